"""Reading a text file so that every mistake in it has a line number.

Readers take the whole file at once, work on lists of lines and convert numbers in bulk; only when the
bulk conversion fails is the guilty line looked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.errors import FormatError

Array = NDArray[np.float64]

LARGEST = 1e12
"""Numbers beyond this are taken for damage."""


def read_bytes(path: Path) -> bytes:
    """The whole file.

    Raises:
        FormatError: It is missing, a folder, unreadable or empty.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise FormatError(path, "no such file") from None
    except (IsADirectoryError, PermissionError) as error:
        reason = "this is a folder, not a file" if path.is_dir() else f"cannot be read: {error.strerror}"
        raise FormatError(path, reason) from None
    except (OSError, ValueError) as error:
        raise FormatError(path, f"cannot be read: {error}") from None
    if not data.strip():
        raise FormatError(path, "the file is empty")
    return data


def read_lines(path: Path) -> list[str]:
    """The lines of a text file, whatever its line ends; line k has the number k + 1.

    Raises:
        FormatError: As ``read_bytes``, or the file is binary.
    """
    data = read_bytes(path)
    if b"\0" in data:
        raise FormatError(path, "this is not a plain text file (it holds zero bytes; save it as UTF-8 text)")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")  # names in an old code page; the numbers are the same
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def parse_number(path: Path, line: int, word: str, what: str) -> float:
    """One finite number of sane size.

    Raises:
        FormatError: With the line, and ``what`` was expected there.
    """
    try:
        value = float(word)
    except ValueError:
        raise FormatError(path, "not a number", line=line, expected=what, got=word) from None
    if not (math.isfinite(value) and abs(value) <= LARGEST):
        raise FormatError(path, "number is not finite or far too large", line=line, expected=what, got=word)
    return value


def parse_numbers(path: Path, line: int, words: Sequence[str], count: int, what: str) -> Array:
    """Exactly ``count`` numbers, shape (count,)."""
    if len(words) != count:
        raise FormatError(
            path,
            f"wrong number of values for {what}",
            line=line,
            expected=f"{count} numbers",
            got=" ".join(words) or "none",
        )
    return np.array([parse_number(path, line, word, what) for word in words])


def parse_rows(path: Path, rows: Sequence[Sequence[str]], lines: Sequence[int], what: str) -> Array:
    """Rows of equal length to an array (rows, columns), fast.

    Args:
        path: For messages.
        rows: Words of each row.
        lines: Line number of each row.
        what: What a number is, for messages.
    """
    try:
        values = np.array(rows, dtype=np.float64)
    except (ValueError, OverflowError):
        values = None
    if values is not None and bool(np.all(np.abs(values) <= LARGEST)):  # also false for NaN
        return values
    for row, line in zip(rows, lines, strict=True):
        for word in row:
            parse_number(path, line, word, what)
    raise FormatError(path, f"the numbers cannot be read as {what}")


def parse_cells(
    path: Path, rows: Sequence[Sequence[str]], lines: Sequence[int], what: Callable[[int], str]
) -> Array:
    """Rows of a table to an array (rows, columns), fast; an empty cell is NaN, and so is "nan".

    Args:
        path: For messages.
        rows: Cells of each row, as many in each.
        lines: Line number of each row.
        what: Column -> what is expected there, for messages.
    """
    cells = [[cell or "nan" for cell in row] for row in rows]
    try:
        values = np.array(cells, dtype=np.float64)
    except (ValueError, OverflowError):
        values = None
    if values is not None and not np.any(np.abs(values) > LARGEST):
        return values
    for row, line in zip(cells, lines, strict=True):
        for column, cell in enumerate(row):
            if cell.lower().lstrip("+-") != "nan":
                parse_number(path, line, cell, what(column))
    raise FormatError(path, "the numbers cannot be read", line=lines[0])
