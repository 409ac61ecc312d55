"""An arm posed by Sequential IK: its angles, its swivel angle, and where its shoulder stops it.

The built-in figure stands in its neutral pose but for one wrist.

Reference: Unzueta et al. 2008, sections 6 and 7.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import SwingTwist
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion, Pose
from sixpoint.jobs.sik_study.trunk import BY_THE_FEET, LEFT, RIGHT, distance, neutral_points, swing_of
from sixpoint.solvers.sequential.solver import SequentialIK

Array = NDArray[np.float64]

FORWARD, BELOW = 0.41, 0.10
"""The right wrist's goal from its shoulder [m]."""
SWIVELS = tuple(range(45, 360, 45))
"""Turns of the arm about the line from shoulder to wrist, from where the solver puts it [degrees]."""
BARRED = ((-70.0, 110.0), (180.0, 85.0))
"""Directions theta and psi that the stretched left arm is asked for, beyond its limits [degrees]."""


@dataclass(frozen=True, eq=False)
class LimbCase:
    """The right arm, its angles, and what they leave open.

    Attributes:
        motion: The solver's posture, then the same with the arm turned by each of ``SWIVELS``.
        goal: (3,) of the wrist [m].
        lengths: Upper arm, forearm, shoulder to goal [m].
        psi: Angle at the shoulder between goal and elbow, in the posture [rad].
        flexion: Of the elbow, in the posture [rad].
        by_triangle: The same two angles from the three lengths alone [rad].
        radius: Of the circle that the elbow may be on [m].
        drift: Largest distance of the wrist to its goal, over all swivels [m].
    """

    motion: Motion
    goal: Array
    lengths: tuple[float, float, float]
    psi: float
    flexion: float
    by_triangle: tuple[float, float]
    radius: float
    drift: float


@dataclass(frozen=True, eq=False)
class LimitCase:
    """The left arm, asked for directions that its shoulder does not allow; one row a direction.

    Attributes:
        shoulder: Limits of the left shoulder.
        hip: Limits of the left hip.
        motion: The postures.
        goals: (D, 3) of the wrist [m].
        asked: (D, 2) theta and psi of the goal [rad].
        kept: (D, 2) theta and psi of the upper arm in the posture [rad].
        allowed: (D,) largest psi in that direction [rad].
    """

    shoulder: SwingTwist
    hip: SwingTwist
    motion: Motion
    goals: Array
    asked: Array
    kept: Array
    allowed: Array


def swivel_arm(figure: Figure) -> LimbCase:
    """Pose the right arm, then turn it about the line from shoulder to wrist."""
    r, points = figure.roles, neutral_points(figure)
    a, b, c = r.shoulder[RIGHT], r.elbow[RIGHT], r.wrist[RIGHT]
    points[3] = figure.neutral_pose.compute_transforms()[0][a] + np.array([0.0, -BELOW, FORWARD])
    pose = SequentialIK(figure, weights=BY_THE_FEET).solve(points).pose
    poses = [pose, *(_swivelled(pose, a, points[3], np.radians(turn)) for turn in SWIVELS)]
    motion = Motion.from_poses(poses, 1.0)
    places = motion.positions
    upper, fore, way = places[0, b] - places[0, a], places[0, c] - places[0, b], points[3] - places[0, a]
    l1, l2, d = (float(np.linalg.norm(v)) for v in (upper, fore, way))
    psi = _angle(upper, way)
    return LimbCase(
        motion=motion,
        goal=points[3],
        lengths=(l1, l2, d),
        psi=psi,
        flexion=_angle(upper, fore),
        by_triangle=(
            float(np.arccos((l1**2 + d**2 - l2**2) / (2 * l1 * d))),
            float(np.pi - np.arccos((l1**2 + l2**2 - d**2) / (2 * l1 * l2))),
        ),
        radius=l1 * float(np.sin(psi)),
        drift=float(distance(places[:, c], points[3]).max()),
    )


def stop_arm(figure: Figure) -> LimitCase:
    """Ask the stretched left arm to go across the body, and back."""
    r, points = figure.roles, neutral_points(figure)
    bones = [r.shoulder[LEFT], r.elbow[LEFT], r.wrist[LEFT]]
    places = figure.neutral_pose.compute_transforms()[0][bones]
    reach = float(distance(places[1:], places[:-1]).sum())
    shoulder, hip = (swing_of(figure, joint) for joint in (bones[0], r.hip[LEFT]))
    asked, poses, goals = np.radians(BARRED), [], []
    for theta, psi in asked:
        aside = np.cos(theta) * shoulder.forward + np.sin(theta) * shoulder.side
        points[2] = places[0] + reach * (np.cos(psi) * shoulder.axis + np.sin(psi) * aside)
        poses.append(SequentialIK(figure, weights=BY_THE_FEET).solve(points).pose)
        goals.append(points[2].copy())
    motion = Motion.from_poses(poses, 1.0)
    segment = rot.mul_vec(motion.rotations[:, bones[0]], shoulder.axis)
    kept = [(np.arctan2(s @ shoulder.side, s @ shoulder.forward), _angle(s, shoulder.axis)) for s in segment]
    return LimitCase(
        shoulder, hip, motion, np.array(goals), asked, np.array(kept), shoulder.compute_limit(asked[:, 0])
    )


def _swivelled(pose: Pose, joint: int, goal: Array, turn: float) -> Pose:
    """The pose with all below a joint turned about the line from it to a point."""
    positions, world = pose.compute_transforms()
    about = rot.from_axis_angle(rot.unit(goal - positions[joint]), turn)
    above = world[int(pose.skeleton.parents[joint])]
    rotations = pose.rotations.copy()
    rotations[joint] = rot.mul(rot.inv(above), rot.mul(about, world[joint]))
    return replace(pose, rotations=rotations)


def _angle(u: Array, v: Array) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(u, v)), u @ v))
