"""Follow the markers of a laboratory recording with prioritized IK, frame by frame.

Reference: Boulic and Raunhardt, "Integrated analytic and linearized inverse kinematics for precise full body
interactions", MIG 2009, section 7 (24 markers in real time); Baerlocher and Boulic 2004.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body.dofs import Dofs
from sixpoint.body.figure import Figure
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.motion import Motion, Pose
from sixpoint.errors import SixpointError, TargetError
from sixpoint.solvers.prioritized.articulation import Articulation
from sixpoint.solvers.prioritized.full_body import attractor_state
from sixpoint.solvers.prioritized.tasks import PostureTask
from sixpoint.solvers.tracking.engine import packing as tp
from sixpoint.solvers.tracking.following import Follower, mark_waiting
from sixpoint.solvers.tracking.model import lower_markers
from sixpoint.solvers.tracking.priorities import PRIORITIES
from sixpoint.solvers.tracking.running import State, TrackingEngine
from sixpoint.solvers.tracking.start import Beginning
from sixpoint.solvers.tracking.two_sided import blend

Array = NDArray[np.float64]
Flags = NDArray[np.int64]

FAR = 1e7  # a marker farther away is not seen [m]
IDLE = 1.0  # time in which what no marker tells goes most of its way to the relaxed posture [s]
USED, LOST, REJECTED, SWAPPED = tp.USED, tp.LOST, tp.REJECTED, tp.SWAPPED


@dataclass(frozen=True, eq=False, repr=False)
class TrackedFrame:
    """One frame.

    Attributes:
        pose: The posture, on the figure's rig.
        residual: (M,) distance of each seen marker from its place on the body [m], 0 where it is lost.
        flags: (M,) what became of each marker: 0 used, 1 not seen, 2 refused, 3 used under another's name.
        iterations: Iterations.
        state: What the next frame needs; give the whole as ``previous``.
        adrift: For how long the markers have been too few or too far off [s]; soon they are begun with anew.
    """

    pose: Pose
    residual: Array
    flags: Flags
    iterations: int
    state: State
    adrift: float = 0.0

    def __repr__(self) -> str:
        return f"TrackedFrame({np.sum(self.flags == tp.USED)} of {len(self.flags)} markers used)"


@dataclass(frozen=True, eq=False, repr=False)
class TrackedMotion:
    """Many frames; the attributes are those of ``TrackedFrame`` with a first axis of frames."""

    motion: Motion
    residual: Array
    flags: Flags
    iterations: NDArray[np.int64]

    def __repr__(self) -> str:
        return f"TrackedMotion({self.motion!r}, {np.mean(self.flags == tp.USED):.0%} of the samples used)"


class MarkerTracker:
    """Follows markers fixed to a figure.

    The markers of one segment at one level count as one constraint of up to six rows. Hands and feet are
    reached by FLEXT limbs. What no marker tells goes on as it moved, then sinks to the relaxed posture.

    Args:
        model: Who moves, and where the markers sit.
        priorities: Part ("feet", "pelvis", "hands", "head", "rest") -> level; 0 is the most important.
        limits: Keep every joint within its limits.
        flext: Reach hands and feet by FLEXT constraints.
        iterations: Most iterations of a frame.
        gate: A marker is refused where it is farther than about this from where it should be [m]; what it
            usually is off by, and what a prediction may miss, are added. Infinity refuses none.
        damping: Lever below which a turn is damped [m].
        tolerances: Part -> how far the centre of its markers may be off before it is held there, whatever
            that costs the parts below [m]; 2 cm by default. Within it all markers count alike.
        dofs: What may move and how far; by default ``figure.full_dofs()``. See ``widen_limits``.

    Raises:
        SixpointError: An option makes no sense; the message says what would.
    """

    def __init__(
        self,
        model: MarkerModel,
        *,
        priorities: Mapping[str, int] | None = None,
        limits: bool = True,
        flext: bool = True,
        iterations: int = 3,
        gate: float = 0.04,
        damping: float = 0.05,
        tolerances: Mapping[str, float] | None = None,
        dofs: Dofs | None = None,
    ) -> None:
        if not (int(iterations) == iterations and iterations >= 1):
            raise SixpointError(f"iterations are a whole number from 1, got {iterations}")
        for name, value in (("gate", gate), ("damping", damping)):
            if not value > 0:
                raise SixpointError(f"the {name} is a positive number [m], got {value}")
        self.model = model
        self.body = Articulation.of(model.figure, dofs or model.figure.full_dofs())
        low = [
            lower_markers(self.body, model, levels, tolerances, limbs, limits)
            for levels, limbs in ((priorities, flext), (dict.fromkeys(PRIORITIES, 0), False))
        ]
        self.parts = low[0].parts
        self._options = tp.Options(limits, iterations, 0.01, False, gate, 0.0, damping, True)
        self._rest = attractor_state(self.body, PostureTask())
        self._engine = TrackingEngine(low[0])
        start = Beginning(self.body, model, self._engine, TrackingEngine(low[1]), self._rest)
        self._follower = Follower(start, self._engine, self._rest)

    @property
    def figure(self) -> Figure:
        """The figure that is posed."""
        return self.model.figure

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the markers, in the order of their positions."""
        return self.model.names

    def solve(
        self, markers: ArrayLike, previous: TrackedFrame | None = None, dt: float = 1 / 100
    ) -> TrackedFrame:
        """Pose the figure for one frame.

        Args:
            markers: (M, 3) positions in the order of ``names`` [m]; NaN where one is not seen.
            previous: The frame before, if any.
            dt: Time since then [s].

        Raises:
            TargetError: The markers have another shape.
            SixpointError: ``previous`` is of another model.
        """
        frame = self._checked(np.asarray(markers, float)[None])
        if previous is None:
            out, state, adrift = self._follower.begin(frame[0], self._options)
        else:
            if previous.state.markers.shape != (len(self.names), tp.MEMORY):
                raise SixpointError("previous is of another model; begin with previous=None")
            out, state, adrift = self._follower.go_on(
                frame, previous.state.copy(), previous.adrift, self._options_at(dt)
            )
        moving, translations = self.body.place_base(out.rotations, out.positions)
        pose = Pose(self.body.rig, out.rotations[0], translations[0], moving)
        return TrackedFrame(pose, out.residual[0], out.flags[0], int(out.iterations[0]), state, adrift)

    def solve_frames(
        self,
        markers: ArrayLike,
        rate: float,
        *,
        two_sided: bool | None = None,
        progress: Callable[[int], None] | None = None,
        name: str = "tracked",
    ) -> TrackedMotion:
        """Pose the figure for every frame of a recording.

        Args:
            markers: (F, M, 3) positions in the order of ``names`` [m]; NaN where one is not seen.
            rate: Frames per second [Hz].
            two_sided: Follow the markers backwards, too, and where some are missing go over from what
                came before to what comes after. None: where any are.
            progress: Called with the number of frames done, of twice as many if two-sided.
            name: Of the motion.
        """
        markers = self._checked(np.asarray(markers, float))
        if not (np.isfinite(rate) and rate > 0):
            raise TargetError(f"the frame rate must be positive, got {rate}")
        report, count = progress or _silent, len(markers)
        options = self._options_at(1 / rate)
        # What is followed both ways is made steady afterwards.
        steady = options._replace(steady=two_sided is False)
        out, state = self._follower.follow(markers, steady, report)
        if two_sided is None:
            two_sided = count > 1 and bool(np.any(out.flags != tp.USED))
        if two_sided:
            back = self._follower.follow_back(markers, state, steady, lambda done: report(count + done))
            bound = partial(self._engine.steady, rate=rate, limits=self._options.limits)
            out = blend(self.body, self.model, out, back, markers, self._rest, rate, bound)
        else:
            out = mark_waiting(out, markers)
        moving, translations = self.body.place_base(out.rotations, out.positions)
        motion = Motion(self.body.rig, out.rotations, translations, rate, moving, name=name)
        return TrackedMotion(motion, out.residual, out.flags, out.iterations)

    def warm_up(self) -> None:
        """Compile the kernels, or load them from disk."""
        places = self.model.place(*self.figure.neutral_pose.compute_transforms())
        self.solve_frames(np.stack([places, places]), 100.0, two_sided=True)

    def _checked(self, markers: Array) -> Array:
        if markers.ndim != 3 or markers.shape[1:] != (len(self.names), 3) or len(markers) == 0:
            raise TargetError(
                f"markers are ({len(self.names)}, 3) a frame, NaN where not seen; got {markers.shape[1:]}"
            )
        with np.errstate(invalid="ignore"):
            seen = np.all(np.abs(markers) < FAR, axis=-1, keepdims=True)
        return np.where(seen, markers, np.nan)

    def _options_at(self, dt: float) -> tp.Options:
        dt = min(max(dt, 1e-4), 0.5) if np.isfinite(dt) else 0.01
        return self._options._replace(dt=dt, posture=1.0 - np.exp(-dt / IDLE))


def _silent(_: int) -> None:
    pass
