"""Step 4: the clavicle moves only when the arm alone cannot reach (Unzueta et al. 2008, Algorithm 4).

The listing's ``L2 = |W - ST|`` contradicts the text and the legend of its figure 3; the distance from
the shoulder to the wrist's target is meant. W is the wrist of the stretched arm.
"""

from math import acos

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.swing_twist import clamp


@helper
def solve_clavicle(start, clavicle, target, reach, limits, balls, ball):
    """Turn the clavicle so that the stretched arm just reaches.

    Args:
        start: Local rotation to start from (neutral, or held from the previous frame).
        clavicle: Shoulder from the sternoclavicular joint in the neutral pose [m].
        target: Wrist target from the sternoclavicular joint, in the parent's frame [m].
        reach: Length of the stretched arm [m].
        limits: Whether joint limits hold.
        balls: Swing and twist limits.
        ball: Row of the clavicle in ``balls``.

    Returns:
        Local rotation of the sternoclavicular joint.
    """
    c = vec.norm(clavicle)
    if c < 1e-9:
        return start
    shoulder = qt.mul_vec(start, clavicle)
    gap = vec.norm(vec.sub(target, shoulder))
    if gap <= reach:
        return start
    d = vec.norm(target)
    normal = vec.cross(shoulder, target)
    if vec.norm(normal) < 1e-9 * c * d:
        return start
    wanted = acos(min(max((c * c + d * d - reach * reach) / (2.0 * c * d), -1.0), 1.0))
    current = acos(min(max((c * c + d * d - gap * gap) / (2.0 * c * d), -1.0), 1.0))
    if current <= wanted:
        return start
    turned = qt.mul(qt.from_axis_angle(vec.unit(normal), current - wanted), start)
    if limits:
        turned, _ = clamp(balls, ball, turned)
    return turned
