"""Calibrate six trackers: from their frames to mounts and lengths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sixpoint.body.figure import Figure
from sixpoint.body.targets import EFFECTORS, Targets
from sixpoint.calibration.estimate import Estimate
from sixpoint.calibration.legs import LegFit, fit_legs
from sixpoint.calibration.lengths import compute_stature, measure_lengths
from sixpoint.calibration.model import Body
from sixpoint.calibration.mounts import Calibration, Mount
from sixpoint.calibration.pivots import find_pivots
from sixpoint.calibration.standing import UP, Posture, Standing, compute_heading, find_standing
from sixpoint.calibration.tracks import Tracks
from sixpoint.errors import TargetError

Array = NDArray[np.float64]


GOOD = 0.01  # an offset that is known to this standard deviation is observed [m]
USELESS = 0.05  # one that is known less well than this is not handed out [m]
POSTURE_STD = np.radians(5.0)  # how exactly a person holds a pose [rad]
HEAD_RATIO = 0.91  # height of a head tracker over the stature, roughly
MOVES = {
    0: "circle both feet, bow and sway on straight legs",
    1: "nod, shake and tilt the head with the chest still",
    2: "circle the hand with the elbow at the waist",
    3: "circle the hand with the elbow at the waist",
    4: "lift the straight leg, hold it and circle the foot widely",
    5: "lift the straight leg, hold it and circle the foot widely",
}


def calibrate(
    targets: Targets,
    figure: Figure | None = None,
    *,
    stature: float | None = None,
    posture: Posture | None = None,
    floor: float | None = 0.0,
) -> Calibration:
    """Find mounts and lengths from a still pose and about ten seconds of movement.

    Args:
        targets: Six trackers with rotations, or, without rotations, six joints (then lengths only).
        figure: The person's own figure where the lengths are known.
        stature: The person's stature where it is known [m].
        posture: The pose that was held, "neutral" or "t"; by default it is told from the wrists' span.
        floor: Height of the floor in the trackers' world [m]; None where it is not known.

    Raises:
        TargetError: Too few frames, or no standing pose where lengths have to be measured.
    """
    tracks = Tracks.from_targets(targets)
    standing = find_standing(tracks, posture)
    if standing is None and figure is None:
        raise TargetError(
            "no still standing pose found: stand upright and still for two seconds with all six trackers "
            "seen, arms hanging or stretched to the sides (or give a figure, if only mounts are sought)"
        )
    if targets.rotations is None:
        return _joints_only(tracks, standing, figure, stature)
    body = _prior_body(standing, figure, stature)
    mounts = np.full((6, 3, 3), np.nan) if standing is None else standing.mounts
    estimates = _pivots(tracks, standing, mounts, body)
    legs: LegFit | None = None
    if standing is not None:
        estimates = _with_heights(estimates, standing, body, floor)
        standing = replace(standing, heading=compute_heading(_standing_joints(standing, estimates)))
        mounts = standing.mounts
        if figure is None and stature is None and estimates[1].std < USELESS:
            joints = _standing_joints(standing, estimates)
            body = Body.from_stature(compute_stature(joints[1, 1] - joints[4:, 1].mean()), found=True)
        if np.isfinite(mounts[0]).all() and max(estimates[4].std, estimates[5].std) < USELESS:
            legs = fit_legs(tracks, standing, mounts[0], (estimates[4], estimates[5]), body)
    if legs is not None:
        estimates = [legs.pelvis, *estimates[1:4], *legs.ankles]
    found = {name: _mount(e, m) for name, e, m in zip(EFFECTORS, estimates, mounts, strict=True)}
    unobserved = _unobserved(found, standing, figure)
    if figure is not None:
        return Calibration(body.stature, {}, {}, found, unobserved, figure)
    return _with_lengths(tracks, standing, found, unobserved, stature, legs)


def _with_lengths(
    tracks: Tracks,
    standing: Standing | None,
    found: dict[str, Mount],
    unobserved: dict[str, str],
    stature: float | None,
    legs: LegFit | None,
) -> Calibration:
    """Measure lengths between the joints, as far as the offsets are known."""
    assert standing is not None
    offsets = np.array([found[name].offset for name in EFFECTORS])
    missing = np.isnan(offsets).any(axis=1)
    unknown = [name for name, gone in zip(EFFECTORS, missing, strict=True) if gone]
    if unknown:
        unobserved = unobserved | {
            "lengths": f"offsets of {', '.join(unknown)} are unknown: their trackers stand in for the joints"
        }
    filled = np.where(missing[:, None], 0.0, offsets)
    joints = standing.positions - np.einsum("kij,kj->ki", _filled(standing.turns), filled)
    joints[2:4][missing[2:4]] = np.nan  # arms are rather proportions
    moved = tracks.joints(offsets)
    span = _largest(np.linalg.norm(moved[:, 2] - moved[:, 3], axis=1))
    lengths = measure_lengths(joints, standing.posture, span, stature, None if legs is None else legs.length)
    return Calibration(lengths.stature, lengths.segments, lengths.sources, found, unobserved)


def _filled(turns: Array) -> Array:
    """Rotations with zeros where they are unknown."""
    return np.where(np.isfinite(turns), turns, 0.0)


def _joints_only(
    tracks: Tracks, standing: Standing | None, figure: Figure | None, stature: float | None
) -> Calibration:
    """Lengths from six joints; nothing is known of mounts."""
    nothing = {name: Mount(np.full(3, np.nan), np.full(4, np.nan)) for name in EFFECTORS}
    why = {"mounts": "the trackers have no rotations: their points are taken as the joints"}
    if figure is not None or standing is None:
        assert figure is not None
        return Calibration(Body.from_figure(figure).stature, {}, {}, nothing, why, figure)
    span = _largest(np.linalg.norm(tracks.positions[:, 2] - tracks.positions[:, 3], axis=1))
    lengths = measure_lengths(standing.positions, standing.posture, span, stature)
    return Calibration(lengths.stature, lengths.segments, lengths.sources, nothing, why)


def _largest(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.max()) if len(known) else float("nan")


def _prior_body(standing: Standing | None, figure: Figure | None, stature: float | None) -> Body:
    """What is known before anything is measured."""
    if figure is not None:
        return Body.from_figure(figure)
    if stature is not None:
        return Body.from_stature(stature, found=False)
    assert standing is not None
    height = float(standing.positions[1, 1] - standing.positions[4:, 1].mean()) / (HEAD_RATIO - 0.04)
    return Body.from_stature(float(np.clip(height, 0.4, 2.8)), found=True)


def _pivots(tracks: Tracks, standing: Standing | None, mounts: Array, body: Body) -> list[Estimate]:
    estimates = [Estimate.nothing()]
    site = body.figure.head_offset
    for k, rest in body.rests(mounts).items():
        known = bool(np.isfinite(mounts[k]).all())
        axis = mounts[k].T @ UP if known else None
        ground = _ground(tracks, standing, k) if k >= 4 else None
        points, turns = tracks.positions[:, k], tracks.turns[:, k]
        if k == 1 and site.any():  # a head that is an end site is not where it turns
            points = points - turns @ (mounts[1].T @ site if known else np.full(3, np.nan))
        estimates.append(find_pivots(points, turns, tracks.rotations[:, k], tracks.rate, axis, rest, ground))
    estimates[1] = estimates[1].blurred(body.neck_std)
    return estimates


def _ground(tracks: Tracks, standing: Standing | None, k: int) -> tuple[Array, Array]:
    """Position and rotation of a foot tracker while its foot stands: in the still pose, else lowest."""
    if standing is not None:
        return standing.positions[k], standing.turns[k]
    height = np.where(np.isfinite(tracks.turns[:, k]).all(axis=(1, 2)), tracks.positions[:, k, 1], np.inf)
    lowest = int(np.argmin(height))
    return tracks.positions[lowest, k], tracks.turns[lowest, k]


def _with_heights(
    estimates: list[Estimate], standing: Standing, body: Body, floor: float | None
) -> list[Estimate]:
    """Add what the heights of a standing person tell of the offsets: one direction of each."""
    if floor is None:
        return estimates
    heights = body.heights(standing.posture) + floor
    out = [estimates[0]]
    for k in range(1, 6):
        std = body.height_std[k // 2]
        if np.isfinite(std) and np.isfinite(standing.turns[k]).all():
            up = standing.turns[k].T @ UP
            value = standing.positions[k, 1] - heights[k]
            height = Estimate(value * up, np.outer(up, up) / std**2)
            out.append(Estimate.fuse([estimates[k], height]))
        else:
            out.append(estimates[k])
    return out


def _known(estimates: list[Estimate]) -> Array:
    return np.array([e.offset if e.std < USELESS else np.zeros(3) for e in estimates])


def _standing_joints(standing: Standing, estimates: list[Estimate]) -> Array:
    """(6, 3) joints in the still pose [m], trackers where an offset is not known."""
    return np.asarray(
        standing.positions - np.einsum("kij,kj->ki", _filled(standing.turns), _known(estimates))
    )


def _mount(estimate: Estimate, mount: Array) -> Mount:
    known = bool(np.isfinite(mount).all())
    rotation = Rotation.from_matrix(mount).as_quat() if known else np.full(4, np.nan)
    useful = estimate.std < USELESS
    return Mount(
        estimate.offset if useful else np.full(3, np.nan),
        np.asarray(rotation, float),
        estimate.std,
        POSTURE_STD if known else float("inf"),
    )


def _unobserved(mounts: dict[str, Mount], standing: Standing | None, figure: Figure | None) -> dict[str, str]:
    out = {}
    for k, (name, mount) in enumerate(mounts.items()):
        if mount.std > GOOD:
            known = f"known to {100 * mount.std:.1f} cm only" if mount.std < USELESS else "not found"
            needs = ", and give a figure, as necks and hips differ" if figure is None and k < 2 else ""
            out[f"{name} offset"] = f"{known}: {MOVES[k]}{needs}"
        if not np.isfinite(mount.rotation_std):
            why = "no still standing pose" if standing is None else "no rotations in the still standing pose"
            out[f"{name} rotation"] = f"{why}: stand still for two seconds, arms hanging or stretched"
    return out
