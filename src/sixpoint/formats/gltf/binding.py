"""Skins: how a mesh hangs on its joints, and the pose in which it was bound.

A skin's inverse bind matrix takes a vertex into the frame of a joint, x = L v + m in metres. From it follows
where the joint was when the mesh was bound, but only up to a placement of the whole mesh; that is taken from
the mesh's node, from the file's world or from the top joint, whichever comes nearest to the pose of the nodes.

Reference: Khronos, glTF 2.0 specification, section 3.7.3 (skins).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.formats.gltf.accessors import read_floats
from sixpoint.formats.gltf.nodes import EVEN, NodeTree
from sixpoint.formats.gltf.rig import Rig

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Skin:
    """One skin.

    Attributes:
        index: Which.
        nodes: (n,) its joints.
        linear: (n, 3, 3) L, mesh -> joint [m].
        shift: (n, 3) m [m].
    """

    index: int
    nodes: tuple[int, ...]
    linear: Array
    shift: Array

    def bind_pose(self) -> tuple[Array, Array] | None:
        """Positions (n, 3) [m] and rotations (n, 4) of the joints when the mesh was bound, up to a placement.

        None where the joints had different scales: then there is no such pose.
        """
        determinant = np.linalg.det(self.linear)
        if not np.all(determinant > 1e-18):
            return None
        scale = np.cbrt(determinant)
        turned = self.linear / scale[:, None, None]
        square = np.abs(turned @ turned.transpose(0, 2, 1) - np.eye(3)).max()
        if square > 10 * EVEN or np.ptp(scale) > 10 * EVEN * scale.mean():
            return None
        columns = turned.transpose(0, 2, 1)  # the inverse rotation
        rotations = rot.from_axes(columns[..., 0], columns[..., 1], columns[..., 2])
        return -rot.mul_vec(rotations, self.shift), rotations


@dataclass(frozen=True, eq=False)
class BindPose:
    """Where the bound nodes were, in the file's world.

    Attributes:
        positions: Node -> (3,) [m].
        rotations: Node -> (4,).
    """

    positions: dict[int, Array]
    rotations: dict[int, Array]


def read_skins(tree: NodeTree) -> list[Skin]:
    """Read all skins.

    Raises:
        FormatError: One has no joints, a joint twice, or matrices that are none.
    """
    document = tree.document
    skins = []
    for k, skin in enumerate(document.items("skins")):
        nodes = tuple(skin["joints"])
        label = document.label("skins", k)
        if not nodes or len(set(nodes)) < len(nodes):
            raise document.error(f"{label} has {'a joint twice' if nodes else 'no joints'}")
        matrices = np.tile(np.eye(4), (len(nodes), 1, 1))
        if "inverseBindMatrices" in skin:
            values = read_floats(
                document, skin["inverseBindMatrices"], "MAT4", f"inverse bind matrices of {label}"
            )
            if len(values) < len(nodes):
                raise document.error(
                    f"accessors[{skin['inverseBindMatrices']}] has {len(values)} inverse bind matrices, "
                    f"{label} has {len(nodes)} joints"
                )
            matrices = values[: len(nodes)].reshape(-1, 4, 4).transpose(0, 2, 1)
            if np.any(np.abs(matrices[:, 3] - (0.0, 0.0, 0.0, 1.0)) > EVEN):
                raise document.error(f"an inverse bind matrix of {label} has a last row other than 0 0 0 1")
        scale = np.array([_accumulated_scale(tree, n) for n in nodes])
        linear, shift = matrices[:, :3, :3] * scale[:, None, None], matrices[:, :3, 3] * scale[:, None]
        skins.append(Skin(k, nodes, linear, shift))
    return skins


def check_one_body(tree: NodeTree, skins: list[Skin]) -> None:
    """Skins without a humanoid map must be of one skeleton: all connected by joints, or by one above another.

    Raises:
        FormatError: They are of several bodies; the message names them.
    """
    groups: list[tuple[set[int], list[int]]] = []
    for skin in skins:
        joined, members = set(skin.nodes), [skin.index]
        reach = {a for n in skin.nodes for a in tree.path(n)}
        apart = []
        for nodes, others in groups:
            above = {a for n in nodes for a in tree.path(n)}
            if nodes & reach or joined & above:
                joined, members = joined | nodes, [*others, *members]
            else:
                apart.append((nodes, others))
        groups = [*apart, (joined, members)]
    if len(groups) > 1:
        labels = [tree.document.label("skins", members[0]) for _, members in groups]
        raise tree.document.error(
            f"the skins are of {len(groups)} separate skeletons: {', '.join(labels)}; export one body per file"
        )


def find_bind_pose(tree: NodeTree, skins: list[Skin]) -> BindPose:
    """The pose in which the meshes were bound; the largest skin leads, others add joints that it lacks."""
    pose = BindPose({}, {})
    for skin in sorted(skins, key=lambda s: -len(s.nodes)):
        bound = skin.bind_pose()
        if bound is None:
            continue
        positions, rotations = bound
        goal = np.array([pose.positions.get(n, tree.world[n, :3, 3]) for n in skin.nodes])
        placed = [
            (origin + rot.mul_vec(turn, positions), rot.mul(turn, rotations))
            for origin, turn in _placements(tree, skin, positions, rotations)
        ]
        best = min(placed, key=lambda place: float(np.sum((place[0] - goal) ** 2)))
        for k, node in enumerate(skin.nodes):
            pose.positions.setdefault(node, best[0][k])
            pose.rotations.setdefault(node, best[1][k])
    return pose


def place_bind_pose(rig: Rig, pose: BindPose) -> tuple[Array, Array]:
    """Positions (J, 3) [m] and world rotations (J, 4) of all nodes of a rig in the bind pose, in our space.

    Joints that are not bound keep their place on their parent.
    """
    parents, tree = rig.skeleton.parents, rig.tree
    positions, rotations = np.zeros((len(parents), 3)), np.zeros((len(parents), 4))
    for k, node in enumerate(rig.nodes):
        if node in pose.positions:
            positions[k] = rot.mul_vec(rig.turn, pose.positions[node])
            rotations[k] = rot.mul(rig.turn, pose.rotations[node])
        elif k == 0:
            local = rot.IDENTITY if node < 0 else tree.rotations[node]
            positions[k], rotations[k] = rig.skeleton.offsets[0], rot.mul(rig.above, local)
        else:
            up = parents[k]
            offset = rig.scales[up] * tree.translations[node]
            positions[k] = positions[up] + rot.mul_vec(rotations[up], offset)
            rotations[k] = rot.mul(rotations[up], tree.rotations[node])
    return positions, rotations


def _placements(tree: NodeTree, skin: Skin, positions: Array, rotations: Array) -> list[tuple[Array, Array]]:
    """Placements (origin (3,), rotation (4,)) of the bound mesh in the file's world to choose from."""
    top = min(range(len(skin.nodes)), key=lambda k: len(tree.path(skin.nodes[k])))
    turn = rot.mul(_world_rotation(tree, skin.nodes[top]), rot.inv(rotations[top]))
    found = [(tree.world[skin.nodes[top], :3, 3] - rot.mul_vec(turn, positions[top]), turn)]
    found.append((np.zeros(3), rot.IDENTITY))
    for node, content in enumerate(tree.document.items("nodes")):
        if content.get("skin") == skin.index:
            found.append((tree.world[node, :3, 3], _world_rotation(tree, node)))
    return found


def _world_rotation(tree: NodeTree, node: int) -> Array:
    turned = rot.IDENTITY
    for n in tree.path(node):
        turned = rot.mul(turned, tree.rotations[n])
    return turned


def _accumulated_scale(tree: NodeTree, node: int) -> float:
    scale = 1.0
    for n in tree.path(node):
        scale *= tree.joint_scale(n)
    return scale
