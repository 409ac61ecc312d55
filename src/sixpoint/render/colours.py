"""What colour a body has: left and right apart, all of one colour, or an avatar's own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.surface.shape import Shape
from sixpoint.errors import SixpointError, listed
from sixpoint.render.light import of_hex

Array = NDArray[np.float64]

SCHEMES = {
    "sides": ("#2a94a8", "#e58550", "#8b98a6"),
    "clay": ("#cfc6ba", "#cfc6ba", "#cfc6ba"),
    "ghost": ("#c3cbd3", "#c3cbd3", "#c3cbd3"),
}
"""Name -> colours of the left, of the right and of the trunk."""


def paint(figure: Figure, shape: Shape, scheme: str = "sides") -> Array:
    """Colours (V, 4) of a shape: linear RGB, opaque.

    Args:
        figure: Whose joints carry it.
        shape: What is painted: a vertex belongs to the joint that carries most of it.
        scheme: A name in ``SCHEMES``, or a colour such as "#c8b090".

    Raises:
        SixpointError: It is neither.
    """
    left, right, trunk = _find_colours(scheme)
    roles, skeleton = figure.roles, figure.skeleton
    joints = np.tile(trunk, (len(skeleton), 1))
    for pair in (roles.shoulder, roles.hip):
        for root, colour in zip(pair, (left, right), strict=True):
            joints[skeleton.subtree(root)] = colour
    strongest = np.take_along_axis(shape.joints, shape.weights.argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.column_stack([joints[strongest], np.ones(len(shape.vertices))])


def check_scheme(scheme: str) -> None:
    """Refuse what ``paint`` does not know."""
    _find_colours(scheme)


def _find_colours(scheme: str) -> tuple[Array, Array, Array]:
    try:
        left, right, trunk = SCHEMES.get(scheme, (scheme,) * 3)
        return of_hex(left), of_hex(right), of_hex(trunk)
    except ValueError:
        raise SixpointError(
            f'colours are {listed(SCHEMES)}, or one such as "#c8b090"; got {scheme!r}'
        ) from None
