"""TGBSIK: the trunk and clavicles of Sequential IK, the limbs of Tolani, Goswami and Badler.

The swivel angle of each limb is the one of least swing^2 + weight twist^2 of shoulder or hip, on the whole
circle. That minimum jumps where two of them are alike.

References: Tolani, Goswami, Badler, "Real-time inverse kinematics techniques for anthropomorphic limbs",
Graphical Models 62 (2000) 353-388; Unzueta et al. 2008, section 9.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError
from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper
from sixpoint.solvers.sequential.frame import place_limb, pose_trunk
from sixpoint.solvers.sequential.packing import unpack_settings, unpack_work, work_rows
from sixpoint.solvers.six_points.frame import MEMORY_ROWS, judge, write_frame
from sixpoint.solvers.six_points.packing import limb_row, unpack_model
from sixpoint.solvers.six_points.solver import WALKING, SixPointSolver
from sixpoint.solvers.tgb.swivel import solve_easiest

Array = NDArray[np.float64]


@helper
def solve_frame(model, settings, weight, points, local, memory, residual, scratch):
    """One frame; arguments as of ``sequential.frame.solve_frame``, ``weight`` is that of twist."""
    lost, root = pose_trunk(model, settings, points, local, memory, residual, scratch)
    world, segs, filled = scratch.world, scratch.segs, scratch.filled
    for limb in range(4):
        residual[limb + 2] = 0.0
        if filled[limb + 2, 3] == 0.0:
            continue
        target = vec.load(filled, limb + 2)
        frame, place = place_limb(model, settings, limb, root, target, local, world, segs)
        row = limb_row(segs.shape[0], limb)
        upper, hinge, end = solve_easiest(
            qt.inv_mul_vec(frame, vec.sub(target, place)),
            model.limbs[limb, 0],
            model.limbs[limb, 1],
            -1.0 if limb < 2 else 1.0,
            weight,
            settings.limits,
            model.balls,
            row,
            model.limbs[limb, 2],
            model.limbs[limb, 3],
        )
        qt.store(local, row, upper)
        qt.store(local, row + 2, hinge)
        residual[limb + 2] = vec.norm(vec.sub(target, vec.add(place, qt.mul_vec(frame, end))))
    return judge(lost, residual)


@entry
def solve_tgbsik(
    table, integers, balls, chords, work, options, points, state, rotations, pelvis, outcome, residual
):
    """Solve F frames in order; arguments as of ``sequential.frame.solve_sequential``."""
    model = unpack_model(table, integers, balls, chords)
    settings = unpack_settings(options)
    scratch = unpack_work(work, model.segments.shape[0])
    rows = state.shape[0] - MEMORY_ROWS
    local, memory = state[:rows], state[rows:]
    for f in range(points.shape[0]):
        outcome[f, 0] = solve_frame(
            model, settings, options[7], points[f], local, memory, residual[f], scratch
        )
        outcome[f, 1] = 1
        write_frame(model, local, memory, rotations[f], pelvis[f])


class TGBSequentialIK(SixPointSolver):
    """Sequential IK with limbs at the swivel angle of least effort.

    Args:
        figure: What to pose.
        weights: Of the pelvis estimate, see ``SixPointSolver``.
        limits: Keep every joint within the figure's limits; limbs are clamped at the end.
        twist_weight: Weight of twist against swing of shoulders and hips.

    Raises:
        SixpointError: An option has an impossible value.
    """

    name = "tgbsik"
    _entry = staticmethod(solve_tgbsik)

    def __init__(
        self,
        figure: Figure,
        *,
        weights: tuple[float, float, float] = WALKING,
        limits: bool = True,
        twist_weight: float = 1.0,
    ) -> None:
        if not 0 <= twist_weight < np.inf:
            raise SixpointError(f"the weight of twist is a number from 0, got {twist_weight}")
        super().__init__(figure, weights=weights, limits=limits)
        self.twist_weight = float(twist_weight)

    def _numbers(self) -> tuple[float, ...]:
        return (0.0, 0.0, 0.0, self.twist_weight)  # exact search, clavicles from rest, trunk not aligned

    def _make_work(self) -> tuple[Array, ...]:
        return (np.empty((work_rows(self._trunk), 4)),)
