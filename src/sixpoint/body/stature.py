"""How tall the person is whose bones a figure has."""

from __future__ import annotations

from functools import cache

from sixpoint.body.anthropometry import MEAN_STATURE
from sixpoint.body.figure import Figure


def stature_of(figure: Figure) -> float:
    """The stature of an average person whose legs and trunk are as long as the figure's [m]."""
    return MEAN_STATURE * figure.height / _mean_height()


@cache
def _mean_height() -> float:
    return Figure.from_stature(MEAN_STATURE).height
