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
PAIRS = (
    "knee_lateral",
    "ankle_lateral",
    "heel",
    "knee_centre",
    "ankle_centre",
    "acromion",
    "shoulder_centre",
)
CROSSED = 0.02  # a pair that lies this far the wrong way round, in the median, is swapped [m]


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
    swapped = []
    for pair in PAIRS:
        columns = [places.columns(f"{side}_{pair}") for side in ("l", "r")]
        if columns[0] and columns[1]:
            apart = local[:, columns[0][0], 0] - local[:, columns[1][0], 0]
            if np.isfinite(apart).any() and np.nanmedian(apart) < -CROSSED:
                swapped.append(f"{places.names[columns[0][0]]} and {places.names[columns[1][0]]}")
    if swapped:
        raise TargetError(
            f"{name}: these markers lie on the other side of the body most of the time, and seem to be "
            f"swapped: {listed(swapped)}; swap their labels, or name them in a layout"
        )


def _is_mirrored(places: Places, local: Array) -> bool:
    """Whether head and thorax lie below the pelvis, or where these are missing, the legs above."""
    upper = places.on("thorax", "head", "l_clavicle", "r_clavicle")
    lower = places.on(*(f"{side}_{part}" for side in ("l", "r") for part in ("shank", "foot")))
    heights = [_median_height(local, columns) for columns in (upper, lower)]
    if upper and np.isfinite(heights[0]):
        return bool(heights[0] < 0)
    return bool(lower) and bool(heights[1] > 0)


def _median_height(local: Array, columns: list[int]) -> float:
    heights = local[:, columns, 1]
    return float(np.nanmedian(heights)) if np.isfinite(heights).any() else np.nan
