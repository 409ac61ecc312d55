"""What the compiled engine reads, and how it crosses from Python in few arrays.

Coordinates are columns: three translations of the base if it is free, then in joint order three tangent
coordinates of every ball joint (in its parent's frame) and one angle of every hinge.

A state is an array (2 J + 1, 4): the J local rotations, the base's position, and per joint up to three hinge
angles.
"""

from typing import NamedTuple

import numpy as np

from sixpoint.kernels.jit import helper

FIXED, BALL, HINGES = range(3)

(
    POSITION,
    ORIENTATION,
    LOOK_AT,
    ALIGNMENT,
    PLANE,
    OBSTACLE,
    BALANCE,
    BALANCE_POINT,
    COUPLING,
    FLEXT,
    TANGENTIAL,
    DRAG,
) = range(12)
"""Kinds of blocks; a task is lowered to one block or more."""

# Columns of a block's integers.
KIND, TASK, LEVEL, COUNT, FIRST, JOINT, ROOT, MIDDLE, SHAPE, OPTION = range(10)
BLOCK_INTEGERS = 10
# Columns of a block's numbers.
OFFSET, DIRECTION, WEIGHT, STEP, TOLERANCE, BUFFER, SIZE = 0, 3, 6, 7, 8, 9, 10
SIDE, RATIO, LOW, HIGH, ACCEPT = 13, 14, 15, 16, 17
BLOCK_NUMBERS = 18

# FLEXT's option bits.
EXPONENTIAL, PREDICT, HINGE_ONLY, SECANT, FOLLOW, YIELD = 1, 2, 4, 8, 16, 32
CARRIED = 1  # an obstacle's: its shape is on the joint ROOT


class Model(NamedTuple):
    """Arrays of one body; vectors and quaternions are rows of four numbers.

    Attributes:
        offsets: (J, 4) place of each joint in its parent's frame [m].
        before: (J, 4) inverse of the neutral rotation of each rig joint's parent.
        after: (J, 4) neutral rotation of each rig joint.
        masses: (J, 4) mass [share of the body] and centre of mass in the joint's frame [m].
        hinges: (n, 4) axis of each hinge in the frame before it; zero for other columns.
        bounds: (n, 4) least and largest hinge angle [rad] and the posture weight of each column.
        levels: (K, 4) per priority level: first block, number of blocks, largest norm of its solution.
        parent: (J,) parent of each joint, -1 for the root.
        kind: (J,) FIXED, BALL or HINGES.
        start: (J,) first column of each joint.
        size: (J,) columns of each joint.
        points: (P, 4) support points in their joints' frames [m].
        grids: (G, 4) distances around meshes, see ``kernels.distance``; a block's MIDDLE is its first row.
        ball: (J,) row of each joint in the table of swing and twist limits, -1 for none.
        point_joints: (P,) joint of each support point.
        base: Joint whose position is the state's.
        free: Whether it moves.
    """

    offsets: np.ndarray
    before: np.ndarray
    after: np.ndarray
    masses: np.ndarray
    hinges: np.ndarray
    bounds: np.ndarray
    levels: np.ndarray
    points: np.ndarray
    grids: np.ndarray
    parent: np.ndarray
    kind: np.ndarray
    start: np.ndarray
    size: np.ndarray
    ball: np.ndarray
    point_joints: np.ndarray
    base: int
    free: bool


HEADER = 7  # joints, columns, levels, points, base, free, rows of all tasks


def pack_model(model):
    """Model -> table (N, 4) of all rows, and integers: sizes and indices."""
    table = np.vstack([getattr(model, name) for name in Model._fields[:9]])
    sizes = [len(model.offsets), len(model.hinges), len(model.levels), len(model.points)]
    parts = [getattr(model, name) for name in Model._fields[9:15]]
    header = np.array([*sizes, model.base, int(model.free), 0])
    return table, np.concatenate([header, *parts]).astype(np.int64)


@helper
def unpack_model(table, integers):
    """The model as slices."""
    j, n, k, p = integers[0], integers[1], integers[2], integers[3]
    a, b = 4 * j + n, 4 * j + 2 * n
    h = HEADER
    return Model(
        table[:j],
        table[j : 2 * j],
        table[2 * j : 3 * j],
        table[3 * j : 4 * j],
        table[4 * j : a],
        table[a:b],
        table[b : b + k],
        table[b + k : b + k + p],
        table[b + k + p :],
        integers[h : h + j],
        integers[h + j : h + 2 * j],
        integers[h + 2 * j : h + 3 * j],
        integers[h + 3 * j : h + 4 * j],
        integers[h + 4 * j : h + 5 * j],
        integers[h + 5 * j : h + 5 * j + p],
        integers[4],
        integers[5] > 0,
    )


class Settings(NamedTuple):
    """Options of the compiled engine; see ``PrioritizedIK``."""

    limits: bool
    gain: float
    max_angle: float
    max_shift: float
    rank: float
    posture_step: float
    posture_cap: float
    posture_after: bool
    most: int
    least: int
    drift: int


def pack_settings(settings):
    """Settings as eleven numbers."""
    return np.array([float(value) for value in settings])


@helper
def unpack_settings(options):
    """Settings from eleven numbers."""
    return Settings(
        options[0] > 0.0,
        options[1],
        options[2],
        options[3],
        options[4],
        options[5],
        options[6],
        options[7] > 0.0,
        int(options[8]),
        int(options[9]),
        int(options[10]),
    )


class Scratch(NamedTuple):
    """Working memory; rows of four numbers unless said otherwise.

    Attributes:
        position: (J, 4) world positions [m].
        rotation: (J, 4) world rotations.
        axis: (n, 4) world axis of each column.
        mass: (J, 4) mass of each subtree and its centre of mass [m].
        row: (R, 4) wanted change of each row.
        block: (B, 4) error, signed distance and state of each block.
        lock: (2 J, 4) locked tangent directions of ball joints.
        hull: (2 P, 4) the support polygon, and the points it is made of.
        rows: (M, n) long rows: the Jacobian's R, then the work rows below.
        small: corner for small matrices.
        locked: (n,) 1 for a locked column.
        locks: (J,) number of locked directions of a ball joint.
    """

    position: np.ndarray
    rotation: np.ndarray
    axis: np.ndarray
    mass: np.ndarray
    row: np.ndarray
    block: np.ndarray
    lock: np.ndarray
    hull: np.ndarray
    rows: np.ndarray
    small: np.ndarray
    locked: np.ndarray
    locks: np.ndarray


@helper
def unpack_scratch(vectors, rows, small, marks, joints, columns, count, blocks, points):
    """Working memory as slices."""
    j, n = joints, columns
    a = 3 * j + n
    b = a + count
    c = b + blocks
    d = c + 2 * j
    return Scratch(
        vectors[:j],
        vectors[j : 2 * j],
        vectors[2 * j : 2 * j + n],
        vectors[2 * j + n : a],
        vectors[a:b],
        vectors[b:c],
        vectors[c:d],
        vectors[d : d + 2 * points],
        rows,
        small,
        marks[:n],
        marks[n : n + j],
    )
