"""Signed distance to a closed triangle mesh on a regular grid: negative inside.

Distances are to the nearest point of the nearest triangles; inside is where the winding number of the mesh is
above one half.

Reference: van Oosterom & Strackee 1983 (solid angle of a triangle); Ericson 2005, section 5.1.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import label
from scipy.spatial import cKDTree

from sixpoint.errors import SixpointError

Array = NDArray[np.float64]
Index = NDArray[np.int64]

CELLS = 32  # along the longest side, by default
MOST_CELLS = 160
PAD = 3  # cells around the mesh
CANDIDATES = 12  # triangles looked at for each point
CHUNK = 2_000_000


@dataclass(frozen=True, eq=False)
class DistanceGrid:
    """Signed distances at the corners of cubes.

    Attributes:
        origin: (3,) the first corner [m].
        spacing: Side of a cube [m].
        values: (X, Y, Z) signed distances [m].
    """

    origin: Array
    spacing: float
    values: Array


def check_closed(vertices: ArrayLike, triangles: ArrayLike) -> tuple[Array, Index]:
    """Vertices (V, 3) and triangles (T, 3) of a closed mesh; vertices at one place are one.

    Raises:
        SixpointError: They are no mesh, or it has a border.
    """
    points, faces = np.asarray(vertices, float), np.asarray(triangles)
    if points.ndim != 2 or points.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
        raise SixpointError(
            f"a mesh is vertices (V, 3) [m] and triangles (T, 3), got {points.shape} and {faces.shape}"
        )
    if not np.issubdtype(faces.dtype, np.integer) or faces.min() < 0 or faces.max() >= len(points):
        raise SixpointError(f"the triangles of a mesh are numbers of its {len(points)} vertices, from 0")
    if not np.isfinite(points).all():
        raise SixpointError("the vertices of a mesh must be finite numbers [m]")
    size = float(np.ptp(points, axis=0).max())
    _, first, same = np.unique(
        np.round(points / max(1e-7 * size, 1e-12)), axis=0, return_index=True, return_inverse=True
    )
    welded = same.reshape(-1)[faces]
    welded = welded[(welded != np.roll(welded, 1, axis=1)).all(axis=1)]
    edges = np.concatenate([welded[:, [0, 1]], welded[:, [1, 2]], welded[:, [2, 0]]])
    there, back = (np.unique(e, axis=0, return_counts=True) for e in (edges, edges[:, ::-1]))
    if not (np.array_equal(there[0], back[0]) and np.array_equal(there[1], back[1])):
        lonely = len({*map(tuple, there[0].tolist())} ^ {*map(tuple, back[0].tolist())}) or 1
        raise SixpointError(
            f"the mesh is not closed: {lonely} edges border one triangle, or its triangles face both ways"
        )
    return points[first], welded.astype(np.int64)


def build_grid(vertices: ArrayLike, triangles: ArrayLike, spacing: float | None = None) -> DistanceGrid:
    """Signed distances around a closed mesh.

    Args:
        vertices: (V, 3) [m].
        triangles: (T, 3), counter-clockwise seen from outside.
        spacing: Side of a cube [m]; by default a 32nd of the longest side.

    Raises:
        SixpointError: The mesh is not closed, or the spacing is no length that makes sense for it.
    """
    points, faces = check_closed(vertices, triangles)
    low, high = points.min(axis=0), points.max(axis=0)
    longest = float((high - low).max())
    step = longest / CELLS if spacing is None else float(spacing)
    if not (np.isfinite(step) and longest / MOST_CELLS <= step):
        raise SixpointError(f"the spacing of a mesh of {longest:g} m is from {longest / MOST_CELLS:.2g} m")
    counts = np.ceil((high - low) / step).astype(int) + 1 + 2 * PAD
    origin = 0.5 * (low + high) - 0.5 * (counts - 1) * step
    axes = [origin[k] + step * np.arange(counts[k]) for k in range(3)]
    corners = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    distance, side = find_distance(points, faces, corners, step)
    distance = distance.reshape(counts)
    inside = _find_inside(points, faces, corners, side, distance, step)
    return DistanceGrid(origin, step, np.where(inside, -distance, distance))


def find_distance(vertices: Array, triangles: Index, points: Array, step: float) -> tuple[Array, Array]:
    """How far points (N, 3) are from a mesh, and on which side of it.

    Args:
        vertices: (V, 3) [m].
        triangles: (T, 3).
        points: (N, 3) [m].
        step: How densely triangles are sampled to find the nearest ones [m].

    Returns:
        Distance (N,) [m], and (N,) 1 outside, -1 inside, 0 where the nearest point is on no triangle's inner.
    """
    corners = vertices[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    counts = np.clip(np.ceil(longest / step), 1, 64).astype(int)
    samples, owners = [], []
    for n in np.unique(counts):
        i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
        u, v = i[i + j <= n] / n, j[i + j <= n] / n
        own = np.flatnonzero(counts == n)
        shares = np.column_stack([1.0 - u - v, u, v])
        samples.append(np.einsum("sk,tkc->tsc", shares, corners[own]).reshape(-1, 3))
        owners.append(np.repeat(own, len(u)))
    tree, owner = cKDTree(np.concatenate(samples)), np.concatenate(owners)
    count = min(CANDIDATES, len(owner))
    out, side = np.full(len(points), np.inf), np.zeros(len(points))
    near = owner[tree.query(points, k=count)[1].reshape(len(points), count)]
    for k in range(count):
        distance, at = _to_triangles(points, corners[near[:, k]])
        side = np.where(distance < out, at, side)
        out = np.minimum(out, distance)
    return out, side


def _to_triangles(p: Array, corners: Array) -> tuple[Array, Array]:
    """(N,) distance of each point to its own triangle (N, 3, 3), and the side if that is to its inner."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    out = np.minimum(_to_segments(p, a, b), np.minimum(_to_segments(p, b, c), _to_segments(p, c, a)))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    unit = normal / np.maximum(length, 1e-300)[:, None]
    height = np.einsum("nk,nk->n", p - a, unit)
    within = length > 1e-18
    for u, v in ((a, b), (b, c), (c, a)):
        within &= np.einsum("nk,nk->n", np.cross(v - u, p - u), unit) >= 0.0
    flat = within & (np.abs(height) < out * (1.0 - 1e-9))
    return np.where(flat, np.abs(height), out), np.where(flat, np.sign(height), 0.0)


def _to_segments(p: Array, a: Array, b: Array) -> Array:
    along = b - a
    square = np.maximum(np.einsum("nk,nk->n", along, along), 1e-300)
    t = np.clip(np.einsum("nk,nk->n", p - a, along) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(p - a - t[:, None] * along, axis=1))


def find_winding(vertices: Array, triangles: Index, points: Array) -> Array:
    """(N,) winding number of a mesh around points: 1 inside, 0 outside."""
    out = np.zeros(len(points))
    step = max(CHUNK // max(len(triangles), 1), 1)
    for first in range(0, len(points), step):
        p = points[first : first + step, None]
        a, b, c = (vertices[triangles[:, k]][None] - p for k in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
        volume = np.einsum("ptk,ptk->pt", a, np.cross(b, c))
        below = la * lb * lc
        for (u, v), w in (((a, b), lc), ((b, c), la), ((c, a), lb)):
            below += np.einsum("ptk,ptk->pt", u, v) * w
        out[first : first + step] = np.arctan2(volume, below).sum(axis=1) / (2.0 * np.pi)
    return out


def _find_inside(
    vertices: Array, triangles: Index, corners: Array, side: Array, distance: Array, step: float
) -> NDArray[np.bool_]:
    """(X, Y, Z) whether corners (N, 3) are inside: told by their side, else by the winding number.

    A region away from the surface is wholly on one side of it.
    """
    near = distance < 1.8 * step
    regions, count = label(~near)
    inside = (side < 0.0).ravel()
    asked = np.flatnonzero(near.ravel() & (side == 0.0))
    inside[asked] = find_winding(vertices, triangles, corners[asked]) > 0.5
    regions = regions.ravel()
    numbers, first = np.unique(regions, return_index=True)
    told = np.zeros(count + 1, bool)
    told[numbers] = find_winding(vertices, triangles, corners[first]) > 0.5
    inside[regions > 0] = told[regions[regions > 0]]
    return inside.reshape(distance.shape)
