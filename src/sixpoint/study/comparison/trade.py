"""A picture of what accuracy costs: position error against time per frame, ours and published.

Both axes are logarithmic and times are ratios to the baseline's, since machines differ.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure as Canvas
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
from numpy.typing import NDArray

from sixpoint.study.canvas import DPI, INK, SOFT, WIDTH, add_heading, add_legend, style_axes
from sixpoint.study.comparison.averages import (
    average,
    averaged_clips,
    baseline,
    divide,
    list_names,
    published_average,
)
from sixpoint.study.comparison.curves import colour_methods, plain
from sixpoint.study.comparison.model import Comparison

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mark:
    """A method in the picture.

    Attributes:
        method: Its name.
        place: Time and position error.
        published: The same of the reference; None for none.
    """

    method: str
    place: tuple[float, float]
    published: tuple[float, float] | None = None


def find_marks(comparison: Comparison) -> tuple[Mark, ...]:
    """Methods with a mean error and time; times are ratios to the baseline's if it has one, else [us]."""
    base = baseline(comparison)
    unit = average(comparison, base, "batch_us")
    published_unit = published_average(comparison, "milliseconds", base)
    marks = []
    for method in comparison.methods:
        time, error = average(comparison, method, "batch_us"), average(comparison, method, "position")
        if not (isfinite(time) and time > 0 and isfinite(error) and error > 0):
            continue
        theirs = (
            divide(published_average(comparison, "milliseconds", method), published_unit),
            published_average(comparison, "position", method),
        )
        known = isfinite(unit) and all(isfinite(value) and value > 0 for value in theirs)
        place = (divide(time, unit) if isfinite(unit) else time, error)
        marks.append(Mark(method, place, theirs if known else None))
    return tuple(marks)


def draw_trade(comparison: Comparison) -> Canvas | None:
    """Draw position error against time per frame, published numbers as hollow markers joined to ours.

    Returns:
        None where no method has both.
    """
    marks, base = find_marks(comparison), baseline(comparison)
    if not marks:
        return None
    ratio = isfinite(average(comparison, base, "batch_us"))
    canvas = Canvas(figsize=(WIDTH, 5.6), dpi=DPI)
    add_heading(
        canvas, "Error against time", f"mean over {plain(list_names(averaged_clips(comparison)), 60)}"
    )
    if comparison.reference and any(mark.published for mark in marks):
        add_legend(
            canvas, ((INK, "measured here   "), (SOFT, f"hollow: {plain(comparison.reference.name, 60)}"))
        )
    axes = canvas.add_axes((0.075, 0.1, 0.895, 0.735))
    colours = colour_methods(comparison.methods, base)
    for mark in marks:
        colour = colours[mark.method]
        if mark.published:
            line = np.array([mark.place, mark.published])
            axes.plot(*line.T, color=colour, lw=0.8, alpha=0.45)
            axes.plot(*mark.published, "o", ms=10.5, mfc="white", mec=colour, mew=1.5, zorder=3)
        axes.plot(*mark.place, "o", ms=7.5, color=colour, mec="white", mew=0.8, zorder=4)
    places = np.array([place for mark in marks for place in (mark.place, mark.published) if place])
    times, errors = places.T
    unit = f"time of a frame, as a ratio to {base}" if ratio else "time of a frame [µs]"
    style_axes(axes, times, "position error over H", unit)
    axes.set(xscale="log", yscale="log")
    axes.set_xlim(times.min() / 1.5, times.max() * 1.5)
    axes.set_ylim(errors.min() / 1.25, errors.max() * 1.25)
    for axis, limits in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        _label(axis, *limits)
    _name(axes, marks, colours, axes.transData.transform(places))
    return canvas


def _label(axis: Axis, low: float, high: float) -> None:
    """Round numbers on a logarithmic axis, more of them where it is short."""
    round_ones = ((8.0, (1, 2, 5)), (1.6, (1, 1.5, 2, 3, 4, 5, 6, 8)), (0.0, np.arange(1, 10, 0.2)))
    steps = next(steps for factor, steps in round_ones if high > factor * low)
    decades = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    values = np.concatenate([10.0**decade * np.array(steps) for decade in decades])
    axis.set_major_locator(FixedLocator([float(v) for v in values if low <= v <= high]))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.4g}"))
    axis.set_minor_locator(NullLocator())


def _name(axes: Axes, marks: Sequence[Mark], colours: Mapping[str, str], taken: Array) -> None:
    """Names beside our markers, where they cover neither a marker nor another name."""
    boxes = [(x - 9, y - 9, x + 9, y + 9) for x, y in taken]
    pixel = DPI / 72
    for mark in marks:
        x, y = axes.transData.transform(mark.place)
        wide, tall = 6.4 * len(mark.method) * pixel, 11.0 * pixel
        spots = [(side, rise) for rise in (0, 11, -11, 20, -20, 30, -30) for side in (1, -1)]
        for side, rise in spots:
            begin = x + 8 * pixel if side > 0 else x - 8 * pixel - wide
            box = (begin, y + rise * pixel - tall / 2, begin + wide, y + rise * pixel + tall / 2)
            if not any(box[0] < b[2] and b[0] < box[2] and box[1] < b[3] and b[1] < box[3] for b in boxes):
                break
        boxes.append(box)
        axes.annotate(
            plain(mark.method),
            mark.place,
            xytext=(8 * side, rise),
            textcoords="offset points",
            ha="left" if side > 0 else "right",
            va="center",
            size=10,
            weight="bold",
            color=colours[mark.method],
            bbox={"fc": "white", "ec": "none", "alpha": 0.7, "pad": 0.3},
            zorder=2.5,
        )
