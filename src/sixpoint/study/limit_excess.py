"""How far is a motion outside a figure's joint limits? Recomputed from the written rotations.

Reference: Unzueta et al. 2008, section 7.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.dofs import Ball, Hinges, JointDof, SwingTwist
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.study.movement import compute_local_rotations

Array = NDArray[np.float64]

ANTIPODE = 1e-6  # nearer to the antipode of the neutral direction there is no twist [rad]


def compute_limit_excess(figure: Figure, motion: Motion, margin: float = 0.0) -> Array:
    """Angle (F, J) by which each joint is outside its limits [rad]; zero inside and where there are none.

    Of a ball it is the larger of the excess of swing and of twist, of several hinges the largest.

    Args:
        figure: Whose limits.
        motion: What is measured.
        margin: How far within a limit counts as outside already [rad], to find the joints that are at one.
    """
    excess = np.zeros((len(motion), len(figure.skeleton)))
    joints = sorted(figure.dofs.joints)
    local = compute_local_rotations(figure, motion, joints)
    for k, joint in enumerate(joints):
        excess[:, joint] = _excess(figure.dofs[joint], local[:, k], margin)
    return excess


def _excess(dof: JointDof, local: Array, margin: float) -> Array:
    """(F,) excess [rad] of local rotations (F, 4)."""
    if isinstance(dof, Hinges):
        angles = dof.compute_angles(local)
        outside = np.maximum(dof.lower - angles, angles - dof.upper).max(axis=-1)
        return np.asarray((outside + margin).clip(min=0.0))
    if isinstance(dof, Ball) and dof.limit is not None:
        return np.maximum(*swing_twist_excess(dof.limit, local, margin))
    return np.zeros(len(local))


def swing_twist_excess(limit: SwingTwist, local: Array, margin: float = 0.0) -> tuple[Array, Array]:
    """How far swing and twist (F,) of rotations (F, 4) are outside [rad], never negative.

    The swing's excess is the angle back to the limit: straight, or over the antipode of the neutral
    direction where that is nearer. So an arm that may be lifted to 180 degrees in front is five degrees out
    when it is overhead and five degrees behind. At the antipode itself no direction and no twist is defined;
    it is inside where any direction reaches it.
    """
    psi, theta, tau = limit.decompose(local)
    over = 2.0 * np.pi - psi - limit.psi.max()
    swing = np.minimum(psi - limit.compute_limit(theta), over)

    least, most = limit.twist
    from_middle = (tau - 0.5 * (least + most) + np.pi) % (2.0 * np.pi) - np.pi
    twist = np.where(psi < np.pi - ANTIPODE, np.abs(from_middle) - 0.5 * (most - least), -np.inf)
    return (swing + margin).clip(min=0.0), (twist + margin).clip(min=0.0)
