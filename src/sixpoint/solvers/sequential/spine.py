"""Step 2: bend or stretch the trunk between pelvis and head (Unzueta et al. 2008, Algorithms 2 and 3).

Scratch arrays: ``world`` (S, 4) are the world rotations of the trunk joints, ``segs`` (S, 4) the segment
vectors in the world (columns 0 to 2); both are updated in place. ``local`` rows 1 to S - 1 are the interior
joints. The angle to bend by is found in ``bending.py``.
"""

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.swing_twist import clamp
from sixpoint.solvers.sequential.bending import COARSE, COARSE_CAP, STALL, plane_components, search_angle

STRAIGHT = 1e-3  # rad, a trunk bent by less has no plane
ALIGNED = 1e-3  # sine of the angle below which two chords span no plane


@helper
def place_trunk(segments, local, world, segs):
    """World rotations and segments of the trunk from its local rotations."""
    q = qt.load(local, 0)
    for k in range(segments.shape[0]):
        if k > 0:
            q = qt.mul(q, qt.load(local, k))
        qt.store(world, k, q)
        vec.store(segs, k, qt.mul_vec(q, vec.load(segments, k)))


@helper
def read_trunk(world, local):
    """Local rotations of pelvis and interior joints from world rotations."""
    before = qt.load(world, 0)
    qt.store(local, 0, before)
    for k in range(1, world.shape[0]):
        q = qt.load(world, k)
        qt.store(local, k, qt.normalised(qt.inv_mul(before, q)))
        before = q


@helper
def chord_of(segs):
    total = (0.0, 0.0, 0.0)
    for k in range(segs.shape[0]):
        total = vec.add(total, vec.load(segs, k))
    return total


@helper
def bending_axis(chord, wanted, local, world, plane):
    """Unit normal of the bending plane.

    A straight trunk bends forward, about the pelvis' X. A bent one stays in its plane: current chord x
    wanted chord, on the side it is already bent to; with the listing's flipping sign the way back would
    fold the spine further instead of straightening it. Parallel chords keep the previous plane.
    """
    bent = (0.0, 0.0, 0.0)  # sum of the interior axes times 2 sin(angle / 2), in the world
    for k in range(1, world.shape[0]):
        q = qt.load(local, k)
        s = 2.0 if q[3] >= 0.0 else -2.0
        bent = vec.madd(bent, s, qt.mul_vec(qt.load(world, k - 1), (q[0], q[1], q[2])))
    if vec.norm(bent) < STRAIGHT:
        return qt.x_axis(qt.load(world, 0))
    v = vec.cross(vec.unit(chord), vec.unit(wanted))
    length = vec.norm(v)
    if length > ALIGNED:
        v = vec.scale(1.0 / length, v)
    elif vec.norm(plane) > 0.5:
        v = plane
    else:
        v = qt.x_axis(qt.load(world, 0))
    return vec.scale(-1.0, v) if vec.dot(bent, v) < 0.0 else v


@helper
def turn_trunk(segments, v, phi, world, segs):
    """Turn every segment by its share of phi about v; the shares are in arithmetic progression."""
    first = segments[0, 3]
    q = qt.from_axis_angle(v, first * phi)
    step = qt.from_axis_angle(v, (segments[1, 3] - first) * phi if world.shape[0] > 1 else 0.0)
    for k in range(world.shape[0]):
        qt.store(world, k, qt.mul(q, qt.load(world, k)))
        vec.store(segs, k, qt.mul_vec(q, vec.load(segs, k)))
        q = qt.mul(q, step)


@helper
def clamp_interior(balls, count, local):
    """Set the interior ones of ``count`` trunk joints within their limits; whether any was outside."""
    any_changed = False
    for k in range(1, count):
        q, changed = clamp(balls, k, qt.load(local, k))
        if changed:
            qt.store(local, k, q)
            any_changed = True
    return any_changed


@helper
def _clamped_chord(segments, balls, v, phi, start, world, segs, local):
    """Chord length after turning the trunk from ``start`` (local rotations) by phi within the limits."""
    for k in range(world.shape[0]):
        qt.store(local, k, qt.load(start, k))
    place_trunk(segments, local, world, segs)
    turn_trunk(segments, v, phi, world, segs)
    read_trunk(world, local)
    clamp_interior(balls, world.shape[0], local)
    place_trunk(segments, local, world, segs)
    return vec.norm(chord_of(segs))


@helper
def search_within_limits(segments, balls, v, wanted, start, world, segs, local):
    """Algorithm 3 with the limits inside the loop: coarse steps, then bisection of the last one.

    ``start`` holds the local rotations to bend from. Leaves the trunk at the best angle found.
    """
    length = _clamped_chord(segments, balls, v, 0.0, start, world, segs, local)
    sign = 1.0 if length > wanted else -1.0
    step, phi, best_phi, best_gap = -sign * COARSE, 0.0, 0.0, abs(length - wanted)
    passed, flipped = False, False
    steps = 0
    while steps < COARSE_CAP:
        before = length
        length = _clamped_chord(segments, balls, v, phi + step, start, world, segs, local)
        steps += 1
        if sign * length <= sign * wanted:
            passed = True
            break
        gap = abs(length - wanted)
        if gap < best_gap:
            best_phi, best_gap = phi + step, gap
        elif phi == 0.0 and not flipped:
            flipped, step, length = True, -step, before
            continue
        if abs(length - before) < STALL or gap > best_gap:
            break
        phi += step
    if passed:
        low, high = phi, phi + step
        for _ in range(24):
            middle = 0.5 * (low + high)
            length = _clamped_chord(segments, balls, v, middle, start, world, segs, local)
            if sign * length > sign * wanted:
                low = middle
            else:
                high = middle
        best_phi = high
    return abs(_clamped_chord(segments, balls, v, best_phi, start, world, segs, local) - wanted) < 1e-4


@helper
def unbend(segments, wanted, start, world, segs, local):
    """Lengthen a trunk bent in another plane: shrink all interior rotations by one factor, by bisection."""
    low, high = 0.0, 1.0  # fraction of the bend that is kept
    for _ in range(30):
        kept = 0.5 * (low + high)
        qt.store(local, 0, qt.load(start, 0))
        for k in range(1, world.shape[0]):
            qt.store(local, k, qt.scaled(qt.load(start, k), kept))
        place_trunk(segments, local, world, segs)
        if vec.norm(chord_of(segs)) > wanted:
            low = kept
        else:
            high = kept


@helper
def stretch(turns, chords, wanted, local):
    """Interior rotations, and the pelvis' own turn, of the precomputed stretch pose of a chord length.

    ``turns`` (S, 4) are axis and full angle of each segment, ``chords`` the lengths of the precomputed poses.
    """
    last = chords.shape[0] - 1
    k = 0
    while k < last - 1 and chords[k + 1] < wanted:
        k += 1
    width = chords[k + 1] - chords[k]
    fraction = 1.0 if wanted > chords[k] else 0.0
    if width > 1e-12:
        fraction = min(max((wanted - chords[k]) / width, 0.0), 1.0)
    t = (k + fraction) / last
    before = qt.IDENTITY
    for k in range(turns.shape[0]):
        q = qt.from_axis_angle(vec.load(turns, k), t * turns[k, 3])
        base = qt.load(local, 0) if k == 0 else qt.inv(before)
        qt.store(local, k, qt.mul(base, q))
        before = q


@helper
def set_chord(
    segments, turns, chords, balls, limits, literal, wanted, goal, local, world, segs, start, flat, plane
):
    """Give the trunk the wanted chord length (Algorithm 2, lines 4 to 13).

    ``local`` holds the spine of the frame before and the pelvis as estimated. ``plane`` is the previous
    bending plane's normal, zero if there is none.

    Returns:
        The normal of the bending plane to remember, and whether the joints are within their limits for sure.
    """
    count = segments.shape[0]
    if count < 2:
        place_trunk(segments, local, world, segs)
        return plane, True
    if wanted >= chords[0]:  # beyond the neutral chord
        stretch(turns, chords, wanted, local)
        place_trunk(segments, local, world, segs)
        return plane, False
    place_trunk(segments, local, world, segs)
    if vec.norm(chord_of(segs)) > chords[0]:
        for k in range(1, count):
            qt.store(local, k, qt.IDENTITY)
        place_trunk(segments, local, world, segs)
    for k in range(count):
        qt.store(start, k, qt.load(local, k))
    chord = chord_of(segs)
    v = bending_axis(chord, goal, local, world, plane)
    along = plane_components(segs, v, flat)
    phi, met = search_angle(segments, flat, along, wanted, literal)
    turn_trunk(segments, v, phi, world, segs)
    read_trunk(world, local)
    if limits and clamp_interior(balls, count, local):
        met = search_within_limits(segments, balls, v, wanted, start, world, segs, local)
    if not met and vec.norm(chord) < wanted:
        unbend(segments, wanted, start, world, segs, local)
        return v, False
    return v, limits
