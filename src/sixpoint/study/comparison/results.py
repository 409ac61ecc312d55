"""Rows of a comparison as a tidy CSV file: a line per method and clip, columns of plain numbers or text."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from dataclasses import astuple, fields
from pathlib import Path
from typing import Any

from sixpoint.errors import FormatError
from sixpoint.study.comparison.model import Row

VERSION = 2
"""Of the columns; a file of another version is not read."""
COLUMNS = ("format", *(field.name for field in fields(Row)))
HELP = "begin again with --force, or choose another folder with -o"
KINDS = {field.name: {"str": str, "int": int, "float": float}[str(field.type)] for field in fields(Row)}


def rows_to_csv(rows: Iterable[Row]) -> str:
    """The text of a results file; numbers in full, NaN empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows:
        writer.writerow([VERSION, *("" if value != value else value for value in astuple(row))])
    return text.getvalue()


def is_results(path: Path) -> bool:
    """Whether a file looks like a results file, of any version."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            return stream.readline(300).startswith("format,clip,method,")
    except (OSError, UnicodeDecodeError):
        return False


def check_version(path: Path) -> list[list[str]]:
    """The lines of a results file of this version.

    Raises:
        FormatError: It cannot be read, or is of another version.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            lines = list(csv.reader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise FormatError(path, f"cannot be read: {error}") from error
    version = lines[1][0] if len(lines) > 1 and lines[1] else str(VERSION)
    if not lines or version != str(VERSION) or tuple(lines[0]) != COLUMNS:
        raise FormatError(
            path, f"results of another version of sixpoint (format {version}, this one is {VERSION}): {HELP}"
        )
    return lines


def rows_from_csv(path: Path) -> list[Row]:
    """The rows of a results file.

    Raises:
        FormatError: It is of another version, or a line is damaged; the message says which and what helps.
    """
    lines = check_version(path)
    rows = []
    for number, line in enumerate(lines[1:], start=2):
        if len(line) != len(COLUMNS):
            message = f"{len(line)} columns in place of {len(COLUMNS)}: mend the line or {HELP}"
            raise FormatError(path, message, line=number)
        try:
            values: dict[str, Any] = {
                c: _value(c, text) for c, text in zip(COLUMNS[1:], line[1:], strict=True)
            }
            rows.append(Row(**values))
        except ValueError as error:
            raise FormatError(path, f"{error}: mend the line or {HELP}", line=number) from error
    return rows


def _value(column: str, text: str) -> str | int | float:
    kind = KINDS[column]
    if kind is float and text == "":
        return float("nan")
    try:
        return kind(text)  # type: ignore[no-any-return]
    except ValueError:
        raise ValueError(f"{column} must be {kind.__name__}, got {text!r}") from None
