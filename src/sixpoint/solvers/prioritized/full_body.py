"""The default tasks of the six points, and the relaxed posture they leave room for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.dofs import Hinges
from sixpoint.body.motion import Pose
from sixpoint.body.rotations import from_axis_angle, mul
from sixpoint.errors import SixpointError
from sixpoint.solvers.prioritized.articulation import Articulation
from sixpoint.solvers.prioritized.goals import FAR
from sixpoint.solvers.prioritized.tasks import FlextTask, PositionTask, PostureTask, Task
from sixpoint.solvers.relaxed import ELBOW, HIP, KNEE, SHOULDER_BACK, SHOULDER_OUT

Array = NDArray[np.float64]

X, Z = np.eye(3)[[0, 2]]


def default_tasks(flext: bool = True, tolerance: float | None = None) -> list[Task]:
    """Pelvis, then legs, arms and head, then the posture; in the order of ``EFFECTORS``.

    With FLEXT the legs flex at level 1 and take their direction at level 2, the arms at 4 and 5, and the rest
    of the body follows (levels 3 and 6) where a limb is too short; the head comes at level 7.
    ``tolerance`` is that of every position [m].
    """
    if not flext:
        levels = {"head": 3, "l_wrist": 2, "r_wrist": 2, "l_ankle": 1, "r_ankle": 1}
        limbs: list[Task] = [PositionTask(at, level=k, tolerance=tolerance) for at, k in levels.items()]
        return [PositionTask("pelvis", level=0, tolerance=tolerance), *limbs, PostureTask(level=4)]
    arms = [FlextTask(at, level=4, drag=True, tolerance=tolerance) for at in ("l_wrist", "r_wrist")]
    legs = [FlextTask(at, level=1, drag=True, tolerance=tolerance) for at in ("l_ankle", "r_ankle")]
    return [
        PositionTask("pelvis", level=0, tolerance=tolerance),
        PositionTask("head", level=7, tolerance=tolerance),
        *arms,
        *legs,
        PostureTask(level=8),
    ]


def place_base(body: Articulation, tasks: Sequence[Task], goals: Array, state: Array) -> None:
    """Move a free base of the rest state so that the most important positions are met on average.

    From too far away the levels below would turn the body over before it arrives.
    """
    if not body.dofs.free_root:
        return
    known = [
        (task.level, goal[:3] - body.rest_positions[joint] - offset)
        for task, goal in zip(tasks, goals, strict=True)
        if isinstance(task, PositionTask | FlextTask) and np.all(np.abs(goal[:3]) < FAR)
        for joint, offset in [body.point(task.at, task.offset)]
    ]
    if known:
        first = min(level for level, _ in known)
        state[len(body.tree), :3] += np.mean([gap for level, gap in known if level == first], axis=0)


def attractor_state(body: Articulation, posture: PostureTask | None) -> Array:
    """State that the posture task is drawn to."""
    if posture is not None and isinstance(posture.pose, Pose):
        return body.state_of(posture.pose)
    state = body.rest_state()
    if posture is None:
        return state
    if posture.pose not in ("relaxed", "middle"):
        raise SixpointError(f"the posture is 'relaxed', 'middle' or a pose, got {posture.pose!r}")
    joints = len(body.tree)
    if posture.pose == "middle":
        for joint, dof in body.dofs.joints.items():
            if isinstance(dof, Hinges):
                middle = 0.5 * (dof.lower + dof.upper)
                state[joints + 1 + joint, : dof.size] = np.where(np.isfinite(middle), middle, 0.0)
        return state
    if body.figure is not None:
        _relax(body, state)
    return state


def _relax(body: Articulation, state: Array) -> None:
    """Bend elbows and knees a little."""
    assert body.figure is not None
    roles, joints = body.figure.roles, len(body.tree)
    for k, side in enumerate((1.0, -1.0)):
        out = from_axis_angle(Z, side * SHOULDER_OUT)
        state[roles.shoulder[k]] = mul(out, from_axis_angle(X, SHOULDER_BACK))
        state[roles.hip[k]] = from_axis_angle(X, -HIP)
        for joint, angle in ((roles.elbow[k], -ELBOW), (roles.knee[k], KNEE)):
            dof = body.dofs[joint]
            if isinstance(dof, Hinges):
                state[joints + 1 + joint, 0] = np.clip(angle, dof.lower[0], dof.upper[0])
