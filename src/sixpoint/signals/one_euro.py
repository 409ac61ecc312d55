"""The One Euro filter: smooth while slow, prompt while fast.

A low-pass filter whose cutoff frequency rises with speed: fc = f_min + beta |v|, with v the velocity, itself
low-passed. Velocities are vectors, so the result does not depend on the axes, and the noise of a still point
averages out of them. Weights are alpha = 1 - exp(-2 pi fc dt), which is the paper's 1 / (1 + tau / dt) to
first order and, unlike it, gives the same course at any frame rate and over uneven time steps.

Reference: G. Casiez, N. Roussel, D. Vogel, "1 Euro filter: a simple speed-based low-pass filter for noisy
input in interactive systems", CHI 2012.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.errors import TargetError, listed

Array = NDArray[np.float64]

NEXT, LAST = [1, 2, 0], [2, 0, 1]


@dataclass(frozen=True)
class Smoothing:
    """Constants of the filter.

    Attributes:
        cutoff: Cutoff frequency of positions at rest [Hz].
        beta: How it rises with speed [Hz per m/s].
        turn_cutoff: Cutoff frequency of rotations at rest [Hz].
        turn_beta: How it rises with angular speed [Hz per rad/s].
        speed_cutoff: Cutoff frequency of the velocities [Hz].
    """

    cutoff: float
    beta: float
    turn_cutoff: float
    turn_beta: float
    speed_cutoff: float = 2.0

    def __post_init__(self) -> None:
        for name in ("cutoff", "turn_cutoff", "speed_cutoff"):
            if not 0 < getattr(self, name) < float("inf"):
                raise TargetError(f"{name} is a frequency above zero [Hz], got {getattr(self, name)}")
        for name in ("beta", "turn_beta"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise TargetError(f"{name} is a number from zero, got {getattr(self, name)}")


SMOOTHINGS: dict[str, Smoothing | None] = {
    "off": None,
    "light": Smoothing(cutoff=4.0, beta=40.0, turn_cutoff=4.0, turn_beta=12.0),
    "strong": Smoothing(cutoff=1.5, beta=15.0, turn_cutoff=1.5, turn_beta=6.0),
}
"""What users choose from; the trade of jitter against lag is measured in ``docs/live_trackers.md``."""


def find_smoothing(name: str) -> Smoothing | None:
    """Constants by name; None, no filter, for "off".

    Raises:
        TargetError: There is no such smoothing; the message lists those there are.
    """
    if name not in SMOOTHINGS:
        raise TargetError(f"no smoothing named {name!r}; there are: {listed(SMOOTHINGS)}")
    return SMOOTHINGS[name]


def compute_alpha(cutoff: ArrayLike, dt: ArrayLike) -> Array:
    """Weight of a new sample after a time ``dt`` [s] at a cutoff [Hz]: in (0, 1], 0 where no time passed."""
    return np.asarray(-np.expm1(-2.0 * np.pi * np.asarray(cutoff, float) * np.maximum(dt, 0.0)))


class OneEuro:
    """A filter of n points and their rotations, sample by sample.

    A row that is unknown (not finite) comes out unknown and leaves the filter as it was; when it is seen
    again the time in between counts. Time that stands still or runs backwards changes nothing.

    Args:
        smoothing: Its constants; None passes everything through.
    """

    def __init__(self, smoothing: Smoothing | None) -> None:
        self.smoothing = smoothing
        self._points = _Memory(3)
        self._turns = _Memory(4)

    def reset(self) -> None:
        """Forget the past: the next sample passes as it is."""
        self._points, self._turns = _Memory(3), _Memory(4)

    def filter_positions(self, positions: ArrayLike, time: float) -> Array:
        """Smooth one sample of positions (n, 3) [m], taken at a time [s]; NaN where unknown."""
        values = np.array(positions, float)
        if self.smoothing is None:
            return values
        s, m = self.smoothing, self._points
        dt, old = m.begin(values, time)
        alpha = m.weigh(values - old, dt, s.cutoff, s.beta, s.speed_cutoff)
        return m.keep(values, m.smooth + alpha * (values - m.smooth), time)

    def filter_rotations(self, rotations: ArrayLike, time: float) -> Array:
        """Smooth one sample of rotations (n, 4) xyzw taken at a time [s], on the sphere (slerp).

        Returns:
            (n, 4) unit quaternions on the input's side of the sphere; NaN where unknown or of no length.
        """
        values = np.array(rotations, float)
        if self.smoothing is None:
            return values
        length = np.sqrt(np.sum(values * values, axis=1, keepdims=True))
        values /= np.where((length > 1e-9) & (length < np.inf), length, np.nan)
        s, m = self.smoothing, self._turns
        dt, old = m.begin(values, time)
        alpha = m.weigh(_rotation_vector(values, old), dt, s.turn_cutoff, s.turn_beta, s.speed_cutoff)
        return m.keep(values, _slerp(m.smooth, values, alpha), time)


class _Memory:
    """What a filter remembers of n rows: the last sample, its smoothed value, velocity, and when."""

    def __init__(self, width: int) -> None:
        self.raw = self.smooth = np.empty((0, width))
        self.velocity = np.empty((0, 3))
        self.time = np.empty((0, 1))

    def begin(self, values: Array, time: float) -> tuple[Array, Array]:
        """Time steps (n, 1) and last samples; a row that is seen first is its own past."""
        if self.raw.shape != values.shape:
            self.raw, self.smooth = np.full(values.shape, np.nan), np.full(values.shape, np.nan)
            self.velocity, self.time = np.zeros((len(values), 3)), np.full((len(values), 1), -np.inf)
        new = self.time == -np.inf
        if new.any():
            self.smooth = np.where(new, values, self.smooth)
            return np.where(new, 0.0, np.maximum(time - self.time, 0.0)), np.where(new, values, self.raw)
        return np.maximum(time - self.time, 0.0), self.raw

    def weigh(self, change: Array, dt: Array, cutoff: float, beta: float, speed_cutoff: float) -> Array:
        """(n, 1) weights of the samples, from how far each changed (n, 3) in ``dt`` (n, 1)."""
        gain = compute_alpha(speed_cutoff, dt) * (change / np.maximum(dt, 1e-6) - self.velocity)
        self.velocity = self.velocity + np.where(np.isfinite(gain), gain, 0.0)
        speed = np.sqrt(np.sum(self.velocity * self.velocity, axis=1, keepdims=True))
        return compute_alpha(cutoff + beta * speed, dt)

    def keep(self, values: Array, smooth: Array, time: float) -> Array:
        """Remember this sample where it is known; returns the smoothed one, NaN where it is not."""
        known = np.isfinite(smooth).all(axis=1, keepdims=True) & np.isfinite(values).all(
            axis=1, keepdims=True
        )
        self.raw = np.where(known, values, self.raw)
        self.smooth = np.where(known, smooth, self.smooth)
        self.time = np.where(known, np.maximum(self.time, time), self.time)
        return np.where(known, smooth, np.nan)


def _rotation_vector(a: Array, b: Array) -> Array:
    """(n, 3) the turn from unit quaternions ``b`` to ``a``, in the world [rad]."""
    av, bv = a[:, :3], b[:, :3]
    v = b[:, 3:] * av - a[:, 3:] * bv - (av[:, NEXT] * bv[:, LAST] - av[:, LAST] * bv[:, NEXT])
    w = np.sum(a * b, axis=1, keepdims=True)
    length = np.sqrt(np.sum(v * v, axis=1, keepdims=True))
    angle = 2.0 * np.arctan2(length, np.abs(w))
    return np.asarray(np.where(w < 0.0, -1.0, 1.0) * angle / np.maximum(length, 1e-12) * v)


def _slerp(a: Array, b: Array, t: Array) -> Array:
    """Unit quaternions (n, 4) a part ``t`` (n, 1) of the short way from ``a`` to ``b``, on ``b``'s side."""
    cosine = np.sum(a * b, axis=1, keepdims=True)
    a = np.where(cosine < 0.0, -a, a)
    angle = np.arccos(np.minimum(np.abs(cosine), 1.0))
    sine = np.sin(angle)
    near = sine < 1e-6
    divisor = np.where(near, 1.0, sine)
    first = np.where(near, 1.0 - t, np.sin((1.0 - t) * angle) / divisor)
    second = np.where(near, t, np.sin(t * angle) / divisor)
    between = first * a + second * b
    return np.asarray(between / np.sqrt(np.sum(between * between, axis=1, keepdims=True)))
