"""Rows of a cluster of markers: three for its centre and up to three about its principal axes.

The least squares problem of n markers on one segment has the normal equations of the segment's six rates.
About the centre of the markers that are seen they split into the centre's shift and a turn whose matrix is
the cluster's inertia; its eigenvectors make six rows that are worth all 3 n, and tell which turn no marker
sees: an axis with a lever below 5 mm has no row.
"""

from math import sqrt

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.linear import clear
from sixpoint.solvers.prioritized.engine import flext
from sixpoint.solvers.prioritized.engine import packing as pk
from sixpoint.solvers.prioritized.engine.kinematics import add_row
from sixpoint.solvers.prioritized.engine.limb_rows import build_tangential, flext_wish, limb_of
from sixpoint.solvers.prioritized.engine.wishes import EQUAL, NONE, OFF, X, Y, Z
from sixpoint.solvers.tracking.engine import packing as tp

LEVER = 5e-3  # about an axis that is nearer than this to all markers nothing is known [m]
FLOOR = 1e-12


@helper
def jacobi_eigen(a, v):
    """Eigenvalues on the diagonal of the symmetric 3 x 3 corner of a, eigenvectors as columns of v."""
    for i in range(3):
        for k in range(3):
            v[i, k] = 1.0 if i == k else 0.0
    for _ in range(12):
        off = a[0, 1] * a[0, 1] + a[0, 2] * a[0, 2] + a[1, 2] * a[1, 2]
        size = a[0, 0] * a[0, 0] + a[1, 1] * a[1, 1] + a[2, 2] * a[2, 2]
        if off <= 1e-18 * size + 1e-30:
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if a[p, q] == 0.0:
                    continue
                theta = 0.5 * (a[q, q] - a[p, p]) / a[p, q]
                t = (1.0 if theta >= 0.0 else -1.0) / (abs(theta) + sqrt(theta * theta + 1.0))
                c = 1.0 / sqrt(t * t + 1.0)
                s = t * c
                for k in range(3):
                    x, y = a[k, p], a[k, q]
                    a[k, p] = c * x - s * y
                    a[k, q] = s * x + c * y
                for k in range(3):
                    x, y = a[p, k], a[q, k]
                    a[p, k] = c * x - s * y
                    a[q, k] = s * x + c * y
                for k in range(3):
                    x, y = v[k, p], v[k, q]
                    v[k, p] = c * x - s * y
                    v[k, q] = s * x + c * y


@helper
def place_in_joint(numbers, memory, i):
    """Where a marker is taken to sit in its joint's frame: its place, and how much of its distance counts."""
    trust = memory[i, tp.TRUST]
    return (
        numbers[i, 0] + trust * memory[i, 0],
        numbers[i, 1] + trust * memory[i, 1],
        numbers[i, 2] + trust * memory[i, 2],
    )


@helper
def centre_of(numbers, memory, flags, goal, first, count):
    """Weight of the used markers of a cluster, their centre in the joint's frame, and that of their goals."""
    total, local, there = 0.0, NONE, NONE
    for i in range(first, first + count):
        if flags[i] == tp.USED or flags[i] == tp.SWAPPED:
            weight = numbers[i, tp.WEIGHT]
            total += weight
            local = vec.madd(local, weight, place_in_joint(numbers, memory, i))
            there = vec.madd(there, weight, vec.load(goal, i))
    if total > 0.0:
        local, there = vec.scale(1.0 / total, local), vec.scale(1.0 / total, there)
    return total, local, there


@helper
def build_radial(m, w, index, values, b, r, goal, error, scale, state):
    """The row along a limb in FLEXT's secant form: the hinge counts by what it does to the limb's length.

    Near full extension the derivative vanishes; the secant over the wished change does not.
    """
    low, high, side = values[b, pk.LOW], values[b, pk.HIGH], values[b, pk.SIDE]
    root, middle, end, axis, angle = limb_of(m, w, index, values, b, state)
    l1, l2, l3, sigma, alpha, wish, low, high = flext_wish(
        root, middle, end, axis, angle, goal, NONE, NONE, low, high
    )
    u = vec.unit(vec.sub(end, root))
    w.row[r, 0] = scale * vec.dot(u, error)
    add_row(m, w, r, index[b, pk.JOINT], end, vec.scale(scale, u), NONE)
    slope = flext.secant(l1, l2, l3, sigma, alpha, wish, side, low, high)
    if slope != 0.0:
        w.rows[r, m.start[index[b, pk.MIDDLE]]] = scale * slope


@helper
def build_cluster(m, w, index, values, clusters, numbers, memory, flags, goal, k, state, tensor):
    """Rows and wanted changes of one cluster."""
    joint, first, count = clusters[k, tp.JOINT], clusters[k, tp.FIRST], clusters[k, tp.COUNT]
    turns, move = clusters[k, tp.TURN], clusters[k, tp.MOVE]
    total, local, there = centre_of(numbers, memory, flags, goal, first, count)
    if total <= 0.0:
        w.block[move, 2], w.block[turns, 2] = OFF, OFF
        return
    turned = qt.load(w.rotation, joint)
    point = vec.add(vec.load(w.position, joint), qt.mul_vec(turned, local))
    scale = sqrt(total)
    error = vec.sub(there, point)
    w.block[move, 0], w.block[move, 2], w.block[move, 3] = vec.norm(error), EQUAL, scale
    r = index[move, pk.FIRST]
    for c in range(3):
        clear(w.rows, r + c)
    if index[move, pk.KIND] == pk.POSITION:
        for axis in range(3):
            w.row[r + axis, 0] = scale * error[axis]
            add_row(m, w, r + axis, joint, point, vec.scale(scale, (X, Y, Z)[axis]), NONE)
    else:
        values[move, pk.OFFSET], values[move, pk.OFFSET + 1], values[move, pk.OFFSET + 2] = local
        values[move, pk.WEIGHT] = scale
        build_tangential(m, w, index, values, move, point, there, 1.0)
        build_radial(m, w, index, values, move, r + 2, there, error, scale, state)
    build_turn(m, w, index, numbers, memory, flags, goal, first, count, joint, local, there, turns, tensor)


@helper
def build_turn(m, w, index, numbers, memory, flags, goal, first, count, joint, local, there, b, tensor):
    """Rows about the principal axes of the used markers round their centre."""
    a, v = tensor[:3], tensor[3:]
    for i in range(3):
        for k in range(3):
            a[i, k] = 0.0
    turned = qt.load(w.rotation, joint)
    pull, total = NONE, 0.0
    for i in range(first, first + count):
        if flags[i] == tp.USED or flags[i] == tp.SWAPPED:
            weight = numbers[i, tp.WEIGHT]
            arm = qt.mul_vec(turned, vec.sub(place_in_joint(numbers, memory, i), local))
            error = vec.sub(vec.sub(vec.load(goal, i), there), arm)
            pull = vec.madd(pull, weight, vec.cross(arm, error))
            square = vec.dot(arm, arm)
            for r in range(3):
                a[r, r] += weight * square
                for c in range(3):
                    a[r, c] -= weight * arm[r] * arm[c]
            total += weight
    jacobi_eigen(a, v)
    used = 0
    for k in range(3):
        if a[k, k] <= LEVER * LEVER * total or a[k, k] < FLOOR:
            continue
        length = sqrt(a[k, k])
        axis = (v[0, k], v[1, k], v[2, k])
        r = index[b, pk.FIRST] + used
        clear(w.rows, r)
        w.row[r, 0] = vec.dot(axis, pull) / length
        add_row(m, w, r, joint, vec.load(w.position, joint), NONE, vec.scale(length, axis))
        used += 1
    index[b, pk.COUNT] = used
    w.block[b, 2] = EQUAL if used else OFF
