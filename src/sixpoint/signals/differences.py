"""Derivatives of sampled signals, as differences over a fixed time instead of a fixed number of frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def compute_velocity(values: ArrayLike, rate: float, half_span: float) -> Array:
    """Central differences over ``2 half_span`` seconds: the mean velocity of that time.

    At 120 Hz and 25 ms white noise of 1 mm gives 0.03 m/s, where neighbouring frames would give 0.08 m/s.
    At the ends the span is cut off; one frame alone does not move.

    Args:
        values: (F, ...) samples in any unit.
        rate: Samples per second [Hz].
        half_span: Time before and after a frame [s], rounded to frames, at least one.

    Returns:
        (F, ...) velocity [unit/s]; NaN where a sample it needs is NaN.
    """
    values = np.asarray(values, float)
    last, reach = len(values) - 1, max(1, round(half_span * rate))
    frame = np.arange(len(values))
    before, after = np.maximum(frame - reach, 0), np.minimum(frame + reach, last)
    seconds = np.maximum(after - before, 1) / rate
    return np.asarray((values[after] - values[before]) / seconds.reshape(-1, *[1] * (values.ndim - 1)))
