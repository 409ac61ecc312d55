"""Degrees of freedom: per joint, what may move and how far; coordinates q <-> local rotations.

A joint is fixed, a sequence of hinges, or a ball with swing and twist limits (section 7 of
Unzueta et al. 2008). A free root moves as a ball and translates.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from sixpoint.body import rotations as rot
from sixpoint.body.skeleton import frozen
from sixpoint.errors import FigureError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SwingTwist:
    """Limits of a ball joint: swing amplitude psi as a spline of the circumduction angle theta, and twist.

    The joint's segment points along ``axis`` in the neutral pose. Its direction s under a local rotation
    has psi = angle(s, axis) and theta = atan2(s . side, s . forward).

    Attributes:
        axis: (3,) neutral direction of the segment in the parent's anatomical frame.
        forward: (3,) direction of theta = 0, perpendicular to ``axis``.
        side: (3,) direction of theta = 90 degrees.
        theta: (K,) knots of the spline, -pi ... pi [rad].
        psi: (K,) largest swing at each knot [rad]; first and last are equal.
        twist: (2,) least and largest twist about ``axis`` [rad].

    Reference: Unzueta et al. 2008, section 7 and eq. 3.
    """

    axis: Array
    forward: Array
    side: Array
    theta: Array
    psi: Array
    twist: Array

    def __post_init__(self) -> None:
        for name in ("axis", "forward", "side", "theta", "psi", "twist"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        theta, psi = self.theta, self.psi
        if len(theta) < 3 or len(theta) != len(psi) or np.any(np.diff(theta) <= 0):
            raise FigureError("a swing limit needs at least three knots with increasing theta")
        if not np.allclose([theta[0], theta[-1], psi[0]], [-np.pi, np.pi, psi[-1]]):
            raise FigureError("swing knots must run from -180 to 180 degrees and end as they begin")
        if not (np.all(psi >= 0) and np.all(psi <= np.pi)):
            raise FigureError("swing limits must lie between 0 and 180 degrees")
        if not -np.pi <= self.twist[0] <= 0 <= self.twist[1] <= np.pi:
            raise FigureError("the twist range must contain the neutral pose and lie in -180 to 180 degrees")

    @cached_property
    def cubics(self) -> Array:
        """(K - 1, 4) coefficients of each piece in theta minus its knot, highest power first.

        A cubic spline with the same slope at both ends (eq. 3), before clipping to the knots.
        """
        step, rise = np.diff(self.theta), np.diff(self.psi)
        slope = rise / step
        # Slopes m at the knots: given at the ends, continuous curvature in between.
        matrix, right = np.eye(len(self.theta)), np.zeros(len(self.theta))
        right[[0, -1]] = 0.5 * (slope[0] + slope[-1])
        for k in range(1, len(self.theta) - 1):
            matrix[k, k - 1 : k + 2] = 1 / step[k - 1], 2 / step[k - 1] + 2 / step[k], 1 / step[k]
            right[k] = 3.0 * (slope[k - 1] / step[k - 1] + slope[k] / step[k])
        m = np.linalg.solve(matrix, right)
        cubic = (m[:-1] + m[1:] - 2.0 * slope) / step**2
        square = (3.0 * slope - 2.0 * m[:-1] - m[1:]) / step
        return np.column_stack([cubic, square, m[:-1], self.psi[:-1]])

    def compute_limit(self, theta: ArrayLike) -> Array:
        """Largest swing [rad] at circumduction angles [rad]; clipped to its knots, as a cubic overshoots."""
        theta = np.asarray(theta, float)
        piece = np.clip(np.searchsorted(self.theta, theta, side="right") - 1, 0, len(self.theta) - 2)
        x, c = theta - self.theta[piece], self.cubics[piece]
        psi = ((c[..., 0] * x + c[..., 1]) * x + c[..., 2]) * x + c[..., 3]
        return np.asarray(np.clip(psi, self.psi.min(), self.psi.max()), float)

    def decompose(self, local: Array) -> tuple[Array, Array, Array]:
        """Swing, circumduction angle and twist (F,) of rotations (F, 4) [rad]."""
        segment = rot.mul_vec(local, self.axis)
        along = segment @ self.axis
        psi = np.arctan2(np.linalg.norm(segment - along[:, None] * self.axis, axis=-1), along)
        theta = np.arctan2(segment @ self.side, segment @ self.forward)
        return psi, theta, 2.0 * np.arctan2(local[:, :3] @ self.axis, local[:, 3])


@dataclass(frozen=True)
class Fixed:
    """A joint that keeps its neutral rotation."""

    size = 0


@dataclass(frozen=True, eq=False)
class Hinges:
    """One to three hinges in sequence: R = Rot(axes[0], q[0]) Rot(axes[1], q[1]) ...

    Attributes:
        axes: (k, 3) unit axes in the joint's rest frame.
        lower: (k,) least angles [rad].
        upper: (k,) largest angles [rad].
    """

    axes: Array
    lower: Array
    upper: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "axes", frozen(np.reshape(self.axes, (-1, 3))))
        object.__setattr__(self, "lower", frozen(np.atleast_1d(self.lower)))
        object.__setattr__(self, "upper", frozen(np.atleast_1d(self.upper)))
        if not 1 <= self.size <= 3:
            raise FigureError(f"a joint has one to three hinges, got {self.size}")
        if self.lower.shape != (self.size,) or self.upper.shape != (self.size,):
            raise FigureError("each hinge needs a lower and an upper limit")
        if not np.all(self.lower <= self.upper):
            raise FigureError("a hinge's lower limit is above its upper limit")
        if not np.allclose(np.linalg.norm(self.axes, axis=1), 1.0, atol=1e-6):
            raise FigureError("hinge axes must have unit length")
        if np.any(np.abs(np.sum(self.axes[1:] * self.axes[:-1], axis=1)) > 1e-6):
            raise FigureError("consecutive hinge axes of one joint must be perpendicular")

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.axes)

    def compute_angles(self, rotations: ArrayLike) -> Array:
        """Local rotations (..., 4) -> hinge angles (..., k) [rad].

        What the hinges cannot express is lost: one keeps the twist about its axis, two the first two angles
        of the decomposition along their axes.
        """
        quat = np.asarray(rotations, float)
        if self.size == 1:
            angle = 2.0 * np.arctan2(quat[..., :3] @ self.axes[0], quat[..., 3])
            middle = 0.5 * (self.lower[0] + self.upper[0])
            middle = middle if np.isfinite(middle) else 0.0  # the turn that is nearest to the range
            return np.asarray(middle + (angle[..., None] - middle + np.pi) % (2 * np.pi) - np.pi)
        axes = np.array(self.axes)  # SciPy wants a writable array
        if self.size == 2:
            axes = np.vstack([axes, np.cross(axes[0], axes[1])])
        flat = Rotation.from_quat(quat.reshape(-1, 4))
        angles = flat.as_davenport(axes, "intrinsic", suppress_warnings=True)
        return np.asarray(angles[:, : self.size]).reshape(*quat.shape[:-1], self.size)


@dataclass(frozen=True, eq=False)
class Ball:
    """A ball joint; its coordinates are a rotation vector. ``limit`` None means unlimited."""

    limit: SwingTwist | None = None
    size = 3


JointDof = Fixed | Hinges | Ball


@dataclass(frozen=True, eq=False)
class Dofs:
    """The degrees of freedom of a skeleton's joints.

    Attributes:
        joints: Joint index -> what it may do. Joints not listed are fixed in a figure, undeclared in a file.
        free_root: Whether the root also translates.
    """

    joints: Mapping[int, JointDof] = field(default_factory=dict)
    free_root: bool = True

    @classmethod
    def undeclared(cls) -> Dofs:
        """What a file without degrees of freedom (BVH) says."""
        return cls({})

    def __getitem__(self, joint: int) -> JointDof:
        return self.joints.get(joint, Fixed())

    @cached_property
    def starts(self) -> dict[int, int]:
        """First coordinate of each joint that moves."""
        starts, total = {}, 0
        for joint in sorted(self.joints):
            if self[joint].size:
                starts[joint] = total
                total += self[joint].size
        return starts

    @property
    def size(self) -> int:
        """Number of rotational coordinates."""
        return sum(dof.size for dof in self.joints.values())

    def compute_rotations(self, q: ArrayLike, joints: int) -> Array:
        """Coordinates (n,) [rad] -> local rotations (joints, 4) from the neutral pose."""
        q = np.asarray(q, float)
        if q.shape != (self.size,):
            raise FigureError(f"q must have {self.size} coordinates, got {q.shape}")
        out = np.tile(rot.IDENTITY, (joints, 1))
        for joint, start in self.starts.items():
            dof = self[joint]
            values = q[start : start + dof.size]
            if isinstance(dof, Hinges):
                for axis, value in zip(dof.axes, values, strict=True):
                    out[joint] = rot.mul(out[joint], rot.from_axis_angle(axis, value))
            else:
                out[joint] = Rotation.from_rotvec(values).as_quat()
        return out

    def compute_coordinates(self, rotations: ArrayLike) -> Array:
        """Local rotations (J, 4) from the neutral pose -> coordinates (n,) [rad].

        What a joint's hinges cannot express is lost, see ``Hinges.compute_angles``.
        """
        rotations = np.asarray(rotations, float)
        q = np.zeros(self.size)
        for joint, start in self.starts.items():
            dof = self[joint]
            q[start : start + dof.size] = _coordinates(dof, rotations[joint])
        return q


def _coordinates(dof: JointDof, quat: Array) -> Array:
    if isinstance(dof, Ball):
        return np.asarray(Rotation.from_quat(quat).as_rotvec(), float)
    assert isinstance(dof, Hinges)
    return dof.compute_angles(quat)
