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
SHARES = np.linspace(0.0, 1.0, 9)
KINDS = ("sitting", "squatting", "crossed")


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
    if kind == "squatting":  # heels under the seat
        return bool((raised > -0.7).all() and (np.abs(ankles[:, 2] - hips[:, 2]) < 0.2).all())
    if kind == "sitting":
        return bool((np.abs(raised) < 0.5).all() and (ankles[:, 1] < knees[:, 1] - 0.25).all())
    return bool((raised < 0.5).all() and ankles[0, 0] < ankles[1, 0] and (ankles[:, 1] < knees[:, 1]).all())


def move_legs(figure: sp.Figure, seed: int, frames: int, kind: str) -> sp.Targets:
    """The points of a body whose legs stay within their limits and out of each other."""
    rng, roles, rest = np.random.default_rng(seed), figure.roles, figure.rest_positions
    hips = rest[list(roles.hip)]
    upper = float(np.linalg.norm(figure.offset_between(roles.hip[0], roles.knee[0])))
    lower = float(np.linalg.norm(figure.offset_between(roles.knee[0], roles.ankle[0])))
    limits = [figure.dofs[j].limit for j in roles.hip]
    hinges = [figure.dofs[j] for j in roles.knee]

    def draw(side: int) -> tuple[Rotation, float]:
        limit, hinge = limits[side], hinges[side]
        theta = rng.uniform(-0.6, 0.6)
        psi = float(limit.compute_limit(theta)) * rng.uniform(0.1, 1.0)
        lean = np.cos(theta) * limit.forward + np.sin(theta) * limit.side
        turn = Rotation.from_rotvec(psi * np.cross(limit.axis, lean))
        turn *= Rotation.from_rotvec(rng.uniform(*limit.twist) * limit.axis)
        return turn, rng.uniform(hinge.lower[0], hinge.upper[0])

    def follow(side: int, turns: Rotation, bends: Array) -> tuple[Array, Array]:
        knee = hips[side] + turns.apply([0.0, -upper, 0.0])
        shank = turns * Rotation.from_rotvec(np.multiply.outer(bends, hinges[side].axes[0]))
        return knee, knee + shank.apply([0.0, -lower, 0.0])

    ankles, here = np.zeros((2, (frames // STEP + 1) * STEP, 3)), None
    for first in range(0, ankles.shape[1], STEP):
        while True:
            there = [draw(side) for side in range(2)]
            ends = np.array([follow(k, turn, np.asarray(bend)) for k, (turn, bend) in enumerate(there)])
            if not is_of(kind, ends[:, 0], ends[:, 1], hips):
                continue
            if not are_clear(ends[:, 0][:, None], ends[:, 1][:, None], hips):
                continue
            start = here or there
            turns = [
                s[0] * Rotation.from_rotvec(WAY[:, None] * (s[0].inv() * t[0]).as_rotvec())
                for s, t in zip(start, there, strict=True)
            ]
            bends = [s[1] + WAY * (t[1] - s[1]) for s, t in zip(start, there, strict=True)]
            way = np.array([follow(k, turns[k], bends[k]) for k in range(2)])
            within = all(is_within(limits[k], q) for k in range(2) for q in turns[k])
            if within and are_clear(way[:, 0], way[:, 1], hips):
                ankles[:, first : first + STEP] = way[:, 1]
                here = there
                break
    points = np.zeros((frames, 6, 3))
    points[:, 0], points[:, 1] = rest[roles.pelvis], rest[roles.head] + figure.head_offset
    points[:, 2:4] = rest[list(roles.wrist)] + np.array([[0.25, 0.3, 0.2], [-0.25, 0.3, 0.2]])
    t = np.arange(frames) / STEP
    lean = 0.1 * np.sin(t[:, None] * rng.uniform(0.5, 1.5, 3) + rng.uniform(0.0, 6.0, 3))
    turns = Rotation.from_euler("xyz", lean).as_matrix()
    points[:, 1:4] = np.einsum("fij,fkj->fki", turns, points[:, 1:4])
    points[:, 4:] = ankles[:, :frames].transpose(1, 0, 2)
    return sp.Targets(points, RATE, name=f"{kind} {seed}")
