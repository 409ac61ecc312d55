"""BVH files to motions and back.

The rig frames of the joints are the file's: zero angles are the identity rotation. Position channels
*replace* a joint's offset; where they never change they become the offset. Each joint keeps its own Euler
order on reading; writing uses one order for all.

Reference: Meredith and Maddock, Motion capture file formats explained, 2001.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.motion import FileSpace, Motion
from sixpoint.errors import FormatError
from sixpoint.formats.bvh_hierarchy import Hierarchy, read_hierarchy, rotation_order
from sixpoint.formats.source import parse_number, parse_rows, read_lines
from sixpoint.formats.translations import fold_translations

Array = NDArray[np.float64]

RAW = FileSpace(1.0, "y", "file", "file")

_FRAMES = re.compile(r"\s*frames\s*:?\s*(\S*)\s*\Z", re.IGNORECASE)
_FRAME_TIME = re.compile(r"\s*frame\s*time\s*:?\s*(\S*)\s*\Z", re.IGNORECASE)


def read_bvh(path: Path) -> Motion:
    """Read a BVH file in its own unit and axes.

    Raises:
        FormatError: With the line of the first thing that is wrong.
    """
    lines = read_lines(path)
    hierarchy = read_hierarchy(path, lines)
    header = _read_header(path, lines, hierarchy.end + 1)
    values = _read_frames(path, lines, header, sum(map(len, hierarchy.channels)))
    return _assemble(path, hierarchy, values, header.rate)


@dataclass(frozen=True)
class _Header:
    """The two lines after MOTION; ``start`` is the index of the line behind them."""

    frames: int
    rate: float
    line: int
    start: int


def _read_header(path: Path, lines: Sequence[str], start: int) -> _Header:
    filled = [k for k in range(start, len(lines)) if lines[k].strip()][:2]
    texts = [(k + 1, lines[k]) for k in filled] + [(len(lines), "")] * (2 - len(filled))
    (count_line, count_text), (time_line, time_text) = texts
    count, time = _FRAMES.match(count_text), _FRAME_TIME.match(time_text)
    if not count or not re.fullmatch(r"\d{1,9}", count[1]):
        raise FormatError(
            path, "bad frame count", line=count_line, expected="Frames: <n>", got=count_text.strip()
        )
    if not time or not time[1]:
        raise FormatError(
            path, "bad frame time", line=time_line, expected="Frame Time: <s>", got=time_text.strip()
        )
    return _Header(int(count[1]), _read_rate(path, time_line, time[1]), count_line, filled[1] + 1)


def _read_rate(path: Path, line: int, word: str) -> float:
    """Frames per second; 0.0083333 s is 120 Hz, as far as its decimals can tell."""
    time = parse_number(path, line, word, "frame time [s]")
    if not 1e-9 <= time <= 1e9:
        raise FormatError(path, "the frame time must be positive", line=line, expected="seconds", got=word)
    rate = 1.0 / time
    whole = max(round(rate), 1)
    try:
        exponent = Decimal(word).as_tuple().exponent
    except InvalidOperation:
        return rate
    half_digit = 0.5 * 10.0**exponent if isinstance(exponent, int) else 0.0
    if abs(1.0 / whole - time) <= half_digit * 1.001 and abs(whole - rate) < 1e-3 * rate:
        return float(whole)
    return rate


def _read_frames(path: Path, lines: Sequence[str], header: _Header, channels: int) -> Array:
    numbers = [k for k in range(header.start, len(lines)) if lines[k].strip()]
    rows = [lines[k].split() for k in numbers]
    if channels == 0:
        raise FormatError(path, "no joint has any CHANNELS: nothing can move", line=header.line)
    for k, row in zip(numbers, rows, strict=True):
        if len(row) != channels:
            last = k == numbers[-1]
            raise FormatError(
                path,
                "the last frame is incomplete: truncated?" if last else "wrong number of values in a frame",
                line=k + 1,
                expected=f"{channels} numbers",
                got=f"{len(row)}",
            )
    if len(rows) < header.frames or not rows:
        raise FormatError(
            path,
            f"fewer frames than declared in line {header.line}: the file is truncated; if these are all, "
            f"write Frames: {len(rows)}"
            if rows
            else "the file holds no frames",
            line=numbers[-1] + 1 if rows else header.line,
            expected=f"{header.frames} frames",
            got=f"{len(rows)}",
        )
    if len(rows) > header.frames:
        warnings.warn(
            f"{path}:{header.line}: {header.frames} frames declared, but the file holds {len(rows)}; "
            "all are read",
            stacklevel=4,
        )
    return parse_rows(path, rows, [k + 1 for k in numbers], "frame values")


def _common_order(hierarchy: Hierarchy) -> str:
    """The Euler order of the first joint with three angles; writing uses one order for all."""
    orders = (rotation_order(channels) for channels in hierarchy.channels)
    return next((order for order in orders if len(set(order)) == 3), RAW.order)


def _assemble(path: Path, hierarchy: Hierarchy, values: Array, rate: float) -> Motion:
    skeleton = hierarchy.skeleton
    frames = len(values)
    rotations = np.tile(rot.IDENTITY, (frames, len(skeleton), 1))
    positions: dict[int, Array] = {0: np.tile(skeleton.offsets[0], (frames, 1))}
    start = 0
    for joint, channels in enumerate(hierarchy.channels):
        columns = values[:, start : start + len(channels)]
        start += len(channels)
        turning = [k for k, name in enumerate(channels) if name.endswith("rotation")]
        placing = [k for k, name in enumerate(channels) if name.endswith("position")]
        if turning:
            rotations[:, joint] = rot.from_euler(rotation_order(channels), np.deg2rad(columns[:, turning]))
        if placing:
            place = positions.setdefault(joint, np.tile(skeleton.offsets[joint], (frames, 1)))
            place[:, ["XYZ".index(channels[k][0]) for k in placing]] = columns[:, placing]
    root = positions.pop(0)
    placed = fold_translations(skeleton, root, positions)
    return Motion(
        placed.skeleton,
        rotations,
        placed.translations,
        rate,
        moving=placed.moving,
        space=replace(RAW, order=_common_order(hierarchy)),
        name=path.stem,
    )
