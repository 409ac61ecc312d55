"""Anatomical joint angles of a motion, as clinicians and OpenSim have them.

Each joint is the rotation of the segment below it in the frame of the segment above, as three angles about
Z, X and Y in this order (X forward, Y up, Z right): flexion, ab- or adduction, rotation. At the ankle X is
the subtalar axis, which rises to the front, and Y at right angles to it. Zero is the neutral pose: standing,
arms hanging, palms to the thighs. Names, axes and signs are those of OpenSim's gait2392 and, for arms, of
Rajagopal's model; what these lack is named in their way (``docs/markers.md``).

The world is the motion's own, unturned: angles lie where the markers do. Above the pelvis is the world, so
a person who faces +X has pelvis_rotation 0, and one who faces +Z, as figures do at rest, -90.

References: G. Wu et al. 2002 and 2005 (ISB recommendations); S. Delp et al. 1990; A. Rajagopal et al. 2016.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.limits import SUBTALAR
from sixpoint.body.motion import Motion
from sixpoint.body.skeleton import frozen
from sixpoint.errors import FigureError

Array = NDArray[np.float64]

# Turns a segment's axes, X forward and Z right, into ours: Z forward, X left.
_FROM_OPENSIM = np.array([0.0, -np.sqrt(0.5), 0.0, np.sqrt(0.5)])
_TO_OPENSIM = rot.inv(_FROM_OPENSIM)
_RISE = rot.between([1.0, 0.0, 0.0], rot.mul_vec(_TO_OPENSIM, SUBTALAR))  # about Z, to the subtalar axis

PELVIS = ("pelvis_tilt", "pelvis_list", "pelvis_rotation")
TRANSLATIONS = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
# Of the right side: about Z, X and Y (the ankle's turned by _RISE). On the left, X and Y have the other sign.
LIMBS = {
    "hip": ("hip_flexion", "hip_adduction", "hip_rotation"),
    "knee": ("knee_angle", "knee_adduction", "knee_rotation"),
    "ankle": ("ankle_angle", "subtalar_angle", "ankle_rotation"),
    "shoulder": ("arm_flex", "arm_add", "arm_rot"),
    "elbow": ("elbow_flex", "elbow_add", "pro_sup"),
    "wrist": ("wrist_dev", "wrist_flex", "wrist_rot"),
}
LUMBAR = ("lumbar_extension", "lumbar_bending", "lumbar_rotation")
NECK = ("neck_extension", "neck_bending", "neck_rotation")


@dataclass(frozen=True, eq=False, repr=False)
class JointAngles:
    """Named angles over F frames.

    Attributes:
        names: N columns; ``TRANSLATIONS`` are the place of the pelvis in the world, all others are angles.
        values: (F, N) [deg], and [m] for ``TRANSLATIONS``.
        rate: Frames per second [Hz].
        name: Short name for messages and file names.
    """

    names: tuple[str, ...]
    values: Array
    rate: float
    name: str = "motion"

    def __repr__(self) -> str:
        return (
            f"JointAngles({self.name!r}, {len(self)} frames at {self.rate:g} Hz, {len(self.names)} columns)"
        )

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", frozen(self.values))

    def __len__(self) -> int:
        return int(self.values.shape[0])

    def __getitem__(self, name: str) -> Array:
        return np.asarray(self.values[:, self.names.index(name)])


def compute_joint_angles(motion: Motion, figure: Figure) -> JointAngles:
    """Joint angles of a motion of a figure's rig.

    Args:
        motion: On the figure's skeleton.
        figure: The anatomy.

    Returns:
        Angles that run on without jumps of 360 degrees; where the middle angle passes 90 degrees, as with
        an arm raised sideways, it goes on beyond 90 rather than that the two others jump by 180.

    Raises:
        FigureError: The motion is on another skeleton.
    """
    if motion.skeleton is not figure.skeleton and motion.skeleton.names != figure.skeleton.names:
        raise FigureError("the motion is on another skeleton than this figure")
    roles, (positions, world) = figure.roles, motion.transforms
    turned = rot.mul(world, rot.inv(figure.neutral))  # identity in the neutral pose
    frames = rot.mul(turned, _FROM_OPENSIM)
    torso = _find_torso(figure)
    names = [*PELVIS, *LUMBAR, *NECK]
    parts = [
        frames[:, roles.pelvis],
        _between(frames, roles.pelvis, torso),
        _between(frames, torso, roles.head),
    ]
    signs = [1.0] * 9
    for side, letter, mirror in ((1, "r", 1.0), (0, "l", -1.0)):
        above = roles.pelvis
        for joint, columns in LIMBS.items():
            above = torso if joint == "shoulder" else above
            here = int(getattr(roles, joint)[side])
            part = _between(frames, above, here)
            parts.append(rot.mul(rot.inv(_RISE), rot.mul(part, _RISE)) if joint == "ankle" else part)
            names += [f"{column}_{letter}" for column in columns]
            signs += [1.0, mirror, mirror]
            above = here
    angles = _continuous(rot.to_euler("ZXY", np.stack(parts, axis=1)))
    table = np.degrees(angles).reshape(len(motion), -1) * signs
    return JointAngles(
        (*names[:3], *TRANSLATIONS, *names[3:]),
        np.hstack([table[:, :3], positions[:, roles.pelvis], table[:, 3:]]),
        motion.rate,
        motion.name,
    )


def _find_torso(figure: Figure) -> int:
    """The joint of the trunk that carries the arms."""
    roles, parents = figure.roles, figure.skeleton.parents
    joint = (roles.clavicle or roles.shoulder)[0]
    trunk = {roles.pelvis, *roles.spine}
    while joint not in trunk and joint > 0:
        joint = int(parents[joint])
    return joint


def _between(frames: Array, above: int, below: int) -> Array:
    """(F, 4) rotation of a segment in the frame of another."""
    return rot.mul(rot.inv(frames[:, above]), frames[:, below])


def _continuous(angles: Array) -> Array:
    """Of the equal triples (a, b, c) and (a + pi, pi - b, c + pi), each frame the one nearest to the last."""
    out = angles.copy()
    for k in range(1, len(out)):
        same = angles[k]
        other = np.array([np.pi, np.pi, np.pi]) + angles[k] * [1.0, -1.0, 1.0]
        both = np.stack([same, other])
        both += 2 * np.pi * np.round((out[k - 1] - both) / (2 * np.pi))
        nearer = np.abs(both - out[k - 1]).sum(axis=-1)
        out[k] = np.where((nearer[0] <= nearer[1])[:, None], both[0], both[1])
    return out
