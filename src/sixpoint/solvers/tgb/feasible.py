"""Which swivel angles keep a limb within its limits, as intervals.

Tolani, Goswami and Badler solve for the swivel angles at which each Euler angle of the shoulder meets its
limit; with swing and twist limits the circle is sampled instead and every boundary refined by bisection.
"""

from math import asin, atan2, pi

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper
from sixpoint.kernels.swing_twist import clamp
from sixpoint.solvers.tgb.swivel import across, direction, hinge_at, root_at, triangle

SAMPLES = 72
BISECTIONS = 12  # 5 degrees / 2^12: below 1e-3 rad by far


@helper
def wrist_angles(q):
    """Pronation, flexion and deviation [rad] of q = Rot(Y, p) Rot(Z, f) Rot(X, d)."""
    x, y, z = qt.x_axis(q), qt.y_axis(q), qt.z_axis(q)
    flexion = asin(min(max(x[1], -1.0), 1.0))
    if abs(x[1]) > 1.0 - 1e-9:  # pronation and deviation turn about one line
        return atan2(y[2], z[2]), flexion, 0.0
    return atan2(-x[2], x[0]), flexion, atan2(-z[1], y[1])


@helper
def is_feasible(n, u, cosine, sine, h, phi, balls, hinge, goal, wrist):
    """Whether root, hinge and (with a goal rotation) forearm and wrist are within their limits."""
    root = root_at(n, u, cosine, sine, h, phi)
    _, changed = clamp(balls, 0, root)
    if changed:
        return False
    if goal[3] > 1.5:  # no goal
        return True
    angles = wrist_angles(qt.inv_mul(qt.mul(root, hinge), goal))
    for k in range(3):
        if angles[k] < wrist[k, 0] or angles[k] > wrist[k, 1]:
            return False
    return True


@entry
def find_feasible(target, limb, reference, balls, goal, wrist, intervals):
    """Intervals of feasible swivel angles.

    Args:
        target: (1, 3) where the end should be, from the limb's root, in the parent's frame [m].
        limb: (5,) upper and lower length [m], least and largest flexion [rad], and -1 for an elbow, +1 for a
            knee.
        reference: (1, 3) direction on whose side the middle joint is at angle 0.
        balls: (1, W) limits of the root joint, see ``kernels.swing_twist``.
        goal: (1, 4) rotation of the end in the parent's frame; (0, 0, 0, 2) for none.
        wrist: (3, 2) ranges of pronation, flexion and deviation [rad].
        intervals: (n, 2) out, [rad]; the first ends after the start of the circle, the last may pass pi.

    Returns:
        How many there are.
    """
    l1, l2, low, high, h = limb[0], limb[1], limb[2], limb[3], limb[4]
    n, distance = direction(vec.load(target, 0))
    _, cosine, sine, flexion = triangle(distance, l1, l2)
    if flexion < low - 1e-9 or flexion > high + 1e-9:
        return 0
    u, hinge, wanted = across(vec.load(reference, 0), n), hinge_at(h, flexion), qt.load(goal, 0)
    step = 2.0 * pi / SAMPLES
    before = is_feasible(n, u, cosine, sine, h, -pi, balls, hinge, wanted, wrist)
    whole, count, opened, first_end = before, 0, before, pi
    start = -pi
    for k in range(1, SAMPLES + 1):
        now = is_feasible(n, u, cosine, sine, h, -pi + k * step, balls, hinge, wanted, wrist)
        if now != before:
            whole = False
            inside, outside = -pi + (k - 1) * step, -pi + k * step
            if now:
                inside, outside = outside, inside
            for _ in range(BISECTIONS):
                middle = 0.5 * (inside + outside)
                if is_feasible(n, u, cosine, sine, h, middle, balls, hinge, wanted, wrist):
                    inside = middle
                else:
                    outside = middle
            if now:
                start = inside
            elif opened:  # the interval that began before the start of the circle: closed at its end
                first_end, opened = inside, False
            else:
                intervals[count, 0], intervals[count, 1] = start, inside
                count += 1
        before = now
    if whole:
        if before:
            intervals[0, 0], intervals[0, 1] = -pi, pi
            return 1
        return 0
    if before:  # it goes on over the start of the circle
        intervals[count, 0], intervals[count, 1] = start, first_end + 2.0 * pi
        count += 1
    return count
