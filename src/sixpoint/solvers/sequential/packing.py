"""Options and working memory of the compiled steps of Sequential IK."""

from typing import NamedTuple

import numpy as np

from sixpoint.kernels.jit import helper


class Settings(NamedTuple):
    """Options of the compiled solver; see ``SequentialIK``."""

    w1: float
    w2: float
    w3: float
    limits: bool
    literal: bool
    hold_clavicles: bool
    align_pelvis: bool


class Scratch(NamedTuple):
    """Working memory for a trunk of S segments; rows of four as in ``Model``.

    Attributes:
        world: (S, 4) world rotations of the trunk joints.
        segs: (S, 4) trunk segments in the world [m].
        start: (S, 4) local rotations to bend from.
        flat: (S, 4) two components of the segments in the bending plane [m].
        filled: (6, 4) effector positions with the lost ones filled in [m], and 1 for a known point, else 0.
    """

    world: np.ndarray
    segs: np.ndarray
    start: np.ndarray
    flat: np.ndarray
    filled: np.ndarray


@helper
def unpack_settings(options):
    """Settings from seven numbers."""
    return Settings(
        options[0],
        options[1],
        options[2],
        options[3] > 0.0,
        options[4] > 0.0,
        options[5] > 0.0,
        options[6] > 0.0,
    )


def work_rows(segments):
    """Rows of working memory for a trunk of so many segments; the last four are for thighs."""
    return 4 * segments + 10


@helper
def unpack_work(work, s):
    """Working memory as slices."""
    return Scratch(
        work[:s], work[s : 2 * s], work[2 * s : 3 * s], work[3 * s : 4 * s], work[4 * s : 4 * s + 6]
    )
