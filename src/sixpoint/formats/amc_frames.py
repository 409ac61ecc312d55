"""The numbers of an AMC file.

All frames normally list the same bones in the same order, so the numbers of one bone are converted in one
go over all frames. Files that do not fit are read line by line, which finds the line to complain about.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.errors import FormatError, listed
from sixpoint.formats.asf import AcclaimRig
from sixpoint.formats.source import LARGEST, parse_number, parse_rows

Array = NDArray[np.float64]

_RATE = re.compile(r"#\s*rate\s+(\S+)\s*\Z")


@dataclass(frozen=True)
class Frames:
    """The numbers of an AMC file.

    Attributes:
        values: Bone -> (F, k) values in the order of its dofs; "root" too.
        degrees: Whether angles are in degrees.
        rate: Frames per second [Hz], None where the file does not note it.
    """

    values: dict[str, Array]
    degrees: bool
    rate: float | None


def read_amc(path: Path, lines: Sequence[str], rig: AcclaimRig) -> Frames:
    """Parse the lines of an AMC file for a rig.

    Raises:
        FormatError: With the line of the first thing that is wrong.
    """
    degrees, rate, start = rig.degrees, None, None
    for number, text in enumerate(lines, start=1):
        word = text.strip()
        if word.upper() in (":DEGREES", ":RADIANS"):
            degrees = word.upper() == ":DEGREES"
        elif _is_frame(word):
            start = number - 1
            break
        elif match := _RATE.match(word):
            rate = _read_rate(path, number, match[1])
        elif word and word[0] not in "#:":
            raise FormatError(path, "not an AMC file", line=number, expected="a frame number", got=word)
    if start is None:
        raise FormatError(path, "the file holds no frames", line=len(lines), expected="a frame number")
    sizes = {"root": len(rig.root.order)} | {n: len(b.dofs) for n, b in rig.bones.items() if b.dofs}
    filled = [(k, text.strip()) for k, text in enumerate(lines[start:], start + 1)]
    texts = [(k, text) for k, text in filled if text and text[0] != "#"]
    values = _read_uniform([text for _, text in texts], sizes)
    return Frames(values if values is not None else _read_by_line(path, texts, sizes), degrees, rate)


def _is_frame(word: str) -> bool:
    return word.isascii() and word.isdigit()


def _read_rate(path: Path, line: int, word: str) -> float:
    rate = parse_number(path, line, word, "rate [Hz]")
    if not 1e-6 <= rate <= 1e6:
        raise FormatError(path, "the rate must be positive", line=line, got=word)
    return rate


def _read_uniform(texts: Sequence[str], sizes: dict[str, int]) -> dict[str, Array] | None:
    """All frames at once where all list the same bones in the same order; None where they do not."""
    period = next((k for k, text in enumerate(texts[1:], 1) if _is_frame(text)), len(texts))
    frames, rest = divmod(len(texts), period)
    names = [text.split()[0] for text in texts[1:period]]
    if rest or sorted(names) != sorted(sizes):
        return None
    numbers = texts[::period]
    if not all(map(_is_frame, numbers)) or any(len(n) > 9 for n in numbers):
        return None
    if np.any(np.diff([int(n) for n in numbers]) != 1):
        return None
    values = {}
    for k, name in enumerate(names, start=1):
        words = " ".join(texts[k::period]).split()
        width = sizes[name] + 1
        if len(words) != frames * width or words[::width].count(name) != frames:
            return None
        del words[::width]
        try:
            values[name] = np.array(words, dtype=np.float64).reshape(frames, width - 1)
        except (ValueError, OverflowError):
            return None
        if not np.all(np.abs(values[name]) <= LARGEST):
            return None
    return values


def _read_by_line(path: Path, texts: Sequence[tuple[int, str]], sizes: dict[str, int]) -> dict[str, Array]:
    """One line after the other; finds what is wrong and where."""
    rows: dict[str, list[list[str]]] = {name: [] for name in sizes}
    places: dict[str, list[int]] = {name: [] for name in sizes}
    frame, previous = 0, None
    for line, text in texts:
        words = text.split()
        if len(words) == 1 and _is_frame(words[0]):
            if frame:
                _check_complete(path, line, previous, rows, frame)
            previous = _check_number(path, line, words[0], previous)
            frame += 1
            continue
        name, *numbers = words
        if name not in sizes:
            raise FormatError(
                path,
                f"the skeleton has no moving bone {name!r}: is this the right ASF? Bones: {listed(sizes)}",
                line=line,
                got=text,
            )
        if len(numbers) != sizes[name]:
            raise FormatError(
                path,
                f"wrong number of values for {name}",
                line=line,
                expected=f"{sizes[name]} numbers",
                got=f"{len(numbers)}",
            )
        if len(rows[name]) == frame:
            raise FormatError(path, f"{name} is listed twice in frame {previous}", line=line, got=text)
        rows[name].append(numbers)
        places[name].append(line)
    _check_complete(path, texts[-1][0], previous, rows, frame)
    return {name: parse_rows(path, rows[name], places[name], f"value of {name}") for name in sizes}


def _check_complete(
    path: Path, line: int, number: int | None, rows: dict[str, list[list[str]]], frame: int
) -> None:
    missing = [name for name, values in rows.items() if len(values) < frame]
    if missing:
        raise FormatError(
            path, f"frame {number} lacks {listed(missing, 5)}: truncated?", line=line, expected="every bone"
        )


def _check_number(path: Path, line: int, word: str, previous: int | None) -> int:
    number = int(word[:18])
    if previous is not None and number <= previous:
        expected = str(previous + 1)
        raise FormatError(path, "frame numbers must increase", line=line, expected=expected, got=word)
    if previous is not None and number != previous + 1:
        warnings.warn(
            f"{path}:{line}: frame {number} follows frame {previous}; frames are taken as consecutive",
            stacklevel=6,
        )
    return number
