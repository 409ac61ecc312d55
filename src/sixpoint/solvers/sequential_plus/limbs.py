"""Limbs by a pole: which way elbow or knee points, and the nearest swivel angle that keeps the limits."""

from math import pi

from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.swing_twist import clamp
from sixpoint.solvers.sequential.limb import close_on
from sixpoint.solvers.tgb.swivel import across, direction, hinge_at, root_at, triangle

STEP = pi / 18  # rad, between two swivel angles that are tried
TRIES = 18
HALVINGS = 10
SIDE = pi / 3  # rad, how much farther the side of the last frame may be


@helper
def arm_pole(side, n, out, down, back, lift):
    """Direction of the elbow in the thorax' frame: outward (more so with a raised hand), down and back."""
    raised = 0.5 * (1.0 + n[1])
    return (side * (out + lift * raised), -down, -back)


@helper
def leg_pole(side, out):
    """Direction of the knee in the pelvis' frame: forward and a little outward."""
    return (side * out, 0.0, 1.0)


@helper
def is_free(n, u, cosine, sine, h, phi, balls, ball):
    """Whether the root joint is within its limits at a swivel angle."""
    _, changed = clamp(balls, ball, root_at(n, u, cosine, sine, h, phi))
    return not changed


@helper
def first_free(n, u, cosine, sine, h, sign, balls, ball):
    """The first swivel angle within the limits to one side of 0 [rad]; above pi if there is none."""
    for k in range(1, TRIES + 1):
        if is_free(n, u, cosine, sine, h, sign * k * STEP, balls, ball):
            outside, inside = (k - 1) * STEP, k * STEP
            for _ in range(HALVINGS):
                middle = 0.5 * (inside + outside)
                if is_free(n, u, cosine, sine, h, sign * middle, balls, ball):
                    inside = middle
                else:
                    outside = middle
            return inside
    return 4.0


@helper
def nearest_free(n, u, cosine, sine, h, before, balls, ball):
    """The swivel angle nearest to 0 within the limits, and whether there is one.

    ``before`` is that of the last frame: its side is kept unless the other is nearer by far.
    """
    if is_free(n, u, cosine, sine, h, 0.0, balls, ball):
        return 0.0, True
    left = first_free(n, u, cosine, sine, h, 1.0, balls, ball)
    right = first_free(n, u, cosine, sine, h, -1.0, balls, ball)
    if min(left, right) > pi:
        return before, False
    keep = SIDE if before > 0.0 else -SIDE if before < 0.0 else 0.0
    return (left, True) if left <= right + keep else (-right, True)


@helper
def solve_by_pole(target, l1, l2, h, pole, before, limits, balls, ball, low, high):
    """Limb whose middle joint points towards ``pole``.

    Arguments as of ``tgb.swivel.solve_at``; ``before`` is the swivel angle of the last frame. Returns the
    local rotations of root and hinge, the end's position in the parent's frame, and the swivel angle.
    """
    n, distance = direction(target)
    d, cosine, sine, flexion = triangle(distance, l1, l2)
    u = across(pole, n)
    if not limits:
        root = root_at(n, u, cosine, sine, h, 0.0)
        return root, hinge_at(h, flexion), vec.scale(d, n), 0.0
    phi, free = nearest_free(n, u, cosine, sine, h, before, balls, ball)
    root = root_at(n, u, cosine, sine, h, phi)
    if free and low <= flexion <= high:
        return root, hinge_at(h, flexion), vec.scale(d, n), phi
    root, _ = clamp(balls, ball, root)
    root, hinge, end = close_on(root, target, l1, l2, h, balls, ball, low, high)
    return root, hinge, end, phi
