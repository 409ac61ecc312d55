"""Two bones to an end point: the law of cosines, and a rule for which way elbows and knees point.

The rule: in a reference direction of the limb (leg down, arm forward) the middle joint points along a
reference pole (knee forward, elbow down). Every other direction turns that pole along the shortest arc.
The one direction where this fails is opposite to the reference, where no human limb goes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot

Array = NDArray[np.float64]

X, Y, Z = np.eye(3)
SOFT, HARD = 0.982, 0.998  # limbs slow down from 98.2 % of their length on and stay shorter than 99.8 %


def compute_pole(direction: Array, reference: Array, pole: Array, swivel: Array) -> Array:
    """Where the middle joint points.

    Args:
        direction: (F, 3) unit vectors along the limb.
        reference: (3,) unit direction in which the pole is ``pole``.
        pole: (3,) unit vector perpendicular to ``reference``.
        swivel: (F,) extra rotation about the limb [rad].

    Returns:
        (F, 3) unit vectors perpendicular to ``direction``.
    """
    carried = rot.mul_vec(rot.between(reference, direction), pole)
    return rot.mul_vec(rot.from_axis_angle(direction, swivel), carried)


def limit_reach(vector: Array, length: float) -> Array:
    """Shorten vectors (F, 3) that the limb of ``length`` [m] cannot reach, smoothly."""
    distance = np.linalg.norm(vector, axis=-1, keepdims=True)
    soft, room = SOFT * length, (HARD - SOFT) * length
    beyond = np.maximum(distance - soft, 0.0)
    limited = np.where(beyond > 0, soft + room * np.tanh(beyond / room), distance)
    return np.asarray(vector * limited / np.maximum(distance, 1e-9), float)


def solve_two_bones(
    vector: Array, pole: Array, upper: float, lower: float, bend: float
) -> tuple[Array, Array]:
    """Rotation of the upper bone and flexion of the middle joint.

    Args:
        vector: (F, 3) from the limb's root to its end [m], within reach.
        pole: (F, 3) unit, perpendicular to ``vector``: where the middle joint points.
        upper: Length of the first bone [m].
        lower: Length of the second bone [m].
        bend: +1 where the middle joint flexes about +X (knee, points forward), -1 about -X (elbow).

    Returns:
        Rotations (F, 4) of the upper bone, which hangs along -Y in the neutral pose, in the frame of
        ``vector``, and flexion angles (F,) >= 0 [rad].
    """
    distance = np.linalg.norm(vector, axis=-1)
    along = vector / distance[:, None]
    cosine = (upper**2 + distance**2 - lower**2) / (2 * upper * distance)
    opening = np.arccos(np.clip(cosine, -1.0, 1.0))[:, None]
    bone = np.cos(opening) * along + np.sin(opening) * pole
    front = bend * (np.cos(opening) * pole - np.sin(opening) * along)
    rotation = rot.from_axes(np.cross(-bone, front), -bone, front)
    inner = (upper**2 + lower**2 - distance**2) / (2 * upper * lower)
    return rotation, np.asarray(np.pi - np.arccos(np.clip(inner, -1.0, 1.0)), float)
