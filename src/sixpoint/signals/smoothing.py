"""Gaussian smoothing of sampled signals with gaps."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

CUT = 3.0  # standard deviations at which the bell ends


def smooth(values: ArrayLike, rate: float, width: float) -> Array:
    """Average samples with a Gaussian bell; what is unknown does not count.

    A linear filter with the same weights for every component: where p = c + R o holds for samples with a
    constant o, it holds for the smoothed ones, too.

    Args:
        values: (F, ...) samples in any unit, NaN where unknown.
        rate: Samples per second [Hz].
        width: Standard deviation of the bell [s].

    Returns:
        (F, ...) smoothed samples; NaN where less than half of the bell's weight is known, as at gaps.
    """
    values = np.asarray(values, float)
    flat = values.reshape(len(values), -1)
    reach = max(1, round(CUT * width * rate))
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / max(width * rate, 1e-9)) ** 2)
    bell /= bell.sum()
    known = np.isfinite(flat)
    weight = _filtered(known.astype(float), bell)
    total = _filtered(np.where(known, flat, 0.0), bell)
    edge = _filtered(np.ones((len(flat), 1)), bell)  # the clip's ends are no gaps
    enough = weight >= 0.5 * edge
    return np.where(enough, total / np.where(enough, weight, 1.0), np.nan).reshape(values.shape)


def _filtered(values: Array, bell: Array) -> Array:
    """Convolve each column of (F, n) with a symmetric bell; zeros beyond the ends."""
    reach = len(bell) // 2
    padded = np.pad(values, ((reach, reach), (0, 0)))
    return sum((w * padded[k : k + len(values)] for k, w in enumerate(bell)), np.zeros_like(values))
