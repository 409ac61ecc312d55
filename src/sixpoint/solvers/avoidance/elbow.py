"""An arm whose elbow is in the trunk gets it out: swivelled, or straight where it misses.

A bent arm turns about the line from shoulder to wrist, by K times the depth over the length of the upper arm
at first (``clear_arm``; ``clear_arm_steadily`` begins at the angle of the last frame), so the wrist stays
where it is. An arm that misses its target turns about v x w by arccos(v . w), where v and w are the
directions from the shoulder to the deepest point and to the nearest point of the outline.

Where this differs from the paper: it repeats steps of K times the depth to one side until the elbow is out;
here the angle is looked for to both sides, and its edge, since limits may forbid the nearer side and a step
overshoots. It turns an arm about v x w that must be almost or fully stretched to reach; here only one that
misses anyway, since a nearly stretched arm would leave its target, and its swivel angle still moves the elbow
(by 6 cm where the arm is 2 % longer than its target is far).

Reference: Unzueta et al. 2008, section 8 and Algorithm 5, line 7.
"""

from math import pi
from typing import NamedTuple

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.swing_twist import clamp
from sixpoint.solvers.avoidance.clearance import OUTSIDE, deepest, gap_of_arm
from sixpoint.solvers.sequential.limb import close_on, fold, turn_about_itself
from sixpoint.solvers.sequential_plus.limbs import carried_angle, is_free, slack
from sixpoint.solvers.six_points.packing import limb_row
from sixpoint.solvers.tgb.swivel import across, direction, hinge_at, root_at, triangle

K = 1.0  # of a bent arm's turn
MET = 1e-3  # m, an arm that misses by less is on its target
STRETCHES = 2  # turns of a stretched arm
GROWTH = 1.7  # of the steps in which a free swivel angle is looked for
LEAST_STEP, LARGEST_STEP, COARSE_STEP = pi / 90, pi / 15, pi / 4  # rad
REFINEMENTS = 4
ENOUGH = 2e-3  # rad, an angle that is free by less is at the edge
HALVES = 6  # times that a turn is halved where limits forbid it, or a step where no angle is free
STRAIGHT = 0.01  # sine between upper arm and target below which a swivel angle moves nothing
GIVES = 0.02  # m, an arm that misses by so much gives way wholly
TOUCH = 5e-4  # m, by which an elbow that is let out stays clear


class Arm(NamedTuple):
    """What an arm of one frame is turned on.

    Attributes:
        shoulder: Its place in the world [m].
        frame: World rotation of what carries it.
        target: Where the wrist should be, from the shoulder, in that frame [m].
        l1: Upper length [m].
        l2: Lower length [m].
        ball: Row of the shoulder in the limits.
        low: Least flexion [rad].
        high: Largest flexion [rad].
        limits: Whether limits hold.
    """

    shoulder: tuple
    frame: tuple
    target: tuple
    l1: float
    l2: float
    ball: int
    low: float
    high: float
    limits: bool


@helper
def make_arm(model, limb, shoulder, frame, target, limits):
    """The arm 0 or 1 of a figure, carried by ``frame`` at ``shoulder``."""
    row = limb_row(model.segments.shape[0], limb)
    return Arm(
        shoulder,
        frame,
        target,
        model.limbs[limb, 0],
        model.limbs[limb, 1],
        row,
        model.limbs[limb, 2],
        model.limbs[limb, 3],
        limits,
    )


class Circle(NamedTuple):
    """The circle of elbows that reach the target; angle 0 is the elbow it was made for.

    Attributes:
        n: Direction of the target, in the arm's frame.
        u: Direction of the elbow at angle 0, across n.
        cosine: Cosine of the angle between upper arm and n.
        sine: Its sine.
        middle: Centre of the circle in the world [m].
        across: Radius at angle 0, in the world [m].
        beside: Radius at a quarter turn, in the world [m].
        wrist: In the world [m].
    """

    n: tuple
    u: tuple
    cosine: float
    sine: float
    middle: tuple
    across: tuple
    beside: tuple
    wrist: tuple


@helper
def make_circle(arm, elbow):
    """The circle of an elbow, given from the shoulder in the arm's frame."""
    n, distance = direction(arm.target)
    d, cosine, sine, _ = triangle(distance, arm.l1, arm.l2)
    u = across(elbow, n)
    r = arm.l1 * sine
    return Circle(
        n,
        u,
        cosine,
        sine,
        vec.madd(arm.shoulder, arm.l1 * cosine, qt.mul_vec(arm.frame, n)),
        vec.scale(r, qt.mul_vec(arm.frame, u)),
        vec.scale(r, qt.mul_vec(arm.frame, vec.cross(n, u))),
        vec.madd(arm.shoulder, d, qt.mul_vec(arm.frame, n)),
    )


@helper
def elbow_on(circle, phi):
    """The elbow in the world at a swivel angle."""
    q = qt.from_axis_angle((0.0, 0.0, 1.0), phi)
    s, c = 2.0 * q[2] * q[3], 1.0 - 2.0 * q[2] * q[2]
    return vec.madd(vec.madd(circle.middle, c, circle.across), s, circle.beside)


@helper
def gap_at(arm, circle, flesh, root, world, segs, phi):
    """Distance of the arm from the trunk at a swivel angle [m]."""
    return gap_of_arm(flesh, root, world, segs, arm.shoulder, elbow_on(circle, phi), circle.wrist)


@helper
def room_at(arm, circle, flesh, root, world, segs, balls, limits, phi):
    """How far a swivel angle is allowed by the trunk, and by ``limits``; negative where not [rad]."""
    free = (gap_at(arm, circle, flesh, root, world, segs, phi) - TOUCH) / arm.l1
    if limits and free >= 0.0:
        free = min(free, slack(circle.n, circle.u, circle.cosine, circle.sine, -1.0, phi, balls, arm.ball))
    return free


@helper
def within(arm, circle, balls, phi):
    """Whether limits allow a swivel angle."""
    if not arm.limits:
        return True
    return is_free(circle.n, circle.u, circle.cosine, circle.sine, -1.0, phi, balls, arm.ball)


@helper
def refine(arm, circle, flesh, root, world, segs, balls, inside, outside):
    """The allowed angle nearest to ``outside`` between one that is allowed and one that is not (Illinois)."""
    a, b = inside, outside
    limits = not within(arm, circle, balls, outside)  # else they most likely allow all between
    fa = room_at(arm, circle, flesh, root, world, segs, balls, limits, a)
    fb = room_at(arm, circle, flesh, root, world, segs, balls, limits, b)
    for _ in range(REFINEMENTS):
        if fa < ENOUGH or fa - fb < 1e-9 or abs(a - b) < ENOUGH:
            break
        c = (a * fb - b * fa) / (fb - fa)
        f = room_at(arm, circle, flesh, root, world, segs, balls, limits, c)
        if f >= 0.0:
            a, fa, fb = c, f, 0.5 * fb
        else:
            b, fb, fa = c, f, 0.5 * fa
    return a if limits or within(arm, circle, balls, a) else inside


@helper
def least_deep(arm, circle, flesh, root, world, segs, balls, best, most):
    """The angle near ``best`` within the limits at which the arm is least deep, by steps that are halved."""
    step = 0.5 * LARGEST_STEP
    for _ in range(HALVES):
        middle = best
        for i in range(2):
            phi = middle + (2 * i - 1) * step
            if within(arm, circle, balls, phi):
                gap = gap_at(arm, circle, flesh, root, world, segs, phi)
                if gap > most:
                    best, most = phi, gap
        step *= 0.5
    return best


@helper
def find_free(arm, circle, flesh, root, world, segs, balls, about, most, first, step, widest):
    """The allowed swivel angle nearest to ``about``, looked for in steps to both sides, ``widest`` at most.

    ``most`` is the arm's distance from the trunk at ``about`` [m], if limits allow that. The side of the sign
    ``first`` is looked at first. Where no angle is allowed, the one within the limits at which the arm is
    least deep in the trunk; ``about`` where limits allow none, or ``most`` is OUTSIDE.
    """
    best, most = about, most + TOUCH
    last, offset = 0.0, min(step, pi)
    while True:
        for i in range(2):
            sign = first if i == 0 else -first
            phi = about + sign * offset
            if within(arm, circle, balls, phi):
                gap = gap_at(arm, circle, flesh, root, world, segs, phi)
                if gap >= TOUCH:
                    before = about + sign * last
                    return refine(arm, circle, flesh, root, world, segs, balls, phi, before)
                if gap > most:
                    best, most = phi, gap
        if offset >= pi:
            if most >= OUTSIDE:
                return about
            return least_deep(arm, circle, flesh, root, world, segs, balls, best, most)
        last, offset = offset, min(GROWTH * offset, offset + widest, pi)


@helper
def close_arm(arm, balls, upper):
    """An upper arm set within the limits and turned about itself; the elbow flexes towards the target."""
    if arm.limits:
        upper, _ = clamp(balls, arm.ball, upper)
        return close_on(upper, arm.target, arm.l1, arm.l2, -1.0, balls, arm.ball, arm.low, arm.high)
    y = qt.y_axis(upper)
    reach = vec.madd(arm.target, arm.l1, y)
    v = vec.reject(reach, y)
    if vec.norm(v) > 1e-6 * arm.l2:
        upper = turn_about_itself(upper, y, v, -1.0)
    return fold(upper, reach, arm.l1, arm.l2, -1.0, 0.0, pi)


@helper
def turn_stretched(arm, flesh, root, world, segs, balls, upper, hinge, end, before, found, share):
    """An arm that misses its target turns out of the trunk, a share of the way; then closes on the target.

    ``before`` is its distance from the trunk as it is [m], ``found`` what is ``deepest`` there.
    """
    turned = upper
    depth, p_e, p_t = found
    for k in range(STRETCHES):
        if depth <= TOUCH:
            break
        v = vec.unit(qt.inv_mul_vec(arm.frame, vec.sub(p_e, arm.shoulder)))
        w = vec.unit(qt.inv_mul_vec(arm.frame, vec.sub(p_t, arm.shoulder)))
        turned = qt.normalised(qt.mul(qt.arc(v, w, qt.x_axis(turned)), turned))
        if k < STRETCHES - 1:
            here = vec.add(arm.shoulder, qt.mul_vec(arm.frame, vec.scale(-arm.l1, qt.y_axis(turned))))
            lower = qt.mul_vec(qt.mul(turned, hinge), (0.0, -arm.l2, 0.0))
            wrist = vec.add(here, qt.mul_vec(arm.frame, lower))
            depth, p_e, p_t = deepest(flesh, root, world, segs, arm.shoulder, here, wrist)
    turned = qt.normalised(qt.mul(upper, qt.scaled(qt.inv_mul(upper, turned), share)))
    root_turn, bent, there = close_arm(arm, balls, turned)
    here = vec.add(arm.shoulder, qt.mul_vec(arm.frame, vec.scale(-arm.l1, qt.y_axis(root_turn))))
    wrist = vec.add(arm.shoulder, qt.mul_vec(arm.frame, there))
    if gap_of_arm(flesh, root, world, segs, arm.shoulder, here, wrist) > before + 1e-4:
        return root_turn, bent, there
    return upper, hinge, end


@helper
def clear_arm(arm, flesh, root, world, segs, balls, upper, hinge, end):
    """Sequential IK: an arm as posed, or with its elbow out of the trunk, whatever the frame before.

    Returns the local rotations of shoulder and elbow, and the wrist in the arm's frame.
    """
    elbow = vec.scale(-arm.l1, qt.y_axis(upper))
    here = vec.add(arm.shoulder, qt.mul_vec(arm.frame, elbow))
    wrist = vec.add(arm.shoulder, qt.mul_vec(arm.frame, end))
    gap = gap_of_arm(flesh, root, world, segs, arm.shoulder, here, wrist)
    if gap >= 0.0:
        return upper, hinge, end
    circle = make_circle(arm, elbow)
    if vec.norm(vec.sub(end, arm.target)) > MET:
        d, _, _, flexion = triangle(vec.norm(arm.target), arm.l1, arm.l2)
        if circle.sine >= STRAIGHT and (not arm.limits or arm.low <= flexion <= arm.high):
            # Another angle may be free and meet the target, which the limits kept this one from.
            first = 1.0 if vec.dot(circle.beside, vec.sub(arm.shoulder, root)) >= 0.0 else -1.0
            phi = find_free(
                arm, circle, flesh, root, world, segs, balls, 0.0, OUTSIDE, first, COARSE_STEP, COARSE_STEP
            )
            if within(arm, circle, balls, phi) and gap_at(arm, circle, flesh, root, world, segs, phi) >= 0.0:
                turned = root_at(circle.n, circle.u, circle.cosine, circle.sine, -1.0, phi)
                return turned, hinge_at(-1.0, flexion), vec.scale(d, circle.n)
        found = deepest(flesh, root, world, segs, arm.shoulder, here, wrist)
        return turn_stretched(arm, flesh, root, world, segs, balls, upper, hinge, end, gap, found, 1.0)
    if circle.sine < STRAIGHT:
        return upper, hinge, end
    depth, p_e, p_t = deepest(flesh, root, world, segs, arm.shoulder, here, wrist)
    outward = 1.0 if vec.dot(circle.beside, vec.sub(p_t, p_e)) >= 0.0 else -1.0
    step = max(K * depth / arm.l1, LEAST_STEP)
    phi = find_free(arm, circle, flesh, root, world, segs, balls, 0.0, gap, outward, step, LARGEST_STEP)
    return root_at(circle.n, circle.u, circle.cosine, circle.sine, -1.0, phi), hinge, end


@helper
def clear_arm_steadily(arm, flesh, root, world, segs, balls, upper, hinge, end, gap, began, was, bent, most):
    """SIK+: an arm with the swivel angle nearest to that of the last frame which is allowed.

    ``gap`` is its distance from the trunk as it is posed, negative [m].
    ``was`` and ``bent`` are the rotations of the last frame, if it ``began`` before; the angle moves by
    ``most`` [rad] per frame, but for what it moves to be where ``upper`` has it. An elbow that cannot be out
    in this frame is on its way.
    """
    elbow = vec.scale(-arm.l1, qt.y_axis(upper))
    here = vec.add(arm.shoulder, qt.mul_vec(arm.frame, elbow))
    wrist = vec.add(arm.shoulder, qt.mul_vec(arm.frame, end))
    missed = vec.norm(vec.sub(end, arm.target))
    if missed > MET:
        share = min((missed - MET) / GIVES, 1.0)
        found = deepest(flesh, root, world, segs, arm.shoulder, here, wrist)
        return turn_stretched(arm, flesh, root, world, segs, balls, upper, hinge, end, gap, found, share)
    circle = make_circle(arm, elbow)
    if circle.sine < STRAIGHT:
        return upper, hinge, end
    before, far, at_before = 0.0, pi, gap
    if began:
        before = carried_angle(circle.n, circle.u, -1.0, was, bent, arm.l1, arm.l2)
        far = most
        at_before = gap_at(arm, circle, flesh, root, world, segs, before)
        if not within(arm, circle, balls, before):
            at_before = -OUTSIDE
        if at_before >= TOUCH:
            phi = refine(arm, circle, flesh, root, world, segs, balls, before, 0.0)
            return root_at(circle.n, circle.u, circle.cosine, circle.sine, -1.0, phi), hinge, end
    _, p_e, p_t = deepest(flesh, root, world, segs, arm.shoulder, here, wrist)
    outward = 1.0 if vec.dot(circle.beside, vec.sub(p_t, p_e)) >= 0.0 else -1.0
    phi = find_free(
        arm, circle, flesh, root, world, segs, balls, before, at_before, outward, LEAST_STEP, LARGEST_STEP
    )
    turn = min(max(phi - before, -far), far)
    for _ in range(HALVES):
        if within(arm, circle, balls, before + turn):
            phi = before + turn
            return root_at(circle.n, circle.u, circle.cosine, circle.sine, -1.0, phi), hinge, end
        turn *= 0.5
    return upper, hinge, end
