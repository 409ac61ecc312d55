"""Labelled markers -> the person: segment lengths, and where each marker sits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.anthropometry import segments_of_stature
from sixpoint.body.figure import Figure
from sixpoint.body.marker_model import MarkerModel
from sixpoint.body.marker_roles import Layout, find_marker_roles
from sixpoint.body.markers import Markers
from sixpoint.calibration.markers.frames import spread_frames
from sixpoint.calibration.markers.kinematics import SEGMENTS, Kinematics
from sixpoint.calibration.markers.places import place_markers
from sixpoint.calibration.markers.problem import Problem, State, solve_all, solve_poses
from sixpoint.calibration.markers.starts import start_poses
from sixpoint.calibration.markers.stature import estimate_stature

Array = NDArray[np.float64]

FRAMES = 100
CANDIDATES = 500
STATURE_STD = 0.15  # of the logarithm of the first guess
PROPORTION_STD = {
    "foot": 0.05,
    "calf": 0.05,
    "thigh": 0.05,
    "pelvis_length": 0.06,
    "pelvis_width": 0.10,
    "torso_length": 0.06,
    "torso_width": 0.08,
    "neck": 0.10,
    "upper_arm": 0.05,
    "forearm": 0.05,
    "hand": 0.06,
}


def _ignore(what: str, done: int, total: int) -> None:
    pass


def calibrate_markers(
    markers: Markers,
    static: Markers | None = None,
    layout: Layout | None = None,
    *,
    progress: Callable[[str, int, int], None] = _ignore,
) -> MarkerModel:
    """Find a person's lengths and marker places from labelled markers."""
    kinematics = Kinematics()
    found = find_marker_roles(markers.names, layout)
    observed = markers.selected(list(found.roles)).positions
    stature = estimate_stature(found, observed, kinematics)
    places = place_markers(found, stature, kinematics)
    lengths = np.array([segments_of_stature(stature)[name] for name in SEGMENTS])
    some = observed[np.linspace(0, len(observed) - 1, min(len(observed), CANDIDATES)).astype(int)]
    poses = start_poses(kinematics, places, lengths, places.offsets, some)
    usable = np.isfinite(poses[:, 0])
    some, poses = some[usable], poses[usable]
    placed = kinematics.place(lengths, poses)
    features = (
        np.swapaxes(placed.world[:, 0], 1, 2)[:, None]
        @ (placed.positions - placed.positions[:, :1])[..., None]
    )
    chosen = spread_frames(features.reshape(len(poses), -1), FRAMES)
    std = np.array([PROPORTION_STD[name] for name in SEGMENTS])
    information = np.linalg.inv(np.diag(std**2) + STATURE_STD**2)
    problem = Problem(
        kinematics,
        places,
        some[chosen],
        np.log(lengths),
        information,
        kinematics.std * 2.0 * max(1.0, len(chosen) / 25.0) ** 0.5,
        0.02,
    )
    state = State(lengths, places.offsets.copy(), poses[chosen])
    state = solve_poses(problem, state)
    for sigma in (0.02, 0.01):
        problem.sigma = sigma
        state = solve_all(problem, state)
    spread = np.sqrt(np.nanmean(np.sum(problem.residuals(state) ** 2, axis=2), axis=0))
    problem.sigma = float(np.clip(np.sqrt(np.mean(spread**2) / 3), 0.004, 0.01))
    state = solve_all(problem, state)
    spread = np.sqrt(np.nanmean(np.sum(problem.residuals(state) ** 2, axis=2), axis=0))
    figure = Figure.from_segments(**dict(zip(SEGMENTS, map(float, state.lengths), strict=True)))
    return MarkerModel(
        figure, places.names, places.carriers, state.offsets + places.reach @ state.lengths, spread
    )
