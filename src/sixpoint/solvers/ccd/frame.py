"""Cyclic Coordinate Descent: turn one joint after another so that the end comes nearest to its target.

As Unzueta et al. 2008 set it up for a whole body: the root is placed and turned by its estimate, then the
spine is solved, then each clavicle with its arm, then the legs, each from the pose of the last frame. What
the spine misses is shared between pelvis and head.

References: Wang and Chen, "A combined optimization method for solving the inverse kinematics problem of
mechanical manipulators", IEEE Transactions on Robotics and Automation 7 (1991) 489-499; Unzueta et al. 2008,
section 9.
"""

from math import atan2

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper
from sixpoint.kernels.swing_twist import clamp
from sixpoint.solvers.six_points.frame import (
    MEMORY_ROWS,
    REACHED,
    end_trunk,
    estimate_pelvis,
    fill_lost,
    judge,
    write_frame,
)
from sixpoint.solvers.six_points.packing import unpack_model
from sixpoint.solvers.six_points.tree import (
    BALL,
    FIXED,
    clamp_hinge,
    end_position,
    place_chain,
    unpack_tree,
)

SWEEPS = 20  # the stop rule of Unzueta et al. 2008, section 9: 20 iterations, 1 cm, or a gain below 1 mm
GAIN = 1e-3  # m
NEAR = 1e-6  # m, a lever shorter than this turns nothing
STRAIGHT = 1e-3  # rad, a limb flexed by less is at its dead point
KINK = 0.3  # rad, the flexion that gets it off: about what 1 cm of a limb needs
X = (1.0, 0.0, 0.0)


@helper
def arc_between(a, b, fallback):
    """Shortest rotation from the direction of a to that of b; none where one has no length."""
    la, lb = vec.norm(a), vec.norm(b)
    if la < NEAR or lb < NEAR:
        return qt.IDENTITY
    return qt.arc(vec.scale(1.0 / la, a), vec.scale(1.0 / lb, b), fallback)


@helper
def hinge_angle(axis, a, b):
    """Turn about a unit axis that brings a nearest to b."""
    s = vec.dot(axis, vec.cross(a, b))
    c = vec.dot(a, b) - vec.dot(a, axis) * vec.dot(b, axis)
    if abs(s) < 1e-12 and abs(c) < 1e-12:
        return 0.0
    return atan2(s, c)


@helper
def turn_joint(tree, balls, limits, j, end, target, local, world, positions):
    """Turn joint j so that the end comes nearest to its target; returns the end's new place."""
    place, before = vec.load(positions, j), qt.load(world, j)
    parent = qt.load(world, tree.parents[j])
    a, b = vec.sub(end, place), vec.sub(target, place)
    if tree.kind[j] == BALL:
        turn = arc_between(a, b, qt.x_axis(before))
        q = qt.normalised(qt.inv_mul(parent, qt.mul(turn, before)))
        if limits:
            q, _ = clamp(balls, j, q)
    else:
        axis = qt.x_axis(before)
        q = qt.normalised(qt.mul(qt.load(local, j), qt.from_axis_angle(X, hinge_angle(axis, a, b))))
        if limits:
            q = clamp_hinge(tree.ranges, j, q)
    qt.store(local, j, q)
    after = qt.mul(parent, q)
    qt.store(world, j, after)
    return vec.add(place, qt.mul_vec(after, qt.inv_mul_vec(before, a)))


@helper
def sweep(tree, balls, limits, from_root, first, count, stride, end, target, local, world, positions):
    """One pass over a chain, from its tip to its root or back; its joints are placed before and after."""
    place = end_position(tree.offsets, tree.ends, world, positions, end)
    for k in range(count):
        j = first + stride * (k if from_root else count - 1 - k)
        if tree.kind[j] == FIXED:
            continue
        place = turn_joint(tree, balls, limits, j, place, target, local, world, positions)
        if from_root:
            place_chain(tree.offsets, tree.parents, local, first, count, stride, world, positions)
    place_chain(tree.offsets, tree.parents, local, first, count, stride, world, positions)
    return end_position(tree.offsets, tree.ends, world, positions, end)


@helper
def solve_spine(tree, balls, limits, from_root, count, pelvis, head, local, world, positions):
    """The trunk of ``count`` joints: sweeps, each followed by sharing what is missed with the pelvis.

    Returns the head's place and the number of sweeps; the pelvis is the first position.
    """
    qt.store(world, 0, qt.load(local, 0))
    vec.store(positions, 0, pelvis)
    place_chain(tree.offsets, tree.parents, local, 1, count - 1, 1, world, positions)
    error, sweeps = 1e300, 0
    top = end_position(tree.offsets, tree.ends, world, positions, 0)
    while sweeps < SWEEPS:
        before = error
        top = sweep(tree, balls, limits, from_root, 1, count - 1, 1, 0, head, local, world, positions)
        chord = vec.sub(top, vec.load(positions, 0))
        missed = vec.sub(vec.sub(head, pelvis), chord)
        shift = vec.sub(vec.madd(pelvis, 0.5, missed), vec.load(positions, 0))
        for k in range(count):
            vec.store(positions, k, vec.add(vec.load(positions, k), shift))
        top = vec.add(top, shift)
        error = 0.5 * vec.norm(missed)
        sweeps += 1
        if error < REACHED or (sweeps > 1 and before - error < GAIN):
            break
    return top, sweeps


@helper
def solve_chain(tree, balls, limits, from_root, first, count, end, target, local, world, positions):
    """A limb whose joints are two rows apart, its hinge the last; returns sweeps and residual."""
    hinge = first + 2 * (count - 1)
    place_chain(tree.offsets, tree.parents, local, first, count, 2, world, positions)
    error = vec.norm(vec.sub(target, end_position(tree.offsets, tree.ends, world, positions, end)))
    if error > REACHED and abs(qt.twist_angle(qt.load(local, hinge), X)) < STRAIGHT:
        # All turns of a straight limb towards a target on its line are zero, and a flexed hinge would turn
        # back if it came first: so flex it and turn the joints above.
        angle = KINK if tree.ranges[hinge, 1] > -tree.ranges[hinge, 0] else -KINK  # the way it flexes
        qt.store(local, hinge, qt.from_axis_angle(X, angle))
        place_chain(tree.offsets, tree.parents, local, first, count, 2, world, positions)
        sweep(tree, balls, limits, True, first, count - 1, 2, end, target, local, world, positions)
        place_chain(tree.offsets, tree.parents, local, first, count, 2, world, positions)
    error, sweeps = 1e300, 0
    while sweeps < SWEEPS:
        before = error
        place = sweep(tree, balls, limits, from_root, first, count, 2, end, target, local, world, positions)
        error = vec.norm(vec.sub(target, place))
        sweeps += 1
        if error < REACHED or (sweeps > 1 and before - error < GAIN):
            break
    return sweeps, error


@helper
def solve_frame(model, tree, options, points, local, memory, residual, world, positions, filled):
    """Solve one frame; returns status and the largest number of sweeps of a chain."""
    limits, from_root = options[3] > 0.0, options[4] > 0.0
    count = model.segments.shape[0]
    lost = fill_lost(points, filled, memory, model.chords[0])
    x, y = estimate_pelvis(filled, memory, options[0], options[1], options[2])
    qt.store(local, 0, qt.from_axes(x, y, vec.cross(x, y)))
    pelvis, head = vec.load(filled, 0), vec.load(filled, 1)
    top, most = solve_spine(
        tree, model.balls, limits, from_root, count, pelvis, head, local, world, positions
    )
    end_trunk(filled, memory, x, y, vec.load(positions, 0), top, residual)
    for limb in range(4):
        residual[limb + 2] = 0.0
        if filled[limb + 2, 3] == 0.0:
            continue
        first, joints = (count + limb, 3) if limb < 2 else (count + 4 + limb, 2)
        target = vec.load(filled, limb + 2)
        sweeps, residual[limb + 2] = solve_chain(
            tree, model.balls, limits, from_root, first, joints, limb + 1, target, local, world, positions
        )
        most = max(most, sweeps)
    return judge(lost, residual), most


@entry
def solve_ccd(
    table,
    integers,
    balls,
    chords,
    tree_table,
    tree_integers,
    work,
    options,
    points,
    state,
    rotations,
    pelvis,
    outcome,
    residual,
):
    """Solve F frames in order; see ``SixPointSolver``."""
    model = unpack_model(table, integers, balls, chords)
    tree = unpack_tree(tree_table, tree_integers)
    rows = state.shape[0] - MEMORY_ROWS
    local, memory = state[:rows], state[rows:]
    world, positions, filled = work[:rows], work[rows : 2 * rows], work[2 * rows :]
    for f in range(points.shape[0]):
        outcome[f, 0], outcome[f, 1] = solve_frame(
            model, tree, options, points[f], local, memory, residual[f], world, positions, filled
        )
        write_frame(model, local, memory, rotations[f], pelvis[f])
