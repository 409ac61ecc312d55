"""Which frames of a recording tell most: poses that are far from each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def spread_frames(features: Array, count: int) -> NDArray[np.int64]:
    """Indices of ``count`` rows (F, N) that are far from each other, in order; the first is the median one.

    Reference: Gonzalez 1985, "Clustering to minimize the maximum intercluster distance".
    """
    if len(features) <= count:
        return np.arange(len(features))
    centre = np.median(features, axis=0)
    chosen = [int(np.argmin(np.sum((features - centre) ** 2, axis=1)))]
    distance = np.full(len(features), np.inf)
    while len(chosen) < count:
        distance = np.minimum(distance, np.sum((features - features[chosen[-1]]) ** 2, axis=1))
        chosen.append(int(np.argmax(distance)))
    return np.sort(np.array(chosen))
