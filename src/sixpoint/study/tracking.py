"""How well markers were followed: what each is off by, worst first, and pictures of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure as Canvas
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.study.canvas import DPI, INK, LEFT, RIGHT, SOFT, WIDTH, add_heading, add_legend, style_axes
from sixpoint.study.plots import film

Array = NDArray[np.float64]
Flags = NDArray[np.int64]

USED, LOST, REFUSED, SWAPPED = range(4)
"""What became of a marker in a frame, as the tracker numbers it."""

SHOWN = 6  # frames of a picture


@dataclass(frozen=True)
class MarkerRow:
    """One marker.

    Attributes:
        name: Its label.
        rms: Root mean square distance from its place on the body, where it was used [m]; NaN if never.
        worst: The largest [m].
        frame: Where that was.
        seen: Share of frames in which it was there, 0 to 1.
        refused: Frames in which it was there and not believed.
        swapped: Frames in which it was found under another's label.
    """

    name: str
    rms: float
    worst: float
    frame: int
    seen: float
    refused: int
    swapped: int


def summarise_markers(names: Sequence[str], residual: Array, flags: Flags) -> list[MarkerRow]:
    """A row per marker, that with the largest residual first; (F, M) residuals [m] and flags."""
    rows = []
    for i, name in enumerate(names):
        used = (flags[:, i] == USED) | (flags[:, i] == SWAPPED)
        values = np.where(used, residual[:, i], 0.0)
        rms = float(np.sqrt(np.mean(residual[used, i] ** 2))) if used.any() else float("nan")
        rows.append(
            MarkerRow(
                name,
                rms,
                float(values.max()) if used.any() else float("nan"),
                int(values.argmax()),
                float(np.mean(flags[:, i] != LOST)),
                int(np.sum(flags[:, i] == REFUSED)),
                int(np.sum(flags[:, i] == SWAPPED)),
            )
        )
    return sorted(rows, key=lambda row: -row.rms if np.isfinite(row.rms) else np.inf)


def overall(residual: Array, flags: Flags) -> float:
    """Root mean square residual of all used samples [m]; NaN where none was used."""
    used = (flags == USED) | (flags == SWAPPED)
    return float(np.sqrt(np.mean(residual[used] ** 2))) if used.any() else float("nan")


def draw_residuals(
    rows: Sequence[MarkerRow], residual: Array, flags: Flags, rate: float, title: str
) -> Canvas:
    """Residual by marker, worst first, and over time."""
    tall = max(2.6, 0.155 * len(rows) + 0.5)
    canvas = Canvas(figsize=(WIDTH, round((tall + 3.2) * DPI) / DPI), dpi=DPI)
    height = canvas.get_figheight()
    bars = canvas.add_axes((0.11, 2.75 / height, 0.87, (tall - 0.35) / height))
    place = np.arange(len(rows))[::-1]
    values = np.array([100 * row.rms for row in rows])
    seen = np.array([row.seen for row in rows])
    bars.barh(place, np.nan_to_num(values), height=0.72, color=LEFT, alpha=0.85)
    for y, row, value in zip(place, rows, np.nan_to_num(values), strict=True):
        notes = [f"{value:.1f}"] if np.isfinite(row.rms) else ["never used"]
        notes += [f"{row.seen:.0%} seen"] if row.seen < 0.995 else []
        notes += [f"{row.refused} refused"] if row.refused else []
        notes += [f"{row.swapped} swapped"] if row.swapped else []
        bars.text(value, y, "  " + ", ".join(notes), va="center", size=7.5, color=SOFT)
    bars.set_yticks(place, [_plain(row.name) for row in rows])
    style_axes(
        bars, np.array([0.0, 1.18 * max(float(np.nanmax(np.append(values, 0.1))), 0.1)]), "", "RMS [cm]"
    )
    bars.grid(axis="y", visible=False)
    bars.tick_params(labelsize=7.5)
    bars.set_ylim(-0.7, len(rows) - 0.3)
    used = (flags == USED) | (flags == SWAPPED)
    lost = 1.0 - used.mean(axis=1)
    room = 0.055 if lost.max(initial=0.0) > 0 else 0.0  # for the axis at the right
    axes = canvas.add_axes((0.06, 0.55 / height, 0.92 - room, 1.6 / height))
    times = np.arange(len(residual)) / rate
    count = np.maximum(used.sum(axis=1), 1)
    rms = 100 * np.sqrt(np.where(used, residual**2, 0.0).sum(axis=1) / count)
    rms[~used.any(axis=1)] = np.nan  # nobody is seen: nothing fits well there
    axes.fill_between(times, rms, color=LEFT, alpha=0.13, lw=0)
    axes.plot(times, rms, color=LEFT, lw=1.4)
    if room:
        twin = axes.twinx()
        twin.fill_between(times, 100 * lost, color=RIGHT, alpha=0.25, lw=0, step="mid")
        twin.set_ylim(0, 100)
        twin.set_ylabel("not used [%]", color=RIGHT, size=9.5)
        twin.tick_params(colors=SOFT, labelsize=9, length=0)
        twin.spines[:].set_visible(False)
    axes.set_ylim(0, max(1.15 * float(np.nanmax(np.append(rms, 0.0))), 0.1))
    style_axes(axes, times, "RMS of all markers [cm]")
    note = f"RMS {100 * overall(residual, flags):.2f} cm,  {np.mean(seen):.1%} of the samples seen"
    add_heading(canvas, _plain(title, 60), note)
    return canvas


def draw_tracking(
    figure: Figure,
    motion: Motion,
    markers: Array,
    flags: Flags,
    title: str,
    frames: Sequence[int] | None = None,
) -> Canvas:
    """The body and the markers (F, M, 3) [m] at some frames; those refused are not drawn.

    Without ``frames`` some of those are shown in which half of the most markers ever used are used.
    """
    used = np.sum((flags == USED) | (flags == SWAPPED), axis=1)
    told = np.flatnonzero(2 * used >= used.max())
    shown = list(frames) if frames is not None else [int(told[k]) for k in _spread(len(told))]
    points = np.where((flags == REFUSED)[..., None], np.nan, markers)
    canvas = film(figure, (motion,), shown, below=0.0, points=points)
    add_heading(canvas, _plain(title, 60), f"{motion.duration:.1f} s at {motion.rate:g} Hz")
    add_legend(canvas, ((LEFT, "left side"), (RIGHT, "right side"), (INK, "markers")))
    return canvas


def _spread(frames: int) -> list[int]:
    return (
        [round((k + 0.5) * (frames - 1) / SHOWN) for k in range(SHOWN)]
        if frames > SHOWN
        else list(range(frames))
    )


def _plain(text: str, longest: int = 24) -> str:
    """A user's text without signs that Matplotlib takes for mathematics."""
    text = " ".join(text.split())
    text = text if len(text) <= longest else text[: longest - 1].rstrip() + "…"
    return text.replace("$", r"\$")
