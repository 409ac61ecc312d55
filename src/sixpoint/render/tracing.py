"""Rays against triangles: Embree on the CPU, no display needed.

Reference: Wald et al. 2014, "Embree: A kernel framework for efficient CPU ray tracing", ACM TOG 33(4).
"""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.errors import SixpointError

Floats = NDArray[np.float32]
Index = NDArray[np.int64]

FAR = 1e4
"""As far as rays go [m]."""


def check_libraries() -> None:
    """Refuse to render where the libraries are not installed.

    Raises:
        SixpointError: Naming them and the extra that brings them.
    """
    missing = [name for name in ("embreex", "av", "PIL") if importlib.util.find_spec(name) is None]
    if missing:
        names = ", ".join({"PIL": "pillow", "av": "av (PyAV)"}.get(name, name) for name in missing)
        raise SixpointError(f'pictures need {names}, not installed here: pip install "sixpoint[render]"')


@dataclass(frozen=True, eq=False)
class Hits:
    """What rays meet first; only of those that meet something.

    Attributes:
        rays: (n,) which rays.
        triangles: (n,) what they meet.
        shares: (n, 3) barycentric weights of the triangle's corners.
        distances: (n,) along the ray [m].
    """

    rays: Index
    triangles: Index
    shares: Floats
    distances: Floats


class Tracer:
    """Triangles that rays can meet."""

    def __init__(self, vertices: Floats, triangles: Index) -> None:
        """From vertices (V, 3) [m] and triangles (T, 3)."""
        check_libraries()
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene: Any = EmbreeScene()
        # The mesh must live as long as the scene.
        self._mesh = TriangleMesh(
            self._scene, np.ascontiguousarray(vertices, np.float32), triangles.astype(np.int32)
        )

    def find_nearest(self, origins: Floats, directions: Floats) -> Hits:
        """First meetings of rays from (n, 3) [m] along unit directions (n, 3)."""
        found = self._scene.run(origins, directions, output=1)
        rays = np.flatnonzero(found["primID"] >= 0)
        u, v = found["u"][rays], found["v"][rays]
        shares = np.stack([1.0 - u - v, u, v], axis=-1)
        return Hits(rays, found["primID"][rays].astype(np.int64), shares, found["tfar"][rays])

    def find_blocked(self, origins: Floats, directions: Floats, reach: float = FAR) -> NDArray[np.bool_]:
        """(n,) whether anything is within ``reach`` [m] of the origins (n, 3) along the directions (n, 3)."""
        if not len(origins):
            return np.zeros(0, bool)
        far = np.full(len(origins), reach, np.float32)
        return np.asarray(self._scene.run(origins, directions, far, query="OCCLUDED") >= 0)
