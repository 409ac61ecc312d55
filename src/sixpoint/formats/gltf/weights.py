"""Joints and weights of vertices as files must have them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

MOST_CARRIERS = 8
"""Joints per vertex that are written, two sets of four; the heaviest stay."""


def pack_weights(joints: Index, weights: Array) -> tuple[Index, Array]:
    """Joints and weights (V, 4 or 8) of any (V, K), not all zero in a row.

    No joint is named twice, the heaviest comes first, weights in single precision sum to one, and what is not
    used is joint 0.
    """
    count, width = joints.shape
    joints, weights = joints.copy(), weights.copy()
    for a in range(width):
        for b in range(a):
            twice = (joints[:, a] == joints[:, b]) & (weights[:, a] > 0)
            weights[twice, b] += weights[twice, a]
            weights[twice, a] = 0.0
    order = np.argsort(-weights, axis=1, kind="stable")[:, :MOST_CARRIERS]
    rows = np.arange(count)[:, None]
    joints, weights = joints[rows, order], weights[rows, order]
    used = int(np.sum(weights.max(axis=0, initial=0.0) > 0))
    full = 4 if used <= 4 else MOST_CARRIERS
    kept = min(full, joints.shape[1])
    out_joints, out_weights = np.zeros((count, full), np.int64), np.zeros((count, full))
    out_joints[:, :kept], out_weights[:, :kept] = joints[:, :kept], weights[:, :kept]
    out_weights /= out_weights.sum(axis=1, keepdims=True)
    out_weights = out_weights.astype(np.float32).astype(np.float64)
    return np.where(out_weights > 0, out_joints, 0), out_weights
