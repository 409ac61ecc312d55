"""Lower a figure and its markers to the plain arrays that the compiled tracker reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.markers.model import MarkerModel
from sixpoint.errors import FigureError
from sixpoint.solvers.prioritized.articulation import Articulation
from sixpoint.solvers.prioritized.blocks import Block, lower_task
from sixpoint.solvers.prioritized.engine import packing as pk
from sixpoint.solvers.prioritized.model import Lowered, lower_blocks
from sixpoint.solvers.prioritized.tasks import FlextTask, PostureTask
from sixpoint.solvers.tracking.engine import packing as tp
from sixpoint.solvers.tracking.priorities import check_priorities, check_tolerances, find_parts

Array = NDArray[np.float64]
Index = NDArray[np.int64]

USUAL = 0.01
"""Distance of a marker from its place that counts as usual [m]; one of a larger spread weighs less."""


@dataclass(frozen=True, eq=False)
class LoweredMarkers:
    """Arrays of a body and its markers.

    Attributes:
        lowered: Body and blocks, as prioritized IK has them.
        order: (M,) the markers in the tracker's order.
        table: (M, 2) joint and segment of each.
        segments: (S, 3) joint, first marker, number of markers.
        clusters: (K, 6) joint, first marker, number, blocks of rows.
        numbers: (M, 5) offset in the joint's anatomical frame [m], weight, spread [m].
        parts: The part of each marker, in the caller's order.
    """

    lowered: Lowered
    order: Index
    table: Index
    segments: Index
    clusters: Index
    numbers: Array
    parts: tuple[str, ...]


def carrier_of(body: Articulation, joint: int, offset: Array) -> tuple[int, Array]:
    """The moving joint that carries a point, and the point in its frame: fixed joints hang on those above."""
    base = body.base
    while body.dofs[joint].size == 0 and joint != base and body.tree.parents[joint] >= 0:
        offset = offset + body.tree.offsets[joint]
        joint = int(body.tree.parents[joint])
    return joint, offset


def lower_markers(
    body: Articulation,
    model: MarkerModel,
    priorities: Mapping[str, int] | None,
    tolerances: Mapping[str, float] | None,
    flext: bool,
    limits: bool,
) -> LoweredMarkers:
    """Lower a body and the markers on it.

    Raises:
        FigureError: There is no marker, or one sits above the pelvis.
    """
    figure, joints = model.figure, model.joints
    if len(joints) == 0:
        raise FigureError("there are no markers to follow")
    places = rot.mul_vec(figure.neutral[joints], model.offsets)
    parts = find_parts(figure, joints, figure.rest_positions[joints] + places)
    levels_of, bands = check_priorities(priorities), check_tolerances(tolerances)
    carried = [carrier_of(body, int(j), p) for j, p in zip(joints, places, strict=True)]
    carriers = np.array([joint for joint, _ in carried])
    inside = set(body.tree.subtree(body.base).tolist())
    if not set(carriers.tolist()) <= inside:
        raise FigureError("a marker sits above the pelvis, on what does not move")
    level = np.array([levels_of[part] for part in parts])
    order = np.lexsort((level, carriers))
    usual = np.where(np.isfinite(model.spread), model.spread, USUAL)
    numbers = np.zeros((len(order), 5))
    numbers[:, :3] = np.array([place for _, place in carried])[order]
    numbers[:, tp.WEIGHT] = (USUAL**2 / (USUAL**2 + usual**2) * 2.0)[order]
    numbers[:, tp.SPREAD] = usual[order]
    segments, table = _group(carriers[order]), np.zeros((len(order), 2), np.int64)
    for s, (joint, first, count) in enumerate(segments):
        table[first : first + count] = joint, s
    lowered, clusters = _lower_clusters(body, figure, carriers[order], level[order], numbers, flext, limits)
    for cluster in clusters:
        band = bands[parts[order[cluster[tp.FIRST]]]]
        lowered.values[cluster[tp.MOVE], pk.TOLERANCE] = band
    return LoweredMarkers(lowered, order, table, segments, clusters, numbers, parts)


def _group(keys: Index) -> Index:
    """(S, 3) key, first and number of each run of equal keys."""
    edges = np.flatnonzero(np.diff(keys, prepend=keys[0] - 1))
    return np.column_stack([keys[edges], edges, np.diff(edges, append=len(keys))])


def _lower_clusters(
    body: Articulation,
    figure: Figure,
    carriers: Index,
    level: Index,
    numbers: Array,
    flext: bool,
    limits: bool,
) -> tuple[Lowered, Index]:
    """Blocks of all clusters: FLEXT or three rows for the centre, three rows for turns."""
    groups = _group(carriers * (level.max() + 1) + level)
    ends = _flext_clusters(body, figure, carriers, level, groups) if flext else {}
    last = int(level.max())
    blocks: list[tuple[int, int, Block]] = []  # cluster, order within it, block
    for k, (_, first, count) in enumerate(groups):
        joint, at = int(carriers[first]), int(level[first])
        if k in ends:
            offset = tuple(numbers[first : first + count, :3].mean(axis=0))
            task = FlextTask(body.tree.names[joint], level=at, offset=offset, drag=False)
            across = lower_task(body, task, ends[k], limits)[1]
            across.index[pk.COUNT] = 3
            blocks.append((k, 0, Block(across.index, across.values, at)))
        else:
            blocks.append((k, 0, _plain(pk.POSITION, joint, at)))
        blocks.append((k, 1, _plain(pk.ORIENTATION, joint, last)))
    blocks.sort(key=lambda entry: (entry[2].level, entry[0], entry[1]))
    places = {entry[:2]: b for b, entry in enumerate(blocks)}
    clusters = np.zeros((len(groups), 6), np.int64)
    for k, (_, first, count) in enumerate(groups):
        clusters[k] = carriers[first], first, count, places[k, 1], places[k, 0], level[first] == last
    lowered = lower_blocks(body, [entry[2] for entry in blocks], PostureTask(), [])
    return lowered, clusters


def _plain(kind: int, joint: int, level: int) -> Block:
    index, values = np.zeros(pk.BLOCK_INTEGERS, np.int64), np.zeros(pk.BLOCK_NUMBERS)
    index[pk.KIND], index[pk.JOINT], index[pk.COUNT] = kind, joint, 3
    values[pk.WEIGHT] = 1.0
    return Block(index, values, level)


def _flext_clusters(
    body: Articulation, figure: Figure, carriers: Index, level: Index, groups: Index
) -> dict[int, int]:
    """Cluster -> number of its limb: for each limb that of the most important level beyond its hinge."""
    ends: dict[int, int] = {}
    for _, middle, _ in figure.roles.limbs:
        below = set(body.tree.subtree(middle).tolist())
        beyond = [k for k, (_, first, _) in enumerate(groups) if int(carriers[first]) in below]
        if beyond and body.dofs[middle].size:
            best = min(beyond, key=lambda k: (level[groups[k, 1]], -groups[k, 2]))
            ends[best] = len(ends)
    return ends
