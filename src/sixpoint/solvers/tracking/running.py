"""Run the compiled tracker: allocate what it writes, hand over few arrays."""

from __future__ import annotations

import logging
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sixpoint.kernels.jit import is_cached
from sixpoint.solvers.prioritized.engine.packing import pack_model
from sixpoint.solvers.prioritized.model import scratch_sizes
from sixpoint.solvers.tracking.engine import packing as tp
from sixpoint.solvers.tracking.engine.frame import steady_states, track_markers
from sixpoint.solvers.tracking.model import LoweredMarkers

Array = NDArray[np.float64]
Index = NDArray[np.int64]

log = logging.getLogger("sixpoint")


class Followed(NamedTuple):
    """What a run over frames writes; markers are in the caller's order.

    Attributes:
        rotations: (F, J, 4) local rotations of the rig.
        positions: (F, 3) position of the base [m].
        flags: (F, M) what became of each marker.
        residual: (F, M) distance of each seen marker from its place [m], 0 where it is lost.
        iterations: (F,) iterations.
    """

    rotations: Array
    positions: Array
    flags: Index
    residual: Array
    iterations: Index


def join(parts: list[Followed]) -> Followed:
    """Runs one after the other."""
    return Followed(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def reverse(run: Followed) -> Followed:
    """The frames from the last to the first."""
    return Followed(*(array[::-1] for array in run))  # type: ignore[arg-type]


class State(NamedTuple):
    """What the next frame needs.

    Attributes:
        pose: (2 J + 1, 4) local rotations, base position, hinge angles, as in prioritized IK.
        speed: (2 J + 1, 4) their rates of change [rad/s, m/s]. The fourth numbers: of joints, time in which
            they may still move to where they were found [s]; of the base, damping of the next frame [m]; of
            hinges, whether markers told the joint (1), and did in the frame before (2).
        lag: (2 J + 1, 4) what is shown beside the pose [rad, m], and how fast it fades [1/s].
        markers: (M, 8) per marker: distance from its place in the joint's frame [m], times since it was used
            and since it is refused [s], whether the distance is known, how much of it counts (0 to 1).
    """

    pose: Array
    speed: Array
    lag: Array
    markers: Array

    def copy(self) -> State:
        """The same numbers in arrays of their own."""
        return State(*(array.copy() for array in self))


class TrackingEngine:
    """The compiled tracker with the arrays of one body and its markers."""

    def __init__(self, low: LoweredMarkers) -> None:
        self.low = low
        body, integers = pack_model(low.lowered.model)
        integers[6] = low.lowered.rows
        self._body = (body, integers, low.lowered.balls)
        self._joints, self._markers = len(low.lowered.model.parent), len(low.order)
        self._back = np.argsort(low.order)

    def run(self, markers: Array, rest: Array, state: State, options: tp.Options) -> Followed:
        """Follow markers (F, M, 3); ``state`` becomes that after the last frame.

        Args:
            markers: Positions [m], NaN where a marker is not seen.
            rest: (2 J + 1, 4) state that what no marker tells is drawn to.
            state: Where to go on from.
            options: See ``MarkerTracker``.
        """
        low, frames = self.low, len(markers)
        compiled = getattr(track_markers, "signatures", True)
        if not compiled and not is_cached("track_markers"):
            log.warning("compiling the marker tracker, once (about half a minute)")
        out = Followed(
            np.empty((frames, self._joints, 4)),
            np.empty((frames, 3)),
            np.empty((frames, self._markers), np.int64),
            np.empty((frames, self._markers)),
            np.empty(frames, np.int64),
        )
        columns = len(low.lowered.model.hinges)
        sizes = scratch_sizes(low.lowered)
        arguments: list[Any] = [
            *self._body,
            low.lowered.index.copy(),
            low.lowered.values.copy(),
            low.table,
            low.segments,
            low.clusters,
            low.numbers,
            np.array(tp.pack_options(options)),
            np.ascontiguousarray(markers[:, low.order]),
            rest,
            *state,
            np.zeros((len(low.lowered.index), 5)),
            *(np.empty_like(state.pose) for _ in range(5)),
            np.zeros((5, self._joints, 4)),
            np.zeros((self._markers, 4)),
            np.zeros((6, 3)),
            np.zeros((columns + 1, columns)),
            *(np.zeros(size) for size in sizes[1:4]),
            np.zeros(sizes[4], np.int64),
            *out,
        ]
        track_markers(*arguments)
        return out._replace(flags=out.flags[:, self._back], residual=out.residual[:, self._back])

    def steady(self, states: Array, told: NDArray[np.bool_], rate: float, limits: bool) -> Array:
        """States (F, 2 J + 1, 4) in which joints that are not told (F, J) do not jump."""
        out, sizes = np.ascontiguousarray(states), scratch_sizes(self.low.lowered)
        like = np.zeros_like(out[0])
        arguments: list[Any] = [
            *self._body,
            limits,
            1 / rate,
            told,
            out,
            *(like.copy() for _ in range(7)),
            np.zeros((5, self._joints, 4)),
            *(np.zeros(size) for size in sizes[1:4]),
            np.zeros(sizes[4], np.int64),
            len(self.low.lowered.index),
        ]
        steady_states(*arguments)
        return out

    def fresh(self, pose: Array) -> State:
        """A state at rest in a pose, nothing known of the markers."""
        return State(
            pose.copy(), np.zeros_like(pose), np.zeros_like(pose), np.zeros((self._markers, tp.MEMORY))
        )
