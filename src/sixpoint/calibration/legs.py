"""Where the pelvis is, from straight legs: the hip of a straight leg is one leg's length from the ankle.

With straight legs of length L, hips h_i in the pelvis' frame, mount rotation M and offsets o,

    | (p_pelvis - R_pelvis (o_pelvis - M^T h_i)) - (p_foot - R_foot o_foot) | = L

A bow turns the pelvis against the legs, which separates height and depth of its offset from L; swaying
sideways and lifting a leg outwards tell its third component, and so does standing upright, less exactly.
Knees are never straight all the time, so the equation is one-sided: bent legs are short, no leg is too long.
Frames with short legs lose their weight while the estimate improves (graduated non-convexity, Blake &
Zisserman 1987). It needs both ankles: with all three offsets open, bent legs explain any of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.calibration.estimate import Estimate
from sixpoint.calibration.model import Body
from sixpoint.calibration.standing import Standing
from sixpoint.calibration.tracks import Tracks

Array = NDArray[np.float64]

SIGMA = 0.004  # of the equation: knees that are nearly straight [m]
WIDEST, NARROWEST = 0.12, 0.008  # how short a leg may be to count as straight, first and last [m]
STEPS = 24
UNKNOWNS = 11  # three offsets, and by how much each leg is longer than it should be
UNEVEN = 0.005  # of the difference of both legs, as one knee may be less straight than the other [m]
EVERY = 0.2  # time between frames that say something new [s]
ANYWHERE = 0.08  # standard deviation of an offset before anything is known [m]
UPRIGHT = (0.015, 0.05)  # of the middle of the hips over that of the ankles, standing: sideways, forward [m]


@dataclass(frozen=True, eq=False)
class LegFit:
    """What straight legs tell.

    Attributes:
        pelvis: Offset of the pelvis tracker.
        ankles: Offsets of both foot trackers.
        length: Length of a leg, mean of both [m].
        length_std: Its standard deviation [m].
    """

    pelvis: Estimate
    ankles: tuple[Estimate, Estimate]
    length: float
    length_std: float


def fit_legs(
    tracks: Tracks, standing: Standing, mount: Array, ankles: tuple[Estimate, Estimate], body: Body
) -> LegFit | None:
    """Fit pelvis offset and leg length, given what is known of the foot trackers' offsets.

    Args:
        tracks: Six trackers.
        standing: The still pose; its legs are straight.
        mount: (3, 3) rotation pelvis<-tracker.
        ankles: Offsets of the foot trackers, as far as they are known.
        body: Hips and leg lengths.

    Returns:
        The fit; None where pelvis and feet are not seen together for long enough.
    """
    step = max(1, round(EVERY * tracks.rate / 3))  # three neighbours share the weight of one
    seen = np.isfinite(tracks.turns[:, [0, 4, 5]]).all(axis=(1, 2, 3))
    pick = np.flatnonzero(seen)[::step]
    if len(pick) < 10:
        return None
    p, turns = tracks.positions[pick], tracks.turns[pick]
    still = np.isin(pick, standing.frames)
    hips = body.hips @ mount  # in the tracker's frame
    prior_rows, prior_right = _priors(standing, ankles, body, hips)
    x = np.concatenate([np.zeros(3), ankles[0].offset, ankles[1].offset, np.zeros(2)])
    legs = body.legs
    for width in np.geomspace(WIDEST, NARROWEST, STEPS):
        rows, right = [prior_rows], [prior_right - prior_rows @ x]
        for i in (0, 1):
            foot = x[3 + 3 * i : 6 + 3 * i]
            leg = p[:, 0] - turns[:, 0] @ (x[:3] - hips[i]) - p[:, 4 + i] + turns[:, 4 + i] @ foot
            length = np.linalg.norm(leg, axis=1)
            along = leg / length[:, None]
            excess = length - legs[i] - x[9 + i]
            jacobian = np.zeros((len(p), UNKNOWNS))
            jacobian[:, :3] = -np.einsum("nij,ni->nj", turns[:, 0], along)
            jacobian[:, 3 + 3 * i : 6 + 3 * i] = np.einsum("nij,ni->nj", turns[:, 4 + i], along)
            jacobian[:, 9 + i] = -1.0
            short = np.where(still, 0.0, np.minimum(excess, 0.0))
            weight = 1.0 / (1.0 + (short / width) ** 2) / (SIGMA * np.sqrt(3.0))
            rows.append(jacobian * weight[:, None])
            right.append(-excess * weight)
        matrix = np.concatenate(rows)
        x = x + np.linalg.lstsq(matrix, np.concatenate(right), rcond=None)[0]
    covariance: Array = np.asarray(np.linalg.inv(matrix.T @ matrix), float)
    feet = [
        Estimate(x[s], np.asarray(np.linalg.inv(covariance[s, s]), float)) for s in (slice(3, 6), slice(6, 9))
    ]
    return LegFit(
        Estimate(x[:3], np.asarray(np.linalg.inv(covariance[:3, :3]), float)).blurred(body.hip_std),
        (feet[0], feet[1]),
        float(legs.mean() + x[9:].mean()),
        float(np.sqrt(covariance[9:, 9:].mean())),
    )


def _priors(
    standing: Standing, ankles: tuple[Estimate, Estimate], body: Body, hips: Array
) -> tuple[Array, Array]:
    """Whitened rows (m, 11) and right side (m,) of what is known before the legs move."""
    rows, right = [], []

    def add(row: Array, value: Array, std: float) -> None:
        rows.append(np.atleast_2d(row) / std)
        right.append(np.atleast_1d(value) / std)

    eye = np.eye(UNKNOWNS)
    add(eye[:9], np.zeros(9), ANYWHERE)
    add(eye[9:].mean(axis=0), np.zeros(1), body.leg_std)
    add(eye[9] - eye[10], np.zeros(1), UNEVEN)
    for i, ankle in enumerate(ankles):
        values, vectors = np.linalg.eigh(ankle.information)
        root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
        row = np.zeros((3, UNKNOWNS))
        row[:, 3 + 3 * i : 6 + 3 * i] = root
        add(row, root @ ankle.offset, 1.0)
    p, turns = standing.positions, standing.turns
    for axis, std in zip((standing.heading[:, 0], standing.heading[:, 2]), UPRIGHT, strict=True):
        row = np.zeros((1, UNKNOWNS))
        row[0, :3] = axis @ turns[0]
        row[0, 3:6], row[0, 6:9] = -0.5 * axis @ turns[4], -0.5 * axis @ turns[5]
        middle = p[0] + turns[0] @ hips.mean(axis=0) - 0.5 * (p[4] + p[5])
        add(row, np.array([axis @ middle]), std)
    return np.concatenate(rows), np.concatenate(right)
