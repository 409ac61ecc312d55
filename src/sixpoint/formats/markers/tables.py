"""Markers and landmarks as CSV tables.

The header is one row ``time,LASI_x,LASI_y,LASI_z,...`` or two: the names, each once or over three columns,
and below them ``X,Y,Z``. An empty cell or NaN is a gap, and so is a point whose ``_visibility`` (or
likelihood, confidence, score) is below one half. Lines such as ``# rate 100``, ``# unit mm`` and ``# up z``
above the header say what a table cannot.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.markers.recording import Markers
from sixpoint.errors import FormatError, listed
from sixpoint.formats.markers.raw import RawMarkers
from sixpoint.formats.markers.times import rate_of_times
from sixpoint.formats.source import parse_cells, parse_number, read_lines

Array = NDArray[np.float64]

SEEN = 0.5
"""Visibility below which a landmark is a gap."""

_COMMENT = re.compile(r"#\s*(rate|unit|up)\s*[:=]?\s*(\S+)\s*\Z", re.IGNORECASE)
_COLUMN = re.compile(r"(.+?)[_.:\s]?([xyz])\Z", re.IGNORECASE)
_SCORE = re.compile(r"(.+?)[_.:\s](visibility|likelihood|confidence|score|presence)\Z", re.IGNORECASE)
_TIME = ("time", "time_s", "timestamp", "t")
_FRAME = ("frame", "frame#", "index", "")


def read_marker_csv(path: Path) -> RawMarkers:
    """Read markers from a CSV file.

    Raises:
        FormatError: With the line of the first thing that is wrong.
    """
    said: dict[str, str] = {}
    lines: list[int] = []
    rows: list[list[str]] = []
    for number, text in enumerate(read_lines(path), start=1):
        if text.lstrip().startswith("#") and not rows:
            if match := _COMMENT.match(text.strip()):
                said[match[1].lower()] = match[2]
            continue
        if text.strip(" ,;\t"):
            lines.append(number)
            rows.append([cell.strip().strip('"').strip() for cell in text.split(_separator(text))])
    if len(rows) < 2:
        raise FormatError(
            path, "the table holds no frames", expected="a header time,NAME_x,NAME_y,NAME_z and rows"
        )
    header = rows[0]
    skip = 1
    if _is_axes(rows[1]):
        header, skip = _join_headers(path, rows[0], rows[1], lines[0]), 2
    columns, scores, time = _read_header(path, header, lines[0])
    if len(rows) == skip:
        raise FormatError(path, "the table holds no frames", line=lines[-1])
    values = _parse(path, rows[skip:], lines[skip:], header)
    positions = np.stack([values[:, places] for places in columns.values()], axis=1)
    for k, name in enumerate(columns):
        if name in scores:
            with np.errstate(invalid="ignore"):
                positions[~(values[:, scores[name]] >= SEEN), k] = np.nan
    rate = parse_number(path, 1, said["rate"], "rate [Hz]") if "rate" in said else None
    if rate is None and time is not None:
        rate = rate_of_times(values[:, time])
    up = said.get("up", "").lower().lstrip("+")
    return RawMarkers(list(columns), positions, rate, unit=said.get("unit", ""), up=up)


def find_marker_columns(path: Path) -> set[str]:
    """Names of the points that the first rows of a table seem to speak of, in lower case; none for no table.

    Raises:
        FormatError: The file cannot be read.
    """
    rows = [text for text in read_lines(path) if text.strip() and not text.lstrip().startswith("#")][:2]
    cells = [[cell.strip().strip('"').strip() for cell in text.split(_separator(text))] for text in rows]
    if len(cells) == 2 and _is_axes(cells[1]):
        return {name.lower() for name in cells[0] if name}
    matches = [_COLUMN.match(cell) for cell in cells[0]] if cells else []
    return {match[1].lower().removesuffix("_q") for match in matches if match}


def _separator(text: str) -> str:
    return max(",;\t", key=text.count)


def _is_axes(cells: Sequence[str]) -> bool:
    """Whether a row is X,Y,Z,X,Y,Z,... after at most two other cells."""
    axes = [cell.lower().rstrip("0123456789") for cell in cells if cell]
    while axes and axes[0] not in ("x", "y", "z") and len(axes) % 3:
        axes.pop(0)
    return bool(axes) and axes == ["x", "y", "z"] * (len(axes) // 3)


def _join_headers(path: Path, names: list[str], axes: list[str], line: int) -> list[str]:
    """Names above X, Y, Z -> NAME_x, NAME_y, NAME_z."""
    names = names + [""] * (len(axes) - len(names))
    joined, current = [], ""
    for name, axis in zip(names, axes, strict=False):
        if axis.lower().rstrip("0123456789") not in ("x", "y", "z"):
            joined.append(name or axis)
            continue
        current = name or current
        if not current:
            raise FormatError(path, f"no name above the first column of {axis}", line=line)
        joined.append(f"{current}_{axis[0].lower()}")
    return joined


def _read_header(
    path: Path, header: Sequence[str], line: int
) -> tuple[dict[str, list[int]], dict[str, int], int | None]:
    """Name -> columns of x, y and z; name -> column of its visibility; column of the time."""
    places: dict[str, dict[str, int]] = {}
    scores: dict[str, int] = {}
    time, unknown = None, []
    for k, column in enumerate(header):
        if column.lower() in _TIME:
            time = k
        elif column.lower() in _FRAME:
            continue
        elif match := _SCORE.match(column):
            scores[match[1]] = k
        elif match := _COLUMN.match(column):
            axes = places.setdefault(match[1], {})
            if match[2].lower() in axes:
                raise FormatError(path, f"column {column!r} appears twice", line=line)
            axes[match[2].lower()] = k
        else:
            unknown.append(column)
    if not places:
        raise FormatError(
            path, f"no columns NAME_x, NAME_y, NAME_z; columns: {listed(header, 12)}", line=line
        )
    for name, axes in places.items():
        if len(axes) < 3:
            missing = [f"{name}_{axis}" for axis in "xyz" if axis not in axes]
            raise FormatError(path, f"columns are missing: {listed(missing)}", line=line)
    if unknown:
        raise FormatError(
            path, f"columns that are neither coordinates nor time: {listed(unknown, 12)}", line=line
        )
    return {name: [axes[axis] for axis in "xyz"] for name, axes in places.items()}, scores, time


def _parse(path: Path, rows: Sequence[list[str]], lines: Sequence[int], header: Sequence[str]) -> Array:
    width = len(header)
    for row, line in zip(rows, lines, strict=True):
        while len(row) > width and not row[-1]:
            row.pop()
        if len(row) != width:
            raise FormatError(
                path, "wrong number of cells", line=line, expected=f"{width}", got=f"{len(row)}"
            )
    return parse_cells(path, rows, lines, lambda column: f"a number for {header[column]}")


def format_marker_csv(markers: Markers, positions: Array, unit: str, up: str) -> str:
    """The text of a CSV file with one row of header.

    Args:
        markers: What is written.
        positions: (F, M, 3) in the file's unit and axes; gaps are empty cells.
        unit: Name of the unit, or metres per unit.
        up: Up axis of the file.
    """
    names = [re.sub(r"[,;\t\r\n\"]", " ", name) for name in markers.names]
    columns = ["time", *(f"{name}_{axis}" for name in names for axis in "xyz")]
    lines = [f"# rate {markers.rate!r}", f"# unit {unit}", f"# up {up}", ",".join(columns)]
    row = "%.9f" + ",%.9g" * (3 * len(names))
    for frame, values in enumerate(positions.reshape(len(markers), -1).tolist()):
        lines.append((row % (frame / markers.rate, *values)).replace("nan", ""))
    return "\n".join(lines) + "\n"
