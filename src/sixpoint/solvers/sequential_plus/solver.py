"""The solver of SIK+ and its constants; what it does is in ``frame``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, fields
from math import exp
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body.figure import COINCIDENT, Figure, SpineChain
from sixpoint.body.motion import Motion, Pose
from sixpoint.body.targets import EFFECTORS, Targets, as_points
from sixpoint.errors import SixpointError, SkeletonError, TargetError, listed
from sixpoint.solvers.avoidance.options import check_avoid, find_flesh
from sixpoint.solvers.base import MotionSolution, Progress, Solution
from sixpoint.solvers.sequential.packing import work_rows
from sixpoint.solvers.sequential_plus.clear import solve_from_start_clear, solve_plus_clear
from sixpoint.solvers.sequential_plus.frame import solve_from_start, solve_plus
from sixpoint.solvers.sequential_plus.start import find_start
from sixpoint.solvers.six_points.model import build_model
from sixpoint.solvers.six_points.packing import Model
from sixpoint.solvers.six_points.solver import WALKING, SixPointSolver

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Habits:
    """The constants of SIK+: how people mostly hold themselves.

    Chosen on subjects 02, 03, 05, 09, 11, 16, 29 and 127 of the CMU database by a coordinate search
    (``benchmarks/tune_sik_plus.py``). The times, the speed and the small bend were then set to round numbers
    that keep the acceleration error below that of Sequential IK on clips of those people and of subject 14.

    Attributes:
        chord_share: Share of the direction to the head in the pelvis' Y.
        leg_share: Of the rest, the share of the legs' direction; the vertical has what is left.
        wrist_line: Weight of the line between the wrists in the pelvis' X; that of the ankles is one.
        ankle_line: Weight of the line between the ankles.
        reach: Weight of how far the hands are before the chest.
        speed: Weight of the pelvis' velocity [s].
        twist_share: Share of the angle to the wrists' line by which the thorax turns.
        bend_share: Share of the bend of an arc that is as short as the trunk, with which it begins.
        low_joint: Weight of the lowest spine joint in closing the trunk; the highest has one.
        neck_curve: Angle by which the base of the neck leans back and its top forward, at rest [rad].
        elbow_out: Outward part of an elbow's direction.
        elbow_down: Its downward part.
        elbow_back: Its backward part.
        elbow_lift: What is added outward when the hand is overhead.
        knee_out: Outward part of a knee's direction; forward it is one.
        known_twist: ``twist_share`` where the pelvis' rotation is measured.
        known_bend: ``bend_share`` where it is.
        head_twist: Share of the head's measured twist that the top of the spine takes.
        head_bend: Share of its bend.
        head_rise: Power of the height by which lower joints take less of both.
        head_hold: Share of the spine's turn at the top that closing on the head avoids, 0 to 1.
        elbow_hand: How much an elbow points along the hand, towards the forearm.
        elbow_palm: How much it points to the front of the hand's neutral pose, where the thumb is.
        elbow_grip: How much the elbow's axis follows the hand's lateral one.
        elbow_tilt: How much it follows the hand's long axis.
        knee_shank: How much a knee points along the foot's vertical axis.
        knee_toes: How much it points where the toes do.
        knee_tilt: How much the knee's axis follows the foot's vertical one.
        swivel_lag: Time constant of a swivel angle where the pole is across the limb's line [s].
        swivel_memory: Time constant of a swivel angle where the pole is 45 degrees from the limb's line; it
            is zero across the line and grows without bound along it [s].
        swivel_speed: Largest change of a swivel angle, but for what limits ask [rad/s].
        turn_speed: Largest speed of the pelvis about its Y [rad/s].
        memory: Time constant of what tells the pelvis' X axis [s].
        speed_memory: Time constant of the pelvis' velocity [s].
        tilt_memory: Time constant of the pelvis' Y axis [s].
        lean_memory: Time constant in which the pelvis gives up a turn towards the ankles [s].
    """

    chord_share: float = 0.35
    leg_share: float = 0.8
    wrist_line: float = 2.5
    ankle_line: float = 1.0
    reach: float = 3.35
    speed: float = 0.5
    twist_share: float = 0.225
    bend_share: float = 0.03
    low_joint: float = 1.8
    neck_curve: float = 0.32
    elbow_out: float = 0.05
    elbow_down: float = 1.25
    elbow_back: float = 0.6
    elbow_lift: float = 1.05
    knee_out: float = 0.0
    known_twist: float = 0.4
    known_bend: float = 0.0
    head_twist: float = 1.6
    head_bend: float = 0.6
    head_rise: float = 7.5
    head_hold: float = 0.75
    elbow_hand: float = 0.6
    elbow_palm: float = -0.45
    elbow_grip: float = 0.3
    elbow_tilt: float = -0.5
    knee_shank: float = 1.0
    knee_toes: float = 0.8
    knee_tilt: float = 0.1
    swivel_lag: float = 0.05
    swivel_memory: float = 0.02
    swivel_speed: float = 20.0
    turn_speed: float = 15.0
    memory: float = 0.05
    speed_memory: float = 0.15
    tilt_memory: float = 0.05
    lean_memory: float = 0.3


class SequentialIKPlus(SixPointSolver):
    """Sequential IK with better steps and no trained model.

    The pelvis is held by legs and gravity as well as by the trunk, the spine closes on the head by small
    turns of all its joints, a limb bends where people bend it, and looks for another swivel angle where the
    limits forbid that one. World Y must be up.

    Args:
        figure: What to pose.
        limits: Keep every joint within the figure's limits.
        habits: Its constants.
        rotations: Effectors, of ``EFFECTORS``, whose measured rotations are used (trackers with six degrees
            of freedom). They are met exactly where limits allow; wrists and ankles have none. In a frame
            without one the effector counts by its position alone.
        avoid: "elbows" keeps elbows out of the trunk, by the figure's shape or, without one, by elliptic
            cylinders; "forearms" also forearms and hands, out of trunk and head; "thighs" thighs out of each
            other; "arms" elbows, forearms and hands out of the thighs, and elbows out of the trunk. Wrists
            and ankles stay on their targets and swivel angles do not jump; nothing is avoided by default.

    Raises:
        SixpointError: A constant has an impossible value, or there is no such effector.
    """

    fitted_on = tuple(f"cmu/{person}" for person in ("02", "03", "05", "09", "11", "16", "29", "127"))

    takes_start: ClassVar[bool] = True
    """Whether ``solve`` and ``solve_frames`` take a pose to start from."""

    _entry: ClassVar[Callable[..., None]] = staticmethod(solve_plus)
    _entry_clear: ClassVar[Callable[..., None]] = staticmethod(solve_plus_clear)

    def __init__(
        self,
        figure: Figure,
        *,
        limits: bool = True,
        habits: Habits | None = None,
        rotations: Sequence[str] = (),
        avoid: Sequence[str] = (),
    ) -> None:
        self.habits = habits or Habits()
        for field in fields(Habits):
            if not np.isfinite(getattr(self.habits, field.name)):
                raise SixpointError(f"{field.name} must be a number, got {getattr(self.habits, field.name)}")
        h = self.habits
        if not min(h.memory, h.speed_memory, h.low_joint, h.head_rise) >= 0:
            raise SixpointError("memory, speed_memory, low_joint and head_rise are numbers from 0")
        if not 0 <= h.head_hold <= 1:
            raise SixpointError(f"head_hold is a share from 0 to 1, got {h.head_hold}")
        self.rotations = check_effectors(rotations)
        self.avoid = check_avoid(avoid)
        super().__init__(figure, weights=WALKING, limits=limits)

    def solve(
        self,
        points: ArrayLike,
        previous: Solution | None = None,
        dt: float = 1 / 60,
        *,
        rotations: ArrayLike | None = None,
        start: Pose | ArrayLike | None = None,
    ) -> Solution:
        """Pose the figure for one frame.

        Args:
            points: (6, 3) positions of the effectors in the order of ``EFFECTORS`` [m]; NaN where lost.
            previous: The solution of the frame before, if any.
            dt: Time since that frame [s]; zero or less counts as no time.
            rotations: (6, 4) their world rotations xyzw, identity in the neutral pose; NaN where unknown.
                Only those of ``self.rotations`` are read, and they must be given.
            start: A pose of the rig to start from in place of the method's own start: the trunk as it is
                there closes on the head, elbows and knees point where they do there. Or what is read of it,
                (S + 4, 4), see ``start.find_start``, which is faster.

        Raises:
            TargetError: ``points`` or ``rotations`` has another shape, or asked-for rotations are missing.
            SkeletonError: ``start`` is of another rig.
            SixpointError: ``previous`` is of another figure.
        """
        frame = as_points(points)
        given = None if rotations is None else np.asarray(rotations, float)[None]
        if isinstance(start, Pose):
            pose: Motion | Array | None = Motion.from_poses([start], 1.0)
        else:
            pose = None if start is None else np.array(start, float, order="C")[None]
        return self._solve_frame(frame, self._beside(Targets(frame[None], 1.0, given), pose), previous, dt)

    def solve_frames(
        self, targets: Targets, progress: Progress | None = None, *, start: Motion | None = None
    ) -> MotionSolution:
        """Pose the figure for every frame.

        Args:
            targets: Where the six points are.
            progress: Called with the number of frames done, every few hundred frames.
            start: A motion of the rig to start each frame from, see ``solve``: an earlier take, or what a
                database or a model of your own says.

        Raises:
            TargetError: Asked-for rotations are missing.
            SkeletonError: ``start`` is of another rig or length.
        """
        return self._solve_frames(targets, self._beside(targets, start), progress)

    def _beside(self, targets: Targets, start: Motion | Array | None = None) -> tuple[Array, ...]:
        """Used rotations (F, 6, 4), NaN where unknown, or (F, 0, 4); and the start if there is one."""
        turned = self._find_rotations(targets) if self.rotations else np.empty((len(targets), 0, 4))
        if start is None:
            return (turned,)
        if isinstance(start, np.ndarray):
            if start.shape != (len(targets), self._trunk + 4, 4) or not np.isfinite(start).all():
                raise SkeletonError(
                    f"the start is a pose or {self._trunk + 4} rotations of this figure, got {start.shape}"
                )
            return turned, start
        chain = SpineChain.from_figure(self.figure, own_pelvis=True)
        return turned, find_start(self.figure, chain, start, len(targets))

    def _entry_of(self, beside: tuple[Array, ...]) -> Callable[..., None]:
        if len(beside) == 1:
            return type(self)._entry_clear if self.avoid else type(self)._entry
        return solve_from_start_clear if self.avoid else solve_from_start

    def _find_rotations(self, targets: Targets) -> Array:
        if targets.rotations is None:
            raise TargetError(
                f"this solver takes the rotations of {listed(self.rotations)}, but {targets.name} has none; "
                "make it without rotations=, or give them"
            )
        turned = np.full((len(targets), len(EFFECTORS), 4), np.nan)
        for name in self.rotations:
            k = EFFECTORS.index(name)
            given = targets.rotations[:, k]
            length = np.linalg.norm(given, axis=1, keepdims=True)
            usable = np.isfinite(length) & (length > 1e-6)
            turned[:, k] = np.where(usable, given / np.where(usable, length, 1.0), np.nan)
            if len(targets) > 1 and not usable.any():
                raise TargetError(f"{targets.name} has no rotation of {name} in any frame")
        return turned

    def _options(self, dt: float) -> Array:
        known = self._adapted.get(dt)
        if known is None:
            if len(self._adapted) > 100:
                self._adapted.clear()
            time = min(dt, 1e3) if dt > 0 else 0.0
            *numbers, memory, speed_memory, tilt_memory, lean_memory = astuple(self.habits)
            times = (memory, speed_memory, tilt_memory, lean_memory)
            kept = [exp(-time / constant) if constant > 0 else 0.0 for constant in times]
            rate = 1.0 / time if time > 1e-6 else 0.0
            site = float(np.linalg.norm(self.figure.head_offset) > COINCIDENT)
            known = self._adapted[dt] = np.array([self.limits, *numbers, *kept, rate, time, site], float)
        return known

    def _build_model(self) -> Model:
        chain = SpineChain.from_figure(self.figure, own_pelvis=True)
        return build_model(self.figure, chain, ends=bool(self.rotations))

    def _lower(self, model: Model) -> tuple[NDArray[Any] | None, ...]:
        return (*super()._lower(model), *self._find_flesh())

    def _find_flesh(self) -> tuple[Array | None, ...]:
        """What is kept apart, the last two of the fixed arrays; none where nothing is avoided."""
        chain = SpineChain.from_figure(self.figure, own_pelvis=True)
        return find_flesh(self.figure, chain, self.avoid) or ()

    def _make_work(self) -> tuple[Array, ...]:
        return (np.empty((work_rows(self._trunk), 4)),)


def check_effectors(names: Sequence[str]) -> tuple[str, ...]:
    """Names of effectors, each once, in the order of ``EFFECTORS``.

    Raises:
        SixpointError: There is no such effector; the message lists those there are.
    """
    named = [names] if isinstance(names, str) else list(names)
    unknown = [name for name in named if name not in EFFECTORS]
    if unknown:
        raise SixpointError(f"no effector named {listed(unknown)}; there are: {listed(EFFECTORS)}")
    return tuple(name for name in EFFECTORS if name in named)
