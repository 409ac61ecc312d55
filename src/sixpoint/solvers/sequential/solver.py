"""Sequential IK: six points in, a whole-body pose out, limb by limb in closed form.

Reference: Unzueta, Peinado, Boulic, Suescun, "Full-body performance animation with Sequential Inverse
Kinematics", Graphical Models 70 (2008) 87-104.
"""

from __future__ import annotations

import logging
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion, Pose
from sixpoint.body.targets import Targets, as_points
from sixpoint.errors import SixpointError
from sixpoint.kernels.jit import is_cached
from sixpoint.solvers.base import MotionSolution, Progress, Solution, Status
from sixpoint.solvers.sequential.frame import MEMORY_ROWS, solve_frames
from sixpoint.solvers.sequential.model import build_model
from sixpoint.solvers.sequential.packing import LIMB_ROWS, Settings, pack_model, work_rows

Array = NDArray[np.float64]

FIGHTING = (1.0, 1.0, 0.0)
WALKING = (0.1, 0.1, 1.0)
STATUSES = tuple(Status)
CHUNK = 512  # frames between two reports of progress

log = logging.getLogger("sixpoint")


class SequentialIK:
    """Sequential Inverse Kinematics of Unzueta et al. 2008.

    Args:
        figure: What to pose.
        weights: Influence of the wrists' line, the ankles' line and the previous frame on the pelvis' X
            axis (w1, w2, w3), as in the paper at 120 Hz; the memory of w3 is kept at any frame rate.
            The paper takes ``FIGHTING`` = (1, 1, 0) for boxing and kicks and ``WALKING`` = (0.1, 0.1, 1),
            the steadier default, for walking and climbing.
        limits: Keep every joint within the figure's limits.
        search: "exact" meets the chord length of the bent spine by Newton's method; "literal" steps by
            0.1 and 0.01 rad as Algorithm 3 does.
        clavicles: "neutral" starts the clavicle from rest in every frame; "hold" from the last frame.
        align_pelvis: Twist the trunk about the line pelvis-head after it is placed, so that the pelvis'
            X axis is as near as possible to its estimate (not in the paper).

    Raises:
        SixpointError: An option has an impossible value.
    """

    name = "sik"

    def __init__(
        self,
        figure: Figure,
        *,
        weights: tuple[float, float, float] = WALKING,
        limits: bool = True,
        search: Literal["exact", "literal"] = "exact",
        clavicles: Literal["neutral", "hold"] = "neutral",
        align_pelvis: bool = False,
    ) -> None:
        if len(weights) != 3 or not np.all(np.isfinite(weights)) or min(weights) < 0 or max(weights) <= 0:
            raise SixpointError(f"weights are three numbers, none negative, not all zero; got {weights}")
        if search not in ("exact", "literal"):
            raise SixpointError(f"search is 'exact' or 'literal', got {search!r}")
        if clavicles not in ("neutral", "hold"):
            raise SixpointError(f"clavicles is 'neutral' or 'hold', got {clavicles!r}")
        self.figure = figure
        self.weights = (float(weights[0]), float(weights[1]), float(weights[2]))
        if max(self.weights) > 1e6 or (0 < max(self.weights) < 1e-6):
            raise SixpointError(f"weights are compared with each other: numbers around 1, got {weights}")
        self._options = {
            "limits": bool(limits),
            "literal": search == "literal",
            "hold_clavicles": clavicles == "hold",
            "align_pelvis": bool(align_pelvis),
        }
        model = build_model(figure)
        table, integers = pack_model(model)
        self._arrays: tuple[Any, Any, Any, Any] = (table, integers, model.balls, model.chords)
        self._work = (work_rows(len(model.segments)), 4)
        self._start = np.zeros((len(model.segments) + LIMB_ROWS + MEMORY_ROWS, 4))
        self._start[:-MEMORY_ROWS] = rot.IDENTITY
        self._adapted: dict[float, Array] = {}

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
        frame = as_points(points)
        state = self._state_after(previous)
        rotations, pelvis = np.empty((1, len(self.figure.skeleton), 4)), np.empty((1, 3))
        status, residual = np.empty(1, np.int64), np.empty((1, 6))
        solve_frames(
            *self._arrays,
            self._settings(dt),
            frame[None],
            state,
            np.empty(self._work),
            rotations,
            pelvis,
            status,
            residual,
        )
        moving, translations = self._place(pelvis)
        pose = Pose(self.figure.skeleton, rotations[0], translations[0], moving)
        return Solution(pose, STATUSES[status[0]], residual[0], 1, (state,))

    def solve_frames(self, targets: Targets, progress: Progress | None = None) -> MotionSolution:
        """Pose the figure for every frame.

        Args:
            targets: Where the six points are.
            progress: Called with the number of frames done, every few hundred frames.
        """
        frames, joints = len(targets), len(self.figure.skeleton)
        rotations, pelvis = np.empty((frames, joints, 4)), np.empty((frames, 3))
        status, residual = np.empty(frames, np.int64), np.empty((frames, 6))
        state, work = self._start.copy(), np.empty(self._work)
        points = targets.positions.copy()  # read-only arrays are another type to Numba: one more compilation
        options = self._settings(1.0 / targets.rate)
        step = CHUNK if progress else frames
        for first in range(0, frames, step):
            part = slice(first, min(first + step, frames))
            solve_frames(
                *self._arrays,
                options,
                points[part],
                state,
                work,
                rotations[part],
                pelvis[part],
                status[part],
                residual[part],
            )
            if progress:
                progress(part.stop)
        moving, translations = self._place(pelvis)
        rotations.flags.writeable = False  # hand over instead of copying
        motion = Motion(
            self.figure.skeleton, rotations, translations, targets.rate, moving, name=targets.name
        )
        return MotionSolution(motion, status, residual)

    def solve_motion(self, targets: Targets) -> Motion:
        """Pose the figure for every frame."""
        return self.solve_frames(targets).motion

    def warm_up(self) -> None:
        """Compile the kernels, or load them from disk, on the neutral pose."""
        if not is_cached("solve_frames"):
            log.warning("compiling kernels, once (about ten seconds)")
        rest = self.figure.rest_positions
        r = self.figure.roles
        points = rest[[r.pelvis, r.head, *r.wrist, *r.ankle]]
        points[1] += self.figure.head_offset
        self.solve(points)

    def _state_after(self, previous: Solution | None) -> Array:
        if previous is None:
            return self._start.copy()
        if previous.pose.skeleton is not self.figure.skeleton or previous.state[0].shape != self._start.shape:
            raise SixpointError("previous is of another figure; begin with previous=None")
        return previous.state[0].copy()

    def _settings(self, dt: float) -> Array:
        """Options for a frame time as seven numbers; the last ones asked for are kept."""
        known = self._adapted.get(dt)
        if known is None:
            settings = Settings(*weights_at_rate(self.weights, dt), **self._options)
            if len(self._adapted) > 100:
                self._adapted.clear()
            known = self._adapted[dt] = np.array(settings, float)
        return known

    def _place(self, pelvis: Array) -> tuple[tuple[int, ...], Array]:
        """Which joints translate and where to; a root above the pelvis stands still."""
        joint = self.figure.roles.pelvis
        if joint == 0:
            return (0,), pelvis[:, None]
        root = np.broadcast_to(self.figure.skeleton.offsets[0], pelvis.shape)
        return (0, joint), np.stack([root, pelvis], axis=1)


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
