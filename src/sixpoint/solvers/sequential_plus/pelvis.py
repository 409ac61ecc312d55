"""The pelvis from gravity, legs, trunk, the lines of wrists and ankles, reach and velocity.

Sequential IK lays the pelvis' Y along the line to the head, so that it tilts with every bend of the trunk,
and takes the lines of wrists and ankles without their lengths. Here Y is mostly the direction of the legs and
the vertical; X is told by lines that count by their lengths, by where the hands reach and by where the body
goes. What is told is low-passed in time before its direction is taken, so that a short line moves little.
"""

from math import atan2

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper

UP = (0.0, 1.0, 0.0)
CHEST = 0.75  # height of the chest's point between pelvis and head
TOLD = 0.02  # m, lines that tell less than this tell nothing
LEANS = 5  # rounds at most
LEAN = 0.1  # rad, largest turn in a round
KEPT = 0.3  # rad, largest turn that is kept
YIELDING = 1e-4  # m^2, a shorter lever turns less than it would need to
RUN = 3.0  # m/s, a faster pelvis is a jump of the tracker


@helper
def estimate_y(filled, chord, chord_share, leg_share):
    """Y axis of the pelvis: its direction to the head, the legs' and the vertical in fixed shares."""
    middle, known = (0.0, 0.0, 0.0), 0.0
    for i in range(4, 6):
        if filled[i, 3] > 0.0:
            middle = vec.add(middle, vec.load(filled, i))
            known += 1.0
    legs = UP
    if known > 0.0:
        legs = vec.unit(vec.sub(vec.load(filled, 0), vec.scale(1.0 / known, middle)))
    below = vec.add(vec.scale(leg_share, legs), vec.scale(1.0 - leg_share, UP))
    y = vec.unit(vec.add(vec.scale(chord_share, chord), vec.scale(1.0 - chord_share, below)))
    return y if vec.norm(y) > 0.5 else chord


@helper
def line_between(filled, left, right):
    """Vector from the right to the left point; zero where one is lost."""
    if filled[left, 3] == 0.0 or filled[right, 3] == 0.0:
        return (0.0, 0.0, 0.0)
    return vec.sub(vec.load(filled, left), vec.load(filled, right))


@helper
def tell_x(filled, y, chest, velocity, wrist_line, ankle_line, reach, speed):
    """What this frame tells of the X axis: a vector across y whose length says how much [m].

    The hands are before the chest and the body goes forward more often than not.
    """
    told = vec.scale(wrist_line, line_between(filled, 2, 3))
    told = vec.madd(told, ankle_line, line_between(filled, 4, 5))
    forward = vec.scale(speed, velocity)
    for i in range(2, 4):
        if filled[i, 3] > 0.0:
            forward = vec.madd(forward, 0.5 * reach, vec.sub(vec.load(filled, i), chest))
    return vec.reject(vec.add(told, vec.cross(y, forward)), y)


@helper
def turn_at_most(before, x, y, most):
    """X axis on its way about ``y`` from where it was [rad]; both across y, ``before`` may be zero."""
    angle = atan2(vec.dot(vec.cross(before, x), y), vec.dot(before, x))
    if vec.norm(before) < 0.5 or abs(angle) <= most:
        return x
    return qt.mul_vec(qt.from_axis_angle(y, most if angle > 0.0 else -most), before)


@helper
def estimate_pelvis(filled, memory, s):
    """X and Y axes of the pelvis; updates what is remembered of X."""
    pelvis, head = vec.load(filled, 0), vec.load(filled, 1)
    began = memory[4, 0] > 0.0
    chord = vec.unit(vec.sub(head, pelvis))
    if vec.norm(chord) < 0.5:
        chord = vec.load(memory, 5) if began else (0.0, 1.0, 0.0)
    y = estimate_y(filled, chord, s.chord_share, s.leg_share)
    if began:
        slow = vec.unit(vec.add(vec.scale(s.kept_tilt, vec.load(memory, 8)), vec.scale(1.0 - s.kept_tilt, y)))
        y = slow if vec.norm(slow) > 0.5 else y
    vec.store(memory, 8, y)
    chest = vec.madd(pelvis, CHEST, vec.sub(head, pelvis))
    velocity = vec.load(memory, 6)
    if began and filled[0, 3] > 0.0:
        now = vec.scale(s.rate, vec.sub(pelvis, vec.load(memory, 7)))
        if vec.norm(now) > RUN:
            now = vec.scale(RUN / vec.norm(now), now)
        velocity = vec.add(vec.scale(s.kept_speed, velocity), vec.scale(1.0 - s.kept_speed, now))
    vec.store(memory, 6, velocity)
    vec.store(memory, 7, pelvis)
    told = tell_x(filled, y, chest, velocity, s.wrist_line, s.ankle_line, s.reach, s.speed)
    if memory[4, 1] > 0.0:
        told = vec.add(vec.scale(s.kept, vec.load(memory, 1)), vec.scale(1.0 - s.kept, told))
    x = vec.reject(told, y)
    if vec.norm(x) >= TOLD:
        memory[4, 1] = 1.0
    else:
        x = vec.reject(vec.load(memory, 0) if began else (1.0, 0.0, 0.0), y)
        if vec.norm(x) < 0.1:
            x = vec.reject((0.0, 0.0, -1.0), y)
    vec.store(memory, 1, told)
    x = vec.unit(x)
    if began:
        x = turn_at_most(vec.unit(vec.reject(vec.load(memory, 0), y)), x, y, s.turn_speed * s.dt)
    return x, y, chord


@helper
def lean_to_ankles(filled, hips, limbs, q):
    """Turn the pelvis by the least angles that bring the hips within a leg's length of known ankles."""
    pelvis = vec.load(filled, 0)
    for _ in range(LEANS):
        near = True
        for k in range(2):
            if filled[4 + k, 3] == 0.0:
                continue
            hip = qt.mul_vec(q, vec.load(hips, k))
            leg = vec.sub(vec.sub(vec.load(filled, 4 + k), pelvis), hip)
            beyond = vec.norm(leg) - (limbs[2 + k, 0] + limbs[2 + k, 1])
            if beyond <= 0.0:
                continue
            near = False
            lever = vec.cross(hip, vec.unit(leg))
            turn = vec.scale(beyond / (vec.dot(lever, lever) + YIELDING), lever)
            size = vec.norm(turn)
            if size > LEAN:
                turn = vec.scale(LEAN / size, turn)
            q = qt.mul(qt.exp(turn), q)
        if near:
            break
    return qt.normalised(q)


@helper
def keep_leaning(filled, hips, limbs, memory, kept, q):
    """The pelvis ``q`` turned towards the ankles; a turn once needed is given up slowly.

    Only a small turn is kept: from a large one, of a pelvis that was the wrong way round, there may be no way
    back.
    """
    start = q
    if memory[4, 0] > 0.0:
        lean = qt.load(memory, 9)
        size = vec.norm(qt.log(lean))
        start = qt.mul(qt.scaled(lean, min(kept, KEPT / max(size, KEPT))), q)
    turned = lean_to_ankles(filled, hips, limbs, start)
    qt.store(memory, 9, qt.normalised(qt.mul(turned, qt.inv(q))))
    return turned
