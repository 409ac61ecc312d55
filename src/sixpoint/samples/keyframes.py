"""Curves through keyframes: what an animator would draw, as arrays.

Between keys the curves are monotone cubics (PCHIP): they are C1 and never overshoot, so a foot that two keys
put on the floor stays there. All angles are authored in degrees and handed out in radians.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Keys: TypeAlias = Mapping[float, ArrayLike]
"""Time [s] or phase -> value, a number or a vector."""

RATE = 60.0


def frame_times(duration: float) -> Array:
    """(F,) times of the frames of a clip [s], at ``RATE``."""
    return np.asarray(np.arange(round(duration * RATE)) / RATE, float)


def curve(keys: Keys, at: Array, period: float | None = None) -> Array:
    """A smooth curve through keys; it holds its first and last value outside of them.

    Args:
        keys: Time -> number or (n,) vector, in increasing order of time.
        at: (F,) times.
        period: Length after which the keys repeat; their times must lie in [0, period).

    Returns:
        (F,) or (F, n) values.
    """
    times = np.array(list(keys), float)
    values = np.array([np.asarray(v, float) for v in keys.values()])
    if len(times) == 1:
        return np.repeat(values, len(at), axis=0)
    if period is None:
        at = np.clip(at, times[0], times[-1])
    else:
        at = np.mod(at, period)
        times = np.concatenate([times - period, times, times + period])
        values = np.concatenate([values, values, values])
    from scipy.interpolate import PchipInterpolator  # slow to import, and only samples need it

    return np.asarray(PchipInterpolator(times, values, axis=0)(at), float)


def ballistic(keys: Mapping[float, tuple[float, float]], at: Array) -> Array:
    """A curve (F,) through {time: (value, slope)}; free fall is such a curve, exactly."""
    times = np.array(list(keys), float)
    values, slopes = np.array(list(keys.values()), float).T
    from scipy.interpolate import CubicHermiteSpline

    return np.asarray(CubicHermiteSpline(times, values, slopes)(np.clip(at, times[0], times[-1])), float)


def degrees(keys: Keys, at: Array, period: float | None = None) -> Array:
    """``curve`` for keys in degrees; the result is in radians."""
    return np.asarray(np.radians(curve(keys, at, period)), float)


def smooth_step(x: ArrayLike) -> Array:
    """Cubic ease from 0 to 1 while x (...,) goes from 0 to 1."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x), float)


def mix(a: ArrayLike, b: ArrayLike, weight: Array) -> Array:
    """Blend points (F, 3): ``a`` where weight (F,) is 0, ``b`` where it is 1."""
    w = weight[:, None]
    return np.asarray((1.0 - w) * np.asarray(a, float) + w * np.asarray(b, float), float)


def sway(at: Array, frequency: float, phase: float = 0.0) -> Array:
    """A slow oscillation (F,) between -1 and 1, never quite the same twice [Hz, cycles]."""
    angle = 2 * np.pi * (frequency * at + phase)
    return np.asarray(0.7 * np.sin(angle) + 0.3 * np.sin(1.618 * angle + 1.0), float)
