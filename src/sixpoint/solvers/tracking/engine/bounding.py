"""What no marker tells, or what is just back, moves by a few centimetres a frame beyond what carries it.

Such joints go on, sink to the relaxed posture or fade into what was found. Where that would move a joint below
them too far in one frame, all of them go only a part of the way, in joint space, from what was shown last.
"""

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.solvers.prioritized.engine.kinematics import compute_world
from sixpoint.solvers.prioritized.engine.packing import BALL, HINGES

PACE, STEP = 2.0, 0.035  # how fast, and how far in a frame, at most [m/s, m]
HALVINGS = 6
GONE = 1e-4  # what is less is nothing [rad, m]
LAST, CARRIED, FOUND, BEFORE = range(4)


@helper
def copy_rows(source, target):
    for i in range(len(source)):
        for k in range(4):
            target[i, k] = source[i, k]


@helper
def is_below(m, j, top):
    """Whether a joint is another one or below it."""
    while j > top:
        j = m.parent[j]
    return j == top


@helper
def is_loose(m, lag, speed, j):
    """Whether a joint is not where markers tell: none does, or what it was off by still fades."""
    joints = len(m.parent)
    if m.size[j] == 0 and j != m.base:
        return False
    off = vec.norm(vec.load(lag, j)) + vec.norm(vec.load(lag, joints + 1 + j))
    if j == m.base:
        off += vec.norm(vec.load(lag, joints))
    return off > GONE or speed[joints + 1 + j, 3] == 0.0


@helper
def keep_places(w, places, which):
    for j in range(places.shape[1]):
        vec.store(places[which], j, vec.load(w.position, j))


@helper
def mix_joint(m, last, goal, share, j, out):
    """A joint on its way from one state to another."""
    joints = len(m.parent)
    if m.kind[j] == BALL:
        turn = qt.log(qt.mul(qt.load(goal, j), qt.inv(qt.load(last, j))))
        qt.store(out, j, qt.normalised(qt.mul(qt.exp(vec.scale(share, turn)), qt.load(last, j))))
    elif m.kind[j] == HINGES:
        row = joints + 1 + j
        for k in range(m.size[j]):
            out[row, k] = last[row, k] + share * (goal[row, k] - last[row, k])
    if j == m.base:
        for k in range(3):
            out[joints, k] = last[joints, k] + share * (goal[joints, k] - last[joints, k])


@helper
def mix_below(m, last, goal, share, top, out):
    for j in range(top, len(m.parent)):
        if is_below(m, j, top):
            mix_joint(m, last, goal, share, j, out)


@helper
def exceeds(m, w, places, speed, top, bound, fully):
    """Whether a joint below moved too far since it was shown last; ``fully``: beyond what it may."""
    joints = len(m.parent)
    for j in range(top, joints):
        if not is_below(m, j, top):
            continue
        may = bound
        if fully:
            may += places[CARRIED, j, 0]
        if vec.norm(vec.sub(vec.load(w.position, j), vec.load(places[LAST], j))) > may:
            return True
    return False


@helper
def measure_carried(m, w, places, speed, top):
    """How far joints below may move anyhow: as what carries them does, or as markers tell that they do."""
    joints = len(m.parent)
    for j in range(top, joints):
        if not is_below(m, j, top):
            continue
        way = vec.norm(vec.sub(vec.load(w.position, j), vec.load(places[LAST], j)))
        if speed[joints + 1 + j, 3] > 0.0 and speed[j, 3] == 0.0:
            told = vec.norm(vec.sub(vec.load(places[FOUND], j), vec.load(places[BEFORE], j)))
            way = max(way, told)
        places[CARRIED, j, 0] = way


@helper
def settle(m, state, shown, lag, speed, share, top):
    """After a part of the way: what is told lags by the rest; what is not is where it is shown, and slower."""
    joints = len(m.parent)
    for j in range(top, joints):
        if not is_below(m, j, top):
            continue
        row = joints + 1 + j
        told = speed[row, 3] > 0.0
        if j == m.base:
            for k in range(3):
                lag[joints, k] = shown[joints, k] - state[joints, k] if told else 0.0
                if not told:
                    state[joints, k] = shown[joints, k]
                    speed[joints, k] *= share
        if m.kind[j] == BALL:
            if told:
                vec.store(lag, j, qt.log(qt.mul(qt.load(shown, j), qt.inv(qt.load(state, j)))))
            else:
                qt.store(state, j, qt.load(shown, j))
                for k in range(3):
                    lag[j, k] = 0.0
                    speed[j, k] *= share
        elif m.kind[j] == HINGES:
            for k in range(m.size[j]):
                lag[row, k] = shown[row, k] - state[row, k] if told else 0.0
                if not told:
                    state[row, k] = shown[row, k]
                    speed[row, k] *= share


@helper
def bound_ends(m, w, state, before, shown, last, goal, places, lag, speed, dt):
    """Shorten the way of loose joints from the ``last`` shown state to this one, in place."""
    joints, bound = len(m.parent), min(PACE * dt, STEP)
    ready = False
    for top in range(joints):
        if not is_loose(m, lag, speed, top):
            continue
        above = m.parent[top]
        if top != m.base and above >= 0 and is_loose(m, lag, speed, above):
            continue
        if not ready:
            compute_world(m, w, last)
            keep_places(w, places, LAST)
        ready = True
        compute_world(m, w, shown)
        if not exceeds(m, w, places, speed, top, bound, False):
            continue
        compute_world(m, w, state)
        keep_places(w, places, FOUND)
        compute_world(m, w, before)
        keep_places(w, places, BEFORE)
        copy_rows(shown, goal)
        mix_below(m, last, goal, 0.0, top, shown)
        compute_world(m, w, shown)
        measure_carried(m, w, places, speed, top)
        mix_below(m, last, goal, 1.0, top, shown)
        compute_world(m, w, shown)
        if not exceeds(m, w, places, speed, top, bound, True):
            continue
        low, high = 0.0, 1.0
        for _ in range(HALVINGS):
            share = 0.5 * (low + high)
            mix_below(m, last, goal, share, top, shown)
            compute_world(m, w, shown)
            if exceeds(m, w, places, speed, top, bound, True):
                high = share
            else:
                low = share
        mix_below(m, last, goal, low, top, shown)
        settle(m, state, shown, lag, speed, low, top)
