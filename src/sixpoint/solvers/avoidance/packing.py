"""How the flesh of a figure crosses into compiled code: one array, a row per prism and one for the arms.

A prism's row: x and z of its centre line, least and largest height, largest radius, then the grown outlines
(7, 32) as |x| + |z| of their points, see ``body.prisms.directions``. The arms' row: number of balls, radius
by which outlines are grown, then per ball 1 for the line elbow-wrist or 0 for elbow-shoulder, the share of
it, and by how much the ball is smaller than that radius [m].
"""

from typing import NamedTuple

import numpy as np

from sixpoint.body import prisms as outlines
from sixpoint.kernels.jit import helper

DIRECTIONS, SLICES = 32, 7  # written out: the cache of compiled code knows this file, not ``body``
assert (DIRECTIONS, SLICES) == (outlines.DIRECTIONS, outlines.SLICES)
HEADER = 5
WIDTH = HEADER + SLICES * DIRECTIONS
BALL = 3
FIRST_BALL = 2


class Flesh(NamedTuple):
    """The flesh as slices.

    Attributes:
        prisms: (P, W) rows of prisms; joint k of the trunk has row k.
        arms: (W,) balls of an arm.
    """

    prisms: np.ndarray
    arms: np.ndarray


def pack_flesh(prisms, forearms):
    """Prisms of a figure, see ``body.prisms`` -> (P + 1, W); with the balls of the forearms or without."""
    norm = np.abs(outlines.directions()).sum(axis=1)
    table = np.zeros((len(prisms.prisms) + 1, WIDTH))
    for row, prism in zip(table, prisms.prisms, strict=False):
        row[:HEADER] = *prism.centre, prism.heights[0], prism.heights[-1], prism.grown.max()
        row[HEADER:] = (prism.grown * norm).ravel()
    balls = [*prisms.elbow, *(prisms.forearm if forearms else ())]
    table[-1, :FIRST_BALL] = len(balls), prisms.radius
    numbers = [(ball.forearm, ball.share, prisms.radius - ball.radius) for ball in balls]
    table[-1, FIRST_BALL : FIRST_BALL + BALL * len(balls)] = np.ravel(numbers)
    return table


@helper
def unpack_flesh(table):
    """The flesh as slices."""
    last = table.shape[0] - 1
    return Flesh(table[:last], table[last])
