"""Targets: where the six tracked points are, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body.skeleton import frozen
from sixpoint.errors import TargetError

Array = NDArray[np.float64]

EFFECTORS = ("pelvis", "head", "l_wrist", "r_wrist", "l_ankle", "r_ankle")
"""The one order of the six effectors."""

GUIDES = ("chest", "l_elbow", "r_elbow", "l_knee", "r_knee")
"""Points that are not met, but lead trunk and swivel angles where they are tracked."""

POINTS = (*EFFECTORS, *GUIDES)
"""The one order of all that a tracker may be on."""


@dataclass(frozen=True, eq=False, repr=False)
class Targets:
    """Positions of the six effectors over F frames.

    Attributes:
        positions: (F, 6, 3) in the order of ``EFFECTORS`` [m]; a lost point is NaN.
        rate: Frames per second [Hz].
        rotations: (F, 6, 4) world rotations xyzw; NaN where a point has none. None: no rotations at all.
        name: Short name for messages and file names.
    """

    positions: Array
    rate: float
    rotations: Array | None = None
    name: str = "targets"

    def __repr__(self) -> str:
        return f"Targets({self.name!r}, {len(self)} frames at {self.rate:g} Hz)"

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        positions = np.asarray(self.positions, float)
        if positions.ndim != 3 or positions.shape[1:] != (6, 3) or len(positions) == 0:
            raise TargetError(
                f"positions must be (frames, 6, 3), one row per effector {EFFECTORS}, got {positions.shape}"
            )
        set_(self, "positions", frozen(positions))
        set_(self, "rate", float(self.rate))
        if not (np.isfinite(self.rate) and self.rate > 0):
            raise TargetError(f"the frame rate must be positive, got {self.rate}")
        if self.rotations is not None:
            rotations = np.asarray(self.rotations, float)
            if rotations.shape != (len(positions), 6, 4):
                raise TargetError(f"rotations must be ({len(positions)}, 6, 4), got {rotations.shape}")
            set_(self, "rotations", frozen(rotations))

    def __len__(self) -> int:
        return int(self.positions.shape[0])

    @property
    def tracked(self) -> NDArray[np.bool_]:
        """(F, 6) whether each point is known."""
        return np.asarray(np.all(np.isfinite(self.positions), axis=-1), bool)

    def sliced(self, frames: slice) -> Targets:
        """The frames of a slice; an empty slice is an error that says how many frames there are."""
        if len(range(*frames.indices(len(self)))) == 0:
            raise TargetError(f"no frames left of 0 to {len(self) - 1}, asked for {frames}")
        rotations = None if self.rotations is None else self.rotations[frames]
        step = abs(frames.step or 1)
        return replace(self, positions=self.positions[frames], rotations=rotations, rate=self.rate / step)


def as_points(points: ArrayLike) -> Array:
    """One frame of effector positions as a new C-contiguous (6, 3) array [m]."""
    try:
        array = np.array(points, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise TargetError(f"points must be numbers (6, 3), NaN where one is lost: {error}") from error
    if array.shape != (6, 3):
        raise TargetError(f"points must be (6, 3), one row per effector {EFFECTORS}, got {array.shape}")
    return array
