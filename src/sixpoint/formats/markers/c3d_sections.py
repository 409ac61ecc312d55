"""Header and parameters of a C3D file, each number checked against the size of the file.

The format: https://www.c3d.org/docs/C3D_User_Guide.pdf. Blocks of 512 bytes are counted from 1; numbers are
those of an Intel, DEC (VAX) or SGI (MIPS) processor. An own reader, because files come from strangers: the
C++ library that we write with may end the whole process on a damaged one.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.errors import FormatError

Array = NDArray[np.float64]

BLOCK = 512
INTEL, DEC, SGI = 84, 85, 86
_MAGIC = 0x50
_SIZES = {-1: 1, 1: 1, 2: 2, 4: 4}

Parameter = list[str] | Array
Parameters = dict[tuple[str, str], Parameter]


@dataclass(frozen=True)
class Header:
    """The first block of a file.

    Attributes:
        points: 3D points per frame.
        analogs: Analog samples per frame, of all channels together.
        first: Number of the first frame.
        last: Number of the last frame; 65535 at most.
        scale: Of integer coordinates; negative where they are floats.
        start: Block where the data begin.
        rate: Frames per second [Hz].
        processor: ``INTEL``, ``DEC`` or ``SGI``.
        events: (time [s], label of at most 4 letters) that old files keep here.
    """

    points: int
    analogs: int
    first: int
    last: int
    scale: float
    start: int
    rate: float
    processor: int
    events: tuple[tuple[float, str], ...]


def read_header(path: Path, data: bytes) -> Header:
    """Read the header; the processor stands at the beginning of the parameters.

    Raises:
        FormatError: This is no C3D file, or it is cut.
    """
    if len(data) < BLOCK or data[1] != _MAGIC:
        raise FormatError(path, "not a C3D file (its second byte is 0x50 and its header has 512 bytes)")
    place = _parameter_place(path, data)
    processor = data[place + 3]
    if processor not in (INTEL, DEC, SGI):
        raise FormatError(path, f"unknown processor type {processor}", expected="84 Intel, 85 DEC or 86 SGI")
    words = decode_integers(data[:BLOCK], processor).astype(int) & 0xFFFF
    scale, rate = decode_floats(data[12:16], processor)[0], decode_floats(data[20:24], processor)[0]
    return Header(
        int(words[1]),
        int(words[2]),
        int(words[3]),
        int(words[4]),
        float(scale),
        int(words[8]),
        float(rate),
        processor,
        _header_events(data, words, processor),
    )


def _header_events(data: bytes, words: NDArray[np.int_], processor: int) -> tuple[tuple[float, str], ...]:
    if words[149] != 12345:
        return ()
    count = min(int(words[150]), 18)
    times = decode_floats(data[304:376], processor)[:count]
    labels = [data[396 + 4 * k : 400 + 4 * k].decode("latin-1").strip(" \0") for k in range(count)]
    return tuple((float(t), label) for t, label in zip(times, labels, strict=True) if np.isfinite(t))


def _parameter_place(path: Path, data: bytes) -> int:
    place = (data[0] - 1) * BLOCK
    if place < BLOCK or place + 4 > len(data):
        blocks = len(data) // BLOCK
        raise FormatError(path, f"damaged: the parameters are said to begin in block {data[0]} of {blocks}")
    return place


def read_parameters(path: Path, data: bytes, processor: int) -> Parameters:
    """All parameters: (group, name) in upper case -> texts, or numbers with their dimensions.

    Raises:
        FormatError: A record reaches beyond the file; the message says where.
    """
    place = _parameter_place(path, data) + 4
    groups: dict[int, str] = {}
    found: dict[tuple[int, str], Parameter] = {}
    while place + 2 <= len(data):
        length, number = abs(_signed(data[place])), _signed(data[place + 1])
        name_end = place + 2 + length
        if length == 0 or number == 0:
            break
        if name_end + 2 > len(data):
            raise FormatError(path, f"the parameters are cut at byte {place}")
        name = data[place + 2 : name_end].decode("latin-1").strip().upper()
        step = int(decode_integers(data[name_end : name_end + 2], processor)[0])
        if number < 0:
            groups.setdefault(-number, name)
        else:
            value = _read_value(path, data, name_end + 2, name, processor)
            found.setdefault((number, name), value)
        if step == 0:
            break
        if step < 2:
            raise FormatError(path, f"parameter {name!r} at byte {place} points back: the file is damaged")
        place = name_end + step
    return {(groups.get(number, f"#{number}"), name): value for (number, name), value in found.items()}


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte


def _read_value(path: Path, data: bytes, place: int, name: str, processor: int) -> Parameter:
    if place + 2 > len(data):
        raise FormatError(path, f"parameter {name!r} is cut at byte {place}")
    kind, dimensions = _signed(data[place]), data[place + 1]
    size = _SIZES.get(kind)
    shape = tuple(data[place + 2 : place + 2 + dimensions])
    begin = place + 2 + dimensions
    count = 1
    for extent in shape:  # at most 255 numbers of at most 255: Python's integers do not overflow
        count *= extent
    if size is None or dimensions > 7 or begin + count * (size or 1) > len(data):
        raise FormatError(
            path, f"parameter {name!r} at byte {place} does not fit into the file: it is damaged"
        )
    chunk = data[begin : begin + count * size]
    if kind == -1:
        width = shape[0] if shape else 1
        texts = [chunk[k : k + width] for k in range(0, len(chunk), width)] if width else []
        return [text.decode("latin-1").strip(" \0") for text in texts]
    if kind == 1:
        values = np.frombuffer(chunk, np.int8).astype(np.float64)
    else:
        values = (decode_integers if kind == 2 else decode_floats)(chunk, processor).astype(np.float64)
    return values.reshape(shape, order="F")


def decode_integers(data: bytes, processor: int) -> NDArray[np.int16]:
    """16-bit integers."""
    return np.frombuffer(data, ">i2" if processor == SGI else "<i2")


def decode_floats(data: bytes, processor: int) -> Array:
    """32-bit floats of one of the three processors, as doubles; what is no number is NaN."""
    if processor == SGI:
        return np.frombuffer(data, ">f4").astype(np.float64)
    if processor == INTEL:
        return np.frombuffer(data, "<f4").astype(np.float64)
    # VAX F-floats are IEEE floats times four with the two words exchanged.
    words = np.frombuffer(data, "<u2").reshape(-1, 2)[:, ::-1].astype("<u2")
    return np.frombuffer(words.tobytes(), "<f4").astype(np.float64) / 4.0


def numbers(parameters: Parameters, group: str, name: str) -> list[float]:
    """A parameter's numbers in one row; empty where there are none."""
    value = parameters.get((group, name))
    return [] if value is None or isinstance(value, list) else [float(v) for v in value.ravel(order="F")]


def texts(parameters: Parameters, group: str, name: str) -> list[str]:
    """A parameter's texts, with those of NAME2, NAME3, ... that hold what is beyond 255."""
    pattern = re.compile(re.escape(name) + r"(\d*)\Z")
    parts = []
    for (owner, full), value in parameters.items():
        match = pattern.match(full)
        if owner == group and match and isinstance(value, list):
            parts.append((int(match[1] or 1), value))
    return [text for _, part in sorted(parts, key=lambda pair: pair[0]) for text in part]
