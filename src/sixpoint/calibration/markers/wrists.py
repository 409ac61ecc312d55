"""Wrists with a bar: two markers on a stick across the back of the wrist, not on its styloids."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.anthropometry import MEAN_STATURE
from sixpoint.calibration.markers.places import Places

Array = NDArray[np.float64]

# All of a person of 1.75 m, in metres.
BAR = 0.09  # farther apart than this no styloids are: 5.5 cm and two markers
UNDER = 0.03  # the wrist's centre is this far under the bar: half of 4 cm, and the marker's height
STD = (0.008, 0.010, 0.008)


def place_wrist_bars(places: Places, observed: Array, stature: float) -> Places:
    """Places with the markers of a wrist on a bar where they are too far apart for styloids.

    The centre of the wrist lies under the middle of the bar, across the forearm; how long the bar is, the
    recording says.

    Args:
        places: Where markers are expected.
        observed: (F, M, 3) [m], NaN where not seen.
        stature: Of the person [m].

    Reference: Vicon, Plug-in Gait: the wrist is half its thickness and the marker's radius from the bar, at
    right angles to bar and forearm. Thickness: ANSUR, Gordon et al. 1989, from breadth and circumference.
    """
    offsets, std, scale = places.offsets.copy(), places.std.copy(), stature / MEAN_STATURE
    for side, outward in (("l", 1.0), ("r", -1.0)):
        pair = [places.columns(f"{side}_wrist_{end}") for end in ("radial", "ulnar")]
        if not (pair[0] and pair[1]):
            continue
        columns = [pair[0][0], pair[1][0]]
        apart = np.linalg.norm(observed[:, columns[0]] - observed[:, columns[1]], axis=1)
        length = float(np.nanmedian(apart)) if np.isfinite(apart).any() else 0.0
        if length > BAR * scale:
            offsets[columns, 0] = outward * UNDER * scale
            offsets[columns, 2] = length / 2, -length / 2
            std[columns] = np.array(STD) * scale
    return replace(places, offsets=offsets, std=std)
