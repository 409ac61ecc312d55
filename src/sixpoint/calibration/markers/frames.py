"""Which frames of a recording tell most: poses that are far from each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.calibration.markers.kinematics import Kinematics
from sixpoint.calibration.markers.places import Places
from sixpoint.calibration.markers.problem import State
from sixpoint.calibration.markers.starts import start_poses

Array = NDArray[np.float64]

CANDIDATES = 600
FULL = 0.7  # of the markers that a good frame shows: others are taken only where there is nothing better


def choose_frames(
    kinematics: Kinematics, places: Places, start: State, observed: Array, count: int
) -> tuple[Array, Array]:
    """Frames (F, M, 3) of a recording whose poses differ most, and poses (F, D) to start from.

    Both are empty where no frame determines the pelvis.
    """
    some = observed[np.linspace(0, len(observed) - 1, min(len(observed), CANDIDATES)).astype(int)]
    shown = np.isfinite(some[..., 0]).sum(axis=1)
    full = shown >= FULL * np.percentile(shown, 90)
    poses = start_poses(kinematics, places, start.lengths, start.offsets, some)
    usable = np.isfinite(poses[:, 0])
    if (usable & full).any():
        usable &= full
    some, poses = some[usable], poses[usable]
    placed = kinematics.place(start.lengths, poses)
    seen = placed.positions - placed.positions[:, :1]
    features = np.einsum("fyx,fjy->fjx", placed.world[:, 0], seen)
    chosen = spread_rows(features.reshape(len(poses), 3 * len(kinematics.skeleton)), count)
    return some[chosen], poses[chosen]


def spread_rows(features: Array, count: int) -> NDArray[np.int64]:
    """Indices of ``count`` rows (F, N) that are far from each other, in order; the median one is among them.

    Reference: Gonzalez 1985, "Clustering to minimize the maximum intercluster distance".
    """
    if len(features) <= count:
        return np.arange(len(features))
    centre = np.median(features, axis=0)
    chosen = [int(np.argmin(np.sum((features - centre) ** 2, axis=1)))]
    distance = np.full(len(features), np.inf)
    while len(chosen) < count:
        distance = np.minimum(distance, np.sum((features - features[chosen[-1]]) ** 2, axis=1))
        chosen.append(int(np.argmax(distance)))
    return np.sort(np.array(chosen))
