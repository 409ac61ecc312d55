"""Pose a calibrated figure by its markers, every frame for itself: for measuring, not for tracking.

There are no joint limits but the hinges' and no memory; what markers do not tell rests near neutral.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.anthropometry import segments_of_skeleton
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.markers.recording import Markers
from sixpoint.body.markers.roles import Layout, find_marker_roles
from sixpoint.body.motion import Motion
from sixpoint.calibration.markers.kinematics import SEGMENTS, Kinematics
from sixpoint.calibration.markers.places import place_markers
from sixpoint.calibration.markers.problem import Problem, State, solve_poses
from sixpoint.calibration.markers.starts import start_poses
from sixpoint.errors import TargetError

Array = NDArray[np.float64]

CHUNK = 200  # frames at once


@dataclass(frozen=True, eq=False)
class Posed:
    """A recording explained by a model.

    Attributes:
        motion: On the model's figure.
        residuals: (F, M) distances of the markers from their places [m]; NaN where not seen.
        found: (F,) whether a frame's pelvis was determined; others repeat the one before.
    """

    motion: Motion
    residuals: Array
    found: NDArray[np.bool_]

    @property
    def rms(self) -> float:
        """Root mean square of all residuals [m]."""
        return float(np.sqrt(np.nanmean(self.residuals**2)))


def pose_markers(
    model: MarkerModel, markers: Markers, layout: Layout | None = None, *, sigma: float = 0.01
) -> Posed:
    """Pose the figure of a model in every frame of a recording.

    Args:
        model: Made by ``calibrate_markers``.
        markers: A recording with the model's markers, or some of them.
        layout: As for the calibration.
        sigma: Standard deviation of a marker around its place [m].

    Raises:
        TargetError: No frame determines the pelvis.
    """
    kinematics = Kinematics()
    names = [name for name in model.names if name in markers.names]
    rows = [model.names.index(name) for name in names]
    lengths = _lengths(model)
    places = place_markers(find_marker_roles(names, layout), 1.75, kinematics)
    offsets = model.offsets[rows] - places.reach @ lengths
    observed = markers.selected(names).positions
    poses = np.empty((len(observed), kinematics.size))
    residuals = np.full((len(observed), len(model.names)), np.nan)
    for start in range(0, len(observed), CHUNK):
        part = slice(start, start + CHUNK)
        first = start_poses(kinematics, places, lengths, offsets, observed[part])
        usable = np.isfinite(first[:, 0])
        poses[part] = first
        if not usable.any():
            continue
        flat = np.zeros(len(lengths))
        problem = Problem(
            kinematics, places, observed[part][usable], flat, np.diag(flat), 2.0 * kinematics.std, sigma
        )
        state = solve_poses(problem, State(lengths, offsets, first[usable]))
        poses[np.arange(len(poses))[part][usable]] = state.poses
        away = np.linalg.norm(problem.residuals(state), axis=2)
        index = np.arange(len(poses))[part][usable]
        residuals[index[:, None], np.array(rows)] = away
    found = np.isfinite(poses[:, 0])
    if not found.any():
        raise TargetError("in no frame are three markers of the pelvis seen together")
    nearest = np.maximum.accumulate(np.where(found, np.arange(len(poses)), np.argmax(found)))
    return Posed(_motion(model, kinematics, poses[nearest], markers), residuals, found)


def _lengths(model: MarkerModel) -> Array:
    return np.array([segments_of_skeleton(model.figure.skeleton)[name] for name in SEGMENTS])


def _motion(model: MarkerModel, kinematics: Kinematics, poses: Array, markers: Markers) -> Motion:
    world = kinematics.place(_lengths(model), poses).world
    parents = kinematics.skeleton.parents
    local = world.copy()
    local[:, 1:] = np.swapaxes(world[:, parents[1:]], 2, 3) @ world[:, 1:]
    turns = rot.from_axes(local[..., 0], local[..., 1], local[..., 2])
    return model.figure.compute_motion(turns, poses[:, :3], markers.rate, name=markers.name)
