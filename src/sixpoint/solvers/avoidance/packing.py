"""How the flesh of a figure crosses into compiled code: one array, a row per prism and one for the arms.

A prism's row: x and z of its centre line, least and largest height, largest radius, outlines per metre, then
the grown outlines (7, 33) as |x| + |z| of their points, see ``body.surface.prisms.directions``; the last
point is the first. The arms' row: number of balls, how far from the elbow the farthest is [m], then per ball
1 for the line elbow-wrist or 0 for elbow-shoulder, the share of it, by how much the ball is smaller than the
radius by which outlines are grown, and how far it is beside the line, to where the elbow folds [m].

Thighs cross in a second array of rows of four, or as None where nothing stays out of them: radius at hip and
knee [m], number of the arms' balls, and 1 if thighs stay out of each other; how far from the elbow the
farthest ball is [m], and the radius at the wrist [m]; then per ball as above, with its radius.
"""

from typing import NamedTuple

import numpy as np

from sixpoint.body.surface import prisms as outlines
from sixpoint.kernels.jit import helper

DIRECTIONS, SLICES = 32, 7  # written out: the cache of compiled code knows this file, not ``body``
assert (DIRECTIONS, SLICES) == (outlines.DIRECTIONS, outlines.SLICES)
HEADER = 6
RING = DIRECTIONS + 1
WIDTH = HEADER + SLICES * RING
BALL = 4
SPREAD, FIRST_BALL = 1, 2
THIGH_HEADER = 2


class Flesh(NamedTuple):
    """The flesh as slices.

    Attributes:
        prisms: (P, W) rows of prisms; joint k of the trunk has row k.
        arms: (W,) balls of an arm.
        thighs: (2 + B, 4) thighs and balls that stay out of them, or None.
        placed: (4, 4) left hip and knee, right hip and knee in the world [m]; beside the hips, the swivel
            angle of the last frame from the knee as it was posed in this one [rad].
        memory: The solver's memory; the clavicles' angles are beside its rows 2 and 3 [rad].
    """

    prisms: np.ndarray
    arms: np.ndarray
    thighs: np.ndarray
    placed: np.ndarray
    memory: np.ndarray


def pack_flesh(prisms, lengths, forearms):
    """Flesh of a figure as an array (P + 1, W).

    Args:
        prisms: See ``body.surface.prisms``.
        lengths: Of upper arm and forearm [m].
        forearms: Whether with the balls of the forearms.
    """
    norm = np.abs(outlines.directions()).sum(axis=1)
    table = np.zeros((len(prisms.prisms) + 1, WIDTH))
    for row, prism in zip(table, prisms.prisms, strict=False):
        low, high = prism.heights[0], prism.heights[-1]
        row[:HEADER] = *prism.centre, low, high, prism.grown.max(), (SLICES - 1) / max(high - low, 1e-9)
        row[HEADER:] = np.pad(prism.grown * norm, ((0, 0), (0, 1)), mode="wrap").ravel()
    balls = [*prisms.elbow, *(prisms.forearm if forearms else ())]
    table[-1, :FIRST_BALL] = len(balls), _spread(balls, lengths)
    numbers = [(ball.forearm, ball.share, prisms.radius - ball.radius, ball.beside) for ball in balls]
    table[-1, FIRST_BALL : FIRST_BALL + BALL * len(balls)] = np.ravel(numbers)
    return table


def pack_thighs(radii, balls, lengths, apart, palm):
    """Thighs of a figure as an array (2 + B, 4).

    Args:
        radii: At hip and knee [m].
        balls: Of an arm, see ``body.surface.prisms``; none where arms may touch thighs.
        lengths: Of upper arm and forearm [m].
        apart: Whether thighs stay out of each other.
        palm: Most of a hand beside a thigh [m]: they touch where a body just stands.
    """
    table = np.zeros((THIGH_HEADER + len(balls), 4))
    table[0] = *radii, len(balls), apart
    if balls:
        wrist = min((b for b in balls if b.forearm), key=lambda ball: abs(ball.share - 1.0))
        table[1, :2] = _spread(balls, lengths), wrist.radius
        table[THIGH_HEADER:] = [
            (b.forearm, b.share, min(b.radius, palm) if b.share > 1.0 else b.radius, b.beside) for b in balls
        ]
    return table


def _spread(balls, lengths):
    """How far from the elbow the farthest ball is [m]."""
    return max(np.hypot(ball.share * lengths[ball.forearm], ball.beside) for ball in balls)


@helper
def unpack_flesh(table, thighs, placed, memory):
    """The flesh as slices; ``placed`` is working memory (4, 4)."""
    last = table.shape[0] - 1
    return Flesh(table[:last], table[last], thighs, placed, memory)
