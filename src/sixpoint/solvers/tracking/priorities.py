"""How important a marker is: by the part of the body that it sits on."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError, listed

Array = NDArray[np.float64]

PRIORITIES: Mapping[str, int] = {"feet": 0, "pelvis": 1, "hands": 2, "head": 3, "rest": 4}
"""Level of each part's markers; 0 is the most important."""

TOLERANCES: Mapping[str, float] = {"feet": 0.02, "pelvis": 0.02, "hands": 0.02, "head": 0.02}
"""How far the centre of a part's markers may be off before it is held at its level [m]."""

NEAR = 0.3
"""Markers this close to a wrist or ankle, over the length of the segment above, are the hand's or foot's."""


def check_priorities(priorities: Mapping[str, int] | None) -> dict[str, int]:
    """The levels of all parts: those given, else the usual ones.

    Raises:
        SixpointError: A part does not exist, or a level is not a whole number from 0.
    """
    given = dict(priorities or {})
    unknown = [part for part in given if part not in PRIORITIES]
    if unknown:
        raise SixpointError(f"no part named {listed(unknown)}; parts are: {listed(PRIORITIES)}")
    for part, level in given.items():
        if not (np.isfinite(level) and int(level) == level and level >= 0):
            raise SixpointError(f"the level of {part!r} is a whole number from 0, got {level}")
    return {**PRIORITIES, **given}


def check_tolerances(tolerances: Mapping[str, float] | None) -> dict[str, float]:
    """The tolerances of all parts: those given, else the usual ones; "rest" has none.

    Raises:
        SixpointError: A part does not exist, or a tolerance is not positive.
    """
    given = dict(tolerances or {})
    unknown = [part for part in given if part not in TOLERANCES]
    if unknown:
        raise SixpointError(f"no tolerance of {listed(unknown)}; parts are: {listed(TOLERANCES)}")
    for part, value in given.items():
        if not value > 0:
            raise SixpointError(f"the tolerance of {part!r} is a positive number [m], got {value}")
    return {**TOLERANCES, **given, "rest": float("inf")}


def find_parts(figure: Figure, joints: NDArray[np.int64], places: Array) -> tuple[str, ...]:
    """The part that each marker belongs to.

    Args:
        figure: The person.
        joints: (M,) joint that carries each marker.
        places: (M, 3) in the neutral pose, pelvis at the origin [m].

    Returns:
        M names of ``PRIORITIES``. Markers on a forearm or shank near its end count as the hand's or foot's:
        they tell where the end is.
    """
    roles, skeleton, rest = figure.roles, figure.skeleton, figure.rest_positions
    below: dict[str, set[int]] = {part: set() for part in ("feet", "hands", "head")}
    for tops, part in ((roles.ankle, "feet"), (roles.wrist, "hands"), ((roles.head,), "head")):
        for joint in tops:
            below[part] |= {int(j) for j in skeleton.subtree(joint)}
    ends = [(m, e, "hands" if k < 2 else "feet") for k, (_, m, e) in enumerate(roles.limbs)]
    parts = []
    for joint, place in zip(joints, places, strict=True):
        part = next((name for name, inside in below.items() if int(joint) in inside), "rest")
        if int(joint) == roles.pelvis:
            part = "pelvis"
        for middle, end, name in ends:
            length = float(np.linalg.norm(rest[end] - rest[middle]))
            if joint == middle and np.linalg.norm(place - rest[end]) < NEAR * length:
                part = name
        parts.append(part)
    return tuple(parts)
