"""The One Euro filter: smooth while slow, prompt while fast.

A low-pass filter whose cutoff frequency rises with speed: fc = f_min + beta |v|, with v the velocity, itself
low-passed. Velocities are vectors, so the result does not depend on the axes, and the noise of a still point
averages out of them. Weights are alpha = 1 - exp(-2 pi fc dt), which is the paper's 1 / (1 + tau / dt) to first
order and, unlike it, gives the same course at any frame rate and over uneven time steps.

Reference: G. Casiez, N. Roussel, D. Vogel, "1 Euro filter: a simple speed-based low-pass filter for noisy
input in interactive systems", CHI 2012.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from sixpoint.errors import TargetError, listed

Array = NDArray[np.float64]


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
        """Smooth one sample of positions (n, 3) [m] taken at a time [s]; returns (n, 3), NaN where unknown."""
        values = np.array(positions, float)
        if self.smoothing is None:
            return values
        memory, s = self._points, self.smoothing
        new, rows, dt = memory.take(values, np.isfinite(values).all(axis=1), time)
        if len(rows):
            change = values[rows] - memory.raw[rows]
            alpha = memory.alphas(rows, change, dt, s.cutoff, s.beta, s.speed_cutoff)
            memory.raw[rows] = values[rows]
            memory.smooth[rows] += alpha * (values[rows] - memory.smooth[rows])
        known = new | np.isin(np.arange(len(values)), rows)
        values[~known] = np.nan
        values[known] = memory.smooth[known]
        return values

    def filter_rotations(self, rotations: ArrayLike, time: float) -> Array:
        """Smooth one sample of rotations (n, 4) xyzw taken at a time [s], on the sphere (slerp).

        Returns:
            (n, 4) unit quaternions on the input's side of the sphere; NaN where unknown or of no length.
        """
        values = np.array(rotations, float)
        if self.smoothing is None:
            return values
        memory, s = self._turns, self.smoothing
        length = np.linalg.norm(values, axis=1)
        good = np.isfinite(length) & (length > 1e-9)
        values[good] /= length[good, None]
        new, rows, dt = memory.take(values, good, time)
        if len(rows):
            now = Rotation.from_quat(values[rows])
            turned = (now * Rotation.from_quat(memory.raw[rows]).inv()).as_rotvec()
            alpha = memory.alphas(rows, turned, dt, s.turn_cutoff, s.turn_beta, s.speed_cutoff)
            smooth = Rotation.from_quat(memory.smooth[rows])
            left = (now * smooth.inv()).as_rotvec()
            memory.raw[rows] = values[rows]
            memory.smooth[rows] = (Rotation.from_rotvec(alpha * left) * smooth).as_quat()
        known = new | np.isin(np.arange(len(values)), rows)
        side = np.where(np.sum(memory.smooth * np.nan_to_num(values), axis=1) < 0, -1.0, 1.0)
        values[~known] = np.nan
        values[known] = (memory.smooth * side[:, None])[known]
        return values


class _Memory:
    """What a filter remembers of n rows: the last sample, its smoothed value, velocity, and when."""

    def __init__(self, width: int) -> None:
        self.raw = self.smooth = np.empty((0, width))
        self.velocity = np.empty((0, 3))
        self.time = np.empty(0)

    def take(self, values: Array, known: NDArray[np.bool_], time: float) -> tuple[Array, Array, Array]:
        """Begin rows that are seen first; returns which, indices of the others, and their time steps."""
        if self.raw.shape != values.shape:
            self.raw, self.smooth = np.full(values.shape, np.nan), np.full(values.shape, np.nan)
            self.velocity, self.time = np.zeros((len(values), 3)), np.full(len(values), -np.inf)
        new = known & ~np.isfinite(self.time)
        rows = np.flatnonzero(known & ~new)
        self.raw[new] = self.smooth[new] = values[new]
        dt = np.maximum(time - self.time[rows], 0.0)
        self.time[new] = time
        self.time[rows] = np.maximum(self.time[rows], time)
        return new, rows, dt

    def alphas(
        self, rows: Array, change: Array, dt: Array, cutoff: float, beta: float, speed_cutoff: float
    ) -> Array:
        """(m, 1) weights of the new samples, from how far each changed (m, 3) in ``dt`` (m,)."""
        now = change / np.maximum(dt, 1e-6)[:, None]
        weight = compute_alpha(speed_cutoff, dt)[:, None]
        self.velocity[rows] += weight * (now - self.velocity[rows])
        speed = np.linalg.norm(self.velocity[rows], axis=1)
        return compute_alpha(cutoff + beta * speed, dt)[:, None]
