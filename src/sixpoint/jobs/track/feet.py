"""Feet that stand do not slide: their markers are held while both heel and toe are on the floor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.motion import Motion
from sixpoint.jobs.track.models import FEWEST
from sixpoint.signals.contacts import find_contacts
from sixpoint.signals.gaps import find_runs
from sixpoint.solvers.tracking.priorities import find_parts

Array = NDArray[np.float64]

STILL, SPAN = 0.01, 0.06  # a foot that stands stays within this [m] so long before and after [s]
DRIFT = 0.02  # one that creeps farther than this stands anew [m]
FADE = 0.06  # time in which a foot goes over from moving to standing, and back [s]
TIGHT = {"feet": 0.01}
"""Tolerance that holds feet where their markers are held [m]."""


def find_stances(
    model: MarkerModel, motion: Motion, seen: NDArray[np.bool_] | None = None
) -> NDArray[np.bool_]:
    """(F, 2) frames in which the left and the right foot stand flat: ankle and toes rest.

    ``seen`` (F,) are the frames in which markers tell of the body; in others no foot stands.
    """
    points = motion.positions[:, _ends(model)]
    if seen is not None:
        points = np.where(seen[:, None, None], points, np.nan)
    rest = find_contacts(points, motion.rate) & _is_still(points, max(round(SPAN * motion.rate), 1))
    return np.stack([rest[:, 0] & rest[:, 1], rest[:, 2] & rest[:, 3]], axis=1)


def hold_feet(model: MarkerModel, motion: Motion, markers: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Markers (F, M, 3) with those of standing feet where the foot is on average of its stance.

    Returns:
        The markers, and (F, 2) the frames in which a foot is held.
    """
    seen = np.isfinite(markers[..., 0]).sum(axis=1) >= FEWEST
    stances, held = find_stances(model, motion, seen), markers.copy()
    positions, world = motion.transforms
    neutral = model.place(*model.figure.neutral_pose.compute_transforms())
    places = neutral - model.figure.neutral_pose.compute_transforms()[0][model.figure.roles.pelvis]
    feet = np.array(find_parts(model.figure, model.joints, places)) == "feet"
    for k, ankle in enumerate(model.figure.roles.ankle):
        mine = np.flatnonzero(np.isin(model.joints, model.figure.skeleton.subtree(ankle)))
        knee = model.figure.roles.knee[k]
        malleoli = np.flatnonzero(feet & (model.joints == knee))
        ends = positions[:, _ends(model)[2 * k : 2 * k + 2]]
        for start, stop in _stands(stances[:, k], ends):
            part = slice(start, stop)
            turn, place = rot.mean(world[part, ankle]), positions[part, ankle].mean(axis=0)
            moved = rot.mul(turn, rot.inv(world[part, ankle]))
            share = _share(stop - start, motion.rate)[:, None]
            for i in mine:
                there = place + rot.mul_vec(moved, markers[part, i] - positions[part, ankle])
                still = np.nanmean(there, axis=0) if np.isfinite(there).any() else there[0]
                held[part, i] = (1 - share) * markers[part, i] + share * still
            for i in malleoli:  # the shank turns about them
                if np.isfinite(markers[part, i]).any():
                    still = np.nanmean(markers[part, i], axis=0)
                    held[part, i] = (1 - share) * markers[part, i] + share * still
    return held, stances


def _ends(model: MarkerModel) -> list[int]:
    """Ankle and toe of the left foot, then of the right."""
    feet = [model.figure.skeleton.subtree(ankle) for ankle in model.figure.roles.ankle]
    return [int(j) for foot in feet for j in (foot[0], foot[-1])]


def _is_still(points: Array, frames: int) -> NDArray[np.bool_]:
    """(F, n) whether points (F, n, 3) are near where they were, and will be, so many frames away."""
    still = np.ones(points.shape[:2], bool)
    for step in {min(frames, len(points) - 1), min((frames + 1) // 2, len(points) - 1)} - {0}:
        near = np.linalg.norm(points[step:] - points[:-step], axis=-1) < STILL
        still[step:] &= near
        still[:-step] &= near
    return still


def _stands(flags: NDArray[np.bool_], ends: Array) -> list[tuple[int, int]]:
    """Runs of set flags, cut where an end of the foot (F, 2, 3) has crept away from its place."""
    found = []
    for start, stop in find_runs(flags):
        begun = start
        for f in range(start, stop):
            if np.linalg.norm(ends[f] - ends[begun], axis=-1).max() > DRIFT:
                found.append((begun, f))
                begun = f
        found.append((begun, stop))
    return found


def _share(frames: int, rate: float) -> Array:
    """How far a foot is held in each frame of a stance: it begins and ends gently."""
    edge = np.minimum(np.arange(frames) + 1.0, np.arange(frames, 0, -1.0)) / (FADE * rate)
    x = np.clip(edge, 0.0, 1.0)
    return np.asarray(x * x * (3 - 2 * x))
