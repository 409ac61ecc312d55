"""Light from everywhere: how much of sky and floor each vertex of a body sees past the body itself.

It is found at the vertices and interpolated, which is smooth and costs a tenth of finding it at every pixel.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.render.light import shine, spread_over_sphere
from sixpoint.render.tracing import Tracer

Floats = NDArray[np.float32]
Index = NDArray[np.int64]

RAYS = 72  # over the sphere; half of them face a vertex
REACH = 1.2  # how far a body shades itself [m]
LIFT = 0.003  # rays start this far off the surface [m]
RETURN = 0.2  # of the light that the body is in the way of, it sends back itself
BURIED = 0.03  # who sees less than this lies within another part, and is lit as its neighbours are
ROUNDS = 6  # over which neighbours' light spreads to the buried


def find_sky_light(tracer: Tracer, vertices: Floats, normals: Floats, triangles: Index) -> Floats:
    """Light (V, 3) of sky and floor at vertices (V, 3) with normals (V, 3)."""
    starts = np.ascontiguousarray(vertices + np.float32(LIFT) * normals)
    light, total = np.zeros_like(starts), np.zeros(len(starts), np.float32)
    clear = np.zeros(len(starts), np.float32)
    for ray in spread_over_sphere(RAYS):
        lean = normals @ ray
        facing = np.flatnonzero(lean > 0.02)
        free = ~tracer.find_blocked(starts[facing], np.tile(ray, (len(facing), 1)), REACH)
        lean = lean[facing]
        total[facing] += lean
        clear[facing] += lean * free
        light[facing] += (lean * np.where(free, np.float32(1.0), np.float32(RETURN)))[:, None] * shine(ray)
    total = np.maximum(total, np.float32(1e-6))
    light /= total[:, None]
    return _fill(light, clear > BURIED * total, triangles)


def _fill(light: Floats, known: NDArray[np.bool_], triangles: Index) -> Floats:
    """Light (V, 3) where that of the vertices not ``known`` (V,) is the mean of their known neighbours'."""
    one = np.concatenate([triangles[:, k] for k in (0, 1, 2, 1, 2, 0)])
    other = np.concatenate([triangles[:, k] for k in (1, 2, 0, 0, 1, 2)])
    for _ in range(ROUNDS):
        wanted = ~known[one] & known[other]
        if not wanted.any():
            break
        to, source = one[wanted], other[wanted]
        count = np.bincount(to, minlength=len(light))
        new = np.flatnonzero(count)
        for k in range(3):
            light[new, k] = np.bincount(to, light[source, k], len(light))[new] / count[new]
        known = known | (count > 0)
    return light
