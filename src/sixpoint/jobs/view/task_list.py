"""Tasks of prioritized IK that can be reordered and switched off, and the solver of six points they make."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.body.rig_names import SIDES
from sixpoint.body.roles import LIMB_ROLES
from sixpoint.body.targets import EFFECTORS, Targets, as_points
from sixpoint.solvers.base import MotionSolution, Progress, Solution
from sixpoint.solvers.prioritized.solver import PrioritizedIK
from sixpoint.solvers.prioritized.tasks import (
    BalanceTask,
    Box,
    FlextTask,
    ObstacleTask,
    PositionTask,
    PostureTask,
    Sphere,
    Task,
)
from sixpoint.solvers.sequential.solver import SequentialIK

Array = NDArray[np.float64]

APART = 3
"""Engine levels between two of the list's: a FLEXT limb uses two more for what it asks of the body."""
FLESH = 0.05  # of what keeps out of an obstacle [m]
CHUNK = 64  # frames between two reports of progress
WATCHED = ("head", "pelvis", *(f"{side}_{role}" for role in LIMB_ROLES for side in SIDES))
"""What an obstacle keeps out."""


@dataclass(frozen=True)
class Row:
    """A line of the list.

    Attributes:
        name: An effector's, "balance", "posture" or an obstacle's.
        level: Priority, 0 is the most important; rows may share one.
        on: Whether it counts.
    """

    name: str
    level: int
    on: bool = True


DEFAULT = (
    Row("pelvis", 0),
    Row("l_ankle", 1),
    Row("r_ankle", 1),
    Row("l_wrist", 2),
    Row("r_wrist", 2),
    Row("head", 3),
    Row("balance", 4, on=False),
    Row("posture", 9),
)
"""The order that ``--method pik`` has, and a balance that may be switched on."""
LAST = 9


def change(rows: tuple[Row, ...], number: int, step: int = 0, toggle: bool = False) -> tuple[Row, ...]:
    """A list with one row at a more (-1) or less (+1) important level, or switched; sorted by level.

    The posture stays last: it takes what all others leave.
    """
    row = rows[number]
    if row.name != "posture":
        row = replace(row, level=min(max(row.level + step, 0), LAST - 1))
    if toggle:
        row = replace(row, on=not row.on)
    changed = (*rows[:number], row, *rows[number + 1 :])
    return tuple(sorted(changed, key=lambda row: row.level))


class TaskSolver:
    """Prioritized IK of the six points by a list of tasks, with obstacles; a ``Solver``.

    The first frame begins from Sequential IK, each other from the frame before.

    Args:
        figure: What to pose.
        rows: The list.
        flext: Limbs by FLEXT tasks, else by plain positions.
        limits: Keep every joint within its limits.
        obstacles: Name of a row -> its shape and its place (7,); joints stay out.
    """

    def __init__(
        self,
        figure: Figure,
        rows: tuple[Row, ...] = DEFAULT,
        *,
        flext: bool = False,
        limits: bool = True,
        obstacles: Mapping[str, tuple[Sphere | Box, Array]] | None = None,
    ) -> None:
        self._figure = figure
        obstacles = obstacles or {}
        made = {row.name: _make(row, flext, obstacles) for row in rows if row.on}
        self._solver = PrioritizedIK(figure, [t for tasks in made.values() for t in tasks], limits=limits)
        self._starter = SequentialIK(figure, limits=limits)
        self._on = [k for k, name in enumerate(EFFECTORS) if name in made]
        self._where = [self._solver.names.index(EFFECTORS[k]) for k in self._on]

    @property
    def figure(self) -> Figure:
        """What is posed."""
        return self._figure

    def solve(self, points: ArrayLike, previous: Solution | None = None, dt: float = 1 / 60) -> Solution:
        """Pose the figure for six points (6, 3) [m]; the residual is that of the six, 0 where one is off."""
        frame = as_points(points)
        goals = {EFFECTORS[k]: frame[k] for k in self._on}
        start = self._starter.solve(frame).pose if previous is None else None
        solution = self._solver.solve(goals, previous, dt, start=start)
        residual = np.zeros(len(EFFECTORS))
        residual[self._on] = solution.residual[self._where]
        return replace(solution, residual=residual)

    def solve_frames(self, targets: Targets, progress: Progress | None = None) -> MotionSolution:
        """Pose the figure for every frame."""
        solution: Solution | None = None
        solutions: list[Solution] = []
        for k, points in enumerate(targets.positions):
            solution = self.solve(points, solution, 1 / targets.rate)
            solutions.append(solution)
            if progress and k % CHUNK == CHUNK - 1:
                progress(k + 1)
        motion = Motion.from_poses([s.pose for s in solutions], targets.rate)
        status = np.array([s.status for s in solutions], np.int64)
        return MotionSolution(motion, status, np.array([s.residual for s in solutions]))

    def solve_motion(self, targets: Targets) -> Motion:
        """Pose the figure for every frame."""
        return self.solve_frames(targets).motion

    def warm_up(self) -> None:
        """Compile the kernels, or load them from disk."""
        self._starter.warm_up()
        self._solver.warm_up()


def _make(row: Row, flext: bool, obstacles: Mapping[str, tuple[Sphere | Box, Array]]) -> list[Task]:
    level = APART * row.level
    if row.name in obstacles:
        shape, place = obstacles[row.name]
        keep: dict[str, Any] = {"shape": shape, "goal": place, "margin": FLESH, "level": level}
        return [ObstacleTask(WATCHED[0], points=WATCHED[1:], name=row.name, **keep)]
    others: dict[str, Callable[[], Task]] = {
        "posture": PostureTask,
        "balance": lambda: BalanceTask(level=level),
    }
    if row.name in others:
        return [others[row.name]()]
    if flext and row.name not in ("pelvis", "head"):
        return [FlextTask(row.name, level=level, drag=True)]
    return [PositionTask(row.name, level=level)]
