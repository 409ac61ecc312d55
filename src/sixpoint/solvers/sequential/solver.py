"""Sequential IK: six points in, a whole-body pose out, limb by limb in closed form.

Reference: Unzueta, Peinado, Boulic, Suescun, "Full-body performance animation with Sequential Inverse
Kinematics", Graphical Models 70 (2008) 87-104.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError
from sixpoint.solvers.avoidance.options import check_avoid, find_flesh
from sixpoint.solvers.sequential.clear import solve_sequential_clear
from sixpoint.solvers.sequential.frame import solve_sequential
from sixpoint.solvers.sequential.packing import work_rows
from sixpoint.solvers.six_points.packing import Model
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
        avoid: "elbows" keeps elbows out of the trunk (the paper's section 8), by the figure's shape or,
            without one, by elliptic cylinders; "forearms" also forearms and hands, out of trunk and head;
            "thighs" thighs out of each other; "arms" elbows, forearms and hands out of the thighs, and elbows
            out of the trunk. Wrists and ankles stay on their targets; nothing is avoided by default.

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
        avoid: Sequence[str] = (),
    ) -> None:
        if search not in ("exact", "literal"):
            raise SixpointError(f"search is 'exact' or 'literal', got {search!r}")
        if clavicles not in ("neutral", "hold"):
            raise SixpointError(f"clavicles is 'neutral' or 'hold', got {clavicles!r}")
        self.avoid = check_avoid(avoid)
        super().__init__(figure, weights=weights, limits=limits)
        self._switches = (search == "literal", clavicles == "hold", bool(align_pelvis))

    def _lower(self, model: Model) -> tuple[NDArray[Any] | None, ...]:
        flesh = find_flesh(self.figure, self.figure.spine_chain, self.avoid)
        return (*super()._lower(model), *(flesh or ()))

    def _entry_of(self, beside: tuple[Array, ...]) -> Callable[..., None]:
        return solve_sequential_clear if self.avoid else type(self)._entry

    def _numbers(self) -> tuple[float, ...]:
        return self._switches

    def _make_work(self) -> tuple[Array, ...]:
        return (np.empty((work_rows(self._trunk), 4)),)
