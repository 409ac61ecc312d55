"""Jacobian transpose, pseudoinverse, damped least squares (two ways) and selectively damped least squares.

References: Buss and Kim 2005 and the papers in ``steps``; as set up by Unzueta et al. 2008, section 9.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError, listed
from sixpoint.solvers.jacobian import steps
from sixpoint.solvers.jacobian.frame import LONG_ROWS, SMALL_ROWS, M, solve_jacobian
from sixpoint.solvers.six_points.packing import LIMB_ROWS, Model
from sixpoint.solvers.six_points.solver import WALKING, SixPointSolver
from sixpoint.solvers.six_points.tree import BALL, build_tree, pack_tree

Array = NDArray[np.float64]

RULES = {
    "transpose": steps.TRANSPOSE,
    "pseudoinverse": steps.PSEUDOINVERSE,
    "dls": steps.DLS,
    "dls-svd": steps.DLS_SVD,
    "sdls": steps.SDLS,
}
DAMPING = 0.075
"""Damping factor [m]. The paper's "75" has no unit; as millimetres, or as a square in centimetres, it is this."""
REACH = 0.1
"""Farthest that one iteration asks an end to move [m]."""


class JacobianIK(SixPointSolver):
    """Numerical IK of head, wrists and ankles at once, by steps of the joint angles.

    Args:
        figure: What to pose.
        step: "transpose", "pseudoinverse", "dls" (damped least squares), "dls-svd" (the same by singular
            values) or "sdls" (selectively damped).
        weights: Of the pelvis estimate, see ``SixPointSolver``.
        limits: Keep every joint within the figure's limits, after each step.
        damping: Of "dls" and "dls-svd" [m].
        reach: Farthest that one step asks an end to move [m].
        solve_root: Also turn the pelvis, from its estimate.

    Raises:
        SixpointError: An option has an impossible value; the message says what would work.
    """

    name = "jacobian"
    _entry = staticmethod(solve_jacobian)

    def __init__(
        self,
        figure: Figure,
        step: Literal["transpose", "pseudoinverse", "dls", "dls-svd", "sdls"] = "dls",
        *,
        weights: tuple[float, float, float] = WALKING,
        limits: bool = True,
        damping: float = DAMPING,
        reach: float = REACH,
        solve_root: bool = False,
    ) -> None:
        if step not in RULES:
            raise SixpointError(f"no step rule named {step!r}; there are: {listed(RULES)}")
        if not 0 < damping < np.inf or not 0 < reach < np.inf:
            raise SixpointError(f"damping and reach are positive lengths in metres, got {damping} and {reach}")
        self.step, self.damping, self.reach, self.solve_root = step, float(damping), float(reach), solve_root
        super().__init__(figure, weights=weights, limits=limits)

    def _numbers(self) -> tuple[float, ...]:
        return (RULES[self.step], self.damping, self.reach)

    def _lower(self, model: Model) -> tuple[NDArray[Any], ...]:
        tree = build_tree(self.figure, model)
        if self.solve_root:
            tree.kind[0] = BALL
        sizes = np.array([0, 3, 1])[tree.kind]
        self._size = int(sizes.sum())
        return (*super()._lower(model), *pack_tree(tree), np.cumsum(sizes) - sizes)

    def _make_work(self) -> tuple[Array, ...]:
        work = np.zeros((2 * (self._trunk + LIMB_ROWS) + 6, 4))
        return (work, np.zeros((LONG_ROWS, self._size)), np.zeros((SMALL_ROWS, M)))
