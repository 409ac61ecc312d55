"""Swivel angles of an arm, or leg: which are allowed by the trunk and the limits, and the nearest of them.

Reference: Unzueta et al. 2008, section 8: an arm turns about the line from shoulder to wrist.
"""

from math import pi
from typing import NamedTuple

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.solvers.avoidance.clearance import OUTSIDE, gap_of_arm
from sixpoint.solvers.sequential_plus.limbs import is_free, slack
from sixpoint.solvers.six_points.packing import limb_row
from sixpoint.solvers.tgb.swivel import across, direction, triangle

GROWTH = 1.7  # of the steps in which a free swivel angle is looked for
LEAST_STEP, LARGEST_STEP = pi / 90, pi / 9  # rad
STEPS_OUT = 5  # of a bent arm to one side, before both are looked at
BESIDE = 2e-3  # m, where secant steps aim
REFINEMENTS = 4
ENOUGH = 2e-3  # rad, an angle that is free by less is at the edge
HALVES = 6  # times that a step is halved where no angle is free
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
    gap = gap_at(arm, circle, flesh, root, world, segs, phi)
    return room_of(arm, circle, balls, limits, phi, gap)


@helper
def room_of(arm, circle, balls, limits, phi, gap):
    """The same where the distance from the trunk is known."""
    free = (gap - TOUCH) / arm.l1
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
def refine(arm, circle, flesh, root, world, segs, balls, inside, outside, gap):
    """The allowed angle nearest to ``outside`` between one that is allowed and one that is not (Illinois).

    ``gap`` is the arm's distance from the trunk at ``inside`` [m].
    """
    a, b = inside, outside
    limits = not within(arm, circle, balls, outside)  # else they most likely allow all between
    fa = room_of(arm, circle, balls, limits, a, gap)
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
def step_out(arm, circle, flesh, root, world, segs, balls, gap, step):
    """The swivel angle at which an arm that is ``gap`` from the trunk [m] is out, and whether it was found.

    The first step is given, the others are secant steps to the same side; limits may end them.
    """
    before, phi = 0.0, step
    for _ in range(STEPS_OUT):
        if abs(phi) > pi or not within(arm, circle, balls, phi):
            break
        here = gap_at(arm, circle, flesh, root, world, segs, phi)
        if here >= TOUCH:
            return phi, True
        if here <= gap:
            break
        ahead = min((BESIDE - here) / (here - gap) * abs(phi - before), LARGEST_STEP)
        before, gap = phi, here
        phi += ahead if step > 0.0 else -ahead
    return 0.0, False


@helper
def find_free(arm, circle, flesh, root, world, segs, balls, about, most, first, step, widest):
    """The allowed swivel angle nearest to ``about``, looked for in steps to both sides, ``widest`` at most.

    ``most`` is the arm's distance from the trunk at ``about`` [m], if limits allow that. The side of the sign
    ``first`` is looked at first. Where no angle is allowed, the one within the limits at which the arm is
    least deep in the trunk; ``about`` where limits allow none, or ``most`` is OUTSIDE. Also whether it is
    free.
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
                    return refine(arm, circle, flesh, root, world, segs, balls, phi, before, gap), True
                if gap > most:
                    best, most = phi, gap
        if offset >= pi:
            if most >= OUTSIDE:
                return about, False
            return least_deep(arm, circle, flesh, root, world, segs, balls, best, most), False
        last, offset = offset, min(GROWTH * offset, offset + widest, pi)
