"""Labelled markers -> the person: segment lengths, and where each marker sits.

Proportions and anatomy say where everything is expected; from there lengths, offsets and the poses of some
frames are fitted together (``problem``). Joints that the movement turns enough are thereby found from it, and
what it does not tell stays at the expectation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.markers.model import PARTS, MarkerModel
from sixpoint.body.markers.recording import Markers
from sixpoint.body.markers.roles import Layout
from sixpoint.calibration.markers.checks import check_pelvis, check_sides
from sixpoint.calibration.markers.expectations import expect_lengths, moving_std, standing_std
from sixpoint.calibration.markers.frames import choose_frames
from sixpoint.calibration.markers.joint_starts import improve_start
from sixpoint.calibration.markers.kinematics import SEGMENTS, Kinematics
from sixpoint.calibration.markers.pelvis import regress_pelvis
from sixpoint.calibration.markers.places import Places, place_markers
from sixpoint.calibration.markers.problem import Problem, State, solve_all, solve_poses
from sixpoint.calibration.markers.recordings import read_recordings
from sixpoint.calibration.markers.stature import estimate_stature
from sixpoint.calibration.markers.wrists import place_wrist_bars
from sixpoint.errors import TargetError

Array = NDArray[np.float64]

FRAMES, STATIC_FRAMES = 100, 10
SIGMAS = (0.02, 0.01)  # of a usual marker around its place, in turn [m]; then what is found
SIGMA_RANGE = (0.007, 0.012)  # residuals do not show what lengths and places have taken from sliding skin
ROUGH = 1e-3  # gain of a step, as a share of the cost, at which a first round ends
UNFIT = 2.5  # frames whose residual is this many times the median's are left out

DOING = "calibrating markers"
Progress = Callable[[str, int, int], None]


def _ignore(what: str, done: int, total: int) -> None:
    """Report nothing."""


def calibrate_markers(
    markers: Markers,
    static: Markers | None = None,
    layout: Layout | None = None,
    *,
    progress: Progress = _ignore,
) -> MarkerModel:
    """Find a person's lengths, and where the markers sit, from a recording of labelled markers.

    The more joints a movement bends, the more of the lengths comes from it; a single frame is enough where
    proportions will do.

    Args:
        markers: The movement; it may have gaps.
        static: A trial of the same person standing still, where there is one. It may have more markers, such
            as the medial ones; they then belong to the model as well.
        layout: What the labels mean where they are of no known set; see ``find_marker_roles``.
        progress: Told (what is done, steps done, steps in total).

    Returns:
        A built-in figure with the markers on it. ``missing`` names parts of the body without markers; their
        lengths follow from the rest by proportion.

    Raises:
        TargetError: No label is known or none of the markers is seen; the static trial has other labels; the
            pelvis is not determined; left and right are mixed up; or nobody is that tall, since the unit is
            wrong.
    """
    kinematics, steps = Kinematics(), len(SIGMAS) + 3
    progress(DOING, 0, steps)
    recordings = [markers] if static is None else [static, markers]
    found, observed = read_recordings(recordings, layout)
    together = np.concatenate(observed)
    try:
        stature = estimate_stature(found, together, kinematics)
    except TargetError as error:
        raise TargetError(f"{' and '.join(part.name for part in recordings)}: {error}") from None
    places = place_wrist_bars(place_markers(found, stature, kinematics), together, stature)
    offsets, hips = regress_pelvis(places, together)
    places = replace(places, offsets=offsets)
    expected, information = expect_lengths(stature, hips)
    start = State(np.exp(expected), offsets.copy(), np.zeros((0, kinematics.size)))
    parts = [
        choose_frames(kinematics, places, start, part, FRAMES if part is observed[-1] else STATIC_FRAMES)
        for part in observed
    ]
    frames, poses = (np.concatenate(rows) for rows in zip(*parts, strict=True))
    check_pelvis(places, together, poses, markers.name)
    check_sides(kinematics, places, frames, poses, markers.name)
    std = moving_std(kinematics, len(parts[-1][0]))
    if static is not None:
        std = np.concatenate([standing_std(kinematics, len(parts[0][0])), std])
    progress(DOING, 1, steps)
    state = improve_start(kinematics, places, replace(start, poses=poses), frames)
    problem = Problem(kinematics, places, frames, expected, information, std, SIGMAS[0])
    state = solve_poses(problem, state)
    for step, sigma in enumerate(SIGMAS):
        progress(DOING, 2 + step, steps)
        problem.sigma = sigma
        state = solve_all(problem, state, tolerance=ROUGH)
        problem, state = _without_unfit(problem, state)
    progress(DOING, steps - 1, steps)
    spread = _spread(problem, state)
    problem.sigma = float(np.clip(np.sqrt(np.nanmean(spread**2) / 3.0), *SIGMA_RANGE))
    state = solve_all(problem, state)
    progress(DOING, steps, steps)
    segments = dict(zip(SEGMENTS, state.lengths.tolist(), strict=True))
    return MarkerModel(
        Figure.from_segments(limits=None, **segments),
        places.names,
        places.carriers,
        state.offsets + places.reach @ state.lengths,
        _spread(problem, state),
        _missing(places),
    )


# --- details -------------------------------------------------------------------------------------


def _without_unfit(problem: Problem, state: State) -> tuple[Problem, State]:
    """Without the frames that stayed far from their markers: they started wrong, or labels were swapped."""
    error = np.sqrt(np.nanmean(np.sum(problem.residuals(state) ** 2, axis=2), axis=1))
    kept = error <= UNFIT * np.median(error) + 0.005
    if kept.all():
        return problem, state
    pose_std = np.broadcast_to(problem.pose_std, state.poses.shape)[kept]
    fewer = replace(problem, observed=problem.observed[kept], pose_std=pose_std)
    return fewer, replace(state, poses=state.poses[kept])


def _spread(problem: Problem, state: State) -> Array:
    """(M,) root mean square distances of the markers from their places [m]; NaN where not seen."""
    square = np.sum(problem.residuals(state) ** 2, axis=2)
    count = problem.seen.sum(axis=0)
    mean = np.nansum(square, axis=0) / np.maximum(count, 1)
    return np.asarray(np.where(count > 0, np.sqrt(mean), np.nan))


def _missing(places: Places) -> tuple[str, ...]:
    """Parts of the body without markers."""
    segments = {
        "head": ("head",),
        "trunk": ("thorax", "spine", "l_clavicle", "r_clavicle"),
        **{f"{s}_arm": (f"{s}_upper_arm", f"{s}_forearm", f"{s}_hand") for s in ("l", "r")},
        **{f"{s}_leg": (f"{s}_thigh", f"{s}_shank", f"{s}_foot", f"{s}_toes") for s in ("l", "r")},
    }
    shown = {part for part in PARTS if places.on(*segments[part])}
    if places.columns("l_shoulder_centre", "r_shoulder_centre"):
        shown.add("trunk")
    return tuple(part for part in PARTS if part not in shown)
