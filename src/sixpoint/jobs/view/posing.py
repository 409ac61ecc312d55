"""How the page poses: a method with its settings, and what it makes of a clip."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion, Pose
from sixpoint.body.targets import EFFECTORS
from sixpoint.jobs.progress import Progress, silent
from sixpoint.jobs.view.clips import Clip
from sixpoint.jobs.view.settings import PRIORITIZED, read_settings
from sixpoint.jobs.view.task_list import DEFAULT, Row, TaskSolver
from sixpoint.solvers.base import MotionSolution, Solution, Solver
from sixpoint.solvers.prioritized.tasks import Box, Sphere
from sixpoint.solvers.registry import DEFAULT as METHOD
from sixpoint.solvers.registry import make_solver
from sixpoint.study.limit_excess import compute_limit_excess
from sixpoint.study.metrics import Errors, compute_errors
from sixpoint.study.movement import compute_local_rotations
from sixpoint.viewer.scene import BOX, OBSTACLES, SPHERE

Array = NDArray[np.float64]

SHAPES: tuple[Sphere | Box, ...] = (Sphere(SPHERE), Box(BOX))
LEAD = 60  # frames solved before one from which dragging begins, for what methods remember
AT_LIMIT, NEUTRAL = np.radians(0.5), np.radians(2.0)


@dataclass(frozen=True, eq=False)
class Posing:
    """A method as it is set.

    Attributes:
        method: A name of ``SOLVERS``, or ``module:Class``.
        values: Name of a setting -> its value, of all methods.
        rows: Tasks of prioritized IK.
        obstacles: Number of an obstacle -> its place (7,); only prioritized IK knows of them.
    """

    method: str = METHOD
    values: dict[str, Any] = field(default_factory=dict)
    rows: tuple[Row, ...] = DEFAULT
    obstacles: dict[int, Array] = field(default_factory=dict)

    @property
    def prioritized(self) -> bool:
        """Whether there is a list of tasks."""
        return self.method in PRIORITIZED

    @property
    def turned(self) -> list[bool]:
        """Which of the six rotations count."""
        asked = read_settings(self.method, self.values).get("rotations", ())
        return [name in asked for name in EFFECTORS]

    def with_setting(self, name: str, value: Any) -> Posing:
        """With another value."""
        return replace(self, values={**self.values, name: value})

    def with_obstacle(self, number: int, place: Array | None) -> Posing:
        """With an obstacle elsewhere, or without it; it has a row in the list while it is there."""
        name = OBSTACLES[number]
        obstacles = {k: p for k, p in self.obstacles.items() if k != number}
        rows = self.rows
        if place is None:
            rows = tuple(row for row in rows if row.name != name)
        else:
            obstacles[number] = place
            if name not in [row.name for row in rows]:
                rows = (Row(name, 0), *rows)
        return replace(self, obstacles=obstacles, rows=rows)

    def make(self, figure: Figure) -> Solver:
        """The solver.

        Raises:
            SixpointError: The settings do not go together.
        """
        options = read_settings(self.method, self.values)
        if not self.prioritized:
            return make_solver(self.method, figure, **options)
        things = {OBSTACLES[k]: (SHAPES[k], place) for k, place in self.obstacles.items()}
        return TaskSolver(figure, self.rows, flext=self.method == "pik-flext", obstacles=things, **options)


@dataclass(frozen=True, eq=False)
class SolvedClip:
    """What a method makes of a clip.

    Attributes:
        solution: Postures, status and residuals.
        seconds: Time per frame [s].
        errors: Against the truth, if there is one.
    """

    solution: MotionSolution
    seconds: float
    errors: Errors | None

    @property
    def motion(self) -> Motion:
        """The postures."""
        return self.solution.motion


def solve_clip(solver: Solver, clip: Clip, progress: Progress = silent) -> SolvedClip:
    """Pose every frame of a clip; kernels are compiled before the clock starts."""
    solver.warm_up()
    start = time.perf_counter()
    solution = solver.solve_frames(clip.targets, lambda done: progress("solving", done, len(clip.targets)))
    seconds = (time.perf_counter() - start) / len(clip.targets)
    errors = compute_errors(clip.figure, clip.truth, solution.motion) if clip.truth else None
    return SolvedClip(solution, seconds, errors)


def solve_frame(
    solver: Solver, points: Array, rotations: Array, previous: Solution | None, dt: float
) -> Solution:
    """Pose one frame; rotations (6, 4) are given to a method that takes them."""
    if getattr(solver, "rotations", ()):
        return solver.solve(points, previous, dt, rotations=rotations)  # type: ignore[call-arg]
    return solver.solve(points, previous, dt)


def solve_up_to(solver: Solver, clip: Clip, frame: int, rotations: Array) -> Solution | None:
    """The solution of a frame with what the method remembers by then; None at the very beginning."""
    solution: Solution | None = None
    turned = clip.targets.rotations
    for k in range(max(0, frame - LEAD), frame + 1):
        given = rotations if turned is None else turned[k]
        solution = solve_frame(solver, clip.targets.positions[k], given, solution, 1 / clip.targets.rate)
    return solution


def find_limited(figure: Figure, pose: Pose) -> list[int]:
    """Joints at or beyond their limits; not neutral ones, as a straight knee always is at its limit."""
    motion = Motion.from_poses([pose], 1.0)
    excess = compute_limit_excess(figure, motion, AT_LIMIT)[0]
    joints = np.flatnonzero(excess > 0)
    local = compute_local_rotations(figure, motion, joints.tolist())[0]
    return [int(joint) for joint, turn in zip(joints, rot.angle(local), strict=True) if turn > NEUTRAL]
