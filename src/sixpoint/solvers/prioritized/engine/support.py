"""The support polygon: convex hull of the feet's points on the floor, and where a point is in it."""

from sixpoint.kernels import vector as vec
from sixpoint.kernels.distance import nearest_on_segment, planar_norm
from sixpoint.kernels.jit import helper
from sixpoint.solvers.prioritized.engine.kinematics import place_of

LIFTED = 0.05  # a point this far above the lowest one bears nothing [m]


@helper
def _turn(hull, i, k, x, z):
    """Twice the signed area of the triangle of two hull points and (x, z)."""
    return (hull[k, 0] - hull[i, 0]) * (z - hull[i, 1]) - (hull[k, 1] - hull[i, 1]) * (x - hull[i, 0])


@helper
def _bearing_points(m, w):
    """Write the points on the floor into the second half of the scratch; returns how many."""
    count, kept, lowest = len(m.points), 0, 1e300
    for i in range(count):
        lowest = min(lowest, place_of(m, w, m.point_joints[i], vec.load(m.points, i))[1])
    for i in range(count):
        place = place_of(m, w, m.point_joints[i], vec.load(m.points, i))
        if place[1] <= lowest + LIFTED:
            w.hull[count + kept, 0], w.hull[count + kept, 1] = place[0], place[2]
            kept += 1
    return kept


@helper
def compute_hull(m, w):
    """Corners of the support polygon, counted round with the inside on the left; returns how many.

    Reference: gift wrapping, Jarvis 1973.
    """
    hull, first = w.hull, len(m.points)
    last = first + _bearing_points(m, w)
    start = first
    for i in range(first, last):
        if hull[i, 0] < hull[start, 0] or (hull[i, 0] == hull[start, 0] and hull[i, 1] < hull[start, 1]):
            start = i
    here, size = start, 0
    while size < last - first:
        hull[size, 0], hull[size, 1] = hull[here, 0], hull[here, 1]
        size += 1
        ahead = -1
        for i in range(first, last):
            gap = planar_norm((hull[i, 0] - hull[here, 0], hull[i, 1] - hull[here, 1]))
            if gap < 1e-9:
                continue
            if ahead < 0:
                ahead = i
                continue
            turn = _turn(hull, here, ahead, hull[i, 0], hull[i, 1])
            reach = planar_norm((hull[ahead, 0] - hull[here, 0], hull[ahead, 1] - hull[here, 1]))
            if turn < -1e-12 or (turn <= 1e-12 and gap > reach):
                ahead = i
        here = ahead
        if here < 0:
            break
        if planar_norm((hull[here, 0] - hull[start, 0], hull[here, 1] - hull[start, 1])) < 1e-9:
            break
    return size


@helper
def _towards(x, z, target):
    gap = (target[0] - x, target[1] - z)
    distance = planar_norm(gap)
    if distance < 1e-12:
        return (0.0, 1.0, 0.0)
    return (-distance, gap[0] / distance, gap[1] / distance)


@helper
def inside_distance(hull, size, x, z, margin):
    """How far (x, z) is inside the polygon shrunk by a margin, and the direction that leads further inside.

    Negative outside. A polygon too narrow for its margin is shrunk by half of what it has.
    """
    if size == 1:
        return _towards(x, z, (hull[0, 0], hull[0, 1]))
    if size == 2:
        a, b = (hull[0, 0], hull[0, 1]), (hull[1, 0], hull[1, 1])
        return _towards(x, z, nearest_on_segment((x, z), a, b))
    cx, cz = 0.0, 0.0
    for i in range(size):
        cx += hull[i, 0] / size
        cz += hull[i, 1] / size
    room = 1e300
    best, nx, nz = 1e300, 0.0, 0.0
    for i in range(size):
        k = (i + 1) % size
        ex, ez = hull[k, 0] - hull[i, 0], hull[k, 1] - hull[i, 1]
        length = planar_norm((ex, ez))
        if length < 1e-9:
            continue
        ix, iz = -ez / length, ex / length
        room = min(room, ix * (cx - hull[i, 0]) + iz * (cz - hull[i, 1]))
        distance = ix * (x - hull[i, 0]) + iz * (z - hull[i, 1])
        if distance < best:
            best, nx, nz = distance, ix, iz
    return (best - min(margin, 0.5 * room), nx, nz)
