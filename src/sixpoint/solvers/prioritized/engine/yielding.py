"""Why a task was not met: which more important tasks, or limits, hold the motion it would need."""

from sixpoint.kernels import linear
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.solvers.prioritized.engine import packing
from sixpoint.solvers.prioritized.engine.kinematics import add_row, place_of
from sixpoint.solvers.prioritized.engine.packing import HINGES
from sixpoint.solvers.prioritized.engine.wishes import ENFORCED, EQUAL, NONE, WAITING, X, Y, Z, triple

AT_BOUND = 1e-4  # a hinge this near its bound is at it [rad]


@helper
def _own_rows(m, w, index, values, b, work):
    """Write what a block occupies into the work rows; returns how many. FLEXT occupies its whole position."""
    kind, first, count = index[b, packing.KIND], index[b, packing.FIRST], index[b, packing.COUNT]
    if kind == packing.FLEXT:
        joint = index[b, packing.JOINT]
        point = place_of(m, w, joint, triple(values, b, packing.OFFSET))
        for k in range(3):
            linear.clear(w.rows, work + k)
            saved = (X, Y, Z)[k]
            add_row(m, w, work + k, joint, point, saved, NONE)
        return 3
    for k in range(count):
        linear.copy(w.rows, work + k, first + k)
    return count


@helper
def _wanted(m, w, index, values, b, goals, wish):
    """Coordinate changes that an unmet block asks for (its rows transposed times its error), normalised."""
    linear.clear(w.rows, wish)
    if index[b, packing.KIND] == packing.FLEXT:
        joint, t = index[b, packing.JOINT], index[b, packing.TASK]
        point = place_of(m, w, joint, triple(values, b, packing.OFFSET))
        gap = vec.sub((goals[t, 0], goals[t, 1], goals[t, 2]), point)
        add_row(m, w, wish, joint, point, vec.unit(gap), NONE)
    else:
        r = index[b, packing.FIRST]
        for k in range(index[b, packing.COUNT]):
            linear.add(w.rows, wish, w.row[r + k, 0], r + k)
    length = linear.dot(w.rows, wish, wish) ** 0.5
    if length < 1e-12:
        return False
    for c in range(w.rows.shape[1]):
        w.rows[wish, c] /= length
    return True


@helper
def _held_by_limits(m, w, state, wish):
    """Squared part of a wanted direction that leads out of limits: of hinges at a bound, of locked balls."""
    joints, held = len(m.parent), 0.0
    for j in range(joints):
        start = m.start[j]
        if m.kind[j] == HINGES:
            for k in range(m.size[j]):
                angle, way = state[joints + 1 + j, k], w.rows[wish, start + k]
                if (angle < m.bounds[start + k, 0] + AT_BOUND and way < 0.0) or (
                    angle > m.bounds[start + k, 1] - AT_BOUND and way > 0.0
                ):
                    held += way * way
        for k in range(w.locks[j]):
            u = vec.load(w.lock, 2 * j + k)
            way = (w.rows[wish, start], w.rows[wish, start + 1], w.rows[wish, start + 2])
            held += vec.dot(u, way) ** 2
    return held


@helper
def report_yielding(m, w, index, values, goals, state, fixed, yielded):
    """Shares (T, T + 1): how much of what each unmet task needs is held by each other task; limits last.

    A share is the squared part of the wanted direction that lies in the row space of the other task; a task's
    own share is 1 where it is unmet.
    """
    wish, work = fixed + 1, fixed + 3
    basis = work + w.small.shape[1]
    tasks = yielded.shape[0]
    for b in range(len(index)):
        active = w.block[b, 2] == EQUAL or w.block[b, 2] == ENFORCED
        if not active or w.block[b, 0] <= values[b, packing.ACCEPT]:
            continue
        t = index[b, packing.TASK]
        yielded[t, t] = 1.0
        if not _wanted(m, w, index, values, b, goals, wish):
            continue
        yielded[t, tasks] = max(yielded[t, tasks], _held_by_limits(m, w, state, wish))
        for other in range(len(index)):
            s = index[other, packing.TASK]
            held = w.block[other, 2] == EQUAL or w.block[other, 2] == ENFORCED
            if w.block[other, 2] == WAITING and w.block[other, 1] < values[other, packing.TOLERANCE]:
                held = (
                    linear.dot(w.rows, index[other, packing.FIRST], wish) < 0.0
                )  # in contact, and in the way
            if s == t or not held or index[other, packing.LEVEL] > index[b, packing.LEVEL]:
                continue
            count = _own_rows(m, w, index, values, other, work)
            rank = linear.extend_basis(w.rows, work, count, basis, 0, w.small, 1e-6)
            share = 0.0
            for k in range(rank):
                share += linear.dot(w.rows, wish, basis + k) ** 2
            yielded[t, s] = max(yielded[t, s], share)
