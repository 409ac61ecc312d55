"""How a shape looks: a colour per vertex, and textures for pictures that show more than vertices can."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.skeleton import frozen
from sixpoint.errors import FigureError

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Bytes = NDArray[np.uint8]

_CODES = np.arange(256) / 255.0
LINEAR = np.where(_CODES <= 0.04045, _CODES / 12.92, ((_CODES + 0.055) / 1.055) ** 2.4)
"""Light of the 256 codes of sRGB."""
_CODE = np.searchsorted(0.5 * (LINEAR[1:] + LINEAR[:-1]), np.arange(65536) / 65535.0).astype(np.uint8)
"""The nearest code for light in 65535ths."""
_LIGHT = np.rint(LINEAR * 65535.0).astype(np.int32)


@dataclass(frozen=True, eq=False, repr=False)
class Texture:
    """An image that is wrapped around a surface.

    Attributes:
        levels: The image (H, W, 4), sRGB and opacity, and smaller copies of it, each half as wide and tall.
        wrap: What is beyond its sides, across and down: "repeat", "clamp" or "mirror".
    """

    levels: tuple[Bytes, ...]
    wrap: tuple[str, str] = ("repeat", "repeat")

    def sample(self, places: Array, level: int = 0) -> Array:
        """Bilinear samples (n, 4), linear, at places (n, 2), which are 0 to 1 across and down."""
        image = self.levels[min(level, len(self.levels) - 1)]
        columns, right = _cells(places[:, 0], image.shape[1], self.wrap[0])
        rows, down = _cells(places[:, 1], image.shape[0], self.wrap[1])
        upper, lower = (
            _light(image[row, columns[0]]) * (1 - right) + _light(image[row, columns[1]]) * right
            for row in rows
        )
        return np.asarray(upper * (1 - down) + lower * down)


def halved(image: Bytes) -> Bytes:
    """An image (H, W, 4) at half its width and height, rounded up, with the light of the whole one.

    Pixels count by their opacity, so that what cannot be seen gives no colour to what can.
    """
    height, width, _ = image.shape
    even = np.pad(image, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
    parts = [even[row::2, column::2] for row in (0, 1) for column in (0, 1)]
    opacity = np.asarray(np.sum([part[..., 3:] for part in parts], axis=0, dtype=np.int64))
    light = np.asarray(sum(_LIGHT.take(part[..., :3]) for part in parts)) // 4
    uneven = np.any([part[..., 3] != parts[0][..., 3] for part in parts], axis=0)
    seen = sum(part[uneven, 3:] * _LIGHT.take(part[uneven, :3]).astype(np.int64) for part in parts)
    light[uneven] = np.asarray(seen) // opacity[uneven]
    return np.concatenate([_CODE.take(light), ((opacity + 2) // 4).astype(np.uint8)], axis=2)


@dataclass(frozen=True, eq=False, repr=False)
class Texturing:
    """Which texture is where on a shape.

    Attributes:
        textures: The images.
        chosen: (T,) texture of each triangle; -1 for none.
        places: (V, 2) where each vertex is on it.
        tints: (V, 4) what its colour is multiplied with, linear.
    """

    textures: tuple[Texture, ...]
    chosen: Index
    places: Array
    tints: Array


@dataclass(frozen=True, eq=False, repr=False)
class Appearance:
    """Colours of a ``Shape``.

    Attributes:
        colours: (V, 4) red, green, blue and opacity of the vertices, 0 to 1, linear (not sRGB).
        texturing: What is between them, where the shape has textures.
    """

    colours: Array
    texturing: Texturing | None = None

    def __repr__(self) -> str:
        return f"Appearance({len(self.colours)} vertices)"

    def __post_init__(self) -> None:
        object.__setattr__(self, "colours", frozen(self.colours))
        if self.colours.shape != (len(self.colours), 4):
            raise FigureError(f"colours must be (V, 4), got {self.colours.shape}")
        if not (np.all(self.colours >= 0) and np.all(self.colours <= 1)):
            raise FigureError("colours must be from 0 to 1")


def _light(codes: Bytes) -> Array:
    """Pixels (n, 4) of an image as light and opacity."""
    return np.concatenate([LINEAR[codes[:, :3]], _CODES[codes[:, 3:]]], axis=1)


def _cells(places: Array, size: int, wrap: str) -> tuple[list[Index], Array]:
    """The two cells (n,) of a row of pixels around each place (n,), and the share (n, 1) of the second."""
    at = np.clip(places, -1e6, 1e6) * size - 0.5
    low = np.floor(at).astype(np.int64)
    cells = []
    for cell in (low, low + 1):
        if wrap == "clamp":
            cells.append(np.clip(cell, 0, size - 1))
        elif wrap == "mirror":
            folded = cell % (2 * size)
            cells.append(np.where(folded < size, folded, 2 * size - 1 - folded))
        else:
            cells.append(cell % size)
    return cells, (at - low)[:, None]
