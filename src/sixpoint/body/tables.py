"""TOML tables: those that ship with sixpoint, and a user's own."""

from __future__ import annotations

import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

from sixpoint.errors import FormatError


def shipped_text(name: str) -> str:
    """The text of a table of ``body/data``."""
    return resources.files("sixpoint.body").joinpath(f"data/{name}").read_text("utf-8")


def read_shipped(name: str) -> dict[str, Any]:
    """A table of ``body/data``."""
    return tomllib.loads(shipped_text(name))


def read_table(path: str | Path) -> dict[str, Any]:
    """A user's table.

    Raises:
        FormatError: The file cannot be read or is not TOML.
    """
    try:
        return tomllib.loads(Path(path).read_text("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FormatError(path, f"not a TOML file: {error}") from error
    except OSError as error:
        raise FormatError(path, f"cannot be read: {error.strerror}") from error
