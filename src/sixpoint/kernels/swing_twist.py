"""Swing and twist limits of ball joints (Unzueta et al. 2008, section 7).

A limit is a row of a ``BallTable``: knots and cubic coefficients of the swing spline, an orthonormal frame
(axis, forward, side), the twist range, and the smallest swing limit, which lets most joints pass at once.
"""

from math import atan2, cos, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper

TOLERANCE = 1e-12


class BallTable(NamedTuple):
    """Limits of B ball joints.

    Attributes:
        frames: (B, 3, 3) rows axis, forward, side.
        knots: (B, K) theta [rad], increasing; padded with pi.
        cubics: (B, K - 1, 4) coefficients of each piece in (theta - knot), highest power first.
        swing: (B, 3) least and largest swing limit [rad], cosine of half the least.
        twist: (B, 2) least and largest twist [rad].
    """

    frames: np.ndarray
    knots: np.ndarray
    cubics: np.ndarray
    swing: np.ndarray
    twist: np.ndarray


@helper
def swing_limit(table, b, theta):
    """Largest swing [rad] in the direction theta: the spline, clipped to the range of its knots."""
    knots = table.knots[b]
    k = 0
    while k < knots.shape[0] - 2 and theta > knots[k + 1]:
        k += 1
    c = table.cubics[b, k]
    x = theta - knots[k]
    psi = ((c[0] * x + c[1]) * x + c[2]) * x + c[3]
    return min(max(psi, table.swing[b, 0]), table.swing[b, 1])


@helper
def clamp(table, b, q):
    """Nearest rotation within the limits that keeps theta: swing first, then twist.

    Returns the rotation and whether it had to be changed.
    """
    axis = vec.load(table.frames[b], 0)
    tau = qt.twist_angle(q, axis)
    half = 0.5 * tau
    twist = (sin(half) * axis[0], sin(half) * axis[1], sin(half) * axis[2], cos(half))
    swing = qt.mul(q, qt.inv(twist))
    if swing[3] < 0.0:
        swing = (-swing[0], -swing[1], -swing[2], -swing[3])
    changed = False
    if swing[3] < table.swing[b, 2]:
        length = sqrt(swing[0] * swing[0] + swing[1] * swing[1] + swing[2] * swing[2])
        psi = 2.0 * atan2(length, swing[3])
        # The swing axis n is axis x s / |.|, so s leans towards n x axis.
        inverse = 1.0 / max(length, 1e-300)
        n = (swing[0] * inverse, swing[1] * inverse, swing[2] * inverse)
        lean = vec.cross(n, axis)
        theta = atan2(vec.dot(lean, vec.load(table.frames[b], 2)), vec.dot(lean, vec.load(table.frames[b], 1)))
        limit = swing_limit(table, b, theta)
        if psi > limit + TOLERANCE:
            swing = qt.from_axis_angle(n, limit)
            changed = True
    low, high = table.twist[b, 0], table.twist[b, 1]
    if tau < low - TOLERANCE or tau > high + TOLERANCE:
        tau = min(max(tau, low), high)
        twist = qt.from_axis_angle(axis, tau)
        changed = True
    if not changed:
        return q, False
    return qt.mul(swing, twist), True


def build_ball_table(limits):
    """Lower ``body.dofs.SwingTwist`` limits to one table; None means unlimited."""
    count, width = len(limits), max([len(limit.theta) for limit in limits if limit is not None], default=3)
    frames = np.tile(np.eye(3), (count, 1, 1))
    knots = np.full((count, width), pi)
    knots[:, 0] = -pi
    cubics = np.zeros((count, width - 1, 4))
    cubics[:, :, 3] = pi
    swing = np.tile([pi, pi, 0.0], (count, 1))
    twist = np.tile([-2 * pi, 2 * pi], (count, 1))
    for b, limit in enumerate(limits):
        if limit is None:
            swing[b, 2] = -1.0
            continue
        pieces = len(limit.theta) - 1
        frames[b] = limit.axis, limit.forward, limit.side
        knots[b, : pieces + 1] = limit.theta
        cubics[b, :pieces] = limit.spline.c.T
        swing[b] = limit.psi.min(), limit.psi.max(), cos(0.5 * limit.psi.min())
        twist[b] = limit.twist
    return BallTable(frames, knots, cubics, swing, twist)
