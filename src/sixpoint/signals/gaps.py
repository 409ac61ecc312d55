"""Gaps and ghosts of tracked points: found, reported, and the short gaps filled where that is asked for.

Nothing here changes its input; what fills gaps says which samples it made.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.errors import TargetError

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ANCHORS = 8  # samples on either side that a spline goes through


@dataclass(frozen=True)
class Gaps:
    """How well one point was seen.

    Attributes:
        seen: Share of the frames in which it was seen, 0 to 1.
        count: Gaps between its first and its last sample.
        longest: Frames of the longest of them.
        first: Its first frame; -1 where it is never seen.
        last: Its last frame; -1 where it is never seen.
    """

    seen: float
    count: int
    longest: int
    first: int
    last: int


@dataclass(frozen=True, eq=False)
class Filled:
    """Points with gaps filled.

    Attributes:
        positions: (F, M, 3) [m]; NaN where gaps were left.
        made: (F, M) samples that were interpolated.
    """

    positions: Array
    made: Flags


@dataclass(frozen=True)
class Ghost:
    """Samples of a point that jump away from its other samples: another point, or a reflection.

    Attributes:
        point: Column of the point.
        start: First frame.
        stop: Frame after the last.
        speed: The slower of the jumps there and back [m/s].
    """

    point: int
    start: int
    stop: int
    speed: float


def _checked(positions: ArrayLike) -> Array:
    points = np.asarray(positions, float)
    if points.ndim != 3 or points.shape[2] != 3:
        raise TargetError(f"positions are (frames, points, 3), got {points.shape}")
    return points


def _known(points: Array) -> Flags:
    """(F, M) which points are seen."""
    return np.asarray(np.isfinite(points).all(axis=2), bool)


def find_runs(known: Flags) -> list[tuple[int, int]]:
    """Unbroken stretches of True in (F,), as (start, stop)."""
    edges = np.diff(np.concatenate([[False], known, [False]]).astype(np.int8))
    return list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))


def find_gaps(positions: ArrayLike) -> list[Gaps]:
    """How well each point of (F, M, 3) was seen, NaN where it was not.

    Raises:
        TargetError: The positions have another shape.
    """
    known = _known(_checked(positions))
    report = []
    for column in known.T:
        runs = find_runs(column)
        if not runs:
            report.append(Gaps(0.0, 0, 0, -1, -1))
            continue
        lengths = [b[0] - a[1] for a, b in pairwise(runs)]
        report.append(
            Gaps(float(column.mean()), len(lengths), max(lengths, default=0), runs[0][0], runs[-1][1] - 1)
        )
    return report


def fill_gaps(positions: ArrayLike, rate: float, longest: float = 0.1) -> Filled:
    """Fill short gaps by cubic splines through the samples beside them; ends are never made up.

    Args:
        positions: (F, M, 3) [m], NaN in gaps.
        rate: Frames per second [Hz].
        longest: Longest gap that is filled [s].

    Raises:
        TargetError: Wrong shape, rate or length.
    """
    points = _checked(positions).copy()
    if not (np.isfinite(rate) and rate > 0 and np.isfinite(longest) and longest >= 0):
        raise TargetError(f"rate and longest gap must be positive, got {rate} Hz and {longest} s")
    from scipy.interpolate import CubicSpline  # only where it is needed: it doubles the time to start

    known = _known(points)
    made = np.zeros(known.shape, bool)
    for m in range(points.shape[1]):
        runs, source = find_runs(known[:, m]), points[:, m].copy()
        for (begin, start), (stop, end) in pairwise(runs):
            if stop - start > longest * rate + 1e-9:
                continue
            at = np.concatenate(
                [np.arange(max(begin, start - _ANCHORS), start), np.arange(stop, min(end, stop + _ANCHORS))]
            )
            gap = np.arange(start, stop)
            points[gap, m] = CubicSpline(at, source[at])(gap)
            made[gap, m] = True
    return Filled(points, made)


def find_ghosts(
    positions: ArrayLike, rate: float, *, speed: float = 20.0, longest: float = 0.25
) -> list[Ghost]:
    """Short stretches of samples that a point jumps to and back from, faster than people move.

    Args:
        positions: (F, M, 3) [m], NaN in gaps.
        rate: Frames per second [Hz].
        speed: What no marker of a person reaches [m/s]; a kicking foot has about 18.
        longest: Longest stretch that counts [s]; longer ones are taken for the point itself.

    Returns:
        In order of frames.

    Raises:
        TargetError: Wrong shape, rate or limits.
    """
    points = _checked(positions)
    if not (np.isfinite(rate) and rate > 0 and speed > 0 and longest > 0):
        raise TargetError(f"rate, speed and length must be positive, got {rate}, {speed}, {longest}")
    found: list[Ghost] = []
    for m in range(points.shape[1]):
        frames = np.flatnonzero(np.isfinite(points[:, m]).all(axis=1))
        if len(frames) < 3:
            continue
        speeds = np.linalg.norm(np.diff(points[frames, m], axis=0), axis=1) / np.diff(frames) * rate
        jumps = np.flatnonzero(speeds > speed)
        for a, b in pairwise(jumps):
            start, stop = int(frames[a + 1]), int(frames[b]) + 1
            if stop - start <= longest * rate and (
                not found or found[-1].point != m or start >= found[-1].stop + 1
            ):
                found.append(Ghost(m, start, stop, float(min(speeds[a], speeds[b]))))
    return sorted(found, key=lambda ghost: (ghost.start, ghost.point))
