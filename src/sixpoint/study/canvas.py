"""What all pictures share: colours, size, headings, axes, and how they get to disk.

Uses Matplotlib's objects, never pyplot; files are written whole or not at all.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Canvas
from numpy.typing import NDArray

from sixpoint.errors import SixpointError

Array = NDArray[np.float64]

INK, SOFT, GHOST = "#22303c", "#8793a0", "#d3d9df"
LEFT, RIGHT, TRUNK = "#1f8a9e", "#e07a3f", "#44546a"
SERIES = (LEFT, RIGHT, "#6b5ca5", "#5a9a4a", "#c14b6a", "#44546a", "#b8952f", "#8793a0")
DPI = 150
WIDTH = 1600 / DPI  # [inch]


def add_heading(canvas: Canvas, title: str, note: str) -> None:
    """Title on the left, a note on the right."""
    y = 1 - 0.36 / canvas.get_figheight()
    canvas.text(0.02, y, title, size=15, weight="bold", color=INK, va="center")
    canvas.text(0.98, y, note, size=10.5, color=INK, va="center", ha="right")


def add_legend(canvas: Canvas, items: Iterable[tuple[str, str]]) -> None:
    """Coloured dots and what they mean, under the heading: (colour, text) pairs."""
    y = 1 - 0.66 / canvas.get_figheight()
    x = 0.02
    for colour, text in items:
        canvas.text(x, y, "\u25cf", color=colour, size=11, va="center")
        canvas.text(x + 0.014, y, text, color=SOFT, size=9.5, va="center")
        x += 0.03 + 0.0062 * len(text)


def style_axes(axes: Axes, times: Array, ylabel: str, xlabel: str = "time [s]") -> None:
    """Plain axes from the first to the last of ``times``, with a grid of levels."""
    axes.set_xlim(float(times.min()), max(float(times.max()), float(times.min()) + 1e-3))
    axes.set_xlabel(xlabel, color=SOFT, size=9.5, labelpad=2)
    axes.set_ylabel(ylabel, color=SOFT, size=9.5)
    axes.tick_params(colors=SOFT, labelsize=9, length=0)
    axes.grid(axis="y", color="#e6eaee", lw=0.8)
    axes.set_axisbelow(True)
    axes.spines[:].set_visible(False)
    axes.spines["bottom"].set(visible=True, color="#c5ccd3")


def save_canvas(canvas: Canvas, path: str | Path) -> Path:
    """Write a PNG beside its place, then move it there."""
    path = Path(path)
    FigureCanvasAgg(canvas)
    picture = BytesIO()
    canvas.savefig(picture, format="png")
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.write_bytes(picture.getvalue())
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise SixpointError(f"{path}: the picture cannot be written: {error.strerror}") from error
    return path
