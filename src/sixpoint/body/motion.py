"""Pose and Motion: local rotations on a skeleton, one frame or many.

Only the joints in ``moving`` have local translations that change; the root always does.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Dofs
from sixpoint.body.skeleton import Skeleton, frozen
from sixpoint.errors import SkeletonError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FileSpace:
    """The space of the file a motion came from, so that it can be written back as it was.

    Inside sixpoint everything is in metres and Y up; only ``formats`` looks at this.

    Attributes:
        unit: Metres per file unit.
        up: Axis of the file's world that points up, ``"y"`` or ``"z"``; marker files also have
            ``"x"`` and the three with a minus.
        unit_source: Where the unit comes from ("file", "guessed", "given").
        order: Euler order of the file's angles, for formats that leave it open.
        up_source: Where the up axis comes from ("convention", "guessed", "given").
    """

    unit: float = 0.01
    up: str = "y"
    unit_source: str = "convention"
    up_source: str = "convention"
    order: str = "ZYX"


@dataclass(frozen=True, eq=False, repr=False)
class Pose:
    """One posture of a skeleton.

    Attributes:
        skeleton: The rig.
        rotations: (J, 4) local rotations, parent<-joint, xyzw.
        translations: (K, 3) local positions of the joints in ``moving`` [m]; row 0 is the root.
        moving: K joints with their own translation; ``moving[0] == 0``.
    """

    skeleton: Skeleton
    rotations: Array
    translations: Array
    moving: tuple[int, ...] = (0,)

    def __repr__(self) -> str:
        return f"Pose({len(self.skeleton)} joints)"

    def compute_transforms(self) -> tuple[Array, Array]:
        """World positions (J, 3) [m] and rotations (J, 4)."""
        return self.skeleton.compute_transforms(self.rotations, self.translations, self.moving)


@dataclass(frozen=True, eq=False, repr=False)
class Motion:
    """F frames of a skeleton at a constant rate.

    Attributes:
        skeleton: The rig.
        rotations: (F, J, 4) local rotations, parent<-joint, xyzw, unit.
        translations: (F, K, 3) local positions of the joints in ``moving`` [m]; [:, 0] is the root.
        rate: Frames per second [Hz].
        moving: K joints that really translate; ``moving[0] == 0``. All others keep their rest offset.
        dofs: Degrees of freedom that the file declares (ASF); ``Dofs.undeclared`` where it declares none.
        space: Unit and up axis of the file.
        name: Short name for messages and file names.
    """

    skeleton: Skeleton
    rotations: Array
    translations: Array
    rate: float
    moving: tuple[int, ...] = (0,)
    dofs: Dofs = field(default_factory=Dofs.undeclared)
    space: FileSpace = field(default_factory=FileSpace)
    name: str = "motion"

    def __repr__(self) -> str:
        return f"Motion({self.name!r}, {len(self)} frames at {self.rate:g} Hz, {len(self.skeleton)} joints)"

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "rotations", frozen(self.rotations))
        set_(self, "translations", frozen(self.translations))
        set_(self, "moving", tuple(int(j) for j in self.moving))
        set_(self, "rate", float(self.rate))
        joints = len(self.skeleton)
        frames = self.rotations.shape[0] if self.rotations.ndim else 0
        if self.rotations.shape != (frames, joints, 4):
            raise SkeletonError(
                f"rotations must be (frames, {joints}, 4) for this skeleton, got {self.rotations.shape}"
            )
        if self.moving[:1] != (0,) or len(set(self.moving)) != len(self.moving):
            raise SkeletonError(f"moving joints must be distinct, the root 0 first, got {self.moving}")
        if self.translations.shape != (frames, len(self.moving), 3):
            raise SkeletonError(
                f"translations must be ({frames}, {len(self.moving)}, 3), got {self.translations.shape}"
            )
        if frames == 0:
            raise SkeletonError("a motion needs at least one frame")
        if not (np.isfinite(self.rate) and self.rate > 0):
            raise SkeletonError(f"the frame rate must be positive, got {self.rate}")
        if not (np.all(np.isfinite(self.rotations)) and np.all(np.isfinite(self.translations))):
            raise SkeletonError("rotations and translations must be finite")

    def __len__(self) -> int:
        return int(self.rotations.shape[0])

    @property
    def root_positions(self) -> Array:
        """(F, 3) world positions of the root [m]."""
        return self.translations[:, 0]

    @property
    def duration(self) -> float:
        """Length [s]."""
        return len(self) / self.rate

    @cached_property
    def transforms(self) -> tuple[Array, Array]:
        """World positions (F, J, 3) [m] and world rotations (F, J, 4), computed once."""
        return self.skeleton.compute_transforms(self.rotations, self.translations, self.moving)

    @property
    def positions(self) -> Array:
        """World positions of the joints (F, J, 3) [m]."""
        return self.transforms[0]

    def pose(self, frame: int) -> Pose:
        """One frame."""
        return Pose(self.skeleton, self.rotations[frame], self.translations[frame], self.moving)

    def sliced(self, frames: slice) -> Motion:
        """The frames of a slice; an empty slice is an error that says how many frames there are."""
        if len(range(*frames.indices(len(self)))) == 0:
            raise SkeletonError(f"no frames left of 0 to {len(self) - 1}, asked for {frames}")
        step = abs(frames.step or 1)
        return replace(
            self,
            rotations=self.rotations[frames],
            translations=self.translations[frames],
            rate=self.rate / step,
        )

    @classmethod
    def from_poses(cls, poses: list[Pose], rate: float) -> Motion:
        """Stack poses of one skeleton into a motion."""
        first = poses[0]
        return cls(
            first.skeleton,
            rot.normalised(np.stack([p.rotations for p in poses])),
            np.stack([p.translations for p in poses]),
            rate,
            first.moving,
        )
