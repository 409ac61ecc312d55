"""The solver of KMA; what it does is in ``frame``."""

from __future__ import annotations

from sixpoint.solvers.kma.frame import solve_kma
from sixpoint.solvers.six_points.solver import TreeSolver


class KulpaMultonArnaldi(TreeSolver):
    """KMA as adapted by Unzueta et al. 2008.

    Args:
        figure: What to pose.
        weights: Of the pelvis estimate, see ``SixPointSolver``; it alone remembers the last frame.
        limits: Keep every joint within the figure's limits: the spine at each step, limbs at the end.
    """

    name = "kma"
    _entry = staticmethod(solve_kma)
