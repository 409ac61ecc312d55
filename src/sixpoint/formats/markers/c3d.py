"""C3D files: points, residuals and events of motion capture systems.

Float and integer files of all three processors are read; their analog channels are skipped. Angles, forces
and other results of models that share the list of points are left out.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.markers.recording import Event
from sixpoint.errors import FormatError, listed
from sixpoint.formats.markers.c3d_sections import (
    BLOCK,
    Header,
    Parameters,
    decode_floats,
    decode_integers,
    numbers,
    read_header,
    read_parameters,
    texts,
)
from sixpoint.formats.markers.raw import RawMarkers
from sixpoint.formats.source import read_bytes

Array = NDArray[np.float64]

_NO_POSITIONS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
_AXIS = re.compile(r"([+-]?)([xyz])([+-]?)\Z")  # "+Z" in most files, "Z" or "Z+" in some


def read_c3d(path: Path) -> RawMarkers:
    """Read the points of a C3D file.

    Raises:
        FormatError: It is no C3D file, is damaged or cut, or holds no points.
    """
    data = read_bytes(path)
    header = read_header(path, data)
    parameters = read_parameters(path, data, header.processor)
    notes: list[str] = []
    used = numbers(parameters, "POINT", "USED")
    if header.points == 0:
        channels = numbers(parameters, "ANALOG", "USED") or [header.analogs]
        raise FormatError(
            path, f"the file holds no points, only {int(channels[0])} analog channels: no markers"
        )
    if used and int(used[0]) & 0xFFFF != header.points:
        notes.append(
            f"POINT:USED says {int(used[0]) & 0xFFFF} points, the header {header.points}: the header's"
        )
    positions, residuals = _read_points(path, data, header, parameters)
    rate = _find_rate(header, parameters)
    names = texts(parameters, "POINT", "LABELS")
    if not names:
        notes.append("the points have no labels (POINT:LABELS); they are numbered")
        names = [f"M{k + 1:03d}" for k in range(header.points)]
    names = (names + [""] * header.points)[: header.points]
    keep = _keep_positions(names, parameters, notes)
    if not keep:
        raise FormatError(path, "all points are angles, forces or other results of models: no markers")
    first = _first_frame(header, parameters)
    descriptions = texts(parameters, "POINT", "DESCRIPTIONS") + [""] * header.points
    return RawMarkers(
        _tell_apart([names[k] for k in keep], [descriptions[k].strip() for k in keep], notes),
        positions[:, keep],
        rate,
        residuals[:, keep],
        _read_events(header, parameters, first, rate),
        (texts(parameters, "POINT", "UNITS") or [""])[0].strip(),
        _read_axis(parameters),
        "z",
        notes,
    )


def _read_axis(parameters: Parameters) -> str:
    """The axis that points up on the screen; empty where the file does not say."""
    match = _AXIS.match((texts(parameters, "POINT", "Y_SCREEN") or [""])[0].strip().lower())
    return ("-" if "-" in match[1] + match[3] else "") + match[2] if match else ""


def _find_rate(header: Header, parameters: Parameters) -> float | None:
    for rate in (*numbers(parameters, "POINT", "RATE")[:1], header.rate):
        if 1e-3 <= rate <= 1e6:
            return rate
    return None


def _first_frame(header: Header, parameters: Parameters) -> int:
    return _long(numbers(parameters, "TRIAL", "ACTUAL_START_FIELD")) or header.first


def _long(words: list[float]) -> int:
    """A 32-bit number kept as two 16-bit ones, the lower first; 0 where there is none."""
    return (int(words[0]) & 0xFFFF) + ((int(words[1]) & 0xFFFF) << 16) if len(words) >= 2 else 0


def _count_frames(path: Path, header: Header, parameters: Parameters, room: int) -> int:
    """Frames of the file: the first of the places that say so and that the file has room for."""
    last = _long(numbers(parameters, "TRIAL", "ACTUAL_END_FIELD"))
    long_frames = numbers(parameters, "POINT", "LONG_FRAMES")
    frames = numbers(parameters, "POINT", "FRAMES")
    stated = [
        last - _first_frame(header, parameters) + 1 if last else 0,
        int(long_frames[0]) if long_frames and np.isfinite(long_frames[0]) else 0,
        header.last - header.first + 1 if header.last < 0xFFFF else 0,
        int(frames[0]) & 0xFFFF if frames else 0,
        header.last - header.first + 1,
    ]
    stated = [count for count in stated if count > 0]
    for count in stated:
        if count <= room:
            return count
    if not stated:
        raise FormatError(path, f"the file has no frames (first {header.first}, last {header.last})")
    raise FormatError(path, f"the file is cut: {stated[0]} frames are stated and there is room for {room}")


def _read_points(path: Path, data: bytes, header: Header, parameters: Parameters) -> tuple[Array, Array]:
    """Positions (F, N, 3) and residuals (F, N) in file units; NaN where a point is not valid."""
    stated = numbers(parameters, "POINT", "SCALE")
    scale = stated[0] if stated and np.isfinite(stated[0]) and stated[0] else header.scale
    if not np.isfinite(scale) or scale == 0:
        raise FormatError(path, f"the scale of the points is {scale}: the file is damaged")
    floats = scale < 0
    start = header.start or int((numbers(parameters, "POINT", "DATA_START") or [0])[0])
    begin = (start - 1) * BLOCK
    width = 4 * header.points + header.analogs
    size = 4 if floats else 2
    if begin < BLOCK or begin >= len(data):
        raise FormatError(path, f"the data are said to begin in block {start} of {len(data) // BLOCK}")
    frames = _count_frames(path, header, parameters, (len(data) - begin) // (width * size))
    chunk = data[begin : begin + frames * width * size]
    points = 4 * header.points
    if floats:
        values = decode_floats(chunk, header.processor).reshape(frames, width)[:, :points]
        values = values.reshape(frames, header.points, 4)
        positions, fourth = values[..., :3].copy(), values[..., 3]
        valid = np.abs(fourth) < 32768
        masks = np.where(valid, fourth, -1.0).astype(np.int16)
    else:
        integers = decode_integers(chunk, header.processor).reshape(frames, width)[:, :points]
        integers = integers.reshape(frames, header.points, 4)
        positions, masks = integers[..., :3].astype(np.float64) * scale, integers[..., 3]
    # The upper byte of the fourth word says which cameras saw the point.
    residuals = (masks & 0xFF).astype(np.float64) * abs(scale)
    positions[masks < 0] = np.nan
    return positions, residuals


def _tell_apart(names: list[str], descriptions: list[str], notes: list[str]) -> list[str]:
    """Labels that repeat, replaced by their descriptions where these differ.

    Systems of the time when a label had four letters call both sides of a knee RKNE, and describe them as
    R.Knee and R.Knee.Medial.
    """
    taken, found, said = set(names), list(names), []
    for name in dict.fromkeys(names):
        places = [k for k, other in enumerate(names) if other == name]
        fresh = [descriptions[k] for k in places]
        if name and len(places) > 1 and all(fresh) and len({*fresh, *taken}) == len(fresh) + len(taken):
            for k, text in zip(places, fresh, strict=True):
                found[k] = text
            taken.update(fresh)
            said.append(f"{name} ({', '.join(fresh)})")
    if said:
        notes.append(f"labels that repeat are called as they are described: {listed(said, 8)}")
    return found


def _keep_positions(names: list[str], parameters: Parameters, notes: list[str]) -> list[int]:
    """Columns that are positions; POINT:ANGLES and its like name those that are not."""
    left_out = {name for kind in _NO_POSITIONS for name in texts(parameters, "POINT", kind) if name}
    keep = [k for k, name in enumerate(names) if name not in left_out]
    if len(keep) < len(names):
        notes.append(
            f"{len(names) - len(keep)} points are angles, forces or other results of models: left out"
        )
    return keep


def _read_events(header: Header, parameters: Parameters, first: int, rate: float | None) -> tuple[Event, ...]:
    """Events in order of time; EVENT:TIMES are minutes and seconds since frame 1."""
    start = (first - 1) / rate if rate else 0.0
    pairs = numbers(parameters, "EVENT", "TIMES")
    times = [60.0 * minutes + seconds for minutes, seconds in zip(pairs[::2], pairs[1::2], strict=False)]
    used = numbers(parameters, "EVENT", "USED")
    labels, contexts = texts(parameters, "EVENT", "LABELS"), texts(parameters, "EVENT", "CONTEXTS")
    count = min(len(times), len(labels), int(used[0]) & 0xFFFF if used else len(times))
    contexts += [""] * count
    found = [Event(labels[k], times[k] - start, contexts[k]) for k in range(count) if np.isfinite(times[k])]
    if not found:
        found = [Event(label, time - start) for time, label in header.events]
    return tuple(sorted(found, key=lambda event: event.time))
