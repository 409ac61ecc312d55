"""A take that exists as markers and as a skeleton, followed: whole, with gaps, and with limbs lost.

The skeleton is the truth as its makers fitted it; see ``takes`` for which joints are compared. Neither the
calibration nor the tracker sees it.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from lost_limbs import GAP, LIMBS, excess
from takes import compare_take
from virtual_markers import drop

import sixpoint as sp
from sixpoint.body.markers.recording import Markers
from sixpoint.calibration.markers import calibrate_markers
from sixpoint.jobs.track.models import columns_of
from sixpoint.solvers.tracking.limits import widen_limits
from sixpoint.solvers.tracking.solver import MarkerTracker
from sixpoint.study.tracking import overall

EVERY = 0.5  # from the beginning of one lost limb to that of the next [s]
SEEDS = (3, 4, 5)  # of deleted samples
COLUMNS = (
    "take", "markers", "residual, RMS [cm]", "joint error [cm]", "95 % below [cm]", "varying [cm]",
    "with gaps, causal", "two-sided", "limbs lost", "worst jump, causal [cm]", "two-sided", "times real time",
)  # fmt: skip


def measure_take(name: str, markers: Markers, truth: sp.Motion, layout: Path | None) -> list[str]:
    """One row of ``COLUMNS``."""
    model, rate = calibrate_markers(markers, None, layout), markers.rate
    positions = columns_of(model, markers)
    MarkerTracker(model).warm_up()
    start = time.process_time()
    tracker = MarkerTracker(model, dofs=widen_limits(model, positions, rate)[0])
    whole = tracker.solve_frames(positions, rate)
    seconds = (time.process_time() - start) / len(positions)
    apart = compare_take(whole.motion, truth)
    gaps, jumps, count = [], [], 0
    for two_sided in (False, True):
        worse = [
            compare_take(
                tracker.solve_frames(drop(positions, rate, seed), rate, two_sided=two_sided).motion, truth
            ).mean
            for seed in SEEDS
        ]
        gaps.append(f"{100 * (np.mean(worse) / apart.mean - 1):+.1f} %")
        found = lose_limbs(tracker, positions, rate, whole.motion, two_sided)
        jumps.append(f"{100 * max(found):.1f}")
        count = len(found)
    return [
        name, str(len(model.names)), f"{100 * overall(whole.residual, whole.flags):.2f}",
        f"{100 * apart.mean:.2f}", f"{100 * np.percentile(apart.distance, 95):.1f}",
        f"{100 * np.sqrt(np.mean(apart.varying**2)):.1f}", *gaps, str(count), *jumps,
        f"{1 / seconds / rate:.0f}",
    ]  # fmt: skip


def lose_limbs(
    tracker: MarkerTracker, positions: np.ndarray, rate: float, whole: sp.Motion, two_sided: bool
) -> list[float]:
    """How much further than with all markers a joint moves in one frame at most, of every gap [m]."""
    roles, gap = tracker.figure.roles, round(GAP * rate)
    joints = [roles.pelvis, roles.head, *(j for limb in roles.limbs for j in limb)]
    names = [name.split(":")[-1] for name in tracker.names]
    found = []
    for side, labels in LIMBS.values():
        columns = [names.index(side + label) for label in labels if side + label in names]
        for start in range(5, len(positions) - gap - 5, round(EVERY * rate)):
            lost = positions.copy()
            lost[start : start + gap, columns] = np.nan
            ours = tracker.solve_frames(lost, rate, two_sided=two_sided).motion
            found.append(float(excess(ours.positions[:, joints], whole.positions[:, joints]).max()))
    return found
