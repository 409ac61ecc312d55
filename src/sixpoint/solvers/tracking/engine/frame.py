"""The loop of one frame of markers, and the compiled entry: frames of markers in, poses out."""

from math import exp

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper
from sixpoint.solvers.prioritized.engine.kinematics import compute_world, locals_of_hinges
from sixpoint.solvers.prioritized.engine.limits import hold_limits
from sixpoint.solvers.prioritized.engine.packing import BALL, HINGES, unpack_model, unpack_scratch
from sixpoint.solvers.tracking.engine import packing as tp
from sixpoint.solvers.tracking.engine.bounding import TWICE, bound_ends, copy_rows, hold_hinges
from sixpoint.solvers.tracking.engine.improving import ALL, OTHERS, bring_back, improve
from sixpoint.solvers.tracking.engine.packing import unpack_options
from sixpoint.solvers.tracking.engine.screening import is_seen, learn_distances, note_astray, screen
from sixpoint.solvers.tracking.engine.smoothing import fade_row, let_go, set_pace, take_up

COAST = 0.05  # what no marker sees goes on for about so long [s]
SMOOTH = 0.02  # rates of change are means over about so long [s]


@helper
def predict(m, state, speed, dt):
    """Move the state on at its rates of change."""
    joints = len(m.parent)
    for k in range(3):
        state[joints, k] += dt * speed[joints, k]
    for j in range(joints):
        if m.kind[j] == BALL:
            turn = qt.exp((dt * speed[j, 0], dt * speed[j, 1], dt * speed[j, 2]))
            qt.store(state, j, qt.normalised(qt.mul(turn, qt.load(state, j))))
        elif m.kind[j] == HINGES:
            for k in range(m.size[j]):
                state[joints + 1 + j, k] += dt * speed[joints + 1 + j, k]


@helper
def update_speed(m, state, before, speed, table, flags, dt):
    """Rates of change from two states; they fade where no marker tells, or one is just back."""
    joints = len(m.parent)
    for j in range(joints):
        speed[joints + 1 + j, 3] = -1.0 if speed[joints + 1 + j, 3] > 0.0 else 0.0
    for i in range(len(flags)):
        if flags[i] == tp.USED or flags[i] == tp.SWAPPED:
            j = table[i, tp.JOINT]
            while j >= 0 and speed[joints + 1 + j, 3] <= 0.0:
                speed[joints + 1 + j, 3] = TWICE if speed[joints + 1 + j, 3] < 0.0 else 1.0
                j = m.parent[j]
    usual = dt / (SMOOTH + dt)
    fade = exp(-dt / COAST)
    for j in range(joints):
        keep, share = 1.0, usual
        if speed[joints + 1 + j, 3] <= 0.0:
            keep, speed[joints + 1 + j, 3] = fade, 0.0
        if speed[j, 3] > 0.0:  # it moves to where it is, not as it is
            keep, share = fade, 0.0
        if j == m.base:
            for k in range(3):
                rate = (state[joints, k] - before[joints, k]) / dt
                speed[joints, k] = keep * (speed[joints, k] + share * (rate - speed[joints, k]))
        if m.kind[j] == BALL:
            turn = qt.log(qt.mul(qt.load(state, j), qt.inv(qt.load(before, j))))
            for k in range(3):
                speed[j, k] = keep * (speed[j, k] + share * (turn[k] / dt - speed[j, k]))
        elif m.kind[j] == HINGES:
            row = joints + 1 + j
            for k in range(m.size[j]):
                rate = (state[row, k] - before[row, k]) / dt
                speed[row, k] = keep * (speed[row, k] + share * (rate - speed[row, k]))


@entry
def track_markers(
    body,
    integers,
    balls,
    index,
    values,
    table,
    segments,
    clusters,
    numbers,
    options,
    markers,
    rest,
    state,
    speed,
    lag,
    memory,
    forced,
    before,
    expected,
    old,
    last,
    start,
    places,
    ahead,
    tensor,
    normal,
    vectors,
    rows,
    small,
    marks,
    rotations,
    translations,
    flags,
    residual,
    iterations,
):
    """Follow every frame of markers (F, M, 3), NaN where one is not seen.

    Written are the rig's local rotations, the base's position, what became of every marker, its distance from
    its place on the body [m] and the iterations; ``state``, ``speed`` and ``memory`` go on.
    """
    m = unpack_model(body, integers)
    joints, columns = len(m.parent), len(m.hinges)
    w = unpack_scratch(vectors, rows, small, marks, joints, columns, integers[6], len(index), len(m.points))
    o = unpack_options(options)
    for f in range(len(markers)):
        goal = markers[f]
        part, arrived = ALL, False
        copy_rows(state, before)
        if o.cold:
            for i in range(len(table)):
                flags[f, i] = tp.USED if is_seen(goal, i) else tp.LOST
        else:
            predict(m, state, speed, o.dt)
            compute_world(m, w, state)
            screen(m, w, table, segments, numbers, memory, flags[f], goal, ahead, speed, o)
            copy_rows(state, expected)
            for j in range(joints):
                part = OTHERS if speed[j, 3] > 0.0 else part
        iterations[f], speed[joints, 3] = improve(
            m, w, balls, index, values, clusters, numbers, memory, flags[f], goal, forced, state, old, rest,
            tensor, normal, max(speed[joints, 3], o.damping), part, speed, o,
        )  # fmt: skip
        if part == OTHERS:
            iterations[f] += bring_back(
                m, w, balls, index, values, clusters, numbers, memory, flags[f], goal, forced, state, old,
                last, rest, tensor, normal, speed, o,
            )  # fmt: skip
            arrived = True
        copy_rows(state, old)
        if not o.cold:
            learn_distances(w, segments, numbers, memory, flags[f], goal, speed, o.dt)
            update_speed(m, state, before, speed, table, flags[f], o.dt)
            copy_rows(before, last)
            let_go(m, last, lag)
            take_up(m, state, expected, lag, speed, o.dt, arrived, o.steady)
            if o.steady:
                let_go(m, old, lag)
                if o.limits:
                    hold_limits(m, balls, old)
                bound_ends(m, w, state, before, old, last, start, expected, places, lag, speed, o.dt, False)
                if o.limits:
                    hold_hinges(m, old)
            compute_world(m, w, old)
        locals_of_hinges(m, old)
        for i in range(len(table)):
            residual[f, i] = 0.0
            if flags[f, i] == tp.LOST:
                continue
            joint = table[i, tp.JOINT]
            turned = qt.mul_vec(qt.load(w.rotation, joint), vec.load(numbers, i))
            place = vec.add(vec.load(w.position, joint), turned)
            residual[f, i] = vec.norm(vec.sub(vec.load(goal, i), place))
        if not o.cold:
            compute_world(m, w, state)
            note_astray(w, table, numbers, memory, flags[f], goal, o.dt)
        for j in range(joints):
            local = qt.mul(qt.mul(qt.load(m.before, j), qt.load(old, j)), qt.load(m.after, j))
            qt.store(rotations[f], j, local)
        vec.store(translations, f, vec.load(old, joints))


@entry
def steady_states(
    body, integers, balls, limits, dt, told, states, lag, speed, before, shown, last, start, goal, places,
    vectors, rows, small, marks, blocks,
):  # fmt: skip
    """Bound the way from frame to frame of states (F, 2 J + 1, 4) in place, as the tracker does.

    Joints that are not told (F, J) move by a few centimetres a frame, then catch up. Where nothing tells the
    base all goes as it is given, but for what fades: whoever is back elsewhere does not lag.
    """
    m = unpack_model(body, integers)
    joints = len(m.parent)
    w = unpack_scratch(vectors, rows, small, marks, joints, len(m.hinges), integers[6], blocks, len(m.points))
    copy_rows(states[0], before)
    copy_rows(before, last)
    for f in range(1, len(states)):
        if not told[f, m.base]:
            for row in range(2 * joints + 1):
                fade_row(lag, row, dt)
            copy_rows(states[f], before)
            let_go(m, states[f], lag)
            if limits:
                hold_hinges(m, states[f])
            copy_rows(states[f], last)
            continue
        for j in range(joints):
            speed[joints + 1 + j, 3] = TWICE if told[f, j] and told[f - 1, j] else 0.0
        for row in range(2 * joints + 1):
            fade_row(lag, row, dt)
            set_pace(lag, row)
        copy_rows(states[f], shown)
        let_go(m, shown, lag)
        if limits:
            hold_limits(m, balls, shown)
        bound_ends(m, w, states[f], before, shown, last, start, goal, places, lag, speed, dt, True)
        if limits:
            hold_hinges(m, shown)
        copy_rows(states[f], before)
        copy_rows(shown, states[f])
        copy_rows(shown, last)
