"""An arm at and near full extension, flexed by a plain position constraint and by FLEXT.

The left arm of the built-in figure (0.30 + 0.27 m) is stretched forward; nothing else moves. As in the paper
one iteration asks for half of the error, at most 10 % of the arm's length; the engine's own cap on the turn
of a joint is out of the way (``TURN``).

Reference: Boulic and Raunhardt 2009, sections 4 and 6, Figure 4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Dofs
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion, Pose
from sixpoint.solvers.prioritized.solver import PrioritizedIK
from sixpoint.solvers.prioritized.tasks import FlextTask, OrientationTask, PositionTask, Task

Array = NDArray[np.float64]

GOALS = {"front": (0.0, 0.0, -0.17), "side": (0.17, 0.0, -0.20)}
"""From the stretched hand to its goal [m]: straight to the shoulder, or to the left and back."""
BENDS = (0.0, np.radians(0.5), np.radians(3.0))
"""Of the elbow at the start [rad]."""
ITERATIONS, DRAWN = 24, 12
GAIN, TURN = 0.5, 2.0
METHODS = ("plain", "FLEXT")
FORWARD = rot.from_axis_angle([1.0, 0.0, 0.0], -0.5 * np.pi)
"""World rotation of the stretched arm, and of its hand."""


@dataclass(frozen=True, eq=False)
class LimbRun:
    """One limb flexing towards one goal.

    Attributes:
        goal: "front" or "side".
        method: "plain" or "FLEXT".
        bend: Of the elbow at the start [rad].
        errors: (K + 1,) distance of the hand to its goal [m] at the start and after each iteration, measured
            by forward kinematics.
        rank: Independent rows of the constraint at the start.
        poses: The posture at the start and after each iteration.
    """

    goal: str
    method: str
    bend: float
    errors: Array
    rank: int
    poses: tuple[Pose, ...]


def stretched(figure: Figure, bend: float = 0.0) -> Pose:
    """The neutral pose with the left arm straight forward but for a bend of the elbow [rad]."""
    local = np.tile(rot.IDENTITY, (1, len(figure.skeleton), 1))
    local[0, figure.roles.shoulder[0]] = FORWARD
    local[0, figure.roles.elbow[0]] = rot.from_axis_angle([1.0, 0.0, 0.0], -bend)
    return figure.compute_motion(local, np.zeros((1, 3)), 60.0).pose(0)


def goal_of(figure: Figure, name: str) -> Array:
    """Place (3,) that the hand of the straight arm shall go to [m]."""
    hand = stretched(figure).compute_transforms()[0][figure.roles.wrist[0]]
    return np.asarray(hand + GOALS[name])


def flex(figure: Figure, goal: str, method: str, bend: float, turned: bool = False) -> LimbRun:
    """Flex the arm, from the start with one iteration, with two, and so on.

    Args:
        figure: The figure.
        goal: A name in ``GOALS``.
        method: "plain" or "FLEXT".
        bend: Of the elbow at the start [rad].
        turned: Also keep the hand's rotation, at a lower level; forearm and wrist turn as well.
    """
    roles, place = figure.roles, goal_of(figure, goal)
    every = figure.full_dofs() if turned else figure.dofs
    joints = [roles.shoulder[0], roles.elbow[0], *([roles.wrist[0]] if turned else [])]
    flexing = FlextTask("l_wrist", goal=place, form="tangent")
    tasks: list[Task] = [flexing if method == "FLEXT" else PositionTask("l_wrist", goal=place)]
    if turned:
        tasks.append(OrientationTask("l_wrist", level=2, goal=FORWARD))
    dofs = Dofs({joint: every[joint] for joint in joints}, free_root=False)
    start = stretched(figure, bend)
    poses = [start]
    for count in range(1, ITERATIONS + 1):
        solver = PrioritizedIK(
            figure,
            tasks,
            dofs=dofs,
            gain=GAIN,
            max_angle=TURN,
            iterations=count,
            least_iterations=count,
        )
        poses.append(solver.solve({}, start=start).pose)
    hands = np.array([pose.compute_transforms()[0][roles.wrist[0]] for pose in poses])
    errors = np.linalg.norm(hands - place, axis=1)
    rank = len(solver.compute_step({}, start=start).basis) - (3 if turned else 0)
    return LimbRun(goal, method, bend, errors, rank, tuple(poses))


def flex_all(figure: Figure) -> list[LimbRun]:
    """Every goal and start, plain and FLEXT next to each other."""
    return [flex(figure, goal, method, bend) for goal in GOALS for bend in BENDS for method in METHODS]


def postures(figure: Figure) -> tuple[Motion, Motion, Array, LimbRun]:
    """The postures of Figure 4 a to d: initial, flexed to the front, to the side, with the hand turned.

    Returns:
        Four postures each with plain constraints and with FLEXT, the goals (4, 1, 3) [m], and the FLEXT run
        with the hand's rotation.
    """
    rows = [("front", False), ("side", False), ("side", True)]
    runs = {m: [flex(figure, goal, m, 0.0, turned) for goal, turned in rows] for m in METHODS}
    motions = [
        Motion.from_poses([stretched(figure), *(run.poses[DRAWN] for run in runs[m])], 1.0) for m in METHODS
    ]
    goals = np.array([[[np.nan] * 3], *([goal_of(figure, goal)] for goal, _ in rows)])
    return motions[0], motions[1], goals, runs["FLEXT"][2]


def hand_angle(figure: Figure, pose: Pose) -> float:
    """Angle of the left hand to the rotation it should keep [rad]."""
    wrist = figure.roles.wrist[0]
    turned = rot.mul(pose.compute_transforms()[1][wrist], rot.inv(figure.neutral[wrist]))
    return float(rot.angle(rot.mul(turned, rot.inv(FORWARD))))
