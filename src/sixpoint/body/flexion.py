"""Flexion axes of elbows and knees: from the file, the motion, the bend of the rest pose, or anatomy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Hinges
from sixpoint.body.motion import Motion
from sixpoint.body.skeleton import Skeleton

Array = NDArray[np.float64]

MIN_BEND = np.radians(8.0)  # smallest bend that tells a flexion axis


def bone_between(skeleton: Skeleton, joint: int, below: int) -> Array:
    """Vector (3,) from ``joint`` to ``below`` in the frame of ``joint``, joints between at rest [m]."""
    return np.asarray(skeleton.offsets[skeleton.path(joint, below)[1:]].sum(axis=0))


def find_flexion_axes(
    skeleton: Skeleton,
    chain: tuple[int, int, int],
    guess: Array,
    flexes_back: bool,
    motion: Motion | None,
    frames: Array | None,
) -> tuple[Array, Array]:
    """Anatomical X axis (3,) in the frames of the limb's upper and lower joint.

    From the file's degrees of freedom, else from the motion, else from the bend of the rest pose, else
    from anatomy (``guess``).
    """
    root, middle, end = chain
    upper = rot.unit(bone_between(skeleton, root, middle))
    lower = rot.unit(bone_between(skeleton, middle, end))
    between = skeleton.path(root, middle)[1:]
    forearms = None if frames is None else rot.mul_vec(_chained(frames, between), lower)
    axis = None if forearms is None else _axis_of_bends(upper, forearms, flexes_back)
    dof = motion.dofs[middle] if motion is not None else None
    if isinstance(dof, Hinges) and dof.size == 1 and abs(float(dof.axes[0] @ lower)) < 0.5:
        hinge = dof.axes[0]
        reference = guess if axis is None else axis
        hinge = hinge if hinge @ reference >= 0 else -hinge
        return hinge, hinge
    if axis is not None and frames is not None:
        in_lower = rot.mul_vec(rot.inv(_chained(frames, between)), axis).mean(axis=0)
        in_lower = in_lower - (in_lower @ lower) * lower
        if np.linalg.norm(in_lower) > 0.3:
            return axis, rot.unit(in_lower)
    axis = _axis_of_bends(upper, lower[None], flexes_back)
    if axis is None or axis @ guess < 0.5:
        axis = guess
    return axis, axis


def _chained(frames: Array, joints: list[int]) -> Array:
    """Product of the local rotations of consecutive joints, (F, 4)."""
    out = frames[:, joints[0]]
    for joint in joints[1:]:
        out = rot.mul(out, frames[:, joint])
    return out


def _axis_of_bends(upper: Array, lower: Array, flexes_back: bool) -> Array | None:
    """Anatomical X axis in the upper joint's frame from lower-limb directions (F, 3) seen there.

    A limb bends one way: the parts of ``lower`` across ``upper`` lie along one direction, which is
    forward for elbows and backward for knees.
    """
    across = lower - (lower @ upper)[:, None] * upper
    if np.sqrt(np.mean(np.sum(across**2, axis=1))) < np.sin(MIN_BEND):
        return None
    values, vectors = np.linalg.eigh(across.T @ across)
    if values[-1] < 4.0 * values[-2]:  # bends in all directions: not a hinge
        return None
    toward = vectors[:, -1] * np.sign(across.sum(axis=0) @ vectors[:, -1])
    forward = -toward if flexes_back else toward
    return rot.unit(np.cross(-upper, forward))
