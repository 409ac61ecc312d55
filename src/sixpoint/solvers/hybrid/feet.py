"""Which feet stand, and where: contact of the ankles with hysteresis, frame by frame, from the past alone.

An ankle that is low and slow is held where it became so, horizontally: its height is followed, as it rises
when the foot rolls over its ball. If it goes on before it has stood for three frames and 25 ms, it was not
standing. Once it has, it is let go when it is fast, clearly off the floor, or far from where it is held; what
it is off by then fades out in 0.1 s.

``signals.contacts`` sees the same with central differences. Here speeds are those of the recent past, and so
later: beginning counts from a higher speed, low-passed less, than ending does.

``memory`` (12, 4) has six rows a foot, left before right: where the ankle was, and whether it was seen; its
quick velocity, and whether there is one; its slow velocity; where the foot is held, and ``FREE``, ``TRYING``
or ``STANDING``; what it was off by when let go, and the time left of that; height of its floor, whether one
is known, frames and time of being low and slow. All zero is nothing known.
"""

from math import exp, inf

from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper

ROWS = 6
FREE, TRYING, STANDING = 0.0, 1.0, 2.0
FOLLOWING, HELD, EASING = 0.0, 1.0, 2.0
ANKLES = 4  # the left one among the six points
LOW, HIGH = 0.03, 0.06  # m over the floor, to begin below and to end above
SLOW, FAST = 0.2, 0.25  # m/s, to begin below and to end above
QUICK, CALM = 0.0125, 0.025  # s, time constants of the two velocities
HOLD, FRAMES = 0.025, 3  # s and frames until a foot stands for sure
EASE = 0.1  # s, in which a foot that is let go comes back to where it is seen
SLID = 0.1  # m, a foot is not held farther away than this
RISE = 0.01  # m/s, a floor that was not seen again is forgotten
APART = 0.03  # m, an ankle's floor is at most so much above the other's
ANKLE = 0.12  # m, a standing foot has its ankle below this height over a floor that is given
FAR = 1e7  # m, a point farther away than this, or not a number, counts as lost


@helper
def fading(time):
    """Share of what a foot was off by that is left, ``time`` before it is none: smooth at both ends."""
    left = time / EASE
    return left * left * (3.0 - 2.0 * left)


@helper
def follow(memory, row, here, dt):
    """Update the velocities; where no time passed nothing is new."""
    if dt <= 0.0 or memory[row, 3] == 0.0:
        return
    now = vec.scale(1.0 / dt, vec.sub(here, vec.load(memory, row)))
    for k in range(2):
        kept = exp(-dt / (QUICK, CALM)[k]) if memory[row + 1, 3] > 0.0 else 0.0
        before = vec.load(memory, row + 1 + k)
        vec.store(memory, row + 1 + k, vec.madd(vec.scale(kept, before), 1.0 - kept, now))
    memory[row + 1, 3] = 1.0


@helper
def learn_floor(memory, row, height, dt, floor):
    """The floor is the lowest height at which the ankle was not fast."""
    if memory[row + 1, 3] == 0.0 or vec.norm(vec.load(memory, row + 2)) > FAST or height > floor + ANKLE:
        return
    known = memory[row + 5, 1] > 0.0
    memory[row + 5, 0] = min(height, memory[row + 5, 0] + RISE * max(dt, 0.0)) if known else height
    memory[row + 5, 1] = 1.0


@helper
def height_over_floor(memory, row, other, height):
    """Height of the ankle over where it is when the foot stands [m]; infinite while nothing is known."""
    floor = memory[row + 5, 0] if memory[row + 5, 1] > 0.0 else inf
    if memory[other + 5, 1] > 0.0:
        floor = min(floor, memory[other + 5, 0] + APART)
    return height - floor if floor < inf else inf


@helper
def place_foot(memory, row, other, here, last, dt):
    """Begin, hold or end a contact; returns where the ankle belongs, and why."""
    up = height_over_floor(memory, row, other, here[1])
    moved = memory[row + 1, 3] > 0.0
    ready = moved and up < LOW and vec.norm(vec.load(memory, row + 1)) < SLOW
    memory[row + 5, 2] = memory[row + 5, 2] + 1.0 if ready else 0.0
    memory[row + 5, 3] = memory[row + 5, 3] + max(dt, 0.0) if ready else 0.0
    memory[row + 4, 3] = max(memory[row + 4, 3] - max(dt, 0.0), 0.0)
    anchor = vec.load(memory, row + 3)
    gap = vec.sub((anchor[0], last[1], anchor[2]), last)
    if memory[row + 3, 3] != FREE:
        fast = vec.norm(vec.load(memory, row + 2)) > FAST
        lifted = up > HIGH and here[1] > anchor[1] + HIGH
        slid = vec.norm(vec.sub((anchor[0], here[1], anchor[2]), here)) > SLID
        if fast or lifted or slid or (memory[row + 3, 3] == TRYING and not ready):
            vec.store(memory, row + 4, gap)
            memory[row + 4, 3] = max(EASE - max(dt, 0.0), 0.0)
            memory[row + 3, 3] = FREE
            ready = False
    share = fading(memory[row + 4, 3])
    if memory[row + 3, 3] == FREE:
        place = vec.madd(here, share, vec.load(memory, row + 4))
        if not ready:
            return place, EASING if share > 0.0 else FOLLOWING
        vec.store(memory, row + 3, place)
        memory[row + 3, 3] = TRYING
    if memory[row + 5, 2] >= FRAMES and memory[row + 5, 3] > HOLD - 1e-6:
        memory[row + 3, 3] = STANDING
    return (memory[row + 3, 0], here[1], memory[row + 3, 2]), HELD


@helper
def forget(memory, row):
    """A lost ankle neither stands nor moves; its floor stays."""
    memory[row, 3] = 0.0
    memory[row + 1, 3] = 0.0
    memory[row + 3, 3] = FREE
    memory[row + 4, 3] = 0.0
    memory[row + 5, 2] = 0.0
    memory[row + 5, 3] = 0.0


@helper
def is_seen(points, k):
    """Whether a point is known; false for NaN."""
    return abs(points[k, 0]) < FAR and abs(points[k, 1]) < FAR and abs(points[k, 2]) < FAR


@helper
def hold_feet(points, dt, floor, memory):
    """Where left and right ankle belong in a frame of points (6, 3) [m], each with why.

    ``dt`` is the time since the last frame [s] and ``floor`` a height [m], infinite where it is to be learnt.
    Nothing can be said of a lost ankle: it follows.
    """
    lasts = (vec.load(memory, 0), vec.load(memory, ROWS))
    for k in range(2):
        row, here = ROWS * k, vec.load(points, ANKLES + k)
        if is_seen(points, ANKLES + k):
            follow(memory, row, here, dt)
            learn_floor(memory, row, here[1], dt, floor)
            vec.store(memory, row, here)
            memory[row, 3] = 1.0
        else:
            forget(memory, row)
    left, right = vec.load(points, ANKLES), vec.load(points, ANKLES + 1)
    why_left, why_right = FOLLOWING, FOLLOWING
    if memory[0, 3] > 0.0:
        left, why_left = place_foot(memory, 0, ROWS, left, lasts[0], dt)
    if memory[ROWS, 3] > 0.0:
        right, why_right = place_foot(memory, ROWS, 0, right, lasts[1], dt)
    return left, why_left, right, why_right
