"""The hybrid: a reconstruction, then at most three iterations of prioritized IK from it and towards it.

References: Unzueta et al. 2008, future work; Boulic and Raunhardt 2009 for the limbs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body.dofs import Dofs
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion, Pose
from sixpoint.body.targets import EFFECTORS, Targets, as_points
from sixpoint.errors import SixpointError
from sixpoint.solvers.base import MotionSolution, Progress, Solution, Solver, Status
from sixpoint.solvers.hybrid.feet import ROWS
from sixpoint.solvers.hybrid.goals import write_goals
from sixpoint.solvers.hybrid.levels import build_tasks, find_led, sole_depths
from sixpoint.solvers.prioritized.articulation import Articulation
from sixpoint.solvers.prioritized.engine.packing import ACCEPT, TASK, pack_settings
from sixpoint.solvers.prioritized.goals import Goals, GoalTable
from sixpoint.solvers.prioritized.model import check_tasks, lower
from sixpoint.solvers.prioritized.options import build_settings
from sixpoint.solvers.prioritized.running import Engine, Frames
from sixpoint.solvers.prioritized.tasks import PostureTask, Task
from sixpoint.solvers.sequential_plus.solver import SequentialIKPlus
from sixpoint.solvers.six_points.frame import REACHED

Array = NDArray[np.float64]

STATUSES = tuple(Status)
CHUNK = 512  # frames between two reports of progress
BACK = 0.5  # share of the way back to the reconstruction that one iteration asks for
LONG = 1e3  # s, longer pauses count as this
STRETCH = 0.9995  # a foot is held within this share of its leg's length


class HybridIK:
    """A reconstruction whose feet stand, hands keep contact, obstacles and balance hold.

    Another solver of the six points poses the figure first. Its pose is where prioritized IK starts in each
    frame and what it is drawn back to; a few iterations do the rest. Feet that stand (``hybrid.feet``) do not
    slide. Levels: 0 feet and floor; 10 pelvis, 11 its turn; 20 legs; 30 arms; 40 head. World Y must be up.

    Args:
        figure: What to pose.
        tasks: More constraints, each at a level of its own; those at 2 to 9 come after the feet and before
            the pelvis. One that moves a tracked point (a hand to its contact) moves it for ``start`` as well.
        start: The solver of the reconstruction, for the same figure; ``SequentialIKPlus`` by default.
        contacts: Hold feet that stand.
        floor: Height of the floor [m]: no ankle comes nearer to it than the rig's sole allows, and a foot
            whose ankle is 12 cm above it does not stand. Without it the floor is where each ankle was lowest.
        limits: Keep every joint within its limits; a solver given as ``start`` has its own say.
        iterations: Most iterations of a frame.
        dofs: What prioritized IK may move; a figure has its own. ``figure.full_dofs()`` adds forearms, wrists
            and ankles, which tasks on hands and feet need.

    Raises:
        SixpointError: An option or a task makes no sense, or ``start`` is of another figure.
    """

    fitted_on = SequentialIKPlus.fitted_on

    def __init__(
        self,
        figure: Figure,
        tasks: Sequence[Task] = (),
        *,
        start: Solver | None = None,
        contacts: bool = True,
        floor: float | None = None,
        limits: bool = True,
        iterations: int = 3,
        dofs: Dofs | None = None,
    ) -> None:
        if any(isinstance(task, PostureTask) for task in tasks):
            raise SixpointError("the posture of the hybrid is its reconstruction: leave the PostureTask out")
        if floor is not None and not np.isfinite(floor):
            raise SixpointError(f"the floor is a height [m], or None where it is to be learnt; got {floor}")
        self.figure = figure
        self.start = start or SequentialIKPlus(figure, limits=limits)
        if self.start.figure.skeleton is not figure.skeleton:
            raise SixpointError("start poses another figure: make it for the one that the hybrid poses")
        self.contacts = bool(contacts)
        self.floor = np.inf if floor is None else float(floor)
        self._body = Articulation.of(figure, dofs)
        own = build_tasks(self._body, floor)
        every, posture = check_tasks(self._body, [*own, *tasks, PostureTask(step=BACK)])
        self._engine = Engine(lower(self._body, every, posture, limits), len(every))
        settings = build_settings(posture, bool(limits), 1.0, 1.0, 0.1, 1e-4, iterations, 0)
        self._settings = pack_settings(settings._replace(drift=iterations))
        self._base_goals = GoalTable(every).default
        self._task_goals = GoalTable(tasks)
        self._led = find_led(tasks)
        self._lowest = None if floor is None else floor + np.array(sole_depths(self._body))
        self._measured = [*range(6), *range(len(own), len(every))]
        self._accepted = self._find_accepted()
        self.names: tuple[str, ...] = (*EFFECTORS, *(task.label for task in tasks))
        self._rig = np.column_stack([figure.skeleton.offsets, figure.skeleton.parents]).astype(float)
        roles = figure.roles
        joints = (roles.pelvis, roles.head, *roles.wrist, *roles.ankle)
        self._ends = np.array([[0.0, 0.0, 0.0, joint] for joint in joints])
        self._ends[1, :3] = roles.head_offset
        legs, between = roles.limbs[2:], figure.offset_between
        lengths = [np.linalg.norm(between(a, b)) + np.linalg.norm(between(b, c)) for a, b, c in legs]
        hips = [between(roles.pelvis, hip) for hip, _, _ in legs]
        self._legs = np.column_stack([hips, STRETCH * np.array(lengths)])

    def solve(
        self,
        points: ArrayLike,
        previous: Solution | None = None,
        dt: float = 1 / 60,
        *,
        goals: Goals | None = None,
    ) -> Solution:
        """Pose the figure for one frame.

        Args:
            points: (6, 3) positions of the effectors in the order of ``EFFECTORS`` [m]; NaN where lost.
            previous: The solution of the frame before, if any.
            dt: Time since that frame [s]; zero or less counts as no time.
            goals: Goals of the tasks in this frame, see ``PrioritizedIK.compute_goals``; those left out keep
                the task's own.

        Returns:
            The pose; residuals are those of the six points, then those of the tasks, as in ``names``.

        Raises:
            TargetError: ``points`` has another shape, or a goal has, or an unknown name.
            SixpointError: ``previous`` is of another figure or method.
        """
        frame = as_points(points)[None]
        before, memory = self._split(previous)
        given = self._task_goals.compute({} if goals is None else goals)
        wanted = self._lead(frame, given)
        begun = self.start.solve(wanted[0], before, dt)
        states = self._body.state_of(begun.pose)[None]
        out = self._refine(frame, wanted, begun.pose.rotations[None], states, dt, memory, given)
        moving, translations = self._body.place_base(out.rotations, out.positions)
        pose = Pose(self._body.rig, out.rotations[0], translations[0], moving)
        state = (*begun.state, memory)
        return Solution(pose, STATUSES[out.status[0]], out.residual[0], int(out.iterations[0]), state)

    def solve_frames(
        self, targets: Targets, progress: Progress | None = None, *, goals: Goals | None = None
    ) -> MotionSolution:
        """Pose the figure for every frame.

        Args:
            targets: Where the six points are.
            progress: Called with the number of frames done, every few hundred frames.
            goals: Goals of the tasks, the same in all frames; see ``solve``.
        """
        frames, dt = len(targets), 1.0 / targets.rate
        given = self._task_goals.compute({} if goals is None else goals)
        points, memory = targets.positions.copy(), self._split(None)[1]
        wanted = self._lead(points, given)
        begun = self.start.solve_motion(replace(targets, positions=wanted))
        base = self._body.base
        places = begun.translations[:, 0] if base == 0 else begun.positions[:, base]
        parts = []
        step = CHUNK if progress else frames
        for first in range(0, frames, step):
            part = slice(first, min(first + step, frames))
            turned = begun.rotations[part]
            states = self._body.states_of(turned, places[part])
            parts.append(self._refine(points[part], wanted[part], turned, states, dt, memory, given))
            if progress:
                progress(part.stop)
        out = Frames(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))
        moving, translations = self._body.place_base(out.rotations, out.positions)
        out.rotations.flags.writeable = False  # hand over instead of copying
        motion = Motion(self._body.rig, out.rotations, translations, targets.rate, moving, name=targets.name)
        return MotionSolution(motion, out.status, out.residual)

    def solve_motion(self, targets: Targets) -> Motion:
        """Pose the figure for every frame."""
        return self.solve_frames(targets).motion

    def warm_up(self) -> None:
        """Compile the kernels, or load them from disk, on the neutral pose."""
        self.start.warm_up()
        lost, rest = np.full((1, 6, 3), np.nan), self._body.rest_state()[None]
        turned = self.figure.neutral_pose.rotations[None]
        self._refine(lost, lost, turned, rest, 0.0, self._split(None)[1], self._task_goals.default)

    def _split(self, previous: Solution | None) -> tuple[Solution | None, Array]:
        """The reconstruction's solution in a previous one, and a copy of what is remembered of the feet."""
        if previous is None:
            return None, np.zeros((2 * ROWS, 4))
        memory = previous.state[-1]
        if previous.pose.skeleton is not self.figure.skeleton or memory.shape != (2 * ROWS, 4):
            raise SixpointError("previous is of another figure or method; begin with previous=None")
        return replace(previous, state=previous.state[:-1]), memory.copy()

    def _lead(self, points: Array, given: Array) -> Array:
        """Where the six points should be (F, 6, 3) [m]: as seen, but above the floor, and where tasks say."""
        wanted = points.copy()
        if self._lowest is not None:
            wanted[:, 4:, 1] = np.maximum(wanted[:, 4:, 1], self._lowest)
        for point, task in self._led:
            if np.isfinite(given[task, :3]).all():
                wanted[:, point] = given[task, :3]
        return wanted

    def _refine(
        self,
        points: Array,
        wanted: Array,
        turned: Array,
        states: Array,
        dt: float,
        memory: Array,
        given: Array,
    ) -> Frames:
        """Frames of prioritized IK from those of the reconstruction; updates ``memory``.

        ``turned`` are its local rotations (F, J, 4), ``states`` (F, 2 J + 1, 4) the same for prioritized IK.
        """
        table = np.tile(self._base_goals, (len(points), 1, 1))
        table[:, table.shape[1] - len(given) :] = given
        time = min(float(dt), LONG) if dt > 0 else 0.0
        body = (self._rig, self._ends, self._legs, self._body.base)
        begun = (turned.copy(), states)  # read-only arrays are another type to Numba: one more compilation
        write_goals(points, wanted, *begun, *body, time, self.floor, self.contacts, memory, table)
        out = self._engine.run(table, states, states[0].copy(), states, self._settings)
        residual = np.ascontiguousarray(out.residual[:, self._measured])
        missed = (residual > self._accepted).any(axis=1)
        status = np.where(out.status == Status.LOST, Status.LOST, np.where(missed, Status.UNREACHABLE, 0))
        return out._replace(status=status, residual=residual)

    def _find_accepted(self) -> Array:
        """Residuals up to which a point or a task counts as met [m or rad]."""
        lowered = self._engine.lowered
        accepted = np.zeros(self._measured[-1] + 1 + len(lowered.index))
        np.maximum.at(accepted, lowered.index[:, TASK], lowered.values[:, ACCEPT])
        return np.concatenate([np.full(6, REACHED), accepted[self._measured[6:]]])
