"""The solver of Cyclic Coordinate Descent; what it does is in ``frame``."""

from __future__ import annotations

from typing import Literal

from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError
from sixpoint.solvers.ccd.frame import solve_ccd
from sixpoint.solvers.six_points.solver import WALKING, TreeSolver


class CyclicCoordinateDescent(TreeSolver):
    """CCD on spine, arms and legs.

    Args:
        figure: What to pose.
        weights: Influence of the wrists' line, the ankles' line and the previous frame on the pelvis' X axis,
            at 120 Hz: ``FIGHTING`` = (1, 1, 0) follows at once, ``WALKING`` = (0.1, 0.1, 1) is steadier.
        limits: Keep every joint within the figure's limits, at each step.
        order: "tip" sweeps from the end of a chain to its root, "root" the other way; the paper's text says
            both, its results speak for "tip".

    Raises:
        SixpointError: An option has an impossible value.
    """

    _entry = staticmethod(solve_ccd)

    def __init__(
        self,
        figure: Figure,
        *,
        weights: tuple[float, float, float] = WALKING,
        limits: bool = True,
        order: Literal["tip", "root"] = "tip",
    ) -> None:
        if order not in ("tip", "root"):
            raise SixpointError(f"order is 'tip' or 'root', got {order!r}")
        super().__init__(figure, weights=weights, limits=limits)
        self.order = order

    def _numbers(self) -> tuple[float, ...]:
        return (self.order == "root",)
