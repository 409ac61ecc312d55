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

from sixpoint.body.anthropometry import segments_of_stature
from sixpoint.body.figure import Figure
from sixpoint.body.marker_model import PARTS, MarkerModel
from sixpoint.body.marker_roles import Layout, find_marker_roles
from sixpoint.body.markers import Markers
from sixpoint.calibration.markers.checks import check_labels, check_pelvis, check_sides
from sixpoint.calibration.markers.frames import choose_frames
from sixpoint.calibration.markers.kinematics import SEGMENTS, Kinematics
from sixpoint.calibration.markers.pelvis import HIP_STD, regress_pelvis
from sixpoint.calibration.markers.places import Places, place_markers
from sixpoint.calibration.markers.problem import INDEPENDENT, Problem, State, solve_all, solve_poses
from sixpoint.calibration.markers.stature import estimate_stature

Array = NDArray[np.float64]

FRAMES, STATIC_FRAMES = 100, 10
SIGMAS = (0.02, 0.01)  # of a marker around its place, in turn [m]; then what is found, within SIGMA_RANGE
SIGMA_RANGE = (0.004, 0.012)
LOOSE = 2.0  # postures of a movement are this many times as wide as the kinematics' priors
UNFIT = 2.5  # frames whose residual is this many times the median's are left out
STATURE_STD = 0.15  # of the logarithm of the first guess
PROPORTION_STD = {  # of the logarithm of each length, the stature apart; NASA 1978 and Drillis & Contini 1966
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
STATIC_STD = {"l_knee": 6, "r_knee": 6, "l_ankle": 8, "r_ankle": 8, "vl5": 8, "vt6": 8, "vc4": 12}  # [deg]

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
        TargetError: No label is known or none of the markers is seen; the pelvis is not determined; left and
            right are mixed up; or nobody is that tall, since the unit is wrong.
    """
    kinematics = Kinematics()
    steps = len(SIGMAS) + 3
    progress("calibrating markers", 0, steps)
    names = tuple(dict.fromkeys([*markers.names, *(static.names if static else ())]))
    found = find_marker_roles(names, layout)
    recordings = [_only(recording, found.roles) for recording in (static, markers) if recording]
    check_labels(markers if static is None else _joined(recordings), found)
    seen = [
        n
        for n in found.roles
        if any(np.isfinite(r.positions[:, r.names.index(n), 0]).any() for r in recordings)
    ]
    found = replace(
        found, roles={n: found.roles[n] for n in seen}, segments={n: found.segments[n] for n in seen}
    )
    observed = [_columns(recording, found.roles) for recording in recordings]
    together = np.concatenate(observed)
    stature = estimate_stature(found, together, kinematics)
    places = place_markers(found, stature, kinematics)
    offsets, hips = regress_pelvis(places, together)
    places = replace(places, offsets=offsets)
    lengths, information = _expect_lengths(stature, hips)
    start = State(np.exp(lengths), places.offsets.copy(), np.zeros((0, kinematics.size)))
    progress("calibrating markers", 1, steps)

    def choose(part: Array, count: int) -> tuple[Array, Array]:
        return choose_frames(kinematics, places, start, part, count)

    frames, poses = choose(observed[-1], FRAMES)
    check_pelvis(places, together, np.isfinite(poses[:, 0]), markers.name)
    std = np.tile(kinematics.std * LOOSE * max(1.0, len(frames) / INDEPENDENT) ** 0.5, (len(frames), 1))
    if static is not None:
        still, still_poses = choose(observed[0], STATIC_FRAMES)
        frames, poses = np.concatenate([still, frames]), np.concatenate([still_poses, poses])
        std = np.concatenate([np.tile(_static_std(kinematics), (len(still), 1)), std])
    check_sides(kinematics, places, frames, poses, markers.name)
    problem = Problem(kinematics, places, frames, lengths, information, std, SIGMAS[0])
    state = solve_poses(problem, replace(start, poses=poses))
    for step, sigma in enumerate(SIGMAS):
        progress("calibrating markers", 2 + step, steps)
        problem.sigma = sigma
        state = solve_all(problem, state)
        problem, state = _without_unfit(problem, state)
    progress("calibrating markers", steps - 1, steps)
    spread = _spread(problem, state)
    problem.sigma = float(np.clip(np.sqrt(np.nanmean(spread**2) / 3.0), *SIGMA_RANGE))
    state = solve_all(problem, state)
    progress("calibrating markers", steps, steps)
    return MarkerModel(
        Figure.from_segments(**dict(zip(SEGMENTS, map(float, state.lengths), strict=True))),
        places.names,
        places.carriers,
        state.offsets + places.reach @ state.lengths,
        _spread(problem, state),
        _missing(places),
    )


# --- details -------------------------------------------------------------------------------------


def _only(recording: Markers, labels: object) -> Markers:
    kept = [name for name in recording.names if name in labels]  # type: ignore[operator]
    return recording.selected(kept) if kept else recording


def _joined(recordings: list[Markers]) -> Markers:
    return recordings[-1]


def _columns(recording: Markers, labels: object) -> Array:
    """(F, M, 3) in the order of the labels; NaN for those that a recording lacks."""
    out = np.full((len(recording), len(labels), 3), np.nan)  # type: ignore[arg-type]
    for k, name in enumerate(labels):  # type: ignore[call-overload]
        if name in recording.names:
            out[:, k] = recording.positions[:, recording.names.index(name)]
    return out


def _expect_lengths(stature: float, hips: float | None) -> tuple[Array, Array]:
    """Logarithms (K,) of the lengths by proportion, and their information (K, K)."""
    by_proportion = segments_of_stature(stature)
    lengths = np.log([by_proportion[name] for name in SEGMENTS])
    std = np.array([PROPORTION_STD[name] for name in SEGMENTS])
    information = np.linalg.inv(np.diag(std**2) + STATURE_STD**2)
    if hips is not None:
        k = SEGMENTS.index("pelvis_width")
        information[k, :] = information[:, k] = 0.0
        information[k, k], lengths[k] = HIP_STD**-2, np.log(hips)
    return lengths, information


def _static_std(kinematics: Kinematics) -> Array:
    std = kinematics.std * LOOSE
    for joint, degrees in STATIC_STD.items():
        std[kinematics.dofs(joint)] = np.radians(degrees)
    return np.asarray(std)


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
    return tuple(part for part in PARTS if not places.on(*segments[part]))
