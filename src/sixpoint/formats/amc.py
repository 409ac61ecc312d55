"""AMC files (Acclaim motions) to motions on the skeleton of an ASF file.

An AMC has neither skeleton nor frame rate. The ASF is looked for beside it; the rate is 120 Hz, as in the
CMU database, unless given or noted by our own writer (``# rate 60``).
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.motion import FileSpace, Motion
from sixpoint.errors import FormatError, listed
from sixpoint.formats.amc_frames import Frames, read_amc
from sixpoint.formats.asf import AcclaimRig, read_asf
from sixpoint.formats.source import read_lines
from sixpoint.formats.translations import fold_translations

Array = NDArray[np.float64]

DEFAULT_RATE = 120.0

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
