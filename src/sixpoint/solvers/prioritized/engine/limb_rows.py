"""Rows of a limb: flexion (FLEXT), the directions across the limb, and the one along it.

Reference: Boulic and Raunhardt 2009, sections 5.2, 5.3 and appendix A.
"""

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.linear import clear
from sixpoint.solvers.prioritized.engine import flext, packing
from sixpoint.solvers.prioritized.engine.kinematics import add_row, motion_of, place_of
from sixpoint.solvers.prioritized.engine.packing import FIRST, JOINT, MIDDLE, ROOT
from sixpoint.solvers.prioritized.engine.wishes import NONE, OFF, Y, limited, perpendicular, triple


@helper
def limb_of(m, w, index, values, b, state):
    """Root, middle, effector, axis, hinge angle of the limb of a FLEXT block."""
    joints = len(m.parent)
    middle = index[b, MIDDLE]
    root = vec.load(w.position, index[b, ROOT])
    axis = vec.load(w.axis, m.start[middle])
    end = place_of(m, w, index[b, JOINT], triple(values, b, packing.OFFSET))
    return root, vec.load(w.position, middle), end, axis, state[joints + 1 + middle, 0]


@helper
def flext_wish(root, middle, end, axis, angle, goal, lost_root, lost_end, low, high):
    """The triangle of a limb and how much L3 should grow for the goal [m], given predicted motions."""
    l1, l2, l3, sigma, alpha, offset = flext.triangle(root, middle, end, axis)
    gamma = flext.wrapped(sigma - angle)
    root_there, end_there = vec.add(root, lost_root), vec.add(end, lost_end)
    to_goal = vec.sub(goal, root_there)
    there = vec.dot(to_goal, to_goal) - offset * offset
    now = vec.sub(end_there, root_there)
    here = vec.dot(now, now) - offset * offset
    wish = max(there, 0.0) ** 0.5 - max(here, 0.0) ** 0.5
    return l1, l2, l3, sigma, alpha, wish, low + gamma, high + gamma


@helper
def build_flext(m, w, index, values, b, goal, state, gain, dq):
    """Row and task of a FLEXT block, given what higher levels already do (row ``dq``, or -1)."""
    r = index[b, FIRST]
    clear(w.rows, r)
    root, middle, end, axis, angle = limb_of(m, w, index, values, b, state)
    shift, lost = NONE, NONE
    if dq >= 0 and index[b, packing.OPTION] & packing.PREDICT:
        shift = motion_of(m, w, index[b, ROOT], root, dq)
        lost = motion_of(m, w, index[b, JOINT], end, dq)
    low, high = values[b, packing.LOW], values[b, packing.HIGH]
    l1, l2, l3, sigma, alpha, wish, low, high = flext_wish(
        root, middle, end, axis, angle, goal, shift, lost, low, high
    )
    wish = wish * limited(abs(wish), gain, values[b, packing.STEP])
    side = values[b, packing.SIDE]
    turn, bend, todo, _ = flext.solve_triangle(l1, l2, l3, sigma, alpha, wish, side, low, high)
    if todo < 0.0:
        return
    c = m.start[index[b, MIDDLE]]
    if index[b, packing.OPTION] & packing.HINGE_ONLY:
        w.rows[r, c] = 1.0
        w.row[r, 0] = todo * bend
    else:
        norm = add_root_turn(m, w, index, b, r, axis, turn, state)
        w.rows[r, c] = bend
        norm = (norm + bend * bend) ** 0.5
        for k in range(w.rows.shape[1]):
            w.rows[r, k] /= norm
        w.row[r, 0] = todo * norm
    if dq >= 0 and not index[b, packing.OPTION] & packing.PREDICT:
        for k in range(w.rows.shape[1]):
            w.row[r, 0] -= w.rows[r, k] * w.rows[dq, k]


@helper
def add_root_turn(m, w, index, b, r, axis, turn, state):
    """Write the root joint's part of the posture variation into row r; returns its squared norm."""
    j = index[b, ROOT]
    start = m.start[j]
    if m.kind[j] == packing.BALL:
        p = m.parent[j]
        local = axis if p < 0 else qt.inv_mul_vec(qt.load(w.rotation, p), axis)
        part = vec.scale(turn, local)
        if index[b, packing.OPTION] & packing.EXPONENTIAL:
            part = flext.exponential(qt.load(state, j), local, turn)
        for k in range(3):
            w.rows[r, start + k] = part[k]
        return vec.dot(part, part)
    # A sequence of hinges: the angles whose axes add up to the turn, least squares.
    square = 0.0
    part = hinges_for(m, w, j, vec.scale(turn, axis))
    for k in range(m.size[j]):
        w.rows[r, start + k] = part[k]
        square += part[k] * part[k]
    return square


@helper
def hinges_for(m, w, j, turn):
    """Angles of up to three hinges whose axes add up to a small turn, least squares (Gauss-Seidel)."""
    x = (0.0, 0.0, 0.0)
    a = vec.load(w.axis, m.start[j])
    b = vec.load(w.axis, m.start[j] + 1) if m.size[j] > 1 else NONE
    c = vec.load(w.axis, m.start[j] + 2) if m.size[j] > 2 else NONE
    for _ in range(20):
        rest = vec.sub(vec.sub(turn, vec.scale(x[1], b)), vec.scale(x[2], c))
        first = vec.dot(a, rest)
        rest = vec.sub(vec.sub(turn, vec.scale(first, a)), vec.scale(x[2], c))
        second = vec.dot(b, rest)
        rest = vec.sub(vec.sub(turn, vec.scale(first, a)), vec.scale(second, b))
        third = vec.dot(c, rest)
        change = abs(first - x[0]) + abs(second - x[1]) + abs(third - x[2])
        x = (first, second, third)
        if change < 1e-12:
            break
    return x


@helper
def build_tangential(m, w, index, values, b, point, goal, gain):
    """Two rows across the line from the limb's root to its end."""
    r, joint = index[b, FIRST], index[b, JOINT]
    weight, step = values[b, packing.WEIGHT], values[b, packing.STEP]
    e = vec.sub(goal, point)
    u = vec.unit(vec.sub(point, vec.load(w.position, index[b, ROOT])))
    if vec.dot(u, u) < 0.5:  # the effector is at the limb's root: no direction is radial
        u = vec.unit(e)
    if vec.dot(u, u) < 0.5:
        u = Y
    outward = vec.sub(goal, vec.load(w.position, index[b, ROOT]))
    e = vec.reject(e, u)
    if vec.norm(e) < 1e-6 and vec.dot(outward, u) < 0.0:  # right behind the root: any way round
        e = vec.scale(vec.norm(outward), perpendicular(u))
    factor = weight * limited(vec.norm(e), gain, step)
    s = perpendicular(u)
    for k in range(2):
        along = (s, vec.cross(u, s))[k]
        w.row[r + k, 0] = factor * vec.dot(along, e)
        add_row(m, w, r + k, joint, point, vec.scale(weight, along), NONE)


@helper
def build_drag(m, w, index, values, b, goal, state, gain):
    """The row along the limb.

    With FOLLOW it asks for what of the goal is out of the limb's reach. Without, in the secant form, it holds
    what the limb has been given; with YIELD only where the goal is within reach.
    """
    r, joint, option = index[b, FIRST], index[b, JOINT], index[b, packing.OPTION]
    weight, step = values[b, packing.WEIGHT], values[b, packing.STEP]
    root, middle, end, axis, angle = limb_of(m, w, index, values, b, state)
    low, high = values[b, packing.LOW], values[b, packing.HIGH]
    l1, l2, l3, sigma, alpha, wish, low, high = flext_wish(
        root, middle, end, axis, angle, goal, NONE, NONE, low, high
    )
    side = values[b, packing.SIDE]
    _, _, _, beyond = flext.solve_triangle(l1, l2, l3, sigma, alpha, wish, side, low, high)
    out = abs(beyond) > 1e-6
    u = vec.unit(vec.sub(end, root))
    if vec.dot(u, u) < 0.5 or (option & packing.FOLLOW and not out) or (option & packing.YIELD and out):
        w.block[b, 2] = OFF
        return
    w.row[r, 0] = 0.0
    add_row(m, w, r, joint, end, vec.scale(weight, u), NONE)
    if option & packing.FOLLOW:  # the body follows only as far as the limb points to the goal already
        beyond *= max(vec.dot(u, vec.unit(vec.sub(goal, root))), 0.0)
        w.row[r, 0] = weight * beyond * limited(abs(beyond), gain, step)
    if option & packing.SECANT:
        wish = wish * limited(abs(wish), gain, step)
        slope = flext.secant(l1, l2, l3, sigma, alpha, wish, side, low, high)
        w.rows[r, m.start[index[b, MIDDLE]]] = weight * slope
