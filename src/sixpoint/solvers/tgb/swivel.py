"""A limb that reaches a target, turned by its swivel angle (Tolani, Goswami and Badler 2000).

Root A, middle joint B, end C. For a target at distance d the middle joint lies on a circle about the line
from A to the target; the swivel angle phi says where, from the side of a reference direction. All vectors are
in the frame of the limb's parent, where the neutral limb hangs along -Y; ``h`` is -1 for an elbow and +1 for
a knee: the hinge's rotation is h times the flexion about X.
"""

from math import acos, atan2, cos, sin, sqrt

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.swing_twist import clamp

COARSE, FINE = 0.1, 0.01  # rad, the steps of the spine's search
HALF_CIRCLE, NEAR = 31, 10  # samples to either side: 63 of the circle, 21 around the best


@helper
def triangle(distance, l1, l2):
    """Of the triangle l1, l2, d: d as far as it can be, cosine and sine at the root, flexion [rad]."""
    d = min(max(distance, abs(l1 - l2)), l1 + l2)
    cosine = 1.0
    if d > 1e-9:
        cosine = min(max((l1 * l1 + d * d - l2 * l2) / (2.0 * l1 * d), -1.0), 1.0)
    # Half angles: exact near full extension, where the cosine rule is not.
    far = max((l1 + l2 - d) * (l1 + l2 + d), 0.0)
    near = max((d - l1 + l2) * (d + l1 - l2), 0.0)
    sine = sqrt(far * near) / (2.0 * l1 * d) if d > 1e-9 else 0.0
    return d, cosine, min(sine, 1.0), 2.0 * atan2(sqrt(far), sqrt(near))


@helper
def across(reference, n):
    """Unit direction of the reference across the unit vector n; any other where it runs along n."""
    u = vec.reject(reference, n)
    if vec.norm(u) < 1e-6:
        u = vec.reject((1.0, 0.0, 0.0) if abs(n[0]) < 0.7 else (0.0, 0.0, 1.0), n)
    return vec.unit(u)


@helper
def root_at(n, u, cosine, sine, h, phi):
    """Rotation of the root joint that puts the middle joint at swivel angle phi from u about n."""
    c, s = cos(phi), sin(phi)
    v = vec.cross(n, u)
    r = (c * u[0] + s * v[0], c * u[1] + s * v[1], c * u[2] + s * v[2])
    x = vec.scale(h, vec.cross(r, n))
    y = vec.scale(-1.0, vec.madd(vec.scale(cosine, n), sine, r))
    return qt.from_axes(x, y, vec.cross(x, y))


@helper
def hinge_at(h, flexion):
    return (h * sin(0.5 * flexion), 0.0, 0.0, cos(0.5 * flexion))


@helper
def end_of(root, hinge, l1, l2):
    """End of the limb in the parent's frame."""
    upper = vec.scale(-l1, qt.y_axis(root))
    return vec.add(upper, qt.mul_vec(qt.mul(root, hinge), (0.0, -l2, 0.0)))


@helper
def direction(target):
    """Unit vector to the target, and its distance; down where the target is at the root."""
    distance = vec.norm(target)
    if distance < 1e-9:
        return (0.0, -1.0, 0.0), 0.0
    return vec.scale(1.0 / distance, target), distance


@helper
def solve_at(target, l1, l2, h, reference, phi, limits, balls, ball, low, high):
    """Limb at a swivel angle; with limits joints are then set within them and the end may leave the target.

    Args:
        target: Where the end should be, from the limb's root [m].
        l1: Upper length [m].
        l2: Lower length [m].
        h: -1 elbow, +1 knee.
        reference: Direction on whose side the middle joint is at phi = 0.
        phi: Swivel angle about the line to the target [rad].
        limits: Whether joint limits hold.
        balls: Swing and twist limits.
        ball: Row of the root joint in ``balls``.
        low: Least flexion [rad].
        high: Largest flexion [rad].

    Returns:
        Local rotation of the root joint, of the hinge, and the end's position in the parent's frame.
    """
    n, distance = direction(target)
    d, cosine, sine, flexion = triangle(distance, l1, l2)
    root = root_at(n, across(reference, n), cosine, sine, h, phi)
    return finish(root, flexion, n, d, l1, l2, h, limits, balls, ball, low, high)


@helper
def finish(root, flexion, n, d, l1, l2, h, limits, balls, ball, low, high):
    """Set the joints of a limb within their limits."""
    if limits:
        root, changed = clamp(balls, ball, root)
        if changed or flexion < low or flexion > high:
            hinge = hinge_at(h, min(max(flexion, low), high))
            return root, hinge, end_of(root, hinge, l1, l2)
    return root, hinge_at(h, flexion), vec.scale(d, n)


@helper
def effort(root, weight):
    """Swing squared plus weight times twist squared of a limb's root joint [rad^2]."""
    swing = acos(
        min(max(qt.y_axis(root)[1], -1.0), 1.0)
    )  # the segment and its neutral direction, both along -Y
    twist = qt.twist_angle(root, (0.0, -1.0, 0.0))
    return swing * swing + weight * twist * twist


@helper
def solve_easiest(target, l1, l2, h, weight, limits, balls, ball, low, high):
    """Limb at the swivel angle of least effort, found on the whole circle by coarse, then fine steps.

    Arguments and result as of ``solve_at``; ``weight`` is that of twist against swing.

    Reference: Unzueta et al. 2008, section 9 (their TGBSIK).
    """
    n, distance = direction(target)
    d, cosine, sine, flexion = triangle(distance, l1, l2)
    u = across((0.0, 0.0, h), n)  # elbows start behind the limb, knees before it
    at_zero = root_at(n, u, cosine, sine, h, 0.0)
    # The two lowest samples with higher neighbours: the lowest valley may be narrower than a step.
    first, second, low_first, low_second = 0.0, 0.0, 1e300, 1e300
    turn = qt.from_axis_angle(n, COARSE)
    root = qt.mul(qt.from_axis_angle(n, -(HALF_CIRCLE + 1) * COARSE), at_zero)
    before = effort(root, weight)
    root = qt.mul(turn, root)
    cost = effort(root, weight)
    for k in range(1 - HALF_CIRCLE, HALF_CIRCLE + 2):
        root = qt.mul(turn, root)
        after = effort(root, weight)
        if before >= cost <= after:
            if cost < low_first:
                second, low_second = first, low_first
                first, low_first = COARSE * (k - 1), cost
            elif cost < low_second:
                second, low_second = COARSE * (k - 1), cost
        before, cost = cost, after
    best, least = first, 1e300
    for middle in (first, second):
        root = qt.mul(qt.from_axis_angle(n, middle - NEAR * FINE), at_zero)
        turn = qt.from_axis_angle(n, FINE)
        for k in range(-NEAR, NEAR + 1):
            cost = effort(root, weight)
            if cost < least:
                best, least = middle + FINE * k, cost
            root = qt.mul(turn, root)
    root = root_at(n, u, cosine, sine, h, best)
    return finish(root, flexion, n, d, l1, l2, h, limits, balls, ball, low, high)
