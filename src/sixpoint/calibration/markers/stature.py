"""How tall a person is, from distances between markers that hardly change; whether the unit can be right."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.anthropometry import MEAN_STATURE, segments_of_stature
from sixpoint.body.markers.roles import MarkerRoles
from sixpoint.calibration.markers.kinematics import SEGMENTS, Kinematics
from sixpoint.calibration.markers.places import place_markers
from sixpoint.errors import TargetError

Array = NDArray[np.float64]

SHORTEST = 0.12  # distances that count [m], on a person of 1.75 m
SURE = 0.03  # markers whose place is known better than this make the distances [m]
STATURES = (0.6, 2.5)  # of whom this figure may be [m]
UNITS = {1e-3: "millimetres", 1e-2: "centimetres", 0.0254: "inches", 1e3: "kilometres"}
MOST_FRAMES = 300


def estimate_stature(found: MarkerRoles, observed: Array, kinematics: Kinematics) -> float:
    """Stature [m] of the person whose proportions fit best; a first guess.

    Args:
        found: Roles of the markers, in the order of the columns.
        observed: (F, M, 3) [m], NaN where not seen.
        kinematics: The figure.

    Raises:
        TargetError: No two markers were seen together, or nobody is that tall: the unit is wrong.
    """
    places = place_markers(found, MEAN_STATURE, kinematics)
    lengths = np.array([segments_of_stature(MEAN_STATURE)[name] for name in SEGMENTS])
    rest = kinematics.rest(lengths)[places.carriers] + places.reach @ lengths + places.offsets
    sure = np.flatnonzero(places.std.max(axis=1) < SURE)
    some = observed[:: max(1, len(observed) // MOST_FRAMES)]
    ratios, weights = [], []
    for a, b in combinations(sure, 2):
        bone = float(np.linalg.norm(rest[a] - rest[b]))
        if bone < SHORTEST or not _rigid(kinematics, int(places.carriers[a]), int(places.carriers[b])):
            continue
        apart = np.linalg.norm(some[:, a] - some[:, b], axis=1)
        if np.isfinite(apart).any():
            ratios.append(float(np.nanmedian(apart)) / bone)
            weights.append(bone)
    if not ratios:
        raise TargetError(
            "no two markers of one segment were ever seen together, so the size of the person is unknown"
        )
    order = np.argsort(ratios)
    half = np.searchsorted(np.cumsum(np.array(weights)[order]), 0.5 * sum(weights))
    stature = MEAN_STATURE * float(np.array(ratios)[order][half])
    if not STATURES[0] <= stature <= STATURES[1]:
        fits = [name for unit, name in UNITS.items() if STATURES[0] <= stature * unit <= STATURES[1]]
        hint = f"; if the file is in {' or '.join(fits)}, say so with --unit / unit=" if fits else ""
        expected = f"expected {STATURES[0]} to {STATURES[1]} m"
        raise TargetError(f"these markers would be a person {stature:.4g} m tall; {expected}{hint}")
    return stature


def _rigid(kinematics: Kinematics, a: int, b: int) -> bool:
    """Whether markers of two joints keep about their distance: on one segment, or on neighbours' ends."""
    parents = kinematics.skeleton.parents
    return a == b or int(parents[a]) == b or int(parents[b]) == a
