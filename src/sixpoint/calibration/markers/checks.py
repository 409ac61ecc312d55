"""What a recording must have before a person can be calibrated from it; each complaint says what would do."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.calibration.markers.kinematics import Kinematics, exponential
from sixpoint.calibration.markers.places import Places
from sixpoint.errors import TargetError, listed

Array = NDArray[np.float64]

ENOUGH = (
    "both anterior iliac spines and a posterior one or the sacrum, or both hips with the shoulders or neck"
)
PAIRS = ("asis", "knee_lateral", "knee_centre", "acromion", "shoulder_centre")
CROSSED = 0.02  # a pair that lies this far the wrong way round, in the median, is swapped [m]
ENDS = (  # pairs that may cross for long, and what each keeps its distance from
    ("ankle_lateral", "knee_lateral"),
    ("ankle_centre", "knee_centre"),
    ("heel", "ankle_lateral"),
    ("toe", "heel"),
    ("wrist_radial", "elbow_lateral"),
    ("wrist_ulnar", "elbow_lateral"),
    ("wrist_centre", "elbow_centre"),
)
VARYING = 0.03  # of distances on one segment [m]
FIRMER = 0.4  # the other side's distance varies less than this share


def check_pelvis(places: Places, observed: Array, poses: Array, name: str) -> None:
    """Some frame must determine the pelvis, so that there are poses (F, D).

    Raises:
        TargetError: None does; names the pelvis' markers and how often they are seen.
    """
    if len(poses):
        return
    pelvis = places.on("pelvis")
    share = np.isfinite(observed[..., 0]).mean(axis=0)
    there = [f"{places.names[k]} ({places.roles[k]}, seen in {share[k]:.0%} of the frames)" for k in pelvis]
    raise TargetError(
        f"{name}: in no frame do three markers that are not in line determine the pelvis; "
        f"it has {listed(there) if there else 'no markers'}; enough would be {ENOUGH}, seen together"
    )


def check_sides(kinematics: Kinematics, places: Places, observed: Array, poses: Array, name: str) -> None:
    """Left must be left: mirrored recordings and swapped pairs are named.

    Args:
        kinematics: The figure.
        places: Its markers.
        observed: (F, M, 3) [m].
        poses: (F, D) that they were started from; the pelvis is laid through its markers.
        name: Of the recording.

    Raises:
        TargetError: The recording is mirrored, or a pair is swapped.
    """
    turned = exponential(poses[:, kinematics.dofs("humanoid_root")])
    local = np.einsum("fyx,fmy->fmx", turned, observed - poses[:, None, :3])
    if _is_mirrored(places, local):
        raise TargetError(
            f"{name}: left and right are mirrored: by the pelvis' labels the head is where the feet are; "
            "swap the labels of both sides, or check the axes of the file"
        )
    swapped = _crossed_pairs(places, local) or _loose_pairs(places, local)
    if swapped:
        raise TargetError(
            f"{name}: these markers move with the other side of the body, and seem to be swapped: "
            f"{listed(swapped)}; swap their labels, or name them in a layout"
        )


def _is_mirrored(places: Places, local: Array) -> bool:
    """Whether head and thorax lie below the pelvis, or where these are missing, the legs above."""
    upper = places.on("thorax", "head", "l_clavicle", "r_clavicle")
    lower = places.on(*(f"{side}_{part}" for side in ("l", "r") for part in ("shank", "foot")))
    heights = [_median_height(local, columns) for columns in (upper, lower)]
    if upper and np.isfinite(heights[0]):
        return bool(heights[0] < 0)
    return bool(lower) and bool(heights[1] > 0)


def _crossed_pairs(places: Places, local: Array) -> list[str]:
    """Pairs whose left one is on the right of the pelvis most of the time."""
    found = []
    for role in PAIRS:
        pair = _pair(places, role)
        if pair is not None:
            apart = local[:, pair[0], 0] - local[:, pair[1], 0]
            if np.isfinite(apart).any() and np.nanmedian(apart) < -CROSSED:
                found.append(f"{places.names[pair[0]]} and {places.names[pair[1]]}")
    return found


def _loose_pairs(places: Places, local: Array) -> list[str]:
    """Pairs that keep their distance from the other side's knee or elbow, and not from their own."""
    found: dict[str, str] = {}
    for role, firm in ENDS:
        ends, near = _pair(places, role), _pair(places, firm)
        if ends is None or near is None or firm in found:
            continue
        apart = np.linalg.norm(local[:, list(ends), None] - local[:, None, list(near)], axis=3)
        both = apart[np.isfinite(apart).all(axis=(1, 2))]
        if len(both) < 3:
            continue
        varying = both.std(axis=0)
        own, other = varying.diagonal().mean(), varying[[0, 1], [1, 0]].mean()
        if own > VARYING and other < FIRMER * own:
            found[role] = f"{places.names[ends[0]]} and {places.names[ends[1]]}"
    return list(found.values())


def _pair(places: Places, role: str) -> tuple[int, int] | None:
    columns = [places.columns(f"{side}_{role}") for side in ("l", "r")]
    return (columns[0][0], columns[1][0]) if columns[0] and columns[1] else None


def _median_height(local: Array, columns: list[int]) -> float:
    heights = local[:, columns, 1]
    return float(np.nanmedian(heights)) if np.isfinite(heights).any() else np.nan
