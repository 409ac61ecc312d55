"""Each kind of constraint: its error, its wanted change and its rows of the Jacobian.

Rows that are angles are scaled by ``RADIAN`` so that they stand beside metres at one level.

Reference: Baerlocher and Boulic 2004; Boulic and Raunhardt 2009; Peinado et al. 2009 for obstacles.
"""

from math import atan2, pi, tan

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.distance import GRID, grid_distance, signed_distance
from sixpoint.kernels.jit import helper
from sixpoint.kernels.linear import clear
from sixpoint.solvers.prioritized.engine import packing
from sixpoint.solvers.prioritized.engine.kinematics import (
    add_mass_row,
    add_row,
    compute_masses,
    place_of,
)
from sixpoint.solvers.prioritized.engine.limb_rows import build_drag, build_tangential
from sixpoint.solvers.prioritized.engine.packing import FIRST, JOINT, KIND, MIDDLE, ROOT
from sixpoint.solvers.prioritized.engine.support import compute_hull, inside_distance
from sixpoint.solvers.prioritized.engine.wishes import (
    ENFORCED,
    EQUAL,
    NONE,
    OFF,
    RADIAN,
    WAITING,
    X,
    Y,
    Z,
    limited,
    perpendicular,
    triple,
)


@helper
def known(goals, t, kind):
    """Whether the parts of the goal that a kind needs are finite numbers."""
    first, last = 0, 3
    if kind == packing.ORIENTATION:
        first, last = 3, 7
    elif kind == packing.PLANE or kind == packing.OBSTACLE:
        last = 7
    elif kind == packing.BALANCE or kind == packing.COUPLING:
        last = 0
    for k in range(first, last):
        if not abs(goals[t, k]) < 1e7:
            return False
    if last == 7:  # no rotation at all
        square = goals[t, 3] ** 2 + goals[t, 4] ** 2 + goals[t, 5] ** 2 + goals[t, 6] ** 2
        return square > 1e-12
    return True


@helper
def set_rows(w, r, error, factor, weight):
    for k in range(3):
        w.row[r + k, 0] = factor * weight * error[k]


@helper
def tangent_coordinates(q, ratio, w, r, start):
    """Rows r, r + 1, r + 2: ratio times the derivative of the rotation vector of q by its ball's columns."""
    v = qt.log(q)
    square = vec.dot(v, v)
    k = 1.0 / 12.0
    if square > 1e-6:
        phi = square**0.5
        k = 1.0 / square - 0.5 / (phi * tan(0.5 * phi)) if phi < pi - 1e-9 else 1.0 / square
    for c in range(3):
        e = (X, Y, Z)[c]
        once = vec.cross(v, e)
        d = vec.madd(vec.madd(e, -0.5, once), k, vec.cross(v, once))
        for i in range(3):
            w.rows[r + i, start + c] = ratio * d[i]
    return v


@helper
def build_unilateral(w, b, r, distance, gain, step, weight):
    """A distance that must not become negative: enforced at once if it is, otherwise it waits."""
    w.block[b, 0] = max(0.0, -distance)
    w.block[b, 1] = distance
    if distance < 0.0:
        w.block[b, 2] = ENFORCED
        w.row[r, 0] = weight * min(-gain * distance, step)
    else:
        w.block[b, 2] = WAITING


@helper
def build_directed(m, w, b, r, joint, point, axis, wanted, arm, gain, step, weight):
    """Two rows that turn an axis towards a unit direction; ``arm`` is 1 / distance for a gaze, else 0."""
    s = perpendicular(axis)
    t = vec.cross(axis, s)
    sine = vec.norm(vec.cross(axis, wanted))
    angle = atan2(sine, vec.dot(axis, wanted))
    scale = angle / sine if sine > 1e-9 else 1.0
    e = (scale * vec.dot(s, wanted), scale * vec.dot(t, wanted))
    if sine <= 1e-9 and angle > 1.0:
        e = (angle, 0.0)  # antiparallel: any way round
    w.block[b, 0] = angle
    factor = RADIAN * weight * limited(angle, gain, step)
    scaled = RADIAN * weight
    for k in range(2):
        along = (s, t)[k]
        w.row[r + k, 0] = factor * e[k]
        slip = vec.scale(scaled * arm, vec.reject(along, wanted))
        add_row(m, w, r + k, joint, point, slip, vec.scale(scaled, vec.cross(axis, along)))


@helper
def build_obstacle(m, w, index, values, b, goals, point, goal, gain):
    """A point outside a shape, which stands in the world or is carried by another joint."""
    r, t, root = index[b, FIRST], index[b, packing.TASK], index[b, ROOT]
    weight, shape = values[b, packing.WEIGHT], index[b, packing.SHAPE]
    carried = index[b, packing.OPTION] == packing.CARRIED
    q = qt.normalised((goals[t, 3], goals[t, 4], goals[t, 5], goals[t, 6]))
    if carried:
        goal = place_of(m, w, root, goal)
        q = qt.mul(qt.load(w.rotation, root), q)
    inside = qt.inv_mul_vec(q, vec.sub(point, goal))
    if shape == GRID:
        found = grid_distance(m.grids, index[b, MIDDLE], inside)
    else:
        found = signed_distance(shape, triple(values, b, packing.SIZE), inside)
    normal = vec.scale(weight, qt.mul_vec(q, (found[1], found[2], found[3])))
    gap = found[0] - values[b, packing.RATIO]
    build_unilateral(w, b, r, gap, gain, values[b, packing.STEP], weight)
    add_row(m, w, r, index[b, JOINT], point, normal, NONE)
    if carried:
        add_row(m, w, r, root, point, vec.scale(-1.0, normal), NONE)


@helper
def build_block(m, w, index, values, b, goals, state, gain):
    """Error, wanted change and rows of one block (``FLEXT``: the error alone; see ``build_flext``)."""
    kind, r, t, joint = index[b, KIND], index[b, FIRST], index[b, packing.TASK], index[b, JOINT]
    w.block[b, 0] = 0.0
    if not known(goals, t, kind):
        w.block[b, 2] = OFF
        return
    w.block[b, 2] = EQUAL
    weight, step = values[b, packing.WEIGHT], values[b, packing.STEP]
    goal = (goals[t, 0], goals[t, 1], goals[t, 2])
    for k in range(index[b, packing.COUNT]):
        clear(w.rows, r + k)
    point = place_of(m, w, joint, triple(values, b, packing.OFFSET))
    if kind == packing.POSITION:
        e = vec.sub(goal, point)
        w.block[b, 0] = vec.norm(e)
        set_rows(w, r, e, limited(w.block[b, 0], gain, step), weight)
        for k in range(3):
            add_row(m, w, r + k, joint, point, vec.scale(weight, (X, Y, Z)[k]), NONE)
    elif kind == packing.FLEXT:
        w.block[b, 0] = vec.norm(vec.sub(goal, point))
    elif kind == packing.TANGENTIAL:
        build_tangential(m, w, index, values, b, point, goal, gain)
    elif kind == packing.DRAG:
        build_drag(m, w, index, values, b, goal, state, gain)
    elif kind == packing.ORIENTATION:
        q = qt.normalised((goals[t, 3], goals[t, 4], goals[t, 5], goals[t, 6]))
        here = qt.load(w.rotation, joint)
        e = qt.log(qt.mul(q, qt.inv(here)))
        w.block[b, 0] = vec.norm(e)
        set_rows(w, r, e, limited(w.block[b, 0], gain, step), RADIAN * weight)
        for k in range(3):
            add_row(m, w, r + k, joint, point, NONE, vec.scale(RADIAN * weight, (X, Y, Z)[k]))
    elif kind == packing.LOOK_AT or kind == packing.ALIGNMENT:
        axis = qt.mul_vec(qt.load(w.rotation, joint), triple(values, b, packing.DIRECTION))
        arm = 0.0
        wanted = goal
        if kind == packing.LOOK_AT:
            wanted = vec.sub(goal, point)
            arm = 1.0 / max(vec.norm(wanted), 1e-3)
        wanted = vec.unit(wanted)
        if vec.dot(wanted, wanted) < 0.5:
            w.block[b, 2] = OFF
            return
        build_directed(m, w, b, r, joint, point, axis, wanted, arm, gain, step, weight)
    elif kind == packing.PLANE or kind == packing.OBSTACLE:
        build_obstacle(m, w, index, values, b, goals, point, goal, gain)
    elif kind == packing.BALANCE:
        compute_masses(m, w)
        x, z = w.mass[0, 1] / w.mass[0, 0], w.mass[0, 3] / w.mass[0, 0]
        inner = inside_distance(w.hull, compute_hull(m, w), x, z, values[b, packing.RATIO])
        build_unilateral(w, b, r, inner[0], gain, step, weight)
        add_mass_row(m, w, r, (weight * inner[1], 0.0, weight * inner[2]))
    elif kind == packing.BALANCE_POINT:
        compute_masses(m, w)
        e = (goal[0] - w.mass[0, 1] / w.mass[0, 0], goal[2] - w.mass[0, 3] / w.mass[0, 0])
        w.block[b, 0] = (e[0] * e[0] + e[1] * e[1]) ** 0.5
        factor = weight * limited(w.block[b, 0], gain, step)
        for k in range(2):
            w.row[r + k, 0] = factor * e[k]
            add_mass_row(m, w, r + k, vec.scale(weight, (X, Z)[k]))
    elif kind == packing.COUPLING:
        build_coupling(m, w, index, values, b, state, gain, weight, step)


@helper
def build_coupling(m, w, index, values, b, state, gain, weight, step):
    """Coordinates of one joint = ratio times those of another: rotation vectors, or hinge angles."""
    r, joint, other, ratio = index[b, FIRST], index[b, JOINT], index[b, ROOT], values[b, packing.RATIO]
    joints = len(m.parent)
    scaled = RADIAN * weight
    e = NONE
    if m.kind[joint] == packing.BALL:
        v = tangent_coordinates(qt.load(state, joint), scaled, w, r, m.start[joint])
        u = tangent_coordinates(qt.load(state, other), -ratio * scaled, w, r, m.start[other])
        e = vec.sub(vec.scale(ratio, u), v)
    else:
        for k in range(m.size[joint]):
            w.rows[r + k, m.start[joint] + k] = scaled
            w.rows[r + k, m.start[other] + k] = -ratio * scaled
        e = vec.sub(
            vec.scale(ratio, vec.load(state, joints + 1 + other)), vec.load(state, joints + 1 + joint)
        )
    w.block[b, 0] = vec.norm(e)
    factor = scaled * limited(w.block[b, 0], gain, step)
    for k in range(index[b, packing.COUNT]):
        w.row[r + k, 0] = factor * e[k]
