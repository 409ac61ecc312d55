"""The colours of the page, those of the pictures in the report."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

INK, SOFT, GHOST = (34, 48, 60), (135, 147, 160), (198, 205, 213)
LEFT, RIGHT, TRUNK = (31, 138, 158), (224, 122, 63), (68, 84, 106)
LIMIT = (201, 55, 79)
"""A joint that is at its limit."""
WOOD = (205, 181, 143)
SIDES = {"left": LEFT, "right": RIGHT, "trunk": TRUNK}
FLOOR, GRID, SECTION = (247, 248, 250), (226, 231, 236), (201, 208, 215)
BRAND = (16, 72, 82)
"""Buttons are a lighter shade of it, which is the left side's."""


def as_hex(colour: tuple[int, int, int]) -> str:
    """As CSS writes it."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def as_linear(colours: ArrayLike) -> NDArray[np.uint8]:
    """Colours (..., 3) for batches of meshes, which the browser takes as linear light."""
    share = np.asarray(colours, float) / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.round(255.0 * light).astype(np.uint8)
