"""How far is a reconstruction from the truth? Measured from two motions alone, in plain NumPy.

Nothing here asks a solver: positions come from forward kinematics of the written rotations.

Reference: Unzueta et al. 2008, section 9.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import COINCIDENT, Figure
from sixpoint.body.motion import Motion
from sixpoint.errors import SkeletonError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Errors:
    """Errors of a reconstruction against the truth.

    Attributes:
        joints: Names of the joints that count.
        height: Sum of calf, thigh, pelvis, torso and neck lengths: the unit of the position error [m].
        distances: (F, N) distance of each joint to its true place [m].
        angles: (F, N) angle of each joint's rotation to the truth, root in the world, others against
            their parent among these joints [rad].
    """

    joints: tuple[str, ...]
    height: float
    distances: Array
    angles: Array

    @property
    def position_curve(self) -> Array:
        """(F,) mean joint distance over height, e_p(t)."""
        return np.asarray(self.distances.mean(axis=1) / self.height)

    @property
    def orientation_curve(self) -> Array:
        """(F,) mean joint angle [rad], e_o(t)."""
        return np.asarray(self.angles.mean(axis=1))

    @property
    def position(self) -> float:
        """RMS over frames of e_p(t), the paper's position error."""
        return float(np.sqrt(np.mean(self.position_curve**2)))

    @property
    def orientation(self) -> float:
        """RMS over frames of e_o(t) [rad], the paper's orientation error."""
        return float(np.sqrt(np.mean(self.orientation_curve**2)))

    @property
    def position_pooled(self) -> float:
        """The other reading of "RMS of the sum": sqrt(mean_t sum_j d^2) / (N H)."""
        pooled = np.sqrt(np.mean(np.sum(self.distances**2, axis=1)))
        return float(pooled / (len(self.joints) * self.height))


def compute_errors(figure: Figure, truth: Motion, result: Motion) -> Errors:
    """Compare a reconstruction with the truth on the same rig.

    The joints are the pelvis, the spine joints and clavicles, shoulders, elbows, wrists, hips, knees and
    ankles. A rig whose first spine joint lies at the pelvis counts a motionless sacroiliac there too, as
    the paper's figure does, which makes 22 joints on H-Anim and CMU rigs. Where the head is an end site,
    the joint that carries it counts with the end site's position.

    Args:
        figure: The anatomy of the rig.
        truth: The recording.
        result: The reconstruction, with as many frames.

    Raises:
        SkeletonError: The motions do not have the figure's joints, or not as many frames.
    """
    for motion in (truth, result):
        if motion.skeleton.names != figure.skeleton.names:
            raise SkeletonError("truth and result must both be motions of the figure's rig")
    if len(truth) != len(result):
        raise SkeletonError(f"truth has {len(truth)} frames, the result {len(result)}")
    joints = measured_joints(figure)
    distances = np.linalg.norm(
        _positions(figure, truth, joints) - _positions(figure, result, joints), axis=-1
    )
    turned = rot.mul(rot.inv(_rotations(figure, truth, joints)), _rotations(figure, result, joints))
    angles = rot.angle(turned)
    names = [figure.skeleton.names[j] for j in joints]
    first = figure.roles.spine[0]
    if np.linalg.norm(figure.offset_between(figure.roles.pelvis, first)) < COINCIDENT:
        distances = np.concatenate([distances[:, :1], distances], axis=1)
        angles = np.concatenate([np.zeros_like(angles[:, :1]), angles], axis=1)
        names = ["(sacroiliac)", *names]
    return Errors(tuple(names), figure.height, distances, angles)


def measured_joints(figure: Figure) -> list[int]:
    """The rig joints that count, the pelvis first."""
    r = figure.roles
    arms = (*r.clavicle, *r.shoulder, *r.elbow, *r.wrist)
    return [r.pelvis, *r.spine, *arms, *r.hip, *r.knee, *r.ankle]


def _positions(figure: Figure, motion: Motion, joints: list[int]) -> Array:
    positions, world = motion.transforms
    places = positions[:, joints].copy()
    if any(figure.roles.head_offset):
        head = figure.roles.head
        places[:, joints.index(head)] += rot.mul_vec(world[:, head], figure.roles.head_offset)
    return places


def _rotations(figure: Figure, motion: Motion, joints: list[int]) -> Array:
    """World rotation of the pelvis, and of each other joint against its nearest ancestor that counts."""
    _, world = motion.transforms
    out = [world[:, joints[0]]]
    for joint in joints[1:]:
        above = figure.skeleton.path(0, joint)[-2::-1]
        parent = next(j for j in above if j in joints)
        out.append(rot.mul(rot.inv(world[:, parent]), world[:, joint]))
    return np.stack(out, axis=1)
