"""Whose points are these? A figure of the person, as far as six moving joints tell its lengths.

``calibrate`` measures lengths in a pose that was asked for. Here nobody was asked: what is used are distances
that a posture can only shorten. Head to pelvis is as long as the trunk whenever the back is straight, pelvis
to ankle as long as the leg whenever a knee is, and the wrists are never farther apart than both arms.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.anthropometry import segments_of_stature
from sixpoint.body.figure import Figure
from sixpoint.body.targets import Targets
from sixpoint.calibration.lengths import UNIT
from sixpoint.errors import FigureError, TargetError

Array = NDArray[np.float64]

LONGEST = 99.0  # percentile of a distance that counts as stretched: some noise is left out
BENT = 0.95  # of the proportional length; legs that seem shorter were never stretched


def estimate_figure(targets: Targets) -> Figure:
    """The built-in figure with the lengths of the person that six joints come from.

    The trunk is measured, and so are legs that were stretched; others, and arms where no larger span is seen,
    are proportions. A leg that is taken 2 % too short hides 23 degrees of a knee's bend: where legs matter,
    rather give a stature or a figure.

    Args:
        targets: The joints themselves; of trackers worn elsewhere, what ``Calibration.apply`` returns.

    Raises:
        TargetError: Head, pelvis and an ankle are never known together, or no human is of this size.
    """
    mean = Figure.from_stature(UNIT)
    rest, roles = mean.rest_positions, mean.roles
    unit = np.linalg.norm(rest[roles.head] + mean.head_offset - rest[roles.pelvis])
    trunk = _longest(targets, (0,), (1,)) / float(unit)
    unit = np.linalg.norm(rest[roles.ankle[0]] - rest[roles.pelvis])
    legs = _longest(targets, (0,), (4, 5)) / float(unit)
    advice = "give the source's stature [m], or its figure"
    if not (np.isfinite(trunk) and np.isfinite(legs)):
        raise TargetError(
            f"{targets.name}: head, pelvis and an ankle have to be known for the source's lengths: {advice}"
        )
    try:
        segments = segments_of_stature(UNIT * max(trunk, legs))
    except FigureError as error:
        raise TargetError(f"{targets.name}: these points are no human's: {error}; {advice}") from None
    lengths = segments_of_stature(UNIT)
    for names, scale in (
        (("torso_length", "neck"), trunk),
        (("thigh", "calf", "pelvis_length"), max(legs, BENT * trunk)),
    ):
        segments |= {name: lengths[name] * scale for name in names}
    arm = segments["upper_arm"] + segments["forearm"]
    span = (_longest(targets, (2,), (3,)) - segments["torso_width"]) / 2.0
    if span > arm:  # no arm is shorter
        segments |= {name: segments[name] * span / arm for name in ("upper_arm", "forearm")}
    return Figure.from_segments(limits=None, **segments)


def _longest(targets: Targets, starts: tuple[int, ...], ends: tuple[int, ...]) -> float:
    """A high percentile of the distances between effectors [m]; NaN where they are never known together."""
    gaps = targets.positions[:, starts] - targets.positions[:, ends]
    distance = np.linalg.norm(gaps, axis=2)
    known = distance[np.isfinite(distance)]
    return float(np.percentile(known, LONGEST)) if known.size else float("nan")
