"""The engine's settings: from the options of ``PrioritizedIK``, for a cold frame, for a frame time."""

from __future__ import annotations

import numpy as np

from sixpoint.errors import SixpointError
from sixpoint.solvers.prioritized.engine.packing import Settings
from sixpoint.solvers.prioritized.tasks import PostureTask

FRAME = 1 / 60  # the time in which the posture takes its step [s]
POSTURE_STEP = 0.1  # largest turn of a joint towards the posture in one iteration [rad]
POSTURE_SPEED = 6.0  # the same from frame to frame [rad/s]


def build_settings(
    posture: PostureTask | None,
    limits: bool,
    gain: float,
    max_angle: float,
    max_shift: float,
    rank_threshold: float,
    iterations: int,
    least_iterations: int,
) -> Settings:
    """Settings of a frame that continues another; see ``PrioritizedIK`` for the options.

    Raises:
        SixpointError: An option makes no sense; the message says what would.
    """
    if not 0 < gain <= 1:
        raise SixpointError(f"the gain is a number above 0, at most 1; got {gain}")
    _check_count(iterations, least_iterations)
    for option, value in (("max_angle", max_angle), ("max_shift", max_shift)):
        if not 0 < value < np.inf:
            raise SixpointError(f"{option} is a positive number, got {value}")
    if not 0 <= rank_threshold < 1:
        raise SixpointError(f"rank_threshold is a share from 0, below 1; got {rank_threshold}")
    return Settings(
        limits=limits,
        gain=gain,
        max_angle=max_angle,
        max_shift=max_shift,
        rank=rank_threshold,
        posture_step=0.0 if posture is None else posture.step,
        posture_cap=POSTURE_STEP,
        posture_after=posture is not None and posture.after,
        most=iterations,
        least=least_iterations,
        drift=1,
    )


def cold(settings: Settings, iterations: int) -> Settings:
    """Settings of a frame without a previous one: the posture acts in the first half of the iterations."""
    _check_count(iterations, settings.least)
    return settings._replace(most=iterations, drift=iterations // 2)


def at_frame_time(settings: Settings, dt: float) -> Settings:
    """Settings whose posture drifts alike at every frame time [s]; an impossible one counts as no time."""
    time = min(dt, 1e3) if dt > 0 else 0.0
    return settings._replace(
        posture_step=1.0 - (1.0 - settings.posture_step) ** (time / FRAME),
        posture_cap=min(POSTURE_SPEED * time, POSTURE_STEP),
    )


def _check_count(iterations: float, least: float) -> None:
    if not (np.isfinite(iterations) and np.isfinite(least) and int(iterations) == iterations):
        raise SixpointError(f"iterations are whole numbers, got {iterations} and least_iterations={least}")
    if not 0 <= least <= iterations:
        raise SixpointError(f"iterations, {iterations}, are at least least_iterations, {least}, and that 0")
