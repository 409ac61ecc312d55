"""What a prior sees: the points, what told the pelvis, proportions and measured rotations, in its frame.

The same features as those of ``study.prior.network``, with which a prior is fitted.
"""

from math import sqrt

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.solvers.sequential_plus.measured import is_measured
from sixpoint.solvers.sequential_plus.pelvis import UP
from sixpoint.solvers.sequential_prior.packing import END, LIMB, MASKS, POINTS, TURNED

SHORT = 1e-6  # m
FIRST_END = 11  # row of the memory with the left wrist


@helper
def put(features, at, v):
    """Three features."""
    features[at], features[at + 1], features[at + 2] = v


@helper
def recall_ends(facts, mean, pelvis_turn, memory, filled):
    """Put lost wrists and ankles where they were last, seen from the pelvis; at first where usual."""
    pelvis = vec.load(filled, 0)
    for i in range(2, 6):
        if filled[i, 3] > 0.0:
            continue
        seen, at = FIRST_END + i - 2, 3 * (i - 1)
        away = vec.load(memory, seen)
        if memory[seen, 3] == 0.0:
            away = vec.scale(facts.height, (mean[at], mean[at + 1], mean[at + 2]))
        vec.store(filled, i, vec.add(pelvis, qt.mul_vec(pelvis_turn, away)))


@helper
def remember_ends(pelvis_turn, filled, memory):
    """Note where wrists and ankles are, seen from the pelvis."""
    for i in range(2, 6):
        if filled[i, 3] > 0.0:
            away = vec.sub(vec.load(filled, i), vec.load(filled, 0))
            vec.store(memory, FIRST_END + i - 2, qt.inv_mul_vec(pelvis_turn, away))
            memory[FIRST_END + i - 2, 3] = 1.0


@helper
def see_points(facts, filled, frame, told, velocity, features):
    """Features of the points, seen in ``frame``; lost ones have been filled in."""
    pelvis, tall = vec.load(filled, 0), facts.height
    middle = (facts.middle[0], facts.middle[1], facts.middle[2])
    base = vec.add(pelvis, qt.mul_vec(frame, middle))
    for i in range(1, 6):
        away = vec.sub(vec.load(filled, i), base)
        put(features, 3 * (i - 1), vec.scale(1.0 / tall, qt.inv_mul_vec(frame, away)))
    put(features, 15, qt.inv_mul_vec(frame, UP))
    told = vec.scale(1.0 / tall, told)
    put(features, 18, vec.scale(1.0 / sqrt(1.0 + vec.dot(told, told)), qt.inv_mul_vec(frame, told)))
    put(features, 21, vec.scale(1.0 / tall, qt.inv_mul_vec(frame, velocity)))
    ratio = min(vec.norm(vec.sub(vec.load(filled, 1), pelvis)) / facts.whole, 1.0)
    features[24] = ratio
    features[25] = sqrt(1.0 - ratio * ratio + 1e-4)
    features[26] = vec.norm(vec.sub(vec.load(filled, 2), vec.load(filled, 3))) / tall
    for i in range(7):
        features[27 + i] = facts.proportions[i]


@helper
def put_axes(q, features, at):
    """Y and Z axis of a rotation without those of the neutral pose."""
    y, z = qt.y_axis(q), qt.z_axis(q)
    put(features, at, (y[0], y[1] - 1.0, y[2]))
    put(features, at + 3, (z[0], z[1], z[2] - 1.0))


@helper
def see_rotations(turned, frame, features):
    """Features of the measured rotations of head, wrists and ankles, and which of them there are."""
    for i in range(1, 6):
        at = POINTS + 6 * (i - 1)
        known = is_measured(turned, i)
        features[POINTS + TURNED + i - 1] = 1.0 if known else 0.0
        if known:
            put_axes(qt.inv_mul(frame, qt.load(turned, i)), features, at)
        else:
            for k in range(at, at + 6):
                features[k] = 0.0


@helper
def reflect(features, source, mirrored, target):
    """A vector seen in the mirror."""
    mirrored[target] = -features[source]
    mirrored[target + 1] = features[source + 1]
    mirrored[target + 2] = features[source + 2]


@helper
def mirror(features, with_rotations, mirrored):
    """All features with left and right exchanged."""
    reflect(features, 0, mirrored, 0)
    for i in range(3, 15, 6):
        reflect(features, i, mirrored, i + 3)
        reflect(features, i + 3, mirrored, i)
    reflect(features, 15, mirrored, 15)
    put(mirrored, 18, (features[18], -features[19], -features[20]))  # what is told points to the left
    reflect(features, 21, mirrored, 21)
    for i in range(24, POINTS):
        mirrored[i] = features[i]
    if not with_rotations:
        return
    masks = POINTS + TURNED
    for i in range(MASKS):
        other = i if i == 0 else i + 1 if i % 2 == 1 else i - 1
        reflect(features, POINTS + 6 * i, mirrored, POINTS + 6 * other)
        reflect(features, POINTS + 6 * i + 3, mirrored, POINTS + 6 * other + 3)
        mirrored[masks + other] = features[masks + i]


@helper
def see_limb(gap, reach, right, features):
    """Features of a limb from its root to its end ``gap``, in the frame of chest or pelvis, as if left."""
    x, y, z = gap
    if right:
        x = -x
    d = max(sqrt(x * x + y * y + z * z), SHORT)
    r = d / reach
    put(features, 0, (x / reach, y / reach, z / reach))
    x, y, z = x / d, y / d, z / d
    put(features, 3, (x, y, z))
    put(features, 6, (x * x, y * y, z * z))
    put(features, 9, (x * y, y * z, z * x))
    features[12], features[13] = r, r * r


@helper
def see_end(turned, effector, base, right, features):
    """Features of a measured hand or foot against chest or pelvis, as if left; zeros where there is none."""
    if is_measured(turned, effector):
        q = qt.inv_mul(base, qt.load(turned, effector))
        put_axes((q[0], -q[1], -q[2], q[3]) if right else q, features, LIMB)
    else:
        for k in range(LIMB, LIMB + END):
            features[k] = 0.0


@helper
def strangeness(features, mean, spread, count):
    """How far features are outside of what is usual: RMS of what exceeds two standard deviations."""
    total = 0.0
    for i in range(count):
        beyond = abs(features[i] - mean[i]) / spread[i] - 2.0
        if beyond > 0.0:
            total += beyond * beyond
    return sqrt(total / count)
