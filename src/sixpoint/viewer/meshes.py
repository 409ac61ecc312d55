"""Shapes that are sent once; each frame places copies of them: balls, and tapered tubes between balls."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.mannequin import Mannequin

Array = NDArray[np.float64]
Mesh = tuple[Array, NDArray[np.int64]]

TAPER = 0.72
"""Radius of a limb's thin end over that of its thick one; trunk bones have 1."""
SECTORS, RINGS = 20, 12
THIN = 1e-6


def make_sphere() -> Mesh:
    """Unit ball as vertices (V, 3) and triangles (T, 3)."""
    down = np.linspace(0, np.pi, RINGS + 1)
    ring = _circle()
    rows = [
        np.column_stack([np.sin(a) * ring[:, 0], np.full(SECTORS, np.cos(a)), np.sin(a) * ring[:, 1]])
        for a in down
    ]
    return np.concatenate(rows), _join_rings(RINGS + 1)


def make_tube(taper: float) -> Mesh:
    """An open tube from 0 to 1 along Y, of radius 1 at its foot and ``taper`` at its top."""
    ring = _circle()
    foot = np.column_stack([ring[:, 0], np.zeros(SECTORS), ring[:, 1]])
    top = np.column_stack([taper * ring[:, 0], np.ones(SECTORS), taper * ring[:, 1]])
    return np.concatenate([top, foot]), _join_rings(2)


def _circle() -> Array:
    around = np.linspace(0, 2 * np.pi, SECTORS, endpoint=False)
    return np.stack([np.cos(around), np.sin(around)], axis=-1)


def _join_rings(rings: int) -> NDArray[np.int64]:
    """Triangles between consecutive rings of vertices, seen from outside when the first ring is on top."""
    k = np.arange(SECTORS)
    after = (k + 1) % SECTORS
    faces = []
    for low in range(0, (rings - 1) * SECTORS, SECTORS):
        high = low + SECTORS
        faces += [
            np.column_stack([low + k, low + after, high + k]),
            np.column_stack([low + after, high + after, high + k]),
        ]
    return np.concatenate(faces)


@dataclass(frozen=True, eq=False)
class Tubes:
    """Tubes between balls of a mannequin, all of one taper.

    Attributes:
        first: (T,) the thick ends.
        last: (T,) the thin ends.
        part: (T,) the part each belongs to.
        taper: Radius of the thin end over the thick one.
    """

    first: NDArray[np.int64]
    last: NDArray[np.int64]
    part: NDArray[np.int64]
    taper: float

    def place(self, centres: Array, radii: Array) -> tuple[Array, Array, Array]:
        """Positions (T, 3), rotations (T, 4) and scales (T, 3) of the copies, between balls at (B, 3)."""
        along = centres[self.last] - centres[self.first]
        length = np.linalg.norm(along, axis=-1)
        flat = length < THIN
        direction = np.where(flat[:, None], [0.0, 1.0, 0.0], along / np.where(flat, 1.0, length)[:, None])
        turned = rot.between(np.broadcast_to([0.0, 1.0, 0.0], direction.shape), direction)
        radius = radii[self.first]
        return centres[self.first], turned, np.column_stack([radius, np.maximum(length, THIN), radius])


def find_tubes(body: Mannequin) -> list[Tubes]:
    """All tubes of a mannequin by taper: one between every two balls of a part."""
    found: dict[float, list[tuple[int, int, int]]] = {}
    for number, part in enumerate(body.parts):
        for pair in combinations(range(part.balls.start, part.balls.stop), 2):
            thick, thin = sorted(pair, key=lambda ball: -body.radii[ball])
            taper = TAPER if body.radii[thin] < 0.9 * body.radii[thick] else 1.0
            found.setdefault(taper, []).append((thick, thin, number))
    tubes = {taper: np.array(rows).T for taper, rows in sorted(found.items())}
    return [Tubes(thick, thin, number, taper) for taper, (thick, thin, number) in tubes.items()]
