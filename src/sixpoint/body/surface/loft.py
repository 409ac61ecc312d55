"""Closed surfaces through cross-sections: what limbs and trunks of the built-in surface are made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

CAP_RINGS = 4
"""That round an end."""


@dataclass(frozen=True, eq=False)
class Loft:
    """A closed mesh around a line.

    Attributes:
        vertices: (V, 3) [m].
        triangles: (T, 3) counter-clockwise seen from outside.
        places: (V,) where along the line the vertex's ring is; beyond the ends in the caps.
    """

    vertices: Array
    triangles: Index
    places: Array


def sample(rows: Sequence[Sequence[float]], places: ArrayLike) -> Array:
    """Columns (n, c) of a table of sections at places (n,), by monotone cubics; constant beyond the ends."""
    from scipy.interpolate import PchipInterpolator  # slow to import, and only surfaces need it

    table = np.asarray(rows, float)
    at = np.clip(np.asarray(places, float), table[0, 0], table[-1, 0])
    return np.asarray(PchipInterpolator(table[:, 0], table[:, 1:], axis=0)(at))


def loft(
    centres: Array,
    across: Array,
    ahead: Array,
    radii: Array,
    places: Array,
    *,
    sectors: int,
    exponents: ArrayLike = 2.0,
    caps: tuple[float, float],
    cap_rings: int = CAP_RINGS,
) -> Loft:
    """A surface through superelliptic rings with rounded ends.

    Args:
        centres: (R, 3) middles of the rings [m].
        across: (R, 3) unit directions of the first radius; (3,) for all.
        ahead: (R, 3) unit directions of the third radius; (3,) for all.
        radii: (R, 4) along ``across``, against it, along ``ahead``, against it [m].
        places: (R,) coordinates of the rings, increasing.
        sectors: Vertices of a ring; a multiple of four has a vertex on each radius.
        exponents: (R,) or one; 2 is an ellipse, more is boxier.
        caps: How far the ends bulge beyond the first and the last ring [m].
        cap_rings: That round each end.
    """
    across, ahead = np.broadcast_to(across, centres.shape), np.broadcast_to(ahead, centres.shape)
    exponents = np.broadcast_to(np.asarray(exponents, float), places.shape)
    angles = 2.0 * np.pi * np.arange(sectors) / sectors
    cosine, sine = np.round(np.cos(angles), 15), np.round(np.sin(angles), 15)
    power = 2.0 / exponents[:, None]
    x = np.sign(cosine) * np.abs(cosine) ** power * np.where(cosine > 0, radii[:, :1], radii[:, 1:2])
    z = np.sign(sine) * np.abs(sine) ** power * np.where(sine > 0, radii[:, 2:3], radii[:, 3:4])
    rings = centres[:, None] + x[..., None] * across[:, None] + z[..., None] * ahead[:, None]
    below = _cap(rings, centres, places, 0, 1, caps[0], cap_rings)
    above = _cap(rings, centres, places, -1, -2, caps[1], cap_rings)
    stack = np.concatenate([below[0], rings, above[0][::-1]])
    along = np.concatenate([below[1], places, above[1][::-1]])
    vertices = np.concatenate([stack.reshape(-1, 3), [below[2], above[2]]])
    coordinates = np.concatenate([np.repeat(along, sectors), [below[3], above[3]]])
    triangles = _join(len(stack), sectors)
    if _signed_volume(vertices, triangles) < 0.0:
        triangles = triangles[:, ::-1]
    return Loft(vertices, triangles, coordinates)


def _cap(
    rings: Array, centres: Array, places: Array, end: int, inner: int, bulge: float, count: int
) -> tuple[Array, Array, Array, float]:
    """Rings (count, S, 3) and places from the pole to the end ring, the pole and its place."""
    outward = centres[end] - centres[inner]
    length = float(np.linalg.norm(outward))
    outward = outward / length
    step = (places[end] - places[inner]) / length  # places per metre
    angles = np.pi / 2 * np.arange(count, 0, -1) / (count + 1)
    rise = bulge * np.sin(angles)
    shrunk = centres[end] + np.cos(angles)[:, None, None] * (rings[end] - centres[end])
    capped = shrunk + rise[:, None, None] * outward
    return capped, places[end] + step * rise, centres[end] + bulge * outward, places[end] + step * bulge


def _join(rings: int, sectors: int) -> Index:
    """Triangles of consecutive rings, and fans at the two poles, which come after all rings."""
    k = np.arange(sectors)
    after = (k + 1) % sectors
    first, last = rings * sectors, rings * sectors + 1
    faces = [np.column_stack([np.full(sectors, first), after, k])]
    for low in range(0, (rings - 1) * sectors, sectors):
        high = low + sectors
        faces.append(np.column_stack([low + k, low + after, high + after]))
        faces.append(np.column_stack([low + k, high + after, high + k]))
    top = (rings - 1) * sectors
    faces.append(np.column_stack([np.full(sectors, last), top + k, top + after]))
    return np.concatenate(faces)


def _signed_volume(vertices: Array, triangles: Index) -> float:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)
