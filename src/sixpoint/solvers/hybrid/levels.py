"""What the hybrid asks of prioritized IK, and in which order; the user's tasks find their place between."""

from __future__ import annotations

from collections.abc import Sequence

from sixpoint.body.targets import EFFECTORS
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
"""Levels: feet that stand, and the floor; pelvis and its turn; limbs; head; what is only measured."""

FOLLOWED = dict(zip(EFFECTORS, (PELVIS, HEAD, ARMS, ARMS, LEGS, LEGS), strict=True))
"""Level of each of the six points, in their order."""

ANYTHING = 1e6  # m, a tolerance that is always met
NOTHING = 1e-9  # weight whose rows are too short to move anything


def build_tasks(body: Articulation, floor: float | None) -> list[Task]:
    """The hybrid's own tasks, in the order of ``goals``; the first six have the residuals of the six points.

    An ankle stands or follows, and a task may want a point elsewhere. So its distance to where it was seen is
    measured apart, by rows that move nothing.

    Args:
        body: What is posed.
        floor: Height of the floor [m], if it is to bear the feet.
    """
    ankles = ("l_ankle", "r_ankle")
    tasks: list[Task] = [
        *(_measure(at) for at in FOLLOWED),
        *(_follow(at, level) for at, level in FOLLOWED.items()),
        *(FlextTask(at, level=FEET, drag=True, drag_level=FEET + 1, name=f"{at} stands") for at in ankles),
        OrientationTask("pelvis", level=TURN, name="pelvis turn"),
    ]
    if floor is not None:
        goal = (0.0, floor, 0.0, 0.0, 0.0, 0.0, 1.0)
        depths = zip(ankles, sole_depths(body), strict=True)
        tasks += [PlaneTask(at, level=FEET, margin=d, goal=goal, name=f"{at} floor") for at, d in depths]
    return tasks


def sole_depths(body: Articulation) -> list[float]:
    """How far the lowest point of the rig's feet is below either ankle in the neutral pose [m]."""
    points = support_of(body, BalanceTask())
    sole = min(body.rest_positions[joint, 1] + offset[1] for joint, offset in points)
    ankles = [body.place(at)[0] for at in ("l_ankle", "r_ankle")]
    return [max(float(body.rest_positions[ankle, 1] - sole), 0.0) for ankle in ankles]


def _measure(at: str) -> Task:
    return PositionTask(at, level=MEASURED, weight=NOTHING, tolerance=ANYTHING, name=f"{at} seen")


def _follow(at: str, level: int) -> Task:
    """Pelvis and head by plain positions, limbs by FLEXT; the reconstruction has them there already."""
    if at in ("pelvis", "head"):
        return PositionTask(at, level=level, name=f"{at} follows")
    return FlextTask(at, level=level, drag=False, name=f"{at} follows")


def find_led(tasks: Sequence[Task]) -> list[tuple[int, int]]:
    """Which of the six points a task of the user's moves, and that task: the reconstruction begins there."""
    return [
        (EFFECTORS.index(task.at), k)
        for k, task in enumerate(tasks)
        if isinstance(task, PositionTask | FlextTask)
        and task.at in FOLLOWED
        and not any(task.offset)
        and task.level < FOLLOWED[task.at]
    ]
