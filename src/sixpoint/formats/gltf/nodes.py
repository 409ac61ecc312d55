"""The node tree of a glTF file: parents, local transforms, places in the world.

A node is a translation, a rotation and a scale, or a matrix, which is decomposed. The matrices of the whole
tree are in the file's own space (metres, Y up).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.formats.gltf.document import Document
from sixpoint.formats.source import LARGEST

Array = NDArray[np.float64]

EVEN = 1e-3
"""Relative difference up to which scales count as uniform, and axes as orthogonal."""
SITE = {"sixpoint": "site"}
"""Extras of a node that is a point fixed to its parent, not a joint: what sixpoint writes for end sites."""


@dataclass(frozen=True, eq=False)
class NodeTree:
    """All N nodes of a file.

    Attributes:
        document: The file.
        names: N distinct names; a node without one is called after its index.
        parents: (N,) parent of each node, -1 for roots.
        order: All nodes, parents before children.
        translations: (N, 3) in the parent [m].
        rotations: (N, 4) in the parent.
        scales: (N, 3) about the node's own axes.
        world: (N, 4, 4) matrices, file <- node.
        in_scene: (N,) whether the file's default scene shows the node.
    """

    document: Document
    names: tuple[str, ...]
    parents: tuple[int, ...]
    order: tuple[int, ...]
    translations: Array
    rotations: Array
    scales: Array
    world: Array
    in_scene: NDArray[np.bool_]

    def path(self, node: int) -> list[int]:
        """The node and its ancestors, from the root down."""
        path = [node]
        while self.parents[path[-1]] >= 0:
            path.append(self.parents[path[-1]])
        return path[::-1]

    def is_site(self, node: int) -> bool:
        """Whether the node is an end site that sixpoint wrote."""
        found = self.document.items("nodes")[node]
        return found.get("extras") == SITE and not found.get("children") and self.parents[node] >= 0

    def joint_scale(self, node: int) -> float:
        """The scale of a joint; joints must keep the proportions of what they carry.

        Raises:
            FormatError: It is negative, zero or not uniform.
        """
        scale = self.scales[node]
        mean = float(scale.mean())
        if np.any(scale <= 0):
            kind = "negative" if np.any(scale < 0) else "zero"
        elif np.any(np.abs(scale - mean) > EVEN * mean):
            kind = "not uniform"
        else:
            return mean
        label = self.document.label("nodes", node)
        shown = " ".join(f"{s:g}" for s in scale)
        raise self.document.error(
            f"{label} has a scale that is {kind} ({shown}): joints need one positive scale; "
            "apply scales in the modelling program and export again"
        )


def read_nodes(document: Document) -> NodeTree:
    """Read the node tree.

    Raises:
        FormatError: There are no nodes, the tree has a cycle or a node with two parents, or a transform is
            none.
    """
    nodes = document.items("nodes")
    if not nodes:
        raise document.error("the file has no nodes: neither skeleton nor mesh")
    parents = _find_parents(document)
    order = _sort(document, parents)
    count = len(nodes)
    translations, rotations, scales = (
        np.zeros((count, 3)),
        np.tile(rot.IDENTITY, (count, 1)),
        np.ones((count, 3)),
    )
    world = np.tile(np.eye(4), (count, 1, 1))
    for node in order:
        label = document.label("nodes", node)
        if "matrix" in nodes[node]:
            parts = _decompose(document, label, nodes[node]["matrix"])
        else:
            parts = _read_parts(document, label, nodes[node])
        translations[node], rotations[node], scales[node] = parts
        world[node] = compose(*parts)
        if parents[node] >= 0:
            world[node] = world[parents[node]] @ world[node]
        if not np.all(np.abs(world[node]) <= LARGEST):
            raise document.error(f"{label} is placed or scaled beyond all measure")
    names = _distinct([str(node.get("name", "")).strip() or f"node_{k}" for k, node in enumerate(nodes)])
    shown = _find_shown(document, parents, order)
    return NodeTree(document, names, parents, order, translations, rotations, scales, world, shown)


def compose(translation: Array, rotation: Array, scale: Array) -> Array:
    """The 4 x 4 matrix of a translation (3,), rotation (4,) and scale (3,)."""
    matrix = np.eye(4)
    matrix[:3, :3] = rot.mul_vec(rotation, np.eye(3)).T * scale
    matrix[:3, 3] = translation
    return matrix


def _find_parents(document: Document) -> tuple[int, ...]:
    nodes = document.items("nodes")
    parents = [-1] * len(nodes)
    for k, node in enumerate(nodes):
        for child in node.get("children", []):
            if parents[child] >= 0:
                both = f"{document.label('nodes', parents[child])} and {document.label('nodes', k)}"
                raise document.error(f"{document.label('nodes', child)} is a child of both {both}")
            parents[child] = k
    return tuple(parents)


def _sort(document: Document, parents: tuple[int, ...]) -> tuple[int, ...]:
    nodes = document.items("nodes")
    order: list[int] = []
    stack = [k for k in range(len(nodes) - 1, -1, -1) if parents[k] < 0]
    while stack:
        node = stack.pop()
        order.append(node)
        stack += reversed(nodes[node].get("children", []))
    if len(order) < len(nodes):
        lost = min(set(range(len(nodes))) - set(order))
        raise document.error(
            f"the node tree has a cycle: {document.label('nodes', lost)} is its own ancestor"
        )
    return tuple(order)


def _find_shown(document: Document, parents: tuple[int, ...], order: tuple[int, ...]) -> NDArray[np.bool_]:
    scenes = document.items("scenes")
    shown = np.ones(len(parents), bool)
    roots = scenes[document.content.get("scene", 0)].get("nodes", []) if scenes else []
    if roots:
        for node in order:
            shown[node] = node in roots or (parents[node] >= 0 and bool(shown[parents[node]]))
    return shown


def _distinct(names: list[str]) -> tuple[str, ...]:
    """Names made distinct by the index of what repeats; control characters and double blanks go."""
    taken: set[str] = set()
    out = []
    for k, name in enumerate(names):
        clean = " ".join("".join(c if c.isprintable() else " " for c in name).split()) or f"node_{k}"
        while clean in taken:
            clean = f"{clean}_{k}"
        taken.add(clean)
        out.append(clean)
    return tuple(out)


def _read_parts(document: Document, label: str, node: dict[str, Any]) -> tuple[Array, Array, Array]:
    rotation = np.array(node.get("rotation", rot.IDENTITY), float)
    if not np.linalg.norm(rotation) > 1e-6:
        raise document.error(f"the rotation of {label} is no quaternion: all four numbers are zero")
    translation = np.array(node.get("translation", (0.0, 0.0, 0.0)), float)
    return translation, rot.normalised(rotation), np.array(node.get("scale", (1.0, 1.0, 1.0)), float)


def _decompose(document: Document, label: str, values: list[float]) -> tuple[Array, Array, Array]:
    matrix = np.array(values, float).reshape(4, 4).T
    axes = matrix[:3, :3]
    scale = np.linalg.norm(axes, axis=0)
    if np.any(np.abs(matrix[3] - (0.0, 0.0, 0.0, 1.0)) > EVEN) or not np.all(scale > 1e-12):
        raise document.error(f"the matrix of {label} is no transform of translation, rotation and scale")
    axes = axes / scale
    if np.any(np.abs(axes.T @ axes - np.eye(3)) > EVEN):
        raise document.error(f"the matrix of {label} is sheared, which glTF forbids: its axes are not square")
    if np.linalg.det(axes) < 0:  # mirrored: by convention along x
        axes, scale = axes * (-1.0, 1.0, 1.0), scale * (-1.0, 1.0, 1.0)
    return matrix[:3, 3], rot.from_axes(*axes.T), scale
