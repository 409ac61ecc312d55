"""The pelvis: hip centres by regression from its own sizes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.calibration.markers.places import Places, pelvic_tilt

Array = NDArray[np.float64]


def regress_pelvis(places: Places, observed: Array) -> tuple[Array, float | None]:
    """Expected offsets of all markers (M, 3), with those of the pelvis by regression; and the hips' distance.

    Without both anterior spines and something behind them, both stay as they were: None for the distance.

    Args:
        places: Where markers are expected by proportion.
        observed: (F, M, 3) [m], NaN where not seen.

    Reference: Harrington et al. 2007, J. Biomech. 40, 595, table 3: with the pelvis' depth and width in
    millimetres a hip is 0.24 depth + 9.9 behind, 0.30 width + 10.9 below and 0.33 width + 7.3 beside the
    middle of the anterior spines, in the plane of the spines.
    """
    offsets = places.offsets.copy()
    front = [places.columns("l_asis"), places.columns("r_asis")]
    back = places.columns("l_psis", "r_psis") if len(places.columns("l_psis", "r_psis")) == 2 else []
    back = back or places.columns("sacrum")
    if not (front[0] and front[1] and back):
        return offsets, None
    left, right = observed[:, front[0][0]], observed[:, front[1][0]]
    behind = observed[:, back].mean(axis=1)
    width = np.linalg.norm(left - right, axis=1)
    depth = np.linalg.norm(0.5 * (left + right) - behind, axis=1)
    if not (np.isfinite(width).any() and np.isfinite(depth).any()):
        return offsets, None
    wide, deep = float(np.nanmedian(width)), float(np.nanmedian(depth))
    ahead, above = 0.24 * deep + 0.0099, 0.30 * wide + 0.0109
    for side, sign in (("l", 1.0), ("r", -1.0)):
        offsets[places.columns(f"{side}_asis")] = _tilted(sign * wide / 2, above, ahead)
    behind_width = _median_distance(observed, back) if len(back) == 2 else 0.0
    for role, sign in (("l_psis", 1.0), ("r_psis", -1.0), ("sacrum", 0.0)):
        offsets[places.columns(role)] = _tilted(sign * behind_width / 2, above, ahead - deep)
    return offsets, 2.0 * (0.33 * wide + 0.0073)


def _tilted(side: float, up: float, forward: float) -> Array:
    """From the plane of the spines to the neutral pose, where their front is lower."""
    c, s = np.cos(pelvic_tilt()), np.sin(pelvic_tilt())
    return np.array([side, c * up - s * forward, c * forward + s * up])


def _median_distance(observed: Array, columns: list[int]) -> float:
    apart = np.linalg.norm(observed[:, columns[0]] - observed[:, columns[1]], axis=1)
    return float(np.nanmedian(apart)) if np.isfinite(apart).any() else 0.0
