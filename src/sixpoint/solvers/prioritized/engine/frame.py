"""The loop of one frame, and the compiled entry: frames of goals in, poses out."""

from sixpoint.kernels import linear
from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper
from sixpoint.solvers.prioritized.engine import packing
from sixpoint.solvers.prioritized.engine.kinematics import compute_world, locals_of_hinges, retract
from sixpoint.solvers.prioritized.engine.limits import (
    enforce_approaches,
    hold_limits,
    lock_violations,
    release,
)
from sixpoint.solvers.prioritized.engine.packing import BALL, unpack_model, unpack_scratch, unpack_settings
from sixpoint.solvers.prioritized.engine.rows import build_block
from sixpoint.solvers.prioritized.engine.step import prioritized_step, scale_step
from sixpoint.solvers.prioritized.engine.wishes import OFF, RADIAN
from sixpoint.solvers.prioritized.engine.yielding import report_yielding

CONVERGED, UNREACHABLE, LOST = 0, 1, 2
GAIN = 3e-5  # less than this is no gain [m]: 0.1 mm in three iterations
AFTERWARDS = 5  # iterations for a posture that waits until all is met
QUIET = 0.15  # share of the speed of the posture while a goal is unknown: what it let go sinks slowly
FREE, PATIENCE = 6, 2  # steps without gain before going back: on the way, and when all are held
CLOSING = 4  # iterations at the end in which levels below one that is off wait
ENOUGH = 9  # iterations of which the last third is for holding levels
SHORTEST = 0.02  # share of a step below which there is no more to gain


@helper
def evaluate(m, w, index, values, goals, state, settings):
    """All errors and rows at the state."""
    compute_world(m, w, state)
    for b in range(len(index)):
        build_block(m, w, index, values, b, goals, state, settings.gain)


@helper
def total_errors(m, w, index, values, column, totals):
    """Write what errors exceed their tolerances by, per level and weighted [m]; returns the sum."""
    everything = 0.0
    levels = len(m.levels)
    for level in range(levels):
        totals[level] = 0.0
    for b in range(len(index)):
        if w.block[b, 2] == OFF:
            continue
        kind = index[b, packing.KIND]
        angular = kind == packing.ORIENTATION or kind == packing.LOOK_AT
        angular = angular or kind == packing.ALIGNMENT or kind == packing.COUPLING
        scale = RADIAN if angular else 1.0
        excess = scale * values[b, packing.WEIGHT] * max(w.block[b, 0] - values[b, column], 0.0)
        totals[index[b, packing.LEVEL]] += excess * excess
        everything += excess
    for level in range(levels):
        totals[level] = totals[level] ** 0.5
    return everything


@helper
def all_within(w, index, values, column):
    """Whether the error of every active block is within its tolerance."""
    for b in range(len(index)):
        if w.block[b, 2] != OFF and w.block[b, 0] > values[b, column]:
            return False
    return True


@helper
def is_switched_off(goals, t):
    """Whether a task is off on purpose, which infinity stands for."""
    for k in range(7):
        if abs(goals[t, k]) > 1e300:
            return True
    return False


@helper
def count_off(w, index, goals):
    """Number of blocks whose goal is unknown, and of those that act; drags come and go by themselves."""
    off, on = 0, 0
    for b in range(len(index)):
        if w.block[b, 2] != OFF:
            on += 1
        elif index[b, packing.KIND] != packing.DRAG and not is_switched_off(goals, index[b, packing.TASK]):
            off += 1
    return off, on


@helper
def is_better(totals, best, levels, margin):
    """Whether errors are smaller by more than a margin [m], the most important level first.

    Of a level that is far off a thousandth matters as little: it must not keep those below from their best.
    """
    for level in range(levels):
        enough = max(margin, 1e-3 * best[level])
        if totals[level] < best[level] - enough:
            return True
        if totals[level] > best[level] + enough:
            return False
    return False


@helper
def last_wishing(w, index, values, totals, levels):
    """The last level that pursues its wishes while a level is off: that one, or where its tasks end.

    A FLEXT task is off at the level of its flexion, and has rows below.
    """
    first = levels
    for level in range(levels - 1, -1, -1):
        if totals[level] > 0.0:
            first = level
    last = first
    for b in range(len(index)):
        if index[b, packing.LEVEL] != first or w.block[b, 0] <= values[b, packing.TOLERANCE]:
            continue
        for other in range(len(index)):
            if index[other, packing.TASK] == index[b, packing.TASK]:
                last = max(last, index[other, packing.LEVEL])
    return last


@helper
def posture_wish(m, w, state, attractor, step, cap, row):
    """Step of the posture optimisation in a row: down the gradient of the weighted distance to the attractor.

    Reference: section 1 of Baerlocher and Boulic 2004; Liegeois 1977.
    """
    linear.clear(w.rows, row)
    joints = len(m.parent)
    longest = 0.0
    for j in range(joints):
        start = m.start[j]
        if m.size[j] == 0:
            continue
        if m.kind[j] == BALL:
            gap = qt.log(qt.mul(qt.load(attractor, j), qt.inv(qt.load(state, j))))
            for k in range(3):
                w.rows[row, start + k] = step * m.bounds[start + k, 2] * gap[k]
        else:
            for k in range(m.size[j]):
                gap = attractor[joints + 1 + j, k] - state[joints + 1 + j, k]
                w.rows[row, start + k] = step * m.bounds[start + k, 2] * gap
        for k in range(m.size[j]):
            longest = max(longest, abs(w.rows[row, start + k]))
    if longest > cap:
        linear.scale(w.rows, row, cap / longest)


@helper
def limited_step(m, w, balls, index, values, goals, state, settings, free, fixed, posture):
    """The clamping loop: solve, turn what is violated into equalities, solve again; returns the rank."""
    step, work = fixed + 1, fixed + 3
    basis = work + w.small.shape[1]
    linear.clear(w.rows, fixed)
    release(m, w)
    size = 0
    for _ in range(len(m.hinges) + len(index) + 2):
        size = prioritized_step(
            m, w, index, values, goals, state, settings, free, fixed, step, posture, work, basis
        )
        violated = enforce_approaches(w, index, values, step)
        if settings.limits and lock_violations(m, w, balls, state, step, fixed):
            violated = True
        if not violated:
            break
    return size


@helper
def copy_state(source, target, rows):
    for i in range(rows):
        for k in range(4):
            target[i, k] = source[i, k]


@helper
def solve_frame(m, w, balls, index, values, goals, state, attractor, best, settings):
    """Improve the state for one frame of goals and leave the best one seen there; returns the iterations.

    First it runs freely until nothing has been gained for a while: a fold may have to open before it turns
    the right way, and a level may be off on the way by what still counts as met (1 cm). Then all levels are
    held to their tolerance (1 mm): steps without gain are taken back and the next are shorter, so that what
    bends away from its tangent bends away less. In the end all levels below one that is off wait.
    """
    size, levels, fixed = 2 * len(m.parent) + 1, len(m.levels), len(w.row)
    least, totals = best[size:, 0], best[size:, 1]
    if settings.limits:
        hold_limits(m, balls, state)
    share, failed, iterations, rank = 1.0, 0, 0, 0
    band, careful, returned, finished = packing.ACCEPT, False, False, False
    while True:
        evaluate(m, w, index, values, goals, state, settings)
        off, on = count_off(w, index, goals)
        if finished or (off > 0 and on == 0):  # nothing is known: stand still
            break
        met = all_within(w, index, values, packing.TOLERANCE)
        excess = total_errors(m, w, index, values, band, totals)
        if returned:
            returned = False
            total_errors(m, w, index, values, band, least)
        else:
            gained = iterations == 0 or met or is_better(totals, least, levels, GAIN)
            current = gained or is_better(totals, least, levels, 1e-9)
            if current:
                copy_state(state, best, size)
                for k in range(levels):
                    least[k] = totals[k]
            failed = 0 if gained else failed + 1
            share = min(2.0 * share, 1.0) if gained else share
            enough = settings.least + (AFTERWARDS if settings.posture_after else 0)
            finished = (met and iterations >= enough) or 0 <= settings.most <= iterations
            if band == packing.ACCEPT:
                late = settings.most >= ENOUGH and 3 * iterations >= 2 * settings.most
                returned = excess == 0.0 or failed >= FREE or late
                band = packing.TOLERANCE if returned else band
            elif careful:
                finished = finished or (failed > 0 and iterations >= settings.least)
            else:
                returned = failed >= PATIENCE
                share *= 0.3 if returned else 1.0
                closing = settings.most >= ENOUGH and iterations >= settings.most - CLOSING
                if share < SHORTEST or closing:
                    careful, returned, share = True, True, 1.0
            if finished and current:
                break
            failed = 0 if returned else failed
            if finished or (returned and not current):
                copy_state(best, state, size)
                continue
            if returned:  # the state is the best already
                returned = False
                total_errors(m, w, index, values, band, least)
        free, posture = levels, -1
        if careful:  # all levels below the first one that is off only hold what they have
            free = last_wishing(w, index, values, totals, levels)
        drifts = met if settings.posture_after else iterations < settings.drift
        if drifts and free == levels and settings.posture_step > 0.0:
            posture = fixed + 2
            cap = settings.posture_cap * (QUIET if off else 1.0)
            posture_wish(m, w, state, attractor, settings.posture_step, cap, posture)
        rank = limited_step(m, w, balls, index, values, goals, state, settings, free, fixed, posture)
        if settings.most < 0:  # only the linear step was asked for; it is in the scratch rows
            return rank
        scale_step(m, w, settings, fixed + 1, share)
        retract(m, w, state, fixed + 1)
        if settings.limits:
            hold_limits(m, balls, state)
        iterations += 1
    locals_of_hinges(m, state)
    return iterations


@helper
def status_of(w, index, values, goals, residual):
    """Residual of every task, and how the frame went."""
    status = CONVERGED
    for t in range(len(residual)):
        residual[t] = 0.0
    for b in range(len(index)):
        t = index[b, packing.TASK]
        if w.block[b, 2] == OFF and index[b, packing.KIND] != packing.DRAG and not is_switched_off(goals, t):
            status = LOST
        residual[t] = max(residual[t], w.block[b, 0])
        if status != LOST and w.block[b, 0] > values[b, packing.ACCEPT]:
            status = UNREACHABLE
    return status


@entry
def solve_prioritized(
    table,
    integers,
    balls,
    index,
    values,
    options,
    goals,
    starts,
    state,
    attractors,
    best,
    vectors,
    rows,
    small,
    marks,
    rotations,
    translations,
    status,
    residual,
    iterations,
    yielded,
):
    """Solve every frame of goals (F, T, 7).

    The state goes from frame to frame unless ``starts`` holds one for the frame; so do the states that the
    posture is drawn to, where ``attractors`` has no more. Written are the rig's local rotations, the base's
    position, status, residuals, iterations, and which task gave way to which.
    """
    m = unpack_model(table, integers)
    joints, columns = len(m.parent), len(m.hinges)
    w = unpack_scratch(vectors, rows, small, marks, joints, columns, integers[6], len(index), len(m.points))
    settings = unpack_settings(options)
    for f in range(len(goals)):
        if f < len(starts):
            for i in range(len(state)):
                for k in range(4):
                    state[i, k] = starts[f, i, k]
        attractor = attractors[min(f, len(attractors) - 1)]
        iterations[f] = solve_frame(m, w, balls, index, values, goals[f], state, attractor, best, settings)
        status[f] = status_of(w, index, values, goals[f], residual[f])
        if f < len(yielded) and status[f] != CONVERGED:
            report_yielding(m, w, index, values, goals[f], state, len(w.row), yielded[f])
        for j in range(joints):
            local = qt.mul(qt.mul(qt.load(m.before, j), qt.load(state, j)), qt.load(m.after, j))
            qt.store(rotations[f], j, local)
        vec.store(translations, f, vec.load(state, joints))
