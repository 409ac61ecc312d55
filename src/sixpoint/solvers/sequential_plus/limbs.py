"""Limbs by a pole: which way elbow or knee points, without jumps and within the limits.

The angle phi of the middle joint is counted about the limb's line from where the pole has it. That of the
last frame is carried along by the shortest rotation of the limb's line; the hinge's axis remembers it, also
through a straight limb.
"""

from math import atan2, pi

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.swing_twist import clamp, room
from sixpoint.solvers.sequential.limb import close_on
from sixpoint.solvers.six_points.frame import REACHED
from sixpoint.solvers.tgb.swivel import across, direction, end_of, hinge_at, root_at, triangle

STEP = pi / 18  # rad, between two swivel angles that are tried
TRIES = 18
NEAR, CLOSE = pi / 180, 4  # rad, the first of so many steps beside the angle of the last frame, each doubled
REFINEMENTS = 6


@helper
def arm_pole(side, n, out, down, back, lift):
    """Direction of the elbow in the thorax' frame: outward (more so with a raised hand), down and back."""
    raised = 0.5 * (1.0 + n[1])
    return vec.unit((side * (out + lift * raised), -down, -back))


@helper
def leg_pole(side, out):
    """Direction of the knee in the pelvis' frame: forward and a little outward."""
    return vec.unit((side * out, 0.0, 1.0))


@helper
def carried_angle(n, u, h, upper, hinge, l1, l2):
    """Swivel angle from u about n of a limb that was posed so, its line turned to n by the shortest arc."""
    before, _ = direction(end_of(upper, hinge, l1, l2))
    x = qt.x_axis(upper)
    r = vec.scale(h, vec.cross(n, qt.mul_vec(qt.arc(before, n, x), x)))
    return atan2(vec.dot(vec.cross(u, r), n), vec.dot(u, r))


@helper
def approach(before, clear, lag, memory, fastest, dt):
    """Where a swivel angle ``before`` is after a frame on its way to 0 [rad].

    It gets there with a ``lag`` [s] where the pole is clear (1: across the limb's line), and the slower the
    nearer the pole is to that line (0), where its direction means nothing; never faster than ``fastest``
    [rad/s].
    """
    lag += memory * (1.0 / max(clear * clear, 1e-6) - 1.0)
    kept = lag / (lag + dt) if lag > 0.0 else 0.0
    most = fastest * dt
    return before + min(max((kept - 1.0) * before, -most), most)


@helper
def is_free(n, u, cosine, sine, h, phi, balls, ball):
    """Whether the root joint is within its limits at a swivel angle."""
    _, changed = clamp(balls, ball, root_at(n, u, cosine, sine, h, phi))
    return not changed


@helper
def slack(n, u, cosine, sine, h, phi, balls, ball):
    """How far the root joint is within its limits at a swivel angle; negative outside [rad]."""
    swing, twist = room(balls, ball, root_at(n, u, cosine, sine, h, phi))
    return min(swing, twist)


@helper
def edge(n, u, cosine, sine, h, inside, outside, balls, ball):
    """The swivel angle at the edge of the limits, between one inside and one outside (Illinois method)."""
    a, b = inside, outside
    fa = slack(n, u, cosine, sine, h, a, balls, ball)
    fb = slack(n, u, cosine, sine, h, b, balls, ball)
    for _ in range(REFINEMENTS):
        if fa - fb < 1e-12:
            break
        c = (a * fb - b * fa) / (fb - fa)
        f = slack(n, u, cosine, sine, h, c, balls, ball)
        if f >= 0.0:
            a, fa, fb = c, f, 0.5 * fb
        else:
            b, fb, fa = c, f, 0.5 * fa
    return a


@helper
def free_beside(n, u, cosine, sine, h, before, first, step, tries, growth, balls, ball):
    """The allowed swivel angle nearest to ``before``, looked for in growing steps to both sides.

    The ``first`` side is looked at first. Returns the angle and whether there is one.
    """
    last, offset = 0.0, step
    for _ in range(tries):
        for i in range(2):
            sign = first if i == 0 else -first
            if is_free(n, u, cosine, sine, h, before + sign * offset, balls, ball):
                inside, outside = before + sign * offset, before + sign * last
                return edge(n, u, cosine, sine, h, inside, outside, balls, ball), True
        last, offset = offset, offset * growth + (0.0 if growth > 1.0 else step)
    return before, False


@helper
def close_at(target, n, u, cosine, sine, phi, l1, l2, h, balls, ball, low, high):
    """The limb at a swivel angle, set within its limits and closed on the target as far as they allow."""
    root, _ = clamp(balls, ball, root_at(n, u, cosine, sine, h, phi))
    return close_on(root, target, l1, l2, h, balls, ball, low, high)


@helper
def solve_by_pole(
    target, l1, l2, h, pole, began, upper, hinge, lag, memory, fastest, dt, limits, balls, ball, low, high
):
    """Limb whose middle joint points towards ``pole``, or is on its way there.

    Where the limits forbid that, the swivel angle goes as far as they allow, or moves with their edge. Only
    where it would have to jump, and the target would be missed without, does it change sides.

    Arguments as of ``tgb.swivel.solve_at``; the pole's part across the limb's line is of length 1 where it is
    clear. ``upper`` and ``hinge`` are the rotations of the last frame, if it ``began`` before; the others as
    of ``approach``. Returns the local rotations of root and hinge, and the end's position in the parent's
    frame.
    """
    n, distance = direction(target)
    d, cosine, sine, flexion = triangle(distance, l1, l2)
    u = across(pole, n)
    before, phi = 0.0, 0.0
    if began:
        before = carried_angle(n, u, h, upper, hinge, l1, l2)
        phi = approach(before, vec.norm(vec.reject(pole, n)), lag, memory, fastest, dt)
    if limits:
        if not low <= flexion <= high:
            return close_at(target, n, u, cosine, sine, phi, l1, l2, h, balls, ball, low, high)
        if not is_free(n, u, cosine, sine, h, phi, balls, ball):
            if began and is_free(n, u, cosine, sine, h, before, balls, ball):
                phi = edge(n, u, cosine, sine, h, before, phi, balls, ball)
            else:
                first = 1.0 if phi >= before else -1.0
                phi, free = free_beside(n, u, cosine, sine, h, before, first, NEAR, CLOSE, 2.0, balls, ball)
                if not free:
                    root, bent, end = close_at(
                        target, n, u, cosine, sine, before, l1, l2, h, balls, ball, low, high
                    )
                    if vec.norm(vec.sub(end, target)) > REACHED:
                        phi, free = free_beside(
                            n, u, cosine, sine, h, 0.0, -first, STEP, TRIES, 1.0, balls, ball
                        )
                    if not free:
                        return root, bent, end
    return root_at(n, u, cosine, sine, h, phi), hinge_at(h, flexion), vec.scale(d, n)
