"""AMC files (Acclaim motions) to motions on the skeleton of an ASF file.

An AMC has neither skeleton nor frame rate. The ASF is looked for beside it; the rate is 120 Hz, as in the
CMU database, unless given or noted by our own writer (``# rate 60``). All frames normally list the same
bones, so the numbers of one bone are converted in one go over all frames; files that do not fit are read
line by line, which finds the line to complain about.
"""

from __future__ import annotations

import logging
import math
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.motion import FileSpace, Motion
from sixpoint.errors import FormatError, listed
from sixpoint.formats.asf import AcclaimRig, read_asf
from sixpoint.formats.source import parse_number, parse_rows, read_lines
from sixpoint.formats.translations import fold_translations

Array = NDArray[np.float64]

DEFAULT_RATE = 120.0

_RATE = re.compile(r"#\s*rate\s+(\S+)\s*\Z")
_LOG = logging.getLogger("sixpoint")


def find_skeleton(path: str | Path) -> Path:
    """The ASF file that belongs to an AMC file.

    Looked for beside it: the same stem, else the subject before the first underscore (``17_10.amc`` ->
    ``17.asf``), else the only ASF in the folder.

    Raises:
        FormatError: There is none, or more than one; the message lists the candidates.
    """
    path = Path(path)
    try:
        found = sorted(p for p in path.parent.iterdir() if p.suffix.lower() == ".asf" and p.is_file())
    except (OSError, ValueError):
        found = []
    stem = path.stem.lower()
    for wanted in (stem, stem.split("_")[0]):
        for candidate in found:
            if candidate.stem.lower() == wanted:
                return candidate
    if len(found) == 1:
        return found[0]
    candidates = f"candidates: {listed([p.name for p in found])}" if found else "there is no .asf beside it"
    raise FormatError(
        path, f"an AMC file needs its skeleton ({candidates}); name it with --skeleton FILE.asf / skeleton="
    )


def read_acclaim(path: Path, skeleton: str | Path | None = None, rate: float | None = None) -> Motion:
    """Read an AMC file in the unit of its ASF, or an ASF alone as one frame of its rest pose.

    Args:
        path: The .amc or .asf file.
        skeleton: The ASF of an AMC; searched beside it by default.
        rate: Frames per second [Hz]; by default what the file notes, else 120.

    Raises:
        FormatError: With the line of the first thing that is wrong.
    """
    if path.suffix.lower() == ".asf":
        return _rest_motion(read_asf(path), rate or DEFAULT_RATE)
    lines = read_lines(path)
    if skeleton is None:
        skeleton = find_skeleton(path)
        _LOG.info("%s: skeleton %s", path, skeleton)
    rig = read_asf(Path(skeleton))
    frames = read_amc(path, lines, rig)
    return _assemble(path, rig, frames, rate or frames.rate or DEFAULT_RATE)


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
        if not np.all(np.abs(values[name]) <= 1e12):
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


def _rest_motion(rig: AcclaimRig, rate: float) -> Motion:
    rotations = np.tile(rot.IDENTITY, (1, len(rig.skeleton), 1))
    place = rig.skeleton.offsets[0].reshape(1, 1, 3)
    return Motion(rig.skeleton, rotations, place, rate, dofs=rig.dofs, space=_space(rig), name=rig.name)


def _space(rig: AcclaimRig) -> FileSpace:
    return FileSpace(rig.unit, "y", "file", "convention")


def _assemble(path: Path, rig: AcclaimRig, frames: Frames, rate: float) -> Motion:
    skeleton = rig.skeleton
    count = len(frames.values["root"])
    rotations = np.tile(rot.IDENTITY, (count, len(skeleton), 1))
    scale = math.radians(1.0) if frames.degrees else 1.0
    columns = dict(zip(rig.root.order, frames.values["root"].T, strict=True))
    root = np.tile(skeleton.offsets[0], (count, 1))
    for k, channel in enumerate(("TX", "TY", "TZ")):
        if channel in columns:
            root[:, k] = columns[channel]
    turned = {name[1].lower(): column * scale for name, column in columns.items() if name[0] == "R"}
    rotations[:, 0] = _compute_rotations(rig.root.frame, rig.root.turns, turned, count)
    positions: dict[int, Array] = {}
    for name, values in frames.values.items():
        if name == "root":
            continue
        bone, joint = rig.bones[name], rig.joints[name]
        named = dict(zip(bone.dofs, values.T, strict=True))
        turned = {axis: named[f"r{axis}"] * scale for axis in bone.turns}
        rotations[:, joint] = _compute_rotations(bone.frame, bone.turns, turned, count)
        shift = np.stack([named.get(f"t{axis}", np.zeros(count)) for axis in "xyz"], axis=1)
        if shift.any():
            _move(positions, skeleton.offsets, joint, rot.mul_vec(bone.frame, shift))
        if "l" in named and named["l"].any():
            stretch = named["l"][:, None] * rot.unit(bone.vector)
            for child in skeleton.children[joint]:
                _move(positions, skeleton.offsets, child, stretch)
    placed = fold_translations(skeleton, root, positions)
    return Motion(
        placed.skeleton,
        rotations,
        placed.translations,
        rate,
        moving=placed.moving,
        dofs=rig.dofs,
        space=_space(rig),
        name=path.stem,
    )


def _move(positions: dict[int, Array], offsets: Array, joint: int, shift: Array) -> None:
    """Add (F, 3) to the local position of a joint."""
    positions[joint] = positions.get(joint, offsets[joint]) + shift


def _compute_rotations(frame: Array, turns: Sequence[str], angles: dict[str, Array], count: int) -> Array:
    """Local rotations (F, 4): C M C^-1, where M applies the turns in order about fixed axes."""
    if not turns:
        return np.tile(rot.IDENTITY, (count, 1))
    order = "".join(reversed(turns)).upper()  # the same as intrinsic turns in reverse
    moved = rot.from_euler(order, np.stack([angles[axis] for axis in reversed(turns)], axis=1))
    return rot.mul(frame, rot.mul(moved, rot.inv(frame)))
