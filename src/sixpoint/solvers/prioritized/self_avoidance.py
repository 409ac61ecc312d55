"""Obstacles for prioritized IK from a figure's own surface: capsules that move with its joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.surface.flesh_regions import (
    HEAD,
    NECK,
    SHANK,
    THIGH,
    TRUNK,
    neutral_surface,
    parts_of_joints,
)
from sixpoint.errors import SixpointError, listed
from sixpoint.solvers.prioritized.tasks import Capsule, ObstacleTask

Array = NDArray[np.float64]

PARTS = {"trunk": (TRUNK,), "head": (HEAD, NECK), "thighs": (THIGH,), "shanks": (SHANK,)}
"""Parts of the body that can be obstacles to others."""
FEWEST = 12  # vertices that make a capsule
FILLED = 0.9  # of the vertices are within a capsule's radius


@dataclass(frozen=True, eq=False)
class BodyCapsule:
    """A capsule that a joint carries.

    Attributes:
        joint: Name of the joint.
        capsule: Its shape.
        place: (7,) position [m] and rotation in the joint's anatomical frame.
    """

    joint: str
    capsule: Capsule
    place: Array


def fit_capsules(figure: Figure, part: str = "trunk") -> list[BodyCapsule]:
    """Capsules around a part of a figure with a shape: one for each joint that carries enough of it.

    A capsule lies along the longest axis of what the joint carries; its radius holds nine tenths of it.

    Raises:
        SixpointError: The figure has no shape, or there is no such part.
    """
    if part not in PARTS:
        raise SixpointError(f"no part {part!r} can be an obstacle; there are: {listed(PARTS)}")
    if figure.shape is None:
        raise SixpointError("capsules are fitted to a figure's surface: give it one, figure.with_shape(...)")
    vertices, parts = neutral_surface(figure)
    shape = figure.shape
    carriers = shape.joints[np.arange(len(vertices)), shape.weights.argmax(axis=1)]
    wanted = np.isin(parts % 16, PARTS[part]) & np.isin(parts_of_joints(figure)[carriers] % 16, PARTS[part])
    found = []
    for joint in np.unique(carriers[wanted]):
        own = vertices[wanted & (carriers == joint)]
        if len(own) < FEWEST:
            continue
        low, high = own.min(axis=0), own.max(axis=0)
        middle, axis = 0.5 * (low + high), int(np.argmax(high - low))
        off = np.linalg.norm(np.delete(own - middle, axis, axis=1), axis=1)
        radius = float(np.quantile(off, FILLED))
        length = max(float(high[axis] - low[axis]) - 2.0 * radius, 0.0)
        turn = rot.from_axis_angle(np.array([[0, 0, -1.0], [0, 1.0, 0], [1.0, 0, 0]])[axis], np.pi / 2)
        place = np.array([*(middle - figure.rest_positions[joint]), *(rot.IDENTITY if axis == 1 else turn)])
        found.append(BodyCapsule(figure.skeleton.names[joint], Capsule(radius, length), place))
    return found


def stay_out(
    figure: Figure,
    at: str,
    part: str = "trunk",
    *,
    level: int = 0,
    points: Sequence[str | tuple[str, tuple[float, float, float]]] = (),
    margin: float = 0.0,
    buffer: float = 0.02,
) -> list[ObstacleTask]:
    """Tasks that keep places of a figure out of a part of its own body.

    Args:
        figure: A figure with a shape.
        at: A place, such as "l_elbow".
        part: A name of ``PARTS``.
        level: Their priority.
        points: More places, see ``ObstacleTask``.
        margin: Distance kept: the flesh around the places [m].
        buffer: Zone in which approaches are slowed [m].

    Raises:
        SixpointError: As of ``fit_capsules``.
    """
    return [
        ObstacleTask(
            at,
            body.capsule,
            level=level,
            points=tuple(points),
            margin=margin,
            buffer=buffer,
            on=body.joint,
            goal=body.place,
            name=f"{at} out of {part} {k}",
        )
        for k, body in enumerate(fit_capsules(figure, part))
    ]
