"""Colours between vertices: what a textured surface shows where a ray meets it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.surface.appearance import Texturing
from sixpoint.body.surface.shape import Shape

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
Index = NDArray[np.int64]


class Painting:
    """The textures of a surface, each as fine as a picture shows.

    Args:
        texturing: Which texture is where.
        shape: What is textured.
        shown: (t,) which of its triangles are drawn.

    Reference: Williams 1983, "Pyramidal parametrics", SIGGRAPH 17(3), for the smaller copies of an image.
    """

    def __init__(self, texturing: Texturing, shape: Shape, shown: Index) -> None:
        self._texturing = texturing
        self._chosen = texturing.chosen[shown]
        corners = shape.triangles[shown]
        a, b, c = (shape.vertices[corners[:, k]] for k in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        u, v, w = (texturing.places[corners[:, k]] for k in range(3))
        covered = np.abs((v - u)[:, 0] * (w - u)[:, 1] - (v - u)[:, 1] * (w - u)[:, 0])
        sizes = np.array([texture.levels[0].shape[:2] for texture in texturing.textures])
        pixels = np.prod(sizes, axis=1)[self._chosen]
        self._density = np.sqrt(covered * pixels / np.maximum(area, 1e-12))

    def apply(self, colours: Floats, triangles: Index, corners: Index, shares: Floats, step: Array) -> None:
        """Replace the colours (n, 3) of points on textured triangles.

        Args:
            colours: Linear light.
            triangles: (n,) which of the drawn triangles a point is on.
            corners: (n, 3) its vertices.
            shares: (n, 3) their barycentric weights.
            step: (n,) how far points are from each other [m].
        """
        coarse = np.log2(np.maximum(self._density[triangles] * step, 1.0))
        level = np.floor(coarse + 0.5).astype(np.int64)
        chosen = self._chosen[triangles]
        for number, texture in enumerate(self._texturing.textures):
            for one in np.unique(level[chosen == number]):
                some = np.flatnonzero((chosen == number) & (level == one))
                where, share = corners[some], shares[some].astype(float)
                places = np.einsum("nkc,nk->nc", self._texturing.places[where], share)
                tints = np.einsum("nkc,nk->nc", self._texturing.tints[where, :3], share)
                colours[some] = tints * texture.sample(places, int(one))[:, :3]
