"""How far thighs, tapered capsules from hip to knee, are from each other and from the balls of an arm."""

from math import sqrt

from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper, specialised
from sixpoint.solvers.avoidance.packing import THIGH_HEADER

# Share of a thigh above which nothing is kept away from it: flesh is rounder there than a capsule.
BELOW_HIP = 0.25  # as ``body.surface.flesh_regions.NEAR_HIP``; written out, see ``packing``
ROUNDS = 3  # of finding the nearest points of two capsules
WIDEST = 4.0  # m, beyond any gap


@helper
def place_on(hip, knee, hip_radius, knee_radius, first, p):
    """Nearest place of a tapered capsule to a point: its share from hip to knee, and the gap there [m].

    The gap |p - axis(t)| - radius(t) is convex in t; its least value lies where the slope of the distance is
    that of the radius.
    """
    along = vec.sub(knee, hip)
    length = max(vec.norm(along), 1e-9)
    slope = min(max((knee_radius - hip_radius) / length, -0.9), 0.9)
    off = vec.sub(p, hip)
    t = vec.dot(off, along) / length
    across = sqrt(max(vec.dot(off, off) - t * t, 0.0))
    best = t + across * slope / sqrt(1.0 - slope * slope)
    best = min(max(best, first * length), length)
    distance = sqrt(across * across + (t - best) * (t - best))
    return best / length, distance - hip_radius - slope * best


@helper
def gap_of_thighs(placed, hip_radius, knee_radius):
    """The least distance of the thighs from each other [m]; negative where they are in each other.

    The gap is convex in both places, so taking turns goes down to its least value.
    """
    hip, knee = vec.load(placed, 0), vec.load(placed, 1)
    other_hip, other_knee = vec.load(placed, 2), vec.load(placed, 3)
    a, b = vec.sub(knee, hip), vec.sub(other_knee, other_hip)
    r = vec.sub(hip, other_hip)
    aa, bb, ab = vec.dot(a, a), vec.dot(b, b), vec.dot(a, b)
    room = aa * bb - ab * ab
    nearest = 1.0
    if room > 1e-6 * aa * bb:  # where their lines are nearest
        nearest = min(max((ab * vec.dot(b, r) - bb * vec.dot(a, r)) / room, BELOW_HIP), 1.0)
    least = WIDEST
    for start in (nearest, 1.0, BELOW_HIP):  # nearly parallel thighs are nearest at an end of one
        share = start
        for _ in range(ROUNDS):
            other, _ = place_on(
                other_hip, other_knee, hip_radius, knee_radius, BELOW_HIP, vec.madd(hip, share, a)
            )
            beyond = vec.madd(other_hip, other, b)
            share, gap = place_on(hip, knee, hip_radius, knee_radius, BELOW_HIP, beyond)
            least = min(least, gap - hip_radius - other * (knee_radius - hip_radius))
    return least


@helper
def fold_of(up, down):
    """Unit vector across a forearm, to where its elbow folds; zero where the arm is straight.

    ``up`` and ``down`` lead from the elbow to shoulder and wrist.
    """
    off = vec.reject(up, vec.unit(down))
    length = vec.norm(off)
    return vec.scale(1.0 / length, off) if length > 1e-6 else (0.0, 0.0, 0.0)


@helper
def is_far(thighs, placed, side, elbow):
    """Whether all of an arm is beside a thigh."""
    hip, knee = vec.load(placed, 2 * side), vec.load(placed, 2 * side + 1)
    _, gap = place_on(hip, knee, thighs[0, 0], thighs[0, 1], BELOW_HIP, elbow)
    return gap > thighs[1, 0] + 0.1  # no ball of an arm is wider


@helper
def wrist_in(thighs, placed, side, wrist):
    """How deep the wrist is in a thigh where its target puts it [m], not positive."""
    hip, knee = vec.load(placed, 2 * side), vec.load(placed, 2 * side + 1)
    _, gap = place_on(hip, knee, thighs[0, 0], thighs[0, 1], BELOW_HIP, wrist)
    return min(gap - thighs[1, 1], 0.0)


@specialised
def beside_thighs(thighs, placed, elbow, up, down, gap):
    """The least of ``gap`` and the distance of an arm from the thighs; negative inside [m].

    Of what the wrist is inside, a ball's share of the forearm counts as none. ``up`` and ``down`` lead from
    the elbow to shoulder and wrist; ``thighs`` may be None.
    """
    if thighs is None:
        return gap
    return gap_to_thighs(thighs, placed, elbow, up, down, gap)


@helper
def gap_to_thighs(thighs, placed, elbow, up, down, gap):
    count, fold = int(thighs[0, 2]), fold_of(up, down)
    for side in range(2 if count > 0 else 0):
        if is_far(thighs, placed, side, elbow):
            continue
        hip, knee = vec.load(placed, 2 * side), vec.load(placed, 2 * side + 1)
        wrist_gap = wrist_in(thighs, placed, side, vec.add(elbow, down))
        for i in range(count):
            ball = thighs[THIGH_HEADER + i]
            forearm = ball[0] > 0.0
            p = vec.madd(vec.madd(elbow, ball[1], down if forearm else up), ball[3], fold)
            _, off = place_on(hip, knee, thighs[0, 0], thighs[0, 1], BELOW_HIP, p)
            off -= ball[2]
            if forearm:
                off -= ball[1] * wrist_gap
            gap = min(gap, off)
    return gap


@specialised
def or_in_thighs(thighs, placed, elbow, up, down, found):
    """What is deepest of an arm in trunk (``found``, as of ``clearance.deepest``) and thighs."""
    if thighs is None:
        return found
    return deepest_in_thighs(thighs, placed, elbow, up, down, found)


@helper
def deepest_in_thighs(thighs, placed, elbow, up, down, found):
    most, p_e, p_t = found
    count, fold = int(thighs[0, 2]), fold_of(up, down)
    for side in range(2 if count > 0 else 0):
        if is_far(thighs, placed, side, elbow):
            continue
        hip, knee = vec.load(placed, 2 * side), vec.load(placed, 2 * side + 1)
        for i in range(count):
            ball = thighs[THIGH_HEADER + i]
            p = vec.madd(vec.madd(elbow, ball[1], down if ball[0] > 0.0 else up), ball[3], fold)
            share, off = place_on(hip, knee, thighs[0, 0], thighs[0, 1], BELOW_HIP, p)
            if ball[2] - off > most:
                most = ball[2] - off
                out = vec.sub(p, vec.madd(hip, share, vec.sub(knee, hip)))
                p_e, p_t = p, vec.madd(p, most, vec.unit(out))
    return most, p_e, p_t
