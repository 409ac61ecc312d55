"""A Motion as a GLB of its own: the skeleton as nodes, a shape as a skinned mesh.

Nodes stand in the skeleton's rest pose. End sites become nodes that are marked as such, so that they are
sites again when the file is read.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.motion import Motion
from sixpoint.body.skeleton import Skeleton
from sixpoint.body.surface.appearance import Appearance
from sixpoint.body.surface.shape import Shape
from sixpoint.errors import FigureError
from sixpoint.formats.gltf.builder import INDICES, VERTICES, Builder
from sixpoint.formats.gltf.keys import Keys
from sixpoint.formats.gltf.nodes import SITE
from sixpoint.formats.gltf.weights import pack_weights

Array = NDArray[np.float64]

GREY = [0.6, 0.6, 0.62, 1.0]


def format_figure(motion: Motion, shape: Shape | None = None, appearance: Appearance | None = None) -> bytes:
    """The bytes of a GLB.

    Args:
        motion: The movement; its skeleton is written.
        shape: A mesh on this skeleton.
        appearance: Colours of its vertices; grey by default.

    Raises:
        FigureError: The shape is bound to another number of joints, or has other vertices than the colours.
    """
    skeleton = motion.skeleton
    if shape is not None and len(shape.bind_positions) != len(skeleton):
        raise FigureError(
            f"the shape is bound to {len(shape.bind_positions)} joints, the motion has {len(skeleton)}"
        )
    if appearance is not None and (shape is None or len(appearance.colours) != len(shape.vertices)):
        raise FigureError("the colours are not those of the shape's vertices")
    builder = Builder()
    add_nodes(builder, skeleton)
    scene = [0]
    if shape is not None and len(shape.triangles):
        scene.append(_add_mesh(builder, skeleton, shape, appearance))
    builder.content |= {"scene": 0, "scenes": [{"nodes": scene}]}
    keys = Keys(builder, len(motion), motion.rate, motion.name)
    for k, joint in enumerate(motion.moving):
        rest = skeleton.offsets[joint]
        keys.add(joint, "translation", motion.translations[:, k], rest, whole=joint == 0)
    for joint in range(len(skeleton)):
        keys.add(joint, "rotation", motion.rotations[:, joint], rot.IDENTITY)
    keys.finish()
    return builder.to_glb()


def add_nodes(builder: Builder, skeleton: Skeleton) -> None:
    """Nodes 0 to J-1 are the joints in their order; then come the sites."""
    for joint, name in enumerate(skeleton.names):
        node: dict[str, Any] = {"name": name, "translation": skeleton.offsets[joint].tolist()}
        sites = [len(skeleton) + int(s) for s in skeleton.sites_of(joint)]
        children = [*skeleton.children[joint], *sites]
        builder.add("nodes", node | ({"children": children} if children else {}))
    for name, offset in zip(skeleton.site_names, skeleton.site_offsets, strict=True):
        builder.add("nodes", {"name": name, "translation": offset.tolist(), "extras": SITE})


def _add_mesh(builder: Builder, skeleton: Skeleton, shape: Shape, appearance: Appearance | None) -> int:
    """Mesh, skin and material; the index of the node that shows them."""
    joints, weights = pack_weights(shape.joints, shape.weights)
    attributes = {
        "POSITION": builder.add_accessor(shape.vertices, target=VERTICES, bounds=True),
        "NORMAL": builder.add_accessor(_normals(shape), target=VERTICES),
    }
    small = "<u1" if len(skeleton) <= 256 else "<u2"
    for k in range(joints.shape[1] // 4):
        here = slice(4 * k, 4 * k + 4)
        attributes[f"JOINTS_{k}"] = builder.add_accessor(joints[:, here], small, target=VERTICES)
        attributes[f"WEIGHTS_{k}"] = builder.add_accessor(weights[:, here], target=VERTICES)
    colour = GREY
    if appearance is not None:
        attributes["COLOR_0"] = builder.add_accessor(appearance.colours, target=VERTICES)
        colour = [1.0, 1.0, 1.0, 1.0]
    surface = {"baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.8}
    material: dict[str, Any] = {"name": shape.name, "pbrMetallicRoughness": surface}
    size = "<u2" if len(shape.vertices) < 65535 else "<u4"
    primitive = {
        "attributes": attributes,
        "indices": builder.add_accessor(shape.triangles.reshape(-1), size, target=INDICES),
        "material": builder.add("materials", material),
    }
    inverse = np.tile(np.eye(4), (len(skeleton), 1, 1))
    back = rot.inv(shape.bind_rotations)
    inverse[:, :3, :3] = rot.mul_vec(back[:, None], np.eye(3)).transpose(0, 2, 1)
    inverse[:, :3, 3] = -rot.mul_vec(back, shape.bind_positions)
    matrices = builder.add_accessor(inverse.transpose(0, 2, 1).reshape(-1, 16))  # by columns
    skin = {"joints": list(range(len(skeleton))), "skeleton": 0, "inverseBindMatrices": matrices}
    node = {
        "name": _free_name(shape.name, skeleton),
        "mesh": builder.add("meshes", {"name": shape.name, "primitives": [primitive]}),
        "skin": builder.add("skins", skin),
    }
    return builder.add("nodes", node)


def _free_name(name: str, skeleton: Skeleton) -> str:
    while name in skeleton.names:
        name += "_mesh"
    return name


def _normals(shape: Shape) -> Array:
    """(V, 3) unit normals, the triangles' weighted by their area; up where a vertex has no extent."""
    corners = shape.vertices[shape.triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(shape.vertices)
    for k in range(3):
        np.add.at(normals, shape.triangles[:, k], area)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 1e-20, normals / np.where(length > 1e-20, length, 1.0), (0.0, 1.0, 0.0))
