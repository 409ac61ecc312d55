"""When does a foot stand? Contact with hysteresis, from positions alone.

A contact begins where a point is low and slow for a while, and ends where it is fast or clearly off the
floor. The two pairs of thresholds keep noise from chopping one contact into many. All times are in seconds,
so that recordings of one step at 30 and at 120 Hz give the same contact.
"""

from __future__ import annotations

from math import ceil

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

from sixpoint.errors import TargetError
from sixpoint.signals.differences import compute_velocity

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LOW, HIGH = 0.03, 0.06  # height over the floor to begin below, to end above [m]
SLOW, FAST = 0.15, 0.25  # speed to begin below, to end above [m/s]
HOLD = 0.025  # a beginning lasts so long [s], and at least
HOLD_FRAMES = 3  # so many frames; both are the same at 120 Hz
HALF_SPAN = 0.025  # speeds are means over twice this time [s]
FLOOR_PERCENTILE = 5.0  # of a point's own heights


def find_contacts(positions: ArrayLike, rate: float, floor: ArrayLike | None = None) -> Flags:
    """Frames in which points stand on the floor.

    A contact begins where the point is lower than 0.03 m over the floor and slower than 0.15 m/s for 25 ms
    and at least three frames: three up to 120 Hz, six at 240 Hz. These frames belong to it. It ends before
    the first frame that is faster than 0.25 m/s or higher than 0.06 m. Speeds are central differences over
    50 ms (at 30 Hz between the two neighbours), see ``compute_velocity``.

    Args:
        positions: (F, n, 3) world positions [m], Y up; an unknown one is NaN and never in contact.
        rate: Frames per second [Hz].
        floor: Height of the floor under each point, a number or (n,) [m]; by default the 5th percentile of
            the point's own heights, so an ankle's floor is where it is when the foot stands.

    Returns:
        (F, n) whether each point is in contact; never in clips of fewer than three frames.

    Raises:
        TargetError: The positions are not (F, n, 3).
    """
    positions = np.asarray(positions, float)
    if positions.ndim != 3 or positions.shape[2] != 3:
        raise TargetError(f"positions must be (frames, points, 3), got {positions.shape}")
    heights = positions[..., 1]
    above = heights - (_own_floor(heights) if floor is None else np.asarray(floor, float))
    speed = np.linalg.norm(compute_velocity(positions, rate, HALF_SPAN), axis=-1)
    begin = _lasting((above < LOW) & (speed < SLOW), max(HOLD_FRAMES, ceil(HOLD * rate - 1e-9)))
    stay = (above < HIGH) & (speed < FAST)  # NaN does not
    return np.asarray(_latest(begin) > _latest(~stay), bool)


def _own_floor(heights: Array) -> Array:
    """(n,) low percentile of each column of (F, n) heights [m]; NaN where nothing is known."""
    floor = np.full(heights.shape[1], np.nan)
    known = np.isfinite(heights).any(axis=0)
    if known.any():
        floor[known] = np.nanpercentile(heights[:, known], FLOOR_PERCENTILE, axis=0)
    return floor


def _lasting(flags: Flags, frames: int) -> Flags:
    """(F, n) flags that belong to an uninterrupted run of at least so many frames."""
    out = np.zeros_like(flags)
    if len(flags) >= frames:
        whole: Flags = np.all(sliding_window_view(flags, frames, axis=0), axis=-1)
        for k in range(frames):
            out[k : k + len(whole)] |= whole
    return out


def _latest(flags: Flags) -> NDArray[np.int64]:
    """(F, n) the last frame up to each one that is set, -1 where there is none."""
    frame = np.arange(len(flags))[:, None]
    return np.asarray(np.maximum.accumulate(np.where(flags, frame, -1), axis=0))
