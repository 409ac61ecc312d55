"""A surface on a skeleton: a triangle mesh whose vertices follow the joints (linear blend skinning).

The mesh is kept as it is in one pose of the skeleton, the bind pose, which need not be its rest pose. A
vertex v carried by joints j with weights w moves to ``sum_j w_j (p_j + R_j inv(B_j) (v - b_j))``, where
(b, B) are the joints' places in the bind pose and (p, R) those now.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.skeleton import frozen
from sixpoint.errors import FigureError

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False, repr=False)
class Shape:
    """A skinned triangle mesh.

    Attributes:
        vertices: (V, 3) in the bind pose [m].
        triangles: (T, 3) vertices, counter-clockwise seen from outside.
        joints: (V, K) joints that carry each vertex; an unused place has any joint and weight 0.
        weights: (V, K) how much, not negative; each row sums to one.
        bind_positions: (J, 3) places of all joints in the bind pose [m].
        bind_rotations: (J, 4) their world rotations there.
        name: For messages and files.
        parts: Name -> range of triangles, where the surface is made of named pieces; may be empty.
    """

    vertices: Array
    triangles: Index
    joints: Index
    weights: Array
    bind_positions: Array
    bind_rotations: Array
    name: str = "body"
    parts: Mapping[str, slice] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"Shape({self.name!r}, {len(self.vertices)} vertices, {len(self.triangles)} triangles)"

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        for name, dtype in (
            ("vertices", np.float64),
            ("triangles", np.int64),
            ("joints", np.int64),
            ("weights", np.float64),
            ("bind_positions", np.float64),
            ("bind_rotations", np.float64),
        ):
            set_(self, name, frozen(getattr(self, name), dtype))
        count, joints = len(self.vertices), len(self.bind_positions)
        if self.vertices.shape != (count, 3) or self.triangles.shape != (len(self.triangles), 3):
            raise FigureError(
                f"a shape needs vertices (V, 3) and triangles (T, 3), "
                f"got {self.vertices.shape} and {self.triangles.shape}"
            )
        if self.bind_positions.shape != (joints, 3) or self.bind_rotations.shape != (joints, 4):
            raise FigureError(
                f"a bind pose is positions (J, 3) and rotations (J, 4), "
                f"got {self.bind_positions.shape} and {self.bind_rotations.shape}"
            )
        if self.joints.ndim != 2 or len(self.joints) != count or self.weights.shape != self.joints.shape:
            raise FigureError(
                f"joints and weights must be ({count}, K), got {self.joints.shape} and {self.weights.shape}"
            )
        if len(self.triangles) and not (self.triangles.min() >= 0 and self.triangles.max() < count):
            raise FigureError(f"a triangle has a vertex that does not exist; there are {count}")
        if self.joints.size and not (self.joints.min() >= 0 and self.joints.max() < joints):
            raise FigureError(f"a vertex hangs on a joint that does not exist; there are {joints}")
        if not all(np.all(np.isfinite(a)) for a in (self.vertices, self.weights, self.bind_positions)):
            raise FigureError("vertices, weights and the bind pose must be finite")
        if np.any(self.weights < 0) or not np.allclose(self.weights.sum(axis=1), 1.0, atol=1e-3):
            raise FigureError("the weights of each vertex must not be negative and must sum to one")
        set_(self, "parts", dict(self.parts))
        for name, part in self.parts.items():
            if part.step not in (None, 1) or not 0 <= part.start <= part.stop <= len(self.triangles):
                raise FigureError(
                    f"part {name!r} is a range of the {len(self.triangles)} triangles, got {part}"
                )

    def place(self, positions: Array, world: Array) -> Array:
        """Vertices (..., V, 3) [m] of joints in the world: places (..., J, 3) [m], rotations (..., J, 4)."""
        turn = rot.mul(world, rot.inv(self.bind_rotations))
        shift = positions - rot.mul_vec(turn, self.bind_positions)
        placed = np.zeros((*positions.shape[:-2], *self.vertices.shape))
        for k in range(self.joints.shape[1]):
            used = np.flatnonzero(self.weights[:, k] > 0)
            carrier = self.joints[used, k]
            moved = rot.mul_vec(turn[..., carrier, :], self.vertices[used]) + shift[..., carrier, :]
            placed[..., used, :] += self.weights[used, k, None] * moved
        return placed
