"""Where a segment pivots: the offset of a tracker from the joint that its segment turns about.

While a hand circles and its forearm is still, the tracker moves on a sphere about the wrist:

    p(t) = c(t) + B phi(t) + R(t) o

with o, the offset sought; c, a polynomial in time, a joint that drifts; phi, the rotation vector of R from
its mean; and B, how the joint gives way in step with the rotation. B is what limits the method: a forearm of
length f that makes a share k of the hand's rotation moves the wrist by k phi x f, which to first order looks
exactly like an offset that is k f longer. The two differ in second order only, by phi x (phi x k f) / 2. So:

- the error points along the bone; across it the offset is found to millimetres,
- along the bone it needs wide circles, and a share that is small: B has the prior of ``Rest``,
- slower or one-sided movement tells nothing, and says so by its standard deviation.

Reference: the sphere fit of Gamage & Lasenby 2002, "New least squares solutions for estimating the average
centre of rotation and the axis of rotation", with a moving centre.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sixpoint.calibration.estimate import Estimate

Array = NDArray[np.float64]

WINDOWS, STRIDE = (1.6, 2.3), 0.2  # of the windows looked at [s]
LEAST = 1.8  # time that windows which agree have to cover together [s]
DRIFT = 0.5  # time per power of the polynomial that the joint drifts by [s]
CURVED = 0.4  # of the share: how far giving way is not proportional
WIDE = np.radians(9.0)  # least standard deviation of the second widest component of the rotation [rad]
LONGEST = 0.16  # a tracker is not farther from its joint [m]
RESTLESS = 0.0025  # a joint whose unexplained movement is larger does not rest [m]
FLOOR_NOISE = 0.0005  # least residual that is believed [m]
LIFTED = 0.04  # height of a lifted foot's joint over where it stands [m]
AGREED = 12.0  # chi square (3 terms) between windows that tell of the same joint
PAIRS = np.sqrt([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])  # products of components, the same in every frame
GIVEN_WAY = 45.0  # chi square of B / prior (27 terms) beyond which the joint did not rest


@dataclass(frozen=True)
class Rest:
    """How still a joint is held while its segment circles.

    Attributes:
        bone: Length of what moves the joint [m].
        share: Standard deviation of the share of the rotation that the bone makes, too.
        stretch: The same for movement along the bone, in bone lengths per radian.
        neck: (share of the rotation, (3,) link in the tracker's frame [m]) of links between what rests and
            the joint, which turn along as a known share.
    """

    bone: float
    share: float
    stretch: float
    neck: tuple[tuple[float, Array], ...] = ()


def find_pivots(
    points: Array,
    turns: Array,
    rotations: Array,
    rate: float,
    axis: Array | None,
    rest: Rest,
    ground: tuple[Array, Array] | None = None,
) -> Estimate:
    """The offset of one tracker, from all windows in which its joint rests.

    Args:
        points: (n, 3) tracker positions [m]; NaN where a frame is lost or should not be looked at.
        turns: (n, 3, 3) smoothed rotation matrices world<-tracker.
        rotations: (n, 3, 3) the nearest rotations.
        rate: Frames per second [Hz].
        axis: (3,) unit vector along the bone that carries the joint, in the tracker's frame; None where it is
            not known.
        rest: How still the joint is held.
        ground: Position (3,) and rotation (3, 3) of the tracker while its foot stands. A standing foot rolls
            about ball and heel, which stay where they are; only a joint that is lifted counts then.
    """
    step = max(1, round(STRIDE * rate))
    lost = np.concatenate([[0], np.cumsum(~np.isfinite(points + turns[:, 0]).all(axis=1))])
    found: list[tuple[int, int, Estimate]] = []
    for size in (round(seconds * rate) for seconds in WINDOWS):
        for start in range(0, len(points) - size + 1, step):
            end = start + size
            if lost[end] == lost[start]:
                window = slice(start, end)
                estimate = fit_pivot(points[window], turns[window], rotations[window], rate, axis, rest)
                if estimate is not None and _lifted(points[window], turns[window], estimate.offset, ground):
                    found.append((start, end, estimate))
    return _agreed(found, round(LEAST * rate))


def _lifted(points: Array, turns: Array, offset: Array, ground: tuple[Array, Array] | None) -> bool:
    """Whether a joint, as it was found, is higher than where it stands."""
    if ground is None:
        return True
    height = (points - turns @ offset)[:, 1].mean() - (ground[0] - ground[1] @ offset)[1]
    return bool(height > LIFTED)


def _agreed(found: list[tuple[int, int, Estimate]], least: int) -> Estimate:
    """Fuse the windows that agree with the one that most agree with; overlapping ones count once.

    Nothing where they cover fewer than ``least`` frames: one window may look like a pivot by chance.
    """
    if not found:
        return Estimate.nothing()
    offsets = np.array([e.offset for *_, e in found])
    covariances = np.array([np.linalg.inv(e.information) for *_, e in found])
    apart = offsets[:, None] - offsets
    both = np.linalg.inv(covariances[:, None] + covariances)
    distance = np.einsum("abi,abij,abj->ab", apart, both, apart)
    weight = 1.0 / np.trace(covariances, axis1=1, axis2=2)
    best = int(np.argmax(np.exp(-0.5 * distance) @ weight * weight))
    chosen = [found[k] for k in np.flatnonzero(distance[best] < AGREED)]
    covered = np.zeros(max(end for _, end, _ in chosen), bool)
    for start, end, _ in chosen:
        covered[start:end] = True
    if covered.sum() < least:
        return Estimate.nothing()
    repeated = sum(end - start for start, end, _ in chosen) / covered.sum()
    fused = Estimate.fuse([estimate for *_, estimate in chosen])
    return Estimate(fused.offset, fused.information / repeated)


def fit_pivot(
    points: Array, turns: Array, rotations: Array, rate: float, axis: Array | None, rest: Rest
) -> Estimate | None:
    """The offset from one window; None where the joint does not rest or the segment does not turn."""
    n, degree = len(points), round(len(points) / (DRIFT * rate))
    mean = Rotation.from_matrix(rotations).mean().as_matrix()
    phi = Rotation.from_matrix(rotations @ mean.T).as_rotvec()
    if np.linalg.eigvalsh(np.cov(phi.T))[1] < WIDE**2:
        return None
    points = points - _bend(phi, mean, rest)
    basis, prior = _bone_basis(None if axis is None else mean @ axis, rest)
    time = np.linspace(-1.0, 1.0, n)
    drift = np.linalg.qr(np.column_stack([time**k for k in range(degree + 1)]))[0]

    def without_drift(a: Array) -> Array:
        return np.asarray(a - np.einsum("nd,md,m...->n...", drift, drift, a))

    pairs = phi[:, [0, 1, 2, 0, 0, 1]] * phi[:, [0, 1, 2, 1, 2, 2]] * PAIRS
    given = without_drift(np.column_stack([phi, pairs]))
    columns = np.concatenate([without_drift(basis @ turns), np.zeros((n, 3, 27))], axis=2)
    for k in range(3):
        columns[:, k, 3 + 9 * k : 12 + 9 * k] = given
    matrix = columns.reshape(-1, 30)
    right = without_drift(points @ basis.T).ravel()
    scale = np.repeat([1.0, CURVED], [3, 6])
    weak = np.concatenate([np.zeros(3), np.outer(prior, scale).ravel() ** -2.0])
    noise = 0.002
    for _ in range(3):
        information = matrix.T @ matrix / noise**2 + np.diag(weak)
        solution = np.linalg.solve(information, matrix.T @ right / noise**2)
        left = (right - matrix @ solution).reshape(n, 3)
        white = np.sqrt(np.sum(left**2) / (3 * (n - degree - 4)))
        noise = max(white, FLOOR_NOISE) * np.sqrt(_correlated(left))
    covariance = np.linalg.inv(information)[:3, :3]
    offset = solution[:3]
    chi = float(np.sum(solution[3:] ** 2 * weak[3:]))
    if white > RESTLESS or np.linalg.norm(offset) > LONGEST or chi > GIVEN_WAY:
        return None
    return Estimate(offset, np.linalg.inv(covariance))


def _correlated(left: Array) -> float:
    """How many neighbouring residuals (n, 3) say the same: 1 + 2 sum of the autocorrelation."""
    total, power = 1.0, float(np.sum(left**2))
    for lag in range(1, len(left) // 3):
        rho = float(np.sum(left[lag:] * left[:-lag])) / max(power, 1e-30)
        if rho < 0.05:
            break
        total += 2.0 * rho
    return total


def _bone_basis(axis: Array | None, rest: Rest) -> tuple[Array, Array]:
    """Rows (3, 3): along the bone and across; and the standard deviation of each row of B [m/rad]."""
    if axis is None:
        return np.eye(3), np.full(3, rest.share * rest.bone)
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    across = np.cross(axis, helper)
    across /= np.linalg.norm(across)
    rows = np.stack([axis, across, np.cross(axis, across)])
    return rows, np.array([rest.stretch, rest.share, rest.share]) * rest.bone


def _bend(phi: Array, mean: Array, rest: Rest) -> Array:
    """(n, 3) how far links that make a share of the rotation carry the joint [m]."""
    moved = np.zeros_like(phi)
    for share, link in rest.neck:
        arm = mean @ link
        moved += Rotation.from_rotvec(share * phi).apply(arm) - arm
    return moved
