"""One prioritized step: the levels in order, each in what the levels above leave free.

The null-space projector is kept as an orthonormal basis V of what is taken, P = P0 (I - V^T V); P0 removes
the locked coordinates. The solution of a level is damped, the projector never is.

Reference: Baerlocher and Boulic 2004; Boulic and Raunhardt 2009, section 4 and eq. 3.
"""

from math import sqrt

from sixpoint.kernels import linear
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.solvers.prioritized.engine import packing
from sixpoint.solvers.prioritized.engine.limb_rows import build_flext
from sixpoint.solvers.prioritized.engine.packing import BALL
from sixpoint.solvers.prioritized.engine.wishes import ENFORCED, EQUAL


@helper
def mask(m, w, i):
    """Remove the locked coordinates from row i."""
    for c in range(len(m.hinges)):
        if w.locked[c]:
            w.rows[i, c] = 0.0
    for j in range(len(m.parent)):
        start = m.start[j]
        for k in range(w.locks[j]):
            u = vec.load(w.lock, 2 * j + k)
            part = u[0] * w.rows[i, start] + u[1] * w.rows[i, start + 1] + u[2] * w.rows[i, start + 2]
            for c in range(3):
                w.rows[i, start + c] -= part * u[c]


@helper
def solve_rows(m, w, index, values, level, goals, state, settings, free, step, work, basis, size, leading):
    """Solve the rows of a level that lead, or the others, in what the basis leaves; returns their rank."""
    first, count = int(m.levels[level, 0]), int(m.levels[level, 1])
    used, longest = 0, 0.0
    capacity = w.small.shape[1]
    right, answer = w.small.shape[0] - 3, w.small.shape[0] - 1
    wishes = level <= free
    for b in range(first, first + count):
        if w.block[b, 2] != EQUAL and w.block[b, 2] != ENFORCED:
            continue
        r = index[b, packing.FIRST]
        special = index[b, packing.KIND] == packing.FLEXT
        if leading != (special and index[b, packing.OPTION] & packing.SECANT > 0):
            continue
        if special:
            t = index[b, packing.TASK]
            goal = (goals[t, 0], goals[t, 1], goals[t, 2])
            build_flext(m, w, index, values, b, goal, state, settings.gain if wishes else 0.0, step)
        held = index[b, packing.KIND] == packing.DRAG and index[b, packing.OPTION] & packing.SECANT > 0
        for k in range(index[b, packing.COUNT]):
            i = work + used
            linear.copy(w.rows, i, r + k)
            longest = max(longest, linear.dot(w.rows, i, i))
            left = w.row[r + k, 0] if wishes or special else 0.0
            # FLEXT has allowed for higher levels; a secant row holds what the limb has been given.
            if not special and not held:
                left -= linear.dot(w.rows, r + k, step)
            w.small[right, used] = left
            mask(m, w, i)
            if special and linear.dot(w.rows, i, i) < 0.25:
                continue  # the hinge is at its limit: the root alone does not change the limb's length
            used += 1
    if used == 0 or used > capacity:
        return 0
    threshold = max(1e-6, settings.rank * sqrt(longest))
    rank = linear.extend_basis(w.rows, work, used, basis, size, w.small, threshold)
    if rank == 0:
        return 0
    linear.solve_damped(w.small, used, rank, right, answer, m.levels[level, 2], threshold)
    for k in range(rank):
        linear.add(w.rows, step, w.small[answer, k], basis + size + k)
    return rank


@helper
def prioritized_step(m, w, index, values, goals, state, settings, free, fixed, step, posture, work, basis):
    """Coordinate changes of all levels and of the posture into row ``step``; below ``free`` levels hold."""
    linear.copy(w.rows, step, fixed)
    size = 0
    for level in range(len(m.levels)):
        # FLEXT rows of the secant form go first: they move the limb, the rows of its directions occupy.
        for leading in (True, False):
            rank = solve_rows(
                m, w, index, values, level, goals, state, settings, free, step, work, basis, size, leading
            )
            size += 0 if leading else rank
    if posture >= 0:
        linear.copy(w.rows, work, posture)
        mask(m, w, work)
        linear.reject(w.rows, work, basis, basis + size, linear.dot(w.rows, work, work))
        linear.add(w.rows, step, 1.0, work)
    return size


@helper
def scale_step(m, w, settings, step, share):
    """Take a share of the step, or less so that no angle and no translation exceeds its cap."""
    angle, shift = 0.0, 0.0
    first = 3 if m.free else 0
    for c in range(first, len(m.hinges)):
        angle = max(angle, abs(w.rows[step, c]))
    for j in range(len(m.parent)):
        if m.kind[j] == BALL:
            s = m.start[j]
            angle = max(angle, vec.norm((w.rows[step, s], w.rows[step, s + 1], w.rows[step, s + 2])))
    if m.free:
        shift = vec.norm((w.rows[step, 0], w.rows[step, 1], w.rows[step, 2]))
    factor = share
    if angle * factor > settings.max_angle:
        factor = settings.max_angle / angle
    if shift * factor > settings.max_shift:
        factor = settings.max_shift / shift
    if factor < 1.0:
        for c in range(len(m.hinges)):
            w.rows[step, c] *= factor
