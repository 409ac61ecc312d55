"""Jacobian transpose, pseudoinverse, damped least squares (two ways) and selectively damped least squares.

References: Buss and Kim 2005 and the papers in ``steps``; as set up by Unzueta et al. 2008, section 9.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError, listed
from sixpoint.solvers.jacobian import steps
from sixpoint.solvers.jacobian.frame import LONG_ROWS, SMALL_ROWS, M, solve_jacobian
from sixpoint.solvers.relaxed import ELBOW, HIP, KNEE, SHOULDER_BACK, SHOULDER_OUT
from sixpoint.solvers.six_points.packing import Model
from sixpoint.solvers.six_points.solver import WALKING, TreeSolver
from sixpoint.solvers.six_points.tree import BALL, Tree

Array = NDArray[np.float64]

X, Z = np.eye(3)[[0, 2]]

RULES = {
    "transpose": steps.TRANSPOSE,
    "pseudoinverse": steps.PSEUDOINVERSE,
    "dls": steps.DLS,
    "dls-svd": steps.DLS_SVD,
    "sdls": steps.SDLS,
}
DAMPING = 0.075
"""Damping factor [m]. The paper's "75" has no unit; as millimetres it is this, as cm^2 nearly so."""
LEAST_DAMPING = 1e-5
"""Below it the normal equations of "dls" are singular in double precision [m]."""
REACH = 0.1
"""Farthest that one iteration asks an end to move [m]."""


class JacobianIK(TreeSolver):
    """Numerical IK of head, wrists and ankles at once, by steps of the joint angles.

    Args:
        figure: What to pose.
        step: "transpose", "pseudoinverse", "dls" (damped least squares), "dls-svd" (the same by singular
            values) or "sdls" (selectively damped).
        weights: Influence of the wrists' line, the ankles' line and the previous frame on the pelvis' X axis,
            at 120 Hz: ``FIGHTING`` = (1, 1, 0) follows at once, ``WALKING`` = (0.1, 0.1, 1) is steadier.
        limits: Keep every joint within the figure's limits, after each step.
        damping: Of "dls" and "dls-svd" [m].
        reach: Farthest that one step asks an end to move [m].
        solve_root: Also turn the pelvis, from its estimate.

    Raises:
        SixpointError: An option has an impossible value; the message says what would work.
    """

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
        if not LEAST_DAMPING <= damping < np.inf or not 0 < reach < np.inf:
            raise SixpointError(
                f"damping, from {LEAST_DAMPING:g}, and reach are lengths in metres; got {damping} and {reach}"
            )
        self.step, self.damping, self.reach, self.solve_root = step, float(damping), float(reach), solve_root
        super().__init__(figure, weights=weights, limits=limits)
        self._relax()

    def _relax(self) -> None:
        """Start with slightly bent limbs: a straight one is singular, and a hinge's limit may hold it."""
        first = self._trunk + 2
        for k, side in enumerate((1.0, -1.0)):
            shoulder, elbow, hip, knee = (first + 2 * n + k for n in range(4))
            out, back = rot.from_axis_angle(Z, side * SHOULDER_OUT), rot.from_axis_angle(X, SHOULDER_BACK)
            self._start[shoulder] = rot.mul(out, back)
            self._start[elbow] = rot.from_axis_angle(X, -ELBOW)
            self._start[hip], self._start[knee] = (rot.from_axis_angle(X, a) for a in (-HIP, KNEE))

    def _numbers(self) -> tuple[float, ...]:
        return (RULES[self.step], self.damping, self.reach)

    def _build_tree(self, model: Model) -> Tree:
        tree = super()._build_tree(model)
        if self.solve_root:
            tree.kind[0] = BALL
        sizes = np.array([0, 3, 1])[tree.kind]
        self._starts, self._size = np.cumsum(sizes) - sizes, int(sizes.sum())
        return tree

    def _lower(self, model: Model) -> tuple[NDArray[Any], ...]:
        return (*super()._lower(model), self._starts)

    def _make_work(self) -> tuple[Array, ...]:
        return (*super()._make_work(), np.zeros((LONG_ROWS, self._size)), np.zeros((SMALL_ROWS, M)))
