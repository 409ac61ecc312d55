"""What the compiled tracker reads and remembers, and how it crosses from Python in few arrays.

Markers are sorted by the segment (moving joint) that carries them, and within it by level; a cluster is the
markers of one segment at one level.
"""

from typing import NamedTuple

from sixpoint.kernels.jit import helper

# Columns of a marker's integers, of a segment's and of a cluster's.
JOINT, SEGMENT = 0, 1
FIRST, COUNT = 1, 2
TURN, MOVE, LAST = 3, 4, 5
# Columns of a marker's numbers: its place in the joint's frame [m], its weight, its usual distance [m].
OFFSET, WEIGHT, SPREAD = 0, 3, 4
# Columns of what is remembered of a marker.
BIAS, EASE, EASE_RATE, UNSEEN, REFUSED, KNOWN, TRUST = 0, 3, 6, 7, 8, 9, 10
MEMORY = 12

USED, LOST, REJECTED, SWAPPED = range(4)
"""What became of a marker in a frame."""


class Options(NamedTuple):
    """Options of the compiled tracker; see ``MarkerTracker``."""

    limits: bool
    most: int
    dt: float
    cold: bool
    gate: float
    posture: float
    damping: float


def pack_options(options):
    """Options as seven numbers."""
    return [float(value) for value in options]


@helper
def unpack_options(numbers):
    """Options from seven numbers."""
    return Options(
        numbers[0] > 0.0,
        int(numbers[1]),
        numbers[2],
        numbers[3] > 0.0,
        numbers[4],
        numbers[5],
        numbers[6],
    )


class Memory(NamedTuple):
    """What goes from frame to frame.

    Attributes:
        state: (2 J + 1, 4) local rotations, base position, hinge angles, as in prioritized IK.
        speed: (2 J + 1, 4) their rates of change [rad/s, m/s]; the last number of the base's row is the damping
            [m] that the next frame begins with.
        marker: (M, 12) per marker: distance from its place [m] in the joint's frame, what is left of a jump
            when it came back [m] and how fast that fades [1/s], times since it was used and since it is
            refused [s], whether its distance is known, and how much of its distance counts (0 to 1).
    """

    state: object
    speed: object
    marker: object
