"""Goals of a frame as an array: position and rotation (7) of every task.

Infinity where it is off, NaN where it is unknown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.errors import TargetError, listed
from sixpoint.solvers.prioritized.tasks import ObstacleTask, PlaneTask, Task

Array = NDArray[np.float64]
Goals = Mapping[str, ArrayLike] | ArrayLike

FAR = 1e7  # a position farther away is unknown [m], as in Sequential IK
UNTURNED = (0.0, 0.0, 0.0, 1.0)
UNTURNED_OFF = (np.inf, np.inf, np.inf, *UNTURNED)


class GoalTable:
    """Which tasks take a goal, and what they have without one."""

    def __init__(self, tasks: Sequence[Task]) -> None:
        self._tasks = {task.label: task for task in tasks}
        self.infinite_is_unknown = False
        self.rows = [k for k, task in enumerate(tasks) if task.takes_goal]
        self.names = tuple(tasks[k].label for k in self.rows)
        self.default = np.zeros((len(tasks), 7))
        self.default[:, 6] = 1.0
        for k in self.rows:
            self.default[k] = np.inf
            if tasks[k].goal is not None:
                self._write(self.default[k], tasks[k].goal, tasks[k].label)
        self._unturned = self.default.copy()
        self._unturned[np.isinf(self.default[:, 3])] = UNTURNED_OFF
        together = self.rows == list(range(len(self.rows)))
        self._places = slice(len(self.rows)) if together else np.array(self.rows, int)

    def compute(self, goals: Goals) -> Array:
        """One frame (T, 7) from a mapping of names, or an array with a row per name in ``names``."""
        if isinstance(goals, Mapping):
            out = self.default.copy()
            for name, value in goals.items():
                if name not in self.names:
                    raise TargetError(f"no task named {name!r} takes a goal; there are: {listed(self.names)}")
                self._write(out[self.rows[self.names.index(name)]], value, name)
            for k, name in zip(self.rows, self.names, strict=True):
                if (
                    isinstance(self._tasks[name], ObstacleTask)
                    and np.isinf(out[k]).any()
                    and name not in goals
                ):
                    raise TargetError(f"the obstacle {name!r} is nowhere: give it a goal, or None for off")
            return out
        try:
            rows = np.asarray(goals, float)
        except (TypeError, ValueError):
            raise self._wrong_shape(type(goals).__name__) from None
        out = self._start_of(rows.shape).copy()
        out[self._places, : rows.shape[1]] = self._clean(rows)
        return out

    def compute_frames(self, goals: Array) -> Array:
        """Frames (F, T, 7) from an array (F, G, 3) or (F, G, 7)."""
        out = np.tile(self._start_of(goals.shape[1:]), (len(goals), 1, 1))
        out[:, self._places, : goals.shape[2]] = self._clean(goals)
        return out

    def _start_of(self, shape: tuple[int, ...]) -> Array:
        """What an array of goals of one frame is written over: a position alone is not turned."""
        if shape == (len(self.names), 3):
            turned = [name for name in self.names if self._tasks[name].turns]
            if turned:
                raise TargetError(f"{listed(turned)} need rotations: give goals ({len(self.names)}, 7)")
            return self._unturned
        if shape == (len(self.names), 7):
            return self.default
        raise self._wrong_shape(shape)

    def _clean(self, goals: Array) -> Array:
        """Infinity is a task switched off, unless it stands for a lost point."""
        return np.where(np.isinf(goals), np.nan, goals) if self.infinite_is_unknown else goals

    def _wrong_shape(self, got: object) -> TargetError:
        count = len(self.rows)
        return TargetError(
            f"goals must be numbers ({count}, 3) or ({count}, 7), NaN where unknown: one row each for "
            f"{listed(self.names)}; got {got}"
        )

    def _write(self, row: Array, value: ArrayLike | None, name: str) -> None:
        """Write a position (3,), a rotation (4,) or both (7,) into a row of seven; None is off."""
        if value is None:
            row[:] = np.inf
            return
        try:
            goal = np.asarray(value, float)
        except (TypeError, ValueError):
            goal = np.zeros(0)
        task = self._tasks[name]
        if (
            goal.shape in ((3,), (4,))
            and (goal.shape == (4,)) != task.turns
            and not isinstance(task, PlaneTask | ObstacleTask)
        ):
            wanted = "a rotation (4,)" if task.turns else "a position (3,)"
            raise TargetError(f"the goal of {name!r} is {wanted} or both (7,); got {goal.shape}")
        goal = self._clean(goal)
        if goal.shape == (3,):
            row[:3] = goal
            if np.isinf(row[3:]).any():
                row[3:] = UNTURNED
        elif goal.shape == (4,):
            row[3:] = goal
            if np.isinf(row[:3]).any():
                row[:3] = 0.0
        elif goal.shape == (7,):
            row[:] = goal
        else:
            raise TargetError(
                f"the goal of {name!r} is a position (3,), a rotation (4,) or both (7,); got {goal.shape}"
            )
