"""Which joints are root and middle of the limb that a FLEXT task flexes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Hinges
from sixpoint.errors import SixpointError
from sixpoint.solvers.prioritized.articulation import Articulation
from sixpoint.solvers.prioritized.tasks import FlextTask

Array = NDArray[np.float64]

SHORT = 1e-3  # a segment below this has no length [m]


@dataclass(frozen=True)
class Limb:
    """A limb: its joints, its length [m], which way it folds, its hinge's range [rad].

    ``movable`` tells whether anything above its root can move.
    """

    root: int
    middle: int
    length: float
    side: float
    low: float
    high: float
    movable: bool


def find_limb(body: Articulation, task: FlextTask, joint: int, offset: Array, limits: bool) -> Limb:
    """Find the limb whose end is a point of a joint; lengths are those of the neutral pose.

    Raises:
        SixpointError: There is no hinge above the point, nothing that moves above the hinge, or a segment of
            the limb has no length.
    """
    point = body.rest_positions[joint] + offset
    path = body.tree.path(0, joint)
    if task.middle is not None:
        middle = _named(body, task, task.middle, path)
        if not isinstance(body.dofs[middle], Hinges):
            raise SixpointError(f"{task.label}: the middle joint {task.middle!r} is not a hinge")
    elif (role := _role_middle(body, path)) is not None:
        middle = role
    else:
        hinges = [j for j in path if isinstance(body.dofs[j], Hinges) and _lever(body, j, point) > SHORT]
        if not hinges:
            raise SixpointError(f"{task.label}: FLEXT needs a hinge between {task.at!r} and the limb's root")
        middle = hinges[-1]
    above = path[: path.index(middle)]
    if task.root is not None:
        root = _named(body, task, task.root, above)
    else:
        moving = [
            j for j in above if body.dofs[j].size and _lever(body, middle, body.rest_positions[j]) > SHORT
        ]
        if not moving:
            raise SixpointError(f"{task.label}: no joint above {body.tree.names[middle]!r} can turn the limb")
        root = moving[-1]
    if body.dofs[root].size == 0:
        raise SixpointError(f"{task.label}: the limb's root {body.tree.names[root]!r} cannot move")
    lengths = _lever(body, middle, body.rest_positions[root]), _lever(body, middle, point)
    if min(lengths) < SHORT:
        raise SixpointError(f"{task.label}: a segment of the limb has no length")
    dof = body.dofs[middle]
    assert isinstance(dof, Hinges)
    low, high = max(float(dof.lower[0]), -np.pi), min(float(dof.upper[0]), np.pi)
    side = -1.0 if -low > high else 1.0
    if not limits:
        low, high = -np.pi, np.pi
    movable = body.dofs.free_root or any(body.dofs[j].size for j in path[: path.index(root)])
    return Limb(root, middle, float(sum(lengths)), side, low, high, bool(movable))


def _role_middle(body: Articulation, path: list[int]) -> int | None:
    """The elbow or knee of a figure above a place on its hand or foot."""
    if body.figure is None:
        return None
    limbs = body.figure.roles.limbs
    return next((m for _, m, end in limbs if end in path and isinstance(body.dofs[m], Hinges)), None)


def _named(body: Articulation, task: FlextTask, name: str, path: list[int]) -> int:
    joint = body.place(name)[0]
    if joint not in path:
        names = [body.tree.names[j] for j in path]
        raise SixpointError(f"{task.label}: {name!r} is not above it; there are: {', '.join(names)}")
    return joint


def _lever(body: Articulation, hinge: int, point: Array) -> float:
    """Distance of a point from the first axis of a hinge joint in the neutral pose [m]."""
    dof = body.dofs[hinge]
    assert isinstance(dof, Hinges)
    arm = point - body.rest_positions[hinge]
    return float(np.linalg.norm(np.cross(rot.unit(dof.axes[0]), arm)))
