"""Characters to test with, made from one table of bones: one body as different exporters write it."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from sixpoint.formats.gltf.builder import Builder

# VRM bone: parent, place in the T-pose [m]; Y up, facing +Z, left is +X.
BONES: dict[str, tuple[str, tuple[float, float, float]]] = {
    "hips": ("", (0.0, 0.98, 0.0)),
    "spine": ("hips", (0.0, 1.08, -0.01)),
    "chest": ("spine", (0.0, 1.22, -0.01)),
    "neck": ("chest", (0.0, 1.46, -0.01)),
    "head": ("neck", (0.0, 1.55, 0.0)),
    "leftShoulder": ("chest", (0.03, 1.42, -0.01)),
    "leftUpperArm": ("leftShoulder", (0.17, 1.41, -0.01)),
    "leftLowerArm": ("leftUpperArm", (0.45, 1.41, -0.01)),
    "leftHand": ("leftLowerArm", (0.70, 1.41, -0.01)),
    "rightShoulder": ("chest", (-0.03, 1.42, -0.01)),
    "rightUpperArm": ("rightShoulder", (-0.17, 1.41, -0.01)),
    "rightLowerArm": ("rightUpperArm", (-0.45, 1.41, -0.01)),
    "rightHand": ("rightLowerArm", (-0.70, 1.41, -0.01)),
    "leftUpperLeg": ("hips", (0.09, 0.93, 0.0)),
    "leftLowerLeg": ("leftUpperLeg", (0.09, 0.51, 0.01)),
    "leftFoot": ("leftLowerLeg", (0.09, 0.09, -0.01)),
    "leftToes": ("leftFoot", (0.09, 0.02, 0.13)),
    "rightUpperLeg": ("hips", (-0.09, 0.93, 0.0)),
    "rightLowerLeg": ("rightUpperLeg", (-0.09, 0.51, 0.01)),
    "rightFoot": ("rightLowerLeg", (-0.09, 0.09, -0.01)),
    "rightToes": ("rightFoot", (-0.09, 0.02, 0.13)),
}
NAMES = tuple(BONES)
PLACES = np.array([place for _, place in BONES.values()])
PARENTS = np.array([NAMES.index(parent) if parent else -1 for parent, _ in BONES.values()])


@dataclass
class Style:
    """How an exporter writes the body.

    Attributes:
        vrm: 0, 1 or None for plain glTF.
        turned: Random bone frames, instead of frames aligned with the world.
        z_up: A matrix node above the skeleton turns a Z-up world up.
        scale: Of the armature node; the joints are written smaller by it.
        names: Write the bones' names.
        mesh: "skin", "two skins" (body and head), "rigid" (on the joints' nodes) or "none".
        pose: (J, 4) local turns of the nodes from the bind pose; None leaves them in it.
        small: Weights as bytes, joints as shorts, interleaved.
        sword: A rigid mesh on the right hand, on a mirrored and unevenly scaled node of its own.
        more: Changes to the finished document, called with the builder and the joints' nodes.
    """

    vrm: int | None = None
    turned: bool = False
    z_up: bool = False
    scale: float = 1.0
    names: bool = True
    mesh: str = "skin"
    pose: np.ndarray | None = None
    small: bool = False
    sword: bool = False
    more: Any = None


STYLES = {
    "vrm0": Style(vrm=0),
    "vrm1": Style(vrm=1, turned=True, mesh="two skins"),
    "cesium": Style(z_up=True, turned=True, names=False),
    "knight": Style(scale=0.01, turned=True, small=True, sword=True),
    "robot": Style(turned=True, mesh="rigid", scale=2.0),
    "bones": Style(vrm=1, mesh="none"),
}
EXTENSIONS = {"vrm0": ".vrm", "vrm1": ".vrm", "bones": ".vrm"}


def octahedron(a: np.ndarray, b: np.ndarray, radius: float = 0.04) -> tuple[np.ndarray, np.ndarray]:
    """A closed double pyramid from a to b: vertices (6, 3) and triangles (8, 3), outside is outside."""
    way = b - a if np.linalg.norm(b - a) > 1e-6 else np.array([0.0, 0.06, 0.0])
    along = way / np.linalg.norm(way)
    side = np.cross(along, [0.31, 0.62, 0.72])
    side /= np.linalg.norm(side)
    third = np.cross(along, side)
    middle = a + 0.3 * way
    ring = [middle + radius * v for v in (side, third, -side, -third)]
    triangles = [(0, 1 + (k + 1) % 4, 1 + k) for k in range(4)] + [
        (5, 1 + k, 1 + (k + 1) % 4) for k in range(4)
    ]
    return np.array([a, *ring, a + way]), np.array(triangles)


def body_mesh(bones: list[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A double pyramid per bone: vertices, triangles, joints (V, 2) and weights (V, 2)."""
    vertices, triangles, joints, weights = [], [], [], []
    for bone in bones:
        children = np.flatnonzero(bone == PARENTS)
        tip = PLACES[children[0]] if len(children) else PLACES[bone] + [0.0, 0.02, 0.08]
        points, faces = octahedron(PLACES[bone], tip)
        triangles.append(faces + 6 * len(vertices))
        vertices.append(points)
        shared = PARENTS[bone] in bones
        joints += [[bone, PARENTS[bone] if shared else bone]] * 6
        weights += [[0.75, 0.25] if shared else [1.0, 0.0]] * 2 + [[1.0, 0.0]] * 4
    return np.concatenate(vertices), np.concatenate(triangles), np.array(joints), np.array(weights)


def png(size: int = 4) -> bytes:
    """A small picture: red in the left half, blue in the right."""
    from PIL import Image

    picture = Image.new("RGB", (size, size), (255, 0, 0))
    picture.paste((0, 0, 255), (size // 2, 0, size, size))
    stream = io.BytesIO()
    picture.save(stream, "PNG")
    return stream.getvalue()


def make_avatar(style: Style | str) -> bytes:
    """The bytes of a GLB."""
    style = STYLES[style] if isinstance(style, str) else style
    builder = Builder()
    facing = Rotation.from_rotvec([0.0, np.pi if style.vrm == 0 else 0.0, 0.0])
    # The bind pose in the file's world, then in the space below the armature node.
    frames = Rotation.random(len(BONES), random_state=3) if style.turned else Rotation.identity(len(BONES))
    upright = Rotation.from_euler("x", -90, degrees=True) if style.z_up else Rotation.identity()
    world, places = facing * frames, facing.apply(PLACES)
    world, places = upright.inv() * world, upright.inv().apply(places) / style.scale
    armature: dict[str, Any] = {"name": "Armature", "scale": [style.scale] * 3}
    if style.z_up:
        matrix = np.eye(4)
        matrix[:3, :3] = upright.as_matrix() * style.scale
        armature = {"name": "Z_UP", "matrix": matrix.T.ravel().tolist()}
    builder.add("nodes", armature | {"children": [1]})
    for k, name in enumerate(NAMES):
        parent = PARENTS[k]
        up, origin = (world[parent], places[parent]) if parent >= 0 else (Rotation.identity(), np.zeros(3))
        local = up.inv() * world[k]
        if style.pose is not None:
            local = local * Rotation.from_quat(style.pose[k])
        node: dict[str, Any] = {
            "translation": up.inv().apply(places[k] - origin).tolist(),
            "rotation": local.as_quat().tolist(),
        }
        if style.names:
            node["name"] = name
        children = [int(c) + 1 for c in np.flatnonzero(k == PARENTS)]
        builder.add("nodes", node | ({"children": children} if children else {}))
    scene = [0]
    if style.mesh != "none":
        scene += _add_meshes(builder, style, world, places, facing, upright)
    builder.content |= {"scene": 0, "scenes": [{"nodes": scene}]}
    nodes = {name: k + 1 for k, name in enumerate(NAMES)}
    if style.vrm == 0:
        bones = [{"bone": name, "node": node, "useDefaultValues": True} for name, node in nodes.items()]
        builder.content["extensions"] = {
            "VRM": {"humanoid": {"humanBones": bones}, "meta": {"title": "test"}}
        }
        builder.content["extensionsUsed"] = ["VRM"]
    elif style.vrm == 1:
        found = {name: {"node": node} for name, node in nodes.items()}
        extension = {"specVersion": "1.0", "humanoid": {"humanBones": found}, "meta": {"name": "test"}}
        builder.content |= {"extensions": {"VRMC_vrm": extension}, "extensionsUsed": ["VRMC_vrm"]}
    if style.more is not None:
        style.more(builder, nodes)
    return builder.to_glb()


def _add_meshes(
    builder: Builder, style: Style, world: Rotation, places: np.ndarray, facing: Rotation, upright: Rotation
) -> list[int]:
    """Material, meshes, skins; the scene's new roots."""
    image = builder.add("images", {"bufferView": builder.add_view(png()), "mimeType": "image/png"})
    texture = builder.add("textures", {"source": image, "sampler": builder.add("samplers", {"wrapS": 33071})})
    surface = {"baseColorTexture": {"index": texture}, "baseColorFactor": [0.5, 0.5, 1.0, 1.0]}
    material = builder.add("materials", {"name": "skin", "pbrMetallicRoughness": surface})
    if style.mesh == "rigid":
        for bone in range(len(BONES)):
            vertices, triangles, _, _ = body_mesh([bone])
            local = (
                world[bone]
                .inv()
                .apply(upright.inv().apply(facing.apply(vertices)) / style.scale - places[bone])
            )
            primitive = _primitive(builder, local, triangles, material)
            mesh = builder.add("meshes", {"primitives": [primitive]})
            builder.content["nodes"][bone + 1]["mesh"] = mesh
        return []
    if style.sword:
        vertices, triangles = octahedron(np.zeros(3), np.array([0.0, 1.0, 0.0]))
        hand = NAMES.index("rightHand")
        mesh = builder.add("meshes", {"primitives": [_primitive(builder, vertices, triangles, material)]})
        node = {
            "name": "sword",
            "mesh": mesh,
            "scale": [-1.0 / style.scale, 0.5 / style.scale, 1.0 / style.scale],
        }
        builder.content["nodes"][hand + 1].setdefault("children", []).append(builder.add("nodes", node))
    inverse = np.tile(np.eye(4), (len(BONES), 1, 1))
    inverse[:, :3, :3] = world.inv().as_matrix()
    inverse[:, :3, 3] = -world.inv().apply(places)
    groups = [list(range(len(BONES)))]
    if style.mesh == "two skins":
        head = [NAMES.index("neck"), NAMES.index("head")]
        groups = [[b for b in groups[0] if b not in head], head]
    roots = []
    for group in groups:
        vertices, triangles, joints, weights = body_mesh(group)
        vertices = upright.inv().apply(facing.apply(vertices)) / style.scale
        carriers = sorted(set(joints.ravel()))
        primitive = _primitive(builder, vertices, triangles, material)
        local = np.searchsorted(carriers, joints)
        local[weights == 0] = 0
        _add_weights(builder, primitive, local, weights, style.small)
        matrices = inverse[carriers].transpose(0, 2, 1).reshape(-1, 16)
        skin = {
            "joints": [int(c) + 1 for c in carriers],
            "inverseBindMatrices": builder.add_accessor(matrices),
        }
        node = {
            "name": f"mesh_{len(group)}",
            "mesh": builder.add("meshes", {"primitives": [primitive]}),
            "skin": builder.add("skins", skin),
        }
        roots.append(builder.add("nodes", node))
    return roots


def _primitive(
    builder: Builder, vertices: np.ndarray, triangles: np.ndarray, material: int
) -> dict[str, Any]:
    uv = np.column_stack([np.where(vertices[:, 0] > 0, 0.25, 0.75), np.full(len(vertices), 0.5)]).astype(
        "<f4"
    )
    coordinates = {
        "bufferView": builder.add_view(uv.tobytes(), 34962),
        "componentType": 5126,
        "count": len(uv),
        "type": "VEC2",
    }
    return {
        "attributes": {
            "POSITION": builder.add_accessor(vertices, target=34962, bounds=True),
            "TEXCOORD_0": builder.add("accessors", coordinates),
        },
        "indices": builder.add_accessor(triangles.reshape(-1), "<u2", target=34963),
        "material": material,
    }


def _add_weights(
    builder: Builder, primitive: dict[str, Any], joints: np.ndarray, weights: np.ndarray, small: bool
) -> None:
    full = np.zeros((len(joints), 4), np.int64), np.zeros((len(joints), 4))
    full[0][:, :2], full[1][:, :2] = joints, weights
    attributes = primitive["attributes"]
    if not small:
        attributes["JOINTS_0"] = builder.add_accessor(full[0], "<u1", target=34962)
        attributes["WEIGHTS_0"] = builder.add_accessor(full[1], target=34962)
        return
    # Interleaved: four shorts of joints, four bytes of weights.
    rows = np.zeros(len(joints), [("joints", "<u2", 4), ("weights", "u1", 4)])
    rows["joints"] = full[0]
    rows["weights"] = np.round(full[1] * 255)
    rows["weights"][:, 0] = 255 - rows["weights"][:, 1:].sum(axis=1)
    view = builder.add_view(rows.tobytes(), 34962, byteStride=12)
    more = {"bufferView": view, "count": len(rows), "type": "VEC4"}
    attributes["JOINTS_0"] = builder.add("accessors", more | {"componentType": 5123})
    more |= {"byteOffset": 8, "componentType": 5121, "normalized": True}
    attributes["WEIGHTS_0"] = builder.add("accessors", more)
