"""One arm or leg in closed form, laid open: any swivel angle, and which of them keep the limits.

Reference: Tolani, Goswami, Badler, "Real-time inverse kinematics techniques for anthropomorphic limbs",
Graphical Models 62 (2000) 353-388.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Ball, Hinges
from sixpoint.body.figure import Figure
from sixpoint.body.limits import Limits
from sixpoint.errors import SixpointError, TargetError, listed
from sixpoint.kernels.swing_twist import build_ball_rows
from sixpoint.solvers.six_points.frame import FAR
from sixpoint.solvers.tgb.feasible import SAMPLES, find_feasible
from sixpoint.solvers.tgb.swivel import solve_at

Array = NDArray[np.float64]

LIMBS = ("l_wrist", "r_wrist", "l_ankle", "r_ankle")
NO_GOAL = (0.0, 0.0, 0.0, 2.0)


@dataclass(frozen=True, eq=False)
class LimbPosture:
    """Rotations of one limb, in the frame of what carries it (clavicle or pelvis).

    Attributes:
        root: (4,) local rotation of shoulder or hip.
        hinge: (4,) local rotation of elbow or knee.
        end: (4,) local rotation of the end that gives it the wanted rotation; the identity without one.
        position: (3,) where the end is [m].
        residual: Distance to the target [m].
    """

    root: Array
    hinge: Array
    end: Array
    position: Array
    residual: float


class AnalyticLimb:
    """An arm or leg whose end is given: every posture that reaches it, by the swivel angle.

    All vectors and rotations are anatomical and in the frame of what carries the limb (X left, Y up, Z
    forward, the neutral limb along -Y), from the limb's root. At swivel angle 0 the middle joint is on the
    side of ``reference``; the angle grows about the direction from the root to the target.

    Args:
        figure: Whose limb.
        end: "l_wrist", "r_wrist", "l_ankle" or "r_ankle".
        reference: (3,) direction of angle 0; by default down for elbows and forward for knees.
        limits: Ranges of forearm and wrist, which a figure does not carry; the shipped table by default.

    Raises:
        SixpointError: There is no such limb, or the reference has no direction.
    """

    def __init__(
        self, figure: Figure, end: str, reference: ArrayLike | None = None, limits: Limits | None = None
    ) -> None:
        if end not in LIMBS:
            raise SixpointError(f"no limb ends at {end!r}; there are: {listed(LIMBS)}")
        number = LIMBS.index(end)
        self.figure, self.end = figure, end
        root, middle, tip = figure.roles.limbs[number]
        self._h = -1.0 if number < 2 else 1.0
        flexion, ball = figure.dofs[middle], figure.dofs[root]
        assert isinstance(flexion, Hinges) and isinstance(ball, Ball)
        low, high = sorted((self._h * flexion.lower[0], self._h * flexion.upper[0]))
        upper, lower = (
            float(np.linalg.norm(figure.offset_between(a, b))) for a, b in ((root, middle), (middle, tip))
        )
        self.lengths = (upper, lower)
        self._limb = np.array([upper, lower, low, high, self._h])
        self._balls = build_ball_rows([ball.limit])
        self._wrist = self._end_ranges(middle, tip, limits) if number < 2 else None
        side = np.array([0.0, -1.0, 0.0] if number < 2 else [0.0, 0.0, 1.0])
        self.reference = side if reference is None else _numbers(reference, 3, "the reference is a direction")
        if not np.linalg.norm(self.reference) > 1e-6:
            raise SixpointError("the reference of the swivel angle needs a direction")

    def _end_ranges(self, elbow: int, wrist: int, limits: Limits | None) -> Array:
        """(3, 2) pronation, flexion and deviation [rad]."""
        dofs = self.figure.full_dofs(limits)
        forearm, hand = dofs[elbow], dofs[wrist]
        assert isinstance(forearm, Hinges) and isinstance(hand, Hinges)
        return np.array([[dof.lower[k], dof.upper[k]] for dof, k in ((forearm, 1), (hand, 0), (hand, 1))])

    def solve(self, target: ArrayLike, swivel: float = 0.0, rotation: ArrayLike | None = None) -> LimbPosture:
        """The posture at a swivel angle; limits are left to the caller, see ``feasible_swivels``.

        Args:
            target: (3,) where the end should be [m]. Out of reach the limb is straight towards it.
            swivel: Angle about the line to the target [rad].
            rotation: (4,) rotation that the end should have.

        Raises:
            TargetError: The target, the angle or the rotation is no such thing.
        """
        goal, turn = self._checked(target, rotation)
        if not np.isfinite(swivel):
            raise TargetError(f"the swivel angle is a number [rad], got {swivel}")
        upper, lower, low, high, h = self._limb.tolist()
        reference = tuple(self.reference.tolist())
        root, hinge, position = solve_at(
            tuple(goal.tolist()), upper, lower, h, reference, swivel, False, self._balls, 0, low, high
        )
        end = np.array([0.0, 0.0, 0.0, 1.0])
        if turn is not None:
            end = rot.mul(rot.inv(rot.mul(np.array(root), np.array(hinge))), turn)
        residual = float(np.linalg.norm(goal - position))
        return LimbPosture(np.array(root), np.array(hinge), end, np.array(position), residual)

    def feasible_swivels(
        self, target: ArrayLike, rotation: ArrayLike | None = None
    ) -> list[tuple[float, float]]:
        """Intervals of swivel angles at which the limits hold.

        Args:
            target: (3,) where the end should be [m].
            rotation: (4,) rotation that the hand should have: forearm and wrist must then reach it.

        Returns:
            (low, high) [rad] in -pi ... pi, the last may pass pi; the whole circle is (-pi, pi); nothing
            where the flexion itself is out of range. The circle is sampled every 5 degrees: a narrower
            interval may be missed.

        Raises:
            SixpointError: A rotation was given for a leg: its ankle cannot turn about the shank.
            TargetError: As ``solve``.
        """
        goal, turn = self._checked(target, rotation)
        if turn is not None and self._wrist is None:
            raise SixpointError("rotations are for hands: an ankle does not turn about the shank")
        wrist = np.zeros((3, 2)) if self._wrist is None else self._wrist
        intervals = np.empty((SAMPLES, 2))
        count = find_feasible(
            goal[None],
            self._limb,
            self.reference[None].copy(),
            self._balls,
            np.array([NO_GOAL if turn is None else turn]),
            wrist,
            intervals,
        )
        return [(float(a), float(b)) for a, b in intervals[:count]]

    def _checked(self, target: ArrayLike, rotation: ArrayLike | None) -> tuple[Array, Array | None]:
        goal = _numbers(target, 3, "the target of a limb is a position [m]")
        if rotation is None:
            return goal, None
        turn = _numbers(rotation, 4, "a rotation is a quaternion xyzw")
        if not np.linalg.norm(turn) > 1e-6:
            raise TargetError(f"a rotation is a quaternion xyzw, got {rotation!r}")
        return goal, turn / np.linalg.norm(turn)


def _numbers(values: ArrayLike, count: int, what: str) -> Array:
    """Finite numbers of a fixed count, none absurdly large."""
    try:
        array = np.array(values, float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (count,) or not np.all(np.abs(array) < FAR):
        raise TargetError(f"{what}: {count} finite numbers, got {values!r}")
    return array
