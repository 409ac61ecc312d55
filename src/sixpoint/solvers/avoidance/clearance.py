"""How far a ball of an arm is from the trunk, and which way out is the shortest.

Reference: Unzueta et al. 2008, section 8: the depth is measured in the XZ plane of the trunk's joint.
"""

from math import sqrt

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.distance import nearest_on_segment
from sixpoint.kernels.jit import helper
from sixpoint.solvers.avoidance.packing import (
    BALL,
    DIRECTIONS,
    FIRST_BALL,
    HEADER,
    RING,
    SLICES,
    SPREAD,
)
from sixpoint.solvers.avoidance.thigh_clearance import beside_thighs, fold_of, or_in_thighs

OUTSIDE = 1.0  # m, how far is said of what is beside or above all prisms
LAST = 32.0 - 1e-9
NEARBY = 5  # directions to both sides in which the nearest edge is looked for, unless a point is far in


@helper
def slice_at(row, y):
    """Outline below a height, as the place of its first number, and how far it is to the next (0 to 1)."""
    t = (y - row[2]) * row[5]
    k = min(max(int(t), 0), SLICES - 2)
    return HEADER + k * RING, min(max(t - k, 0.0), 1.0)


@helper
def direction_of(x, z, inverse):
    """The place of a direction among the 32 of an outline, from 0 to 32; ``inverse`` is 1 / (|x| + |z|)."""
    a = 1.0 - x * inverse if z >= 0.0 else 3.0 + x * inverse
    return min(0.25 * DIRECTIONS * a, LAST)


@helper
def gap_to_prism(row, p):
    """Distance of a point from an outline along the ray from its centre; negative inside [m]."""
    x, z = p[0] - row[0], p[2] - row[1]
    if p[1] < row[2] or p[1] > row[3]:
        return OUTSIDE
    square = x * x + z * z
    if square > row[4] * row[4]:
        return min(0.5 * (square / row[4] - row[4]), OUTSIDE)  # about as much, without a root
    first, up = slice_at(row, p[1])
    diamond = abs(x) + abs(z)
    if diamond < 1e-9:
        return -row[first]
    inverse = 1.0 / diamond
    a = direction_of(x, z, inverse)
    k = int(a)
    here, above = first + k, first + k + RING
    low = row[here] + (a - k) * (row[here + 1] - row[here])
    high = row[above] + (a - k) * (row[above + 1] - row[above])
    return sqrt(square) * (1.0 - (low + up * (high - low)) * inverse)


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
def gap_of_arm(flesh, root, world, segs, shoulder, elbow, wrist):
    """The least distance of an arm's balls from the trunk, and from thighs if asked for; negative inside [m].

    Of what the wrist, which is where it has to be, is inside, a ball's share of the forearm counts as none.
    """
    count, spread = int(flesh.arms[0]), flesh.arms[SPREAD]
    wrist_gap = 0.0
    if count > 3:
        wrist_gap = min(gap_to_trunk(flesh, root, world, segs, wrist), 0.0)
    least, place = OUTSIDE, root
    up, down = vec.sub(shoulder, elbow), vec.sub(wrist, elbow)
    fold = fold_of(up, down) if count > 3 else down
    for k in range(flesh.prisms.shape[0]):
        row, q = flesh.prisms[k], qt.load(world, k)
        p = qt.inv_mul_vec(q, vec.sub(elbow, place))
        place = vec.add(place, vec.load(segs, k))
        x, z, far = p[0] - row[0], p[2] - row[1], row[4] + spread
        if p[1] < row[2] - spread or p[1] > row[3] + spread or x * x + z * z > far * far:
            continue  # the whole arm is beside this prism
        above, below = qt.inv_mul_vec(q, up), qt.inv_mul_vec(q, down)
        for i in range(count):
            b = FIRST_BALL + BALL * i
            forearm, share = flesh.arms[b] > 0.0, flesh.arms[b + 1]
            ball = vec.madd(p, share, below if forearm else above)
            if flesh.arms[b + 3] != 0.0:
                ball = vec.madd(ball, flesh.arms[b + 3], qt.inv_mul_vec(q, fold))
            gap = gap_to_prism(row, ball) + flesh.arms[b + 2]
            if forearm:
                gap -= share * wrist_gap
            least = min(least, gap)
    return beside_thighs(flesh.thighs, flesh.placed, elbow, up, down, least)


@helper
def corner(row, first, up, k):
    """A corner of the outline at a height, seen from its centre: x and z."""
    j = k % DIRECTIONS
    a = 4.0 * j / DIRECTIONS
    x = 1.0 - a if a <= 2.0 else a - 3.0
    z = 1.0 - abs(x) if a <= 2.0 else abs(x) - 1.0
    size = row[first + j] + up * (row[first + RING + j] - row[first + j])
    return (size * x, size * z)


@helper
def way_out(row, p):
    """Nearest point of a prism's outline at the point's height, in the prism's frame."""
    first, up = slice_at(row, p[1])
    here = (p[0] - row[0], p[2] - row[1])
    diamond = abs(here[0]) + abs(here[1])
    middle, around = 0, DIRECTIONS // 2
    if diamond > 1e-9:
        middle = int(direction_of(here[0], here[1], 1.0 / diamond))
        if diamond > 0.6 * row[first + middle]:
            around = NEARBY
    best, least = here, 1e300
    before = corner(row, first, up, middle - around + DIRECTIONS)
    for k in range(middle - around + 1, middle + around + 2):
        after = corner(row, first, up, k + DIRECTIONS)
        near = nearest_on_segment(here, before, after)
        x, z = near[0] - here[0], near[1] - here[1]
        if x * x + z * z < least:
            best, least = near, x * x + z * z
        before = after
    return (best[0] + row[0], p[1], best[1] + row[1])


@helper
def deepest(flesh, root, world, segs, shoulder, elbow, wrist):
    """The ball of an arm that is deepest in the trunk, along rays from the outlines' centres, or in a thigh.

    Returns its depth, straight out [m], its centre, and where that should be. Depth is 0, and both points are
    the elbow, where all are outside.

    The paper measures along the line through the elbow joint to the outer vertex of the segment, in the same
    plane; ours goes the nearest way to the outline, as the elbow need not face the vertex that is outermost.
    """
    count, spread = int(flesh.arms[0]), flesh.arms[SPREAD]
    most, smaller, place = 0.0, 0.0, root
    prism, centre, turn, origin = -1, elbow, qt.IDENTITY, root
    up, down = vec.sub(shoulder, elbow), vec.sub(wrist, elbow)
    fold = fold_of(up, down) if count > 3 else down
    for k in range(flesh.prisms.shape[0]):
        row, q = flesh.prisms[k], qt.load(world, k)
        p = qt.inv_mul_vec(q, vec.sub(elbow, place))
        here, place = place, vec.add(place, vec.load(segs, k))
        x, z, far = p[0] - row[0], p[2] - row[1], row[4] + spread
        if p[1] < row[2] - spread or p[1] > row[3] + spread or x * x + z * z > far * far:
            continue
        above, below = qt.inv_mul_vec(q, up), qt.inv_mul_vec(q, down)
        for i in range(count):
            b = FIRST_BALL + BALL * i
            ball = vec.madd(p, flesh.arms[b + 1], below if flesh.arms[b] > 0.0 else above)
            if flesh.arms[b + 3] != 0.0:
                ball = vec.madd(ball, flesh.arms[b + 3], qt.inv_mul_vec(q, fold))
            depth = -gap_to_prism(row, ball) - flesh.arms[b + 2]
            if depth > most:
                most, smaller, prism, centre, turn, origin = depth, flesh.arms[b + 2], k, ball, q, here
    if prism < 0:
        return or_in_thighs(flesh.thighs, flesh.placed, elbow, up, down, (0.0, elbow, elbow))
    out = vec.sub(way_out(flesh.prisms[prism], centre), centre)
    length = vec.norm(out)
    p_e = vec.add(origin, qt.mul_vec(turn, centre))
    depth = max(length - smaller, 0.0)
    p_t = vec.madd(p_e, depth / max(length, 1e-12), qt.mul_vec(turn, out))
    return or_in_thighs(flesh.thighs, flesh.placed, elbow, up, down, (depth, p_e, p_t))
