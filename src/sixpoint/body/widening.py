"""Wider joint limits: a table of people, and a person or a calibration that goes beyond it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.dofs import Ball, Hinges, JointDof

Array = NDArray[np.float64]

MOST = np.radians(30.0)
"""What is farther outside is no posture of a person [rad]."""
LIFTED = np.radians(15.0)
"""A table that is so wrong says nothing of this person; wide limits near the antipode trap a ball [rad]."""


def widen(dof: JointDof, local: Array, share: float = 0.99) -> tuple[JointDof, float]:
    """Limits that contain a share of the given rotations, and by how much they grew.

    The swing grows in the directions in which it is exceeded only, the twist and hinges to the side.

    Args:
        dof: What a joint may do.
        local: (F, 4) rotations from the neutral pose.
        share: Of the frames that is to be inside, side by side; the others may be errors.

    Returns:
        The joint's new limits, and the largest growth [rad]: of hinges 30 degrees at most; a ball that is
        more than 15 degrees outside is left without limits, infinity.
    """
    if len(local) == 0:
        return dof, 0.0
    if isinstance(dof, Hinges):
        angles = dof.compute_angles(local)
        below, above = (_grow(x, share, axis=0) for x in (dof.lower - angles, angles - dof.upper))
        grown = float(max(below.max(), above.max()))
        return (replace(dof, lower=dof.lower - below, upper=dof.upper + above) if grown else dof), grown
    if not isinstance(dof, Ball) or dof.limit is None:
        return dof, 0.0
    limit = dof.limit
    psi, theta, tau = limit.decompose(local)
    beyond = np.minimum(psi - limit.compute_limit(theta), 2 * np.pi - psi - limit.psi.max())
    piece = np.clip(np.searchsorted(limit.theta, theta, side="right") - 1, 0, len(limit.theta) - 2)
    knots = np.zeros(len(limit.theta))
    for k in range(len(knots) - 1):
        if np.any(piece == k):  # the share is of all frames: a few in a direction are not the person
            there = np.where(piece == k, beyond, -np.inf)
            knots[k : k + 2] = np.maximum(knots[k : k + 2], _grow(there, share, axis=0))
    knots[[0, -1]] = knots[[0, -1]].max()
    least, most = limit.twist
    from_middle = (tau - 0.5 * (least + most) + np.pi) % (2 * np.pi) - np.pi
    half = 0.5 * (most - least)
    low, high = (float(_grow(x - half, share, axis=0)) for x in (-from_middle, from_middle))
    grown = float(max(knots.max(), low, high))
    if not grown:
        return dof, 0.0
    if grown > LIFTED:
        return Ball(), float("inf")
    twist = np.array([max(least - low, -np.pi), min(most + high, np.pi)])
    return Ball(replace(limit, psi=np.minimum(limit.psi + knots, np.pi), twist=twist)), grown


def _grow(beyond: Array, share: float, axis: int) -> Array:
    """By how much a limit grows that is exceeded by so much (negative inside)."""
    value = np.quantile(beyond, share, axis=axis, method="higher")
    return np.asarray(np.clip(np.where(value > 0, value, 0.0), 0.0, MOST))
