"""The light of all pictures: a soft key light over the viewer's left shoulder, a sky, and a bright floor.

Directions are fixed patterns, the same for every pixel, so that pictures are deterministic and without noise;
each sample of a pixel has its own, and their mean is smooth.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

KEY_PLACE = (-0.50, 0.85, 0.62)
"""Direction of the key light, in units of the viewer's right, of up, and of the way back to the viewer."""
KEY_RADIUS = 0.09
"""Of the key light's disc, seen from the body [rad]: how soft shadows are."""
KEY = np.array([1.0, 0.975, 0.94]) * 0.72
SKY = np.array([0.66, 0.69, 0.73])
HORIZON = np.array([0.60, 0.61, 0.62])
GROUND = np.array([0.36, 0.35, 0.34])
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


def find_key(right: Array, back: Array) -> Array:
    """Unit direction (3,) to the key light for a viewer whose axes are these."""
    level = np.array([back[0], 0.0, back[2]]) / np.hypot(back[0], back[2])
    key = KEY_PLACE[0] * right + KEY_PLACE[1] * np.array([0.0, 1.0, 0.0]) + KEY_PLACE[2] * level
    return np.asarray(key / np.linalg.norm(key))


def spread_over_disc(centre: Array, count: int, turn: float = 0.0) -> Floats:
    """Directions (count, 3) to points spread evenly over the key light's disc."""
    k = np.arange(count) + 0.5
    radius, angle = KEY_RADIUS * np.sqrt(k / count), GOLDEN * k + turn
    side = np.cross(centre, [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    other = np.cross(centre, side)
    spread = centre + radius[:, None] * (np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * other)
    return np.asarray(spread / np.linalg.norm(spread, axis=1, keepdims=True), np.float32)


def spread_over_sphere(count: int, turn: float = 0.0) -> Floats:
    """Directions (count, 3) spread evenly over the sphere (a Fibonacci lattice)."""
    k = np.arange(count) + 0.5
    y, angle = 1.0 - 2.0 * k / count, GOLDEN * k + turn
    level = np.sqrt(1.0 - y * y)
    return np.stack([level * np.cos(angle), y, level * np.sin(angle)], axis=-1).astype(np.float32)


def shine(direction: Floats) -> Floats:
    """Light (3,) that comes from a direction (3,) where nothing is in its way."""
    height = float(direction[1])
    if height < 0.0:
        return np.asarray(GROUND + (HORIZON - GROUND) * (1.0 + height) ** 4 * 0.5, np.float32)
    return np.asarray(HORIZON + (SKY - HORIZON) * np.sqrt(height), np.float32)


def to_linear(colour: ArrayLike) -> Array:
    """Linear light of sRGB values in 0..1."""
    share = np.asarray(colour, float)
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def to_srgb(light: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Bytes of sRGB of linear light in 0..1; brighter is white."""
    share = np.clip(light, 0.0, 1.0)
    curve = np.where(share <= 0.0031308, 12.92 * share, 1.055 * share ** (1 / 2.4) - 0.055)
    return np.asarray(np.round(255.0 * curve), np.uint8)


def of_hex(colour: str) -> Array:
    """Linear light (3,) of a colour such as "#1f8a9e"; ValueError if it is none."""
    digits = colour.removeprefix("#")
    if len(digits) != 6:
        raise ValueError(colour)
    return to_linear([int(digits[k : k + 2], 16) / 255.0 for k in (0, 2, 4)])


def mixed(colours: Sequence[ArrayLike], shares: Sequence[float]) -> Array:
    """Weighted mean of colours."""
    return np.asarray(sum(s * np.asarray(c, float) for c, s in zip(colours, shares, strict=True)))
