"""What is back after a gap is followed at once, and shown without a jump.

The difference between what was expected and what was found is taken up in joint space, where a limb stays a
limb, added to what is shown, and fades (as animators' inertial blending does).
"""

from math import exp

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.solvers.prioritized.engine.packing import BALL, HINGES

PACE = 0.45  # time for each radian or metre of a jump [s]
QUICKEST, SLOWEST = 0.06, 0.15  # of it [s]
GONE = 1e-4  # what is less is nothing [rad, m]


@helper
def fade_row(lag, row, dt):
    """Let a row fade at its rate; returns its norm."""
    size = vec.norm(vec.load(lag, row))
    if size < GONE:
        for k in range(4):
            lag[row, k] = 0.0
        return 0.0
    share = exp(-lag[row, 3] * dt)
    for k in range(3):
        lag[row, k] *= share
    return size


@helper
def set_pace(lag, row):
    """How fast a row fades: the larger the slower."""
    time = min(max(PACE * vec.norm(vec.load(lag, row)), QUICKEST), SLOWEST)
    lag[row, 3] = 1.0 / time


@helper
def take_up(m, state, expected, lag, speed, dt, arrived, steady):
    """Fade what is left; add what joints that are back were off by, the last time once they arrived."""
    joints = len(m.parent)
    for row in range(2 * joints + 1):
        fade_row(lag, row, dt)
    for j in range(joints):
        if speed[j, 3] <= 0.0:
            continue
        speed[j, 3] = 0.0 if arrived else max(speed[j, 3] - dt, 0.0)
        if not steady:
            continue
        if j == m.base:
            for k in range(3):
                lag[joints, k] += expected[joints, k] - state[joints, k]
            set_pace(lag, joints)
        if m.kind[j] == BALL:
            shown = qt.mul(qt.exp(vec.load(lag, j)), qt.load(expected, j))
            vec.store(lag, j, qt.log(qt.mul(shown, qt.inv(qt.load(state, j)))))
            set_pace(lag, j)
        elif m.kind[j] == HINGES:
            row = joints + 1 + j
            for k in range(m.size[j]):
                lag[row, k] += expected[row, k] - state[row, k]
            set_pace(lag, row)


@helper
def let_go(m, state, lag):
    """Add what is left to a state."""
    joints = len(m.parent)
    for k in range(3):
        state[joints, k] += lag[joints, k]
    for j in range(joints):
        if m.kind[j] == BALL:
            qt.store(state, j, qt.normalised(qt.mul(qt.exp(vec.load(lag, j)), qt.load(state, j))))
        elif m.kind[j] == HINGES:
            for k in range(m.size[j]):
                state[joints + 1 + j, k] += lag[joints + 1 + j, k]
