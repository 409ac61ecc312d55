"""Feet that have no rotation of their own are levelled where they are low: soles are flat on a floor.

Six points say where an ankle is, not how the foot is turned; solvers leave it at its rest angle to the shank,
which puts toes into the floor as soon as a knee bends. Here a foot whose ankle is as high as in standing is
flat and keeps its heading, one that is lifted returns to its rest angle, and the toes of no foot are below
the floor. A shank that lies, as in kneeling, leaves the foot as it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Pose
from sixpoint.calibration.model import ANKLE_HEIGHT, stature_of
from sixpoint.live.stance import about_up, compute_yaw
from sixpoint.live.stepping import ease

Array = NDArray[np.float64]

LOW, HIGH = 0.010, 0.085  # ankle over its standing height: flat below the first, free above [of the stature]
STEEP, LYING = 0.9, 1.4  # rad, a shank's lean from which its foot is let go, and is free
FLEX = 0.9  # rad, most that an ankle is turned against its shank
BALL, TOES = 0.07, 0.10  # the ball of the foot and the toe tips before the ankle, of the stature


@dataclass(frozen=True)
class Floor:
    """A level floor under a figure.

    Attributes:
        stature: Of the figure [m].
        ankle: Height of its ankles over the floor in standing [m].
        height: Of the floor [m].
    """

    stature: float
    ankle: float
    height: float = 0.0

    @classmethod
    def under(cls, figure: Figure, height: float = 0.0) -> Floor:
        """The floor under a figure of average proportions, whose ankles are 0.039 of the stature over it."""
        stature = stature_of(figure)
        return cls(stature, ANKLE_HEIGHT * stature, height)


def level_feet(
    figure: Figure, pose: Pose, floor: Floor | None = None, *, free: tuple[bool, bool] = (True, True)
) -> Pose:
    """Turn the ankles of a solved pose so that low feet are flat on the floor.

    Args:
        figure: What is posed.
        pose: A pose of it.
        floor: Where the floor is; ``Floor.under(figure)`` by default, which a loop makes once.
        free: Whether the left, the right foot has no measured rotation; others are left alone.

    Returns:
        A pose that differs in the ankles' rotations only.
    """
    floor = floor or Floor.under(figure)
    places, world = pose.compute_transforms()
    stature, stand = floor.stature, floor.ankle
    rotations = pose.rotations.copy()
    for knee, ankle, is_free in zip(figure.roles.knee, figure.roles.ankle, free, strict=True):
        if not is_free:
            continue
        parent = int(figure.skeleton.parents[ankle])
        height = float(places[ankle][1]) - floor.height - stand
        bone = rot.unit(places[knee] - places[ankle])
        lean = float(np.arccos(np.clip(bone[1], -1.0, 1.0)))
        now = rot.mul(world[ankle], rot.inv(figure.neutral[ankle]))
        turn = _level(now, height, lean, stature, stand)
        rotations[ankle] = rot.mul(rot.inv(world[parent]), rot.mul(turn, figure.neutral[ankle]))
    return Pose(pose.skeleton, rotations, pose.translations, pose.moving)


def _level(now: Array, height: float, lean: float, stature: float, stand: float) -> Array:
    """World rotation of a foot whose ankle is ``height`` over where it stands."""
    flat = about_up(compute_yaw(now))
    lift = height / stature
    weight = 1.0 - float(ease((lift - LOW) / (HIGH - LOW)))
    upright = 1.0 - float(ease((lean - STEEP) / (LYING - STEEP)))
    turn = _towards(now, flat, weight * upright, FLEX)
    # The tips of the toes are at least on the floor: a foot that points lower is turned up about its X axis.
    toes = rot.mul_vec(turn, np.array([0.0, -stand, TOES * stature]))
    least = -(height + stand)
    if toes[1] < least and upright > 0.0:
        reach = float(np.hypot(toes[1], np.hypot(toes[0], toes[2])))
        pitch = asin(min(max(-toes[1] / reach, -1.0), 1.0)) - asin(min(max(-least / reach, -1.0), 1.0))
        axis = rot.unit(np.array([toes[2], 0.0, -toes[0]]))
        turn = rot.mul(rot.from_axis_angle(axis, -upright * max(pitch, 0.0)), turn)
    return turn


def _towards(a: Array, b: Array, weight: float, most: float) -> Array:
    """A rotation on the short way from ``a`` to ``b``, at most so far [rad]."""
    change = rot.mul(b, rot.inv(a))
    change = -change if change[3] < 0 else change
    size = float(rot.angle(change))
    return rot.mul(rot.from_axis_angle(rot.unit(change[:3]), min(weight * size, most)), a)
