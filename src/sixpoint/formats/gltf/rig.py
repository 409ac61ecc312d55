"""Nodes to a Skeleton whose reference pose is the identity, and back.

Files differ in how their nodes are turned and scaled. A rig hides that: with W the world rotation of a node
in a reference pose (the bind pose or that of the nodes) and s the scale it has accumulated,

    sixpoint's local rotation = W_parent * node's local rotation * inv(W)
    sixpoint's offset = W_parent (s_parent * node's translation)

so that in the reference pose all joints' frames are aligned with the world, in metres. Avatars that look
along -Z (VRM 0.x) are turned to look along +Z.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.skeleton import Skeleton
from sixpoint.formats.gltf.nodes import NodeTree

Array = NDArray[np.float64]

HALF_TURN: Array = np.array([0.0, 1.0, 0.0, 0.0])  # about Y


@dataclass(frozen=True, eq=False)
class Rig:
    """Which node each joint is, and how its frame is turned.

    Attributes:
        tree: The file's nodes.
        skeleton: The joints; their frames are aligned with the world in the reference pose.
        nodes: (J,) node of each joint; -1 for a root that was added above several.
        turn: (4,) ours <- file.
        frames: (J, 4) W: world rotation of each node in the reference pose, in our space.
        scales: (J,) scale that each node has accumulated.
        above: (4,) W of what is above the root; it stands still.
        above_scale: Its scale.
        above_origin: (3,) its place in our space [m].
    """

    tree: NodeTree
    skeleton: Skeleton
    nodes: tuple[int, ...]
    turn: Array
    frames: Array
    scales: Array
    above: Array
    above_scale: float
    above_origin: Array

    @property
    def parent_frames(self) -> Array:
        """(J, 4) W of the parent of each joint."""
        return np.concatenate([self.above[None], self.frames[self.skeleton.parents[1:]]])

    def joint_of(self, node: int) -> int | None:
        """The joint that a node is, or that carries it; None where no joint is above it."""
        while node >= 0:
            if node in self.nodes:
                return self.nodes.index(node)
            node = self.tree.parents[node]
        return None

    def enter(self, local: Array) -> Array:
        """Nodes' local rotations (..., J, 4) -> ours."""
        return rot.mul(self.parent_frames, rot.mul(local, rot.inv(self.frames)))

    def leave(self, local: Array) -> Array:
        """Our local rotations (..., J, 4) -> the nodes'."""
        return rot.mul(rot.inv(self.parent_frames), rot.mul(local, self.frames))

    def enter_place(self, joint: int, translation: Array) -> Array:
        """A node's translations (..., 3) -> our local positions [m]."""
        if joint == 0:
            return self.above_origin + rot.mul_vec(self.above, self.above_scale * translation)
        parent = self.skeleton.parents[joint]
        return rot.mul_vec(self.frames[parent], self.scales[parent] * translation)

    def leave_place(self, joint: int, position: Array) -> Array:
        """Our local positions (..., 3) [m] -> the node's translations."""
        if joint == 0:
            shift = rot.mul_vec(rot.inv(self.above), position - self.above_origin)
            return np.asarray(shift / self.above_scale)
        parent = self.skeleton.parents[joint]
        return np.asarray(rot.mul_vec(rot.inv(self.frames[parent]), position) / self.scales[parent])

    def default_rotations(self) -> Array:
        """(J, 4) our local rotations of the pose that the file's nodes have."""
        local = np.array([rot.IDENTITY if n < 0 else self.tree.rotations[n] for n in self.nodes])
        return self.enter(local)


def choose_joints(
    tree: NodeTree, joints: Iterable[int], bones: Iterable[int], animated: Iterable[int]
) -> list[int]:
    """The nodes that become joints, parents first; -1 first where a root has to be added.

    With skins: their joints, the humanoid's bones and what lies between. Without: the humanoid's bones and
    all below them, else all nodes of the scene. A node above these that the animation moves belongs to them.

    Args:
        tree: The nodes.
        joints: Joints of all skins.
        bones: Nodes of the humanoid map.
        animated: Nodes that the animation moves.
    """
    bones = list(bones)
    core = {*joints, *bones}
    if not core:
        core = {n for n in tree.order if tree.in_scene[n]}
    elif core == set(bones):
        top = _common(tree, core)
        core |= {n for n in tree.order if top and any(a in core for a in tree.path(n)[len(top) - 1 :])}
    core = {n for n in core if not tree.is_site(n)} or core
    common = _common(tree, core)
    moved = set(animated)
    start = next((k for k, n in enumerate(common) if n in moved), max(len(common) - 1, 0))
    inside = {n for joint in core for n in tree.path(joint)[start:]}
    chosen = [n for n in tree.order if n in inside]
    return chosen if common else [-1, *chosen]


def _common(tree: NodeTree, nodes: Iterable[int]) -> list[int]:
    """From the root down to the deepest common ancestor; empty for several trees."""
    paths = [tree.path(n) for n in nodes]
    common = []
    for level in zip(*paths, strict=False):
        if len(set(level)) > 1:
            break
        common.append(level[0])
    return common


def build_rig(
    tree: NodeTree, joints: list[int], turn: Array, bound: Mapping[int, Array] | None = None
) -> Rig:
    """Make a rig of chosen nodes.

    Args:
        tree: The nodes.
        joints: As ``choose_joints`` gives them.
        turn: (4,) ours <- file.
        bound: Node -> its world rotation (4,) in the bind pose, in our space; the reference pose of these
            joints and of what hangs on them. By default it is the nodes' pose.

    Raises:
        FormatError: A scale is negative or not uniform.
    """
    bound = bound or {}
    top = joints[0] if joints[0] >= 0 else -1
    outside = tree.path(top)[:-1] if top >= 0 else []
    above, above_scale, above_origin = turn, 1.0, np.zeros(3)
    for node in outside:
        above_origin = above_origin + rot.mul_vec(above, above_scale * tree.translations[node])
        above = rot.mul(above, tree.rotations[node])
        above_scale *= tree.joint_scale(node)
    row = {node: k for k, node in enumerate(joints)}
    count = len(joints)
    parents = np.full(count, -1)
    frames, scales, offsets = np.zeros((count, 4)), np.ones(count), np.zeros((count, 3))
    names = []
    for k, node in enumerate(joints):
        if node < 0:
            frames[k] = turn
            names.append("root" if "root" not in tree.names else f"root_{len(tree.names)}")
            continue
        names.append(tree.names[node])
        if k:
            parents[k] = row.get(tree.parents[node], 0)
        up, scale = (frames[parents[k]], scales[parents[k]]) if k else (above, above_scale)
        offsets[k] = rot.mul_vec(up, scale * tree.translations[node]) + (0.0 if k else above_origin)
        frames[k] = bound.get(node, rot.mul(up, tree.rotations[node]))
        scales[k] = scale * tree.joint_scale(node)
    sites = [n for n in tree.order if tree.is_site(n) and tree.parents[n] in row and n not in row]
    carriers = [row[tree.parents[n]] for n in sites]
    ways = [
        rot.mul_vec(frames[c], scales[c] * tree.translations[n]) for c, n in zip(carriers, sites, strict=True)
    ]
    skeleton = Skeleton(
        tuple(names),
        parents,
        offsets,
        tuple(tree.names[n] for n in sites),
        np.array(carriers, np.int64),
        np.reshape(ways, (-1, 3)),
    )
    return Rig(
        tree, skeleton, tuple(joints), turn, rot.normalised(frames), scales, above, above_scale, above_origin
    )
