"""Means over clips, ours and published, and how well they agree: numbers that tables and pictures share.

Only test clips are averaged: none whose person any of the methods was fitted on. Clips that a reference
averages are the ones averaged, so that both means are over the same clips. A method without a result on one
of them has no mean: failures are never averaged away.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan

import numpy as np
from scipy.stats import spearmanr

from sixpoint.study.comparison.model import TEST, Comparison, Row

AVERAGE = "average"
"""The clip of a ``Reference`` that is its printed average."""
BASELINE = "sik"
QUANTITIES = ("position", "orientation")


@dataclass(frozen=True)
class Correlation:
    """Rank correlation of our averages with the published ones.

    Attributes:
        methods: Those that both have.
        value: Spearman's coefficient; NaN for fewer than three methods, or where all of one side are equal.
    """

    methods: tuple[str, ...]
    value: float


def baseline(comparison: Comparison) -> str:
    """The method that others are compared with: Sequential IK, else the first."""
    return BASELINE if BASELINE in comparison.methods else next(iter(comparison.methods), BASELINE)


def clip_names(comparison: Comparison) -> tuple[str, ...]:
    """All clips, also those that could not be read, in the order of the rows."""
    names = [row.clip for row in comparison.rows] + [clip.name for clip in comparison.clips]
    return tuple(dict.fromkeys(names))


def clips_of(comparison: Comparison, split: str) -> tuple[str, ...]:
    """The clips of a split, in the order of the rows; one without a row is a test."""
    splits = {row.clip: row.split for row in comparison.rows}
    return tuple(name for name in clip_names(comparison) if splits.get(name, TEST) == split)


def find_result(comparison: Comparison, clip: str, method: str) -> Row | None:
    """The row of a clip and method, if it has a result."""
    row = comparison.row(clip, method)
    return row if row is not None and not row.error else None


def explain_missing(comparison: Comparison, clip: str, method: str) -> str:
    """Why there is no result: the row's error, or that it was not run."""
    row = comparison.row(clip, method)
    return "not run" if row is None else row.error or "no curve was kept"


def averaged_clips(comparison: Comparison) -> tuple[str, ...]:
    """Test clips with a result of some method; of those the reference has, if it has any."""
    some = {row.clip for row in comparison.rows if not row.error}
    names = [name for name in clips_of(comparison, TEST) if name in some]
    known = comparison.reference.position if comparison.reference else {}
    return tuple([name for name in names if name in known] or names)


def count_results(comparison: Comparison, method: str) -> int:
    """On how many of the averaged clips a method has a result."""
    return sum(find_result(comparison, clip, method) is not None for clip in averaged_clips(comparison))


def average(
    comparison: Comparison, method: str, name: str, combine: Callable[[list[float]], float] | None = None
) -> float:
    """Plain mean over the averaged clips of one number of the rows.

    Args:
        comparison: What to average.
        method: Whose rows.
        name: A numeric attribute of ``Row``.
        combine: In place of the mean, for example ``max``.

    Returns:
        NaN where the method lacks a result on some clip, and where no clip has the number. Clips on which it
        is not defined do not count.
    """
    rows = [find_result(comparison, clip, method) for clip in averaged_clips(comparison)]
    values = [float(getattr(row, name)) for row in rows if row is not None]
    known = [value for value in values if not np.isnan(value)]
    if len(values) < len(rows) or not known:
        return nan
    return float((combine or np.mean)(known))


def published(comparison: Comparison, quantity: str, clip: str, method: str) -> float:
    """A number of the reference, NaN if it has none.

    ``quantity`` is "position", "orientation" or "milliseconds".
    """
    if comparison.reference is None:
        return nan
    table: Mapping[str, Mapping[str, float]] = getattr(comparison.reference, quantity)
    return float(table.get(clip, {}).get(method, nan))


def published_average(comparison: Comparison, quantity: str, method: str) -> float:
    """The printed average, if it is over the averaged clips; else the mean of the printed clips."""
    printed = published(comparison, quantity, AVERAGE, method)
    return (
        printed
        if _same_clips(comparison) and isfinite(printed)
        else mean_of_published(comparison, quantity, method)
    )


def mean_of_published(comparison: Comparison, quantity: str, method: str) -> float:
    """Mean of the printed numbers of the averaged clips; NaN where one is missing."""
    values = [published(comparison, quantity, clip, method) for clip in averaged_clips(comparison)]
    return float(np.mean(values)) if values else nan


def _same_clips(comparison: Comparison) -> bool:
    if comparison.reference is None:
        return False
    return {*averaged_clips(comparison)} == {*comparison.reference.position} - {AVERAGE}


def correlate(comparison: Comparison, quantity: str) -> Correlation:
    """Spearman's rank correlation of our averages with the reference's; what differs by rounding ties."""
    pairs = {
        method: (average(comparison, method, quantity), published_average(comparison, quantity, method))
        for method in comparison.methods
    }
    pairs = {method: pair for method, pair in pairs.items() if all(map(isfinite, pair))}
    ours, theirs = ([round(pair[k], 9) for pair in pairs.values()] for k in (0, 1))
    if len(pairs) < 3 or len({*ours}) == 1 or len({*theirs}) == 1:
        return Correlation(tuple(pairs), nan)
    return Correlation(tuple(pairs), float(spearmanr(ours, theirs).statistic))


def divide(value: float, by: float) -> float:
    """A ratio; NaN where there is none."""
    return value / by if isfinite(value) and isfinite(by) and by > 0 else nan


def list_names(names: Sequence[str]) -> str:
    """Names as in a sentence; only how many clips where there are many."""
    if len(names) > 6:
        return f"{len(names)} clips"
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else "".join(names)
