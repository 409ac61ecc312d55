"""A USD stage as a motion, and its skinned meshes as a surface.

Of a stage the first skeleton with an animation is read, else the first one. Others write otherwise than we
do: frames are turned until the rest pose has identity rotations; uniform, constant scales go into offsets;
several roots hang on one that is added; an animation may name its joints in any order, or only some of them;
and the prims above the skeleton place it in the world.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.motion import FileSpace, Motion
from sixpoint.body.skeleton import Skeleton
from sixpoint.body.surface.shape import Shape
from sixpoint.errors import FormatError
from sixpoint.formats.source import LARGEST, read_bytes
from sixpoint.formats.usd.library import import_usd
from sixpoint.formats.usd.matrices import ALIKE, Similarity, decompose
from sixpoint.formats.usd.mesh import read_shape
from sixpoint.formats.usd.rig import Rig, read_rig
from sixpoint.formats.usd.timing import find_times

Array = NDArray[np.float64]

STILL = 1e-5  # translations that differ by less do not move [of the largest offset]


def read_usd(path: Path) -> tuple[Motion, Shape | None]:
    """Read the first animated skeleton of a stage, and what is skinned to it.

    Returns:
        The motion in the stage's units and axes, which its ``space`` says, and the surface in the same units,
        in a bind pose of its own; None without a skinned mesh. Without an animation the motion is one frame
        of the rest pose.

    Raises:
        FormatError: usd-core is missing, the file is no stage, or has no skeleton that can be read.
    """
    usd = import_usd(path)
    read_bytes(path)
    try:
        return _read(usd, path)
    except usd.Tf.ErrorException as error:
        raise FormatError(path, f"not a USD file, or a damaged one: {_said(error)}") from None


def _read(usd: Any, path: Path) -> tuple[Motion, Shape | None]:
    stage = usd.Usd.Stage.Open(str(path))
    rig, binding = read_rig(usd, stage, path)
    space = FileSpace(
        float(usd.UsdGeom.GetStageMetersPerUnit(stage)),
        "z" if usd.UsdGeom.GetStageUpAxis(stage) == usd.UsdGeom.Tokens.z else "y",
        "file",
        "file",
    )
    if not 1e-9 <= space.unit <= 1e9:
        raise FormatError(path, f"metersPerUnit is {space.unit:g}", expected="metres per unit of the stage")
    local, rate = _read_frames(usd, stage, rig, path)
    sizes = _constant_scales(rig, local, path)
    above = _above(rig, sizes)
    motion = replace(_make_motion(rig, local, above, rate), space=space, name=path.stem)
    return motion, read_shape(usd, rig, binding, path, above * sizes)


def _said(error: Exception) -> str:
    """The sentence in an error of usd-core, which comes with the C++ calls that led to it."""
    try:
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    except UnicodeDecodeError:  # it cites damaged text
        return "it holds bytes that are no text"
    return lines[-1].rpartition(" : ")[2].strip("' ")[:200] if lines else "usd-core cannot read it"


def _make_motion(rig: Rig, local: Similarity, sizes: Array, rate: float) -> Motion:
    """Local transforms (F, J) on a skeleton whose rest pose has identity rotations.

    Args:
        rig: The skeleton of the stage.
        local: In its frames and units.
        sizes: (J,) scale of each joint's parent in the world.
        rate: Frames per second [Hz].
    """
    turned = rot.mul(rig.rest_above, rot.mul(local.rotations, rot.inv(rig.rest_world)))
    places = rot.mul_vec(rig.rest_above, local.translations * sizes[:, None])
    rest = rot.mul_vec(rig.rest_above, rig.rest.translations * sizes[:, None])
    apart = np.abs(places - rest).max(axis=(0, 2))
    drift = np.abs(places - places[:1]).max(axis=(0, 2))
    least = STILL * max(float(np.abs(rest[1:]).max(initial=0.0)), 1e-9)
    offsets = np.where(((apart > least) & (drift <= least))[:, None], places[0], rest)
    moving = (0, *(j for j in range(1, len(rest)) if drift[j] > least))
    skeleton = Skeleton(rig.names, rig.parents, offsets, *rig.sites)
    return Motion(skeleton, rot.normalised(turned), places[:, list(moving)], rate, moving)


def _read_frames(usd: Any, stage: Any, rig: Rig, path: Path) -> tuple[Similarity, float]:
    """Local transforms (F, J) of all joints, the root's in the world, and the rate [Hz]."""
    times, rate = find_times(usd, stage, rig, path)
    return _sample(usd, rig, times, path), rate


def _sample(usd: Any, rig: Rig, times: list[float], path: Path) -> Similarity:
    """Local transforms of all joints (F, J) at times; joints that are not animated rest."""
    shape = (len(times), len(rig.names))
    rotations = np.broadcast_to(rig.rest.rotations, (*shape, 4)).copy()
    translations = np.broadcast_to(rig.rest.translations, (*shape, 3)).copy()
    scales = np.broadcast_to(rig.rest.scales, (*shape, 3)).copy()
    if rig.animation is not None:
        animated = [rig.index.get(str(name)) for name in rig.animation.GetJointOrder()]
        rows = [k for k, joint in enumerate(animated) if joint is not None]
        joints = [joint for joint in animated if joint is not None]
        if not joints:
            raise FormatError(path, f"{rig.animation.GetPrim().GetPath()} animates no joint of {rig.path}")
        for frame, time in enumerate(times):
            moved = rig.animation.ComputeJointLocalTransformComponents(time)
            if not moved or {len(part) for part in moved} != {len(animated)}:
                raise FormatError(
                    path,
                    f"{rig.animation.GetPrim().GetPath()} has not one translation, rotation and scale per "
                    f"joint at time {time:g}",
                )
            translations[frame, joints] = np.asarray(moved[0], float)[rows]
            rotations[frame, joints] = np.asarray(moved[1], float)[rows]
            scales[frame, joints] = np.asarray(moved[2], float)[rows]
    if not all(np.all(np.abs(a) < LARGEST) for a in (rotations, translations, scales)):  # NaN is not
        raise FormatError(
            path, f"the animation of {rig.path} holds numbers that are not finite or far too large"
        )
    _place(usd, rig, times, rotations, translations, scales, path)
    return Similarity(rot.normalised(rotations), translations, scales)


def _place(
    usd: Any, rig: Rig, times: list[float], rotations: Array, translations: Array, scales: Array, path: Path
) -> None:
    """Move the root by what the prims above the skeleton say."""
    world = np.array(
        [
            np.array(usd.UsdGeom.XformCache(time).GetLocalToWorldTransform(rig.prim))
            for time in (times if rig.is_placed_over_time else times[:1])
        ]
    )
    above = decompose(world)
    if above is None or not above.is_uniform.all():
        raise FormatError(path, f"{rig.path} is sheared, mirrored or scaled unevenly by the prims above it")
    size = above.scales.mean(axis=-1, keepdims=True)
    translations[:, 0] = above.translations + rot.mul_vec(above.rotations, size * translations[:, 0])
    rotations[:, 0] = rot.mul(above.rotations, rotations[:, 0])
    scales[:, 0] = scales[:, 0] * size


def _constant_scales(rig: Rig, local: Similarity, path: Path) -> Array:
    """(J,) the scale of each joint, the same along all axes and in all frames."""
    means = local.scales.mean(axis=0)
    wrong = np.abs(local.scales - means).max(axis=(0, 2)) > ALIKE * np.abs(means).max(axis=1)
    even = Similarity(local.rotations[0], local.translations[0], means).is_uniform
    bad = [rig.names[j] for j in np.flatnonzero(wrong | ~even)]
    if bad:
        raise FormatError(
            path,
            f"the joint {bad[0]!r} is scaled over time, unevenly or to nothing; scales have to be constant "
            "and the same along all axes",
        )
    size = means.mean(axis=1)
    return np.where(np.abs(size - 1.0) < ALIKE / 4, 1.0, size)  # a half float's one


def _above(rig: Rig, scales: Array) -> Array:
    """(J,) product of the scales of all joints above each."""
    whole = np.ones(len(scales))
    for joint, parent in enumerate(rig.parents):
        if parent >= 0:
            whole[joint] = whole[parent] * scales[parent]
    return whole
