"""One picture: bodies in a scene, seen by a camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.render.camera import FIELD, Camera
from sixpoint.render.floor import Ground
from sixpoint.render.light import KEY, find_key, spread_over_disc, to_srgb
from sixpoint.render.painting import Painting
from sixpoint.render.sky import find_sky_light
from sixpoint.render.tracing import Hits, Tracer

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
Index = NDArray[np.int64]

SAMPLES = np.array([[0.375, 0.125], [0.875, 0.375], [0.625, 0.875], [0.125, 0.625]])
"""Within a pixel: a rotated grid, which smooths edges near the horizontal and the vertical best."""
PATTERNS = 4 * len(SAMPLES)
"""Of directions to the key light: one for each sample of two by two pixels, so that shadows have no steps;
what then repeats every second pixel, ``_blur`` takes out."""
KEY_RAYS = 2  # per sample
LIFT = 0.0015  # rays start this far off the surface [m]
GLOSS, SHARPNESS = 0.05, 28.0
GHOST = 0.55
"""Opacity of a ghost."""


@dataclass(frozen=True, eq=False)
class Body:
    """A surface in place.

    Attributes:
        vertices: (V, 3) [m].
        normals: (V, 3) unit.
        triangles: (T, 3).
        colours: (V, 3) linear.
        ghost: Drawn translucent, behind the others, and without a shadow.
        painting: Colours between the vertices, if there are textures.
    """

    vertices: Floats
    normals: Floats
    triangles: Index
    colours: Floats
    ghost: bool = False
    painting: Painting | None = None


def take_picture(bodies: list[Body], camera: Camera, ground: Ground) -> NDArray[np.uint8]:
    """Render bodies on a floor.

    Args:
        bodies: What is seen.
        camera: From where.
        ground: The floor as this camera sees it.

    Returns:
        (height, width, 3) sRGB.
    """
    key = find_key(camera.axes[0], camera.axes[2])
    layers = [_Shading(body, camera, key) for body in sorted(bodies, key=lambda body: not body.ghost)]
    picture = ground.picture
    for layer in layers:
        if not layer.body.ghost:
            picture = ground.shade(picture, layer.tracer, layer.body.vertices, key)
    for layer in layers:
        light, cover = layer.run()
        opacity = GHOST if layer.body.ghost else 1.0
        picture = picture * (1.0 - opacity * cover[..., None]) + opacity * light
    return to_srgb(picture)


class _Shading:
    """Light and cover of one body in the pixels where it may be."""

    def __init__(self, body: Body, camera: Camera, key: Array) -> None:
        self.body, self.camera, self.key = body, camera, key
        self.tracer = Tracer(body.vertices, body.triangles)
        self.sky = find_sky_light(self.tracer, body.vertices, body.normals, body.triangles)
        self.eye = camera.eye.astype(np.float32)
        self.step = 2.0 * np.tan(FIELD / 2) / camera.size[1] / np.sqrt(len(SAMPLES))  # per metre away

    def run(self) -> tuple[Floats, Floats]:
        """Light (height, width, 3), already times the cover, and the cover (height, width)."""
        width, tall = self.camera.size
        light, cover = np.zeros((tall, width, 3), np.float32), np.zeros((tall, width), np.float32)
        seen = self.camera.project(self.body.vertices)
        x0, y0 = np.clip(np.floor(seen.min(axis=0)).astype(int) - 1, 0, [width, tall])
        x1, y1 = np.clip(np.ceil(seen.max(axis=0)).astype(int) + 1, 0, [width, tall])
        if x0 >= x1 or y0 >= y1:
            return light, cover
        part = np.s_[y0:y1, x0:x1]
        columns, rows = (grid.ravel() for grid in np.meshgrid(np.arange(x0, x1), np.arange(y0, y1)))
        key = np.zeros((y1 - y0, x1 - x0, 3), np.float32)  # as if nothing were in its way
        clear, facing = np.zeros(key.shape[:2], np.float32), np.zeros(key.shape[:2], np.float32)
        for number, (dx, dy) in enumerate(SAMPLES):
            rays = self.camera.cast(columns + dx, rows + dy)
            origins = np.broadcast_to(self.eye, rays.shape).copy()
            hits = self.tracer.find_nearest(origins, rays)
            y, x = rows[hits.rays], columns[hits.rays]
            pattern = number + len(SAMPLES) * (x % 2 + 2 * (y % 2))
            around, straight, lit, share = self._shade(hits, rays[hits.rays], pattern)
            light[y, x] += around
            cover[y, x] += 1.0
            key[y - y0, x - x0] += straight
            facing[y - y0, x - x0] += lit
            clear[y - y0, x - x0] += share
        light[part] += key * (_blur(clear) / np.maximum(_blur(facing), 1e-6))[..., None]
        light /= len(SAMPLES)
        cover /= len(SAMPLES)
        return light, cover

    def _shade(self, hits: Hits, rays: Floats, patterns: Index) -> tuple[Floats, Floats, Floats, Floats]:
        """What hits send back along their rays; ``patterns`` (n,) of directions to the key light.

        Returns:
            Light (n, 3) of the sky and (n, 3) of the key light, were nothing in its way; 1 (n,) where the
            surface faces the key light; the share (n,) of its disc that is seen from there.
        """
        body = self.body
        corners = body.triangles[hits.triangles]
        points = self.eye + hits.distances[:, None] * rays
        normals = np.einsum("nkc,nk->nc", body.normals[corners], hits.shares)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
        a, b, c = (body.vertices[corners[:, k]] for k in range(3))
        flat = np.cross(b - a, c - a)
        behind = np.einsum("nc,nc->n", flat, rays) > 0.0  # the inside of an open mesh
        normals[behind] *= -1.0
        flat[behind] *= -1.0
        flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12)
        colours = np.einsum("nkc,nk->nc", body.colours[corners], hits.shares)
        if body.painting is not None:
            step = hits.distances * self.step
            body.painting.apply(colours, hits.triangles, corners, hits.shares, step)
        starts = _smooth_starts(points, normals, flat, body, corners, hits.shares, behind)
        around = colours * np.einsum("nkc,nk->nc", self.sky[corners], hits.shares)
        lean = (normals @ self.key.astype(np.float32)).clip(0.0)
        half = self.key.astype(np.float32) - rays
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        gloss = GLOSS * np.einsum("nc,nc->n", half, normals).clip(0.0) ** SHARPNESS * (lean > 0.0)
        straight = colours * lean[:, None] * KEY.astype(np.float32) + gloss[:, None]
        facing = (lean > 0.0).astype(np.float32)
        return around, straight, facing, self._clear(starts, lean > 0.0, patterns)

    def _clear(self, starts: Floats, facing: NDArray[np.bool_], patterns: Index) -> Floats:
        """Share (n,) of the key light's disc that is seen; none where the surface does not face it."""
        share = np.zeros(len(starts), np.float32)
        disc = spread_over_disc(self.key, KEY_RAYS * PATTERNS, 0.5)
        for pattern in np.unique(patterns):
            some = np.flatnonzero((patterns == pattern) & facing)
            for ray in disc[pattern::PATTERNS]:
                blocked = self.tracer.find_blocked(starts[some], np.tile(ray, (len(some), 1)))
                share[some[~blocked]] += 1.0 / KEY_RAYS
        return share


def _blur(values: Floats) -> Floats:
    """Mean over three by three pixels with weights 1 2 1 either way: what has a period of two is gone."""
    around = np.pad(values, 1)
    rows = around[:-2] + 2.0 * around[1:-1] + around[2:]
    return np.asarray((rows[:, :-2] + 2.0 * rows[:, 1:-1] + rows[:, 2:]) / 16.0)


def _smooth_starts(
    points: Floats,
    normals: Floats,
    flat: Floats,
    body: Body,
    corners: Index,
    shares: Floats,
    behind: NDArray[np.bool_],
) -> Floats:
    """Where light rays start: on the smooth surface that the normals mean, so that facets cast no shadows.

    Reference: Hanika 2021, "Hacking the shadow terminator", Ray Tracing Gems II, chapter 4.
    """
    lifted = np.zeros_like(points)
    for k in range(3):
        normal = np.where(behind[:, None], -1.0, 1.0).astype(np.float32) * body.normals[corners[:, k]]
        depth = np.einsum("nc,nc->n", points - body.vertices[corners[:, k]], normal)
        lifted += shares[:, k, None] * (points - np.minimum(depth, 0.0)[:, None] * normal)
    return np.ascontiguousarray(lifted + np.float32(LIFT) * flat)
