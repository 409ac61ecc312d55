"""The solver of KMA; what it does is in ``frame``."""

from __future__ import annotations

from sixpoint.solvers.kma.frame import solve_kma
from sixpoint.solvers.six_points.solver import TreeSolver


class KulpaMultonArnaldi(TreeSolver):
    """KMA as adapted by Unzueta et al. 2008.

    Args:
        figure: What to pose.
        weights: Influence of the wrists' line, the ankles' line and the previous frame on the pelvis' X axis,
            at 120 Hz: ``FIGHTING`` = (1, 1, 0) follows at once, ``WALKING`` = (0.1, 0.1, 1) is steadier. The
            axis alone remembers the last frame.
        limits: Keep every joint within the figure's limits: the spine at each step, limbs at the end.
    """

    _entry = staticmethod(solve_kma)
