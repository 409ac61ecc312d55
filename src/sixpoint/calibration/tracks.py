"""What trackers report, made ready for fitting: smoothed, thinned out, with rotations as matrices.

Positions and the nine elements of the rotations pass through the same linear filter, so that
p = joint + R o stays true for the filtered values, while white noise shrinks.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sixpoint.body.targets import Targets
from sixpoint.errors import TargetError
from sixpoint.signals.smoothing import smooth

Array = NDArray[np.float64]

WIDTH = 0.05  # of the smoothing bell [s]
RATE = 30.0  # frames kept per second, about [Hz]
SHORTEST = 1.0  # of a usable recording [s]


@dataclass(frozen=True, eq=False)
class Tracks:
    """Smoothed tracker frames.

    Attributes:
        positions: (n, 6, 3) [m]; NaN where lost.
        turns: (n, 6, 3, 3) smoothed rotation matrices, slightly shorter than orthonormal; NaN where lost.
        rotations: (n, 6, 3, 3) the nearest rotations.
        rate: Frames per second [Hz].
    """

    positions: Array
    turns: Array
    rotations: Array
    rate: float

    @classmethod
    def from_targets(cls, targets: Targets) -> Tracks:
        """Smooth targets and thin them out.

        Raises:
            TargetError: The recording is shorter than a second.
        """
        if len(targets) < SHORTEST * targets.rate:
            raise TargetError(
                f"calibration needs a standing pose and about ten seconds of movement, got "
                f"{len(targets) / targets.rate:.2g} s ({len(targets)} frames at {targets.rate:g} Hz)"
            )
        quat = np.full((len(targets), 6, 4), np.nan) if targets.rotations is None else targets.rotations
        norm = np.linalg.norm(quat, axis=-1)
        turned = np.isfinite(norm) & (norm > 1e-6)
        known = targets.tracked if targets.rotations is None else targets.tracked & turned
        unit = np.where(turned[..., None], quat, [0.0, 0.0, 0.0, 1.0]).reshape(-1, 4)
        matrix = Rotation.from_quat(unit).as_matrix().reshape(-1, 6, 3, 3)
        step = max(1, ceil(targets.rate / RATE - 0.5))
        positions = np.where(known[..., None], targets.positions, np.nan)
        turns = np.where((known & turned)[..., None, None], matrix, np.nan)
        positions = smooth(positions, targets.rate, WIDTH)[::step]
        turns = smooth(turns, targets.rate, WIDTH)[::step]
        return cls(positions, turns, _nearest_rotations(turns), targets.rate / step)

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def times(self) -> Array:
        """(n,) [s]."""
        return np.arange(len(self)) / self.rate

    def joints(self, offsets: Array) -> Array:
        """(n, 6, 3) p - R o for offsets (6, 3) in the trackers' frames [m]."""
        return np.asarray(self.positions - np.einsum("nkij,kj->nki", self.turns, offsets))


def _nearest_rotations(turns: Array) -> Array:
    known = np.asarray(np.isfinite(turns).all(axis=(-2, -1)))
    filled = np.where(known[..., None, None], turns, np.eye(3))
    nearest = Rotation.from_matrix(filled.reshape(-1, 3, 3)).as_matrix().reshape(turns.shape)
    return np.where(known[..., None, None], nearest, np.nan)
