"""Signed distance of a point to simple shapes, in the shape's own frame, with the outward normal.

A shape is a kind and three numbers: sphere (radius), capsule along Y (radius, half length of its axis), box
(half extents), half-space below its plane y = 0.
"""

from math import sqrt

from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper

SPHERE, CAPSULE, BOX, HALF_SPACE = range(4)


@helper
def _from_centre(v, radius):
    """Distance to a ball around the origin; up at its very centre, where every way out is as good."""
    length = vec.norm(v)
    if length < 1e-9:
        return (-radius, 0.0, 1.0, 0.0)
    return (length - radius, v[0] / length, v[1] / length, v[2] / length)


@helper
def _box(p, half):
    outside = (
        max(abs(p[0]) - half[0], 0.0),
        max(abs(p[1]) - half[1], 0.0),
        max(abs(p[2]) - half[2], 0.0),
    )
    distance = vec.norm(outside)
    if distance > 1e-12:
        k = 1.0 / distance
        return (
            distance,
            k * outside[0] * (1.0 if p[0] >= 0.0 else -1.0),
            k * outside[1] * (1.0 if p[1] >= 0.0 else -1.0),
            k * outside[2] * (1.0 if p[2] >= 0.0 else -1.0),
        )
    depth = (half[0] - abs(p[0]), half[1] - abs(p[1]), half[2] - abs(p[2]))
    if depth[0] <= depth[1] and depth[0] <= depth[2]:
        return (-depth[0], 1.0 if p[0] >= 0.0 else -1.0, 0.0, 0.0)
    if depth[1] <= depth[2]:
        return (-depth[1], 0.0, 1.0 if p[1] >= 0.0 else -1.0, 0.0)
    return (-depth[2], 0.0, 0.0, 1.0 if p[2] >= 0.0 else -1.0)


@helper
def signed_distance(kind, size, p):
    """(distance, nx, ny, nz): negative inside; the normal points the shortest way out."""
    if kind == SPHERE:
        return _from_centre(p, size[0])
    if kind == CAPSULE:
        along = min(max(p[1], -size[1]), size[1])
        return _from_centre((p[0], p[1] - along, p[2]), size[0])
    if kind == BOX:
        return _box(p, size)
    return (p[1], 0.0, 1.0, 0.0)


@helper
def nearest_on_segment(p, a, b):
    """Point of the segment a-b in the plane nearest to p, all (x, z) pairs."""
    ux, uz = b[0] - a[0], b[1] - a[1]
    square = ux * ux + uz * uz
    if square < 1e-18:
        return a
    t = min(max(((p[0] - a[0]) * ux + (p[1] - a[1]) * uz) / square, 0.0), 1.0)
    return (a[0] + t * ux, a[1] + t * uz)


@helper
def planar_norm(v):
    return sqrt(v[0] * v[0] + v[1] * v[1])
