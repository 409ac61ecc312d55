"""What the errors do not tell of a reconstruction: misses, limits, smoothness, sliding feet, jumps, habits.

Like the errors, everything is measured from the written motions by forward kinematics in plain NumPy; no
solver's word is taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.body.targets import Targets
from sixpoint.errors import SkeletonError
from sixpoint.signals.contacts import find_contacts
from sixpoint.study.limit_excess import compute_limit_excess
from sixpoint.study.movement import (
    compute_bend_top,
    compute_clavicle_angle,
    compute_jerk,
    find_swivel_jumps,
)

Array = NDArray[np.float64]

MISSED = 0.01  # an effector farther off than this misses its target [m]
LIMIT_TOLERANCE = np.radians(0.1)  # an excess below this is rounding [rad]
STILL = 1e-9  # a smaller mean third difference is rounding: nothing moves [m]


@dataclass(frozen=True)
class Quality:
    """Measures of a reconstruction beside its errors; NaN where one is not defined.

    Attributes:
        residual_mean: Mean over frames of the largest distance of an effector to its target [m]. Frames
            without any known target do not count, here and in the next three.
        residual_p95: 95th percentile of the same [m].
        residual_max: Largest of the same [m].
        missed: Share of frames with an effector more than 1 cm off its target.
        limit_frames: Share of frames with a posed joint outside its limits by more than 0.1 degrees.
        limit_worst: Largest excess of a joint over its limits in any frame [rad].
        jerk_ratio: Mean third difference of the measured joints' positions over that of the truth; NaN where
            there are fewer than four frames or the truth stands still.
        skate: Mean horizontal way of an ankle from a frame to the next while the true one is in contact in
            both [m]; NaN where there is no contact.
        skate_truth: The same of the truth [m].
        swivel_jumps: Number of changes of an elbow's or knee's swivel angle by more than 30 degrees from a
            frame to the next; all four limbs together.
        swivel_jumps_truth: The same of the truth.
        clavicle: Mean angle of the clavicles from rest [rad]; NaN where the rig has none.
        clavicle_truth: The same of the truth [rad].
        bend_top: Share of the trunk's bending that the upper half of its interior joints does; NaN where
            there are fewer than two, or the trunk is straight.
        bend_top_truth: The same of the truth.
    """

    residual_mean: float
    residual_p95: float
    residual_max: float
    missed: float
    limit_frames: float
    limit_worst: float
    jerk_ratio: float
    skate: float
    skate_truth: float
    swivel_jumps: int
    swivel_jumps_truth: int
    clavicle: float
    clavicle_truth: float
    bend_top: float
    bend_top_truth: float


def measure_quality(figure: Figure, truth: Motion, result: Motion, targets: Targets) -> Quality:
    """Measure a reconstruction.

    Args:
        figure: The anatomy of the rig.
        truth: The recording.
        result: The reconstruction, with as many frames.
        targets: What it was made of, with as many frames; NaN where a point was lost.

    Raises:
        SkeletonError: The motions do not have the figure's joints, or not as many frames.
    """
    if any(motion.skeleton.names != figure.skeleton.names for motion in (truth, result)):
        raise SkeletonError("truth and result must both be motions of the figure's rig")
    if not len(truth) == len(result) == len(targets):
        counts = f"{len(truth)}, {len(result)} and {len(targets)}"
        raise SkeletonError(f"truth, result and targets must have the same number of frames, got {counts}")
    residual = compute_residuals(figure, result, targets)
    excess = compute_limit_excess(figure, result).max(axis=1)
    jerk = compute_jerk(figure, truth)
    contacts = find_contacts(truth.positions[:, figure.roles.ankle], truth.rate)
    return Quality(
        residual_mean=float(residual.mean()) if residual.size else nan,
        residual_p95=float(np.percentile(residual, 95.0)) if residual.size else nan,
        residual_max=float(residual.max()) if residual.size else nan,
        missed=float((residual > MISSED).mean()) if residual.size else nan,
        limit_frames=float((excess > LIMIT_TOLERANCE).mean()),
        limit_worst=float(excess.max()),
        jerk_ratio=compute_jerk(figure, result) / jerk if jerk > STILL else nan,
        skate=_skate(figure, result, contacts),
        skate_truth=_skate(figure, truth, contacts),
        swivel_jumps=int(find_swivel_jumps(figure, result).sum()),
        swivel_jumps_truth=int(find_swivel_jumps(figure, truth).sum()),
        clavicle=compute_clavicle_angle(figure, result),
        clavicle_truth=compute_clavicle_angle(figure, truth),
        bend_top=compute_bend_top(figure, result),
        bend_top_truth=compute_bend_top(figure, truth),
    )


def compute_residuals(figure: Figure, result: Motion, targets: Targets) -> Array:
    """Largest distance of the six effectors to their known targets [m], of each frame that has one."""
    distances = np.linalg.norm(figure.targets(result).positions - targets.positions, axis=-1)
    known = targets.tracked
    worst = np.max(distances, axis=1, where=known, initial=0.0)
    return np.asarray(worst[known.any(axis=1)])


def compute_contact_drift(figure: Figure, truth: Motion, result: Motion) -> Array:
    """How far ankles are from where their contact began, horizontally, in each frame of contact (n,) [m].

    Contacts are those of the true ankles (``find_contacts``), the left ones before the right ones; where a
    contact began is where the result's ankle was in its first frame. The height does not count: an ankle
    rises while the foot rolls over its ball.

    Raises:
        SkeletonError: The motions do not have as many frames.
    """
    if len(truth) != len(result):
        raise SkeletonError(f"truth has {len(truth)} frames, the result {len(result)}")
    ankles = list(figure.roles.ankle)
    contacts = find_contacts(truth.positions[:, ankles], truth.rate).T
    places = np.swapaxes(result.positions[:, ankles], 0, 1)[..., [0, 2]]
    frame = np.arange(len(truth))
    begun = contacts & ~np.pad(contacts, ((0, 0), (1, 0)))[:, :-1]
    first = np.maximum.accumulate(np.where(begun, frame, 0), axis=1)
    ways = places - np.take_along_axis(places, first[..., None], axis=1)
    return np.asarray(np.linalg.norm(ways, axis=-1)[contacts])


def _skate(figure: Figure, motion: Motion, contacts: NDArray[np.bool_]) -> float:
    """Mean horizontal way of the ankles per step between two frames of contact (F, 2) [m]."""
    ankles = motion.positions[:, figure.roles.ankle]
    steps = np.linalg.norm(np.diff(ankles[..., [0, 2]], axis=0), axis=-1)
    standing = contacts[1:] & contacts[:-1]
    return float(steps[standing].mean()) if standing.any() else nan
