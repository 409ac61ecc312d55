"""Between the space of a file and ours: metres, Y up.

BVH states neither unit nor up axis, so both are guessed from the body: a human is about 1.7 m tall and
mostly has the head above the ankles. A Z-up file is turned as a *world*: rig frames and offsets stay as
they are, only the root's rotation and position change.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.motion import FileSpace, Motion
from sixpoint.body.roles import Roles, find_roles
from sixpoint.body.skeleton import Skeleton
from sixpoint.errors import FormatError, SixpointError, listed

Array = NDArray[np.float64]

INCH = 0.0254
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": INCH, "cmu": INCH / 0.45}
"""Metres per file unit by name; "cmu" is the unit of the CMU database."""

UPS = ("y", "z")

_RANGES = (  # stature in file units: from, to, metres per unit
    (0.9, 2.5, UNITS["m"]),
    (25.0, 45.0, UNITS["cmu"]),
    (45.0, 90.0, UNITS["inch"]),
    (90.0, 250.0, UNITS["cm"]),
    (900.0, 2500.0, UNITS["mm"]),
)
_STATURE = 1.7  # [m]
_CLEARLY = 1.3  # one axis is up if it outweighs the other by this factor
_SAMPLES = 300
_LARGEST_RIG = 400  # joints; larger or deeper trees are no human rig and their roles are not looked for
_DEEPEST_RIG = 100

_Y_FROM_Z = np.array([-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])  # (x, y, z) -> (x, z, -y)


def parse_unit(path: Path, unit: str | float) -> float:
    """Metres per file unit from a name of ``UNITS`` or a positive number."""
    try:
        value = UNITS[unit.lower()] if isinstance(unit, str) and unit.lower() in UNITS else float(unit)
    except (TypeError, ValueError):
        value = math.nan
    if not 1e-9 <= value <= 1e9:
        raise FormatError(
            path, f"unknown unit {unit!r}; units: {listed(UNITS)}, or metres per file unit as a number"
        )
    return value


def parse_up(path: Path, up: str) -> str:
    """The up axis, "y" or "z"."""
    if not isinstance(up, str) or up.lower() not in UPS:
        raise FormatError(path, f"unknown up axis {up!r}; axes: {listed(UPS)}")
    return up.lower()


def compute_diameter(skeleton: Skeleton) -> float:
    """Longest way between two points of the tree along its bones, in the skeleton's unit."""
    reach = np.zeros(len(skeleton))  # longest way down from each joint
    longest = 0.0
    lengths = np.linalg.norm(skeleton.offsets, axis=1)
    ends = [
        (int(parent), float(np.linalg.norm(offset)))
        for parent, offset in zip(skeleton.site_parents, skeleton.site_offsets, strict=True)
    ]
    joints = [(int(skeleton.parents[j]), j) for j in range(len(skeleton) - 1, 0, -1)]
    for parent, way in ends:
        longest = max(longest, float(reach[parent]) + way)
        reach[parent] = max(reach[parent], way)
    for parent, joint in joints:
        way = float(reach[joint] + lengths[joint])
        longest = max(longest, float(reach[parent]) + way)
        reach[parent] = max(reach[parent], way)
    return longest


def compute_stature(skeleton: Skeleton, roles: Roles | None) -> float:
    """Rough stature of a figure from its bones, in the skeleton's unit."""
    if roles is None:
        return compute_diameter(skeleton) / 1.45
    rest = _rest_positions(skeleton)
    hip, knee, ankle = (rest[joint[0]] for joint in (roles.hip, roles.knee, roles.ankle))
    leg = float(np.linalg.norm(knee - hip) + np.linalg.norm(ankle - knee))
    drop = abs(float(rot.unit(ankle - hip) @ (hip - rest[roles.pelvis])))
    trunk = float(np.linalg.norm(skeleton.offsets[list(roles.spine)], axis=1).sum())
    return 1.24 * (leg + drop + trunk + float(np.linalg.norm(roles.head_offset)))


def guess_unit(stature: float) -> float:
    """Metres per file unit of a figure with a stature in file units."""
    for least, most, unit in _RANGES:
        if least <= stature < most:
            return unit
    if not (math.isfinite(stature) and stature > 1e-12):
        return UNITS["m"]
    return float(10.0 ** round(math.log10(_STATURE / stature)))


def guess_up(motion: Motion, roles: Roles | None) -> str | None:
    """The axis along which the head is above the ankles; None for a rig without roles."""
    if roles is None:
        return None
    frames = np.unique(np.linspace(0, len(motion) - 1, min(len(motion), _SAMPLES)).astype(int))
    positions, world = motion.skeleton.compute_transforms(
        motion.rotations[frames], motion.translations[frames], motion.moving
    )
    heads = positions[:, roles.head] + rot.mul_vec(world[:, roles.head], roles.head_offset)
    _, y, z = np.mean(heads - positions[:, list(roles.ankle)].mean(axis=1), axis=0)
    if abs(y) > _CLEARLY * abs(z):
        return "y"
    if z > _CLEARLY * abs(y):
        return "z"
    rest = _rest_positions(motion.skeleton)
    _, y, z = rest[roles.head] + np.array(roles.head_offset) - rest[list(roles.ankle)].mean(axis=0)
    return "z" if abs(z) > abs(y) else "y"


def detect_space(path: Path, raw: Motion, unit: str | float | None, up: str | None) -> FileSpace:
    """Unit and up axis of a motion in file units, as far as they are not given."""
    roles = find_human_roles(raw.skeleton) if unit is None or up is None else None
    if unit is None:
        metres, unit_source = guess_unit(compute_stature(raw.skeleton, roles)), "guessed"
    else:
        metres, unit_source = parse_unit(path, unit), "given"
    if up is None:
        guessed = guess_up(raw, roles)
        axis, up_source = guessed or "y", "guessed" if guessed else "convention"
    else:
        axis, up_source = parse_up(path, up), "given"
    return FileSpace(metres, axis, unit_source, up_source, raw.space.order)


def find_human_roles(skeleton: Skeleton) -> Roles | None:
    """Anatomical roles, or None where the rig is not a human's."""
    depth = np.zeros(len(skeleton), int)
    for joint in range(1, len(skeleton)):
        depth[joint] = depth[skeleton.parents[joint]] + 1
    if len(skeleton) > _LARGEST_RIG or depth.max() > _DEEPEST_RIG:
        return None
    try:
        return find_roles(skeleton)
    except SixpointError:
        return None


def enter_world(raw: Motion, space: FileSpace) -> Motion:
    """A motion in file units and file axes -> metres, Y up."""
    motion = _scaled(raw, space.unit)
    if space.up == "z":
        motion = _turned(motion, _Y_FROM_Z)
    return replace(motion, space=space)


def leave_world(motion: Motion, space: FileSpace) -> Motion:
    """The inverse of ``enter_world``: what goes into the file."""
    if space.up == "z":
        motion = _turned(motion, rot.inv(_Y_FROM_Z))
    return replace(_scaled(motion, 1.0 / space.unit), space=space)


def _scaled(motion: Motion, factor: float) -> Motion:
    skeleton = motion.skeleton
    return replace(
        motion,
        skeleton=replace(
            skeleton, offsets=skeleton.offsets * factor, site_offsets=skeleton.site_offsets * factor
        ),
        translations=motion.translations * factor,
    )


def _turned(motion: Motion, turn: Array) -> Motion:
    """The world about the figure turned: only what the root says changes."""
    offsets = motion.skeleton.offsets.copy()
    offsets[0] = rot.mul_vec(turn, offsets[0])
    rotations, translations = motion.rotations.copy(), motion.translations.copy()
    rotations[:, 0] = rot.mul(turn, rotations[:, 0])
    translations[:, 0] = rot.mul_vec(turn, translations[:, 0])
    skeleton = replace(motion.skeleton, offsets=offsets)
    return replace(motion, skeleton=skeleton, rotations=rotations, translations=translations)


def _rest_positions(skeleton: Skeleton) -> Array:
    identity = np.tile(rot.IDENTITY, (len(skeleton), 1))
    return skeleton.compute_transforms(identity)[0]
