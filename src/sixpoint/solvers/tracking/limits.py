"""Limits that the markers themselves contradict: found by following without any, and widened by as much."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Dofs
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.widening import widen
from sixpoint.solvers.tracking.engine import packing as tp
from sixpoint.solvers.tracking.solver import MarkerTracker
from sixpoint.solvers.tracking.two_sided import carried_by

Array = NDArray[np.float64]

SEEN = 0.9  # share of the markers on and below a joint that say how it is
FAR = 2.0  # frames farther off than this times the median's residual say nothing
LEAST = np.radians(1.0)  # what is less is noise [rad]


def widen_limits(
    model: MarkerModel,
    markers: Array,
    rate: float,
    progress: Callable[[int], None] | None = None,
) -> tuple[Dofs, dict[str, float]]:
    """Limits within which the figure can follow its markers.

    Limits are a table of people. This person may go beyond it, and a calibration whose neutral posture is a
    few degrees off moves every angle by as much. Where markers tell a joint well, they are believed.

    Args:
        model: Who moves.
        markers: (F, M, 3) positions in the model's order [m], NaN where one is not seen.
        rate: Frames per second [Hz].
        progress: Told how many frames are done.

    Returns:
        What may move and how far, and name of a joint -> growth of its limits [rad], the largest first.
    """
    dofs = model.figure.full_dofs()
    tracker = MarkerTracker(model, limits=False, dofs=dofs)
    free = tracker.solve_frames(markers, rate, two_sided=False, progress=progress)
    body, used = tracker.body, free.flags == tp.USED
    told = used @ carried_by(body, model) > SEEN
    off = np.sqrt(np.sum(free.residual**2 * used, axis=1) / np.maximum(used.sum(axis=1), 1))
    good = off <= FAR * np.median(off) + 1e-4
    before, after = rot.inv(body.before), rot.inv(body.neutral)
    local = rot.mul(rot.mul(before, free.motion.rotations), after)
    joints, grown = dict(dofs.joints), {}
    for joint, dof in dofs.joints.items():
        wider, by = widen(dof, local[good & told[:, joint], joint])
        if by > LEAST:
            joints[joint] = wider
            grown[model.figure.skeleton.names[joint]] = by
    return Dofs(joints, dofs.free_root), dict(sorted(grown.items(), key=lambda entry: -entry[1]))
