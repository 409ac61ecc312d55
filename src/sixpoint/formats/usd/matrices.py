"""4x4 matrices as USD has them (row vectors, the translation in the last row) and rigid motions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sixpoint.formats.source import LARGEST

Array = NDArray[np.float64]

ALIKE = 2e-3  # scales that differ by less are the same: UsdSkel keeps them as half floats


@dataclass(frozen=True, eq=False)
class Similarity:
    """(...) many maps of a point p to ``translation + rotation * (scale p)``.

    Attributes:
        rotations: (..., 4) xyzw.
        translations: (..., 3).
        scales: (..., 3) along the axes before the rotation.
    """

    rotations: Array
    translations: Array
    scales: Array

    @property
    def is_uniform(self) -> NDArray[np.bool_]:
        """(...) whether a scale is the same along all axes, and positive."""
        least, most = self.scales.min(axis=-1), self.scales.max(axis=-1)
        return np.asarray((least > 0) & (most - least <= ALIKE * most))


def compose(rotations: Array, translations: Array) -> Array:
    """(..., 4, 4) matrices of rigid motions."""
    matrices = np.zeros((*translations.shape[:-1], 4, 4))
    turn = Rotation.from_quat(np.reshape(rotations, (-1, 4))).as_matrix()
    matrices[..., :3, :3] = np.swapaxes(turn, 1, 2).reshape(*translations.shape[:-1], 3, 3)
    matrices[..., 3, :3], matrices[..., 3, 3] = translations, 1.0
    return matrices


def decompose(matrices: Array) -> Similarity | None:
    """Parts of (..., 4, 4) matrices; None where one has a shear, a mirror, or no sane size."""
    matrices = np.asarray(matrices, float)
    if not np.all(np.abs(matrices) < LARGEST):  # NaN is not
        return None
    axes = matrices[..., :3, :3]
    scales = np.linalg.norm(axes, axis=-1)
    if not np.all(scales > 1e-9):
        return None
    turn = axes / scales[..., None]
    gram = turn @ np.swapaxes(turn, -1, -2)
    if np.abs(gram - np.eye(3)).max(initial=0.0) > ALIKE or np.any(np.linalg.det(turn) < 0):
        return None
    quats = Rotation.from_matrix(np.swapaxes(turn, -1, -2).reshape(-1, 3, 3)).as_quat()
    return Similarity(quats.reshape(*matrices.shape[:-2], 4), matrices[..., 3, :3], scales)
