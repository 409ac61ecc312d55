"""What is behind every compiled method of the six points: figure in, frames through, state along."""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion, Pose
from sixpoint.body.targets import EFFECTORS, Targets, as_points
from sixpoint.errors import SixpointError
from sixpoint.kernels.jit import is_cached
from sixpoint.solvers.base import MotionSolution, Progress, Solution, Status
from sixpoint.solvers.six_points.frame import MEMORY_ROWS
from sixpoint.solvers.six_points.model import build_model
from sixpoint.solvers.six_points.packing import LIMB_ROWS, Model, pack_model
from sixpoint.solvers.six_points.tree import Tree, build_tree, pack_tree

Array = NDArray[np.float64]

FIGHTING = (1.0, 1.0, 0.0)
WALKING = (0.1, 0.1, 1.0)
STATUSES = tuple(Status)
CHUNK = 512  # frames between two reports of progress

log = logging.getLogger("sixpoint")


class SixPointSolver(ABC):
    """A method that poses a figure from six points by one compiled call.

    A subclass names its compiled entry, which solves F frames in order:

        entry(*arrays, *work, options, points, *beside, state, rotations, pelvis, outcome, residual)

    where ``arrays`` are those of ``_lower``, ``work`` those of ``_make_work``, ``options`` the weights at the
    frame rate, whether limits hold and the numbers of ``_numbers``; ``beside`` is what ``_beside`` takes from
    the targets, frame by frame; ``outcome`` (F, 2) are status and iterations.

    Args:
        figure: What to pose.
        weights: Influence of the wrists' line, the ankles' line and the previous frame on the pelvis' X
            axis (w1, w2, w3), as in Unzueta et al. 2008 at 120 Hz; the memory of w3 is kept at any frame
            rate. They take ``FIGHTING`` = (1, 1, 0) for boxing and kicks and ``WALKING`` = (0.1, 0.1, 1),
            the steadier default, for walking and climbing.
        limits: Keep every joint within the figure's limits.

    Raises:
        SixpointError: The weights make no sense.
    """

    fitted_on: ClassVar[tuple[str, ...]] = ()
    """People whose recordings its constants or model were fitted on, as "cmu/02"; see ``find_fitted_on``."""

    _entry: ClassVar[Callable[..., None]]
    _compiling: ClassVar[str] = "about ten seconds"

    def __init__(
        self, figure: Figure, *, weights: tuple[float, float, float] = WALKING, limits: bool = True
    ) -> None:
        self.figure = figure
        self.weights = check_weights(weights)
        self.limits = bool(limits)
        model = self._build_model()
        self._arrays = self._lower(model)
        self._trunk = len(model.segments)
        self._start = np.zeros((len(model.balls) + MEMORY_ROWS, 4))
        self._start[:-MEMORY_ROWS] = rot.IDENTITY
        self._adapted: dict[float, Array] = {}

    def _build_model(self) -> Model:
        """The figure lowered."""
        return build_model(self.figure)

    def _lower(self, model: Model) -> tuple[NDArray[Any] | None, ...]:
        """The figure as the entry's first arrays."""
        table, integers = pack_model(model)
        return (table, integers, model.balls, model.chords)

    @abstractmethod
    def _make_work(self) -> tuple[Array, ...]:
        """Working memory of the entry; each call has its own, so that threads may share a solver."""

    def _beside(self, targets: Targets) -> tuple[Array, ...]:
        """What the method reads of each frame beside the points: writable arrays (F, ...)."""
        return ()

    def _numbers(self) -> tuple[float, ...]:
        """Options of the method's own."""
        return ()

    def solve(self, points: ArrayLike, previous: Solution | None = None, dt: float = 1 / 60) -> Solution:
        """Pose the figure for one frame.

        Args:
            points: (6, 3) positions of the effectors in the order of ``EFFECTORS`` [m]; NaN where lost.
            previous: The solution of the frame before, if any.
            dt: Time since that frame [s]; zero or less counts as no time.

        Raises:
            TargetError: ``points`` has another shape.
            SixpointError: ``previous`` is of another figure.
        """
        return self._solve_frame(as_points(points), (), previous, dt)

    def _entry_of(self, beside: tuple[Array, ...]) -> Callable[..., None]:
        """The compiled entry that reads so many arrays beside the points."""
        return type(self)._entry

    def _solve_frame(
        self, points: Array, beside: tuple[Array, ...], previous: Solution | None, dt: float
    ) -> Solution:
        """One frame; ``beside`` are arrays of one frame."""
        state = self._state_after(previous)
        rotations, pelvis = np.empty((1, len(self.figure.skeleton), 4)), np.empty((1, 3))
        outcome, residual = np.empty((1, 2), np.int64), np.empty((1, 6))
        self._entry_of(beside)(
            *self._arrays,
            *self._make_work(),
            self._options(dt),
            points[None],
            *beside,
            state,
            rotations,
            pelvis,
            outcome,
            residual,
        )
        moving, translations = self._place(pelvis)
        pose = Pose(self.figure.skeleton, rotations[0], translations[0], moving)
        status, iterations = outcome[0].tolist()
        return Solution(pose, STATUSES[status], residual[0], iterations, (state,))

    def solve_frames(self, targets: Targets, progress: Progress | None = None) -> MotionSolution:
        """Pose the figure for every frame.

        Args:
            targets: Where the six points are.
            progress: Called with the number of frames done, every few hundred frames.
        """
        return self._solve_frames(targets, self._beside(targets), progress)

    def _solve_frames(
        self, targets: Targets, beside: tuple[Array, ...], progress: Progress | None
    ) -> MotionSolution:
        """Every frame; ``beside`` are arrays of as many frames."""
        frames, joints = len(targets), len(self.figure.skeleton)
        rotations, pelvis = np.empty((frames, joints, 4)), np.empty((frames, 3))
        outcome, residual = np.empty((frames, 2), np.int64), np.empty((frames, 6))
        state = self._start.copy()
        # Read-only arrays are another type to Numba: one more compilation.
        given = (targets.positions.copy(), *beside)
        fixed = (*self._arrays, *self._make_work(), self._options(1.0 / targets.rate))
        entry, step = self._entry_of(beside), CHUNK if progress else frames
        for first in range(0, frames, step):
            part = slice(first, min(first + step, frames))
            out = (rotations[part], pelvis[part], outcome[part], residual[part])
            entry(*fixed, *(array[part] for array in given), state, *out)
            if progress:
                progress(part.stop)
        moving, translations = self._place(pelvis)
        rotations.flags.writeable = False  # hand over instead of copying
        motion = Motion(
            self.figure.skeleton, rotations, translations, targets.rate, moving, name=targets.name
        )
        return MotionSolution(motion, outcome[:, 0], residual)

    def solve_motion(self, targets: Targets) -> Motion:
        """Pose the figure for every frame."""
        return self.solve_frames(targets).motion

    def warm_up(self) -> None:
        """Compile the kernels, or load them from disk, on the neutral pose."""
        if not is_cached(type(self)._entry.__name__):
            log.warning(f"compiling kernels, once ({self._compiling})")
        rest = self.figure.rest_positions
        r = self.figure.roles
        points = rest[[r.pelvis, r.head, *r.wrist, *r.ankle]]
        points[1] += self.figure.head_offset
        neutral = np.tile(rot.IDENTITY, (1, len(EFFECTORS), 1))
        targets = Targets(points[None], 60.0, neutral)
        self._solve_frame(as_points(points), self._beside(targets), None, 1 / 60)

    def _state_after(self, previous: Solution | None) -> Array:
        if previous is None:
            return self._start.copy()
        if previous.pose.skeleton is not self.figure.skeleton or previous.state[0].shape != self._start.shape:
            raise SixpointError("previous is of another figure; begin with previous=None")
        return previous.state[0].copy()

    def _options(self, dt: float) -> Array:
        """Options for a frame time as numbers; the last ones asked for are kept."""
        known = self._adapted.get(dt)
        if known is None:
            if len(self._adapted) > 100:
                self._adapted.clear()
            weights = weights_at_rate(self.weights, dt)
            known = self._adapted[dt] = np.array([*weights, self.limits, *self._numbers()], float)
        return known

    def _place(self, pelvis: Array) -> tuple[tuple[int, ...], Array]:
        """Which joints translate and where to; a root above the pelvis stands still."""
        joint = self.figure.roles.pelvis
        if joint == 0:
            return (0,), pelvis[:, None]
        root = np.broadcast_to(self.figure.skeleton.offsets[0], pelvis.shape)
        return (0, joint), np.stack([root, pelvis], axis=1)


def check_weights(weights: Sequence[float]) -> tuple[float, float, float]:
    """Weights of the pelvis estimate as three numbers.

    Raises:
        SixpointError: They make no sense.
    """
    if len(weights) != 3 or not np.all(np.isfinite(weights)) or min(weights) < 0 or max(weights) <= 0:
        raise SixpointError(f"weights are three numbers, none negative, not all zero; got {weights}")
    if max(weights) > 1e6 or max(weights) < 1e-6:
        raise SixpointError(f"weights are compared with each other: numbers around 1, got {weights}")
    return float(weights[0]), float(weights[1]), float(weights[2])


def weights_at_rate(weights: tuple[float, float, float], dt: float) -> tuple[float, float, float]:
    """Weights that keep, at a frame time ``dt`` [s], the memory they have at 120 Hz.

    The share of new information per frame is b = (w1 + w2) / (w1 + w2 + w3); over equal times the same
    forgetting needs b' = 1 - (1 - b)^(120 dt). The ratio of w1 to w2 stays.

    Where no time passed (two packets of one instant; also a negative or unknown ``dt``) nothing new is known:
    the pelvis keeps its axis if it has a memory at all.
    """
    if not dt > 0:
        dt = 0.0
    w1, w2, w3 = weights
    new = w1 + w2
    if w3 <= 0.0 or new <= 0.0:
        return weights
    kept = (w3 / (new + w3)) ** (120.0 * min(dt, 1e3))
    scale = w3 * (1.0 - kept) / kept / new if kept > 1e-12 else 1e12
    return w1 * scale, w2 * scale, w3


class TreeSolver(SixPointSolver):
    """A method that sees the posed joints as a plain tree, see ``six_points.tree``."""

    def _lower(self, model: Model) -> tuple[NDArray[Any] | None, ...]:
        return (*super()._lower(model), *pack_tree(self._build_tree(model)))

    def _build_tree(self, model: Model) -> Tree:
        return build_tree(self.figure, model)

    def _make_work(self) -> tuple[Array, ...]:
        return (np.zeros((2 * (self._trunk + LIMB_ROWS) + 6, 4)),)
