"""How unlike a human a set of trackers is, if they are given certain roles.

A sum of squared deviations over their spread, in lengths of the stature, which is tried on a grid: lengths
of trunk, arms and legs, what is left and what is right, what is low, and that hands and knees are rather
before the body than behind. Spreads allow for trackers some centimetres off their joints, and for any pose
that a person may take who was asked to stand or sit still.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.anthropometry import segments_of_stature

Array = NDArray[np.float64]

UP = np.array([0.0, 1.0, 0.0])
STATURES = np.arange(1.0, 2.21, 0.1)
MEAN, SPREAD = 1.65, 0.5  # of statures [m]
LENGTH = segments_of_stature(1.0)
TRUNK = (
    LENGTH["torso_length"] + LENGTH["neck"] + 0.02
)  # pelvis to head, whose tracker is rather above its joint
ARM, LEG = LENGTH["upper_arm"] + LENGTH["forearm"], LENGTH["thigh"] + LENGTH["calf"]
SHOULDER, CHEST = 0.72, 0.75  # places on the line from pelvis to head
SIDES = (("l", 1.0), ("r", -1.0))


@dataclass(frozen=True, eq=False)
class Stances:
    """What is asked.

    Attributes:
        names: The roles, in the order of the columns.
        facing: (3,) where the person faces; None where it follows from the roles.
        stature: [m]; None where it is not known.
    """

    names: tuple[str, ...]
    facing: Array | None
    stature: float | None

    def place_costs(self, points: Array, head: Array, pelvis: Array | None, facing: Array) -> Array:
        """(m, n) what each point costs in each role by itself, for a head and a pelvis.

        Args:
            points: (m, 3) [m].
            head: (3,) [m].
            pelvis: (3,) [m]; None where it has no tracker.
            facing: (3,).
        """
        length = self.stature or 0.0
        if pelvis is not None and not length:
            length = float(np.clip(np.linalg.norm(head - pelvis) / TRUNK, STATURES[0], STATURES[-1]))
        length = length or MEAN
        base = head - TRUNK * length * UP if pelvis is None else pelvis
        left = np.cross(UP, facing)
        lowest = points[:, 1].min()
        cost = np.zeros((len(points), len(self.names)))
        for k, name in enumerate(self.names):
            side = {"l": 1.0, "r": -1.0}.get(name[0] if name[1] == "_" else "", 0.0)
            shoulder = base + SHOULDER * (head - base) + side * 0.12 * length * left
            hip = base - 0.06 * length * UP + side * 0.055 * length * left
            part = name[2:] if side else name
            low = (points[:, 1] - lowest) / length
            aside = -side * ((points - base) @ left) / length
            if part == "ankle":
                cost[:, k] = (low / 0.05) ** 2 + 20.0 * aside
            elif part == "knee":
                thigh = np.linalg.norm(points - hip, axis=1) / length
                cost[:, k] = ((thigh - LENGTH["thigh"]) / 0.05) ** 2 + 20.0 * aside
            elif part == "elbow":
                upper = np.linalg.norm(points - shoulder, axis=1) / length
                cost[:, k] = ((upper - LENGTH["upper_arm"]) / 0.05) ** 2 + 20.0 * aside
            elif part == "wrist":
                reach = np.linalg.norm(points - shoulder, axis=1) / length
                cost[:, k] = (_over(reach, ARM) / 0.04) ** 2 + (_over(0.2, low) / 0.08) ** 2 + 20.0 * aside
            elif part == "chest":
                cost[:, k] = np.sum(((points - base - CHEST * (head - base)) / length / 0.08) ** 2, axis=1)
        return cost


def compute_facing(points: Array, stances: Stances) -> Array:
    """(K, 3) where people face: given, or across the lines of wrists, ankles, elbows and knees."""
    if stances.facing is not None:
        return np.broadcast_to(stances.facing, (len(points), 3))
    line = np.zeros((len(points), 3))
    for part in ("wrist", "ankle", "elbow", "knee"):
        if f"l_{part}" in stances.names:
            left, right = (stances.names.index(f"{s}_{part}") for s in "lr")
            line += points[:, left] - points[:, right]
    line[:, 1] = 0.0
    size = np.linalg.norm(line, axis=1, keepdims=True)
    line = np.where(size > 1e-6, line / np.maximum(size, 1e-6), [1.0, 0.0, 0.0])
    return np.asarray(np.cross(line, UP))


def compute_cost(points: Array, stances: Stances) -> Array:
    """(K,) costs of points (K, n, 3) in the order of the roles [m], each at its best stature."""
    facing = compute_facing(points, stances)
    axes = np.stack([np.cross(UP, facing), np.broadcast_to(UP, facing.shape), facing], axis=1)
    statures = STATURES if stances.stature is None else np.array([stances.stature])
    local = np.einsum("kij,knj->kni", axes, points)
    best = np.full(len(points), np.inf)
    for stature in statures:
        at = {name: local[:, k] / stature for k, name in enumerate(stances.names)}
        cost = _cost(at) + (0.0 if stances.stature is not None else ((stature - MEAN) / SPREAD) ** 2)
        best = np.minimum(best, cost)
    return best


def _cost(at: dict[str, Array]) -> Array:
    """Cost of roles at places (K, 3) left, up, forward, in statures."""
    head = at["head"]
    pelvis = at.get("pelvis")
    total = np.zeros(len(head))
    if pelvis is None:
        pelvis = head - [0.0, TRUNK, 0.04]
    else:
        total += _trunk(head - pelvis)
    low = np.min([p[:, 1] for p in at.values()], axis=0)
    if "l_ankle" in at:
        total += _legs(at, pelvis, low)
    for name, side in SIDES:
        shoulder = pelvis + SHOULDER * (head - pelvis) + np.array([0.12 * side, 0.0, 0.0])
        hip = pelvis + np.array([0.055 * side, -0.06, 0.0])
        total += _arm(at, name, side, pelvis, shoulder)
        for part in ("wrist", "elbow", "knee"):  # hands may be raised, knees may not
            if f"{name}_{part}" in at:
                total += _square(_over(at[f"{name}_{part}"][:, 1], head[:, 1]), 0.11)
        if f"{name}_wrist" in at and "l_ankle" in at:
            total += _square(_over(0.2, at[f"{name}_wrist"][:, 1] - low), 0.08)
        if f"{name}_knee" in at:
            total += _knee(at, name, hip)
    for part, spread in (("wrist", 0.03), ("ankle", 0.02), ("elbow", 0.03), ("knee", 0.02)):
        if f"l_{part}" in at and f"r_{part}" in at:
            total += _square(_over(0.03, at[f"l_{part}"][:, 0] - at[f"r_{part}"][:, 0]), spread)
    if "chest" in at:
        total += np.sum(((at["chest"] - pelvis - CHEST * (head - pelvis)) / 0.06) ** 2, axis=1)
    return total


def _trunk(chord: Array) -> Array:
    """The line from pelvis to head has its length, rises, and leans forward rather than aside or back."""
    length = np.linalg.norm(chord, axis=1)
    aside, up, forward = chord.T / np.maximum(length, 1e-9)
    return np.asarray(
        _square(length - TRUNK, 0.04)
        + _square(aside, 0.09)
        + _square(_over(0.3, up), 0.1)
        + _square(_over(-0.05, forward), 0.15)
        + _square(_over(forward, 0.4), 0.2)
    )


def _legs(at: dict[str, Array], pelvis: Array, low: Array) -> Array:
    """Ankles are lowest, within reach, below the pelvis, and stand about its middle."""
    left, right = at["l_ankle"], at["r_ankle"]
    total = _square(0.5 * (left + right)[:, 0] - pelvis[:, 0], 0.08)
    for side, ankle in ((1.0, left), (-1.0, right)):
        leg = ankle - pelvis - [0.055 * side, -0.06, 0.0]
        reach = np.linalg.norm(leg, axis=1)
        total += _square(_over(reach, LEG + 0.01), 0.03) + 0.5 * _square(_over(0.35, reach), 0.1)
        total += _square(ankle[:, 1] - low, 0.03) + _square(_over(0.1, pelvis[:, 1] - ankle[:, 1]), 0.04)
        total += _square(_over(-0.06, leg[:, 2]), 0.08)
    return np.asarray(total)


def _arm(at: dict[str, Array], name: str, side: float, pelvis: Array, shoulder: Array) -> Array:
    """A wrist is within reach, on its side, and before the body; an elbow is out, down and behind."""
    wrist, elbow = at.get(f"{name}_wrist"), at.get(f"{name}_elbow")
    total = np.zeros(len(pelvis))
    if wrist is not None:
        total += _square(_over(np.linalg.norm(wrist - shoulder, axis=1), ARM + 0.02), 0.03)
        aside = side * (wrist - pelvis)[:, 0]
        total += _square(_over(-0.02, aside), 0.05) + _square(_over(0.08, aside), 0.1)
        total += _square(_over(-0.08, (wrist - pelvis)[:, 2]), 0.06)
    if elbow is not None:
        total += _square(np.linalg.norm(elbow - shoulder, axis=1) - LENGTH["upper_arm"], 0.035)
        aside = side * (elbow - pelvis)[:, 0]
        total += _square(_over(0.04, aside), 0.05)
        total += _square(_over(-0.12, (elbow - shoulder)[:, 2]), 0.06)
    if wrist is not None and elbow is not None:
        total += _square(np.linalg.norm(wrist - elbow, axis=1) - LENGTH["forearm"], 0.03)
        off = _off_line(elbow, shoulder, wrist)
        pointing = side * 0.5 * off[:, 0] - 0.5 * off[:, 1] - 0.7 * off[:, 2]
        total += _square(_over(0.0, pointing), 0.02)
    return total


def _knee(at: dict[str, Array], name: str, hip: Array) -> Array:
    knee = at[f"{name}_knee"]
    total = _square(np.linalg.norm(knee - hip, axis=1) - LENGTH["thigh"], 0.035)
    ankle = at.get(f"{name}_ankle")
    if ankle is not None:
        total += _square(np.linalg.norm(knee - ankle, axis=1) - LENGTH["calf"], 0.03)
        total += _square(_over(0.0, _off_line(knee, hip, ankle)[:, 2]), 0.03)
    return np.asarray(total)


def _off_line(middle: Array, start: Array, end: Array) -> Array:
    """(K, 3) from the line between two points to a third, across the line."""
    line = end - start
    line = line / np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-9)
    way = middle - start
    return np.asarray(way - np.sum(way * line, axis=1, keepdims=True) * line)


def _over(value: Array | float, limit: Array | float) -> Array:
    """How far a value is beyond a limit."""
    return np.asarray(np.maximum(np.subtract(value, limit), 0.0))


def _square(value: Array, spread: float) -> Array:
    return np.asarray((value / spread) ** 2)
