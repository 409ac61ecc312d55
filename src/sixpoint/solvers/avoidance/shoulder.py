"""An arm that no swivel angle takes out of the trunk: its clavicle gives way, back or forward.

Not in the paper. Limits of the shoulder bind elbows where the hand is across the chest or behind the back; a
few degrees of the clavicle, within its own limits, move them. The angle is the least that frees the arm, it
moves at a limited speed, and goes back to zero at that speed.
"""

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.swing_twist import clamp

MOST = 0.35  # rad, of a clavicle
TILT = 1.5  # of its turn about itself: backward where it goes forward, as when an arm is raised
SPEED = 6.0  # rad/s
GAIN = 1e-4  # m, less is no way out
TRIES = 3  # of finding the least angle that frees the arm
CLOSE = 5e-3  # rad, an angle so near to the least one is it


@helper
def draw_clavicle(model, limits, limb, angle, base, world, frame, place):
    """A clavicle turned from ``base`` about Y by an angle and about X by ``TILT`` of that, within its limits.

    Returns its local rotation, the world rotation of what carries the shoulder, and where the shoulder is.
    """
    row = model.segments.shape[0] + limb
    chest, bone = qt.load(world, model.chest[limb]), vec.load(model.clavicles, limb)
    tilt = TILT * angle if limb == 0 else -TILT * angle
    turn = qt.mul(qt.from_axis_angle((0.0, 1.0, 0.0), angle), qt.from_axis_angle((1.0, 0.0, 0.0), tilt))
    turned = qt.mul(base, turn)
    if limits:
        turned, _ = clamp(model.balls, row, turned)
    joint = vec.sub(place, qt.mul_vec(frame, bone))
    above = qt.mul(chest, turned)
    return turned, above, vec.add(joint, qt.mul_vec(above, bone))


@helper
def angle_range(before, began, dt):
    """Least and largest angle of a clavicle in this frame [rad]."""
    if not began:
        return -MOST, MOST
    step = SPEED * dt
    return max(before - step, -MOST), min(before + step, MOST)
