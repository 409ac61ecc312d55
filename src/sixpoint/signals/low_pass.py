"""Zero-phase low-pass filtering of recordings, stretch by stretch between gaps.

A Butterworth filter of second order runs forwards and backwards: fourth order, and no delay. The cutoff of
the single pass is raised so that both together halve the power at the frequency asked for.

Reference: D. A. Winter, "Biomechanics and Motor Control of Human Movement", section 3.4.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.errors import TargetError
from sixpoint.signals.gaps import find_runs

Array = NDArray[np.float64]

_PASSES = 2
_RAISED = (2.0 ** (1.0 / _PASSES) - 1.0) ** -0.25  # 1.2465: of the cutoff, for second-order passes


@dataclass(frozen=True, eq=False)
class LowPassed:
    """Filtered points.

    Attributes:
        positions: (F, M, 3) [m], NaN where there was nothing.
        kept: (F, M) samples left as they were, in stretches too short to filter.
    """

    positions: Array
    kept: NDArray[np.bool_]


def low_pass(positions: ArrayLike, rate: float, cutoff: float = 6.0) -> LowPassed:
    """Filter recorded points without delay; a gap ends one stretch and begins another.

    Args:
        positions: (F, M, 3) [m], NaN in gaps.
        rate: Frames per second [Hz].
        cutoff: Frequency at which half of the power is left [Hz]; 6 for gait, 10 to 20 for sports.

    Raises:
        TargetError: Wrong shape, or a cutoff that is not between zero and four tenths of the rate.
    """
    points = np.asarray(positions, float)
    if points.ndim != 3 or points.shape[2] != 3:
        raise TargetError(f"positions are (frames, points, 3), got {points.shape}")
    if not (np.isfinite(rate) and rate > 0 and 0 < cutoff < 0.4 * rate):
        raise TargetError(
            f"the cutoff must be between 0 and 0.4 of the rate, {0.4 * rate:g} Hz here; got {cutoff:g} Hz"
        )
    from scipy.signal import butter, sosfiltfilt  # only where it is needed: it doubles the time to start

    # What is raised is the analog frequency: the bilinear transform bends the axis.
    raised = np.arctan(np.tan(np.pi * cutoff / rate) * _RAISED) * rate / np.pi
    sections = butter(2, raised, fs=rate, output="sos")
    shortest = 3 * (2 * len(sections) + 1) + 1
    known = np.isfinite(points).all(axis=2)
    filtered = np.where(known[..., None], points, np.nan)
    kept = np.zeros(known.shape, bool)
    whole = known.all(axis=0) if len(points) >= shortest else np.zeros(known.shape[1], bool)
    if whole.any():
        filtered[:, whole] = sosfiltfilt(sections, points[:, whole], axis=0)
    for m in np.flatnonzero(~whole):
        for start, stop in find_runs(known[:, m]):
            if stop - start < shortest:
                kept[start:stop, m] = True
            else:
                filtered[start:stop, m] = sosfiltfilt(sections, points[start:stop, m], axis=0)
    return LowPassed(filtered, kept)
