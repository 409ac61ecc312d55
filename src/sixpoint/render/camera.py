"""Where a picture is taken from: a pinhole that looks at a body and has all of it in view."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

FIELD = np.radians(26.0)
"""Vertical field of view: a long lens, so that near limbs do not look swollen."""
MARGIN = 1.08


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole.

    Attributes:
        eye: (3,) where it is [m].
        axes: (3, 3) rows: unit vectors right, up and towards the viewer.
        size: Width and height of the picture [pixels].
    """

    eye: Array
    axes: Array
    size: tuple[int, int]

    @classmethod
    def framing(
        cls, points: Array, yaw: float, pitch: float, size: tuple[int, int], margin: float = MARGIN
    ) -> Camera:
        """The nearest camera in a direction that has all points in view.

        Args:
            points: (n, 3) what must be seen [m].
            yaw: Direction of the viewer about Y, 0 along Z, pi/2 along X [rad].
            pitch: How far above the horizon the viewer is [rad].
            size: Width and height of the picture [pixels].
            margin: Of the picture over what is seen.
        """
        back = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
        right = np.array([np.cos(yaw), 0.0, -np.sin(yaw)])
        axes = np.array([right, np.cross(back, right), back])
        x, y, z = (np.asarray(points, float) @ axes.T).T
        # A point is in view if |x - cx| <= slope (distance - z): the tightest two on either side decide.
        centre, distance = np.zeros(2), 0.0
        slopes = np.tan(FIELD / 2) * np.array([size[0] / size[1], 1.0]) / margin
        for k, (along, slope) in enumerate(zip((x, y), slopes, strict=True)):
            high, low = (along + slope * z).max(), (-along + slope * z).max()
            centre[k] = (high - low) / 2
            distance = max(distance, (high + low) / 2 / slope)
        return cls(np.array([*centre, distance]) @ axes, axes, size)

    def moved(self, shift: Array) -> Camera:
        """The same camera elsewhere: shifted by (3,) [m]."""
        return replace(self, eye=self.eye + shift)

    def project(self, points: NDArray[np.floating]) -> Array:
        """Pixel coordinates (n, 2), from the upper left corner, of points (n, 3) before the camera [m]."""
        seen = (points - self.eye) @ self.axes.T
        scale = self.size[1] / (2.0 * np.tan(FIELD / 2))
        flat = seen[:, :2] / np.maximum(-seen[:, 2:], 1e-6) * scale
        return np.stack([self.size[0] / 2 + flat[:, 0], self.size[1] / 2 - flat[:, 1]], axis=-1)

    def cast(self, x: NDArray[np.floating], y: NDArray[np.floating]) -> Floats:
        """Unit directions (n, 3) of the rays through pixel coordinates (n,), (n,)."""
        scale = self.size[1] / (2.0 * np.tan(FIELD / 2))
        right, up, back = (self.axes / scale).astype(np.float32)
        across = (np.asarray(x, np.float32) - np.float32(self.size[0] / 2))[:, None]
        down = (np.asarray(y, np.float32) - np.float32(self.size[1] / 2))[:, None]
        rays = across * right - down * up - np.float32(scale) * back
        rays *= 1.0 / np.sqrt(np.einsum("nc,nc->n", rays, rays))[:, None]
        return np.asarray(rays, np.float32)
