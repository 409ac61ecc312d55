"""One method on one clip: solve, time, measure. What fails becomes a row that says why."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.limits import Limits
from sixpoint.body.motion import Motion, Pose
from sixpoint.body.targets import Targets
from sixpoint.errors import SixpointError
from sixpoint.jobs.compare.methods import Method
from sixpoint.jobs.compare.study import Clip
from sixpoint.jobs.reading import ALL, Reading, open_motion, parse_frames
from sixpoint.solvers.base import Solution, Solver
from sixpoint.study.comparison.model import Row, Run
from sixpoint.study.metrics import Errors, compute_errors
from sixpoint.study.movement import compute_local_rotations, compute_turning
from sixpoint.study.quality import measure_quality

Array = NDArray[np.float64]
Frames = Callable[[int], None]

SINGLE_CALLS = 1000
"""Frames at most that are timed call by call."""
ROUNDS, ROUND_TIME = 5, 0.3
"""A batch is repeated this often, or until it took this long in all [s]; the fastest round counts."""


@dataclass(frozen=True, eq=False)
class OpenClip:
    """A clip that was read.

    Attributes:
        clip: Which.
        figure: Anatomy of its rig.
        truth: The recording.
        targets: Its six points.
        sample: The frame that is drawn large.
    """

    clip: Clip
    figure: Figure
    truth: Motion
    targets: Targets
    sample: int

    @property
    def turning(self) -> Array:
        """(F,) speed of the true pelvis about the vertical [rad/s]."""
        return compute_turning(self.figure, self.truth)


def open_clip(clip: Clip, limits: Limits | None = None) -> OpenClip:
    """Read a clip and find its anatomy.

    Raises:
        SixpointError: It cannot be read, cannot be mapped, or lacks the frames asked for.
    """
    frames = parse_frames(clip.frames) if clip.frames else ALL
    opened = open_motion(clip.file, Reading(skeleton=clip.skeleton, frames=frames))
    figure = opened.find_figure(clip.mapping, limits)
    truth = opened.motion
    targets = figure.targets(truth)
    targets = Targets(targets.positions, targets.rate, name=targets.name)
    sample = _most_unusual(figure, truth) if clip.sample is None else clip.sample
    if not 0 <= sample < len(truth):
        raise SixpointError(f"{clip.name}: sample {sample} is not one of its frames, 0 to {len(truth) - 1}")
    return OpenClip(clip, figure, truth, targets, sample)


def _most_unusual(figure: Figure, truth: Motion) -> int:
    """The frame whose joints are farthest from standing at ease."""
    joints = [j for j in sorted(figure.dofs.joints) if j != figure.roles.pelvis]
    return int(np.argmax(rot.angle(compute_local_rotations(figure, truth, joints)).mean(axis=1)))


def run_method(
    opened: OpenClip, method: Method, limits: bool, key: str, frames: Frames
) -> tuple[Row, Run | None]:
    """Solve a clip by a method and measure it.

    Args:
        opened: The clip.
        method: The method.
        limits: Whether joint limits hold.
        key: Name of the row.
        frames: Told how many frames are done.

    Returns:
        The row, and what is drawn; None where the method gave no result.
    """
    clip, truth = opened.clip, opened.truth
    head: dict[str, Any] = {"clip": clip.name, "method": method.name, "key": key}
    head |= {"frames": len(truth), "rate": truth.rate, "options": method.describe(limits, clip.weights)}
    try:
        start = time.perf_counter()
        solver = method.make(opened.figure, limits, clip.weights)
        getattr(solver, "warm_up", _nothing)()
        _first_batch(solver, opened.targets)
        warm = time.perf_counter() - start
        result, failed, whole = _solve(solver, opened, frames)
        errors = compute_errors(opened.figure, truth, result)
        quality = measure_quality(opened.figure, truth, result, opened.targets)
        measured: dict[str, Any] = {name: float(value) for name, value in asdict(quality).items()}
        batch = _time_batch(solver, opened.targets) if whole else nan
        single = _time_calls(solver, opened.targets)
    except Exception as error:  # of any method, also a user's: it is a row, not the end of the comparison
        text = " ".join(str(error).split()) or type(error).__name__
        if not isinstance(error, SixpointError):
            text = f"{type(error).__name__}: {text}"
        return Row(**head, error=text[:500], failed_frames=len(truth)), None
    row = Row(
        **head,
        failed_frames=failed,
        **_errors(errors),
        batch_us=1e6 * batch,
        median_us=1e6 * float(np.median(single)),
        p99_us=1e6 * float(np.percentile(single, 99)),
        warm_up_s=warm,
        **measured,
    )
    sample = result.sliced(slice(opened.sample, opened.sample + 1))
    return row, Run(errors.position_curve, errors.orientation_curve, sample)


def failed_row(clip: Clip, method: Method, key: str, error: SixpointError) -> Row:
    """The row of a clip that could not be read."""
    return Row(clip.name, method.name, 0, nan, key=key, error=" ".join(str(error).split())[:500])


def _errors(errors: Errors) -> dict[str, Any]:
    position, orientation = errors.position_curve, errors.orientation_curve
    return {
        "position": errors.position,
        "orientation": errors.orientation,
        "position_mean": float(position.mean()),
        "position_p95": float(np.percentile(position, 95)),
        "orientation_mean": float(orientation.mean()),
        "orientation_p95": float(np.percentile(orientation, 95)),
        "position_pooled": errors.position_pooled,
    }


def _first_batch(solver: Solver, targets: Targets) -> None:
    """Have all that a batch needs compiled; what is wrong with a frame shows later."""
    try:
        solver.solve_frames(targets.sliced(slice(0, 1)))
    except Exception:
        return


def _nothing() -> None:
    """A user's own method need not warm up."""


def _solve(solver: Solver, opened: OpenClip, frames: Frames) -> tuple[Motion, int, bool]:
    """The motion, the number of frames that failed, and whether all were solved at once.

    Where that raises, or is not offered, frames are solved one by one; a failing one holds the pose before.
    """
    try:
        return solver.solve_frames(opened.targets, frames).motion, 0, True
    except Exception:
        motion, failed = _solve_singly(solver, opened, frames)
        return motion, failed, False


def _solve_singly(solver: Solver, opened: OpenClip, frames: Frames) -> tuple[Motion, int]:
    targets = opened.targets
    poses: list[Pose] = []
    previous: Solution | None = None
    failed, last = 0, ""
    held = opened.figure.neutral_pose
    for number, points in enumerate(targets.positions, start=1):
        try:
            previous = solver.solve(points, previous, 1 / targets.rate)
            held = previous.pose
        except Exception as error:
            failed, last, previous = failed + 1, f"{type(error).__name__}: {error}", None
        poses.append(held)
        if number % 64 == 0 or number == len(targets):
            frames(number)
    if failed == len(targets):
        raise SixpointError(f"no frame was solved; {last}")
    return Motion.from_poses(poses, targets.rate), failed


def _time_batch(solver: Solver, targets: Targets) -> float:
    """Time per frame of ``solve_frames`` [s]."""
    best, spent, rounds = np.inf, 0.0, 0
    while rounds < 1 or (rounds < ROUNDS and spent < ROUND_TIME):
        start = time.perf_counter()
        solver.solve_frames(targets)
        took = time.perf_counter() - start
        best, spent, rounds = min(best, took), spent + took, rounds + 1
    return float(best / len(targets))


def _time_calls(solver: Solver, targets: Targets) -> list[float]:
    """Times of single calls, each from the solution before [s]."""
    times: list[float] = []
    solution: Solution | None = None
    for points in targets.positions[:SINGLE_CALLS]:
        start = time.perf_counter()
        try:
            solution = solver.solve(points, solution, 1 / targets.rate)
        except Exception:
            solution = None
        times.append(time.perf_counter() - start)
    return times
