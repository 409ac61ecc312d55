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
from sixpoint.solvers.tracking.model import lower_markers
from sixpoint.solvers.tracking.priorities import PRIORITIES
from sixpoint.solvers.tracking.running import Followed, State, TrackingEngine, join, reverse
from sixpoint.solvers.tracking.start import find_swaps, place_base, refuse_strays
from sixpoint.solvers.tracking.two_sided import blend

Array = NDArray[np.float64]
Flags = NDArray[np.int64]

CHUNK = 64  # frames between two reports of progress
COLD, STRAYS = 60, 4  # iterations of a first frame, and times that its strays are left out
CAUTIOUS = 0.1  # damping of a first frame, whose steps are large [m]
POOR = 0.03  # a first frame that is off by more on average is also begun without limits [m]
FAR = 1e7  # a marker farther away is not seen [m]
IDLE = 1.0  # time in which what no marker tells goes most of its way to the relaxed posture [s]
LOST, REJECTED, SWAPPED = tp.LOST, tp.REJECTED, tp.SWAPPED


@dataclass(frozen=True, eq=False, repr=False)
class TrackedFrame:
    """One frame.

    Attributes:
        pose: The posture, on the figure's rig.
        residual: (M,) distance of each seen marker from its place on the body [m], 0 where it is lost.
        flags: (M,) what became of each marker: 0 used, 1 not seen, 2 refused, 3 used under another's name.
        iterations: Iterations.
        state: What the next frame needs; give the whole as ``previous``.
    """

    pose: Pose
    residual: Array
    flags: Flags
    iterations: int
    state: State

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
        self._engine, self._starter = TrackingEngine(low[0]), TrackingEngine(low[1])
        self._options = tp.Options(limits, iterations, 0.01, False, gate, 0.0, damping, True)
        self._rest = attractor_state(self.body, PostureTask())

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
            out, state = self._begin(frame[0])
        else:
            if previous.state.markers.shape != (len(self.names), tp.MEMORY):
                raise SixpointError("previous is of another model; begin with previous=None")
            state = previous.state.copy()
            out = self._engine.run(frame, self._rest, state, self._options_at(dt))
        moving, translations = self.body.place_base(out.rotations, out.positions)
        pose = Pose(self.body.rig, out.rotations[0], translations[0], moving)
        return TrackedFrame(pose, out.residual[0], out.flags[0], int(out.iterations[0]), state)

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
        report = progress or _silent
        steady = two_sided is False  # what is followed both ways is made steady afterwards
        out, state = self._follow(markers, 1 / rate, report, steady)
        if two_sided is None:
            two_sided = len(markers) > 1 and bool(np.any(out.flags != tp.USED))
        if two_sided:  # the way back begins where this one ended, and knows what it has learnt
            state.speed[:, :3] *= -1.0
            state.lag[:] = 0.0
            back = self._run(markers[::-1], state, 1 / rate, lambda done: report(len(markers) + done), False)
            bound = partial(self._engine.steady, rate=rate, limits=self._options.limits)
            out = blend(self.body, self.model, out, reverse(back), markers, self._rest, rate, bound)
        moving, translations = self.body.place_base(out.rotations, out.positions)
        motion = Motion(self.body.rig, out.rotations, translations, rate, moving, name=name)
        return TrackedMotion(motion, out.residual, out.flags, out.iterations)

    def warm_up(self) -> None:
        """Compile the kernels, or load them from disk."""
        places = self.model.place(*self.figure.neutral_pose.compute_transforms())
        self.solve_frames(np.stack([places, places]), 100.0, two_sided=True)

    def _follow(
        self, markers: Array, dt: float, progress: Callable[[int], None], steady: bool
    ) -> tuple[Followed, State]:
        """Once through the frames; those before the first with enough markers take its pose."""
        first = next((f for f, frame in enumerate(markers) if _enough(frame)), 0)
        begun, state = self._begin(markers[first])
        rest = self._run(markers[first + 1 :], state, dt, lambda done: progress(first + 1 + done), steady)
        out = join([begun] * (first + 1) + [rest])
        out.flags[:first] = np.where(np.isfinite(markers[:first, :, 0]), tp.REJECTED, tp.LOST)
        out.residual[:first] = 0.0
        return out, state

    def _run(
        self, markers: Array, state: State, dt: float, progress: Callable[[int], None], steady: bool
    ) -> Followed:
        """Frames that continue a state, in chunks."""
        parts, options = [], self._options_at(dt)._replace(steady=steady)
        for start in range(0, max(len(markers), 1), CHUNK):
            chunk = markers[start : start + CHUNK]
            parts.append(self._engine.run(chunk, self._rest, state, options))
            progress(start + len(chunk))
        return join(parts)

    def _begin(self, markers: Array) -> tuple[Followed, State]:
        """A first frame: all markers at one level, from the neutral pose; strays are left out.

        Strays that are where another one should be have each other's labels.
        """
        seen, pairs = markers.copy(), []
        for _ in range(STRAYS):
            out, pose = self._begin_with(seen)
            strays = refuse_strays(out.residual[0], out.flags[0], self._options.gate)
            if not strays.any():
                break
            seen[strays] = np.nan
        if np.isfinite(self._options.gate):
            moving, translations = self.body.place_base(out.rotations, out.positions)
            places = self.model.place(*self.body.rig.compute_transforms(out.rotations, translations, moving))
            pairs = find_swaps(markers, places[0], np.isnan(seen[:, 0]))
        if pairs:
            for pair in pairs:
                seen[pair] = markers[pair[::-1]]
            out, pose = self._begin_with(seen)
        state = self._engine.fresh(pose)
        quiet = self._options._replace(dt=1e-6, most=10)
        out = self._engine.run(seen[None], self._rest, state, quiet)
        state.speed[:] = 0.0
        state.lag[:] = 0.0
        out.flags[0][np.isfinite(markers[:, 0]) & np.isnan(seen[:, 0])] = tp.REJECTED
        for pair in pairs:
            out.flags[0][pair] = tp.SWAPPED
        return out, state

    def _begin_with(self, seen: Array) -> tuple[Followed, Array]:
        """The better one of two ways to the first pose: within the limits all along, or at last."""
        options = self._options._replace(cold=True, most=COLD, posture=0.02, damping=CAUTIOUS)
        start = place_base(self.body, self.model, seen)
        found = []
        for limits in (True, False):
            state = self._starter.fresh(start)
            if not (limits or not self._options.limits):
                self._starter.run(seen[None], self._rest, state, options._replace(limits=False))
            out = self._starter.run(seen[None], self._rest, state, options)
            used = out.flags[0] == tp.USED
            off = float(np.mean(out.residual[0][used])) if used.any() else 0.0
            found.append((off, out, state.pose))
            if off < POOR:
                break
        _, out, pose = min(found, key=lambda entry: entry[0])
        return out, pose

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


def _enough(frame: Array) -> bool:
    """Whether a frame can begin a recording: three markers, of half of those there are."""
    return int(np.isfinite(frame[:, 0]).sum()) >= max(3, len(frame) // 2)


def _silent(_: int) -> None:
    pass
