"""Seeded movements of the legs, for ``collision.py`` and its test: sitting, squatting, legs crossed.

The trunk sways; each leg goes from one pose within its limits to the next in half a second.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from reaches import RATE, STEP, WAY, is_within
from scipy.spatial.transform import Rotation

import sixpoint as sp

Array = NDArray[np.float64]

THIGHS, SHANKS = 0.15, 0.10  # m, between the axes of thighs, and of whatever else, at least
NEAREST, FARTHEST = 0.045, 0.12  # m, of wrists from the flesh of thighs
ARM, TRUNK = 0.03, 0.21  # m, of the arms' bones from thighs, and of elbows from the middle, at least
WIDTHS = (0.095, 0.06)  # m, of a thigh at hip and knee
SHARES = np.linspace(0.0, 1.0, 9)
KINDS = ("sitting", "squatting", "crossed")
POSTURES = ("standing", "sitting", "squatting")  # in which hands are near the thighs


class Limb:
    """An arm or leg of a figure at rest: a ball joint, a hinge, and their limits."""

    def __init__(self, figure: sp.Figure, joints: tuple[int, int, int], spread: float) -> None:
        root, middle, end = joints
        self.root, self.spread = figure.rest_positions[root], spread
        self.limit, self.hinge = figure.dofs[root].limit, figure.dofs[middle]
        self.upper = float(np.linalg.norm(figure.offset_between(root, middle)))
        self.lower = float(np.linalg.norm(figure.offset_between(middle, end)))

    def draw(self, rng: np.random.Generator) -> tuple[Rotation, float]:
        """Rotation of the ball joint, swung to the front give or take ``spread``, and bend of the hinge."""
        limit, hinge = self.limit, self.hinge
        theta = rng.uniform(-self.spread, self.spread)
        psi = float(limit.compute_limit(theta)) * np.sqrt(rng.uniform())
        lean = np.cos(theta) * limit.forward + np.sin(theta) * limit.side
        turn = Rotation.from_rotvec(psi * np.cross(limit.axis, lean))
        turn *= Rotation.from_rotvec(rng.uniform(*limit.twist) * limit.axis)
        return turn, rng.uniform(hinge.lower[0], hinge.upper[0])

    def go(self, a: tuple[Rotation, float], b: tuple[Rotation, float], n: int) -> tuple[Rotation, Array]:
        """The first n frames of the way from one pose to another."""
        turn = (a[0].inv() * b[0]).as_rotvec()
        return a[0] * Rotation.from_rotvec(WAY[:n, None] * turn), a[1] + WAY[:n] * (b[1] - a[1])

    def follow(self, turns: Rotation, bends: Array | float) -> tuple[Array, Array]:
        """Places of middle joint and end [m]."""
        middle = self.root + turns.apply([0.0, -self.upper, 0.0])
        below = turns * Rotation.from_rotvec(np.multiply.outer(bends, self.hinge.axes[0]))
        return middle, middle + below.apply([0.0, -self.lower, 0.0])

    def is_within(self, turns: Rotation) -> bool:
        """Whether limits allow all rotations of the ball joint."""
        return all(is_within(self.limit, q) for q in turns)


def distance(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Least distance of the lines a-b and c-d (n, 3), by points on them [m]; ``a`` is left out a little."""
    p = a[:, None] + SHARES[:, None] * (b - a)[:, None]
    q = c[:, None] + SHARES[:, None] * (d - c)[:, None]
    off = np.linalg.norm(p[:, 2:, None] - q[:, None, 2:], axis=-1)
    return np.asarray(off.min(axis=(1, 2)))


def are_clear(knees: Array, ankles: Array, hips: Array) -> bool:
    """Whether legs (2, n, 3) are beside each other in all of n poses."""
    hip = [np.broadcast_to(h, knees[0].shape) for h in hips]
    thighs = distance(hip[0], knees[0], hip[1], knees[1])
    others = [
        distance(knees[0], ankles[0], knees[1], ankles[1]),
        distance(hip[0], knees[0], knees[1], ankles[1]),
        distance(knees[0], ankles[0], hip[1], knees[1]),
    ]
    return bool(thighs.min() > THIGHS and np.min(others) > SHANKS)


def is_of(kind: str, knees: Array, ankles: Array, hips: Array) -> bool:
    """Whether a pose (2, 3) is what its kind says."""
    thigh = knees - hips
    raised = thigh[:, 1] / np.linalg.norm(thigh, axis=1)
    if kind == "standing":
        return bool((raised < -0.9).all() and (ankles[:, 1] < knees[:, 1] - 0.35).all())
    if kind == "squatting":  # heels under the seat
        return bool((raised > -0.7).all() and (np.abs(ankles[:, 2] - hips[:, 2]) < 0.2).all())
    if kind == "sitting":
        return bool((np.abs(raised) < 0.5).all() and (ankles[:, 1] < knees[:, 1] - 0.25).all())
    return bool((raised < 0.5).all() and ankles[0, 0] < ankles[1, 0] and (ankles[:, 1] < knees[:, 1]).all())


def draw_legs(figure: sp.Figure, rng: np.random.Generator, frames: int, kind: str) -> tuple[Array, ...]:
    """Hips (2, 3), knees and ankles (2, F, 3) of legs within their limits and out of each other [m]."""
    roles, rest = figure.roles, figure.rest_positions
    hips = rest[list(roles.hip)]
    legs = [Limb(figure, (roles.hip[k], roles.knee[k], roles.ankle[k]), 0.6) for k in range(2)]
    ankles = np.zeros((2, (frames // STEP + 1) * STEP, 3))
    knees, here = np.zeros_like(ankles), None
    for first in range(0, ankles.shape[1], STEP):
        while True:
            there = [leg.draw(rng) for leg in legs]
            ends = np.array([leg.follow(*pose) for leg, pose in zip(legs, there, strict=True)])
            if not is_of(kind, ends[:, 0], ends[:, 1], hips):
                continue
            if not are_clear(ends[:, 0][:, None], ends[:, 1][:, None], hips):
                continue
            ways = [leg.go(a, b, STEP) for leg, a, b in zip(legs, here or there, there, strict=True)]
            way = np.array([leg.follow(*w) for leg, w in zip(legs, ways, strict=True)])
            within = all(leg.is_within(w[0]) for leg, w in zip(legs, ways, strict=True))
            if within and are_clear(way[:, 0], way[:, 1], hips):
                knees[:, first : first + STEP], ankles[:, first : first + STEP] = way[:, 0], way[:, 1]
                here = there
                break
    return hips, knees[:, :frames], ankles[:, :frames]


def move_legs(figure: sp.Figure, seed: int, frames: int, kind: str) -> sp.Targets:
    """The points of a body that moves its legs, hands held away."""
    rng, rest = np.random.default_rng(seed), figure.rest_positions
    _, _, ankles = draw_legs(figure, rng, frames, kind)
    wrists = rest[list(figure.roles.wrist)] + np.array([[0.25, 0.3, 0.2], [-0.25, 0.3, 0.2]])
    return build(figure, rng, np.repeat(wrists[:, None], frames, axis=1), ankles, 0.1, f"{kind} {seed}")


def build(
    figure: sp.Figure, rng: np.random.Generator, wrists: Array, ankles: Array, sway: float, name: str
) -> sp.Targets:
    """Six points of a trunk that sways by so much [rad], wrists on it and ankles (2, F, 3) [m]."""
    roles, rest, frames = figure.roles, figure.rest_positions, ankles.shape[1]
    points = np.zeros((frames, 6, 3))
    points[:, 0], points[:, 1] = rest[roles.pelvis], rest[roles.head] + figure.head_offset
    points[:, 2:4], points[:, 4:] = wrists.transpose(1, 0, 2), ankles.transpose(1, 0, 2)
    t = np.arange(frames) / STEP
    lean = sway * np.sin(t[:, None] * rng.uniform(0.5, 1.5, 3) + rng.uniform(0.0, 6.0, 3))
    turns = Rotation.from_euler("xyz", lean).as_matrix()
    points[:, 1:4] = np.einsum("fij,fkj->fki", turns, points[:, 1:4])
    return sp.Targets(points, RATE, name=name)


def rest_hands(figure: sp.Figure, seed: int, frames: int, kind: str) -> sp.Targets:
    """The points of a body whose hands hang or lie near its thighs and go from place to place.

    Arms are within their limits; elbow, forearm and hand stay out of its thighs, the trunk is still.
    """
    rng, roles = np.random.default_rng(seed), figure.roles
    hips, knees, ankles = draw_legs(figure, rng, frames, kind)
    wrists = np.zeros((2, frames, 3))
    for side in range(2):
        arm = Limb(figure, (roles.shoulder[side], roles.elbow[side], roles.wrist[side]), np.pi)

        def gap(points: Array, part: slice, knees: Array = knees) -> Array:
            """Of points (n, m, 3) from both thighs in frames of a part (n, m)."""
            found = []
            for hip, knee in zip(hips, knees[:, part], strict=True):
                line = knee - hip
                t = np.einsum("nmi,ni->nm", points - hip, line) / np.sum(line * line, axis=1)[:, None]
                t = np.clip(t, 0.0, 1.0)[..., None]
                off = np.linalg.norm(points - hip - t * line[:, None], axis=-1)
                found.append(off - (WIDTHS[0] + t[..., 0] * (WIDTHS[1] - WIDTHS[0])))
            return np.asarray(np.min(found, axis=0))

        here = None
        for first in range(0, frames, STEP):
            part = slice(first, min(first + STEP, frames))
            for _ in range(20000):
                there = arm.draw(rng)
                _, wrist = arm.follow(*there)
                end = gap(wrist[None, None], slice(part.stop - 1, part.stop))[0, 0]
                if not NEAREST < end < FARTHEST or wrist[1] > hips[0, 1] + 0.1:
                    continue
                way = arm.go(here or there, there, part.stop - first)
                elbows, path = arm.follow(*way)
                places = np.stack([elbows, 0.5 * (elbows + path), path, 1.3 * path - 0.3 * elbows], axis=1)
                beside = np.abs(elbows[:, 0]) > TRUNK
                if gap(places, part).min() > ARM and beside.all() and arm.is_within(way[0]):
                    wrists[side, part], here = path, there
                    break
            else:
                raise RuntimeError(f"no way for a hand in {kind} {seed}")
    return build(figure, rng, wrists, ankles, 0.0, f"hands, {kind} {seed}")
