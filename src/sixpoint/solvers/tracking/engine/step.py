"""One step: all markers by least squares, while the important ones stay within their tolerance.

The levels of prioritized IK, each held to its tolerance before those below it. Within their tolerances the
clusters of all levels share what a figure of rods cannot follow: one damped least squares problem. A cluster
that its solution would leave farther off than its tolerance becomes an equality at its level, and joints that
leave their limits are locked; then it is solved again.

Reference: Baerlocher and Boulic 2004, sections 3 and 4 (levels, clamping loop); Boulic and Raunhardt 2009.
"""

from math import sqrt

from sixpoint.kernels import linear
from sixpoint.kernels.jit import algebra, helper
from sixpoint.solvers.prioritized.engine import packing as pk
from sixpoint.solvers.prioritized.engine.limits import lock_violations, release
from sixpoint.solvers.prioritized.engine.step import mask
from sixpoint.solvers.prioritized.engine.wishes import EQUAL
from sixpoint.solvers.tracking.engine import packing as tp

ROUNDS = 6  # times that what is violated is added
SHORTEST = 0.05  # an equality whose row is shorter than this is out of reach [m]
STIFF = 0.03  # damping of equalities [m]


@algebra
def add_square(normal, i, factor, rows, k):
    """Row i of a matrix, up to the diagonal, += factor * row k."""
    for c in range(i + 1):
        normal[i, c] += factor * rows[k, c]


@algebra
def dot_rows(normal, i, k, count):
    total = 0.0
    for c in range(count):
        total += normal[i, c] * normal[k, c]
    return total


@helper
def add_equation(normal, w, r, left):
    """Add a row and what it asks for to the normal equations; the right side is their last row."""
    columns = normal.shape[1]
    for c in range(columns):
        x = w.rows[r, c]
        if x != 0.0:
            add_square(normal, c, x, w.rows, r)
            normal[columns, c] += x * left


@helper
def factorise(normal):
    """Cholesky factor of the lower triangle, in place."""
    for i in range(normal.shape[1]):
        for k in range(i):
            normal[i, k] = (normal[i, k] - dot_rows(normal, i, k, k)) / normal[k, k]
        normal[i, i] = sqrt(max(normal[i, i] - dot_rows(normal, i, i, i), 1e-30))


@helper
def substitute(normal):
    """Solve with the factor, in place in the last row."""
    n = normal.shape[1]
    for i in range(n):
        normal[n, i] = (normal[n, i] - dot_rows(normal, n, i, i)) / normal[i, i]
    for i in range(n - 1, -1, -1):
        x = normal[n, i] / normal[i, i]
        normal[n, i] = x
        for c in range(i):
            normal[n, c] -= x * normal[i, c]


@helper
def least_squares(m, w, index, fixed, basis, size, held, damping, posture, normal):
    """Add to the step what fits all clusters best in what equalities and locks leave."""
    step, work, columns = fixed + 1, fixed + 3, len(m.hinges)
    for i in range(columns + 1):
        for c in range(columns):
            normal[i, c] = 0.0
    for b in range(len(index)):
        if w.block[b, 2] != EQUAL:
            continue
        for k in range(index[b, pk.COUNT]):
            r = index[b, pk.FIRST] + k
            left = w.row[r, 0]
            if held:
                left -= linear.dot(w.rows, r, step)
                linear.copy(w.rows, work, r)
                mask(m, w, work)
                if size:
                    linear.reject(w.rows, work, basis, basis + size, linear.dot(w.rows, work, work))
                r = work
            add_equation(normal, w, r, left)
    square = damping * damping
    if posture >= 0:
        linear.copy(w.rows, work, posture)
        mask(m, w, work)
        if size:
            linear.reject(w.rows, work, basis, basis + size, linear.dot(w.rows, work, work))
    for c in range(columns):
        normal[c, c] += square
        if posture >= 0:
            normal[columns, c] += square * w.rows[work, c]
    factorise(normal)
    substitute(normal)
    for c in range(columns):
        w.rows[step, c] += normal[columns, c]


@helper
def equality_row(w, index, forced, b, target):
    """Write the equality of a block into a row: along its direction it stays at its tolerance."""
    linear.clear(w.rows, target)
    r = index[b, pk.FIRST]
    for k in range(3):
        linear.add(w.rows, target, forced[b, k], r + k)


@helper
def solve_equalities(m, w, index, forced, fixed, basis):
    """The equalities of all levels in their order; returns how many directions they take."""
    step, work = fixed + 1, fixed + 3
    right, answer = w.small.shape[0] - 3, w.small.shape[0] - 1
    size = 0
    for level in range(len(m.levels)):
        first, count, used = int(m.levels[level, 0]), int(m.levels[level, 1]), 0
        for b in range(first, first + count):
            if forced[b, 4] == 0.0 or used >= w.small.shape[1]:
                continue
            equality_row(w, index, forced, b, work + used)
            w.small[right, used] = forced[b, 3] - linear.dot(w.rows, work + used, step)
            mask(m, w, work + used)
            used += 1
        if used == 0:
            continue
        rank = linear.extend_basis(w.rows, work, used, basis, size, w.small, SHORTEST)
        if rank == 0:
            continue
        linear.solve_normal(w.small, used, rank, right, answer, STIFF)
        for k in range(rank):
            linear.add(w.rows, step, w.small[answer, k], basis + size + k)
        size += rank
    return size


@helper
def force_clusters(w, index, values, clusters, forced, step):
    """Make equalities of clusters that the step leaves off by more than they may be; whether there are."""
    found = False
    for k in range(len(clusters)):
        b = clusters[k, tp.MOVE]
        if clusters[k, tp.LAST] > 0 or w.block[b, 2] != EQUAL or forced[b, 4] > 0.0:
            continue
        r, weight = index[b, pk.FIRST], w.block[b, 3]
        square, tolerance = 0.0, values[b, pk.TOLERANCE]
        for c in range(3):
            forced[b, c] = (w.row[r + c, 0] - linear.dot(w.rows, r + c, step)) / weight
            square += forced[b, c] * forced[b, c]
        if square <= tolerance * tolerance:
            continue
        length, wish = sqrt(square), 0.0
        for c in range(3):
            forced[b, c] /= length * weight
            wish += forced[b, c] * w.row[r + c, 0]
        forced[b, 3], forced[b, 4] = wish - tolerance, 1.0
        found = True
    return found


@helper
def hold_others(m, w, speed):
    """Lock all but the joints that are back after a gap: they come to the body, not it to them."""
    if m.free and speed[m.base, 3] == 0.0:
        for c in range(3):
            w.locked[c] = 1
    for j in range(len(m.parent)):
        if speed[j, 3] == 0.0:
            for c in range(m.start[j], m.start[j] + m.size[j]):
                w.locked[c] = 1


@helper
def solve_step(
    m, w, balls, index, values, clusters, forced, state, damping, o, posture, normal, alone, speed
):
    """Coordinate changes into row ``fixed + 1``: solve, add what is violated, solve again.

    With ``alone`` only joints that are back after a gap move, and all levels are one: the way may be far.
    """
    fixed = len(w.row)
    step, basis = fixed + 1, fixed + 3 + w.small.shape[1]
    linear.clear(w.rows, fixed)
    release(m, w)
    for b in range(len(index)):
        forced[b, 4] = 0.0
    held = alone
    if alone:
        hold_others(m, w, speed)
    for _ in range(ROUNDS):
        linear.copy(w.rows, step, fixed)
        size = solve_equalities(m, w, index, forced, fixed, basis) if held else 0
        least_squares(m, w, index, fixed, basis, size, held, damping, posture, normal)
        added = not alone and force_clusters(w, index, values, clusters, forced, step)
        if o.limits and lock_violations(m, w, balls, state, step, fixed):
            added = True
        if not added:
            return
        held = True
