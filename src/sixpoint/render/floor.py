"""The floor of a picture: a fine grid that fades with the distance, and the body's shadow on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.render.camera import FIELD, Camera
from sixpoint.render.light import of_hex, spread_over_disc, spread_over_sphere
from sixpoint.render.tracing import Tracer

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

TOP, BOTTOM = of_hex("#fbfcfd"), of_hex("#e9edf1")
FLOOR, GRID, SECTION = of_hex("#f3f5f7"), of_hex("#dde3e9"), of_hex("#c3ccd4")
SHADOW = np.array([0.24, 0.26, 0.30])
"""What is left of the floor's light in the deepest shadow, per colour."""
STEP, LINE, THICK = 0.25, 0.004, 0.007  # of the grid, of its lines, of each fourth line [m]
FADE = (1.6, 4.2)  # from where to where the floor fades into the background [m]
FINE, COARSE, MOST_CELLS = 0.014, 0.04, 320  # cells of shadows [m], and the most along a side
KEY_SHARE = 0.55  # of the floor's light
KEY_RAYS, SKY_RAYS = 16, 120


def paint_background(size: tuple[int, int]) -> Floats:
    """A gradient (height, width, 3) in linear light."""
    down = np.linspace(0.0, 1.0, size[1])[:, None, None]
    rows = TOP + (BOTTOM - TOP) * down**1.5
    return np.asarray(np.broadcast_to(rows, (size[1], size[0], 3)), np.float32)


@dataclass(frozen=True, eq=False)
class Ground:
    """The floor as a camera sees it, without shadow.

    Attributes:
        picture: (height, width, 3) linear light.
        pixels: (n,) indices of the pixels that show the floor.
        points: (n, 2) x and z of the floor there [m].
        strength: (n,) how much of a shadow shows there: it fades as the floor does.
        height: Of the floor [m].
    """

    picture: Floats
    pixels: NDArray[np.int64]
    points: Floats
    strength: Floats
    height: float

    @classmethod
    def seen(cls, camera: Camera, height: float, middle: Array) -> Ground:
        """The floor around a point (3,)."""
        width, tall = camera.size
        picture = paint_background(camera.size).copy()
        columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(tall) + 0.5)
        rays = camera.cast(columns.ravel(), rows.ravel())
        fall = height - camera.eye[1]
        with np.errstate(divide="ignore"):
            way = fall / rays[:, 1]
        pixels = np.flatnonzero((way > 0.0) & (way < 60.0))
        way, rays = way[pixels, None], rays[pixels]
        points = (camera.eye[[0, 2]] + way * rays[:, [0, 2]]).astype(np.float32)
        away = np.linalg.norm(points - middle[[0, 2]].astype(np.float32), axis=1)
        near = np.clip((FADE[1] - away) / (FADE[1] - FADE[0]), 0.0, 1.0)
        strength = (near * near * (3.0 - 2.0 * near)).astype(np.float32)
        shown = strength > 0.0
        pixels, points, strength, way, rays = (a[shown] for a in (pixels, points, strength, way, rays))
        colour = _paint_grid(points, _footprint(camera, way, rays))
        flat = picture.reshape(-1, 3)
        flat[pixels] += strength[:, None] * (colour - flat[pixels])
        return cls(picture, pixels, points, strength, height)

    def shade(self, picture: Floats, tracer: Tracer, vertices: Floats, key: Array) -> Floats:
        """A picture of the floor (height, width, 3) with the shadow of vertices (V, 3) in a light."""
        picture = picture.copy()
        depth = self.strength * _Shadow(tracer, vertices, key, self.height).look_up(self.points)
        dark = np.flatnonzero(depth > 1e-4)
        flat = picture.reshape(-1, 3)
        flat[self.pixels[dark]] *= 1.0 - depth[dark, None] * (1.0 - SHADOW).astype(np.float32)
        return picture


def _footprint(camera: Camera, way: Array, rays: Floats) -> Array:
    """How far a pixel reaches on the floor along x and z (n, 2) [m], ``way`` (n, 1) from the eye."""
    across = way[:, 0] * (2.0 * np.tan(FIELD / 2) / camera.size[1])
    along = across / np.maximum(-rays[:, 1], 0.02)
    level = rays[:, [0, 2]] / np.maximum(np.linalg.norm(rays[:, [0, 2]], axis=1, keepdims=True), 1e-6)
    return np.asarray(np.hypot(across[:, None] * level[:, ::-1], along[:, None] * level))


def _paint_grid(points: Floats, footprint: Array) -> Floats:
    """Colours (n, 3) of the floor: lines as much as they cover of a pixel's footprint."""
    fine, bold = np.zeros(len(points)), np.zeros(len(points))
    for axis in (0, 1):
        wide = np.maximum(footprint[:, axis], 1e-6)
        for step, line, total in ((STEP, LINE, fine), (4.0 * STEP, THICK, bold)):
            off = np.abs((points[:, axis] + 0.5 * step) % step - 0.5 * step)
            covered = np.minimum(off + wide / 2, line / 2) - np.maximum(off - wide / 2, -line / 2)
            np.maximum(total, np.clip(covered / wide, 0.0, 1.0), out=total)
    colour = FLOOR + fine[:, None] * (GRID - FLOOR)
    return np.asarray(colour + bold[:, None] * (SECTION - colour), np.float32)


class _Shadow:
    """How dark the floor is around a body: a fine raster of the key light, and a coarse one of the sky."""

    def __init__(self, tracer: Tracer, vertices: Floats, key: Array, height: float) -> None:
        tall = np.maximum(vertices[:, 1] - height, 0.0)
        flat = vertices[:, [0, 2]]
        cast = flat - (tall / key[1])[:, None] * key[[0, 2]]
        low, high = (
            np.minimum(cast.min(axis=0), flat.min(axis=0)),
            np.maximum(cast.max(axis=0), flat.max(axis=0)),
        )
        rays = spread_over_disc(key, KEY_RAYS)
        self.key = _Raster(low - 0.1, high + 0.1, FINE)
        self.key.fill(tracer, height, rays, np.full(len(rays), KEY_SHARE / len(rays)))
        sky = spread_over_sphere(SKY_RAYS)
        sky = sky[sky[:, 1] > 0.03]
        self.sky = _Raster(flat.min(axis=0) - 0.8, flat.max(axis=0) + 0.8, COARSE)
        self.sky.fill(tracer, height, sky, (1.0 - KEY_SHARE) * sky[:, 1] / sky[:, 1].sum())

    def look_up(self, points: Floats) -> Floats:
        """Depth (n,) of the shadow at points (n, 2) of the floor, 0 to 1."""
        return self.key.look_up(points) + self.sky.look_up(points)


class _Raster:
    """What is hidden from the floor, between two corners (2,) and in cells of a size [m]."""

    def __init__(self, low: Array, high: Array, cell: float) -> None:
        self.low, self.cell = low, max(cell, float((high - low).max()) / MOST_CELLS)
        self.count = np.maximum(np.ceil((high - low) / self.cell).astype(int), 2)

    def fill(self, tracer: Tracer, height: float, rays: Floats, weights: Array) -> None:
        """Find what is hidden: the sum of the weights (n,) of blocked rays (n, 3)."""
        x, z = (self.low[k] + self.cell * (np.arange(self.count[k]) + 0.5) for k in (0, 1))
        grid = np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1).reshape(-1, 2)
        starts = np.column_stack([grid[:, 0], np.full(len(grid), height + 0.002), grid[:, 1]]).astype(
            np.float32
        )
        dark = np.zeros(len(starts))
        for ray, weight in zip(rays, weights, strict=True):
            dark += weight * tracer.find_blocked(starts, np.tile(ray, (len(starts), 1)))
        dark = _blurred(dark.reshape(self.count))
        rim = np.minimum(*np.meshgrid(*(_to_edge(n) for n in self.count), indexing="ij"))
        self.dark = (dark * rim).astype(np.float32)

    def look_up(self, points: Floats) -> Floats:
        """Bilinear values (n,) at points (n, 2); 0 outside."""
        at = ((points - self.low) / self.cell - 0.5).astype(np.float32)
        out = np.zeros(len(points), np.float32)
        inside = np.flatnonzero(np.all((at >= 0) & (at < self.count - 1), axis=1))
        at = at[inside]
        cell = at.astype(int)
        (u, v), (i, j), d = (at - cell).T, cell.T, self.dark
        near, far = (1 - v) * d[i, j] + v * d[i, j + 1], (1 - v) * d[i + 1, j] + v * d[i + 1, j + 1]
        out[inside] = (1 - u) * near + u * far
        return out


def _to_edge(count: int) -> Array:
    """0 at both ends of a raster's side, 1 from the sixth cell on: shadows end softly there."""
    k = np.arange(count)
    return np.clip(np.minimum(k, count - 1 - k) / 5.0, 0.0, 1.0)


def _blurred(raster: Array) -> Array:
    """A raster (a, b) smoothed by a binomial of five, edges kept."""
    for axis in (0, 1):
        padded = np.pad(raster, [(2, 2) if k == axis else (0, 0) for k in (0, 1)], mode="edge")
        size = raster.shape[axis]
        parts = [np.take(padded, np.arange(k, k + size), axis=axis) for k in range(5)]
        raster = (parts[0] + 4 * parts[1] + 6 * parts[2] + 4 * parts[3] + parts[4]) / 16
    return raster
