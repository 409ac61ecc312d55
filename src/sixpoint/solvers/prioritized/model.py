"""Lower a body and its tasks to the plain arrays that the compiled engine reads."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.dofs import Ball, Hinges, SwingTwist
from sixpoint.errors import SixpointError, listed
from sixpoint.kernels.swing_twist import build_ball_rows
from sixpoint.solvers.prioritized.articulation import Articulation
from sixpoint.solvers.prioritized.blocks import Block, lower_task
from sixpoint.solvers.prioritized.engine import packing
from sixpoint.solvers.prioritized.engine.packing import BALL, FIXED, HINGES, Model
from sixpoint.solvers.prioritized.tasks import BalanceTask, FlextTask, PostureTask, Task

Array = NDArray[np.float64]

POSITION_NORM, FLEXT_NORM = 0.4, 1.0
"""Largest norm of one level's part of a step [rad]; a FLEXT level has unit singular values."""


@dataclass(frozen=True, eq=False)
class Lowered:
    """Arrays of a body and its tasks.

    Attributes:
        model: The body.
        balls: (rows, W) swing and twist limits.
        index: (B, 10) integers of the blocks.
        values: (B, 18) numbers of the blocks.
        rows: Rows of all blocks.
        widest: Rows of the widest level.
    """

    model: Model
    balls: Array
    index: NDArray[np.int64]
    values: Array
    rows: int
    widest: int


def lower(
    body: Articulation, tasks: Sequence[Task], posture: PostureTask | None, limits: bool = True
) -> Lowered:
    """Lower a body and its tasks; posture is not among them."""
    blocks = [block for k, task in enumerate(tasks) for block in lower_task(body, task, k, limits)]
    return lower_blocks(body, blocks, posture, tasks)


def lower_blocks(
    body: Articulation, blocks: Sequence[Block], posture: PostureTask | None, tasks: Sequence[Task]
) -> Lowered:
    """Lower a body and blocks of rows, most important level first; ``tasks`` say what bears on the floor."""
    wanted = sorted({block.level for block in blocks})
    blocks = sorted(blocks, key=lambda block: block.level)
    index = np.zeros((len(blocks), packing.BLOCK_INTEGERS), np.int64)
    values = np.zeros((len(blocks), packing.BLOCK_NUMBERS))
    grids: list[Array] = []
    row = 0
    for b, block in enumerate(blocks):
        index[b], values[b] = block.index, block.values
        index[b, packing.LEVEL], index[b, packing.FIRST] = wanted.index(block.level), row
        if block.grid is not None:
            index[b, packing.MIDDLE] = sum(map(len, grids))
            grids.append(block.grid)
        row += int(index[b, packing.COUNT])
    levels = np.zeros((len(wanted), 4))
    widest = 3
    for k in range(len(wanted)):
        inside = np.flatnonzero(index[:, packing.LEVEL] == k)
        flext = np.any(index[inside, packing.KIND] == packing.FLEXT)
        levels[k, :3] = inside[0], len(inside), FLEXT_NORM if flext else POSITION_NORM
        widest = max(widest, int(index[inside, packing.COUNT].sum()))
    model, balls = _lower_body(body, tasks, posture, levels, np.vstack([np.zeros((0, 4)), *grids]))
    return Lowered(model, balls, index, values, row, widest)


def _lower_body(
    body: Articulation, tasks: Sequence[Task], posture: PostureTask | None, levels: Array, grids: Array
) -> tuple[Model, Array]:
    joints = len(body.tree)
    column = 3 if body.dofs.free_root else 0
    kind, start, size = (np.zeros(joints, np.int64) for _ in range(3))
    ball = np.full(joints, -1, np.int64)
    limits: list[SwingTwist | None] = []
    hinges, bounds = np.zeros((column, 4)), np.zeros((column, 4))
    bounds[:, :2] = -np.inf, np.inf
    for j in range(joints):
        dof = body.dofs[j]
        start[j], size[j] = column, dof.size
        kind[j] = BALL if isinstance(dof, Ball) else HINGES if isinstance(dof, Hinges) else FIXED
        column += dof.size
        axes, ranges = np.zeros((dof.size, 4)), np.zeros((dof.size, 4))
        if isinstance(dof, Hinges):
            axes[:, :3], ranges[:, 0], ranges[:, 1] = dof.axes, dof.lower, dof.upper
        elif isinstance(dof, Ball):
            ranges[:, :2] = -np.inf, np.inf
            if dof.limit is not None:
                ball[j] = len(limits)
                limits.append(dof.limit)
        hinges, bounds = np.vstack([hinges, axes]), np.vstack([bounds, ranges])
    if column == 0:
        raise SixpointError("nothing can move: every joint is fixed and so is the root")
    if posture is not None:
        weights = posture_weights(body, posture)
        for j in range(joints):
            bounds[start[j] : start[j] + size[j], 2] = weights[j]
    points = [place for task in tasks if isinstance(task, BalanceTask) for place in support_of(body, task)]
    offsets = np.zeros((len(points), 4))
    for k, (_, offset) in enumerate(points):
        offsets[k, :3] = offset
    model = Model(
        offsets=np.pad(body.tree.offsets, ((0, 0), (0, 1))),
        before=body.before,
        after=np.array(body.neutral),
        masses=body.masses,
        hinges=hinges,
        bounds=bounds,
        levels=levels,
        points=offsets,
        grids=grids,
        parent=np.array(body.tree.parents),
        kind=kind,
        start=start,
        size=size,
        ball=ball,
        point_joints=np.array([joint for joint, _ in points], np.int64),
        base=body.base,
        free=body.dofs.free_root,
    )
    return model, build_ball_rows(limits or [None])


def scratch_sizes(low: Lowered) -> tuple[tuple[int, ...], ...]:
    """Shapes of the engine's working memory: best state, vectors, long rows, small corner, marks."""
    m = low.model
    joints, columns, levels, points = len(m.parent), len(m.hinges), len(m.levels), len(m.points)
    vectors = 5 * joints + columns + low.rows + len(low.index) + 2 * points
    return (
        (2 * joints + 1 + levels, 4),
        (vectors, 4),
        (low.rows + 4 + low.widest + columns + low.widest, columns),
        (2 * low.widest + 3, low.widest),
        (columns + joints,),
    )


def support_of(body: Articulation, task: BalanceTask) -> list[tuple[int, Array]]:
    """Points that bear on the floor: those asked for, else heels, balls and toes, else the ankles."""
    if task.target == "point":
        return []
    if task.support:
        return body.points(task.support)
    if body.figure is None:
        raise SixpointError("a balance task on a skeleton needs support=(...): the points on the floor")
    out: list[tuple[int, Array]] = []
    for ankle in body.figure.roles.ankle:
        foot = body.tree.subtree(ankle)
        out += [(int(j), np.zeros(3)) for j in foot[1:]]
        out += [
            body.place(body.tree.site_names[s]) for s in np.flatnonzero(np.isin(body.tree.site_parents, foot))
        ]
        if len(foot) == 1:
            out.append((int(ankle), np.zeros(3)))
    return out


def posture_weights(body: Articulation, posture: PostureTask) -> Array:
    """(J,) weight of each joint in the posture; the base itself has no preferred orientation."""
    weights = np.ones(len(body.tree))
    if body.figure is not None:
        weights[list(body.figure.roles.spine)] = 2.0
        weights[list(body.figure.roles.clavicle)] = 5.0
    if body.dofs.free_root:
        weights[body.base] = 0.0
    for name, weight in posture.weights.items():
        if not (np.isfinite(weight) and weight >= 0):
            raise SixpointError(f"posture weights are numbers from 0, got {name} = {weight}")
        weights[body.place(name)[0]] = weight
    return weights


def check_tasks(body: Articulation, tasks: Sequence[Task]) -> tuple[list[Task], PostureTask | None]:
    """The tasks with rows, and the posture; wrong constructions are errors.

    Raises:
        SixpointError: No task, two tasks of one name, a wrong level or weight, posture not the lowest.
    """
    tasks = list(tasks)
    if not tasks:
        raise SixpointError("no tasks; give at least one, such as PositionTask('l_wrist')")
    postures = [task for task in tasks if isinstance(task, PostureTask)]
    others = [task for task in tasks if not isinstance(task, PostureTask)]
    strangers = [type(task).__name__ for task in tasks if not isinstance(task, Task)]
    if strangers:
        raise SixpointError(f"{listed(strangers)} is not a task; tasks are PositionTask, FlextTask and so on")
    names = Counter(task.label for task in others)
    twice = [name for name, count in names.items() if count > 1]
    if twice:
        raise SixpointError(
            f"more than one task named {listed(twice)}: two tasks at one place need a name=... each"
        )
    for task in tasks:
        levels = [task.level]
        if isinstance(task, FlextTask):
            levels += [k for k in (task.tangential_level, task.drag_level) if k is not None]
        if any(not (np.isfinite(k) and int(k) == k and k >= 0) for k in levels):
            raise SixpointError(f"{task.label}: levels are whole numbers from 0, got {levels}")
        if not (np.isfinite(task.weight) and task.weight > 0):
            raise SixpointError(f"{task.label}: the weight is a positive number, got {task.weight}")
        if task.tolerance is not None and not task.tolerance > 0:
            raise SixpointError(f"{task.label}: the tolerance is a positive number, got {task.tolerance}")
    if sum(isinstance(task, BalanceTask) and task.target == "polygon" for task in others) > 1:
        raise SixpointError("one balance task is enough: there is one centre of mass")
    if len(postures) > 1:
        raise SixpointError("one posture task is enough: it is the last of all")
    if postures and not 0 <= postures[0].step <= 1:
        raise SixpointError(f"the step of a posture is a share from 0 to 1, got {postures[0].step}")
    if postures and others and postures[0].level <= max(task.level for task in others):
        raise SixpointError(
            f"the posture is the lowest level: give it a level above {max(task.level for task in others)}"
        )
    return others, postures[0] if postures else None
