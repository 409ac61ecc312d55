"""Limits that the markers themselves contradict: found by following within and without, and widened."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Dofs
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.widening import widen
from sixpoint.errors import TargetError
from sixpoint.solvers.tracking.engine import packing as tp
from sixpoint.solvers.tracking.solver import MarkerTracker, TrackedMotion
from sixpoint.solvers.tracking.two_sided import carried_by

Array = NDArray[np.float64]

SEEN = 0.9  # share of the markers on and below a joint that say how it is
POOR = 2.0  # frames farther off than this times the median's residual say nothing
LEAST = np.radians(1.0)  # what is less is noise [rad]
WORSE, MORE = 1.1, 5e-4  # limits cost where markers are off by so many times, and so much more [m]
FINE = 60.0  # frames in between are left out where this rate remains [Hz]


def widen_limits(
    model: MarkerModel,
    markers: Array,
    rate: float,
    progress: Callable[[int], None] | None = None,
) -> tuple[Dofs, dict[str, float]]:
    """Limits within which the figure can follow its markers.

    Limits are a table of people. This person may go beyond it, and a calibration whose neutral posture is a
    few degrees off moves every angle by as much. Where markers tell a joint well, and those on and below it
    are farther off within the limits than without, they are believed.

    Args:
        model: Who moves.
        markers: (F, M, 3) positions in the model's order [m], NaN where one is not seen.
        rate: Frames per second [Hz].
        progress: Told how many frames are done.

    Returns:
        What may move and how far, and name of a joint -> growth of its limits [rad], the largest first.

    Raises:
        TargetError: The rate is not positive.
    """
    if not (np.isfinite(rate) and rate > 0):
        raise TargetError(f"the frame rate must be positive, got {rate}")
    dofs, step = model.figure.full_dofs(), max(1, int(rate / FINE))
    thin, trackers = markers[::step], [MarkerTracker(model, limits=keep, dofs=dofs) for keep in (True, False)]

    def tell(way: int, done: int) -> None:
        if progress:
            progress((way * len(markers) + min(done * step, len(markers))) // 2)

    kept, free = (
        tracker.solve_frames(thin, rate / step, two_sided=False, progress=partial(tell, k))
        for k, tracker in enumerate(trackers)
    )
    body, used = trackers[0].body, free.flags == tp.USED
    carries = carried_by(body, model)
    costly = _misses(kept, carries) > WORSE * _misses(free, carries) + MORE
    told = used @ carries > SEEN
    off = np.sqrt(np.sum(free.residual**2 * used, axis=1) / np.maximum(used.sum(axis=1), 1))
    good = off <= POOR * np.median(off[used.any(axis=1)]) + 1e-4 if used.any() else used.any(axis=1)
    before, after = rot.inv(body.before), rot.inv(body.neutral)
    local = rot.mul(rot.mul(before, free.motion.rotations), after)
    joints, grown = dict(dofs.joints), {}
    for joint, dof in dofs.joints.items():
        if not costly[joint]:
            continue
        wider, by = widen(dof, local[good & told[:, joint], joint])
        if by > LEAST:
            joints[joint] = wider
            grown[model.figure.skeleton.names[joint]] = by
    return Dofs(joints, dofs.free_root), dict(sorted(grown.items(), key=lambda entry: -entry[1]))


def _misses(way: TrackedMotion, carries: Array) -> Array:
    """(J,) RMS distance of the markers on and below each joint from their places [m]."""
    used = way.flags == tp.USED
    squares, count = (np.sum(each @ carries, axis=0) for each in (way.residual**2 * used, used))
    return np.asarray(np.sqrt(squares / np.maximum(count, 1e-9)))
