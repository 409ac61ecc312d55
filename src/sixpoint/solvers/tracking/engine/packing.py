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
BIAS, UNSEEN, REFUSED, KNOWN, TRUST, ASTRAY = 0, 3, 4, 5, 6, 7
MEMORY = 8

USED, LOST, REJECTED, SWAPPED = range(4)
"""What became of a marker in a frame."""
WAITING = -1
"""The frame was not followed: it lies before the first, or after the last, that tells a body."""


class Options(NamedTuple):
    """Options of the compiled tracker; see ``MarkerTracker``."""

    limits: bool
    most: int
    dt: float
    cold: bool
    gate: float
    posture: float
    damping: float
    steady: bool


def pack_options(options):
    """Options as eight numbers."""
    return [float(value) for value in options]


@helper
def unpack_options(numbers):
    """Options from eight numbers."""
    return Options(
        numbers[0] > 0.0,
        int(numbers[1]),
        numbers[2],
        numbers[3] > 0.0,
        numbers[4],
        numbers[5],
        numbers[6],
        numbers[7] > 0.0,
    )
