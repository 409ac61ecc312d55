"""Joint limits and one-sided constraints inside the loop: what a step would violate becomes an equality.

Reference: Baerlocher and Boulic 2004; Unzueta et al. 2008, section 9; swing and twist limits as in section 7.
"""

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.swing_twist import clamp, room
from sixpoint.solvers.prioritized.engine import packing
from sixpoint.solvers.prioritized.engine.packing import BALL, HINGES
from sixpoint.solvers.prioritized.engine.wishes import ENFORCED, WAITING

TOLERANCE = 1e-9
DIFFERENCE = 1e-4  # step of the numerical gradient [rad]


@helper
def _gradient(balls, b, q, part):
    """Derivative of ``room`` (part 0 swing, 1 twist) by the tangent of the rotation."""
    g = (0.0, 0.0, 0.0)
    for k in range(3):
        e = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))[k]
        there = room(balls, b, qt.mul(qt.exp(vec.scale(DIFFERENCE, e)), q))
        back = room(balls, b, qt.mul(qt.exp(vec.scale(-DIFFERENCE, e)), q))
        g = vec.madd(g, (there[part] - back[part]) / (2.0 * DIFFERENCE), e)
    return g


@helper
def release(m, w):
    """Lock nothing."""
    for c in range(len(m.hinges)):
        w.locked[c] = 0
    for j in range(len(m.parent)):
        w.locks[j] = 0


@helper
def lock_direction(m, w, balls, j, q, part, fixed):
    """Lock the tangent direction in which a ball joint meets a limit; row ``fixed`` takes it there."""
    count = w.locks[j]
    if count >= 2:
        return False
    g = _gradient(balls, m.ball[j], q, part)
    u = g
    start = m.start[j]
    along = 0.0
    if count == 1:
        first = vec.load(w.lock, 2 * j)
        u = vec.reject(g, first)
        for k in range(3):
            along += g[k] * w.rows[fixed, start + k]
    length = vec.norm(u)
    if length < 1e-3:
        return False
    u = vec.scale(1.0 / length, u)
    inside = room(balls, m.ball[j], q)[part]
    move = -(inside + along) / length
    vec.store(w.lock, 2 * j + count, u)
    w.locks[j] = count + 1
    for k in range(3):
        w.rows[fixed, start + k] += move * u[k]
    return True


@helper
def lock_violations(m, w, balls, state, step, fixed):
    """Lock every joint that the trial step takes out of its limits; returns whether there was any."""
    joints = len(m.parent)
    found = False
    for j in range(joints):
        start = m.start[j]
        if m.kind[j] == HINGES:
            for k in range(m.size[j]):
                c = start + k
                if w.locked[c]:
                    continue
                angle = state[joints + 1 + j, k]
                there = angle + w.rows[step, c]
                if there < m.bounds[c, 0] - TOLERANCE:
                    w.rows[fixed, c] = m.bounds[c, 0] - angle
                elif there > m.bounds[c, 1] + TOLERANCE:
                    w.rows[fixed, c] = m.bounds[c, 1] - angle
                else:
                    continue
                w.locked[c] = 1
                found = True
        elif m.kind[j] == BALL and m.ball[j] >= 0:
            turn = (w.rows[step, start], w.rows[step, start + 1], w.rows[step, start + 2])
            if vec.dot(turn, turn) == 0.0 or w.locks[j] >= 2:
                continue
            q = qt.load(state, j)
            there = room(balls, m.ball[j], qt.mul(qt.exp(turn), q))
            # What is already locked may leak by its curvature; the limiter takes that back.
            leak = 1e-6 if w.locks[j] == 0 else 0.02
            if there[0] < -leak and lock_direction(m, w, balls, j, q, 0, fixed):
                found = True
            if there[1] < -leak and lock_direction(m, w, balls, j, q, 1, fixed):
                found = True
    return found


@helper
def enforce_approaches(w, index, values, step):
    """Enforce every one-sided constraint that the trial step violates or approaches too fast.

    Inside the buffer of an obstacle the approach is slowed in proportion to what is left of the buffer.
    """
    found = False
    for b in range(len(index)):
        if w.block[b, 2] != WAITING:
            continue
        r = index[b, packing.FIRST]
        moved = 0.0
        for c in range(w.rows.shape[1]):
            moved += w.rows[r, c] * w.rows[step, c]
        weight = values[b, packing.WEIGHT]
        approach = moved / weight
        distance, buffer = w.block[b, 1], values[b, packing.BUFFER]
        if approach < 0.0 and distance < buffer:
            w.row[r, 0] = weight * max(approach * distance / buffer, -distance)
        elif distance + approach < -1e-9:
            w.row[r, 0] = -weight * distance
        else:
            continue
        w.block[b, 2] = ENFORCED
        found = True
    return found


@helper
def hold_limits(m, balls, state):
    """Take every joint back inside its limits."""
    joints = len(m.parent)
    for j in range(joints):
        if m.kind[j] == HINGES:
            for k in range(m.size[j]):
                c = m.start[j] + k
                angle = state[joints + 1 + j, k]
                state[joints + 1 + j, k] = min(max(angle, m.bounds[c, 0]), m.bounds[c, 1])
        elif m.kind[j] == BALL and m.ball[j] >= 0:
            held, changed = clamp(balls, m.ball[j], qt.load(state, j))
            if changed:
                qt.store(state, j, qt.normalised(held))
