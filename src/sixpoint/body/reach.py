"""How high a body has to be for its hands and feet to reach where they shall."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ends = Literal["feet", "hands"]

FOLDED = 0.5  # of a leg: arms pull the hips no nearer to the feet, unless the body squats already
TETHER = 1e-4  # weight of the wished height against a missing reach: 10 cm cost a hundredth of a millimetre
HALVINGS = 50  # of the interval that holds a height


def find_lift(roots: Array, ends: Array, lengths: Array, first: Ends = "feet") -> Array:
    """The vertical shift of a body at which its limbs reach as far as possible.

    What is missing is convex in the height, so there is one best height, and it changes continuously with
    the points. One pair of limbs says what it needs, then the other, which has the last word; and arms do not
    fold up the legs of a body that stands.

    Args:
        roots: (F, 4, 3) shoulders and hips, left before right, as wished [m].
        ends: (F, 4, 3) wrists and ankles [m]; one that is NaN does not count.
        lengths: (F, 4) reach of the limbs [m].
        first: Who has the last word.

    Returns:
        (F, 3) shift [m], vertical.
    """
    gap = roots - ends
    arms, legs = slice(0, 2), slice(2, 4)
    lift = np.zeros(len(gap))
    if first == "hands":
        lift = _nearest_reach(gap[:, legs], lengths[:, legs], lift)
    lift = _nearest_reach(gap[:, arms], lengths[:, arms], lift)
    if first == "feet":
        lift = np.maximum(lift, _lowest(gap[:, legs], FOLDED * lengths[:, legs]))
        lift = _nearest_reach(gap[:, legs], lengths[:, legs], lift)
    return np.stack([np.zeros_like(lift), lift, np.zeros_like(lift)], axis=1)


def _lowest(gap: Array, nearest: Array) -> Array:
    """Heights (F,), at most zero, below which hips come nearer to ankles than wished and than (F, 2) [m]."""
    far = np.linalg.norm(gap, axis=2)
    across = np.linalg.norm(gap[..., [0, 2]], axis=2)
    least = np.sqrt(np.maximum(np.minimum(far, nearest) ** 2 - across**2, 0.0))
    over = np.isfinite(far) & (gap[..., 1] >= 0)  # hips below the feet, as hanging, are not pressed
    return np.asarray(np.where(over, least - gap[..., 1], -np.inf).max(axis=1))


def _nearest_reach(gap: Array, lengths: Array, start: Array) -> Array:
    """Heights (F,) nearest to ``start`` at which the sum of squared missing reaches is least.

    Args:
        gap: (F, n, 3) from the ends to the roots at height zero [m].
        lengths: (F, n) reaches [m].
        start: (F,) wished heights [m].
    """
    known: NDArray[np.bool_] = np.all(np.isfinite(gap), axis=2)
    gap = np.where(known[..., None], gap, 0.0)
    levels = np.where(known, -gap[..., 1], start[:, None])  # heights at which root and end are level
    low, high = np.minimum(levels.min(axis=1), start), np.maximum(levels.max(axis=1), start)
    across = np.linalg.norm(gap[..., [0, 2]], axis=2)
    for _ in range(HALVINGS):
        height = 0.5 * (low + high)
        rise = gap[..., 1] + height[:, None]
        far = np.hypot(across, rise)
        missing = np.where(known, np.maximum(far - lengths, 0.0), 0.0)
        slope = np.sum(missing * rise / np.maximum(far, 1e-12), axis=1) + TETHER * (height - start)
        low, high = np.where(slope < 0, height, low), np.where(slope < 0, high, height)
    return np.asarray(0.5 * (low + high))
