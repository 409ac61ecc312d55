"""The trunk between a placed pelvis and the head: twisted towards the wrists, bent, closed on the head.

Scratch arrays as in ``sequential.spine``.
"""

from math import atan2

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.swing_twist import clamp
from sixpoint.solvers.sequential.bending import plane_components, search_angle
from sixpoint.solvers.sequential.spine import chord_of, place_trunk

ROUNDS = 8  # Newton steps at most
CLOSED = 1e-9  # m
STEP = 0.3  # rad, largest turn of a joint in one step
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
def start_trunk(segments, wanted, twist, bend_share, neck_curve, local, world, segs, flat):
    """Spine with its twist spread evenly and a share of the bend that would give the wanted distance."""
    count = segments.shape[0]
    for k in range(1, count):
        qt.store(local, k, qt.IDENTITY)
    place_trunk(segments, local, world, segs)
    if count < 2:
        return
    bend = 0.0
    if wanted < vec.norm(chord_of(segs)):
        along = plane_components(segs, qt.x_axis(qt.load(local, 0)), flat)
        phi, _ = search_angle(segments, flat, along, wanted, False)
        bend = -2.0 * phi / (count - 1) * bend_share
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
    return (
        (m0 * v[0] + m1 * v[1] + m2 * v[2]) / det,
        (m1 * v[0] + m3 * v[1] + m4 * v[2]) / det,
        (m2 * v[0] + m4 * v[1] + m5 * v[2]) / det,
    )


@helper
def close_trunk(segments, balls, limits, goal, damping, low, hold, local, world, segs):
    """Turn the spine by the least angles that bring the head to ``goal`` (from the pelvis) [m].

    Gauss-Newton steps of least weighted norm; ``low`` is the weight of the lowest joint, one that of the
    highest. ``hold`` is how much of the turns' sum, the turn of the spine's top, is avoided: 0 none of it,
    1 all. Returns how far the head is off [m].
    """
    count = segments.shape[0]
    error = vec.sub(goal, chord_of(segs))
    for _ in range(ROUNDS):
        if vec.norm(error) < CLOSED or count < 2:
            break
        a, b, c, d, e, f = damping, 0.0, 0.0, damping, 0.0, damping
        lever, middle, total = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
        for k in range(count - 1, 0, -1):
            lever = vec.add(lever, vec.load(segs, k))
            w = low + (1.0 - low) * (k - 1) / max(count - 2, 1)
            middle, total = vec.madd(middle, w, lever), total + w
            x, y, z = lever
            a += w * (y * y + z * z)
            b -= w * x * y
            c -= w * x * z
            d += w * (x * x + z * z)
            e -= w * y * z
            f += w * (x * x + y * y)
        middle = vec.scale(hold / total, middle)
        if hold > 0.0:
            x, y, z = middle
            w = total / hold
            a -= w * (y * y + z * z)
            b += w * x * y
            c += w * x * z
            d -= w * (x * x + z * z)
            e += w * y * z
            f -= w * (x * x + y * y)
        force = solve_three(a, b, c, d, e, f, error)
        lever = vec.sub(chord_of(segs), middle)
        for k in range(1, count):
            lever = vec.sub(lever, vec.load(segs, k - 1))
            w = low + (1.0 - low) * (k - 1) / max(count - 2, 1)
            turn = vec.scale(w, vec.cross(lever, force))
            size = vec.norm(turn)
            if size > STEP:
                turn = vec.scale(STEP / size, turn)
            parent = qt.load(world, k - 1)
            q = qt.mul(qt.exp(qt.inv_mul_vec(parent, turn)), qt.load(local, k))
            q = qt.normalised(q)
            if limits:
                q, _ = clamp(balls, k, q)
            qt.store(local, k, q)
        place_trunk(segments, local, world, segs)
        error = vec.sub(goal, chord_of(segs))
    return vec.norm(error)
