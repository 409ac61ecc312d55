"""Which markers to believe in a frame: ghosts, swaps, gaps, and markers that come back.

A marker is expected where the predicted pose and its usual distance from the model put it. What all markers
of a segment miss together is the prediction's error; what one misses alone is its own.
"""

from math import exp

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.solvers.prioritized.engine.wishes import NONE
from sixpoint.solvers.tracking.engine import packing as tp

ACCELERATION = 400.0  # what a prediction may miss by half of this times the square of the frame time [m/s^2]
DRIFT = 3.0  # speed at which a segment without markers leaves its prediction [m/s]
WANDER = 0.05  # the same of a lost marker on a segment that is seen [m/s]
PATIENCE = 0.25  # a refused marker that has no better neighbours is believed after this time [s]
HOPELESS = 0.5  # but never where it is farther off than this [m]
MOST = 0.4  # share of refused markers from which on all are believed
RETURNING = 0.2  # a segment that is back may move to where it is for so long [s]
AWAY = 2.0  # how far it may be meanwhile [m]
FORGOTTEN = 2.0  # a marker that is lost so long [s] no longer counts as missing from its segment
STUCK, ENOUGH = 0.08, 0.03  # a segment that is so far off [m] for so long [s] is sought anew
ADAPT, FADE = 0.1, 0.15  # times in which usual distances are learnt, and cease to count [s]


@helper
def is_seen(goal, i):
    return abs(goal[i, 0]) < 1e7 and abs(goal[i, 1]) < 1e7 and abs(goal[i, 2]) < 1e7


@helper
def expected(w, numbers, memory, joint, i):
    """Where a marker should be in the pose of the scratch arrays."""
    place = (
        numbers[i, 0] + memory[i, 0],
        numbers[i, 1] + memory[i, 1],
        numbers[i, 2] + memory[i, 2],
    )
    return vec.add(vec.load(w.position, joint), qt.mul_vec(qt.load(w.rotation, joint), place))


@helper
def median(ahead, first, count, flags, axis):
    """Median of one component of what the seen markers of a segment miss."""
    seen = 0
    for i in range(first, first + count):
        if flags[i] != tp.LOST:
            seen += 1
    low, high = 0.0, 0.0
    for i in range(first, first + count):
        if flags[i] == tp.LOST:
            continue
        below = 0
        for k in range(first, first + count):
            smaller = ahead[k, axis] < ahead[i, axis] or (ahead[k, axis] == ahead[i, axis] and k < i)
            if flags[k] != tp.LOST and smaller:
                below += 1
        if below == (seen - 1) // 2:
            low = ahead[i, axis]
        if below == seen // 2:
            high = ahead[i, axis]
    return 0.5 * (low + high)


@helper
def screen_segment(w, segments, numbers, memory, flags, goal, ahead, speed, s, options):
    """Refuse the markers of a segment that leave the others; ``ahead`` becomes what each is off by."""
    joint, first, count = segments[s, tp.JOINT], segments[s, tp.FIRST], segments[s, tp.COUNT]
    seen, alone = 0, 1e9
    for i in range(first, first + count):
        alone = min(alone, memory[i, tp.UNSEEN])
        flags[i] = tp.USED if is_seen(goal, i) else tp.LOST
        if flags[i] == tp.USED:
            seen += 1
            off = vec.sub(vec.load(goal, i), expected(w, numbers, memory, joint, i))
            vec.store(ahead, i, off)
    common = NONE
    if seen >= 3:
        common = (
            median(ahead, first, count, flags, 0),
            median(ahead, first, count, flags, 1),
            median(ahead, first, count, flags, 2),
        )
    # What a prediction misses is common to a segment, but for a quarter.
    miss = (0.125 if seen >= 3 else 0.5) * ACCELERATION * options.dt * options.dt
    slack = options.gate + miss + DRIFT * alone + (AWAY if speed[joint, 3] > 0.0 else 0.0)
    refused = 0
    for i in range(first, first + count):
        if flags[i] == tp.LOST:
            continue
        vec.store(ahead, i, vec.sub(vec.load(ahead, i), common))
        reach = slack + numbers[i, tp.SPREAD] + WANDER * memory[i, tp.UNSEEN]
        reach = reach if seen >= 3 else 1.5 * reach
        ahead[i, 3] = reach
        if memory[i, tp.KNOWN] > 0.0 and vec.norm(vec.load(ahead, i)) > reach:
            flags[i] = tp.REJECTED
            refused += 1
    return seen, refused


@helper
def exchange(w, table, numbers, memory, flags, goal, ahead):
    """Two refused markers that are where the other one should be change places."""
    for i in range(len(flags)):
        if flags[i] != tp.REJECTED:
            continue
        here = vec.sub(vec.load(goal, i), vec.load(ahead, i))
        for k in range(i + 1, len(flags)):
            if flags[k] != tp.REJECTED:
                continue
            there = vec.sub(vec.load(goal, k), vec.load(ahead, k))
            a = vec.norm(vec.sub(vec.load(goal, k), here))
            b = vec.norm(vec.sub(vec.load(goal, i), there))
            if a < ahead[i, 3] and b < ahead[k, 3]:
                one, other = vec.load(goal, i), vec.load(goal, k)
                vec.store(goal, i, other)
                vec.store(goal, k, one)
                flags[i] = tp.SWAPPED
                flags[k] = tp.SWAPPED
                break


@helper
def readmit(segments, memory, flags, ahead, s, dt):
    """A segment most of whose markers are refused is where they are; patience with a stubborn one ends."""
    first, count = segments[s, tp.FIRST], segments[s, tp.COUNT]
    used, refused = 0, 0
    for i in range(first, first + count):
        if flags[i] == tp.REJECTED:
            refused += 1
            memory[i, tp.REFUSED] += dt
        else:
            memory[i, tp.REFUSED] = 0.0
            if flags[i] != tp.LOST:
                used += 1
    if refused == 0:
        return
    for i in range(first, first + count):
        if flags[i] != tp.REJECTED:
            continue
        patient = memory[i, tp.REFUSED] > PATIENCE and vec.norm(vec.load(ahead, i)) < HOPELESS
        if (refused > used and refused >= 3) or (used < 2 and patient):
            flags[i] = tp.USED


@helper
def note_astray(w, table, numbers, memory, flags, goal, dt):
    """Count for how long each used marker was far from its place after all."""
    for i in range(len(flags)):
        gap = vec.sub(vec.load(goal, i), expected(w, numbers, memory, table[i, tp.JOINT], i))
        if flags[i] == tp.USED and vec.norm(gap) > STUCK:
            memory[i, tp.ASTRAY] += dt
        else:
            memory[i, tp.ASTRAY] = 0.0


@helper
def is_stuck(segments, memory, flags, s):
    """Whether all markers of a segment stay far from their places: limits hold it on the wrong side."""
    used = 0
    for i in range(segments[s, tp.FIRST], segments[s, tp.FIRST] + segments[s, tp.COUNT]):
        if flags[i] == tp.USED:
            used += 1
            if memory[i, tp.ASTRAY] < ENOUGH:
                return False
    return used > 0


@helper
def count_children(m, j):
    count = 0
    for k in range(j + 1, len(m.parent)):
        if m.parent[k] == j:
            count += 1
    return count


@helper
def note_returns(m, table, segments, memory, flags, speed, dt):
    """Mark joints that markers are back on, after nothing told how they are: they may have moved far."""
    joints = len(m.parent)
    for s in range(len(segments)):
        first, count = segments[s, tp.FIRST], segments[s, tp.COUNT]
        alone, back = 1e9, False
        for i in range(first, first + count):
            alone = min(alone, memory[i, tp.UNSEEN])
            if flags[i] == tp.LOST or flags[i] == tp.REJECTED:
                memory[i, tp.UNSEEN] += dt
            else:
                back = True
                memory[i, tp.UNSEEN] = 0.0
        j = segments[s, tp.JOINT]
        if is_stuck(segments, memory, flags, s):
            speed[j, 3] = RETURNING
            while m.parent[j] != m.base and m.parent[j] >= 0 and count_children(m, m.parent[j]) == 1:
                j = m.parent[j]
                speed[j, 3] = RETURNING
        if not back or alone < 1.5 * dt:
            continue
        j = segments[s, tp.JOINT]
        if speed[joints + 1 + j, 3] > 0.0:
            continue  # markers below told how it is
        speed[j, 3] = RETURNING
        while j != m.base and speed[joints + 1 + m.parent[j], 3] == 0.0:
            j = m.parent[j]
            speed[j, 3] = RETURNING


@helper
def trust_distances(segments, memory, flags, s, dt):
    """While markers of a segment are missing, the others' usual distances count, so that it does not move."""
    first, count = segments[s, tp.FIRST], segments[s, tp.COUNT]
    missing = False
    for i in range(first, first + count):
        lost = flags[i] == tp.LOST or flags[i] == tp.REJECTED
        if lost and memory[i, tp.KNOWN] > 0.0 and memory[i, tp.UNSEEN] < FORGOTTEN:
            missing = True
    fade = exp(-dt / FADE)
    for i in range(first, first + count):
        memory[i, tp.TRUST] = 1.0 if missing else memory[i, tp.TRUST] * fade
    return missing


@helper
def screen(m, w, table, segments, numbers, memory, flags, goal, ahead, speed, options):
    """Judge all markers of a frame against the predicted pose; goals are exchanged in place."""
    seen, refused = 0, 0
    for s in range(len(segments)):
        found = screen_segment(w, segments, numbers, memory, flags, goal, ahead, speed, s, options)
        seen, refused = seen + found[0], refused + found[1]
    if refused > MOST * seen:  # the prediction is wrong, not they
        for i in range(len(flags)):
            if flags[i] == tp.REJECTED:
                flags[i] = tp.USED
    elif refused > 1:
        exchange(w, table, numbers, memory, flags, goal, ahead)
    for s in range(len(segments)):
        readmit(segments, memory, flags, ahead, s, options.dt)
    note_returns(m, table, segments, memory, flags, speed, options.dt)
    for s in range(len(segments)):
        trust_distances(segments, memory, flags, s, options.dt)


@helper
def learn_distances(w, segments, numbers, memory, flags, goal, speed, dt):
    """Update the usual distances of markers on segments that are seen whole."""
    share = dt / (ADAPT + dt)
    for s in range(len(segments)):
        joint, first, count = segments[s, tp.JOINT], segments[s, tp.FIRST], segments[s, tp.COUNT]
        for i in range(first, first + count):
            if flags[i] == tp.LOST or flags[i] == tp.REJECTED:
                continue
            new = memory[i, tp.KNOWN] == 0.0
            if not new and (memory[i, tp.TRUST] > 0.05 or speed[joint, 3] > 0.0):
                continue
            gap = vec.sub(vec.load(goal, i), vec.load(w.position, joint))
            local = qt.inv_mul_vec(qt.load(w.rotation, joint), gap)
            for k in range(3):
                off = local[k] - numbers[i, k]
                memory[i, tp.BIAS + k] = off if new else memory[i, k] + share * (off - memory[i, k])
            memory[i, tp.KNOWN] = 1.0
