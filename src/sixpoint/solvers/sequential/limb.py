"""Step 5: a limb from its stretched neutral pose, in closed form (Unzueta et al. 2008, Algorithm 5).

All vectors are in the frame of the limb's parent, where the neutral limb hangs along -Y. ``h`` is -1 for
an elbow (folds to +Z) and +1 for a knee (folds to -Z): the hinge's rotation is h times the flexion about X.
"""

from math import atan2, cos, sin, sqrt

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.swing_twist import clamp

OVERHEAD = 0.99985  # cosine of 1 degree


@helper
def point_at(u):
    """Rotation that takes -Y to the unit vector u: the shortest one, or over the front when u is +Y."""
    if u[1] > OVERHEAD:  # the antipode of the neutral pose: raise forward, about -X, then correct
        return qt.mul(qt.arc((0.0, 1.0, 0.0), u, (1.0, 0.0, 0.0)), (-1.0, 0.0, 0.0, 0.0))
    return qt.normalised((-u[2], 0.0, u[0], 1.0 - u[1]))


@helper
def place_leg(hips, side, root, world):
    """World rotation of a hip's parent, and where the hip is."""
    frame = qt.load(world, 0)
    return frame, vec.add(root, qt.mul_vec(frame, vec.load(hips, side)))


@helper
def solve_limb(target, l1, l2, h, limits, balls, ball, flexion_low, flexion_high):
    """Pose one limb.

    Args:
        target: Where the end should be, from the limb's root, in the parent's frame [m].
        l1: Upper length [m].
        l2: Lower length [m].
        h: -1 elbow, +1 knee.
        limits: Whether joint limits hold.
        balls: Swing and twist limits.
        ball: Row of the root joint in ``balls``.
        flexion_low: Least flexion [rad].
        flexion_high: Largest flexion [rad].

    Returns:
        Local rotation of the root joint, of the hinge, and the end's position in the parent's frame.
    """
    distance = vec.norm(target)
    u = (0.0, -1.0, 0.0)
    if distance > 1e-9:
        u = vec.scale(1.0 / distance, target)
    d = min(max(distance, abs(l1 - l2)), l1 + l2)
    root = point_at(u)  # line 2
    # Lines 3-4: half angles of the triangle l1, l2, d, in the form that is exact near full extension.
    half_sin = 0.0
    if d > 1e-9:
        half_sin = sqrt(min(max((l2 - l1 + d) * (l2 + l1 - d) / (4.0 * l1 * d), 0.0), 1.0))
    root = qt.mul(root, (-h * half_sin, 0.0, 0.0, sqrt(1.0 - half_sin * half_sin)))
    bend_cos = sqrt(min(max((d - l1 + l2) * (d + l1 - l2) / (4.0 * l1 * l2), 0.0), 1.0))
    bend_sin = sqrt(min(max((l1 + l2 - d) * (l1 + l2 + d) / (4.0 * l1 * l2), 0.0), 1.0))
    hinge = (h * bend_sin, 0.0, 0.0, bend_cos)
    if not limits:
        return root, hinge, vec.scale(d, u)
    limited, changed = clamp(balls, ball, root)  # line 6
    flexion = 2.0 * atan2(bend_sin, bend_cos)
    if not changed and flexion_low <= flexion <= flexion_high:
        return root, hinge, vec.scale(d, u)
    # Line 7, elbow-torso avoidance, is in ``avoidance.elbow``: it needs the trunk.
    return close_on(limited, target, l1, l2, h, balls, ball, flexion_low, flexion_high)


@helper
def close_on(root, target, l1, l2, h, balls, ball, flexion_low, flexion_high):
    """Lines 8-12: turn the clamped upper segment about itself and flex, as near to the target as it gets."""
    y = qt.y_axis(root)
    reach = vec.madd(target, l1, y)  # from the middle joint to the target; the segment runs along -y
    v = vec.reject(reach, y)
    if vec.norm(v) > 1e-6 * l2:
        root = turn_about_itself(root, y, v, h)  # line 9
        root, _ = clamp(balls, ball, root)  # line 10
    return fold(root, reach, l1, l2, h, flexion_low, flexion_high)


@helper
def turn_about_itself(root, y, v, h):
    """Turn an upper segment, along -y, so that the limb folds towards v, which is across it."""
    z = qt.z_axis(root)
    aim = vec.scale(-h / vec.norm(v), v)
    half = 0.5 * atan2(vec.dot(vec.cross(z, aim), y), vec.dot(z, aim))
    return qt.mul(root, (0.0, sin(half), 0.0, cos(half)))


@helper
def fold(root, reach, l1, l2, h, flexion_low, flexion_high):
    """Flex towards ``reach``, from the middle joint to the target; returns root, hinge and end."""
    z, y = qt.z_axis(root), qt.y_axis(root)
    flexion = atan2(-h * vec.dot(reach, z), -vec.dot(reach, y))  # line 11
    flexion = min(max(flexion, flexion_low), flexion_high)  # line 12
    hinge = (h * sin(0.5 * flexion), 0.0, 0.0, cos(0.5 * flexion))
    end = vec.add(vec.scale(-l1, y), qt.mul_vec(qt.mul(root, hinge), (0.0, -l2, 0.0)))
    return root, hinge, end
