"""A calibration: how trackers sit on a person, how long the person is, and what could not be found."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.targets import EFFECTORS, Targets

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mount:
    """How a tracker sits on its segment.

    Attributes:
        offset: (3,) from the joint to the tracker in the tracker's frame [m]; NaN where it was not found.
        rotation: (4,) segment<-tracker; NaN where it was not found.
        std: Largest standard deviation of the offset in any direction [m].
        rotation_std: Of the rotation, which is how exactly the pose was held [rad].
    """

    offset: Array
    rotation: Array
    std: float = float("inf")
    rotation_std: float = float("inf")


@dataclass(frozen=True, eq=False)
class Calibration:
    """What a recording tells about a person and six trackers.

    Attributes:
        stature: [m].
        segments: Segment lengths by name [m], as for ``Figure.from_segments``; empty with a given figure.
        sources: Where each comes from.
        mounts: Effector -> how its tracker is mounted.
        unobserved: What the data does not tell -> why, and what would.
        given: The figure that was given.
    """

    stature: float
    segments: dict[str, float]
    sources: dict[str, str]
    mounts: dict[str, Mount]
    unobserved: dict[str, str] = field(default_factory=dict)
    given: Figure | None = None

    def figure(self) -> Figure:
        """The figure that was given, or the built-in one with the lengths found."""
        return self.given if self.given is not None else Figure.from_segments(limits=None, **self.segments)

    def apply(self, targets: Targets) -> Targets:
        """Trackers -> joint positions and segment rotations.

        A point whose offset was not found is lost (NaN), a rotation whose mount was not found has none:
        give them a mount of your own with ``dataclasses.replace`` if you know better. Targets without
        rotations are taken as joints already.
        """
        if targets.rotations is None:
            return targets
        offsets = np.array([self.mounts[name].offset for name in EFFECTORS])
        mounts = np.array([self.mounts[name].rotation for name in EFFECTORS])
        turned = rot.normalised(targets.rotations)
        turned = np.where(np.isfinite(targets.rotations).all(axis=-1, keepdims=True), turned, np.nan)
        positions = targets.positions - rot.mul_vec(turned, offsets)
        return Targets(positions, targets.rate, rot.mul(turned, rot.inv(mounts)), targets.name)
