"""Goals of a frame as an array: position and rotation (7) of every task, NaN where it is off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.errors import TargetError, listed
from sixpoint.solvers.prioritized.tasks import Task

Array = NDArray[np.float64]
Goals = Mapping[str, ArrayLike] | ArrayLike

UNTURNED = (0.0, 0.0, 0.0, 1.0)


class GoalTable:
    """Which tasks take a goal, and what they have without one."""

    def __init__(self, tasks: Sequence[Task]) -> None:
        self.rows = [k for k, task in enumerate(tasks) if task.takes_goal]
        self.names = tuple(tasks[k].label for k in self.rows)
        self.default = np.zeros((len(tasks), 7))
        self.default[:, 6] = 1.0
        for k in self.rows:
            self.default[k] = np.nan
            if tasks[k].goal is not None:
                self._write(self.default[k], tasks[k].goal, tasks[k].label)

    def compute(self, goals: Goals) -> Array:
        """One frame (T, 7) from a mapping of names, or an array with a row per name in ``names``."""
        if isinstance(goals, Mapping):
            out = self.default.copy()
            for name, value in goals.items():
                if name not in self.names:
                    raise TargetError(f"no task named {name!r} takes a goal; there are: {listed(self.names)}")
                self._write(out[self.rows[self.names.index(name)]], value, name)
            return out
        try:
            frame: Array = self.compute_frames(np.asarray(goals, float)[None])[0]
            return frame
        except (TypeError, ValueError):
            raise self._wrong_shape(type(goals).__name__) from None

    def compute_frames(self, goals: Array) -> Array:
        """Frames (F, T, 7) from an array (F, G, 3) or (F, G, 7)."""
        if goals.ndim != 3 or goals.shape[1:] not in ((len(self.rows), 3), (len(self.rows), 7)):
            raise self._wrong_shape(goals.shape[1:])
        out = np.tile(self.default, (len(goals), 1, 1))
        width = goals.shape[2]
        out[:, self.rows, :width] = goals
        if width == 3:  # a position alone is not turned, and switches a task on that has no goal of its own
            unknown = np.isnan(self.default[self.rows, 3:]).any(axis=1)
            out[:, np.array(self.rows, int)[unknown], 3:] = UNTURNED
        return out

    def _wrong_shape(self, got: object) -> TargetError:
        count = len(self.rows)
        return TargetError(
            f"goals must be numbers ({count}, 3) or ({count}, 7), NaN where unknown: one row each for "
            f"{listed(self.names)}; got {got}"
        )

    @staticmethod
    def _write(row: Array, value: ArrayLike | None, name: str) -> None:
        """Write a position (3,), a rotation (4,) or both (7,) into a row of seven."""
        try:
            goal = np.asarray(value, float)
        except (TypeError, ValueError):
            goal = np.zeros(0)
        if goal.shape == (3,):
            row[:3] = goal
            if np.isnan(row[3:]).any():
                row[3:] = UNTURNED
        elif goal.shape == (4,):
            row[3:] = goal
            if np.isnan(row[:3]).any():
                row[:3] = 0.0
        elif goal.shape == (7,):
            row[:] = goal
        else:
            raise TargetError(
                f"the goal of {name!r} is a position (3,), a rotation (4,) or both (7,); got {goal.shape}"
            )
