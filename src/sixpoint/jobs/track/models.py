"""Who moves: a saved marker model, or one calibrated on the spot; and its markers in a recording."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.dofs import Dofs
from sixpoint.body.limits import Limits
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.markers.recording import Markers
from sixpoint.calibration.markers import calibrate_markers
from sixpoint.errors import TargetError, listed
from sixpoint.formats import load_markers
from sixpoint.jobs.marker_models import load_marker_model
from sixpoint.jobs.progress import Progress, silent
from sixpoint.jobs.track.options import Following
from sixpoint.solvers.tracking.limits import widen_limits

Array = NDArray[np.float64]

log = logging.getLogger("sixpoint")

NEAR = 0.05  # where a marker is still believed on its place [m]
FEWEST = 3
"""A recording with fewer markers of the model says nothing about a body."""


def find_model(markers: Markers, following: Following, progress: Progress = silent) -> MarkerModel:
    """The saved model, or a calibration on the static trial or the recording itself."""
    if following.model is not None:
        model = load_marker_model(following.model)
    else:
        static = None
        if following.static is not None:  # messages name the file as it was given
            static = replace(load_markers(following.static), name=str(following.static))
        model = calibrate_markers(markers, static, following.layout, progress=progress)
    return select_markers(model, following.markers) if following.markers else model


def find_ranges(
    model: MarkerModel, positions: Array, rate: float, following: Following, progress: Progress = silent
) -> tuple[Dofs, dict[str, float]]:
    """What may move and how far, and by how much limits had to be widened: name of a joint -> growth [rad].

    Args:
        model: Who moves.
        positions: (F, M, 3) its markers [m], NaN where one is not seen.
        rate: Frames per second [Hz].
        following: A table of its own is taken as it is.
        progress: Told how far the work is.
    """
    if following.limits_file is not None:
        limits = Limits.load(following.limits_file)
        return model.figure.with_limits(limits).full_dofs(limits), {}
    if not following.limits:
        return model.figure.full_dofs(), {}
    return widen_limits(model, positions, rate, lambda done: progress("finding limits", done, len(positions)))


def select_markers(model: MarkerModel, names: tuple[str, ...]) -> MarkerModel:
    """The model with some of its markers only.

    Raises:
        TargetError: A marker is not in the model (the message lists those that are), or too few are chosen.
    """
    unknown = [name for name in names if name not in model.names]
    if unknown:
        raise TargetError(f"no marker {listed(unknown)} in the model; there are: {listed(model.names)}")
    chosen = [model.names.index(name) for name in dict.fromkeys(names)]
    if len(chosen) < FEWEST:
        raise TargetError(
            f"{listed(names)}: {len(chosen)} of the model's {len(model.names)} markers chosen; following "
            f"needs at least {FEWEST}, three on the pelvis to begin with"
        )
    return MarkerModel(
        model.figure,
        tuple(model.names[k] for k in chosen),
        model.joints[chosen],
        model.offsets[chosen],
        model.spread[chosen],
        model.missing,
    )


def columns_of(model: MarkerModel, markers: Markers) -> Array:
    """(F, M, 3) positions of the model's markers [m], NaN for one that the recording does not have.

    Raises:
        TargetError: The recording has fewer than three of them.
    """
    there = [name for name in model.names if name in markers.names]
    if len(there) < FEWEST:
        raise TargetError(
            f"{markers.name}: only {len(there)} of the model's {len(model.names)} markers are there "
            f"({listed(markers.names)}); following needs {FEWEST}, three on the pelvis to begin with"
        )
    absent = [name for name in model.names if name not in markers.names]
    if absent:
        log.warning("markers of the model that the recording does not have: %s", listed(absent))
    out = np.full((len(markers), len(model.names), 3), np.nan)
    for k, name in enumerate(model.names):
        if name in markers.names:
            out[:, k] = markers.positions[:, markers.index(name)]
    return out


def near_pairs(model: MarkerModel) -> list[tuple[str, str]]:
    """Markers of one segment that are too near to each other for swapped labels to be found."""
    apart = np.linalg.norm(model.offsets[:, None] - model.offsets[None], axis=-1)
    close = (apart < NEAR) & (model.joints[:, None] == model.joints)
    return [(model.names[a], model.names[b]) for a, b in zip(*np.nonzero(np.triu(close, 1)), strict=True)]
