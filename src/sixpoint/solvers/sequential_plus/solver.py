"""The solver of SIK+ and its constants; what it does is in ``frame``."""

from __future__ import annotations

from dataclasses import astuple, dataclass, fields
from math import exp

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure, SpineChain
from sixpoint.errors import SixpointError
from sixpoint.solvers.sequential.packing import work_rows
from sixpoint.solvers.sequential_plus.frame import solve_plus
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
        bend_share: Share of Sequential IK's bend that the trunk begins with.
        low_joint: Weight of the lowest spine joint in closing the trunk; the highest has one.
        neck_curve: Angle by which the base of the neck leans back and its top forward, at rest [rad].
        elbow_out: Outward part of an elbow's direction.
        elbow_down: Its downward part.
        elbow_back: Its backward part.
        elbow_lift: What is added outward when the hand is overhead.
        knee_out: Outward part of a knee's direction; forward it is one.
        memory: Time constant of what tells the pelvis' X axis [s].
        speed_memory: Time constant of the pelvis' velocity [s].
    """

    chord_share: float = 0.35
    leg_share: float = 0.8
    wrist_line: float = 2.5
    ankle_line: float = 1.0
    reach: float = 3.35
    speed: float = 0.5
    twist_share: float = 0.225
    bend_share: float = 0.1
    low_joint: float = 1.8
    neck_curve: float = 0.35
    elbow_out: float = 0.05
    elbow_down: float = 1.25
    elbow_back: float = 0.6
    elbow_lift: float = 1.05
    knee_out: float = 0.0
    memory: float = 0.05
    speed_memory: float = 0.15


class SequentialIKPlus(SixPointSolver):
    """Sequential IK with better steps and no trained model.

    The pelvis is held by legs and gravity as well as by the trunk, the spine closes on the head by small
    turns of all its joints, a limb bends where people bend it, and looks for another swivel angle where the
    limits forbid that one. World Y must be up.

    Args:
        figure: What to pose.
        limits: Keep every joint within the figure's limits.
        habits: Its constants.

    Raises:
        SixpointError: A constant has an impossible value.
    """

    fitted_on = tuple(f"cmu/{person}" for person in ("02", "03", "05", "09", "11", "16", "29", "127"))

    _entry = staticmethod(solve_plus)

    def __init__(self, figure: Figure, *, limits: bool = True, habits: Habits | None = None) -> None:
        self.habits = habits or Habits()
        for field in fields(Habits):
            if not np.isfinite(getattr(self.habits, field.name)):
                raise SixpointError(f"{field.name} must be a number, got {getattr(self.habits, field.name)}")
        if not (self.habits.memory >= 0 and self.habits.speed_memory >= 0 and self.habits.low_joint >= 0):
            raise SixpointError("memory, speed_memory and low_joint are numbers from 0")
        super().__init__(figure, weights=WALKING, limits=limits)

    def _options(self, dt: float) -> Array:
        known = self._adapted.get(dt)
        if known is None:
            if len(self._adapted) > 100:
                self._adapted.clear()
            time = min(dt, 1e3) if dt > 0 else 0.0
            *numbers, memory, speed_memory = astuple(self.habits)
            kept = [exp(-time / constant) if constant > 0 else 0.0 for constant in (memory, speed_memory)]
            rate = 1.0 / time if time > 1e-6 else 0.0
            known = self._adapted[dt] = np.array([self.limits, *numbers, *kept, rate], float)
        return known

    def _build_model(self) -> Model:
        return build_model(self.figure, SpineChain.from_figure(self.figure, own_pelvis=True))

    def _make_work(self) -> tuple[Array, ...]:
        return (np.empty((work_rows(self._trunk), 4)),)
