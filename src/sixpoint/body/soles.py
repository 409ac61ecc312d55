"""Where the soles of a figure are: below and before its ankles, and on which floor they stand."""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion

FLAT = 0.04  # a foot that reaches less far below the ankle [of the pelvis' height over it] shows no sole
CARRIED = 0.5  # skin belongs to a foot that carries more than this share of it
STANDING = 0.2  # of the frames at least one foot stands in


def ankle_height(figure: Figure) -> float:
    """Height of the ankles over the soles, standing in the neutral pose [m].

    Soles are where the skin of the feet ends; without skin there, at the lowest joint or site of a foot; of a
    rig without feet by proportion.
    """
    skin = measure_feet(figure)
    if skin is not None:
        return skin[0]
    skeleton, ankles, rest = figure.skeleton, figure.roles.ankle, figure.rest_positions
    marks = skeleton.compute_sites(rest, figure.neutral)[:, 1]
    height = float(rest[figure.roles.pelvis, 1] - rest[list(ankles), 1].mean())
    drop = 0.0
    for ankle in ankles:
        foot = skeleton.subtree(ankle)
        below = [*rest[foot, 1], *marks[np.isin(skeleton.site_parents, foot)]]
        drop = max(drop, float(rest[ankle, 1] - min(below)))
    return drop if drop > FLAT * height else _average_ankle() * height


@lru_cache(maxsize=8)  # a whole skin is placed, and live feet are levelled at every frame
def measure_feet(figure: Figure) -> tuple[float, float] | None:
    """How far the skin of the feet reaches below and before the ankles in the neutral pose [m].

    None where a foot has no skin: a rig of bones, or a body without feet.
    """
    shape = figure.shape
    if shape is None:
        return None
    places, world = figure.neutral_pose.compute_transforms()
    vertices = shape.place(places, world)
    reach = []
    for ankle in figure.roles.ankle:
        carried = np.isin(shape.joints, figure.skeleton.subtree(ankle))
        foot = vertices[np.sum(shape.weights * carried, axis=1) > CARRIED] - places[ankle]
        if not len(foot):
            return None
        reach.append((-foot[:, 1].min(), foot[:, 2].max()))
    below, before = np.max(reach, axis=0)
    return (float(below), float(before)) if min(below, before) > 0.0 else None


def find_floor(figure: Figure, motion: Motion) -> float:
    """Height of the soles when they stand, which is the floor's if they ever do [m]."""
    lowest = motion.positions[:, list(figure.roles.ankle), 1].min(axis=1)
    return float(np.quantile(lowest, STANDING)) - ankle_height(figure)


@cache
def _average_ankle() -> float:
    """Height of the ankles over the soles, of the pelvis' height over the ankles."""
    figure = Figure.from_stature()
    rest = figure.rest_positions
    return ankle_height(figure) / float(rest[figure.roles.pelvis, 1] - rest[figure.roles.ankle[0], 1])
