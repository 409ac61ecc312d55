"""The posed joints as a plain tree, for methods that treat them all alike (CCD, Jacobian methods).

Rows are those of ``packing``: trunk, clavicles, shoulders, elbows, hips, knees; parents come before children.
The five end effectors are head, wrists and ankles; the pelvis is placed, not solved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.solvers.six_points.packing import LIMB_ROWS, Model

Array = NDArray[np.float64]
Index = NDArray[np.int64]

FIXED, BALL, HINGE = 0, 1, 2
ENDS = 5
SHORT = 1e-6  # a chain of joints this short cannot be turned by its end [m]


class Tree(NamedTuple):
    """The posed joints of a figure.

    Attributes:
        offsets: (rows + 5, 4) place of each joint in its parent's frame [m], of each end in its joint's;
            the fourth column is unused.
        ranges: (rows, 2) least and largest angle about X of hinges [rad].
        parents: (rows,) parent row, -1 for the pelvis.
        ends: (5,) row that carries each end.
        kind: (rows,) FIXED, BALL or HINGE. The pelvis is fixed, as are clavicles that the rig lacks.
    """

    offsets: Array
    ranges: Array
    parents: Index
    ends: Index
    kind: Index


def build_tree(figure: Figure, model: Model) -> Tree:
    """The tree of a lowered figure."""
    s = len(model.segments)
    rows = s + LIMB_ROWS
    offsets, ranges = np.zeros((rows + ENDS, 4)), np.zeros((rows, 2))
    parents, kind = np.arange(-1, rows - 1), np.full(rows, BALL)
    offsets[1:s, :3] = model.segments[:-1, :3]
    kind[0] = FIXED
    ends = np.array([s - 1, s + 4, s + 5, s + 8, s + 9])
    offsets[rows, :3] = model.segments[-1, :3]
    for k in range(2):
        clavicle, shoulder, elbow, hip, knee = (s + 2 * n + k for n in range(5))
        parents[[clavicle, shoulder, elbow, hip, knee]] = model.chest[k], clavicle, shoulder, 0, hip
        offsets[clavicle], offsets[shoulder] = model.girdle[k], model.clavicles[k]
        offsets[hip] = model.hips[k]
        if not figure.roles.clavicle or np.linalg.norm(model.clavicles[k]) < SHORT:
            kind[clavicle] = FIXED
        for limb, hinge, sign in ((k, elbow, -1.0), (2 + k, knee, 1.0)):
            upper, lower, low, high = model.limbs[limb]
            kind[hinge] = HINGE
            offsets[hinge, 1] = -upper
            offsets[rows + 1 + limb, 1] = -lower
            ranges[hinge] = sorted((sign * low, sign * high))
    return Tree(offsets, ranges, parents, ends, kind)


def pack_tree(tree):
    """Tree -> a table (2 rows + 5, 4) and integers, so that few arrays cross into compiled code."""
    table = np.vstack([tree.offsets, np.pad(tree.ranges, ((0, 0), (0, 2)))])
    return table, np.concatenate([tree.parents, tree.ends, tree.kind])


@helper
def unpack_tree(table, integers):
    """The tree as slices."""
    rows = (integers.shape[0] - ENDS) // 2
    return Tree(
        table[: rows + ENDS],
        table[rows + ENDS :],
        integers[:rows],
        integers[rows : rows + ENDS],
        integers[rows + ENDS :],
    )


@helper
def place_joints(offsets, parents, local, root, world, positions):
    """World rotations and positions of all joints; the pelvis is at ``root``."""
    qt.store(world, 0, qt.load(local, 0))
    vec.store(positions, 0, root)
    place_chain(offsets, parents, local, 1, parents.shape[0] - 1, 1, world, positions)


@helper
def place_chain(offsets, parents, local, first, count, stride, world, positions):
    """The same for some rows alone, whose parents are placed."""
    for k in range(count):
        j = first + stride * k
        p = parents[j]
        q = qt.load(world, p)
        vec.store(positions, j, vec.add(vec.load(positions, p), qt.mul_vec(q, vec.load(offsets, j))))
        qt.store(world, j, qt.mul(q, qt.load(local, j)))


@helper
def end_position(offsets, ends, world, positions, end):
    """Where an end effector is: 0 the head, then wrists and ankles."""
    j = ends[end]
    offset = vec.load(offsets, world.shape[0] + end)
    return vec.add(vec.load(positions, j), qt.mul_vec(qt.load(world, j), offset))


@helper
def clamp_hinge(ranges, j, q):
    """The hinge's rotation within its range."""
    angle = qt.twist_angle(q, (1.0, 0.0, 0.0))
    low, high = ranges[j, 0], ranges[j, 1]
    if low <= angle <= high:
        return q
    return qt.from_axis_angle((1.0, 0.0, 0.0), min(max(angle, low), high))
