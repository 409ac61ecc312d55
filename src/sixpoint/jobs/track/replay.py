"""A recording of markers, replayed at its own rate and solved frame by frame, as a live stream would be."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.jobs.progress import Progress, silent
from sixpoint.jobs.reading import Reading, open_markers
from sixpoint.jobs.track.models import columns_of, find_model, find_ranges
from sixpoint.jobs.track.options import Following
from sixpoint.live.frames import play_frames
from sixpoint.live.statistics import Statistics
from sixpoint.solvers.tracking.solver import MarkerTracker, TrackedFrame

Array = NDArray[np.float64]

PICTURES = 30.0  # Hz, sent to browsers
COLOURS = np.array([[34, 48, 60], [34, 48, 60], [201, 55, 79], [184, 149, 47]])
"""Colour of a marker that is used, not seen, refused, found under another's label."""


class Replay:
    """A session of frames; a context that closes its page.

    Attributes:
        address: Of the page; empty without one.
        statistics: Of the run.
    """

    def __init__(
        self, tracker: MarkerTracker, positions: Array, rate: float, view: tuple[str, int | None] | None
    ) -> None:
        self.tracker, self.positions, self.rate = tracker, positions, rate
        self.statistics = Statistics()
        self._page = _Page(tracker, positions, *view) if view else None
        self.address = self._page.address if self._page else ""
        self._running = True

    def __enter__(self) -> Replay:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
        if self._page is not None:
            self._page.close()

    def stop(self) -> None:
        """End ``run`` after the present frame; may be called from another thread."""
        self._running = False

    def run(self, say: Callable[[str], object] | None = None) -> TrackedFrame | None:
        """Play once; with a page over and over, until stopped. ``say`` is told how each round went."""
        solved: TrackedFrame | None = None
        while self._running:
            solved = play_frames(
                self.positions,
                self.rate,
                self.tracker.solve,
                statistics=self.statistics,
                watch=None if self._page is None else self._page.watch,
                running=lambda: self._running,
            )
            if say is not None:
                say(self.statistics.line())
            if self._page is None:
                break
        return solved


def replay(
    source: Path,
    reading: Reading | None = None,
    following: Following | None = None,
    *,
    view: bool = False,
    host: str = "127.0.0.1",
    port: int | None = None,
    progress: Progress = silent,
) -> Replay:
    """Prepare a replay: read, calibrate or load the model, compile; see ``Replay.run``.

    Args:
        source: Labelled markers.
        reading: How to read them.
        following: Whom they are on; filters and held feet need what comes later, so these are left out.
        view: Show it on a page in the browser.
        host: Address that the page listens on.
        port: Its port; None: the first free one from 8080.
        progress: Told how far the calibration is.

    Raises:
        SixpointError: The message says why.
    """
    reading, following = reading or Reading(), following or Following()
    following.check()
    markers = open_markers(source, reading)
    model = find_model(markers, following, progress)
    positions = columns_of(model, markers)
    dofs, _ = find_ranges(model, positions, markers.rate, following, progress)
    tracker = MarkerTracker(model, limits=following.limits, dofs=dofs)
    tracker.warm_up()
    return Replay(tracker, positions, markers.rate, (host, port) if view else None)


class _Page:
    """The body and its markers in a browser; the loop only leaves its newest frame here."""

    def __init__(self, tracker: MarkerTracker, positions: Array, host: str, port: int | None) -> None:
        from sixpoint.viewer import Scene, describe_address, open_server

        self._server: Any = open_server(host, port)
        self._scene = Scene(self._server, lambda what, value: None)
        self._scene.set_figure(tracker.figure)
        middle = np.nanmean(positions, axis=(0, 1))
        if np.isfinite(middle).all():
            self._scene.look_at(middle)
        self._positions = positions
        self._line = self._server.gui.add_markdown("waiting for the first frame")
        self.address = describe_address(self._server)[0]
        self._newest: tuple[int, TrackedFrame] | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._draw, daemon=True)
        self._thread.start()

    def watch(self, number: int, frame: TrackedFrame) -> None:
        self._newest = (number, frame)

    def close(self) -> None:
        from sixpoint.viewer.server import close

        self._stop.set()
        self._thread.join(2.0)
        close(self._server)

    def _draw(self) -> None:
        while not self._stop.wait(1.0 / PICTURES):
            newest, self._newest = self._newest, None
            if newest is not None:
                with contextlib.suppress(Exception):  # a browser that leaves must not end the page
                    self._show(*newest)

    def _show(self, number: int, frame: TrackedFrame) -> None:
        with self._server.atomic():
            self._scene.show(*frame.pose.compute_transforms())
            self._scene.show_markers(self._positions[number], COLOURS[frame.flags])
        used = np.isin(frame.flags, (0, 3))
        rms = 100 * float(np.sqrt(np.mean(frame.residual[used] ** 2))) if used.any() else float("nan")
        self._line.content = f"frame {number}, {used.sum()} of {len(used)} markers, RMS {rms:.1f} cm"
