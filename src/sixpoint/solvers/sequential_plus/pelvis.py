"""The pelvis from gravity, legs, trunk, the lines of wrists and ankles, reach and velocity.

Sequential IK lays the pelvis' Y along the line to the head, so that it tilts with every bend of the trunk,
and takes the lines of wrists and ankles without their lengths. Here Y is mostly the direction of the legs and
the vertical; X is told by lines that count by their lengths, by where the hands reach and by where the body
goes. What is told is low-passed in time before its direction is taken, so that a short line moves little.
"""

from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper

UP = (0.0, 1.0, 0.0)


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
