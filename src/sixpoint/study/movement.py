"""What one motion does, measured on a figure's anatomy: turning, swivel jumps, shrugging, bending, jerk.

All angles are of anatomical frames, so that rigs with other axes and rest poses give the same numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import nan

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.signals.differences import compute_velocity
from sixpoint.signals.swivel import compute_swivel_steps
from sixpoint.study.metrics import measured_joints

Array = NDArray[np.float64]

JUMP = np.radians(30.0)  # a larger change of a swivel angle in one frame is a jump [rad]
UPRIGHT = 0.3  # the pelvis' X axis has a heading while its projection to the floor is longer than this
TURNING_HALF_SPAN = 0.05  # turning is the mean over twice this time [s]
UNBENT = 1e-6  # a trunk that bends less has no distribution of bending [rad]


def compute_local_rotations(figure: Figure, motion: Motion, joints: Sequence[int]) -> Array:
    """(F, n, 4) anatomical local rotations of joints against their parents; identity in the neutral pose."""
    above = figure.neutral[np.maximum(figure.skeleton.parents[list(joints)], 0)].copy()
    above[[joint == 0 for joint in joints]] = rot.IDENTITY
    turned = rot.mul(above, motion.rotations[:, list(joints)])
    return rot.mul(turned, rot.inv(figure.neutral[list(joints)]))


def wrap(angle: Array) -> Array:
    """The same angles between -pi and pi [rad]."""
    return np.arctan2(np.sin(angle), np.cos(angle))


def compute_heading(figure: Figure, motion: Motion) -> Array:
    """Angle (F,) about the world's vertical of the pelvis' X axis, projected to the floor [rad].

    NaN where that axis is nearly vertical.
    """
    pelvis = figure.roles.pelvis
    world = rot.mul(motion.transforms[1][:, pelvis], rot.inv(figure.neutral[pelvis]))
    x, _, z = rot.mul_vec(world, [1.0, 0.0, 0.0]).T
    return np.where(np.hypot(x, z) > UPRIGHT, np.arctan2(-z, x), np.nan)


def compute_turning(figure: Figure, motion: Motion) -> Array:
    """Speed (F,) of the pelvis about the world's vertical [rad/s], smoothed over 0.1 s.

    Where there is no heading, as of a body that lies on its side, it is held: such frames add no turning.
    """
    steps = np.nan_to_num(wrap(np.diff(compute_heading(figure, motion))))
    held = np.concatenate([[0.0], np.cumsum(steps)])
    return np.abs(compute_velocity(held, motion.rate, TURNING_HALF_SPAN))


def find_swivel_jumps(figure: Figure, motion: Motion) -> NDArray[np.bool_]:
    """Frames (F, 4) in which an elbow or knee has swivelled by more than 30 degrees since the one before.

    The limbs are in the order of ``figure.roles.limbs``: left arm, right arm, left leg, right leg. Nearly
    straight limbs do not count, see ``compute_swivel_steps``.
    """
    root, middle, end = np.moveaxis(motion.positions[:, np.array(figure.roles.limbs)], 2, 0)
    jumps = np.abs(compute_swivel_steps(root, middle, end)) > JUMP
    return np.concatenate([np.zeros((1, jumps.shape[1]), bool), jumps])


def compute_clavicle_angle(figure: Figure, motion: Motion) -> float:
    """Mean angle of the clavicles from rest [rad]; NaN where the rig has none."""
    if not figure.roles.clavicle:
        return nan
    return float(rot.angle(compute_local_rotations(figure, motion, figure.roles.clavicle)).mean())


def compute_bend_top(figure: Figure, motion: Motion) -> float:
    """Share of the trunk's bending that the upper half of its interior joints does, 0 to 1.

    Bending is the swing of each rotating trunk joint above the pelvis against the one below it, without its
    twist about the trunk, summed over the frames. Of an odd number of joints the middle one counts half to
    either side. NaN where the trunk has fewer than two such joints, or is never bent.
    """
    chain = list(figure.spine_chain.joints)
    if len(chain) < 3:
        return nan
    world = rot.mul(motion.transforms[1][:, chain], rot.inv(figure.neutral[chain]))
    x, y, z, w = np.moveaxis(rot.mul(rot.inv(world[:, :-1]), world[:, 1:]), -1, 0)
    bending = 2.0 * np.arctan2(np.hypot(x, z), np.hypot(y, w)).mean(axis=0)
    if bending.sum() < UNBENT:
        return nan
    count = len(bending)
    upper = np.clip(np.arange(1, count + 1) - 0.5 * count, 0.0, 1.0)
    return float(bending @ upper / bending.sum())


def compute_jerk(figure: Figure, motion: Motion) -> float:
    """Mean third difference of the measured joints' positions [m]; NaN of fewer than four frames."""
    if len(motion) < 4:
        return nan
    third = np.diff(motion.positions[:, measured_joints(figure)], n=3, axis=0)
    return float(np.linalg.norm(third, axis=-1).mean())
