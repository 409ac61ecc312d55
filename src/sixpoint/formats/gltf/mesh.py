"""Meshes to one Shape: all primitives of all meshes on the skeleton, skinned or fixed to a joint.

Every primitive contributes the vertices that its triangles use. Skinned ones are brought into one common
bind pose, which is exact unless two skins were bound in different poses; those of a mesh without a skin hang
on the joint that carries its node with weight 1.

Reference: Khronos, glTF 2.0 specification, section 3.7.2 (meshes).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.surface.shape import Shape
from sixpoint.formats.gltf.accessors import read_floats, read_indices
from sixpoint.formats.gltf.binding import Skin
from sixpoint.formats.gltf.document import COMPRESSIONS, Document
from sixpoint.formats.gltf.rig import Rig
from sixpoint.formats.source import LARGEST

Array = NDArray[np.float64]
Index = NDArray[np.int64]

MOST_SETS = 4
"""Sets of four joints per vertex that are read."""
TRIANGLES, STRIP, FAN = 4, 5, 6


@dataclass(frozen=True, eq=False)
class Piece:
    """What one primitive on one node contributes to the shape.

    Attributes:
        label: For messages.
        primitive: Its JSON.
        used: (n,) which of its vertices.
        vertices: (n, 3) in the common bind pose [m].
        triangles: (t, 3) counted from its own first vertex.
        joints: (n, K) joints of the rig.
        weights: (n, K).
    """

    label: str
    primitive: dict[str, Any]
    used: Index
    vertices: Array
    triangles: Index
    joints: Index
    weights: Array


def read_pieces(rig: Rig, skins: list[Skin], positions: Array, rotations: Array) -> list[Piece]:
    """Read all meshes that hang on a rig.

    Args:
        rig: The rig.
        skins: All skins of the file.
        positions: (J, 3) places of the joints in the common bind pose [m].
        rotations: (J, 4) world rotations of their nodes there.

    Raises:
        FormatError: Data are missing, damaged or not supported.
    """
    document, tree = rig.tree.document, rig.tree
    pieces = []
    row = {node: k for k, node in enumerate(rig.nodes)}
    resting = rig.skeleton.compute_transforms(rig.default_rotations())
    for node in tree.order:
        content = document.items("nodes")[node]
        carrier = rig.joint_of(node)
        if "mesh" not in content or not tree.in_scene[node] or (carrier is None and "skin" not in content):
            continue
        mesh = content["mesh"]
        for p, primitive in enumerate(document.items("meshes")[mesh]["primitives"]):
            label = f"{document.label('meshes', mesh)}, primitive {p}"
            found = _read_triangles(document, primitive, label)
            if found is None:
                continue
            points, triangles, used = found
            # A skin without weights, which is against the rules, moves nothing: the mesh stays on its node.
            if "skin" in content and "JOINTS_0" in primitive["attributes"]:
                skin = skins[content["skin"]]
                local, weights = _read_weights(document, primitive, label, used, skin)
                joints = np.array([row[n] for n in skin.nodes])[local]
                points = _bind(points, skin, local, weights, positions[joints], rotations[joints])
            else:
                carrier = carrier or 0
                world = tree.world[node]
                points = rot.mul_vec(rig.turn, points @ world[:3, :3].T + world[:3, 3])
                joints, weights = np.full((len(points), 1), carrier), np.ones((len(points), 1))
                points = rot.mul_vec(rot.inv(resting[1][carrier]), points - resting[0][carrier])
                # From the joint's own frame, which is aligned with the world in the reference pose.
                turned = rot.mul(rotations[carrier], rot.inv(rig.frames[carrier]))
                points = positions[carrier] + rot.mul_vec(turned, points)
                if np.linalg.det(world[:3, :3]) < 0:
                    triangles = triangles[:, ::-1]
            if not np.all(np.abs(points) <= LARGEST):
                raise document.error(f"{label} has vertices beyond all measure")
            pieces.append(Piece(label, primitive, used, points, triangles, joints, weights))
    return pieces


def join_pieces(rig: Rig, pieces: list[Piece], positions: Array, rotations: Array, name: str) -> Shape | None:
    """One Shape of all pieces; None where there are none. Arguments as ``read_pieces``."""
    if not pieces:
        return None
    starts = np.cumsum([0, *(len(p.vertices) for p in pieces)])
    width = max(p.joints.shape[1] for p in pieces)
    joints, weights = np.zeros((starts[-1], width), np.int64), np.zeros((starts[-1], width))
    for piece, start in zip(pieces, starts, strict=False):
        here = slice(start, start + len(piece.vertices))
        joints[here, : piece.joints.shape[1]] = piece.joints
        weights[here, : piece.joints.shape[1]] = piece.weights
    triangles = [p.triangles + start for p, start in zip(pieces, starts, strict=False)]
    return Shape(
        np.concatenate([p.vertices for p in pieces]),
        np.concatenate(triangles),
        joints,
        weights,
        positions,
        rot.normalised(rot.mul(rotations, rot.inv(rig.frames))),
        name,
    )


def _read_triangles(
    document: Document, primitive: dict[str, Any], label: str
) -> tuple[Array, Index, Index] | None:
    """Vertices that are used (n, 3), triangles (t, 3) of them, and which they were (n,); None without any."""
    for name in primitive.get("extensions", {}):
        if name in COMPRESSIONS:
            raise document.error(f"{label}: {COMPRESSIONS[name]}: not supported; export without compression")
    mode = primitive.get("mode", TRIANGLES)
    if mode not in (TRIANGLES, STRIP, FAN) or "POSITION" not in primitive["attributes"]:
        return None  # points and lines are no surface
    points = read_floats(document, primitive["attributes"]["POSITION"], "VEC3", f"vertices of {label}")
    if "indices" in primitive:
        what = f"indices of {label}"
        order = read_indices(document, primitive["indices"], "SCALAR", what)[:, 0]
        if order.max(initial=0) >= len(points) and len(order):
            raise document.error(
                f"accessors[{primitive['indices']}] ({what}) names vertex {order.max()} of {len(points)}"
            )
    else:
        order = np.arange(len(points))
    if mode == TRIANGLES:
        triangles = order[: len(order) // 3 * 3].reshape(-1, 3)
    elif mode == FAN:
        triangles = np.column_stack([np.repeat(order[:1], max(len(order) - 2, 0)), order[1:-1], order[2:]])
    else:
        triangles = np.column_stack([order[:-2], order[1:-1], order[2:]])
        triangles[1::2] = triangles[1::2, [1, 0, 2]]
    if not len(triangles):
        return None
    used, compact = np.unique(triangles, return_inverse=True)
    return points[used], compact.reshape(-1, 3), used


def _read_weights(
    document: Document, primitive: dict[str, Any], label: str, used: Index, skin: Skin
) -> tuple[Index, Array]:
    """Joints of the skin (n, K) and weights (n, K) that sum to one, for the vertices that are used."""
    joints, weights = [], []
    attributes = primitive["attributes"]
    for k in range(MOST_SETS):
        names = f"JOINTS_{k}", f"WEIGHTS_{k}"
        if not any(name in attributes for name in names):
            break
        if not all(name in attributes for name in names):
            raise document.error(f"{label} has only one of {names[0]} and {names[1]}")
        joints.append(read_indices(document, attributes[names[0]], "VEC4", f"{names[0]} of {label}"))
        weights.append(read_floats(document, attributes[names[1]], "VEC4", f"{names[1]} of {label}"))
        if len(joints[-1]) <= used.max() or len(weights[-1]) <= used.max():
            raise document.error(f"{label} has {names[0]} and {names[1]} for only a part of its vertices")
    skin_label = document.label("skins", skin.index)
    picked, share = np.hstack([j[used] for j in joints]), np.hstack([w[used] for w in weights])
    if np.any(share < 0):
        raise document.error(f"{label} has negative weights")
    if np.any(picked[share > 0] >= len(skin.nodes)):
        raise document.error(
            f"{label} hangs on joint {picked.max()} of {skin_label}, which has {len(skin.nodes)}"
        )
    picked = np.where(share > 0, picked, 0)
    total = share.sum(axis=1, keepdims=True)
    share[:, :1] = np.where(total > 0, share[:, :1], 1.0)  # as viewers do: the first joint takes it
    share = share / share.sum(axis=1, keepdims=True)
    kept = np.flatnonzero(share.max(axis=0) > 0)
    return picked[:, kept], share[:, kept]


def _bind(
    points: Array, skin: Skin, local: Index, weights: Array, positions: Array, rotations: Array
) -> Array:
    """Skinned vertices (n, 3) in a pose: positions (n, K, 3) and rotations (n, K, 4) of their joints."""
    bound = np.zeros_like(points)
    for k in range(local.shape[1]):
        inside = np.einsum("nij,nj->ni", skin.linear[local[:, k]], points) + skin.shift[local[:, k]]
        bound += weights[:, k, None] * (positions[:, k] + rot.mul_vec(rotations[:, k], inside))
    return bound
