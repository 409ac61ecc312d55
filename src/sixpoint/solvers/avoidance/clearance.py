"""How far a ball of an arm is from the trunk, and which way out is the shortest.

Reference: Unzueta et al. 2008, section 8: the depth is measured in the XZ plane of the trunk's joint.
"""

from math import sqrt

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.distance import nearest_on_segment
from sixpoint.kernels.jit import helper
from sixpoint.solvers.avoidance.packing import BALL, DIRECTIONS, FIRST_BALL, HEADER, SLICES

OUTSIDE = 1.0  # m, how far is said of what is beside or above all prisms


@helper
def slice_at(row, y):
    """Outline below a height, as the place of its first number, and how far the height is towards the next."""
    t = (y - row[2]) / max(row[3] - row[2], 1e-9) * (SLICES - 1)
    k = min(max(int(t), 0), SLICES - 2)
    return HEADER + k * DIRECTIONS, min(max(t - k, 0.0), 1.0)


@helper
def gap_to_prism(row, p):
    """Distance of a point from an outline along the ray from its centre; negative inside [m]."""
    x, z = p[0] - row[0], p[2] - row[1]
    if p[1] < row[2] or p[1] > row[3]:
        return OUTSIDE
    square = x * x + z * z
    if square > row[4] * row[4]:
        return sqrt(square) - row[4] if square < 4.0 * row[4] * row[4] else OUTSIDE
    first, up = slice_at(row, p[1])
    diamond = abs(x) + abs(z)
    if diamond < 1e-9:
        return -row[first]
    a = 1.0 - x / diamond if z >= 0.0 else 3.0 + x / diamond
    a *= 0.25 * DIRECTIONS
    k = int(a)
    t = a - k
    k = k % DIRECTIONS
    n = k + 1 if k + 1 < DIRECTIONS else 0
    low = row[first + k] + t * (row[first + n] - row[first + k])
    above = first + DIRECTIONS
    high = row[above + k] + t * (row[above + n] - row[above + k])
    return sqrt(square) * (1.0 - (low + up * (high - low)) / diamond)


@helper
def gap_to_trunk(flesh, root, world, segs, p):
    """The least of ``gap_to_prism`` of a world point; ``root`` is the place of the first trunk joint."""
    least, place = OUTSIDE, root
    for k in range(flesh.prisms.shape[0]):
        q = qt.inv_mul_vec(qt.load(world, k), vec.sub(p, place))
        least = min(least, gap_to_prism(flesh.prisms[k], q))
        place = vec.add(place, vec.load(segs, k))
    return least


@helper
def ball_at(flesh, i, shoulder, elbow, wrist):
    """Centre of a ball of an arm."""
    b = FIRST_BALL + BALL * i
    other = wrist if flesh.arms[b] > 0.0 else shoulder
    return vec.madd(elbow, flesh.arms[b + 1], vec.sub(other, elbow))


@helper
def gap_of_arm(flesh, root, world, segs, shoulder, elbow, wrist):
    """The least distance of an arm's balls from the trunk; negative inside [m].

    Of what the wrist, which is where it has to be, is inside, a ball's share of the forearm counts as none.
    """
    count = int(flesh.arms[0])
    least, wrist_gap = OUTSIDE, 0.0
    if count > 3:
        wrist_gap = min(gap_to_trunk(flesh, root, world, segs, wrist), 0.0)
    for i in range(count):
        b = FIRST_BALL + BALL * i
        gap = gap_to_trunk(flesh, root, world, segs, ball_at(flesh, i, shoulder, elbow, wrist))
        gap += flesh.arms[b + 2]
        if flesh.arms[b] > 0.0:
            gap -= flesh.arms[b + 1] * wrist_gap
        least = min(least, gap)
    return least


@helper
def corner(row, first, up, k):
    """A corner of the outline at a height, seen from its centre: x and z."""
    j = k % DIRECTIONS
    a = 4.0 * j / DIRECTIONS
    x = 1.0 - a if a <= 2.0 else a - 3.0
    z = 1.0 - abs(x) if a <= 2.0 else abs(x) - 1.0
    size = row[first + j] + up * (row[first + DIRECTIONS + j] - row[first + j])
    return (size * x, size * z)


@helper
def way_out(row, p):
    """Nearest point of a prism's outline at the point's height, in the prism's frame."""
    first, up = slice_at(row, p[1])
    here = (p[0] - row[0], p[2] - row[1])
    best, least = here, 1e300
    before = corner(row, first, up, DIRECTIONS - 1)
    for k in range(DIRECTIONS):
        after = corner(row, first, up, k)
        near = nearest_on_segment(here, before, after)
        x, z = near[0] - here[0], near[1] - here[1]
        if x * x + z * z < least:
            best, least = near, x * x + z * z
        before = after
    return (best[0] + row[0], p[1], best[1] + row[1])


@helper
def deepest(flesh, root, world, segs, shoulder, elbow, wrist):
    """The deepest ball of an arm in the trunk: its depth [m], its centre, and where that should be.

    Depth is 0, and both points are the elbow, where all are outside.
    """
    most, p_e, p_t = 0.0, elbow, elbow
    for i in range(int(flesh.arms[0])):
        centre = ball_at(flesh, i, shoulder, elbow, wrist)
        smaller = flesh.arms[FIRST_BALL + BALL * i + 2]
        place = root
        for k in range(flesh.prisms.shape[0]):
            q = qt.load(world, k)
            inside = qt.inv_mul_vec(q, vec.sub(centre, place))
            if gap_to_prism(flesh.prisms[k], inside) + smaller < 0.0:
                out = vec.sub(way_out(flesh.prisms[k], inside), inside)
                depth = vec.norm(out)
                if depth - smaller > most:
                    most, p_e = depth - smaller, centre
                    p_t = vec.madd(centre, most / depth, qt.mul_vec(q, out))
            place = vec.add(place, vec.load(segs, k))
    return most, p_e, p_t
