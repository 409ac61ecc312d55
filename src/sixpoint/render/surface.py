"""A coloured surface that is placed anew in each frame, and what smooth shading needs of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.surface.appearance import Texturing
from sixpoint.body.surface.shape import Shape
from sixpoint.render.painting import Painting

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
Index = NDArray[np.int64]

OPAQUE = 0.5
"""Triangles whose corners are all more transparent than this are left out."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A shape with colours.

    Attributes:
        shape: The skinned mesh.
        colours: (V, 4) linear RGB and opacity, each 0..1.
        texturing: What is between the vertices, if anything.
    """

    shape: Shape
    colours: Array
    texturing: Texturing | None = None

    @cached_property
    def _shown(self) -> Index:
        """(T,) which triangles are seen."""
        return np.flatnonzero((self.colours[:, 3] >= OPAQUE)[self.shape.triangles].any(axis=1))

    @cached_property
    def triangles(self) -> Index:
        """(T, 3) those that are seen."""
        return np.asarray(self.shape.triangles[self._shown])

    @cached_property
    def painting(self) -> Painting | None:
        """The textures of the triangles that are seen."""
        return None if self.texturing is None else Painting(self.texturing, self.shape, self._shown)

    @cached_property
    def _welded(self) -> Index:
        """(V,) number of each vertex's place: meshes with textures have several vertices at one."""
        rounded = np.round(self.shape.vertices, 6)
        return np.asarray(np.unique(rounded, axis=0, return_inverse=True)[1].reshape(-1))

    def place(self, positions: Array, world: Array) -> tuple[Floats, Floats]:
        """Vertices (V, 3) [m] and unit normals (V, 3) of joints at (J, 3) [m] turned by (J, 4)."""
        vertices = self.shape.place(positions, world)
        a, b, c = (vertices[self.triangles[:, k]] for k in range(3))
        faces = np.cross(b - a, c - a)  # twice the area long: large triangles count more
        corners = self._welded[self.triangles].ravel()
        count = int(self._welded.max(initial=-1)) + 1
        sums = np.stack([np.bincount(corners, np.repeat(faces[:, k], 3), count) for k in range(3)], axis=-1)
        length = np.linalg.norm(sums, axis=1, keepdims=True)
        normals = np.where(length > 1e-15, sums / np.maximum(length, 1e-15), [0.0, 1.0, 0.0])
        return vertices.astype(np.float32), normals[self._welded].astype(np.float32)
