"""What arms and thighs can be told to stay out of, and the figure's flesh for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure, SpineChain
from sixpoint.body.surface.flesh_regions import PALM, thigh_radii, unit_of
from sixpoint.body.surface.prisms import build_prisms
from sixpoint.errors import SixpointError, listed
from sixpoint.solvers.avoidance.packing import WIDTH, pack_flesh, pack_thighs

Array = NDArray[np.float64]

AVOIDABLE = ("elbows", "forearms", "thighs", "arms")
"""What can be kept apart: elbows and trunk; forearms and hands, and trunk and head; thigh and thigh; arms and
thighs (elbows then stay out of the trunk too), which is experimental: see docs/collision.md."""


def check_avoid(names: Sequence[str] | None) -> tuple[str, ...]:
    """Names of what is kept apart, each once, in the order of ``AVOIDABLE``.

    Raises:
        SixpointError: There is no such part; the message lists those there are.
    """
    named = [names] if isinstance(names, str) else list(names or ())
    unknown = [str(name) for name in named if name not in AVOIDABLE]
    if unknown:
        raise SixpointError(f"nothing to avoid is named {listed(unknown)}; there are: {listed(AVOIDABLE)}")
    return tuple(name for name in AVOIDABLE if name in named)


def arm_lengths(figure: Figure) -> tuple[float, float]:
    """Lengths of upper arm and forearm [m]."""
    shoulder, elbow, wrist = figure.roles.limbs[0]
    upper, lower = figure.offset_between(shoulder, elbow), figure.offset_between(elbow, wrist)
    return float(np.linalg.norm(upper)), float(np.linalg.norm(lower))


def find_flesh(
    figure: Figure, chain: SpineChain, avoid: tuple[str, ...]
) -> tuple[Array, Array | None] | None:
    """The flesh of a figure as compiled code reads it, trunk and thighs; None where nothing is avoided."""
    if not avoid:
        return None
    lengths, trunk = arm_lengths(figure), np.zeros((1, WIDTH))
    forearms, arms = "forearms" in avoid, "arms" in avoid
    prisms = build_prisms(figure, chain, head=forearms) if avoid != ("thighs",) else None
    if prisms is not None:
        trunk = np.ascontiguousarray(pack_flesh(prisms, lengths, forearms))
    if "thighs" not in avoid and not arms:
        return trunk, None
    balls = (*prisms.elbow, *prisms.forearm) if prisms is not None and arms else ()
    palm = PALM * unit_of(figure)
    return trunk, pack_thighs(thigh_radii(figure), balls, lengths, "thighs" in avoid, palm)
