"""How far does an elbow or knee turn about its limb's line from one frame to the next?

A swivel angle needs a reference direction, and every reference has a pole where angles jump by themselves.
Steps need none: the direction of the elbow in one frame is carried into the next by the shortest rotation of
the limb's line, and compared with the direction there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

STRAIGHT = 0.02  # below this radius of the elbow's circle its direction means nothing [m]


def compute_swivel_steps(root: ArrayLike, middle: ArrayLike, end: ArrayLike) -> Array:
    """Change of the swivel angle from each frame to the next.

    With the line n = unit(end - root) and r, the unit component of middle - root across n: the signed angle
    about the next n from r, carried along by the shortest arc n -> next n, to the next r. A limb that
    turns about its own line with the whole body, as a standing leg in a spin, swivels by that angle.

    Args:
        root: (F, ..., 3) shoulder or hip [m].
        middle: (F, ..., 3) elbow or knee [m].
        end: (F, ..., 3) wrist or ankle [m].

    Returns:
        (F - 1, ...) angles in [-pi, pi] [rad]; NaN where the radius of the elbow's circle is below 2 cm in
        either frame, or the line turns by more than 90 degrees.
    """
    root = np.asarray(root, float)
    line, arm = np.asarray(end, float) - root, np.asarray(middle, float) - root
    length = np.linalg.norm(line, axis=-1, keepdims=True)
    n = line / np.where(length > 0.0, length, 1.0)
    across = arm - _dot(arm, n) * n
    defined = np.linalg.norm(across, axis=-1) >= STRAIGHT
    here, there, r, wanted = n[:-1], n[1:], across[:-1], across[1:]
    along = _dot(here, there)
    defined = defined[:-1] & defined[1:] & (along[..., 0] > 0.0)
    # Rodrigues' formula for the shortest arc, of a vector across its start.
    carried = r - (here + there) * (_dot(there, r) / (1.0 + np.maximum(along, 0.0)))
    angle = np.arctan2(_dot(np.cross(carried, wanted), there), _dot(carried, wanted))[..., 0]
    return np.where(defined, angle, np.nan)


def _dot(a: Array, b: Array) -> Array:
    """(..., 1) dot products."""
    return np.asarray(np.sum(a * b, axis=-1, keepdims=True))
