"""Parts of a figure's surface are collected here, with the weights of their vertices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.surface.loft import Loft
from sixpoint.body.surface.shape import Shape

Array = NDArray[np.float64]

CARRIERS = 4
"""Most joints of a vertex, as glTF and game engines have it."""


class Flesh:
    """Collects the parts of one figure's surface.

    Attributes:
        figure: Whose.
        positions: (J, 3) its joints in the neutral pose, the pelvis at the origin [m].
        stature: The figure's, from its segments [m]; the unit of all sizes.
    """

    def __init__(self, figure: Figure, positions: Array, stature: float) -> None:
        self.figure, self.positions, self.stature = figure, positions, stature
        self._parts: list[tuple[str, Loft, Array]] = []

    def add(self, name: str, part: Loft, weights: Array) -> None:
        """A piece of a part and the weights (V, J) of its vertices; pieces of a part follow each other."""
        self._parts.append((name, part, weights))

    def add_rigid(self, name: str, part: Loft, joint: int) -> None:
        """A piece that one joint carries."""
        weights = np.zeros((len(part.vertices), len(self.figure.skeleton)))
        weights[:, joint] = 1.0
        self.add(name, part, weights)

    def finish(self, positions: Array, world: Array) -> Shape:
        """All pieces as one shape, bound to the pose of joints (J, 3) [m] and (J, 4)."""
        vertices, triangles, weights = [], [], []
        parts: dict[str, slice] = {}
        count = faces = 0
        for name, part, own in self._parts:
            vertices.append(part.vertices)
            triangles.append(part.triangles + count)
            weights.append(own)
            start = parts[name].start if name in parts else faces
            count, faces = count + len(part.vertices), faces + len(part.triangles)
            parts[name] = slice(start, faces)
        full = np.concatenate(weights)
        joints = np.argsort(-full, axis=1, kind="stable")[:, :CARRIERS]
        kept = np.take_along_axis(full, joints, axis=1)
        kept = kept / kept.sum(axis=1, keepdims=True)
        joints = np.where(kept > 0.0, joints, joints[:, :1])
        return Shape(
            np.concatenate(vertices),
            np.concatenate(triangles),
            joints,
            kept,
            positions,
            world,
            name=self.figure.name,
            parts=parts,
        )

    def find_crown(self, above_joint: float, above_site: float) -> Array:
        """Top of the head (3,): a site above the head joint, or as far above it as a head is high."""
        figure, sk = self.figure, self.figure.skeleton
        head = self.positions[figure.roles.head]
        if np.any(figure.roles.head_offset):
            return np.asarray(head + figure.head_offset + np.array([0.0, above_site * self.stature, 0.0]))
        sites = [s for s in range(len(sk.site_names)) if sk.site_parents[s] == figure.roles.head]
        offsets = rot.mul_vec(figure.neutral[figure.roles.head], sk.site_offsets[sites])
        heights = offsets[:, 1].max(initial=0.0) / self.stature
        high = heights if 0.06 < heights < 0.16 else above_joint
        return np.asarray(head + np.array([0.0, high * self.stature, 0.0]))

    def points_below(self, joint: int) -> Array:
        """(n, 3) joints and sites below a joint, itself included, seen from it in the neutral pose [m]."""
        sk, figure = self.figure.skeleton, self.figure
        below = sk.subtree(joint)
        sites = np.flatnonzero(np.isin(sk.site_parents, below))
        carriers = sk.site_parents[sites]
        marks = self.positions[carriers] + rot.mul_vec(figure.neutral[carriers], sk.site_offsets[sites])
        return np.asarray(np.concatenate([self.positions[below], marks]) - self.positions[joint])


def smooth_step(x: ArrayLike) -> Array:
    """From 0 at 0 to 1 at 1, flat at both and beyond."""
    share = np.clip(np.asarray(x, float), 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))


def weigh_along(
    flesh: Flesh, places: Array, joints: Sequence[int], borders: Sequence[float], windows: Sequence[float]
) -> Array:
    """Weights (V, J) of vertices along a chain of joints.

    Args:
        flesh: Whose.
        places: (V,) coordinate of each vertex.
        joints: n joints of the chain, in the order of the coordinate.
        borders: n - 1 places where the next joint takes over, not decreasing.
        windows: n - 1 distances before and behind a border within which both carry.
    """
    weights = np.zeros((len(places), len(flesh.figure.skeleton)))
    passed = np.ones(len(places))
    for joint, border, window in zip(joints, borders, windows, strict=False):
        beyond = np.minimum(smooth_step(0.5 * (places - border) / window + 0.5), passed)
        weights[:, joint] += passed - beyond
        passed = beyond
    weights[:, joints[-1]] += passed
    return weights


def frames_along(centres: Array, sign: float) -> tuple[Array, Array]:
    """Directions (R, 3) outward and forward across a line that hangs down, one pair per point.

    Args:
        centres: (R, 3) points of the line.
        sign: 1 for the left side, -1 for the right.
    """
    down = rot.unit(np.gradient(centres, axis=0))
    outward = np.array([sign, 0.0, 0.0]) - sign * down[:, :1] * down
    outward = rot.unit(outward)
    forward = sign * np.cross(outward, -down)
    return outward, np.asarray(forward * np.sign(forward[:, 2:] + 1e-12))
