"""Signed distance of a point to simple shapes, in the shape's own frame, with the outward normal.

A shape is a kind and three numbers: sphere (radius), capsule along Y (radius, half length of its axis), box
(half extents), half-space below its plane y = 0. A mesh is a grid of distances, as rows of four numbers: its
first corner and spacing; the counts of corners in x, y, z; then the distances at the corners, z fastest.
"""

from math import sqrt

from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper

SPHERE, CAPSULE, BOX, HALF_SPACE, GRID = range(5)


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
def _corner(grid, first, ny, nz, i, j, k):
    n = (i * ny + j) * nz + k
    return grid[first + 2 + n // 4, n % 4]


@helper
def grid_distance(grid, first, p):
    """As ``signed_distance``, interpolated on the grid that begins in a row; the normal is the gradient.

    Beside the grid, the distance at its border and that to it.
    """
    h = grid[first, 3]
    nx, ny, nz = int(grid[first + 1, 0]), int(grid[first + 1, 1]), int(grid[first + 1, 2])
    x, y, z = (p[0] - grid[first, 0]) / h, (p[1] - grid[first, 1]) / h, (p[2] - grid[first, 2]) / h
    cx, cy, cz = min(max(x, 0.0), nx - 1.0), min(max(y, 0.0), ny - 1.0), min(max(z, 0.0), nz - 1.0)
    i, j, k = min(int(cx), nx - 2), min(int(cy), ny - 2), min(int(cz), nz - 2)
    u, v, w = cx - i, cy - j, cz - k
    a, b = _corner(grid, first, ny, nz, i, j, k), _corner(grid, first, ny, nz, i, j, k + 1)
    c, d = _corner(grid, first, ny, nz, i, j + 1, k), _corner(grid, first, ny, nz, i, j + 1, k + 1)
    e, f = _corner(grid, first, ny, nz, i + 1, j, k), _corner(grid, first, ny, nz, i + 1, j, k + 1)
    g, o = _corner(grid, first, ny, nz, i + 1, j + 1, k), _corner(grid, first, ny, nz, i + 1, j + 1, k + 1)
    low0, low1 = a + w * (b - a), c + w * (d - c)
    top0, top1 = e + w * (f - e), g + w * (o - g)
    low, top = low0 + v * (low1 - low0), top0 + v * (top1 - top0)
    distance = low + u * (top - low)
    gx = (top - low) / h
    gy = ((1.0 - u) * (low1 - low0) + u * (top1 - top0)) / h
    gz = (1.0 - u) * ((1.0 - v) * (b - a) + v * (d - c)) + u * ((1.0 - v) * (f - e) + v * (o - g))
    gz /= h
    beside = (h * (x - cx), h * (y - cy), h * (z - cz))
    off = vec.norm(beside)
    if off > 0.0:
        gx = beside[0] / off if beside[0] != 0.0 else gx
        gy = beside[1] / off if beside[1] != 0.0 else gy
        gz = beside[2] / off if beside[2] != 0.0 else gz
        return (distance + off, gx, gy, gz)
    if gx * gx + gy * gy + gz * gz < 1e-6:
        return (distance, 0.0, 1.0, 0.0)
    return (distance, gx, gy, gz)


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
