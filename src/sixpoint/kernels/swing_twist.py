"""Swing and twist limits of ball joints (Unzueta et al. 2008, section 7).

The limits of one joint are one row of a plain array, so that compiled functions pass a single array:

    axis 3 | forward 3 | side 3 | least swing limit, largest, cosine of half the least | twist 2
    | sines of half the twist 2 | K knots of theta | 4 (K - 1) cubic coefficients, highest power first, in
    (theta - knot)

The least swing limit and the sines let most joints pass without trigonometry.
"""

from math import atan2, cos, pi, sqrt

import numpy as np

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper

FORWARD, SIDE, SWING, TWIST, SINES, KNOTS = 3, 6, 9, 12, 14, 16
TOLERANCE = 1e-12
NEAR_ANTIPODE = pi / 6


@helper
def swing_limit(row, theta):
    """Largest swing [rad] in the direction theta: the spline, clipped to the range of its knots."""
    pieces = (row.shape[0] - KNOTS - 1) // 5
    k = 0
    while k < pieces - 1 and theta > row[KNOTS + k + 1]:
        k += 1
    c = KNOTS + pieces + 1 + 4 * k
    x = theta - row[KNOTS + k]
    psi = ((row[c] * x + row[c + 1]) * x + row[c + 2]) * x + row[c + 3]
    return min(max(psi, row[SWING]), row[SWING + 1])


@helper
def clamp(balls, b, q):
    """Nearest rotation within the limits on the same great circle of swing: swing first, then twist.

    The segment turns back at the same theta, as in the paper, except within 30 degrees of the antipode
    where the way over it is the shorter one: an arm raised overhead and a little behind the head stays up.

    Returns the rotation and whether it had to be changed.
    """
    row = balls[b]
    axis = (row[0], row[1], row[2])
    # Sine and cosine of half the twist, the twist in (-pi, pi]; of a half turn of swing it is zero.
    s, c = q[0] * axis[0] + q[1] * axis[1] + q[2] * axis[2], q[3]
    length = sqrt(s * s + c * c)
    if length > 1e-150:
        length = 1.0 / length if c >= 0.0 else -1.0 / length
        s, c = s * length, c * length
    else:
        s, c = 0.0, 1.0
    twist = (s * axis[0], s * axis[1], s * axis[2], c)
    swing = qt.mul(q, (-twist[0], -twist[1], -twist[2], c))
    if swing[3] < 0.0:
        swing = (-swing[0], -swing[1], -swing[2], -swing[3])
    changed = False
    if swing[3] < row[SWING + 2]:
        length = sqrt(swing[0] * swing[0] + swing[1] * swing[1] + swing[2] * swing[2])
        psi = 2.0 * atan2(length, swing[3])
        # The swing axis n is axis x s / |.|, so s leans towards n x axis.
        inverse = 1.0 / max(length, 1e-300)
        n = (swing[0] * inverse, swing[1] * inverse, swing[2] * inverse)
        lean = vec.cross(n, axis)
        sideways = vec.dot(lean, (row[SIDE], row[SIDE + 1], row[SIDE + 2]))
        onward = vec.dot(lean, (row[FORWARD], row[FORWARD + 1], row[FORWARD + 2]))
        theta = atan2(sideways, onward)
        limit = swing_limit(row, theta)
        if psi > limit + TOLERANCE:
            if psi > pi - NEAR_ANTIPODE:
                beyond = swing_limit(row, theta - pi if theta > 0.0 else theta + pi)
                limit = -beyond if 2.0 * pi - psi - beyond < psi - limit else limit
            swing = qt.from_axis_angle(n, limit)
            changed = True
    if s < row[SINES] - TOLERANCE or s > row[SINES + 1] + TOLERANCE:
        twist = qt.from_axis_angle(axis, row[TWIST] if s < 0.0 else row[TWIST + 1])
        changed = True
    if not changed:
        return q, False
    return qt.mul(swing, twist), True


@helper
def room(balls, b, q):
    """How far a rotation is inside its swing limit and inside its twist limit [rad]; negative outside."""
    row = balls[b]
    axis = (row[0], row[1], row[2])
    tau = qt.twist_angle(q, axis)
    s = qt.mul_vec(q, axis)
    cosine = min(max(vec.dot(s, axis), -1.0), 1.0)
    psi = atan2(vec.norm(vec.cross(axis, s)), cosine)
    theta = atan2(
        vec.dot(s, (row[SIDE], row[SIDE + 1], row[SIDE + 2])),
        vec.dot(s, (row[FORWARD], row[FORWARD + 1], row[FORWARD + 2])),
    )
    # Near the antipode the limit may be met over the top, see ``clamp``.
    swing = swing_limit(row, theta) - psi
    beyond = swing_limit(row, theta - pi if theta > 0.0 else theta + pi) - (2.0 * pi - psi)
    swing = max(swing, beyond)
    return swing, min(tau - row[TWIST], row[TWIST + 1] - tau)


def build_ball_rows(limits):
    """Lower ``body.dofs.SwingTwist`` limits to rows (B, W); None means unlimited."""
    width = max([len(limit.theta) for limit in limits if limit is not None], default=3)
    rows = np.zeros((len(limits), KNOTS + width + 4 * (width - 1)))
    for row, limit in zip(rows, limits, strict=True):
        knots = np.full(width, pi)
        cubics = np.zeros((width - 1, 4))
        if limit is None:
            row[:9] = np.eye(3).ravel()
            row[SWING : SWING + 3] = pi, pi, -1.0
            row[TWIST : TWIST + 2] = -2 * pi, 2 * pi
            row[SINES : SINES + 2] = -2.0, 2.0
        else:
            pieces = len(limit.theta) - 1
            row[:9] = np.concatenate([limit.axis, limit.forward, limit.side])
            row[SWING : SWING + 3] = limit.psi.min(), limit.psi.max(), cos(0.5 * limit.psi.min())
            row[TWIST : TWIST + 2] = limit.twist
            row[SINES : SINES + 2] = np.sin(0.5 * limit.twist)
            knots[: pieces + 1] = limit.theta
            cubics[:pieces] = limit.cubics
        row[KNOTS:] = np.concatenate([knots, cubics.ravel()])
    return rows
