"""Lower one task to blocks of rows: which joint, which offset, which numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.dofs import Ball, Hinges
from sixpoint.body.surface.distance_grid import DistanceGrid
from sixpoint.errors import SixpointError
from sixpoint.kernels import distance
from sixpoint.solvers.prioritized.articulation import Articulation
from sixpoint.solvers.prioritized.engine import packing
from sixpoint.solvers.prioritized.limbs import find_limb
from sixpoint.solvers.prioritized.tasks import (
    AlignTask,
    BalanceTask,
    Box,
    Capsule,
    CouplingTask,
    FlextTask,
    HalfSpace,
    LookAtTask,
    Mesh,
    ObstacleTask,
    OrientationTask,
    PlaneTask,
    PositionTask,
    Shape,
    Sphere,
    Task,
)

Array = NDArray[np.float64]

METRES, RADIANS = 1e-3, 1e-2
"""Errors at which iterating stops, by default."""
ACCEPTED = 10.0
"""A frame counts as met within so many times that: 1 cm, as in Unzueta et al. 2008, section 9.

A larger tolerance counts as it is.
"""
ROTATION_STEP = 0.3
CHAIN_SHARE = 0.1
"""Largest wanted change of one iteration: 10 % of the driving chain (Boulic and Raunhardt 2009), 0.3 rad."""


@dataclass(frozen=True, eq=False)
class Block:
    """Rows that belong together: integers, numbers and the priority level they were asked for."""

    index: NDArray[np.int64]
    values: Array
    level: int
    grid: Array | None = None


def _block(
    kind: int, task: Task, k: int, rows: int, joint: int, level: int, step: float, **extra: Any
) -> Block:
    index = np.zeros(packing.BLOCK_INTEGERS, np.int64)
    values = np.zeros(packing.BLOCK_NUMBERS)
    index[packing.KIND], index[packing.TASK], index[packing.COUNT] = kind, k, rows
    index[packing.JOINT] = joint
    angular = kind in (packing.ORIENTATION, packing.LOOK_AT, packing.ALIGNMENT, packing.COUPLING)
    usual = RADIANS if angular else METRES
    tolerance = task.tolerance or usual
    accepted = min(ACCEPTED * tolerance, max(ACCEPTED * usual, tolerance))
    values[packing.WEIGHT], values[packing.STEP] = task.weight, step
    values[packing.TOLERANCE], values[packing.ACCEPT] = tolerance, accepted
    for name, value in extra.items():
        column = getattr(packing, name.upper())
        if name in ("root", "middle", "shape", "option"):
            index[column] = value
        elif np.ndim(value):
            values[column : column + 3] = value
        else:
            values[column] = value
    return Block(index, values, level)


def _direction(task: Task, axis: object) -> Array:
    vector = np.asarray(axis, float)
    length = np.linalg.norm(vector)
    if vector.shape != (3,) or not 1e-9 < length < np.inf:
        raise SixpointError(f"{task.label}: the axis is three numbers, not all zero; got {axis}")
    return np.asarray(vector / length)


def _reach(body: Articulation, joint: int, offset: Array) -> float:
    """Largest step of a point [m]: a share of the chain that drives it."""
    path = body.tree.path(0, joint)
    below = [j for j in path[1:] if j > body.base]
    length = float(np.linalg.norm(body.tree.offsets[below], axis=1).sum() + np.linalg.norm(offset))
    return CHAIN_SHARE * max(length, 1.0 if body.dofs.free_root else 1e-3)


def lower_task(body: Articulation, task: Task, k: int, limits: bool) -> list[Block]:
    """Blocks of one task; ``k`` is its row among the goals, ``limits`` whether hinges have any.

    Raises:
        SixpointError: It hangs on a joint that does not exist, or its numbers make no sense.
    """
    match task:
        case FlextTask():
            return _flext(body, task, k, limits)
        case PositionTask():
            joint, offset = body.point(task.at, task.offset)
            step = _reach(body, joint, offset)
            return [_block(packing.POSITION, task, k, 3, joint, task.level, step, offset=offset)]
        case OrientationTask():
            joint, _ = body.point(task.at, task.offset)
            return [_block(packing.ORIENTATION, task, k, 3, joint, task.level, ROTATION_STEP)]
        case LookAtTask() | AlignTask():
            kind = packing.LOOK_AT if isinstance(task, LookAtTask) else packing.ALIGNMENT
            joint, offset = body.point(task.at, task.offset)
            axis = _direction(task, task.axis)
            return [_block(kind, task, k, 2, joint, task.level, ROTATION_STEP, offset=offset, direction=axis)]
        case PlaneTask():
            joint, offset = body.point(task.at, task.offset)
            return [_avoidance(body, packing.PLANE, task, k, joint, offset, HalfSpace(), task.margin, 0.0)]
        case ObstacleTask():
            return _obstacle(body, task, k)
        case BalanceTask():
            return [_balance(body, task, k)]
        case CouplingTask():
            return [_coupling(body, task, k)]
        case _:
            raise SixpointError(f"{type(task).__name__} is not a task")


def _avoidance(
    body: Articulation,
    kind: int,
    task: Task,
    k: int,
    joint: int,
    offset: Array,
    shape: Shape,
    margin: float,
    buffer: float,
    on: str | None = None,
) -> Block:
    if not (0 <= margin < np.inf and 0 <= buffer < np.inf):
        raise SixpointError(f"{task.label}: margin and buffer are lengths from 0 [m]")
    number, size = _size(task, shape)
    step = _reach(body, joint, offset)
    carried: dict[str, int] = {}
    if on is not None:
        carrier, _ = body.place(on)
        if carrier == joint:
            raise SixpointError(f"{task.label}: a point of {on!r} is always where it is on {on!r}")
        carried = {"root": carrier, "option": packing.CARRIED}
    block = _block(
        kind,
        task,
        k,
        1,
        joint,
        task.level,
        step,
        offset=offset,
        shape=number,
        size=size,
        ratio=margin,
        buffer=buffer,
        **carried,
    )
    return replace(block, grid=pack_grid(shape.grid)) if isinstance(shape, Mesh) else block


def pack_grid(grid: DistanceGrid) -> Array:
    """A grid of distances as rows of four: origin and spacing, counts, values; see ``kernels.distance``."""
    values = grid.values.ravel()
    rows = np.zeros((2 + -(-len(values) // 4), 4))
    rows[0], rows[1, :3] = (*grid.origin, grid.spacing), grid.values.shape
    rows[2:].flat[: len(values)] = values
    return rows


def _size(task: Task, shape: Shape) -> tuple[int, Array]:
    match shape:
        case Sphere(radius):
            number, size = distance.SPHERE, [radius, 0.0, 0.0]
        case Capsule(radius, length):
            number, size = distance.CAPSULE, [radius, 0.5 * length, 0.0]
        case Box(sides):
            number, size = distance.BOX, [0.5 * side for side in sides]
        case HalfSpace():
            number, size = distance.HALF_SPACE, [0.0, 0.0, 0.0]
        case Mesh():
            number, size = distance.GRID, [0.0, 0.0, 0.0]
        case _:
            raise SixpointError(f"{task.label}: a shape is a Sphere, Capsule, Box, HalfSpace or Mesh")
    array = np.asarray(size, float)
    if array.shape != (3,) or not np.all((array >= 0) & np.isfinite(array)):
        raise SixpointError(f"{task.label}: sizes of a shape are lengths from 0 [m], got {shape}")
    return number, array


def _obstacle(body: Articulation, task: ObstacleTask, k: int) -> list[Block]:
    points = body.points([(task.at, task.offset), *task.points])
    return [
        _avoidance(
            body, packing.OBSTACLE, task, k, joint, offset, task.shape, task.margin, task.buffer, task.on
        )
        for joint, offset in points
    ]


def _balance(body: Articulation, task: BalanceTask, k: int) -> Block:
    step = CHAIN_SHARE
    if not 0 <= task.margin < np.inf:
        raise SixpointError(f"{task.label}: the margin is a length from 0 [m], got {task.margin}")
    if task.target == "point":
        return _block(packing.BALANCE_POINT, task, k, 2, 0, task.level, step)
    if task.target != "polygon":
        raise SixpointError(f"{task.label}: the target is 'polygon' or 'point', got {task.target!r}")
    return _block(packing.BALANCE, task, k, 1, 0, task.level, step, ratio=task.margin)


def _coupling(body: Articulation, task: CouplingTask, k: int) -> Block:
    joint, other = body.place(task.at)[0], body.place(task.other)[0]
    a, b = body.dofs[joint], body.dofs[other]
    alike = (isinstance(a, Ball) and isinstance(b, Ball)) or (
        isinstance(a, Hinges) and isinstance(b, Hinges) and a.size == b.size
    )
    if joint == other or not alike:
        raise SixpointError(
            f"{task.label}: coupled are two joints of one kind, both balls or with as many hinges; "
            f"{task.at!r} and {task.other!r} are not"
        )
    if not np.isfinite(task.ratio):
        raise SixpointError(f"{task.label}: the ratio is a finite number, got {task.ratio}")
    return _block(
        packing.COUPLING, task, k, a.size, joint, task.level, ROTATION_STEP, root=other, ratio=task.ratio
    )


def _flext(body: Articulation, task: FlextTask, k: int, limits: bool) -> list[Block]:
    joint, offset = body.point(task.at, task.offset)
    limb = find_limb(body, task, joint, offset, limits)
    drag = limb.movable if task.drag is None else task.drag
    forms = {
        "tangent": 0,
        "exponential": packing.EXPONENTIAL,
        "hinge": packing.HINGE_ONLY,
        "secant": packing.SECANT,
    }
    if task.form not in forms:
        raise SixpointError(f"{task.label}: the form is one of {', '.join(forms)}; got {task.form!r}")
    common: dict[str, Any] = {
        "offset": offset,
        "root": limb.root,
        "middle": limb.middle,
        "option": forms[task.form] | task.predict * packing.PREDICT,
        "side": limb.side,
        "low": limb.low,
        "high": limb.high,
    }
    step = CHAIN_SHARE * limb.length
    secant = task.form == "secant"
    across = task.tangential_level
    if across is None:
        across = task.level if secant else task.level + 1
    blocks = [
        _block(packing.FLEXT, task, k, 1, joint, task.level, step, **common),
        _block(packing.TANGENTIAL, task, k, 2, joint, across, step, **common),
    ]
    if drag:
        level = task.level + 2 if task.drag_level is None else task.drag_level
        follow = {**common, "option": common["option"] | packing.FOLLOW}
        blocks.append(_block(packing.DRAG, task, k, 1, joint, level, step, **follow))
    if secant:  # what the limb can reach is held along it too, unless the body is to follow
        common["option"] |= packing.YIELD if drag else 0
        blocks.append(_block(packing.DRAG, task, k, 1, joint, task.level, step, **common))
    return blocks
