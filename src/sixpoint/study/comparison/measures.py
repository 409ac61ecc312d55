"""The tables of what is measured beside the errors: quality, times, other readings; per clip and over clips.

A dash is a number that was not, or cannot be, measured.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import degrees, isfinite, isnan, nan

from sixpoint.study.comparison.averages import (
    average,
    averaged_clips,
    baseline,
    count_results,
    divide,
    find_result,
    published,
    published_average,
)
from sixpoint.study.comparison.model import Comparison, Row
from sixpoint.study.document import Table

NONE, OURS, THEIRS, ALL = "–", "ours", "reference", "Over all clips"


@dataclass(frozen=True)
class Measure:
    """A column: a number of the rows and how it is printed.

    Attributes:
        group: What it belongs to.
        head: Of the column, with the unit.
        name: Attribute of ``Row``.
        factor: From the row's unit to the printed one.
        digits: After the point.
        combine: Over clips, in place of the mean.
    """

    group: str
    head: str
    name: str
    factor: float = 1.0
    digits: int = 2
    combine: Callable[[list[float]], float] | None = None


QUALITY = (
    Measure("targets", "mean miss [mm]", "residual_mean", 1e3),
    Measure("targets", "p95 [mm]", "residual_p95", 1e3, 1),
    Measure("targets", "worst [mm]", "residual_max", 1e3, 1, max),
    Measure("targets", "frames > 1 cm [%]", "missed", 1e2, 1),
    Measure("limits", "frames outside [%]", "limit_frames", 1e2, 1),
    Measure("limits", "worst excess [°]", "limit_worst", degrees(1), 2, max),
    Measure("motion", "jerk / truth", "jerk_ratio"),
    Measure("motion", "foot skate [mm/frame]", "skate", 1e3),
    Measure("motion", "swivel jumps", "swivel_jumps", 1.0, 1),
    Measure("posture", "clavicles [°]", "clavicle", degrees(1), 1),
    Measure("posture", "upper trunk [%]", "bend_top", 1e2, 0),
    Measure("failed", "frames", "failed_frames", 1.0, 0, sum),
)
READINGS = (
    Measure("position", "RMS, E_p", "position", 1.0, 4),
    Measure("position", "mean", "position_mean", 1.0, 4),
    Measure("position", "p95", "position_p95", 1.0, 4),
    Measure("position", "pooled", "position_pooled", 1.0, 4),
    Measure("orientation", "RMS, E_o [rad]", "orientation", 1.0, 4),
    Measure("orientation", "mean [rad]", "orientation_mean", 1.0, 4),
    Measure("orientation", "p95 [rad]", "orientation_p95", 1.0, 4),
)
TIMES = (
    Measure("whole clip", "best round [µs/frame]", "batch_us", 1.0, 1),
    Measure("single calls", "median [µs]", "median_us", 1.0, 1),
    Measure("single calls", "p99 [µs]", "p99_us", 1.0, 1),
)
TRUE = {
    "jerk_ratio": "",
    **{name: f"{name}_truth" for name in ("skate", "swivel_jumps", "clavicle", "bend_top")},
}
"""Measures that the truth has as well: by which attribute; the jerk's ratio is one."""


def number(value: float, digits: int) -> str:
    """A number with so many digits after the point; a dash for NaN."""
    return NONE if isnan(value) else f"{value:.{digits}f}"


def quality_table(comparison: Comparison, clip: str | None = None) -> Table:
    """What the errors do not tell, of one clip or over the averaged ones; the truth comes first."""
    note = (
        "Swivel jumps: changes of an elbow's or knee's swivel angle by more than 30° in a frame. Foot skate: "
        "horizontal way of an ankle while the true foot stands. Clavicles: their mean angle from rest. Upper "
        "trunk: share of the trunk's bending that its upper half does."
    )
    means = "Means over the clips; under worst the worst of all, under failed the sum."
    title = "Quality" if clip else ALL
    return _measures(
        comparison, QUALITY, clip, title, f"{means} {note}" if clip is None else note, truth=True
    )


def reading_table(comparison: Comparison, clip: str | None = None) -> Table:
    """Other readings of the errors: mean, 95th percentile over frames, and pooled."""
    note = (
        "Position is over H. p95: 95th percentile over frames. Pooled: the root of the mean over "
        "frames of the summed squared joint distances, over the number of joints and H."
    )
    title = "Other readings of the errors" + ("" if clip else ", over all clips")
    return _measures(comparison, READINGS, clip, title, note)


def _measures(
    comparison: Comparison,
    measures: Sequence[Measure],
    clip: str | None,
    title: str,
    note: str,
    truth: bool = False,
) -> Table:
    """A table of measures; what they are is said once, where all clips are."""
    rows = [_truth_row(comparison, measures, clip)] if truth else []
    rows += [[method, *_cells(comparison, measures, clip, method)] for method in comparison.methods]
    columns = ("method", *(measure.head for measure in measures))
    groups = ("", *(measure.group for measure in measures))
    said = clip is None or len(averaged_clips(comparison)) == 1
    return Table(title, columns, tuple(map(tuple, rows)), groups, note=note if said else "")


def _cells(comparison: Comparison, measures: Sequence[Measure], clip: str | None, method: str) -> list[str]:
    values = [_value(comparison, measure, clip, method) * measure.factor for measure in measures]
    cells = [number(value, _digits(measure, clip)) for measure, value in zip(measures, values, strict=True)]
    missing = describe_missing(comparison, clip, method)
    return [missing, *cells[1:]] if missing else cells


def _digits(measure: Measure, clip: str | None) -> int:
    """Jumps are whole on one clip."""
    return 0 if clip and measure.name == "swivel_jumps" else measure.digits


def _value(comparison: Comparison, measure: Measure, clip: str | None, method: str) -> float:
    if measure.name == "failed_frames":  # counts where there is no result, too
        names = averaged_clips(comparison) if clip is None else (clip,)
        rows = [comparison.row(name, method) for name in names]
        return float(sum(row.failed_frames for row in rows if row)) if any(rows) else nan
    if clip is None:
        return average(comparison, method, measure.name, measure.combine)
    row = find_result(comparison, clip, method)
    return float(getattr(row, measure.name)) if row else nan


def describe_missing(comparison: Comparison, clip: str | None, method: str) -> str:
    """What stands in place of numbers: that a run failed, or on how many clips there is a result; else ""."""
    if clip is not None:
        row = comparison.row(clip, method)
        return NONE if row is None else "failed" if row.error else ""
    count, total = count_results(comparison, method), len(averaged_clips(comparison))
    return "" if count == total else f"{count} of {total} clips"


def _truth_row(comparison: Comparison, measures: Sequence[Measure], clip: str | None) -> list[str]:
    clips = averaged_clips(comparison) if clip is None else (clip,)
    cells = []
    for measure in measures:
        name = TRUE.get(measure.name)
        values = [_true(comparison, name, each) for each in clips] if name is not None else []
        known = [value for value in values if not isnan(value)]
        mean = measure.factor * sum(known) / len(known) if known else nan
        cells.append(number(mean, _digits(measure, clip)))
    return ["truth", *cells]


def _true(comparison: Comparison, name: str, clip: str) -> float:
    """A number of the true motion, which is the same in all rows of a clip."""
    values = (float(getattr(row, name)) if name else 1.0 for row in _results(comparison, clip))
    return next((value for value in values if not isnan(value)), nan)


def _results(comparison: Comparison, clip: str) -> list[Row]:
    return [row for row in comparison.rows if row.clip == clip and not row.error]


def time_table(comparison: Comparison, clip: str | None = None) -> Table:
    """Times of one clip or over the averaged ones, and as ratios to the baseline, which machines share."""
    base = baseline(comparison)
    columns = ["method", *(measure.head for measure in TIMES), OURS]
    groups = ["", *(measure.group for measure in TIMES), f"time / {base}"]
    ours = [_value(comparison, TIMES[0], clip, method) for method in comparison.methods]
    theirs = [
        published_average(comparison, "milliseconds", method)
        if clip is None
        else published(comparison, "milliseconds", clip, method)
        for method in comparison.methods
    ]
    where = dict(zip(comparison.methods, zip(ours, theirs, strict=True), strict=True))
    unit, printed_unit = where.get(base, (nan, nan))
    known = any(map(isfinite, theirs))
    if known:
        columns += [THEIRS, "median [ms]"]
        groups += [f"time / {base}", "reference"]
    rows = []
    for method, (mine, printed) in where.items():
        row = [method, *_cells(comparison, TIMES, clip, method), number(divide(mine, unit), 2)]
        rows.append(
            tuple([*row, number(divide(printed, printed_unit), 2), number(printed, 2)] if known else row)
        )
    note = (
        f"Compiling or loading kernels is not contained. Ratios are of whole clips, to {base} on the same "
        "clip; a folder that was resumed may mix runs. Single calls contain Python's share. Means over the "
        "clips. The reference's are medians of its C++."
    )
    title = "Time" if clip else ALL
    return Table(title, tuple(columns), tuple(rows), tuple(groups), note="" if clip else note)
