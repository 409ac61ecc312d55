"""A curve over the frames of a recording, with a mark at the frame that is shown."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import ArrayLike
from viser import uplot

from sixpoint.viewer.colours import GRID, INK, LEFT, SOFT, as_hex

MOST = 400
"""Points that are sent at most: each browser gets them with each move of the mark."""


class Curve:
    """One quantity over time; hidden until there is something to show."""

    def __init__(self, gui: viser.GuiApi) -> None:
        nothing = np.zeros(2)
        line = uplot.Series(label="error", stroke=as_hex(LEFT), width=2, fill=as_hex(LEFT) + "22")
        mark = uplot.Series(label="now", stroke=as_hex(INK), width=2)
        ink = {"stroke": as_hex(SOFT), "grid": {"stroke": as_hex(GRID), "width": 1}}
        self._plot = gui.add_uplot(
            (nothing, nothing, nothing),
            (uplot.Series(label="time [s]"), line, mark),
            title="mean joint distance [cm]",
            scales={"x": uplot.Scale(time=False), "y": uplot.Scale(auto=True)},
            axes=(uplot.Axis(**ink), uplot.Axis(**ink)),  # type: ignore[typeddict-item]
            legend=uplot.Legend(show=False),
            height=150,
            visible=False,
        )
        self._stride, self._shown = 1, -1

    def show(self, times: ArrayLike, values: ArrayLike) -> None:
        """A curve (F,) over times [s]; of long ones every nth point; nothing of fewer than two points."""
        t, y = np.asarray(times, float), np.asarray(values, float)
        self._plot.visible = len(t) > 1
        if len(t) < 2:
            return
        self._stride = -(-len(t) // MOST)
        self._shown = -1
        self._plot.data = (
            t[:: self._stride].copy(),
            y[:: self._stride].copy(),
            np.zeros(len(t[:: self._stride])),
        )

    def mark(self, frame: int) -> None:
        """Mark a frame by a needle."""
        times, values, _ = self._plot.data
        place = min(frame // self._stride, len(times) - 1)
        if place == self._shown or not self._plot.visible:
            return
        self._shown = place
        needle = np.zeros(len(times))
        needle[place] = 1.06 * max(values.max(), 1e-3)
        self._plot.data = (times, values, needle)
