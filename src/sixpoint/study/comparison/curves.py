"""Errors over the frames of a clip, as the paper's Figures 14 to 18.

Many curves in one axes hide each other, so each method has a panel of its own, all of one scale, with
Sequential IK in grey behind it; frames in which the true pelvis turns quickly are shaded through all panels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Canvas
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from sixpoint.study.canvas import DPI, INK, SERIES, SOFT, WIDTH, add_heading, add_legend, style_axes
from sixpoint.study.comparison.model import ClipRuns

Array = NDArray[np.float64]

TURN = 2.0
"""A pelvis that turns faster about the vertical turns around [rad/s]."""
SHADE, MARK = "#f8e3c8", "#b98a45"
BEHIND = "#b9c2cb"
BEYOND = 1.8
"""Curves that peak this many times higher than the median one do not count for the scale."""
PANEL, TOP, FOOT = 0.68, 1.06, 0.46  # height of a panel with its gap, of what is above and below [inch]
LEFT_EDGE, RIGHT_EDGE, BETWEEN = (
    1.16,
    0.62,
    1.06,
)  # room for names and numbers, between the two columns [inch]
TITLES = {"position": "position error over H", "orientation": "orientation error [rad]"}
COLOURS = (*SERIES[:5], "#2f6db3", SERIES[6], "#9a5b3b", "#2b8f74", "#a04fb3", "#6f7f22", "#7a6f8f")


def encode(canvas: Canvas) -> bytes:
    """A canvas as PNG; the same canvas gives the same bytes."""
    FigureCanvasAgg(canvas)
    stream = BytesIO()
    canvas.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()


def plain(text: str, longest: int = 24) -> str:
    """A user's text on one line, so long at most, without signs that Matplotlib takes for mathematics."""
    text = " ".join(text.split())
    text = text if len(text) <= longest else text[: longest - 1].rstrip() + "…"
    return text.replace("$", r"\$")


def colour_methods(methods: Sequence[str], base: str) -> dict[str, str]:
    """A colour for each method, ink for the baseline."""
    others = [method for method in methods if method != base]
    return {base: INK, **{method: COLOURS[k % len(COLOURS)] for k, method in enumerate(others)}}


@dataclass(frozen=True, eq=False)
class _Column:
    """Curves of one quantity over the shown frames."""

    title: str
    curves: Mapping[str, Array]
    top: float


def draw_errors(
    clip: ClipRuns,
    methods: Sequence[str],
    missing: Mapping[str, str],
    base: str,
    span: tuple[int, int] | None = None,
) -> Canvas:
    """Draw position and orientation error over frames, a panel each for every method.

    Args:
        clip: What to draw.
        methods: In the order of the panels.
        missing: Method -> why it has no result, said in its panel.
        base: The method drawn in grey behind the others.
        span: First frame and end of the part to draw; None: all, with the window and the chosen frame marked.
    """
    start, end = span or (0, len(clip.turning))
    height = TOP + PANEL * len(methods) + FOOT
    canvas = Canvas(figsize=(WIDTH, round(height * DPI) / DPI), dpi=DPI)
    part = "error over frames" if span is None else f"frames {start} to {end}"
    add_heading(
        canvas,
        f"{plain(clip.name)}: {part}",
        "numbers: RMS of the frames shown; ▲: highest, above the scale",
    )
    items = [(SHADE, f"true pelvis turns faster than {TURN:g} rad/s"), (BEHIND, f"{base}, for comparison")]
    add_legend(canvas, items if span else [*items, (MARK, _explain_marks(clip))])
    colours = colour_methods(methods, base)
    wide = (WIDTH - LEFT_EDGE - BETWEEN - RIGHT_EDGE) / 2
    for c, quantity in enumerate(TITLES):
        column = _make_column(clip, quantity, slice(start, end))
        left = LEFT_EDGE + c * (wide + BETWEEN)
        for k, method in enumerate(methods):
            foot = FOOT + PANEL * (len(methods) - 1 - k)
            axes = canvas.add_axes((left / WIDTH, foot / height, wide / WIDTH, (PANEL - 0.14) / height))
            _draw_panel(axes, column, method, base, colours[method], range(start, end))
            _shade(axes, clip, range(start, end))
            if span is None and method in column.curves:
                _mark(axes, clip)
            _finish(axes, column, range(start, end), first=k == 0, last=k == len(methods) - 1)
            if method not in column.curves:
                text = plain(missing.get(method, "no result"), 58)
                axes.text(
                    0.5, 0.5, text, transform=axes.transAxes, color=SOFT, size=9, ha="center", va="center"
                )
            if c == 0:
                y = (foot + (PANEL - 0.14) / 2) / height
                size = min(10.5, 94.5 / max(len(method), 1))  # nine letters have room
                name = plain(method, 15)
                canvas.text(
                    0.012, y, name, size=max(size, 6.5), weight="bold", color=colours[method], va="center"
                )
    return canvas


def _make_column(clip: ClipRuns, quantity: str, part: slice) -> _Column:
    """Curves and a common scale; methods much worse than most leave it rather than flatten the others."""
    curves = {name: np.asarray(getattr(run, quantity), float)[part] for name, run in clip.runs.items()}
    tops = [float(np.nanmax(curve)) for curve in curves.values() if np.isfinite(curve).any()]
    usual = BEYOND * float(np.median(tops)) if tops else 1.0
    top = max([value for value in tops if value <= usual], default=1.0)
    return _Column(TITLES[quantity], curves, 1.08 * max(top, 1e-6))


def _draw_panel(axes: Axes, column: _Column, method: str, base: str, colour: str, frames: range) -> None:
    """A method's curve over the baseline's, and beside it its RMS and where it leaves the scale."""
    curve, behind = column.curves.get(method), column.curves.get(base)
    if curve is None:
        return
    style = "o" if len(frames) == 1 else "-"
    if behind is not None and method != base:
        axes.plot(frames, behind, style, ms=4, color=BEHIND, lw=1.0, zorder=2)
    axes.fill_between(frames, curve, color=colour, alpha=0.12, lw=0, zorder=1)
    axes.plot(frames, curve, style, ms=4, color=colour, lw=1.15, zorder=3)
    rms, highest = float(np.sqrt(np.nanmean(curve**2))), float(np.nanmax(curve))
    axes.text(1.02, 0.5, f"{rms:.4f}", transform=axes.transAxes, color=colour, size=9.5, va="center")
    if highest > column.top:
        axes.text(1.02, 0.98, f"▲ {highest:.2g}", transform=axes.transAxes, color=colour, size=8.5, va="top")


def _shade(axes: Axes, clip: ClipRuns, frames: range) -> None:
    """Frames in which the true pelvis turns quickly."""
    fast = find_turns(clip)[frames.start : frames.stop]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], fast, [False]]).astype(int)))
    for begin, end in edges.reshape(-1, 2) + frames.start:
        axes.axvspan(begin - 0.5, end - 0.5, color=SHADE, lw=0, zorder=0)


def find_turns(clip: ClipRuns) -> NDArray[np.bool_]:
    """(F,) whether the true pelvis turns around; an unknown speed is none."""
    return np.asarray(np.abs(np.nan_to_num(clip.turning)) > TURN)


def has_window(clip: ClipRuns) -> bool:
    """Whether the window is a part of the clip."""
    begin, end = clip.window
    return 0 < end - begin < len(clip.turning)


def _explain_marks(clip: ClipRuns) -> str:
    window = (
        f"dashed: frames {clip.window[0]} to {clip.window[1]}, drawn large below; "
        if has_window(clip)
        else ""
    )
    return f"{window}dotted: frame {clip.frame}"


def _mark(axes: Axes, clip: ClipRuns) -> None:
    """The window that is drawn large elsewhere, and the chosen frame."""
    if has_window(clip):
        for edge in clip.window:
            axes.axvline(edge, color=MARK, lw=0.9, ls=(0, (3, 2)), zorder=4)
    axes.axvline(clip.frame, color=MARK, lw=0.9, ls=(0, (1, 1.5)), zorder=4)


def _finish(axes: Axes, column: _Column, frames: range, first: bool, last: bool) -> None:
    style_axes(axes, np.array([frames.start, frames.stop - 1.0]), "", "frame" if last else "")
    if len(frames) == 1:
        axes.set_xlim(frames.start - 0.5, frames.start + 0.5)
    axes.set_ylim(0, column.top)
    axes.yaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))
    axes.xaxis.set_major_locator(MaxNLocator(7, integer=True, min_n_ticks=1, steps=[1, 2, 5, 10]))
    axes.tick_params(labelsize=8.5, labelbottom=last)
    if first:
        axes.set_title(column.title, loc="left", color=INK, size=10.5, pad=5)
