"""The iterations of a frame: all markers, or only those that are back after a gap."""

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.solvers.prioritized.engine import packing as pk
from sixpoint.solvers.prioritized.engine.frame import posture_wish
from sixpoint.solvers.prioritized.engine.kinematics import compute_world, retract
from sixpoint.solvers.prioritized.engine.limits import hold_limits
from sixpoint.solvers.prioritized.engine.packing import Settings
from sixpoint.solvers.prioritized.engine.step import scale_step
from sixpoint.solvers.prioritized.engine.wishes import OFF
from sixpoint.solvers.tracking.engine import packing as tp
from sixpoint.solvers.tracking.engine.bounding import copy_rows
from sixpoint.solvers.tracking.engine.clusters import build_cluster, place_in_joint
from sixpoint.solvers.tracking.engine.step import solve_step

SMALL = 0.02  # a step below this needs no other: what is left is its square [rad, m]
ALL, OTHERS, RETURNED = 0, 1, 2
MORE = 25  # iterations in which only what is back after a gap moves
POOR = 0.03  # one that ends farther off than this is gone again another way [m]
CAUTIOUS = 0.1  # their damping at first: the way may be far [m]
TURN, SHIFT = 0.5, 0.3  # largest step of one iteration [rad, m]
PENALTY = 100.0  # weight of what exceeds a tolerance
WORSE, SLACK = 1.01, 1e-5  # a merit beyond this share and sum [m^2] is worse: the posture moves a little
STIFFEST = 1.0  # largest damping [m]
CAP = 6.0  # largest speed towards the posture [rad/s]


@helper
def largest_step(m, w, step):
    """Largest change of a coordinate in a row."""
    largest = 0.0
    for c in range(len(m.hinges)):
        largest = max(largest, abs(w.rows[step, c]))
    return largest


@helper
def merit(w, values, clusters, numbers, memory, flags, goal, part, speed):
    """What an iteration must not increase: squared errors, and what important clusters exceed theirs by."""
    total = 0.0
    for k in range(len(clusters)):
        joint, first, count = clusters[k, tp.JOINT], clusters[k, tp.FIRST], clusters[k, tp.COUNT]
        weight, centre = 0.0, (0.0, 0.0, 0.0)
        if part == OTHERS and speed[joint, 3] > 0.0:
            continue
        for i in range(first, first + count):
            if flags[i] == tp.USED or flags[i] == tp.SWAPPED:
                local = place_in_joint(numbers, memory, i)
                place = vec.add(vec.load(w.position, joint), qt.mul_vec(qt.load(w.rotation, joint), local))
                error = vec.sub(vec.load(goal, i), place)
                weight += numbers[i, tp.WEIGHT]
                centre = vec.madd(centre, numbers[i, tp.WEIGHT], error)
                total += numbers[i, tp.WEIGHT] * vec.dot(error, error)
        if weight > 0.0 and clusters[k, tp.LAST] == 0 and part != RETURNED:
            tolerance = values[clusters[k, tp.MOVE], pk.TOLERANCE]
            beyond = max(vec.norm(centre) / weight - tolerance, 0.0)
            total += PENALTY * weight * beyond * beyond
    return total


@helper
def improve(
    m, w, balls, index, values, clusters, numbers, memory, flags, goal, forced, state, old, rest, tensor,
    normal, damping, part, speed, o,
):  # fmt: skip
    """Iterate one frame; returns the iterations and the damping that the next one begins with.

    ``part`` says whether all clusters count, those of joints that are back after a gap not, or only such
    joints move.

    Where a step makes things worse, limits that it ran into made it so: it is taken back, and the next one is
    more damped (Levenberg, Marquardt).
    """
    step = len(w.row) + 1
    settings = Settings(o.limits, 1.0, TURN, SHIFT, 1e-4, o.posture, CAP * o.dt, False, o.most, 1, 1)
    if o.limits:
        hold_limits(m, balls, state)
    compute_world(m, w, state)
    here = merit(w, values, clusters, numbers, memory, flags, goal, part, speed)
    most = o.most if part != RETURNED else MORE
    for n in range(most):
        for k in range(len(clusters)):
            build_cluster(m, w, index, values, clusters, numbers, memory, flags, goal, k, state, tensor)
            if part == OTHERS and speed[clusters[k, tp.JOINT], 3] > 0.0:
                w.block[clusters[k, tp.MOVE], 2] = OFF
                w.block[clusters[k, tp.TURN], 2] = OFF
        posture = -1
        if o.posture > 0.0 and (n == 0 or o.cold):
            posture = step + 1
            posture_wish(m, w, state, rest, o.posture, CAP * o.dt, posture)
        solve_step(
            m,
            w,
            balls,
            index,
            values,
            clusters,
            forced,
            state,
            damping,
            o,
            posture,
            normal,
            part == RETURNED,
            speed,
        )
        scale_step(m, w, settings, step, 1.0)
        copy_rows(state, old)
        retract(m, w, state, step)
        if o.limits:
            hold_limits(m, balls, state)
        compute_world(m, w, state)
        there = merit(w, values, clusters, numbers, memory, flags, goal, part, speed)
        if there > WORSE * here + SLACK:
            copy_rows(old, state)
            compute_world(m, w, state)
            damping = min(4.0 * damping, STIFFEST)
            continue
        here = there
        damping = max(0.5 * damping, o.damping)
        if largest_step(m, w, step) < (1e-3 if o.cold else SMALL):
            return n + 1, damping
    return most, damping


@helper
def returned_error(w, clusters, numbers, memory, flags, goal, speed):
    """Mean square distance of the markers on joints that are back after a gap [m^2]."""
    total, weights = 0.0, 1e-9
    for k in range(len(clusters)):
        joint, first, count = clusters[k, tp.JOINT], clusters[k, tp.FIRST], clusters[k, tp.COUNT]
        if speed[joint, 3] == 0.0:
            continue
        for i in range(first, first + count):
            if flags[i] == tp.USED or flags[i] == tp.SWAPPED:
                local = place_in_joint(numbers, memory, i)
                place = vec.add(vec.load(w.position, joint), qt.mul_vec(qt.load(w.rotation, joint), local))
                gap = vec.sub(vec.load(goal, i), place)
                total += numbers[i, tp.WEIGHT] * vec.dot(gap, gap)
                weights += numbers[i, tp.WEIGHT]
    return total / weights


@helper
def reset_returned(m, source, speed, state):
    """Joints that are back after a gap as in another state; the base stays."""
    joints = len(m.parent)
    for j in range(joints):
        if speed[j, 3] > 0.0 and j != m.base:
            for k in range(4):
                state[j, k] = source[j, k]
                state[joints + 1 + j, k] = source[joints + 1 + j, k]


@helper
def bring_back(
    m, w, balls, index, values, clusters, numbers, memory, flags, goal, forced, state, old, best, rest,
    tensor, normal, speed, o,
):  # fmt: skip
    """Take joints that are back after a gap to their markers; returns the iterations.

    The way may be far, and limits in between: where it ends elsewhere it is gone again, without limits at
    first, and from the relaxed posture; the best counts.
    """
    spent, least = 0, 1e9
    copy_rows(state, best)
    for attempt in range(4):
        if attempt >= 2:
            reset_returned(m, rest, speed, state)
        elif attempt == 1:
            reset_returned(m, best, speed, state)
        for free in range(attempt % 2, -1, -1):
            limits = o.limits and free == 0
            part = tp.Options(limits, o.most, o.dt, False, o.gate, 0.0, o.damping, False)
            more, _ = improve(
                m, w, balls, index, values, clusters, numbers, memory, flags, goal, forced, state, old, rest,
                tensor, normal, max(CAUTIOUS, o.damping), RETURNED, speed, part,
            )  # fmt: skip
            spent += more
        off = returned_error(w, clusters, numbers, memory, flags, goal, speed)
        if off < least:
            least = off
            copy_rows(state, best)
        if least < POOR * POOR or not o.limits:
            break
    copy_rows(best, state)
    compute_world(m, w, state)
    return spent
