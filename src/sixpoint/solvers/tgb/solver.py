"""The solver of TGBSIK; what it does is in ``frame``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError
from sixpoint.solvers.sequential.packing import work_rows
from sixpoint.solvers.six_points.solver import WALKING, SixPointSolver
from sixpoint.solvers.tgb.frame import solve_tgbsik

Array = NDArray[np.float64]


class TGBSequentialIK(SixPointSolver):
    """Sequential IK with limbs at the swivel angle of least effort.

    Args:
        figure: What to pose.
        weights: Influence of the wrists' line, the ankles' line and the previous frame on the pelvis' X axis,
            at 120 Hz: ``FIGHTING`` = (1, 1, 0) follows at once, ``WALKING`` = (0.1, 0.1, 1) is steadier.
        limits: Keep every joint within the figure's limits; limbs are clamped at the end.
        twist_weight: Weight of twist against swing of shoulders and hips.

    Raises:
        SixpointError: An option has an impossible value.
    """

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
