"""TRC files of Motion Analysis and OpenSim: a tab-separated table of markers.

Five lines of header, then a line per frame. Commas between the cells or within the numbers, blank cells,
trailing tabs and counts that are wrong are all found in files of laboratories, and read.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.markers.recording import Markers
from sixpoint.errors import FormatError
from sixpoint.formats.markers.raw import RawMarkers
from sixpoint.formats.markers.times import rate_of_times
from sixpoint.formats.source import parse_cells, read_lines

Array = NDArray[np.float64]

_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?\Z")
_KEYS = ("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units", "OrigDataRate", "OrigDataStartFrame")
_LOOKED = 100  # rows in which decimal commas are looked for
_RATE_OFF = 0.02  # share by which times may differ from the stated rate


def read_trc(path: Path) -> RawMarkers:
    """Read a TRC file.

    Raises:
        FormatError: With the line of the first thing that is wrong.
    """
    lines = read_lines(path)
    start = next((k for k, text in enumerate(lines) if _is_names(text)), -1)
    if start < 0 or not any("PathFileType" in text or "DataRate" in text for text in lines[: start or 1]):
        raise FormatError(
            path, "not a TRC file: a line that begins with Frame# and Time must name the markers", line=1
        )
    separator = "\t" if "\t" in lines[start] else "," if "," in lines[start] else None
    header = _read_header(lines[:start], separator)
    notes: list[str] = []
    first = _first_row(lines, start + 1, separator)
    names = _read_names(path, lines, start, first, separator)
    numbers, times, positions = _read_rows(path, lines, first, separator, names, start + 1)
    for key, count, what in (("NumMarkers", len(names), "markers"), ("NumFrames", len(times), "frames")):
        stated = header.get(key.lower(), "")
        if _number(stated) != count:
            notes.append(f"the header states {stated or 'no'} {what}, the table has {count}")
    if len(numbers) > 1 and np.any(np.diff(numbers) != 1):
        k = int(np.argmax(np.diff(numbers) != 1))
        notes.append(
            f"frame numbers jump from {numbers[k]:g} to {numbers[k + 1]:g}; frames are taken as they come"
        )
    rate = _find_rate(header, times, notes)
    return RawMarkers(names, positions, rate, unit=header.get("units", ""), usual_up="y", notes=notes)


def _is_names(text: str) -> bool:
    return re.match(r'\s*"?frame\s*#?"?\s*[\t, ]\s*"?time', text, re.IGNORECASE) is not None


def _cells(text: str, separator: str | None) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in text.split(separator)]


def _read_header(lines: Sequence[str], separator: str | None) -> dict[str, str]:
    """Values of the header by key in lower case."""
    for keys, values in pairwise(lines):
        names = [name.lower() for name in _cells(keys, separator)]
        if "datarate" in names or "numframes" in names:
            return dict(zip(names, _cells(values, separator), strict=False))
    return {}


def _first_row(lines: Sequence[str], after: int, separator: str | None) -> int:
    """The line where the numbers begin: after that of X1, Y1, ... and blank ones."""
    for k in range(after, len(lines)):
        cells = [cell for cell in _cells(lines[k], separator) if cell]
        if cells and not re.fullmatch(r"[XYZxyz]\s*\d*", cells[0]):
            return k
    return len(lines)


def _read_names(path: Path, lines: Sequence[str], start: int, first: int, separator: str | None) -> list[str]:
    """Labels; each is followed by two empty cells, but often by one or by none."""
    cells = _cells(lines[start], separator)[2:]
    names = [cell for cell in cells if cell]
    axes = [c for text in lines[start + 1 : first] for c in _cells(text, separator) if c]
    count = len(axes) // 3
    if count and len(axes) % 3 == 0 and len(names) < count:
        spread = (cells + [""] * (3 * count))[: 3 * count : 3]
        if sum(bool(name) for name in spread) == len(names):  # unlabelled markers between labelled ones
            names = spread
    if not names:
        raise FormatError(
            path, "no markers are named", line=start + 1, expected="labels after Frame# and Time"
        )
    if count and len(names) != count:
        raise FormatError(
            path,
            f"{len(names)} labels for {count} columns of X, Y and Z",
            line=start + 1,
            got=" ".join(names),
        )
    return names


def _read_rows(
    path: Path, lines: Sequence[str], first: int, separator: str | None, names: list[str], header: int
) -> tuple[Array, Array, Array]:
    """Frame numbers (F,), times (F,) and positions (F, M, 3)."""
    width = 2 + 3 * len(names)
    rows, places = [], []
    for k in range(first, len(lines)):
        cells = _cells(lines[k], separator)
        if not any(cells):
            continue
        while len(cells) > width and not cells[-1]:
            cells.pop()
        if len(cells) > width or (len(cells) < width and (len(cells) - 2) % 3 and any(cells[2:])):
            raise FormatError(
                path,
                f"wrong number of cells for {len(names)} markers",
                line=k + 1,
                expected=f"{width}: frame, time and three for each marker",
                got=f"{len(cells)}",
            )
        rows.append(cells + [""] * (width - len(cells)))
        places.append(k + 1)
    if not rows:
        raise FormatError(path, "the table holds no frames", line=header)
    values = _parse(path, rows, places, names, separator)
    return values[:, 0], values[:, 1], values[:, 2:].reshape(len(rows), len(names), 3)


def _parse(
    path: Path, rows: list[list[str]], lines: list[int], names: list[str], separator: str | None
) -> Array:
    if separator != "," and any(_DECIMAL_COMMA.match(c) for row in rows[:_LOOKED] for c in row):
        rows = [[cell.replace(",", ".") for cell in row] for row in rows]

    def what(column: int) -> str:
        return ("a frame number", "a time", f"a coordinate of {names[(column - 2) // 3]}")[min(column, 2)]

    return parse_cells(path, rows, lines, what)


def _number(word: str) -> float:
    try:
        return float(word.replace(",", "."))
    except ValueError:
        return math.nan


def _find_rate(header: dict[str, str], times: Array, notes: list[str]) -> float | None:
    stated = [r for key in ("datarate", "camerarate") if 1e-3 <= (r := _number(header.get(key, ""))) <= 1e6]
    timed = rate_of_times(times)
    if timed is None:
        return stated[0] if stated else None
    if not stated:
        notes.append(f"the header states no rate: {timed:g} Hz by the times")
        return timed
    if abs(timed / stated[0] - 1.0) > _RATE_OFF:
        notes.append(f"the header states {stated[0]:g} Hz, the times say {timed:g} Hz: these are taken")
        return timed
    return stated[0]


def format_trc(markers: Markers, positions: Array, unit: str) -> str:
    """The text of a TRC file.

    Args:
        markers: What is written.
        positions: (F, M, 3) in the file's unit and axes; gaps are blank cells.
        unit: Name of the unit.
    """
    frames, count, rate = len(markers), len(markers.names), f"{markers.rate:.6f}".rstrip("0").rstrip(".")
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{markers.name}.trc",
        "\t".join((*_KEYS, "OrigNumFrames")),
        "\t".join((rate, rate, str(frames), str(count), unit, rate, "1", str(frames))),
        "Frame#\tTime\t" + "\t\t\t".join(_label(name) for name in markers.names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{k + 1}" for k in range(count) for axis in "XYZ"),
        "",
    ]
    row = "%d\t%.9g" + "\t%.9g" * (3 * count)
    for frame, values in enumerate(positions.reshape(frames, -1).tolist()):
        lines.append((row % (frame + 1, frame / markers.rate, *values)).replace("nan", ""))
    return "\n".join(lines) + "\n"


def _label(name: str) -> str:
    return re.sub(r"[\t\r\n]", " ", name)
