"""One linear step, laid open: rows, what they want, what they get, and what is left free."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.solvers.prioritized.engine import packing
from sixpoint.solvers.prioritized.engine.wishes import ENFORCED, EQUAL
from sixpoint.solvers.prioritized.model import Lowered

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LinearStep:
    """The linear problem of one iteration and its prioritized solution, before it is shortened and applied.

    Columns are coordinates: three translations of a free base [m], then per joint the tangent of a ball (in
    its parent's frame) or the angles of its hinges [rad]. Rows that are angles count 0.2 m per radian.

    Attributes:
        jacobian: (R, n) rows of all tasks, scaled by their weights; FLEXT's are those of its own form.
        wanted: (R,) wanted change of each row; of FLEXT what higher levels leave to do.
        task: (R,) index of the task of each row.
        level: (R,) rank of the priority level of each row, 0 first.
        active: (R,) whether the row takes part: its goal is known and, one-sided, it is enforced.
        step: (n,) the solution.
        basis: (r, n) orthonormal rows spanning what the levels take; P = P0 (I - V^T V).
        locked: (n,) coordinates held at a limit; of ball joints see ``directions``.
        directions: (k, n) unit rows: tangent directions of ball joints held at a limit.
    """

    jacobian: Array
    wanted: Array
    task: NDArray[np.int64]
    level: NDArray[np.int64]
    active: NDArray[np.bool_]
    step: Array
    basis: Array
    locked: NDArray[np.bool_]
    directions: Array


def read_step(low: Lowered, scratch: tuple[Array, ...], rank: int) -> LinearStep:
    """Read the working memory after one linear step."""
    _, vectors, rows, _, marks = scratch
    m, count = low.model, low.rows
    joints, columns = len(m.parent), len(m.hinges)
    first_row = 3 * joints + columns
    blocks = vectors[first_row + count : first_row + count + len(low.index)]
    locks = vectors[first_row + count + len(low.index) :]
    block = np.repeat(np.arange(len(low.index)), low.index[:, packing.COUNT])
    directions = np.zeros((0, columns))
    for j in range(joints):
        for k in range(int(marks[columns + j])):
            row = np.zeros((1, columns))
            row[0, m.start[j] : m.start[j] + 3] = locks[2 * j + k, :3]
            directions = np.vstack([directions, row])
    basis = count + 3 + low.widest
    return LinearStep(
        jacobian=rows[:count].copy(),
        wanted=vectors[first_row : first_row + count, 0].copy(),
        task=low.index[block, packing.TASK],
        level=low.index[block, packing.LEVEL],
        active=np.isin(blocks[block, 2], (EQUAL, ENFORCED)),
        step=rows[count + 1].copy(),
        basis=rows[basis : basis + rank].copy(),
        locked=marks[:columns] > 0,
        directions=directions,
    )
