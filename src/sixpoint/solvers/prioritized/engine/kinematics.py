"""Forward kinematics, axes and Jacobian rows of a tree of ball joints and hinges."""

from math import cos, sin

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.solvers.prioritized.engine.packing import BALL, HINGES


@helper
def compute_world(m, w, state):
    """World positions and rotations of all joints, and the world axis of every column."""
    joints = len(m.parent)
    for j in range(joints):
        p = m.parent[j]
        if p < 0:
            above = (0.0, 0.0, 0.0, 1.0)
            place = vec.load(m.offsets, 0)
        else:
            above = qt.load(w.rotation, p)
            place = vec.add(vec.load(w.position, p), qt.mul_vec(above, vec.load(m.offsets, j)))
        if j == m.base:
            place = vec.load(state, joints)
        vec.store(w.position, j, place)
        here = above
        if m.kind[j] == BALL:
            start = m.start[j]
            vec.store(w.axis, start, qt.x_axis(above))
            vec.store(w.axis, start + 1, qt.y_axis(above))
            vec.store(w.axis, start + 2, qt.z_axis(above))
            here = qt.mul(above, qt.load(state, j))
        elif m.kind[j] == HINGES:
            for k in range(m.size[j]):
                c = m.start[j] + k
                axis = vec.load(m.hinges, c)
                vec.store(w.axis, c, qt.mul_vec(here, axis))
                half = 0.5 * state[joints + 1 + j, k]
                s = sin(half)
                here = qt.mul(here, (s * axis[0], s * axis[1], s * axis[2], cos(half)))
        qt.store(w.rotation, j, here)


@helper
def place_of(m, w, joint, offset):
    """World position of a point fixed to a joint."""
    return vec.add(vec.load(w.position, joint), qt.mul_vec(qt.load(w.rotation, joint), offset))


@helper
def add_row(m, w, r, joint, point, along, about):
    """Row r += along . (velocity of a point the joint carries) + about . (the joint's angular velocity)."""
    rows = w.rows
    j = joint
    while j >= 0:
        if m.size[j] > 0:
            arm = vec.sub(point, vec.load(w.position, j))
            moment = vec.add(vec.cross(arm, along), about)
            for c in range(m.start[j], m.start[j] + m.size[j]):
                rows[r, c] += w.axis[c, 0] * moment[0] + w.axis[c, 1] * moment[1] + w.axis[c, 2] * moment[2]
        if j == m.base and m.free:
            rows[r, 0] += along[0]
            rows[r, 1] += along[1]
            rows[r, 2] += along[2]
            return
        j = m.parent[j]


@helper
def motion_of(m, w, joint, point, dq):
    """How far a point that a joint carries moves, to first order, under the changes in row dq [m]."""
    rows = w.rows
    moved = (0.0, 0.0, 0.0)
    j = joint
    while j >= 0:
        if m.size[j] > 0:
            turn = (0.0, 0.0, 0.0)
            for c in range(m.start[j], m.start[j] + m.size[j]):
                turn = vec.madd(turn, rows[dq, c], vec.load(w.axis, c))
            moved = vec.add(moved, vec.cross(turn, vec.sub(point, vec.load(w.position, j))))
        if j == m.base and m.free:
            return vec.add(moved, (rows[dq, 0], rows[dq, 1], rows[dq, 2]))
        j = m.parent[j]
    return moved


@helper
def compute_masses(m, w):
    """Mass of every subtree and its centre of mass."""
    joints = len(m.parent)
    for j in range(joints):
        share = m.masses[j, 0]
        centre = place_of(m, w, j, (m.masses[j, 1], m.masses[j, 2], m.masses[j, 3]))
        w.mass[j, 0] = share
        w.mass[j, 1] = share * centre[0]
        w.mass[j, 2] = share * centre[1]
        w.mass[j, 3] = share * centre[2]
    for j in range(joints - 1, 0, -1):
        p = m.parent[j]
        for k in range(4):
            w.mass[p, k] += w.mass[j, k]


@helper
def add_mass_row(m, w, r, along):
    """Row r += along . (velocity of the body's centre of mass)."""
    rows = w.rows
    total = w.mass[0, 0]
    for j in range(len(m.parent)):
        share = w.mass[j, 0] / total
        if m.size[j] == 0 or share == 0.0:
            continue
        place = vec.load(w.position, j)
        arm = (
            w.mass[j, 1] / total - share * place[0],
            w.mass[j, 2] / total - share * place[1],
            w.mass[j, 3] / total - share * place[2],
        )
        moment = vec.cross(arm, along)
        for c in range(m.start[j], m.start[j] + m.size[j]):
            rows[r, c] += w.axis[c, 0] * moment[0] + w.axis[c, 1] * moment[1] + w.axis[c, 2] * moment[2]
    if m.free:
        share = w.mass[m.base, 0] / total
        rows[r, 0] += share * along[0]
        rows[r, 1] += share * along[1]
        rows[r, 2] += share * along[2]


@helper
def retract(m, w, state, dq):
    """Move the state along the coordinate changes in row dq."""
    rows = w.rows
    joints = len(m.parent)
    if m.free:
        for k in range(3):
            state[joints, k] += rows[dq, k]
    for j in range(joints):
        start = m.start[j]
        if m.kind[j] == BALL:
            turn = qt.exp((rows[dq, start], rows[dq, start + 1], rows[dq, start + 2]))
            qt.store(state, j, qt.normalised(qt.mul(turn, qt.load(state, j))))
        elif m.kind[j] == HINGES:
            for k in range(m.size[j]):
                state[joints + 1 + j, k] += rows[dq, start + k]


@helper
def locals_of_hinges(m, state):
    """Write the local rotations of the hinge joints into the state."""
    joints = len(m.parent)
    for j in range(joints):
        if m.kind[j] == HINGES:
            here = (0.0, 0.0, 0.0, 1.0)
            for k in range(m.size[j]):
                axis = vec.load(m.hinges, m.start[j] + k)
                here = qt.mul(here, qt.from_axis_angle(axis, state[joints + 1 + j, k]))
            qt.store(state, j, here)
