"""A mapping names the joints of a rig by hand: role -> joint name, as a dict or a TOML file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from sixpoint.body.tables import read_table
from sixpoint.errors import FigureError, FormatError


def read_mapping(mapping: Mapping[str, str] | str | Path | None) -> dict[str, str]:
    """A mapping as a dict.

    Args:
        mapping: The dict itself, or a TOML file that holds it at top level or under ``[roles]``.

    Raises:
        FigureError: A role of the dict does not name one joint.
        FormatError: The file cannot be read, or a role in it does not name one joint.
    """
    if mapping is None:
        return {}
    if isinstance(mapping, Mapping):
        wrong = [str(key) for key, value in mapping.items() if not isinstance(value, str)]
        if wrong:
            raise FigureError(f"each role names one joint; not so at {', '.join(wrong)}")
        return dict(mapping)
    table = read_table(mapping)
    table = table.get("roles", table)
    if not isinstance(table, dict):
        raise FormatError(mapping, '[roles] must be a table of role = "joint name"')
    wrong = [key for key, value in table.items() if not isinstance(value, str)]
    if wrong:
        raise FormatError(mapping, f"each role names one joint; not so at {', '.join(wrong)}")
    return dict(table)
