"""Through the frames of a recording: where to begin, when to begin anew, and the way back."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sixpoint.solvers.tracking.engine import packing as tp
from sixpoint.solvers.tracking.running import Followed, State, TrackingEngine, join, reverse
from sixpoint.solvers.tracking.start import Beginning

Array = NDArray[np.float64]
Report = Callable[[int], None]

CHUNK, MOMENT = 64, 0.3  # frames, and time [s], between two looks at how it goes, whichever is less
FEW = 3  # markers in fewer than these tell no body
OFF = 0.08  # a body is lost where half of its markers are farther off [m]
PATIENCE = 0.3  # so long [s]; then the next frame with enough of them is begun with


class Follower:
    """Follows markers from a pose found afresh, and finds it again where it got lost.

    Args:
        start: Finds first poses.
        engine: Follows markers.
        rest: (2 J + 1, 4) the relaxed posture.
    """

    def __init__(self, start: Beginning, engine: TrackingEngine, rest: Array) -> None:
        self._start, self._engine, self._rest = start, engine, rest

    def begin(self, frame: Array, options: tp.Options) -> tuple[Followed, State, float]:
        """The pose of a first frame of markers (M, 3) [m]; adrift for ever where it tells no body."""
        out, state = self._start.begin(frame, options)
        return out, state, 0.0 if count_seen(frame) >= FEW else np.inf

    def go_on(
        self, markers: Array, state: State, adrift: float, options: tp.Options, ever: int | None = None
    ) -> tuple[Followed, State, float]:
        """Frames (F, M, 3) after a state, which was ``adrift`` for so long [s].

        After that long the first frame is also begun with anew, and the better way is taken.

        Args:
            markers: Positions [m], NaN where a marker is not seen.
            state: What is known; it is written to.
            adrift: For how long nothing was followed [s].
            options: Of the compiled tracker.
            ever: How many of the markers are seen at all; by default those that have been, or are now, or a
                third of all.

        Returns:
            The frames, the state after them, and how long that is adrift [s].
        """
        if ever is None:
            known = int(np.sum(state.markers[:, tp.KNOWN] > 0.0))
            ever = max(known, count_seen(markers[0]), markers.shape[1] // 3)
        anew = adrift > PATIENCE and is_enough(markers[0], ever)
        other = self._start.begin(markers[0], options) if anew else None
        out = self._engine.run(markers, self._rest, state, options)
        if other is not None:
            begun, fresh = other
            run = join([begun, self._engine.run(markers[1:], self._rest, fresh, options)])
            adrift = 0.0
            if _cost(run) < _cost(out):
                out, state = run, fresh
        follows = _follows(out)
        after = len(follows) - (int(np.flatnonzero(follows)[-1]) + 1 if follows.any() else 0)
        return out, state, after * options.dt + (adrift if after == len(follows) else 0.0)

    def follow(self, markers: Array, options: tp.Options, progress: Report) -> tuple[Followed, State]:
        """From the first frame with enough markers to the end; those before take its pose.

        Returns:
            The frames, and the state after the last frame that has enough markers: where the way back begins.
        """
        first, last = _whole(markers)
        begun, state, _ = self.begin(markers[first], options)
        part, state = self._run(markers[first + 1 : last + 1], state, options, lambda n: progress(first + n))
        parts, turning = [begun] * (first + 1) + [part], state.copy()
        if last + 1 < len(markers):
            part, _ = self._run(markers[last + 1 :], state, options, lambda n: progress(last + n))
            parts.append(part)
        out = join(parts)
        out.flags[:first] = tp.WAITING
        progress(len(markers))
        return out, turning

    def follow_back(self, markers: Array, state: State, options: tp.Options, progress: Report) -> Followed:
        """From the last frame with enough markers to the first of all; those after take its pose.

        The way back begins where the way there was, and knows what that has learnt.
        """
        _, last = _whole(markers)
        state.speed[:, :3] *= -1.0
        state.lag[:] = 0.0
        out = reverse(self._run(markers[last::-1], state, options, progress)[0])
        beyond = Followed(*(array[-1:] for array in out))  # type: ignore[arg-type]
        out = join([out] + [beyond] * (len(markers) - 1 - last))
        out.flags[last + 1 :] = tp.WAITING
        progress(len(markers))
        return out

    def _run(
        self, markers: Array, state: State, options: tp.Options, progress: Report
    ) -> tuple[Followed, State]:
        parts, adrift, ever = [], 0.0, count_ever(markers)
        for start, stop in _chunks(markers, ever, options.dt):
            out, state, adrift = self.go_on(markers[start:stop], state, adrift, options, ever)
            parts.append(out)
            progress(stop)
        return (join(parts) if parts else self._engine.run(markers, self._rest, state, options)), state


def count_seen(frame: Array) -> int:
    """Markers (M, 3) that are there."""
    return int(np.isfinite(frame[:, 0]).sum())


def count_ever(markers: Array) -> int:
    """Markers that any frame (F, M, 3) has: a recording may lack some of its model's."""
    return int(np.isfinite(markers[..., 0]).any(axis=0).sum())


def is_enough(frame: Array, ever: int) -> bool:
    """Whether a frame (M, 3) can begin a recording: three markers, of half of those that are ever seen."""
    return count_seen(frame) >= max(FEW, ever // 2)


def mark_waiting(run: Followed, markers: Array) -> Followed:
    """Frames that were not followed, as what they are: markers there are refused."""
    waiting = run.flags == tp.WAITING
    flags = np.where(waiting, np.where(np.isfinite(markers[..., 0]), tp.REJECTED, tp.LOST), run.flags)
    return run._replace(flags=flags, residual=np.where(waiting, 0.0, run.residual))


def _whole(markers: Array) -> tuple[int, int]:
    """First and last frame with enough markers; the first of all where none has."""
    ever = count_ever(markers)
    frames = [f for f, frame in enumerate(markers) if is_enough(frame, ever)]
    return (frames[0], frames[-1]) if frames else (0, 0)


def _chunks(markers: Array, ever: int, dt: float) -> list[tuple[int, int]]:
    """First frame of every chunk, and one past its last; where a body comes back, a chunk begins."""
    few = np.isfinite(markers[..., 0]).sum(axis=1) < FEW
    size = max(1, min(CHUNK, round(MOMENT / dt)))
    away, edges = 0, set(range(0, len(markers), size))
    for f, frame in enumerate(markers):
        if few[f] or (away and not is_enough(frame, ever)):
            away += 1
            continue
        if away * dt > PATIENCE:
            edges.add(f)
        away = 0
    return list(pairwise([*sorted(edges), len(markers)]))


def _follows(run: Followed) -> NDArray[np.bool_]:
    """(F,) whether enough markers are used, and at least half of these near their places."""
    used = np.isin(run.flags, (tp.USED, tp.SWAPPED))
    count, near = used.sum(axis=1), np.sum(used & (run.residual <= OFF), axis=1)
    return np.asarray((count >= FEW) & (2 * near >= count))


def _cost(run: Followed) -> float:
    """Sum over all markers of the squared distance to their places, each up to twice ``OFF`` [m^2]."""
    seen = run.flags != tp.LOST
    return float(np.sum(np.minimum(run.residual, 2 * OFF)[seen] ** 2))
