"""Frames of markers at the pace they were recorded: what a live stream of them would be.

A loop that is late leaves frames out, the newest counts; the time since the last solved frame is handed on.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sixpoint.live.statistics import Statistics

Array = NDArray[np.float64]
Solved = TypeVar("Solved")

BEHIND = 3  # frames that wait and are solved one by one; of more the newest counts


def play_frames(
    markers: Array,
    rate: float,
    solve: Callable[[Array, Solved | None, float], Solved],
    *,
    statistics: Statistics,
    watch: Callable[[int, Solved], None] | None = None,
    running: Callable[[], bool] | None = None,
) -> Solved | None:
    """Solve every frame when it is due.

    Args:
        markers: (F, M, 3) positions [m], NaN where a marker is not seen.
        rate: Frames per second [Hz].
        solve: A frame, what was solved before (None at first) and the time since [s] -> what is solved.
        statistics: Told the time of every frame, and of frames left out.
        watch: Told the number of every solved frame and what it gave; must return at once.
        running: Whether to go on; by default to the end.

    Returns:
        What the last solved frame gave.
    """
    solved: Solved | None = None
    start, last, frame = time.perf_counter(), 0, 0
    while frame < len(markers) and (running is None or running()):
        due = start + frame / rate
        now = time.perf_counter()
        if now < due:
            time.sleep(min(due - now, 0.1))
            continue
        waiting = min(int((now - start) * rate), len(markers) - 1) - frame
        if waiting > BEHIND:
            statistics.counts["frames left out"] += waiting
            frame += waiting
        due = start + frame / rate
        begun = time.perf_counter()
        solved = solve(markers[frame], solved, max(frame - last, 1) / rate)
        done = time.perf_counter()
        statistics.posed(done, done - begun, done - due)
        if watch is not None:
            watch(frame, solved)
        last, frame = frame, frame + 1
    return solved
