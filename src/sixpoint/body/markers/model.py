"""A marker model: a figure with a person's lengths, and where each marker sits on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.skeleton import Index, frozen
from sixpoint.errors import FigureError

Array = NDArray[np.float64]

PARTS = ("head", "trunk", "l_arm", "r_arm", "l_leg", "r_leg")
"""Body parts that ``MarkerModel.missing`` may name; the pelvis never lacks markers."""


@dataclass(frozen=True, eq=False, repr=False)
class MarkerModel:
    """M markers fixed to the joints of a figure.

    Attributes:
        figure: The person: a built-in figure with lengths from a recording, or any other.
        names: M distinct labels of markers.
        joints: (M,) joint of the figure that carries each marker.
        offsets: (M, 3) place of each marker in its joint's rig frame [m].
        spread: (M,) root mean square distance of each marker from its place in the calibration [m];
            NaN where it was not measured.
        missing: Body parts without markers, of ``PARTS``: nothing says how they move.
    """

    figure: Figure
    names: tuple[str, ...]
    joints: Index
    offsets: Array
    spread: Array
    missing: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"MarkerModel({len(self.names)} markers on {self.figure!r})"

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "names", tuple(self.names))
        set_(self, "missing", tuple(self.missing))
        set_(self, "joints", frozen(self.joints, np.int64))
        set_(self, "offsets", frozen(self.offsets))
        set_(self, "spread", frozen(self.spread))
        count, joints = len(self.names), len(self.figure.skeleton)
        if len(set(self.names)) != count:
            raise FigureError("marker names must be distinct")
        shapes = self.joints.shape, self.offsets.shape, self.spread.shape
        if shapes != ((count,), (count, 3), (count,)):
            raise FigureError(
                f"{count} markers need joints ({count},), offsets ({count}, 3) and spread ({count},), "
                f"got {shapes[0]}, {shapes[1]} and {shapes[2]}"
            )
        if count and not (self.joints.min() >= 0 and self.joints.max() < joints):
            raise FigureError(f"a marker sits on a joint that does not exist; the figure has {joints}")
        if not np.isfinite(self.offsets).all():
            raise FigureError("offsets of markers must be finite numbers")

    def place(self, positions: Array, world: Array) -> Array:
        """Where the markers are in a pose.

        Args:
            positions: (..., J, 3) world positions of the figure's joints [m].
            world: (..., J, 4) world rotations of its rig frames.

        Returns:
            (..., M, 3) world positions of the markers [m].
        """
        carried = rot.mul_vec(world[..., self.joints, :], self.offsets)
        return np.asarray(positions[..., self.joints, :] + carried)
