"""Sequential IK: six points in, a whole-body pose out, limb by limb in closed form.

Reference: Unzueta, Peinado, Boulic, Suescun, "Full-body performance animation with Sequential Inverse
Kinematics", Graphical Models 70 (2008) 87-104.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError
from sixpoint.solvers.sequential.frame import solve_sequential
from sixpoint.solvers.sequential.packing import work_rows
from sixpoint.solvers.six_points.solver import WALKING, SixPointSolver

Array = NDArray[np.float64]


class SequentialIK(SixPointSolver):
    """Sequential Inverse Kinematics of Unzueta et al. 2008.

    Args:
        figure: What to pose.
        weights: Influence of the wrists' line, the ankles' line and the previous frame on the pelvis' X axis,
            at 120 Hz: ``FIGHTING`` = (1, 1, 0) follows at once, ``WALKING`` = (0.1, 0.1, 1) is steadier.
        limits: Keep every joint within the figure's limits.
        search: "exact" meets the chord length of the bent spine by Newton's method; "literal" steps by
            0.1 and 0.01 rad as Algorithm 3 does.
        clavicles: "neutral" starts the clavicle from rest in every frame; "hold" from the last frame.
        align_pelvis: Twist the trunk about the line pelvis-head after it is placed, so that the pelvis'
            X axis is as near as possible to its estimate (not in the paper).

    Raises:
        SixpointError: An option has an impossible value.
    """

    _entry = staticmethod(solve_sequential)

    def __init__(
        self,
        figure: Figure,
        *,
        weights: tuple[float, float, float] = WALKING,
        limits: bool = True,
        search: Literal["exact", "literal"] = "exact",
        clavicles: Literal["neutral", "hold"] = "neutral",
        align_pelvis: bool = False,
    ) -> None:
        if search not in ("exact", "literal"):
            raise SixpointError(f"search is 'exact' or 'literal', got {search!r}")
        if clavicles not in ("neutral", "hold"):
            raise SixpointError(f"clavicles is 'neutral' or 'hold', got {clavicles!r}")
        super().__init__(figure, weights=weights, limits=limits)
        self._switches = (search == "literal", clavicles == "hold", bool(align_pelvis))

    def _numbers(self) -> tuple[float, ...]:
        return self._switches

    def _make_work(self) -> tuple[Array, ...]:
        return (np.empty((work_rows(self._trunk), 4)),)
