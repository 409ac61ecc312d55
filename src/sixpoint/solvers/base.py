"""What every solver takes and gives: points in, a ``Solution`` out, and no hidden state.

A solver is made once for a figure. What the next frame needs travels in the solution.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion, Pose
from sixpoint.body.targets import Targets

Array = NDArray[np.float64]
Progress = Callable[[int], None]


class Status(IntEnum):
    """How a frame went."""

    CONVERGED = 0
    """Every effector is within 1 cm of its target (the stop criterion of Unzueta et al. 2008, section 9)."""
    UNREACHABLE = 1
    """Some target is not met: beyond the body's reach or limits, or the method stopped before."""
    LOST = 2
    """Some target is unknown (NaN); its limb holds its last local pose, pelvis and head follow each other."""


@dataclass(frozen=True, eq=False, repr=False, slots=True)
class Solution:
    """One solved frame.

    Attributes:
        pose: The posture, on the figure's own rig.
        status: How it went.
        residual: (6,) distance of each effector to its target [m]; 0 where the target is lost. Of prioritized
            IK the error of every task [m or rad].
        iterations: Frame updates used; 1 for a sequential method.
        state: What the next frame needs; give the whole solution as ``previous``.
        gave_way: Of prioritized IK: unmet task -> tasks (or "joint limits") that hold the motion it needs;
            nothing where it is out of reach, or the search ended there.
    """

    pose: Pose
    status: Status
    residual: Array
    iterations: int
    state: tuple[Array, ...]
    gave_way: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"Solution({self.status.name}, worst residual {max(self.residual, default=0.0):.4f})"


@dataclass(frozen=True, eq=False, repr=False)
class MotionSolution:
    """Many solved frames.

    Attributes:
        motion: The postures, on the figure's own rig.
        status: (F,) ``Status`` of each frame.
        residual: (F, 6) distance of each effector to its target [m]; 0 where the target is lost.
    """

    motion: Motion
    status: NDArray[np.int64]
    residual: Array

    def __repr__(self) -> str:
        return f"MotionSolution({self.motion!r}, {self.count(Status.CONVERGED)} frames converged)"

    def count(self, status: Status) -> int:
        """Number of frames with a status."""
        return int(np.count_nonzero(self.status == status))


class Solver(Protocol):
    """The protocol of all solvers."""

    @property
    def figure(self) -> Figure:
        """What is posed."""

    def solve(self, points: ArrayLike, previous: Solution | None = None, dt: float = 1 / 60) -> Solution:
        """Pose the figure for one frame of six points (6, 3) [m]."""

    def solve_frames(self, targets: Targets, progress: Progress | None = None) -> MotionSolution:
        """Pose the figure for every frame, with the status and residual of each."""

    def solve_motion(self, targets: Targets) -> Motion:
        """Pose the figure for every frame."""

    def warm_up(self) -> None:
        """Compile, or load, the kernels, so that the first real solve is not slow."""
