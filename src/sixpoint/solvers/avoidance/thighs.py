"""Thighs that are in each other part: both legs turn about their lines from hip to ankle, knees outward.

Ankles stay on their targets. Both legs turn by the same angle, the least that parts them; one that comes to
its limits, or cannot turn, leaves the rest to the other. Not in the paper, which asks for it (Unzueta et al.
2008, section 10).
"""

from math import atan2, pi

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper, specialised
from sixpoint.solvers.avoidance.elbow import MET, STRAIGHT
from sixpoint.solvers.avoidance.swivel import (
    ENOUGH,
    GROWTH,
    LARGEST_STEP,
    LEAST_STEP,
    REFINEMENTS,
    TOUCH,
    elbow_on,
    make_arm,
    make_circle,
)
from sixpoint.solvers.avoidance.thigh_clearance import gap_of_thighs
from sixpoint.solvers.sequential.limb import place_leg
from sixpoint.solvers.sequential_plus.limbs import carried_angle, edge, is_free
from sixpoint.solvers.six_points.packing import limb_row
from sixpoint.solvers.tgb.swivel import across, direction, root_at

STEP = pi / 36  # rad, in which the limits of a leg are looked for


@specialised
def remember_knee(thighs, placed, limb, aim, upper, began, was, bent, l1, l2):
    """Keep the swivel angle of a leg's last frame, ``was`` and ``bent``, from the knee as it is now posed."""
    if thighs is not None:
        n, _ = direction(aim)
        u = across(vec.scale(-1.0, qt.y_axis(upper)), n)
        if limb >= 2:
            placed[2 * limb - 4, 3] = carried_angle(n, u, 1.0, was, bent, l1, l2) if began else 0.0


@helper
def place_thigh(model, leg, root, local, world, placed):
    """Write where hip and knee of the leg 0 or 1 are."""
    frame, hip = place_leg(model.hips, leg, root, world)
    y = qt.y_axis(qt.load(local, limb_row(model.segments.shape[0], leg + 2)))
    knee = vec.madd(hip, -model.limbs[leg + 2, 0], qt.mul_vec(frame, y))
    vec.store(placed, 2 * leg, hip)
    vec.store(placed, 2 * leg + 1, knee)


@helper
def find_leg(model, limits, leg, root, filled, local, world):
    """A leg as ``elbow.Arm`` and the circle of its knee."""
    frame, hip = place_leg(model.hips, leg, root, world)
    aim = qt.inv_mul_vec(frame, vec.sub(vec.load(filled, leg + 4), hip))
    limb = make_arm(model, leg + 2, hip, frame, aim, limits)
    y = qt.y_axis(qt.load(local, limb.ball))
    return limb, make_circle(limb, vec.scale(-limb.l1, y))


@helper
def find_range(limb, circle, balls, leg, before, most):
    """The swivel angle [rad] up to which a knee goes outward within limits and speed; its sign is the side's.

    ``before`` is the angle of the last frame, which may change by ``most``.
    """
    side = 1.0 if leg == 0 else -1.0
    v = vec.cross(circle.n, circle.u)
    outermost = atan2(side * v[0], side * circle.u[0])
    sign = 1.0 if outermost >= 0.0 else -1.0
    last = min(abs(outermost), max(most + sign * before, 0.0))
    if limb.limits:
        inside = 0.0
        while inside < last:
            angle = min(inside + STEP, last)
            if not is_free(
                circle.n, circle.u, circle.cosine, circle.sine, 1.0, sign * angle, balls, limb.ball
            ):
                a, b = sign * inside, sign * angle
                found = edge(circle.n, circle.u, circle.cosine, circle.sine, 1.0, a, b, balls, limb.ball)
                return sign * min(max(sign * found, inside), angle)
            inside = angle
    return sign * last


@helper
def gap_apart(thighs, left, right, ranges, placed, t):
    """Distance of the thighs where both knees are turned outward by t, or as far as they go [m]."""
    vec.store(placed, 1, elbow_on(left, min(max(ranges[0], -t), t)))
    vec.store(placed, 3, elbow_on(right, min(max(ranges[1], -t), t)))
    return gap_of_thighs(placed, thighs[0, 0], thighs[0, 1])


@helper
def find_turn(thighs, left, right, ranges, placed, gap):
    """The least turn outward that parts the thighs; else the one at which they are least deep [rad]."""
    farthest = max(abs(ranges[0]), abs(ranges[1]))
    best, most, last, before = 0.0, gap, 0.0, gap - TOUCH
    t = min(LEAST_STEP, farthest)
    while t > last:
        here = gap_apart(thighs, left, right, ranges, placed, t)
        if here >= TOUCH:
            a, fa, b, fb = t, here - TOUCH, last, before  # Illinois
            for _ in range(REFINEMENTS):
                if fa - fb < 1e-9 or a - b < ENOUGH:
                    break
                c = (a * fb - b * fa) / (fb - fa)
                f = gap_apart(thighs, left, right, ranges, placed, c) - TOUCH
                if f >= 0.0:
                    a, fa, fb = c, f, 0.5 * fb
                else:
                    b, fb, fa = c, f, 0.5 * fa
            return a
        if here > most:
            best, most = t, here
        last, before = t, here - TOUCH
        t = min(GROWTH * t, t + LARGEST_STEP, farthest)
    return best


@specialised
def part_thighs(thighs, placed, model, limits, root, filled, local, world, residual, most):
    """Place the thighs of posed legs, and part them if that is asked for.

    Knees turn by at most ``most`` [rad] from where they were in the last frame. Nothing is done where
    ``thighs`` is None.
    """
    if thighs is not None:
        place_thigh(model, 0, root, local, world, placed)
        place_thigh(model, 1, root, local, world, placed)
        if thighs[0, 3] > 0.0:
            gap = gap_of_thighs(placed, thighs[0, 0], thighs[0, 1])
            if gap < 0.0:
                turn_knees(thighs, placed, model, limits, root, filled, local, world, residual, most, gap)


@helper
def turn_knees(thighs, placed, model, limits, root, filled, local, world, residual, most, gap):
    left, circle = find_leg(model, limits, 0, root, filled, local, world)
    right, other = find_leg(model, limits, 1, root, filled, local, world)
    first, second = 0.0, 0.0
    # A leg that misses its target is at its limits, and one that is straight has no swivel angle.
    if filled[4, 3] > 0.0 and residual[4] <= MET and circle.sine >= STRAIGHT:
        first = find_range(left, circle, model.balls, 0, placed[0, 3], most)
    if filled[5, 3] > 0.0 and residual[5] <= MET and other.sine >= STRAIGHT:
        second = find_range(right, other, model.balls, 1, placed[2, 3], most)
    t = find_turn(thighs, circle, other, (first, second), placed, gap)
    if first != 0.0:
        phi = min(max(first, -t), t)
        qt.store(local, left.ball, root_at(circle.n, circle.u, circle.cosine, circle.sine, 1.0, phi))
    if second != 0.0:
        phi = min(max(second, -t), t)
        qt.store(local, right.ball, root_at(other.n, other.u, other.cosine, other.sine, 1.0, phi))
    place_thigh(model, 0, root, local, world, placed)
    place_thigh(model, 1, root, local, world, placed)
