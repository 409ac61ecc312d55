"""Prioritized IK: any number of constraints on any articulated body, honoured in strict order.

References: Baerlocher and Boulic, "An inverse kinematics architecture enforcing an arbitrary number of strict
priority levels", The Visual Computer 20 (2004); Boulic and Raunhardt, "Integrated analytic and linearized
inverse kinematics for precise full body interactions", MIG 2009.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.dofs import Dofs, Hinges
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion, Pose
from sixpoint.body.skeleton import Skeleton
from sixpoint.body.targets import EFFECTORS, Targets
from sixpoint.errors import SixpointError, TargetError
from sixpoint.solvers.base import MotionSolution, Progress, Solution, Status
from sixpoint.solvers.prioritized.articulation import Articulation
from sixpoint.solvers.prioritized.engine.packing import pack_settings
from sixpoint.solvers.prioritized.full_body import attractor_state, default_tasks, place_base
from sixpoint.solvers.prioritized.goals import Goals, GoalTable
from sixpoint.solvers.prioritized.linear_step import LinearStep, read_step
from sixpoint.solvers.prioritized.model import check_tasks, lower
from sixpoint.solvers.prioritized.options import FRAME, at_frame_time, build_settings, cold
from sixpoint.solvers.prioritized.running import Engine, Frames
from sixpoint.solvers.prioritized.tasks import Task
from sixpoint.solvers.sequential.solver import SequentialIK

Array = NDArray[np.float64]
STATUSES = tuple(Status)
CHUNK = 64  # frames between two reports of progress
TRACE = 0.05  # less than this holds nothing
SHARE = 0.3  # a task that holds this much of what another needs made it give way


class PrioritizedIK:
    """Prioritized Inverse Kinematics with the FLEXT constraint.

    Args:
        body: A figure, or a skeleton with ``dofs``.
        tasks: The constraints; level 0 is the most important.
        dofs: What may move; a figure has its own.
        limits: Keep every joint within its limits.
        gain: Share of the error that one iteration asks for, in (0, 1].
        iterations: Most iterations of a frame that continues another.
        cold_iterations: Most iterations of a frame with neither a previous one nor a start.
        least_iterations: Fewest iterations of a frame.
        max_angle: Largest turn of a joint in one iteration [rad].
        max_shift: Largest translation of the base in one iteration [m].
        rank_threshold: Rows shorter than this share of the longest of their level, after projection, are
            beyond what is left to move.

    Raises:
        SixpointError: An option, a task or the body makes no sense; the message says what would.
    """

    def __init__(
        self,
        body: Figure | Skeleton,
        tasks: Sequence[Task],
        *,
        dofs: Dofs | None = None,
        limits: bool = True,
        gain: float = 1.0,
        iterations: int = 20,
        cold_iterations: int = 50,
        least_iterations: int = 1,
        max_angle: float = 1.0,
        max_shift: float = 0.1,
        rank_threshold: float = 1e-4,
    ) -> None:
        self.body = Articulation.of(body, dofs)
        self.tasks, self.posture = check_tasks(self.body, tasks)
        self._settings = build_settings(
            self.posture, limits, gain, max_angle, max_shift, rank_threshold, iterations, least_iterations
        )
        self._cold_settings = pack_settings(cold(self._settings, cold_iterations))
        self._engine = Engine(lower(self.body, self.tasks, self.posture, limits), len(self.tasks))
        self._goals = GoalTable(self.tasks)
        self._start = self.body.rest_state()
        self._fixed = ~self.body.moving_rows()
        self._no_starts = np.empty((0, *self._start.shape))
        self._attractor = attractor_state(self.body, self.posture)[None]
        self._adapted: dict[float, Array] = {}
        self._starter: SequentialIK | None = None
        self._restart = False

    @classmethod
    def from_targets(
        cls,
        figure: Figure,
        *,
        flext: bool = True,
        limits: bool = True,
        start: Literal["previous", "sequential"] = "previous",
        tasks: Sequence[Task] | None = None,
        tolerance: float | None = None,
        **options: Any,
    ) -> PrioritizedIK:
        """A solver of the six points, with the default levels of ``full_body.default_tasks``.

        Args:
            figure: What to pose.
            flext: Limbs by FLEXT tasks, else by plain position tasks.
            limits: Keep every joint within its limits.
            start: Begin each frame from the frame before (the first from Sequential IK), or each from
                Sequential IK.
            tasks: Other tasks, one goal each for the six effectors in their order.
            tolerance: Error at which the default tasks stop iterating [m]; None for 1 mm.
            **options: Those of ``PrioritizedIK``.
        """
        if start not in ("previous", "sequential"):
            raise SixpointError(f"start is 'previous' or 'sequential', got {start!r}")
        solver = cls(figure, tasks or default_tasks(flext, tolerance), limits=limits, **options)
        if len(solver.goal_names) != len(EFFECTORS):
            raise SixpointError(f"the six points need six tasks with a goal, got {len(solver.goal_names)}")
        solver._starter = SequentialIK(figure, limits=limits)
        solver._goals.infinite_is_unknown = True
        solver._restart = start == "sequential"
        return solver

    @property
    def figure(self) -> Figure:
        """The figure that is posed."""
        if self.body.figure is None:
            raise SixpointError("this solver poses a plain skeleton, which is no figure")
        return self.body.figure

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the tasks, in the order of residuals."""
        return tuple(task.label for task in self.tasks)

    @property
    def goal_names(self) -> tuple[str, ...]:
        """Names of the tasks that take a goal, in the order of an array of goals."""
        return self._goals.names

    def compute_goals(self, goals: Goals) -> Array:
        """One frame of goals as (T, 7): position and rotation of every task, not finite where it is off.

        Args:
            goals: Name -> position (3,), rotation (4,) or both (7,), or None for off; names left out keep
                the task's own goal, if it has one. Or an array (G, 3) or (G, 7), a row per name in
                ``goal_names``.

        Raises:
            TargetError: An unknown name, or a wrong shape; the message lists names or shapes.
        """
        return self._goals.compute(goals)

    # --- solving ---------------------------------------------------------------------------------

    def solve(
        self,
        goals: Goals,
        previous: Solution | None = None,
        dt: float = 1 / 60,
        *,
        start: Pose | None = None,
        posture: Pose | None = None,
    ) -> Solution:
        """Pose the body for one frame.

        Args:
            goals: See ``compute_goals``. Of a solver made by ``from_targets``: (6, 3) points [m].
            previous: The solution of the frame before, if any.
            dt: Time since that frame [s]: how far the posture may drift.
            start: Pose to begin from, instead of the previous one.
            posture: Pose that the posture task is drawn to in this frame.

        Raises:
            TargetError: The goals have another shape or unknown names.
            SixpointError: ``previous``, ``start`` or ``posture`` is of another body.
        """
        frame = self.compute_goals(goals)
        begun: tuple[Array, ...] = ()
        if start is None and self._starter is not None and (previous is None or self._restart):
            first = self._starter.solve(frame[self._goals.rows, :3], self._started(previous), dt)
            start, begun = first.pose, first.state if self._restart else ()
        state = self.body.state_of(start) if start is not None else self._state_after(previous)
        if previous is None and start is None:
            place_base(self.body, self.tasks, frame, state)
        settings = self._cold_settings if previous is None and start is None else self._settings_at(dt)
        attractor = self._attractor if posture is None else self.body.state_of(posture)[None]
        out = self._engine.run(frame[None], self._no_starts, state, attractor, settings, explain=True)
        moving, translations = self.body.place_base(out.rotations, out.positions)
        pose = Pose(self.body.rig, out.rotations[0], translations[0], moving)
        status = STATUSES[out.status[0]]
        gave_way = {} if status is Status.CONVERGED else self._gave_way(out.yielded[0])
        return Solution(pose, status, out.residual[0], int(out.iterations[0]), (state, *begun), gave_way)

    def begin(self, pose: Pose) -> Solution:
        """A solution to go on from that takes a pose as it is; give it as ``previous``."""
        state = self.body.state_of(pose)
        return Solution(pose, Status.CONVERGED, np.zeros(len(self.tasks)), 0, (state,))

    def compute_step(
        self, goals: Goals, previous: Solution | None = None, *, start: Pose | None = None
    ) -> LinearStep:
        """The linear problem and its solution at a pose, for study and tests; the pose is not changed.

        Args:
            goals: See ``compute_goals``.
            previous: Solution whose pose is meant; without it ``start``, else the rest pose.
            start: Pose that is meant.
        """
        state = self.body.state_of(start) if start is not None else self._state_after(previous)
        settings = pack_settings(self._settings._replace(most=-1, least=1))
        scratch = self._engine.make_scratch()
        for array in scratch:
            array.fill(0)
        goal = self.compute_goals(goals)
        out = self._engine.run(goal[None], self._no_starts, state, self._attractor, settings, scratch)
        return read_step(self._engine.lowered, scratch, int(out.iterations[0]))

    def solve_frames(self, targets: Targets | Array, progress: Progress | None = None) -> MotionSolution:
        """Pose the body for every frame.

        Args:
            targets: The six points of a solver made by ``from_targets``, or goals (F, G, 3) or (F, G, 7) at
                60 Hz, a row per name in ``goal_names``.
            progress: Called with the number of frames done.
        """
        if isinstance(targets, Targets):
            positions, rate, name = targets.positions, targets.rate, targets.name
        else:
            positions, rate, name = np.asarray(targets, float), 60.0, "prioritized"
            if self._starter is not None and positions.ndim == 3 and positions.shape[1:] == (6, 3):
                return self.solve_frames(Targets(positions, rate, name=name), progress)
            if positions.ndim != 3 or len(positions) == 0:
                raise TargetError(
                    f"goals of frames are an array (frames, tasks, 3 or 7), got {positions.shape}"
                )
        goals = self._goals.compute_frames(positions)
        starts = self._no_starts
        if self._starter is not None and isinstance(targets, Targets):
            starts = self._sequential_starts(targets if self._restart else targets.sliced(slice(1)))
        state = self._start.copy()
        if not len(starts):
            place_base(self.body, self.tasks, goals[0], state)
        frames = len(goals)
        parts = []
        step = CHUNK if progress else frames
        cold = 0 if len(starts) else 1
        for part in _parts(frames, step, cold):
            settings = self._cold_settings if part.stop == cold else self._settings_at(1 / rate)
            parts.append(self._engine.run(goals[part], starts[part], state, self._attractor, settings))
            if progress:
                progress(part.stop)
        out = Frames(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))
        moving, translations = self.body.place_base(out.rotations, out.positions)
        out.rotations.flags.writeable = False  # hand over instead of copying
        motion = Motion(self.body.rig, out.rotations, translations, rate, moving, name=name)
        return MotionSolution(motion, out.status, out.residual)

    def solve_motion(self, targets: Targets) -> Motion:
        """Pose the body for every frame."""
        return self.solve_frames(targets).motion

    def hinge_angles(self, solution: Solution) -> dict[str, Array]:
        """Angles (k,) [rad] of every joint made of hinges, by joint name, of a solution of this solver."""
        state, tree = self._state_after(solution), self.body.tree
        angles = {j: dof.size for j, dof in self.body.dofs.joints.items() if isinstance(dof, Hinges)}
        return {tree.names[j]: state[len(tree) + 1 + j, :size] for j, size in sorted(angles.items())}

    def warm_up(self) -> None:
        """Compile the kernels, or load them from disk, on the rest pose."""
        state = self._start.copy()
        self._engine.run(
            self._goals.default[None], self._no_starts, state, self._attractor, self._settings_at(FRAME)
        )
        if self._starter is not None:
            self._starter.warm_up()

    def _started(self, previous: Solution | None) -> Solution | None:
        """The Sequential IK solution that belongs to a previous one, if that began from it."""
        self._state_after(previous)  # of this body?
        if previous is None or len(previous.state) < 2:
            return None
        return replace(previous, state=previous.state[1:])

    def _sequential_starts(self, targets: Targets) -> Array:
        """States (F, 2 J + 1, 4) of the Sequential IK solutions."""
        assert self._starter is not None
        motion = self._starter.solve_motion(targets)
        return self.body.states_of(motion.rotations, motion.positions[:, self.body.base])

    def _settings_at(self, dt: float) -> Array:
        """Settings whose posture drifts alike at every frame rate; the last ones asked for are kept."""
        known = self._adapted.get(dt)
        if known is None:
            if len(self._adapted) > 100:
                self._adapted.clear()
            known = self._adapted[dt] = pack_settings(at_frame_time(self._settings, dt))
        return known

    def _state_after(self, previous: Solution | None) -> Array:
        if previous is None:
            return self._start.copy()
        if previous.pose.skeleton is not self.body.rig or previous.state[0].shape != self._start.shape:
            raise SixpointError("previous is of another body or method; begin with previous=None")
        state = previous.state[0].copy()
        np.copyto(state, self._start, where=self._fixed)  # another solver of this body may move more joints
        return state

    def _gave_way(self, shares: Array) -> dict[str, tuple[str, ...]]:
        """Unmet task -> what holds the motion it needs."""
        names = (*self.names, "joint limits")
        found = {}
        for k, (name, row) in enumerate(zip(names, shares, strict=False)):
            if row[k] > 0.0:  # unmet; the most important cause first, at least the largest if there is any
                row[k] = 0.0
                order = np.argsort(-row, kind="stable")
                held = [k for k in order if row[k] > SHARE] or [k for k in order[:1] if row[k] > TRACE]
                found[name] = tuple(names[k] for k in held)
        return found


def _parts(frames: int, step: int, cold: int) -> list[slice]:
    """Slices of at most ``step`` frames; the first ``cold`` frames are one of their own."""
    edges = [0, *range(cold, frames, step), frames]
    return [slice(a, b) for a, b in pairwise(edges) if a < b]
