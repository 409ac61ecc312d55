"""The rate of a table from its column of times."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def rate_of_times(times: NDArray[np.float64]) -> float | None:
    """Frames per second [Hz] of times (F,) [s]; None where they do not increase, or are fewer than two."""
    times = times[np.isfinite(times)]
    steps = np.diff(times)
    if not len(steps) or not np.all(steps > 0):
        return None
    mean = float(times[-1] - times[0]) / len(steps)
    median = float(np.median(steps))
    # Rounded times have a wrong median, missing frames a wrong mean.
    step = mean if abs(mean - median) < 0.1 * median else median
    if not 1e-6 <= step <= 1e3:
        return None
    rate = 1.0 / step
    return float(round(rate)) if round(rate) and abs(rate - round(rate)) < 5e-4 * rate else rate
