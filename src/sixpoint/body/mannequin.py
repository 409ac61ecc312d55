"""A mannequin of a figure: balls that joints carry, and parts that are hulls of a few of them.

Pictures and the viewer draw the same body from it. Joints without a role are left out.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure

Array = NDArray[np.float64]
Side = Literal["left", "right", "trunk"]

HEIGHT = 1.6  # of the figure for which radii are given, see Figure.height [m]


@dataclass(frozen=True, eq=False)
class Part:
    """The hull of some balls.

    Attributes:
        balls: Which ones.
        side: Left, right or in the middle.
    """

    balls: slice
    side: Side


@dataclass(frozen=True, eq=False)
class Mannequin:
    """Balls and the parts they make.

    Attributes:
        joints: (B,) joint that carries each ball.
        offsets: (B, 3) the ball in the joint's frame [m].
        radii: (B,) [m].
        parts: Limbs, trunk, hands, feet and head.
    """

    joints: NDArray[np.int64]
    offsets: Array
    radii: Array
    parts: tuple[Part, ...]

    @classmethod
    def of(cls, figure: Figure, slim: bool = False) -> Mannequin:
        """The body of a figure: with its flesh, or slim so that it can be seen inside one with flesh."""
        return _Builder(figure, 0.55 if slim else 1.0).build(slim)

    def place(self, positions: Array, world: Array) -> Array:
        """Centres of the balls (..., B, 3) [m] of joints in the world: (..., J, 3) [m] and (..., J, 4)."""
        carried = rot.mul_vec(world[..., self.joints, :], self.offsets)
        return np.asarray(positions[..., self.joints, :] + carried)


class _Builder:
    """Collects the parts of a mannequin."""

    def __init__(self, figure: Figure, thin: float) -> None:
        self.figure, self.unit, self.thin = figure, figure.height / HEIGHT, thin
        self.balls: list[tuple[int, Array, float]] = []
        self.parts: list[Part] = []

    def build(self, slim: bool) -> Mannequin:
        r = self.figure.roles
        trunk = [r.pelvis, *r.spine]
        waist, chest = trunk[len(trunk) // 3], trunk[-3 if len(trunk) > 4 else -2]
        self.add("trunk", (trunk[-1], chest), 0.048, 0.055)
        if slim:
            bones = [*pairwise(trunk)]
            for pair, radius in [
                *((pair, 0.05) for pair in bones),
                *(((r.pelvis, hip), 0.045) for hip in r.hip),
                *(((chest, shoulder), 0.045) for shoulder in r.shoulder),
            ]:
                self.add("trunk", pair, radius, radius)
        else:
            self.add("trunk", (*r.hip, waist), 0.088, 0.088, 0.105)
            self.add("trunk", (*r.shoulder, waist, chest), 0.058, 0.058, 0.105, 0.09)
        sides: tuple[Side, Side] = ("left", "right")
        for k, side in enumerate(sides):
            self.add(side, (r.hip[k], r.knee[k]), 0.08, 0.056)
            self.add(side, (r.knee[k], r.ankle[k]), 0.054, 0.037)
            self.add(side, (r.shoulder[k], r.elbow[k]), 0.05, 0.04)
            self.add(side, (r.elbow[k], r.wrist[k]), 0.039, 0.028)
            for end, radius, tip in ((r.ankle[k], 0.036, 0.024), (r.wrist[k], 0.03, 0.022)):
                tips = self.find_tips(end)
                self.add(side, (end, *tips), radius, *[tip] * len(tips))
        self.add_head(0.85 if slim else 1.0)
        joints, offsets, radii = zip(*self.balls, strict=True)
        return Mannequin(np.array(joints), np.array(offsets), np.array(radii), tuple(self.parts))

    def add(self, side: Side, places: Iterable[int | tuple[int, Array]], *radii: float) -> None:
        """A part around joints, or points (joint, offset [m]); radii in units of the figure."""
        start = len(self.balls)
        for place, radius in zip(places, radii, strict=True):
            joint, offset = place if isinstance(place, tuple) else (place, np.zeros(3))
            self.balls.append((joint, offset, radius * self.unit * self.thin))
        self.parts.append(Part(slice(start, len(self.balls)), side))

    def add_head(self, thin: float) -> None:
        r, figure = self.figure.roles, self.figure
        lift = [0, 0.03, 0.01] if np.any(r.head_offset) else [0, 0.065, 0.02]
        upright = rot.inv(figure.neutral[r.head])
        skull = np.asarray(r.head_offset) + rot.mul_vec(upright, np.array(lift) * self.unit)
        below = skull - 0.012 * self.unit * rot.mul_vec(upright, [0, 1, 0])
        self.thin = thin
        self.add("trunk", ((r.head, below), (r.head, skull)), 0.085, 0.095)

    def find_tips(self, joint: int) -> list[tuple[int, Array]]:
        """The farthest joint or site below a joint, and its heel if it has one."""
        sk = self.figure.skeleton
        below = [j for j in range(joint + 1, len(sk)) if sk.path(joint, j)]
        sites = [s for s in range(len(sk.site_names)) if sk.site_parents[s] in (joint, *below)]
        positions, world = self.figure.neutral_pose.compute_transforms()
        marks = sk.compute_sites(positions, world)

        def length(place: Array) -> float:
            return float(np.linalg.norm(place - positions[joint]))

        ends = [((j, np.zeros(3)), length(positions[j])) for j in below]
        ends += [((int(sk.site_parents[s]), sk.site_offsets[s]), length(marks[s])) for s in sites]
        farthest = sorted(ends, key=lambda end: -end[1])[:1]
        heels = [s for s in sites if "heel" in sk.site_names[s].lower()]
        tips = [place for place, far in farthest if far > 0.02]
        return tips + [(int(sk.site_parents[s]), sk.site_offsets[s]) for s in heels]
