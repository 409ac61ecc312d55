"""Centres and axes of joints from movement alone: no anatomy goes in.

Seen from one segment, markers of the next one stay on spheres about a ball joint and in planes across a
hinge. How far the movement tells the centre comes with it, as a standard deviation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_FRAMES = 10
INDEPENDENT = 10.0  # frames that a movement's errors are worth, since skin slides with the pose


@dataclass(frozen=True, eq=False)
class Centre:
    """A joint centre in a segment's frame.

    Attributes:
        position: (3,) [m].
        std: In the direction that the movement tells least [m]; infinite where it tells nothing.
        spread: Root mean square of what radii change, or of the distance of both segments' centres [m].
    """

    position: Array
    std: float
    spread: float


def fit_centre(points: Array, iterations: int = 20) -> Centre:
    """The point that markers keep their distances from.

    Args:
        points: (F, M, 3) markers of one segment, seen from the other [m]; NaN where not seen.
        iterations: Of the correction for noise, which pulls the algebraic fit towards the markers.

    Reference: Gamage & Lasenby 2002, J. Biomech. 35, 87; Halvorsen 2003, J. Biomech. 36, 999.
    """
    matrix, right, means, noise = np.zeros((3, 3)), np.zeros(3), [], 0.0
    used = []
    for m in range(points.shape[1]):
        v = points[np.isfinite(points[:, m, 0]), m]
        if len(v) < LEAST_FRAMES:
            continue
        mean, square = v.mean(axis=0), np.sum(v**2, axis=1)
        matrix += v.T @ v / len(v) - np.outer(mean, mean)
        right += 0.5 * ((v * square[:, None]).mean(axis=0) - mean * square.mean())
        means.append(mean)
        used.append(v)
    if not used:
        return Centre(np.full(3, np.nan), np.inf, np.inf)
    centre = _solve(matrix, right)
    for _ in range(iterations):
        radii = [np.linalg.norm(v - centre, axis=1) for v in used]
        noise = float(np.mean([np.var(r) for r in radii]))
        centre = _solve(matrix, right - noise * sum((mean - centre for mean in means), np.zeros(3)))
    information = np.zeros((3, 3))
    for v in used:
        u = (v - centre) / np.linalg.norm(v - centre, axis=1, keepdims=True)
        information += (u - u.mean(axis=0)).T @ (u - u.mean(axis=0)) * min(1.0, INDEPENDENT / len(v))
    return Centre(centre, _worst(information, noise), float(np.sqrt(noise)))


def fit_common_centre(first: tuple[Array, Array], second: tuple[Array, Array]) -> tuple[Centre, Centre]:
    """The point that is fixed in two segments, in the frame of each.

    Args:
        first: Rotations (F, 3, 3) and places (F, 3) [m] of a segment; NaN where unknown.
        second: Of the other.

    Reference: Ehrig et al. 2006, "symmetrical centre of rotation estimation", J. Biomech. 39, 2798.
    """
    seen = np.isfinite(first[1][:, 0]) & np.isfinite(second[1][:, 0])
    if seen.sum() < LEAST_FRAMES:
        nothing = Centre(np.full(3, np.nan), np.inf, np.inf)
        return nothing, nothing
    rows = np.concatenate([first[0][seen], -second[0][seen]], axis=2).reshape(-1, 6)
    right = (second[1][seen] - first[1][seen]).reshape(-1)
    solution, *_ = np.linalg.lstsq(rows, right, rcond=1e-9)
    noise = float(np.mean((rows @ solution - right) ** 2))
    covariance = np.linalg.pinv(rows.T @ rows * min(1.0, INDEPENDENT / seen.sum()), rcond=1e-9) * noise
    spread = float(np.sqrt(3.0 * noise))
    a, b = (float(np.sqrt(np.linalg.eigvalsh(covariance[k : k + 3, k : k + 3])[-1])) for k in (0, 3))
    return Centre(solution[:3], a, spread), Centre(solution[3:], b, spread)


def fit_axis(points: Array) -> tuple[Array, float]:
    """The direction across which markers move.

    Args:
        points: (F, M, 3) markers of one segment, seen from the other [m]; NaN where not seen.

    Returns:
        A unit vector (3,), either way round, and how much more they move in the plane than along it: the
        ratio of standard deviations, 1 where nothing is told.

    Reference: Gamage & Lasenby 2002, section 3.
    """
    scatter = np.zeros((3, 3))
    for m in range(points.shape[1]):
        v = points[np.isfinite(points[:, m, 0]), m]
        if len(v) >= LEAST_FRAMES:
            scatter += np.cov(v.T)
    sizes, vectors = np.linalg.eigh(scatter)
    return vectors[:, 0], float(np.sqrt(max(sizes[1], 0.0) / max(sizes[0], 1e-12)))


def _solve(matrix: Array, right: Array) -> Array:
    solution, *_ = np.linalg.lstsq(matrix, right, rcond=1e-9)
    return np.asarray(solution)


def _worst(information: Array, noise: float) -> float:
    least = float(np.linalg.eigvalsh(information)[0])
    return float(np.sqrt(noise / least)) if least > 1e-9 else np.inf
