"""The rigid motion that takes one set of points nearest to another."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body import rotations as rot

Array = NDArray[np.float64]

THIN = 0.01  # points nearer to a line than this, as a standard deviation, do not tell a rotation [m]


def fit_rigid(local: ArrayLike, world: ArrayLike) -> tuple[Array, Array]:
    """Rotations and shifts that take points nearest to where they are seen, least squares.

    Args:
        local: (n, 3) points [m].
        world: (..., n, 3) where they are [m], NaN where one is not seen.

    Returns:
        (..., 4) rotations and (..., 3) shifts [m], ``world = rotation local + shift``; NaN where fewer than
        three points are seen, or those on a line.

    Reference: Kabsch 1976; Umeyama 1991.
    """
    local, world = np.asarray(local, float), np.asarray(world, float)
    seen = np.isfinite(world).all(axis=-1)
    count = np.maximum(seen.sum(axis=-1), 1)[..., None]
    there = np.where(seen[..., None], world, 0.0)
    here = np.where(seen[..., None], np.broadcast_to(local, world.shape), 0.0)
    a, b = here.sum(axis=-2) / count, there.sum(axis=-2) / count
    here = np.where(seen[..., None], here - a[..., None, :], 0.0)
    there = np.where(seen[..., None], there - b[..., None, :], 0.0)
    u, _, vt = np.linalg.svd(np.swapaxes(there, -1, -2) @ here)
    flip = np.linalg.det(u @ vt)
    u = u.copy()
    u[..., :, 2] *= np.where(flip < 0, -1.0, 1.0)[..., None]
    turn = u @ vt
    wide = np.linalg.svd(here, compute_uv=False)[..., 1] / np.sqrt(count[..., 0]) > THIN
    known = (seen.sum(axis=-1) >= 3) & wide
    quat = rot.from_axes(turn[..., :, 0], turn[..., :, 1], turn[..., :, 2])
    shift = b - (turn @ a[..., None])[..., 0]
    return np.where(known[..., None], quat, np.nan), np.where(known[..., None], shift, np.nan)
