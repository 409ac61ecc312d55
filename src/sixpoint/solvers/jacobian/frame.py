"""One frame of a Jacobian method: Jacobian, errors, step, limits, until the stop rule.

Ball joints are three hinges in sequence, R = Rot(X, a) Rot(Y, b) Rot(Z, c) ("follower" angles); elbows and
knees are one about X. A column of the Jacobian is the hinge's axis in the world x the lever to the end. Head,
wrists and ankles are solved at once; the root is placed and turned by its estimate.

Reference: Unzueta et al. 2008, section 9.
"""

from math import asin, atan2, cos, sin

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper
from sixpoint.kernels.swing_twist import clamp
from sixpoint.solvers.jacobian.steps import EXTRA, compute_step, error_row
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
    ENDS,
    FIXED,
    clamp_hinge,
    end_position,
    place_joints,
    unpack_tree,
)

M = 3 * ENDS
ITERATIONS = 20  # the stop rule of the paper: 20 iterations, 1 cm, or a gain below 1 mm
GAIN = 1e-3  # m
GIMBAL = 1.0 - 1e-13  # sine of the middle angle at which the outer two turn about one line
X = (1.0, 0.0, 0.0)

LEVERS, PART, STEP = 2 * M, 2 * M + ENDS, 2 * M + ENDS + 1
LONG_ROWS = STEP + 1
SMALL_ROWS = 2 * M + EXTRA


@helper
def euler_angles(q):
    """Angles of R = Rot(X, a) Rot(Y, b) Rot(Z, c); c = 0 in gimbal lock."""
    x, z = qt.x_axis(q), qt.z_axis(q)
    if abs(z[0]) > GIMBAL:
        y = qt.y_axis(q)
        return atan2(y[2], y[1]), (1.0 if z[0] > 0.0 else -1.0) * asin(1.0), 0.0
    y = qt.y_axis(q)
    return atan2(-z[1], z[2]), asin(z[0]), atan2(-y[0], x[0])


@helper
def from_euler(a, b, c):
    sa, ca, sb, cb, sc, cc = (
        sin(0.5 * a),
        cos(0.5 * a),
        sin(0.5 * b),
        cos(0.5 * b),
        sin(0.5 * c),
        cos(0.5 * c),
    )
    return (
        sa * cb * cc + ca * sb * sc,
        ca * sb * cc - sa * cb * sc,
        ca * cb * sc + sa * sb * cc,
        ca * cb * cc - sa * sb * sc,
    )


@helper
def fill_columns(rows, levers, column, axis, arm, block):
    """One column of one end's block: axis x arm, and its length."""
    v = vec.cross(axis, arm)
    for i in range(3):
        rows[3 * block + i, column] = v[i]
    levers[block, column] = vec.norm(v)


@helper
def fill_jacobian(tree, starts, filled, local, world, positions, rows, levers):
    """The Jacobian (15, n) of head, wrists and ankles; rows of a lost end are zero."""
    for i in range(M):
        for c in range(rows.shape[1]):
            rows[i, c] = 0.0
    for i in range(ENDS):
        for c in range(rows.shape[1]):
            levers[i, c] = 0.0
    for end in range(ENDS):
        if filled[end + 1, 3] == 0.0 and end > 0:
            continue
        place = end_position(tree.offsets, tree.ends, world, positions, end)
        j = tree.ends[end]
        while j >= 0:
            if tree.kind[j] != FIXED:
                arm = vec.sub(place, vec.load(positions, j))
                q, c = qt.load(world, j), starts[j]
                if tree.kind[j] == BALL:
                    above = qt.IDENTITY if j == 0 else qt.load(world, tree.parents[j])
                    a, _, _ = euler_angles(qt.load(local, j))
                    fill_columns(rows, levers, c, qt.x_axis(above), arm, end)
                    middle = qt.mul_vec(above, (0.0, cos(a), sin(a)))
                    fill_columns(rows, levers, c + 1, middle, arm, end)
                    fill_columns(rows, levers, c + 2, qt.z_axis(q), arm, end)
                else:
                    fill_columns(rows, levers, c, qt.x_axis(q), arm, end)
            j = tree.parents[j]


@helper
def apply_step(tree, balls, starts, limits, step, local):
    """Turn the joints by a step of their angles, then set them within their limits."""
    for j in range(tree.kind.shape[0]):
        if tree.kind[j] == FIXED:
            continue
        q, c = qt.load(local, j), starts[j]
        if tree.kind[j] == BALL:
            a, b, g = euler_angles(q)
            q = qt.normalised(from_euler(a + step[c], b + step[c + 1], g + step[c + 2]))
            if limits:
                q, _ = clamp(balls, j, q)
        else:
            q = qt.normalised(qt.mul(q, qt.from_axis_angle(X, step[c])))
            if limits:
                q = clamp_hinge(tree.ranges, j, q)
        qt.store(local, j, q)


@helper
def share_missed(tree, local, pelvis, head, world, positions):
    """Place all joints so that pelvis and head miss their targets alike (Algorithm 2, line 17)."""
    place_joints(tree.offsets, tree.parents, local, pelvis, world, positions)
    missed = vec.sub(head, end_position(tree.offsets, tree.ends, world, positions, 0))
    for j in range(positions.shape[0]):
        vec.store(positions, j, vec.madd(vec.load(positions, j), 0.5, missed))
    return 0.5 * vec.norm(missed)


@helper
def write_errors(tree, filled, world, positions, reach, small):
    """Errors of the ends, each at most ``reach`` long, into their row; returns the largest in full."""
    row, largest = error_row(small), 0.0
    for end in range(ENDS):
        e = (0.0, 0.0, 0.0)
        if filled[end + 1, 3] > 0.0 or end == 0:
            e = vec.sub(
                vec.load(filled, end + 1), end_position(tree.offsets, tree.ends, world, positions, end)
            )
        length = vec.norm(e)
        largest = max(largest, length)
        factor = reach / length if length > reach else 1.0
        for i in range(3):
            small[row, 3 * end + i] = factor * e[i]
    return largest


@helper
def solve_frame(
    model, tree, starts, options, points, local, memory, residual, world, positions, filled, long, small
):
    """Solve one frame; returns status and iterations."""
    limits, rule, damping, reach = options[3] > 0.0, int(options[4]), options[5], options[6]
    lost = fill_lost(points, filled, memory, model.chords[0])
    x, y = estimate_pelvis(filled, memory, options[0], options[1], options[2])
    qt.store(local, 0, qt.from_axes(x, y, vec.cross(x, y)))
    pelvis, head = vec.load(filled, 0), vec.load(filled, 1)
    rows, levers, part, step = long[: 2 * M], long[LEVERS:PART], long[PART], long[STEP]
    place_joints(tree.offsets, tree.parents, local, pelvis, world, positions)
    write_errors(tree, filled, world, positions, reach, small)
    error, iterations = 1e300, 0
    while iterations < ITERATIONS:
        before = error
        fill_jacobian(tree, starts, filled, local, world, positions, rows, levers)
        compute_step(rule, rows, M, small, damping, levers, part, step)
        apply_step(tree, model.balls, starts, limits, step, local)
        share_missed(tree, local, pelvis, head, world, positions)
        error = write_errors(tree, filled, world, positions, reach, small)
        iterations += 1
        if error < REACHED or (iterations > 1 and before - error < GAIN):
            break
    top = end_position(tree.offsets, tree.ends, world, positions, 0)
    end_trunk(filled, memory, x, y, vec.load(positions, 0), top, residual)
    for end in range(1, ENDS):
        gap = vec.sub(vec.load(filled, end + 1), end_position(tree.offsets, tree.ends, world, positions, end))
        residual[end + 1] = vec.norm(gap) if filled[end + 1, 3] > 0.0 else 0.0
    return judge(lost, residual), iterations


@entry
def solve_jacobian(
    table,
    integers,
    balls,
    chords,
    tree_table,
    tree_integers,
    starts,
    work,
    long,
    small,
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
            model,
            tree,
            starts,
            options,
            points[f],
            local,
            memory,
            residual[f],
            world,
            positions,
            filled,
            long,
            small,
        )
        write_frame(model, local, memory, rotations[f], pelvis[f])
