"""Single steps of Sequential IK, posed by the solver and measured on its postures.

A spine that stretches and bends, and a clavicle that helps its arm. The built-in figure stands in its neutral
pose but for the points that are moved.

Reference: Unzueta et al. 2008, sections 4 and 5.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Ball, SwingTwist
from sixpoint.body.figure import Figure
from sixpoint.body.limits import Limits
from sixpoint.body.motion import Motion
from sixpoint.solvers.sequential.solver import SequentialIK

Array = NDArray[np.float64]

LEANS = ((1.0, 0.0), (0.97, 16.0), (0.93, 30.0), (0.88, 44.0), (0.82, 58.0), (0.75, 70.0))
"""Head from pelvis after the stretched posture: share of the neutral distance, lean forward [degrees]."""
BEYOND, OUTWARD = 0.06, 20.0
"""The wrist's goal: how far beyond the stretched arm [m], how far outward from straight up [degrees]."""
BY_THE_FEET = (0.0, 1.0, 0.0)
"""Weights for which only the ankles tell where the pelvis faces, so that a moved wrist does not turn it."""
LEFT, RIGHT = 0, 1
"""Places in the roles of limbs."""


@dataclass(frozen=True, eq=False)
class SpineCase:
    """A trunk between two known points, from stretched to bent; one row a posture.

    Attributes:
        motion: The postures.
        goals: (P, 2, 3) known places of pelvis and head [m].
        asked: (P,) their distance [m].
        chords: (P,) distance of pelvis and head in the posture [m].
        misses: (P, 2) distance of pelvis and head to their goals [m].
        bends: (P, S) turn of each joint between pelvis and head from its neutral rotation [rad].
        allowed: (P, S) largest turn in that direction that the limits allow [rad].
        joints: Names of these joints.
        neutral: The chord of the neutral pose [m].
    """

    motion: Motion
    goals: Array
    asked: Array
    chords: Array
    misses: Array
    bends: Array
    allowed: Array
    joints: tuple[str, ...]
    neutral: float

    @property
    def names(self) -> list[str]:
        """What each posture is called: its distance in percent of the neutral one."""
        return ["stretched", "neutral", *(f"{100 * asked / self.neutral:.0f} %" for asked in self.asked[2:])]


@dataclass(frozen=True, eq=False)
class ClavicleCase:
    """A wrist's goal that the arm alone cannot reach: the left one.

    Attributes:
        motion: Two postures: the clavicle held, the clavicle free.
        goal: (3,) of the wrist [m].
        reach: Length of the stretched arm [m].
        gaps: (2,) distance from shoulder to goal in both postures [m].
        misses: (2,) distance from wrist to goal [m].
        angle: Turn of the clavicle [rad].
        limit: Largest turn that the clavicle's limits allow in that direction [rad].
    """

    motion: Motion
    goal: Array
    reach: float
    gaps: Array
    misses: Array
    angle: float
    limit: float


def bend_spine(figure: Figure) -> SpineCase:
    """Let the head come nearer to the pelvis and lean to the front, from the totally stretched trunk on."""
    chain, points = figure.spine_chain, neutral_points(figure)
    chord = chain.segments.sum(axis=0)
    neutral, full = float(np.linalg.norm(chord)), float(np.linalg.norm(chain.segments, axis=1).sum())
    solver, solution = SequentialIK(figure), None
    poses, goals = [], []
    for share, lean in ((full / neutral, 0.0), *LEANS):
        turned = rot.mul_vec(rot.from_axis_angle([1.0, 0.0, 0.0], np.radians(lean)), chord)
        points[1] = points[0] + share * turned
        wrists = np.full((2, 3), np.nan)  # nothing is known of the arms: they stay as they are
        solution = solver.solve(np.vstack([points[:2], wrists, points[4:]]), solution)
        poses.append(solution.pose)
        goals.append(points[:2].copy())
    motion, known = Motion.from_poses(poses, 1.0), np.array(goals)
    places = motion.positions[:, [figure.roles.pelvis, figure.roles.head]]
    inner = list(chain.joints[1:])
    return SpineCase(
        motion=motion,
        goals=known,
        asked=distance(known[:, 0], known[:, 1]),
        chords=distance(places[:, 0], places[:, 1]),
        misses=distance(places, known),
        bends=rot.angle(motion.rotations[:, inner]),
        allowed=np.stack([_allowed(swing_of(figure, j), motion.rotations[:, j]) for j in inner], axis=1),
        joints=tuple(figure.skeleton.names[j] for j in inner),
        neutral=neutral,
    )


def reach_beyond(figure: Figure) -> ClavicleCase:
    """Ask the left wrist to be farther up than its arm is long: with the clavicle held, and free."""
    r, points = figure.roles, neutral_points(figure)
    bones = [r.shoulder[LEFT], r.elbow[LEFT], r.wrist[LEFT]]
    shoulder, elbow, wrist = figure.neutral_pose.compute_transforms()[0][bones]
    reach = float(distance(elbow, shoulder) + distance(wrist, elbow))
    tilt = np.radians(OUTWARD)
    points[2] = shoulder + (reach + BEYOND) * np.array([np.sin(tilt), np.cos(tilt), 0.0])
    held = figure.with_limits(Limits(_without_clavicles(Limits.default().table)))
    poses = [SequentialIK(who, weights=BY_THE_FEET).solve(points).pose for who in (held, figure)]
    motion = Motion.from_poses([replace(pose, skeleton=figure.skeleton) for pose in poses], 1.0)
    clavicle = r.clavicle[LEFT]
    ball = swing_of(figure, clavicle)
    return ClavicleCase(
        motion=motion,
        goal=points[2],
        reach=reach,
        gaps=distance(motion.positions[:, bones[0]], points[2]),
        misses=distance(motion.positions[:, bones[2]], points[2]),
        angle=float(rot.angle(motion.rotations[1, clavicle])),
        limit=float(_allowed(ball, motion.rotations[1, clavicle])),
    )


def swing_of(figure: Figure, joint: int) -> SwingTwist:
    """Limits of a ball joint."""
    ball = figure.dofs[joint]
    assert isinstance(ball, Ball)
    assert ball.limit is not None
    return ball.limit


def _allowed(limit: SwingTwist, rotations: Array) -> Array:
    """Largest swing (...,) in the directions of rotations (..., 4) [rad]."""
    way = rot.mul_vec(rotations, limit.axis)
    return limit.compute_limit(np.arctan2(way @ limit.side, way @ limit.forward))


def neutral_points(figure: Figure) -> Array:
    """The six points (6, 3) of the neutral pose [m], in the order of ``EFFECTORS``."""
    still = Motion.from_poses([figure.neutral_pose], 1.0)
    return np.array(figure.targets(still).positions[0])


def _without_clavicles(table: Mapping[str, Any]) -> dict[str, Any]:
    """A table of limits whose clavicles cannot move."""
    entry = table["clavicle"]
    still = {"swing": [[theta, 0.0] for theta, _ in entry["swing"]], "twist": 0.0}
    return {**table, "clavicle": {**entry, **still}}


def distance(a: Array, b: Array) -> Array:
    """Distances (...,) of points (..., 3)."""
    return np.asarray(np.linalg.norm(a - b, axis=-1), float)
