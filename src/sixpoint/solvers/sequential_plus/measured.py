"""What measured rotations tell: the bend and twist of the spine, and where elbows and knees point.

A measured rotation is a row of ``turned`` (6, 4), in the order of the effectors: the world rotation of the
anatomical frame; NaN where there is none. ``turned`` has no rows where no rotation is used.
"""

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.swing_twist import clamp


@helper
def is_measured(turned, effector):
    """Whether there is a rotation of an effector."""
    return turned.shape[0] > 0 and turned[effector, 3] == turned[effector, 3]


@helper
def lean_to_head(segments, head, twist, twist_part, bend_part, rise, local):
    """Add to the spine its parts of the head's rotation against the pelvis.

    The parts of the joints' world rotations grow with a power of their height, so that the neck turns most:
    ``twist_part`` and ``bend_part`` would be those of a joint at the head. ``twist`` is what the spine is
    twisted by already, ``head`` the head's rotation in the pelvis' frame.
    """
    v = qt.log(head)
    count = segments.shape[0]
    whole = 0.0
    for k in range(count):
        whole += vec.norm(vec.load(segments, k))
    height, before = vec.norm(vec.load(segments, 0)), 0.0
    for k in range(1, count):
        length = vec.norm(vec.load(segments, k))
        here = ((height + 0.5 * length) / whole) ** rise
        part = here - before
        turn = (bend_part * part * v[0], twist_part * part * (v[1] - twist), bend_part * part * v[2])
        qt.store(local, k, qt.normalised(qt.mul(qt.load(local, k), qt.exp(turn))))
        height, before = height + length, here


@helper
def turn_end(row, frame, turned, effector, limits, balls, local):
    """Rotate an extremity as it was measured; ``frame`` is its parent's world rotation. Whether it could."""
    if not is_measured(turned, effector):
        qt.store(local, row, qt.IDENTITY)
        return True
    q = qt.normalised(qt.inv_mul(frame, qt.load(turned, effector)))
    changed = False
    if limits:
        q, changed = clamp(balls, row, q)
    qt.store(local, row, q)
    return not changed


@helper
def pole_of_end(n, pole, end, side, along, front, grip, tilt):
    """Direction of elbow or knee from what is usual and from the rotation of hand or foot.

    ``n`` is the limb's line, ``pole`` the usual direction, ``end`` the rotation of the extremity, all in the
    frame of the limb's parent. The extremity's long axis (``along``) and its front lie in the limb's plane,
    more or less; its lateral axis (``grip``) and, on its ``side``, the long one (``tilt``) lie across it.
    """
    y = qt.y_axis(end)
    told = vec.add(vec.scale(along, y), vec.scale(front, qt.z_axis(end)))
    across = vec.add(vec.scale(grip, qt.x_axis(end)), vec.scale(side * tilt, y))
    return vec.add(vec.reject(vec.add(pole, told), n), vec.cross(across, n))
