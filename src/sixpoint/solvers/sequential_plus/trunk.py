"""The trunk between a placed pelvis and the head: twisted towards the wrists, bent, closed on the head.

Scratch arrays as in ``sequential.spine``.
"""

from math import atan2, sqrt

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.swing_twist import clamp
from sixpoint.solvers.sequential.spine import chord_of, place_trunk

ROUNDS = 8  # Newton steps at most
CLOSED = 1e-7  # m
FAR = 0.01  # how much the damping grows with the square of the distance
HALF_STEP = 0.15  # rad, half the largest turn of a joint in one step
YIELD = 40.0  # how much less a joint counts in the next step that its limits turned back
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


@helper
def twist_to_wrists(filled, pelvis_x, axis, share, largest):
    """Angle about the trunk's axis by which the thorax turns towards the wrists' line [rad]."""
    if filled[2, 3] == 0.0 or filled[3, 3] == 0.0:
        return 0.0
    line = vec.reject(vec.sub(vec.load(filled, 2), vec.load(filled, 3)), axis)
    across = vec.reject(pelvis_x, axis)
    length = vec.norm(line)
    if length < 1e-6 or vec.norm(across) < 1e-6:
        return 0.0
    angle = atan2(vec.dot(vec.cross(across, line), axis), vec.dot(across, line))
    # A line that points backwards (crossed arms) says nothing: it fades out beyond a right angle.
    trust = min(length / 0.3, 1.0) * min(max(2.0 - abs(angle) / 1.5708, 0.0), 1.0)
    return min(max(share * trust * angle, -largest), largest)


@helper
def bend_spine(segments, wanted, twist, bend_share, neck_curve, local, world, segs):
    """Spine with its twist spread evenly, and bent forward by a share of what an arc as short would be."""
    count = segments.shape[0]
    for k in range(1, count):
        qt.store(local, k, qt.IDENTITY)
    place_trunk(segments, local, world, segs)
    if count < 2:
        return
    length = vec.norm(chord_of(segs))
    # An arc of angle a is shorter than its length by the share a^2 / 24.
    bend = bend_share * sqrt(24.0 * max(1.0 - wanted / length, 0.0)) / (count - 1)
    turn = qt.mul(qt.from_axis_angle(Y, twist / (count - 1)), qt.from_axis_angle(X, bend))
    for k in range(1, count):
        qt.store(local, k, turn)
    if count >= 5:  # a neck of two joints
        for k, curve in ((count - 2, -neck_curve), (count - 1, neck_curve)):
            qt.store(local, k, qt.mul(turn, qt.from_axis_angle(X, curve)))
    place_trunk(segments, local, world, segs)


@helper
def solve_three(a, b, c, d, e, f, v):
    """Solution of the symmetric system [[a, b, c], [b, d, e], [c, e, f]] x = v."""
    m0, m1, m2 = d * f - e * e, c * e - b * f, b * e - c * d
    m3, m4, m5 = a * f - c * c, b * c - a * e, a * d - b * b
    det = a * m0 + b * m1 + c * m2
    if abs(det) < 1e-18:
        return (0.0, 0.0, 0.0)
    x, y, z = vec.scale(1.0 / det, v)
    return (m0 * x + m1 * y + m2 * z, m1 * x + m3 * y + m4 * z, m2 * x + m4 * y + m5 * z)


@helper
def half_sine(a, b):
    """Sine of half the angle between two rotations."""
    x, y, z, _ = qt.inv_mul(a, b)
    return vec.norm((x, y, z))


@helper
def close_trunk(segments, balls, limits, goal, first, damping, low, hold, local, world, segs):
    """Turn the spine by the least angles that bring the head to ``goal`` (from the pelvis) [m].

    Gauss-Newton steps of least weighted norm. Joints turn from the ``first`` on: 1, or 0 if the pelvis turns
    too. ``low`` is the weight of the lowest joint, one that of the highest. ``hold`` is how much of the
    turns' sum, the turn of the spine's top, is avoided: 0 none of it, 1 all. The fourth numbers of ``segs``
    are the joints' weights. Returns how far the head is off [m].
    """
    count = segments.shape[0]
    error = vec.sub(goal, chord_of(segs))
    if count <= first:
        return vec.norm(error)
    slope = (1.0 - low) / max(count - 2, 1)
    for k in range(first, count):
        segs[k, 3] = low + slope * max(k - 1, 0)
    for step in range(ROUNDS):
        size = vec.dot(error, error)
        if size < CLOSED * CLOSED and (step > 0 or not limits):
            break
        a = damping + FAR * size
        b, c, d, e, f = 0.0, 0.0, a, 0.0, a
        lever, middle, total = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
        for k in range(count - 1, first - 1, -1):
            lever = vec.add(lever, vec.load(segs, k))
            w = segs[k, 3]
            middle, total = vec.madd(middle, w, lever), total + w
            x, y, z = lever
            a += w * (y * y + z * z)
            b -= w * x * y
            c -= w * x * z
            d += w * (x * x + z * z)
            e -= w * y * z
            f += w * (x * x + y * y)
        if hold > 0.0:
            middle = vec.scale(hold / total, middle)
            x, y, z = middle
            w = total / hold
            a -= w * (y * y + z * z)
            b += w * x * y
            c += w * x * z
            d -= w * (x * x + z * z)
            e += w * y * z
            f -= w * (x * x + y * y)
            lever = vec.sub(lever, middle)
        force = vec.scale(0.5, solve_three(a, b, c, d, e, f, error))
        for k in range(first, count):
            turn = vec.scale(segs[k, 3], vec.cross(lever, force))
            lever = vec.sub(lever, vec.load(segs, k))
            size = vec.dot(turn, turn)
            if size > HALF_STEP * HALF_STEP:
                turn = vec.scale(HALF_STEP / sqrt(size), turn)
            # Half the turn with a 1, normalised: exact to third order, which is enough for a step.
            x, y, z = qt.inv_mul_vec(qt.load(world, k - 1), turn) if k > 0 else turn
            q = qt.normalised(qt.mul((x, y, z, 1.0), qt.load(local, k)))
            if limits:  # a joint that is turned back counts less in the next step
                wanted = q
                q, changed = clamp(balls, k, q)
                if changed:
                    segs[k, 3] /= 1.0 + YIELD * half_sine(wanted, q)
            qt.store(local, k, q)
        place_trunk(segments, local, world, segs)
        error = vec.sub(goal, chord_of(segs))
    return vec.norm(error)
