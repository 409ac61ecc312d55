"""Run the compiled engine: allocate what it writes, hand over few arrays."""

from __future__ import annotations

import logging
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sixpoint.kernels.jit import is_cached
from sixpoint.solvers.prioritized.engine.frame import solve_prioritized
from sixpoint.solvers.prioritized.engine.packing import pack_model
from sixpoint.solvers.prioritized.model import Lowered, scratch_sizes

Array = NDArray[np.float64]

log = logging.getLogger("sixpoint")


class Frames(NamedTuple):
    """What a run over frames writes.

    Attributes:
        rotations: (F, J, 4) local rotations of the rig.
        positions: (F, 3) position of the base [m].
        status: (F,) numbers of ``Status``.
        residual: (F, T) error of every task [m or rad].
        iterations: (F,) iterations.
        yielded: (F, T, T + 1) or nothing: see ``engine.yielding``.
    """

    rotations: Array
    positions: Array
    status: NDArray[np.int64]
    residual: Array
    iterations: NDArray[np.int64]
    yielded: Array


class Engine:
    """The compiled engine with the arrays of one body and its tasks."""

    def __init__(self, lowered: Lowered, tasks: int) -> None:
        self.lowered = lowered
        table, integers = pack_model(lowered.model)
        integers[6] = lowered.rows
        self._arrays = (table, integers, lowered.balls, lowered.index, lowered.values)
        self._sizes = scratch_sizes(lowered)
        self._joints, self._tasks = len(lowered.model.parent), tasks

    def run(
        self,
        goals: Array,
        starts: Array,
        state: Array,
        attractors: Array,
        settings: Array,
        scratch: tuple[Array, ...] | None = None,
        explain: bool = False,
    ) -> Frames:
        """Solve frames of goals (F, T, 7); ``state`` becomes that after the last.

        Args:
            goals: Position and rotation of every task, NaN where it is off.
            starts: (S, 2 J + 1, 4) states to begin the first S frames from.
            state: (2 J + 1, 4) state to begin from otherwise.
            attractors: (A, 2 J + 1, 4) states that the posture is drawn to in the first A frames; the last
                one also in those that follow.
            settings: See ``engine.packing.Settings``.
            scratch: Working memory to look at afterwards.
            explain: Write what unmet tasks gave way to.
        """
        frames = len(goals)
        out = Frames(
            np.empty((frames, self._joints, 4)),
            np.empty((frames, 3)),
            np.empty(frames, np.int64),
            np.empty((frames, self._tasks)),
            np.empty(frames, np.int64),
            np.zeros((frames if explain else 0, self._tasks, self._tasks + 1)),
        )
        compiled = getattr(solve_prioritized, "signatures", True)
        if not compiled and not is_cached("solve_prioritized"):
            log.warning("compiling the prioritized engine, once (about half a minute)")
        scratch = scratch or self.make_scratch()
        arguments: list[Any] = [*self._arrays, settings, goals, starts, state, attractors, *scratch, *out]
        solve_prioritized(*arguments)
        return out

    def make_scratch(self) -> tuple[Any, ...]:
        """Working memory of one run, so that runs in several threads do not meet."""
        return (*(np.empty(size) for size in self._sizes[:4]), np.zeros(self._sizes[4], np.int64))
