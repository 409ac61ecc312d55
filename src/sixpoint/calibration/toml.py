"""Tables of TOML that people may edit: values read with complaints that say where; and written exactly."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.errors import FormatError, listed

Array = NDArray[np.float64]


class TableReader:
    """Values of a table, with the key and what was expected in every complaint."""

    def __init__(self, path: str | Path) -> None:
        self.path = path

    def only(self, table: Mapping[str, Any], where: str, known: Sequence[str] | Mapping[str, Any]) -> None:
        """Refuse keys that are not among the known ones."""
        for key in table:
            if key not in known:
                raise FormatError(self.path, f"unknown key {where}{key}", expected=f"one of {listed(known)}")

    def table(self, table: Mapping[str, Any], key: str) -> dict[str, Any]:
        """A table under a key; empty where there is none."""
        value = table.get(key, {})
        if not isinstance(value, dict):
            raise FormatError(self.path, key, expected="a table", got=repr(value))
        return dict(value)

    def number(
        self, table: Mapping[str, Any], key: str, low: float, high: float, what: str, where: str = ""
    ) -> float:
        """A number within a range."""
        value = table.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise FormatError(self.path, f"{where}{key}", expected=what, got=repr(value))
        return float(value)

    def numbers(self, table: Mapping[str, Any], key: str, size: int, most: float, where: str) -> Array:
        """Some numbers, none beyond ``most`` either way."""
        value = table.get(key)
        what = f"{size} numbers from {-most:g} to {most:g}"
        if not isinstance(value, list) or len(value) != size:
            raise FormatError(self.path, f"{where}{key}", expected=what, got=repr(value))
        return np.array(
            [self.number({key: v}, key, -most, most, what, where) for v in value],
        )


def toml_key(name: str) -> str:
    """A key, quoted where it must be."""
    return name if name.replace("_", "").isalnum() and name.isascii() else toml_text(name)


def toml_text(value: str) -> str:
    """A TOML basic string: JSON's escapes are TOML's, but for DEL."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def toml_number(value: float) -> str:
    """A number that reads back to the last bit."""
    return repr(float(value))


def toml_numbers(values: Array) -> str:
    """Numbers as an array."""
    return "[" + ", ".join(toml_number(v) for v in values) + "]"
