"""Which joints of a file really translate.

Many files give every joint position channels that never change. Those become plain offsets; a joint counts
as moving only if its position varies by more than 1e-5 of the body's size.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.skeleton import Skeleton
from sixpoint.formats.space import compute_diameter

Array = NDArray[np.float64]

STILL = 1e-5
"""Part of the body's size within which a position counts as constant."""


class Placement(NamedTuple):
    """Constant offsets and real movement.

    Attributes:
        skeleton: The rig with constant positions as its offsets.
        moving: Joints that translate, the root first.
        translations: (F, K, 3) their local positions.
    """

    skeleton: Skeleton
    moving: tuple[int, ...]
    translations: Array


def fold_translations(skeleton: Skeleton, root: Array, others: Mapping[int, Array]) -> Placement:
    """Split joint positions into constant offsets and real movement.

    Args:
        skeleton: The rig as the file describes it.
        root: (F, 3) positions of the root.
        others: Joint -> (F, 3) local positions of joints below the root that have position channels.
    """
    offsets = skeleton.offsets.copy()
    for joint, position in others.items():
        offsets[joint] = position.min(axis=0) + 0.5 * np.ptp(position, axis=0)
    tolerance = STILL * compute_diameter(replace(skeleton, offsets=offsets))
    moving, translations = [0], [root]
    for joint in sorted(others):
        if np.any(np.ptp(others[joint], axis=0) > tolerance):
            offsets[joint] = skeleton.offsets[joint]
            moving.append(joint)
            translations.append(others[joint])
    return Placement(replace(skeleton, offsets=offsets), tuple(moving), np.stack(translations, axis=1))
