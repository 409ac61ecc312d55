"""What no marker tells, or what is just back, moves by a few centimetres a frame beyond what carries it.

Such joints go on, sink to the relaxed posture or fade into what was found. Where that would move a joint
below them too far in one frame, all of them go only a part of the way in joint space, from the pose that was
shown last: that hangs on what moves on, and is not swung by it.
"""

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.solvers.prioritized.engine.kinematics import compute_world
from sixpoint.solvers.prioritized.engine.packing import BALL, HINGES

PACE, STEP = 1.8, 0.03  # how fast, and how far in a frame, at most [m/s, m]
PARTS, HALVINGS = 6, 3  # of the way that are tried
GONE = 1e-4  # what is less is nothing [rad, m]
LAST, FOUND, BEFORE, MAY, ABOVE = range(5)
TWICE = 2.0  # a joint is told in this frame and was in the one before


@helper
def copy_rows(source, target):
    for i in range(len(source)):
        for k in range(4):
            target[i, k] = source[i, k]


@helper
def hold_hinges(m, state):
    """Hinges within their ranges; a ball that hangs in the world while the trunk turns may be outside."""
    for j in range(len(m.parent)):
        if m.kind[j] == HINGES:
            row = len(m.parent) + 1 + j
            for k in range(m.size[j]):
                c = m.start[j] + k
                state[row, k] = min(max(state[row, k], m.bounds[c, 0]), m.bounds[c, 1])


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
def hang(m, w, places, last, top, out):
    """The joints below as they were shown last, turned as they were in the world if the topmost is a ball.

    ``w`` has the new pose: what is above is there already.
    """
    mix_below(m, last, last, 0.0, top, out)
    above = m.parent[top]
    if m.kind[top] == BALL and above >= 0:
        turned = qt.mul(qt.inv(qt.load(w.rotation, above)), qt.load(places[ABOVE], top))
        qt.store(out, top, qt.normalised(qt.mul(turned, qt.load(last, top))))


@helper
def furthest(m, w, places, top, bound, fully):
    """By how much a joint below moved further than the bound since it was shown last, or than it may [m]."""
    most = -1.0
    for j in range(top, len(m.parent)):
        if is_below(m, j, top):
            may = places[MAY, j, 0] if fully else bound
            way = vec.norm(vec.sub(vec.load(w.position, j), vec.load(places[LAST], j)))
            most = max(most, way - may)
    return most


@helper
def measure_allowed(m, w, places, speed, top, bound):
    """How far joints below may move: a bound beyond what markers tell of their place, or as their parents.

    The place of a joint is told by the rotation above it; what cannot turn is told with what carries it.
    """
    joints = len(m.parent)
    for j in range(top, joints):
        if not is_below(m, j, top):
            continue
        above = m.parent[j]
        if m.size[j] == 0 and j > top:
            places[MAY, j, 1] = places[MAY, above, 1]
        else:
            places[MAY, j, 1] = 1.0 if speed[joints + 1 + j, 3] == TWICE and speed[j, 3] == 0.0 else 0.0
        if (j > top and places[MAY, above, 1] > 0.0) or (j == m.base and places[MAY, j, 1] > 0.0):
            told = vec.norm(vec.sub(vec.load(places[FOUND], j), vec.load(places[BEFORE], j)))
            places[MAY, j, 0] = bound + told
        elif j > top:
            places[MAY, j, 0] = places[MAY, above, 0]
        else:
            shift = vec.norm(vec.sub(vec.load(w.position, top), vec.load(places[LAST], top)))
            places[MAY, j, 0] = bound if top == m.base else max(shift, bound)


@helper
def settle(m, state, shown, lag, speed, share, top, known):
    """After a part of the way: what is told lags by the rest; what is not stays where it is shown, slower."""
    joints = len(m.parent)
    for j in range(top, joints):
        if not is_below(m, j, top):
            continue
        row = joints + 1 + j
        told = known or speed[row, 3] > 0.0
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
def try_share(m, w, places, start, goal, share, top, bound, shown):
    """Go a share of the way; by how much that is too far [m]."""
    mix_below(m, start, goal, share, top, shown)
    compute_world(m, w, shown)
    return furthest(m, w, places, top, bound, True)


@helper
def go_on(m, w, places, start, goal, top, bound, shown):
    """Go the largest share of the way that is not too far, or that is least so; returns it."""
    best, least, above = 0.0, 1e9, 1.0
    for n in range(PARTS, -1, -1):
        share = n / PARTS
        over = try_share(m, w, places, start, goal, share, top, bound, shown)
        if over < least:
            best, least = share, over
        if over <= 0.0:
            above = share + 1.0 / PARTS
            break
    if least <= 0.0 and best < 1.0:
        for _ in range(HALVINGS):
            share = 0.5 * (best + above)
            if try_share(m, w, places, start, goal, share, top, bound, shown) <= 0.0:
                best = share
            else:
                above = share
    mix_below(m, start, goal, best, top, shown)
    return best


@helper
def bound_ends(m, w, state, before, shown, last, start, goal, places, lag, speed, dt, known):
    """Shorten the way of loose joints from the ``last`` shown state to this one, in place.

    With ``known`` the states of all frames are: nothing but the lag changes. Else what no marker tells goes
    on from where it is shown.
    """
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
            for j in range(joints):
                vec.store(places[LAST], j, vec.load(w.position, j))
                if m.parent[j] >= 0:
                    qt.store(places[ABOVE], j, qt.load(w.rotation, m.parent[j]))
            ready = True
        compute_world(m, w, shown)
        if furthest(m, w, places, top, bound, False) <= 0.0:
            continue
        compute_world(m, w, state)
        keep_places(w, places, FOUND)
        compute_world(m, w, before)
        keep_places(w, places, BEFORE)
        compute_world(m, w, shown)
        measure_allowed(m, w, places, speed, top, bound)
        if furthest(m, w, places, top, bound, True) <= 0.0:
            continue
        copy_rows(shown, goal)
        copy_rows(shown, start)
        hang(m, w, places, last, top, start)
        share = go_on(m, w, places, start, goal, top, bound, shown)
        settle(m, state, shown, lag, speed, share, top, known)
