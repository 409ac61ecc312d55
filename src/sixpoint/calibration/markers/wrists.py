"""Wrists with a bar: two markers on a stick across the back of the wrist, not on its styloids."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.anthropometry import MEAN_STATURE, segments_of_stature
from sixpoint.calibration.markers.places import Places

Array = NDArray[np.float64]

# All of a person of 1.75 m, in metres.
BAR = 0.09  # farther apart than this no styloids are: 5.5 cm and two markers
LONGEST = 0.20  # farther apart than this no bar is: one of the labels is elsewhere
STEADY = 0.01  # the middle half of all distances between two ends of a stick differ by less
ON_FOREARM = 0.03  # and those from the elbow's marker of what the forearm carries
UNDER = 0.03  # the wrist's centre is this far under the bar: half of 4 cm, and the marker's height
STD = (0.008, 0.010, 0.008)
ALONG = 0.5  # of its length, by which the ends of a bar differ in their distance from the elbow at most
ANYWHERE = 0.3  # how far a marker with another's label may be from where that is expected


def place_wrist_bars(places: Places, observed: Array, stature: float) -> Places:
    """Places with the markers of a wrist on a bar where they are too far apart for styloids.

    The centre of the wrist lies under the middle of the bar, across the forearm; how long the bar is, the
    recording says. Where the two are on no stick across the forearm (too far apart, not steadily so, or
    along it), one has the wrong label: the one that is not a forearm away from the elbow. If its distance
    from there is steady, it is anywhere on the forearm; else it is off in most poses, which the fit can tell.

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
        apart = apart[np.isfinite(apart)]
        length, spread = _middle(apart) if len(apart) else (0.0, 0.0)
        if length <= BAR * scale:
            continue
        reach = _distances_to_elbow(places, observed, side, columns)
        across = reach is None or np.ptp(reach[0]) < ALONG * length
        if length < LONGEST * scale and spread < STEADY * scale and across:
            offsets[columns, 0] = outward * UNDER * scale
            offsets[columns, 2] = length / 2, -length / 2
            std[columns] = np.array(STD) * scale
        elif reach is not None:
            forearm = segments_of_stature(stature)["forearm"]
            wrong = int(np.argmax(np.abs(reach[0] - forearm)))
            if reach[1][wrong] < ON_FOREARM * scale:
                std[columns[wrong]] = ANYWHERE * scale
    return replace(places, offsets=offsets, std=std)


def _middle(values: Array) -> tuple[Array, Array]:
    """Medians of the columns of values, and the ranges of the middle half of them."""
    low, middle, high = np.quantile(values, (0.25, 0.5, 0.75), axis=0)
    return middle, high - low


def _distances_to_elbow(
    places: Places, observed: Array, side: str, columns: list[int]
) -> tuple[Array, Array] | None:
    """(2,) how far two markers are from the elbow's, and how steadily [m]; None if never seen together."""
    elbow = places.columns(f"{side}_elbow_lateral")
    if not elbow:
        return None
    apart = np.linalg.norm(observed[:, columns] - observed[:, elbow[:1]], axis=2)
    apart = apart[np.isfinite(apart).all(axis=1)]
    return _middle(apart) if len(apart) else None
