"""What the hybrid asks of prioritized IK, and in which order; the user's tasks find their place between."""

from __future__ import annotations

from sixpoint.solvers.prioritized.articulation import Articulation
from sixpoint.solvers.prioritized.model import support_of
from sixpoint.solvers.prioritized.tasks import (
    BalanceTask,
    FlextTask,
    OrientationTask,
    PlaneTask,
    PositionTask,
    Task,
)

FEET, PELVIS, TURN, LEGS, ARMS, HEAD, MEASURED = 0, 10, 11, 20, 30, 40, 50
"""Levels: feet that stand, and the floor; the pelvis and how it is turned; limbs; head; what is only measured."""

SEEN, FOLLOWING, STANDING, TURNED = slice(0, 6), slice(6, 8), slice(8, 10), 10
"""Rows: the six points as they were seen, ankles that follow, ankles that stand, the pelvis' turn."""

ANYTHING = 1e6  # m, a tolerance that is always met


def build_tasks(body: Articulation, floor: float | None) -> list[Task]:
    """The hybrid's own tasks; the first six have the residuals of the six points.

    An ankle stands or follows, so its distance to where it was seen is measured apart: by rows at the end of
    all, for which nothing is left to move.

    Args:
        body: What is posed.
        floor: Height of the floor [m], if it is to bear the feet.
    """
    ankles = ("l_ankle", "r_ankle")
    tasks: list[Task] = [
        PositionTask("pelvis", level=PELVIS, name="pelvis seen"),
        PositionTask("head", level=HEAD, name="head seen"),
        *(FlextTask(at, level=ARMS, drag=True, name=f"{at} seen") for at in ("l_wrist", "r_wrist")),
        *(PositionTask(at, level=MEASURED, tolerance=ANYTHING, name=f"{at} seen") for at in ankles),
        *(FlextTask(at, level=LEGS, drag=True, name=f"{at} follows") for at in ankles),
        *(FlextTask(at, level=FEET, drag=True, drag_level=FEET + 1, name=f"{at} stands") for at in ankles),
        OrientationTask("pelvis", level=TURN, name="pelvis turn"),
    ]
    if floor is not None:
        goal = (0.0, floor, 0.0, 0.0, 0.0, 0.0, 1.0)
        sole = min(body.rest_positions[joint, 1] + offset[1] for joint, offset in support_of(body, BalanceTask()))
        for at in ankles:
            depth = max(float(body.rest_positions[body.place(at)[0], 1] - sole), 0.0)
            tasks.append(PlaneTask(at, level=FEET, margin=depth, goal=goal, name=f"{at} floor"))
    return tasks
