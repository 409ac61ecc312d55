"""Feet that have no rotation of their own are levelled where they are low: soles are flat on a floor.

Six points say where an ankle is, not how the foot is turned; solvers leave it at its rest angle to the shank,
which puts toes into the floor as soon as a knee bends. Here a foot whose ankle is as high as in standing is
flat and keeps its heading, one that is lifted returns to its rest angle, and the toes of no foot are below
the floor. A shank that lies, as in kneeling, leaves the foot as it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, asin, cos, sin

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Pose
from sixpoint.body.soles import measure_feet
from sixpoint.body.stature import stature_of
from sixpoint.calibration.model import ANKLE_HEIGHT
from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.live.chains import Quaternion, trace
from sixpoint.live.stance import compute_yaw
from sixpoint.live.stepping import ease

LOW, HIGH = 0.010, 0.060  # ankle over its standing height: flat below the first, free above [of the stature]
STEEP, LYING = 0.9, 1.4  # rad, a shank's lean from which its foot is let go, and is free
FLEX = 0.9  # rad, most that an ankle is turned against its shank
TOES = 0.10  # how far the toe tips are before the ankle, of the stature


@dataclass(frozen=True, kw_only=True)
class Floor:
    """A level floor under a figure.

    Attributes:
        stature: Of the figure [m].
        ankle: Height of its ankles over the floor in standing [m].
        toes: How far the tips of its toes are before the ankle [m].
        height: Of the floor [m].
    """

    stature: float
    ankle: float
    toes: float
    height: float = 0.0

    @classmethod
    def under(cls, figure: Figure, height: float = 0.0) -> Floor:
        """The floor under a figure: its feet are those of its skin, else of average proportions."""
        stature = stature_of(figure)
        skin = measure_feet(figure)
        ankle, toes = (ANKLE_HEIGHT * stature, TOES * stature) if skin is None else skin
        return cls(stature=stature, ankle=ankle, toes=toes, height=height)


def level_feet(
    figure: Figure,
    pose: Pose,
    floor: Floor | None = None,
    *,
    free: tuple[bool, bool] = (True, True),
    clear: bool = False,
) -> Pose:
    """Turn the ankles of a solved pose so that low feet are flat on the floor.

    Args:
        figure: What is posed.
        pose: A pose of it.
        floor: Where the floor is; ``Floor.under(figure)`` by default, which a loop makes once.
        free: Whether the left, the right foot has no measured rotation; others are left alone.
        clear: Turn up the toes of these, too, where they are in the floor.

    Returns:
        A pose that differs in the ankles' rotations only.
    """
    floor = floor or Floor.under(figure)
    roles, rotations = figure.roles, pose.rotations.copy()
    places, world = trace(pose, roles.ankle)
    for knee, ankle, is_free in zip(roles.knee, roles.ankle, free, strict=True):
        if not (is_free or clear):
            continue
        neutral = tuple(figure.neutral[ankle].tolist())
        bone = vec.unit(vec.sub(places[knee], places[ankle]))
        lean = acos(min(max(bone[1], -1.0), 1.0))
        now = qt.mul(world[ankle], qt.inv(neutral))
        height = places[ankle][1] - floor.height - floor.ankle
        upright = 1.0 - float(ease((lean - STEEP) / (LYING - STEEP)))
        turn = _clear(_level(now, height, upright, floor) if is_free else now, height, upright, floor)
        above = world[int(figure.skeleton.parents[ankle])]
        rotations[ankle] = qt.inv_mul(above, qt.mul(turn, neutral))
    return Pose(pose.skeleton, rotations, pose.translations, pose.moving)


def _level(now: Quaternion, height: float, upright: float, floor: Floor) -> Quaternion:
    """World rotation of a foot whose ankle is ``height`` over where it stands [m]: flat where that is low."""
    yaw = compute_yaw(now)
    flat = (0.0, sin(0.5 * yaw), 0.0, cos(0.5 * yaw))
    weight = 1.0 - float(ease((height / floor.stature - LOW) / (HIGH - LOW)))
    change = qt.mul(flat, qt.inv(now))
    size = vec.norm(qt.log(change))
    return qt.mul(qt.scaled(change, min(weight * upright, FLEX / max(size, 1e-9))), now)  # type: ignore[no-any-return]


def _clear(turn: Quaternion, height: float, upright: float, floor: Floor) -> Quaternion:
    """The tips of the toes are at least on the floor: a foot that points lower is turned up."""
    toes = qt.mul_vec(turn, (0.0, -floor.ankle, floor.toes))
    least = -(height + floor.ankle)
    if toes[1] < least and upright > 0.0:
        reach = vec.norm(toes)
        pitch = asin(min(max(-toes[1] / reach, -1.0), 1.0)) - asin(min(max(-least / reach, -1.0), 1.0))
        axis = vec.unit((toes[2], 0.0, -toes[0]))
        turn = qt.mul(qt.from_axis_angle(axis, -upright * max(pitch, 0.0)), turn)
    return qt.normalised(turn)  # type: ignore[no-any-return]
