"""Six points from markers: centres of joints by rigid fits of the segments they belong to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.motion import Motion
from sixpoint.body.rigid import fit_rigid
from sixpoint.body.targets import EFFECTORS, Targets

Array = NDArray[np.float64]

REACH = 0.35
"""Without three markers on a segment those this near to the joint tell where it is [m]."""


def reduce_to_six(
    model: MarkerModel, markers: Array, tracked: Motion, rate: float, name: str
) -> tuple[Targets, tuple[str, ...]]:
    """The six points of a recording of markers.

    Where three markers of a joint's segment are seen, their rigid fit places the joint. Else, while some
    marker near it is seen, it is where the followed body has it, moved by what these markers are off by.

    Args:
        model: Who moves.
        markers: (F, M, 3) positions in the model's order [m], NaN where one is not seen.
        tracked: The followed motion, for segments with fewer markers.
        rate: Frames per second [Hz].
        name: Of the targets.

    Returns:
        The points, NaN where no marker near one is seen; and which of them came from the followed body in
        most frames.
    """
    figure = model.figure
    roles, parents = figure.roles, figure.skeleton.parents
    positions, world = tracked.transforms
    places = model.place(positions, world)
    joints = dict(zip(EFFECTORS, (roles.pelvis, roles.head, *roles.wrist, *roles.ankle), strict=True))
    points, borrowed = np.full((len(markers), 6, 3), np.nan), []
    for k, (effector, joint) in enumerate(joints.items()):
        offset = roles.head_offset if effector == "head" else np.zeros(3)
        # The joint is a point of its own segment and of the one above: a hand, or its forearm.
        carriers = [joint] if effector in ("pelvis", "head") else [int(parents[joint]), joint]
        for carrier in carriers:
            mine = np.flatnonzero(model.joints == carrier)
            if len(mine) < 3:
                continue
            turn, shift = fit_rigid(model.offsets[mine], markers[:, mine])
            local = offset if carrier == joint else figure.skeleton.offsets[joint]
            found = shift + rot.mul_vec(turn, local)
            points[:, k] = np.where(np.isfinite(points[:, k]), points[:, k], found)
        open_ = ~np.isfinite(points[:, k, 0])
        place = positions[:, joint] + rot.mul_vec(world[:, joint], offset)
        near = np.flatnonzero(np.isin(model.joints, carriers))
        if open_.any() and len(near):
            off = markers[:, near] - places[:, near]
            seen = np.isfinite(off[..., 0]) & (
                np.linalg.norm(places[:, near] - place[:, None], axis=-1) < REACH
            )
            count = np.maximum(seen.sum(axis=1), 1)[:, None]
            moved = place + np.where(seen[..., None], off, 0.0).sum(axis=1) / count
            points[:, k] = np.where((open_ & seen.any(axis=1))[:, None], moved, points[:, k])
            if open_.mean() > 0.5:
                borrowed.append(effector)
    return Targets(points, rate, name=name), tuple(borrowed)
