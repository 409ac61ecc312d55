"""The still standing pose: what it tells about heading, mount rotations and posture.

In the neutral pose all anatomical frames agree with each other: X left, Y up, Z where the person looks. So a
tracker's mount rotation is the turn from that frame to what the tracker reports; it is as exact as the
person stands, a few degrees. In a T-pose the hands are turned by a quarter about Z, palms down.
Up is the world's; left comes from the wrists and ankles, so the heading needs no rotations.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sixpoint.calibration.tracks import Tracks
from sixpoint.signals.differences import compute_velocity

Array = NDArray[np.float64]
Posture = Literal["neutral", "t"]

UP = np.array([0.0, 1.0, 0.0])
STILL = 0.08  # fastest tracker in a still pose [m/s]
TURNING = 0.5  # fastest rotation in a still pose [rad/s]
LOW = 0.06  # both foot trackers are this near to their lowest place [m]
LASTING = 0.5  # a pose is held so long [s]
SPAN = 0.65  # wrist to wrist over ankle to head, between hanging (0.3) and stretched arms (1.0)
UPRIGHT = 0.8  # height of the head over the ankles, over their distance
TALL = 0.85  # of the greatest height of the head over the ankles


@dataclass(frozen=True, eq=False)
class Standing:
    """A still standing pose.

    Attributes:
        frames: (m,) indices into the tracks.
        posture: "neutral", arms hanging, or "t", arms stretched to the sides with the palms down.
        positions: (6, 3) mean tracker positions [m].
        turns: (6, 3, 3) mean tracker rotations; NaN where there are none.
        heading: (3, 3) world<-person: columns left, up, forward.
    """

    frames: NDArray[np.int64]
    posture: Posture
    positions: Array
    turns: Array
    heading: Array

    @property
    def mounts(self) -> Array:
        """(6, 3, 3) rotation segment<-tracker of each tracker; NaN where it has no rotations."""
        segments = np.repeat(self.heading[None], 6, axis=0)
        if self.posture == "t":
            for k, angle in ((2, 90.0), (3, -90.0)):
                segments[k] = self.heading @ Rotation.from_euler("z", angle, degrees=True).as_matrix()
        return np.asarray(np.swapaxes(segments, 1, 2) @ self.turns)


def find_standing(tracks: Tracks, posture: Posture | None = None) -> Standing | None:
    """The longest still upright pose of a recording, the first of equals; None without any.

    Args:
        tracks: Six trackers.
        posture: What the person was told; by default it is told from the span of the wrists.
    """
    p = tracks.positions
    speed = np.linalg.norm(compute_velocity(p, tracks.rate, 0.05), axis=-1).max(axis=1)
    trunk = p[:, 1] - p[:, 4:].mean(axis=1)
    tall = np.nanmax(trunk[:, 1], initial=0.0)
    good = (speed < STILL) & (trunk[:, 1] > UPRIGHT * np.linalg.norm(trunk, axis=1))
    good &= trunk[:, 1] > TALL * tall
    feet = p[:, 4:, 1]
    lowest = np.nanmin(feet, axis=0) if np.isfinite(feet).any(axis=0).all() else np.full(2, np.nan)
    good &= (feet < lowest + LOW).all(axis=1)
    turning = np.linalg.norm(compute_velocity(tracks.turns, tracks.rate, 0.05), axis=(-2, -1)) / np.sqrt(2.0)
    good &= ~(turning > TURNING).any(axis=1)  # NaN, without rotations, does not turn
    start, length = _longest_run(good)
    if length < LASTING * tracks.rate:
        return None
    frames = np.arange(start, start + length)
    inner = frames[length // 10 : length - length // 10]
    positions = p[inner].mean(axis=0)
    known = np.isfinite(tracks.turns[inner]).all(axis=(0, 2, 3))
    turns = np.full((6, 3, 3), np.nan)
    turns[known] = Rotation.from_matrix(tracks.turns[inner].mean(axis=0)[known]).as_matrix()
    if posture is None:
        span = np.linalg.norm(positions[2] - positions[3])
        posture = "t" if span > SPAN * (positions[1] - positions[4:].mean(axis=0))[1] else "neutral"
    return Standing(inner, posture, positions, turns, compute_heading(positions))


def compute_heading(points: Array) -> Array:
    """(3, 3) world<-person of six standing points (6, 3): up is up, left where left wrist and ankle are."""
    left = (points[2] - points[3]) + (points[4] - points[5])
    left = left - (left @ UP) * UP
    left /= max(float(np.linalg.norm(left)), 1e-9)
    return np.column_stack([left, UP, np.cross(left, UP)])


def _longest_run(flags: NDArray[np.bool_]) -> tuple[int, int]:
    """Start and length of the first longest run of set flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    if not len(edges):
        return 0, 0
    lengths = edges[1::2] - edges[::2]
    best = int(np.argmax(lengths))
    return int(edges[2 * best]), int(lengths[best])
