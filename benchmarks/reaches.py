"""Seeded movements of the hands about the trunk, for ``collision.py`` and its test.

The figure stands and sways; each wrist goes from one place near the trunk to the next in half a second.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import sixpoint as sp
from sixpoint.body.dofs import SwingTwist

Array = NDArray[np.float64]

RATE = 60.0
STEP = 30  # frames from place to place
DEPTH = 0.11  # m, half depth of the cylinder; its half width is 0.8 of the shoulders'
NEAREST, FARTHEST = 0.04, 0.14  # m, of wrists from the cylinder
ELBOW = 0.06  # m, of elbows, at least


class Cylinder:
    """An elliptic cylinder about as wide and deep as the trunk in the neutral pose."""

    def __init__(self, figure: sp.Figure) -> None:
        rest, roles = figure.rest_positions, figure.roles
        self.shoulders, hips = rest[list(roles.shoulder)], rest[list(roles.hip)]
        self.low, self.high = hips[:, 1].mean() + 0.05, self.shoulders[:, 1].mean() + 0.02
        self.radii = np.array([0.8 * abs(self.shoulders[0, 0]), DEPTH])
        self.middle = 0.5 * (hips.mean(axis=0) + self.shoulders.mean(axis=0))
        self.upper = float(np.linalg.norm(figure.offset_between(roles.shoulder[0], roles.elbow[0])))
        self.lower = float(np.linalg.norm(figure.offset_between(roles.elbow[0], roles.wrist[0])))

    def is_clear(self, points: Array, gap: float) -> bool:
        """Whether points (n, 3) are so far from the cylinder, or above it [m]."""
        fast = np.hypot(*((points - self.middle)[:, [0, 2]] / (self.radii + gap)).T) > 1.0  # nearly the same
        return bool(np.all(fast | (points[:, 1] > self.high + gap)))

    def place(self, knots: Array) -> Array:
        """Angle from the front to the left [rad], height [m] and distance [m] (..., 3) -> points (..., 3)."""
        angle, height, gap = np.moveaxis(knots, -1, 0)
        out = np.stack([np.sin(angle), np.cos(angle)], axis=-1)
        flat = out * (self.radii + gap[..., None])
        return np.stack([self.middle[0] + flat[..., 0], height, self.middle[2] + flat[..., 1]], axis=-1)

    def find(self, point: Array) -> Array:
        """Angle, height and distance (3,) of a point; the distance is negative inside."""
        flat = (point - self.middle)[[0, 2]]
        gap = 0.0
        for _ in range(30):  # the ellipse grown by the distance goes through the point
            excess = np.hypot(*(flat / (self.radii + gap))) - 1.0
            gap = max(gap + 0.5 * excess * self.radii.min(), -0.9 * self.radii.min())
        angle = np.arctan2(*(flat / (self.radii + gap)))
        return np.array([angle, point[1], gap])


def reach_across(figure: sp.Figure, seed: int, frames: int) -> sp.Targets:
    """The points of a body whose arms stay within their limits and out of its trunk.

    Shoulders and elbows are drawn from their limits until the wrist is near the trunk, and turn evenly from
    one drawn pose to the next; a way on which elbow or wrist comes too near is not taken. It begins standing,
    arms a little out: with hands behind its back first, a body may be taken for one that is turned round.
    """
    cylinder, rng = Cylinder(figure), np.random.default_rng(seed)
    roles, count = figure.roles, frames // STEP + 2
    wrists = np.zeros((2, (count - 1) * STEP, 3))
    for side in range(2):
        limit = figure.dofs[roles.shoulder[side]].limit
        hinge = figure.dofs[roles.elbow[side]]

        def draw(limit=limit, hinge=hinge) -> tuple[Rotation, float]:
            theta = rng.uniform(-np.pi, np.pi)
            psi = float(limit.compute_limit(theta)) * np.sqrt(rng.uniform())
            lean = np.cos(theta) * limit.forward + np.sin(theta) * limit.side
            turn = Rotation.from_rotvec(psi * np.cross(limit.axis, lean))
            turn *= Rotation.from_rotvec(rng.uniform(*limit.twist) * limit.axis)
            return turn, rng.uniform(hinge.lower[0], hinge.upper[0])

        def follow(turns: Rotation, bends: Array, side=side, hinge=hinge) -> tuple[Array, Array]:
            elbow = cylinder.shoulders[side] + turns.apply([0.0, -cylinder.upper, 0.0])
            hand = turns * Rotation.from_rotvec(np.multiply.outer(bends, hinge.axes[0]))
            return elbow, elbow + hand.apply([0.0, -cylinder.lower, 0.0])

        out, fold = (1.0 if side == 0 else -1.0), np.clip(-0.4, hinge.lower[0], hinge.upper[0])
        here = (Rotation.from_rotvec([0.0, 0.0, 0.3 * out]), float(fold))
        for k in range(1, count):
            while True:
                there = draw()
                elbow, wrist = follow(there[0], np.asarray(there[1]))
                knot = cylinder.find(wrist)
                near = NEAREST < knot[2] < FARTHEST and cylinder.low < wrist[1] < cylinder.high
                if not near or not cylinder.is_clear(elbow[None], ELBOW):
                    continue
                turn = (here[0].inv() * there[0]).as_rotvec()
                turns = here[0] * Rotation.from_rotvec(WAY[:, None] * turn)
                elbows, path = follow(turns, here[1] + WAY * (there[1] - here[1]))
                clear = cylinder.is_clear(elbows, ELBOW) and cylinder.is_clear(path, 0.8 * NEAREST)
                if clear and all(is_within(limit, q) for q in turns):
                    wrists[side, (k - 1) * STEP : k * STEP] = path
                    break
            here = there
    return build(figure, wrists[:, :frames], rng, f"reaches {seed}")


def smooth(t: Array) -> Array:
    """From 0 to 1 with rest at both ends."""
    return t**3 * (10.0 - 15.0 * t + 6.0 * t**2)


WAY = smooth(np.arange(STEP) / STEP)


def is_within(limit: SwingTwist, turn: Rotation) -> bool:
    """Whether a rotation is within limits of swing and twist, told by SciPy alone."""
    x, y, z, w = turn.as_quat()
    twist = 2.0 * np.arctan2(np.dot([x, y, z], limit.axis), w)
    twist = (twist + np.pi) % (2.0 * np.pi) - np.pi
    lean = turn.apply(np.array(limit.axis))
    psi = np.arccos(np.clip(lean @ limit.axis, -1.0, 1.0))
    theta = np.arctan2(lean @ limit.side, lean @ limit.forward)
    fits = psi <= limit.compute_limit(theta) + 1e-6
    return bool(fits and limit.twist[0] - 1e-6 <= twist <= limit.twist[1] + 1e-6)


def wander_around(figure: sp.Figure, seed: int, frames: int) -> sp.Targets:
    """Places from across the chest to the small of the back at even odds, whether limits allow them or not.

    Between them a wrist's angle, height and distance from the cylinder change smoothly.
    """
    cylinder, rng = Cylinder(figure), np.random.default_rng(seed)

    def draw(side: int) -> Array:
        sign = 1.0 if side == 0 else -1.0
        while True:
            height, gap = rng.uniform(cylinder.low, cylinder.high), rng.uniform(NEAREST, FARTHEST)
            knot = np.array([sign * rng.uniform(-1.4, 2.8), height, gap])
            reach = np.linalg.norm(cylinder.place(knot) - cylinder.shoulders[side])
            if reach < 0.97 * (cylinder.upper + cylinder.lower):
                return knot

    t = np.arange(frames) / STEP
    first, share = t.astype(int), smooth(t % 1.0)[:, None]
    wrists = np.zeros((2, frames, 3))
    for side in range(2):
        knots = np.array([draw(side) for _ in range(first[-1] + 2)])
        wrists[side] = cylinder.place(knots[first] + share * (knots[first + 1] - knots[first]))
    return build(figure, wrists, rng, f"wandering {seed}")


def build(figure: sp.Figure, wrists: Array, rng: np.random.Generator, name: str) -> sp.Targets:
    """Six points of a standing figure with wrists (2, F, 3) [m] beside its neutral trunk, which sways."""
    rest, roles = figure.rest_positions, figure.roles
    frames = wrists.shape[1]
    points = np.zeros((frames, 6, 3))
    points[:, 0] = rest[roles.pelvis]
    points[:, 1] = rest[roles.head] + figure.head_offset
    points[:, 2:4] = wrists.transpose(1, 0, 2)
    points[:, 4:] = rest[list(roles.ankle)]
    t = np.arange(frames) / STEP
    lean = 0.15 * np.sin(t[:, None] * rng.uniform(0.5, 1.5, 3) + rng.uniform(0.0, 6.0, 3))
    turns = Rotation.from_euler("xyz", lean).as_matrix()
    points[:, 1:4] = np.einsum("fij,fkj->fki", turns, points[:, 1:4])
    return sp.Targets(points, RATE, name=name)
