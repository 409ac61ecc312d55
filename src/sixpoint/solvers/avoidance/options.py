"""What elbows and arms can be told to stay out of, and the figure's flesh for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure, SpineChain
from sixpoint.body.prisms import build_prisms
from sixpoint.errors import SixpointError, listed
from sixpoint.solvers.avoidance.packing import pack_flesh

Array = NDArray[np.float64]

AVOIDABLE = ("elbows", "forearms")
"""Parts that can be kept out of the trunk: elbows; forearms and hands, with those also out of the head."""


def check_avoid(names: Sequence[str] | None) -> tuple[str, ...]:
    """Names of what stays out of the trunk, each once, in the order of ``AVOIDABLE``.

    Raises:
        SixpointError: There is no such part; the message lists those there are.
    """
    named = [names] if isinstance(names, str) else list(names or ())
    unknown = [str(name) for name in named if name not in AVOIDABLE]
    if unknown:
        raise SixpointError(f"nothing to avoid is named {listed(unknown)}; there are: {listed(AVOIDABLE)}")
    return tuple(name for name in AVOIDABLE if name in named)


def find_flesh(figure: Figure, chain: SpineChain, avoid: tuple[str, ...]) -> Array | None:
    """The flesh of a figure as compiled code reads it; None where nothing is avoided."""
    if not avoid:
        return None
    forearms = "forearms" in avoid
    shoulder, elbow, wrist = figure.roles.limbs[0]
    ends = ((shoulder, elbow), (elbow, wrist))
    lengths = [float(np.linalg.norm(figure.offset_between(a, b))) for a, b in ends]
    return np.ascontiguousarray(pack_flesh(build_prisms(figure, chain, head=forearms), lengths, forearms))
