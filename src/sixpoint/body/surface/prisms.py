"""The flesh that elbows must stay out of: outlines around the trunk's joints, and balls around the elbow.

Each trunk joint has a stack of outlines in planes across its Y axis, as radii in 32 directions around a
centre line. They come from the surface of a figure with a shape, else from elliptic cylinders. Outlines that
are *grown* by the elbow's radius say at once whether an elbow, then a point, is inside.

Reference: Unzueta et al. 2008, section 8 (their prisms have one outline each).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure, SpineChain
from sixpoint.body.surface.flesh_regions import (
    arm_radius,
    bare_trunk,
    hand_balls,
    trunk_points,
    unit_of,
)

Array = NDArray[np.float64]

DIRECTIONS = 32
SLICES = 7
OVERLAP = 0.02  # m, by which prisms of bent neighbours run into each other
LEAST = 1e-3  # m, least radius of an outline
REGION = 0.08  # of an elbow: so far along upper arm and forearm, for the mean stature [m]
FOREARM_SHARES = (0.55, 0.8)  # places on the line elbow-wrist


def directions() -> Array:
    """(32, 2) unit x and z of the directions of an outline.

    They are even in the diamond angle, x / (|x| + |z|) along each quarter, which needs no trigonometry;
    mirrored in x they are the same directions.
    """
    a = 4.0 * np.arange(DIRECTIONS) / DIRECTIONS
    x = np.where(a <= 2.0, 1.0 - a, a - 3.0)
    z = np.where(a <= 2.0, 1.0 - np.abs(x), np.abs(x) - 1.0)
    return np.asarray(np.column_stack([x, z]) / np.hypot(x, z)[:, None])


@dataclass(frozen=True, eq=False)
class Prism:
    """Outlines around one trunk joint, in its anatomical frame (neutral pose: X left, Y up, Z forward).

    Attributes:
        joint: The joint.
        centre: (2,) x and z of the centre line [m].
        heights: (K,) y of the outlines, rising [m].
        radii: (K, 32) the flesh's, along ``directions()`` [m].
        grown: (K, 32) those of the region in which a ball of the elbow's radius touches the flesh [m].
    """

    joint: int
    centre: Array
    heights: Array
    radii: Array
    grown: Array


@dataclass(frozen=True, eq=False)
class Ball:
    """A ball of an arm.

    Attributes:
        forearm: Whether it lies on the line from elbow to wrist, else on that from elbow to shoulder.
        share: Where on it: 0 the elbow, 1 the other end.
        radius: [m].
        beside: How far beside the line, to where the elbow folds [m].
    """

    forearm: bool
    share: float
    radius: float
    beside: float = 0.0


@dataclass(frozen=True, eq=False)
class Prisms:
    """The flesh of a figure as elbow avoidance sees it.

    Attributes:
        prisms: One per joint of the trunk that has flesh, from the pelvis up.
        elbow: Balls near an elbow; the same for both arms.
        forearm: Balls of forearm and hand.
        radius: Radius by which outlines are grown [m].
    """

    prisms: tuple[Prism, ...]
    elbow: tuple[Ball, ...]
    forearm: tuple[Ball, ...]
    radius: float

    @cached_property
    def joints(self) -> tuple[int, ...]:
        """The joints of the prisms."""
        return tuple(prism.joint for prism in self.prisms)


def build_prisms(figure: Figure, chain: SpineChain | None = None, *, head: bool = False) -> Prisms:
    """The prisms of a figure.

    Args:
        figure: Whose flesh; without a shape it has elliptic cylinders.
        chain: The trunk as a solver sees it; ``figure.spine_chain`` by default.
        head: Whether neck and head have prisms too.
    """
    chain = chain or figure.spine_chain
    unit = unit_of(figure)
    radius = arm_radius(figure, REGION * unit, 0.0, 0.5 * REGION * unit, forearm=True)
    points = trunk_points(figure, head) if figure.shape is not None else bare_trunk(figure, head)
    prisms = []
    carriers = range(len(chain.joints) if head else _top(figure, chain) + 1)
    for k in carriers:
        last = k == carriers[-1]
        place = figure.rest_positions[chain.joints[k]]
        local = points - place
        low = local[:, 1].min() - radius if k == 0 else -OVERLAP
        high = local[:, 1].max() + radius if last else chain.segments[k][1] + OVERLAP
        prisms.append(_prism(chain.joints[k], local, max(high, low + OVERLAP), low, radius))
    elbow, forearm = _balls(figure, unit, radius)
    return Prisms(tuple(prisms), elbow, forearm, radius)


def _top(figure: Figure, chain: SpineChain) -> int:
    """Node of the chain whose joint carries the arms."""
    roles = figure.roles
    first = (roles.clavicle or roles.shoulder)[0]
    carrier = next(j for j in figure.skeleton.path(0, first)[-2::-1] if j in chain.node)
    return min(chain.node[carrier], len(chain.joints) - 1)


def _balls(figure: Figure, unit: float, radius: float) -> tuple[tuple[Ball, ...], tuple[Ball, ...]]:
    roles = figure.roles
    upper = float(np.linalg.norm(figure.offset_between(roles.shoulder[0], roles.elbow[0])))
    lower = float(np.linalg.norm(figure.offset_between(roles.elbow[0], roles.wrist[0])))
    half = 0.5 * REGION * unit

    def ball(forearm: bool, share: float) -> Ball:
        along = share * (lower if forearm else upper)
        found = arm_radius(figure, along + half, along, half, forearm=forearm)
        return Ball(forearm, share, min(found, radius))

    elbow = (
        Ball(True, 0.0, radius),
        ball(False, min(0.75 * REGION * unit / upper, 1.0)),
        ball(True, min(0.75 * REGION * unit / lower, 1.0)),
    )
    hand = [Ball(True, 1.0 + beyond / lower, found, beside) for beyond, beside, found in hand_balls(figure)]
    return elbow, (*(ball(True, share) for share in FOREARM_SHARES), *hand)


def _prism(joint: int, points: Array, high: float, low: float, radius: float) -> Prism:
    """Outlines of points (N, 3) of a surface between two heights."""
    near = points[(points[:, 1] > low - radius) & (points[:, 1] < high + radius)]
    heights = np.linspace(low, high, SLICES)
    if not len(near):
        empty = np.full((SLICES, DIRECTIONS), LEAST)
        return Prism(joint, np.zeros(2), heights, empty, empty)
    centre = 0.5 * (near[:, ::2].min(axis=0) + near[:, ::2].max(axis=0))
    thin = 0.015
    radii = np.maximum(_reach(near, centre, heights, thin) - thin, LEAST)
    grown = np.maximum(_reach(near, centre, heights, radius), LEAST)
    return Prism(joint, centre, heights, radii, grown)


def _reach(points: Array, centre: Array, heights: Array, radius: float) -> Array:
    """How far the balls around points reach along rays from the centre line: (K, 32), 0 where none is met."""
    out = np.zeros((len(heights), DIRECTIONS))
    rays = directions()
    for k, height in enumerate(heights):
        room = radius * radius - (points[:, 1] - height) ** 2
        met = room > 0.0
        if not met.any():
            continue
        flat = points[met][:, ::2] - centre
        along = flat @ rays.T
        inside = room[met, None] - (flat**2).sum(axis=1)[:, None] + along**2
        reached = np.where(inside >= 0.0, along + np.sqrt(np.maximum(inside, 0.0)), 0.0)
        out[k] = reached.max(axis=0)
    return out
