"""Stature and segment lengths from the joint positions of a standing person.

Six points measure four lengths: the height of the head over the ankles, of the head over the pelvis and of
the pelvis over the ankles, and the span of the arms. All others are proportions, and are called so. The split
of an arm at the elbow, of a leg at the knee and of the trunk at the neck's root is never observable.

Reference: Drillis & Contini 1966; proportions in ``body/data/proportions.toml``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.anthropometry import segments_of_stature
from sixpoint.body.figure import Figure
from sixpoint.calibration.standing import Posture
from sixpoint.errors import FigureError, TargetError

Array = NDArray[np.float64]

UNIT = 1.75  # stature of the figure whose ratios are used [m]


@dataclass(frozen=True)
class Lengths:
    """A person's lengths.

    Attributes:
        stature: [m].
        segments: The eleven segment lengths by name [m], as for ``Figure.from_segments``.
        sources: Where each comes from: "measured", "measured with ..., split by proportion", or "proportion".
    """

    stature: float
    segments: dict[str, float]
    sources: dict[str, str]


def compute_stature(head_over_ankles: float) -> float:
    """Stature [m] for a height of the head joint over the ankles [m], at average proportions."""
    figure = Figure.from_stature(UNIT)
    roles, rest = figure.roles, figure.rest_positions
    ratio = (rest[roles.head] + figure.head_offset - rest[roles.ankle[0]])[1] / UNIT
    return float(head_over_ankles / ratio)


def measure_lengths(
    standing: Array, posture: Posture, span: float, stature: float | None = None, leg: float | None = None
) -> Lengths:
    """Lengths of a standing person.

    Args:
        standing: (6, 3) joint positions in the still pose [m]; the wrists may be NaN.
        posture: Arms hanging or stretched to the sides.
        span: Largest distance between the wrists in the whole recording [m]; NaN where it is not known.
        stature: The person's stature where it is known [m].
        leg: Length of a leg, hip to ankle, where it was measured [m].

    Raises:
        TargetError: Head, pelvis and ankles are not those of a standing person.
    """
    ankles = float(standing[4:, 1].mean())
    tall, low = float(standing[1, 1]) - ankles, float(standing[0, 1]) - ankles
    if not 0.2 * tall < low < 0.9 * tall:
        raise TargetError(
            f"the still pose is not standing: over the ankles, the head is {tall:.2f} m high, "
            f"the pelvis {low:.2f} m"
        )
    given = stature is not None
    height = stature if stature is not None else compute_stature(tall)
    try:
        segments = segments_of_stature(height)
    except FigureError as error:
        raise TargetError(
            f"the head is {tall:.2f} m above the ankles, which is no human's: {error}"
        ) from error
    sources = dict.fromkeys(segments, "proportion")

    def share(names: tuple[str, ...], total: float, source: str) -> None:
        whole = sum(segments[n] for n in names)
        for name in names:
            segments[name] *= total / whole
            sources[name] = source

    rest = _ratios()
    if leg is not None:
        share(("thigh", "calf"), leg, "measured with the leg, split by proportion")
    else:
        share(
            ("thigh", "calf", "pelvis_length"), low, "measured with the pelvis' height, split by proportion"
        )
    share(
        ("torso_length", "neck"), (tall - low) * rest["trunk"], "measured with the trunk, split by proportion"
    )
    arm = _measure_arm(standing, posture, span, segments, rest["shoulder_drop"])
    if arm is not None:
        share(("upper_arm", "forearm"), arm, "measured with the arms, split by proportion")
    return Lengths(height, segments, sources | {"stature": "given" if given else "measured"})


def _ratios() -> dict[str, float]:
    """Torso and neck, and the shoulders' drop from the head, over the head's height above the pelvis."""
    figure = Figure.from_stature(UNIT)
    roles, rest, lengths = figure.roles, figure.rest_positions, segments_of_stature(UNIT)
    head = rest[roles.head] + figure.head_offset
    trunk = (lengths["torso_length"] + lengths["neck"]) / (head - rest[roles.pelvis])[1]
    drop = (head - rest[roles.shoulder[0]])[1] / (head - rest[roles.pelvis])[1]
    return {"trunk": float(trunk), "shoulder_drop": float(drop)}


def _measure_arm(
    standing: Array, posture: Posture, span: float, segments: dict[str, float], drop: float
) -> float | None:
    """Length of an arm, shoulder to wrist [m]; None where no wrist is known."""
    wrists = standing[2:4]
    if not np.isfinite(wrists).all():
        return None
    stretched = (span - segments["torso_width"]) / 2 if np.isfinite(span) else 0.0  # no arm is shorter
    if posture == "t":
        return float((np.linalg.norm(wrists[0] - wrists[1]) - segments["torso_width"]) / 2)
    shoulder = standing[1, 1] - drop * (standing[1, 1] - standing[0, 1])
    return float(max(shoulder - wrists[:, 1].mean(), stretched))
