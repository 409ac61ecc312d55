"""How a shape looks: one colour per vertex, which is enough for pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.skeleton import frozen
from sixpoint.errors import FigureError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Appearance:
    """Colours of the vertices of a ``Shape``.

    Attributes:
        colours: (V, 4) red, green, blue and opacity, 0 to 1, linear (not sRGB).
    """

    colours: Array

    def __repr__(self) -> str:
        return f"Appearance({len(self.colours)} vertices)"

    def __post_init__(self) -> None:
        object.__setattr__(self, "colours", frozen(self.colours))
        if self.colours.shape != (len(self.colours), 4):
            raise FigureError(f"colours must be (V, 4), got {self.colours.shape}")
        if not (np.all(self.colours >= 0) and np.all(self.colours <= 1)):
            raise FigureError("colours must be from 0 to 1")
