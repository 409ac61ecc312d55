"""Procedural motions of a whole human, the truth that needs no file.

They hold what people do and six points do not show: a turning pelvis, a twisting trunk, shrugs, swivelling
elbows, turning hands and feet. They are made by authored curves, never by a solver of this project.
"""

from __future__ import annotations

from collections.abc import Callable

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.errors import SixpointError, listed
from sixpoint.samples.boxing import boxing
from sixpoint.samples.climb import climb_and_hang
from sixpoint.samples.jump_kick import jump_kick
from sixpoint.samples.reach import reach
from sixpoint.samples.walk import walk

SAMPLES: dict[str, Callable[[Figure], Motion]] = {
    "boxing": boxing,
    "jump_kick": jump_kick,
    "climb_and_hang": climb_and_hang,
    "walk": walk,
    "reach": reach,
}
"""Name of each built-in motion -> the function that makes it for a figure."""


def make_sample(name: str, figure: Figure | None = None) -> Motion:
    """A built-in motion at 60 Hz.

    Args:
        name: One of ``SAMPLES``.
        figure: Whom to move; by default the built-in figure of 1.75 m. Steps and reaches scale with its legs.

    Raises:
        SixpointError: There is no such motion.
    """
    if name not in SAMPLES:
        raise SixpointError(f"no built-in motion named {name!r}; there are: {listed(SAMPLES)}")
    return SAMPLES[name](Figure.from_stature(1.75) if figure is None else figure)


__all__ = ["SAMPLES", "make_sample"]
