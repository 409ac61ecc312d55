"""An avatar's own file with another animation: materials, textures, meshes and extensions stay as they are.

The file's old animations go, with the numbers that only they used; external images and buffers come into the
GLB.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import numpy as np

from sixpoint.body import rotations as rot
from sixpoint.body.motion import Motion
from sixpoint.errors import FigureError
from sixpoint.formats.gltf.appearance import read_image
from sixpoint.formats.gltf.avatar import Avatar
from sixpoint.formats.gltf.builder import Builder
from sixpoint.formats.gltf.document import Document
from sixpoint.formats.gltf.keys import Keys

KNOWN = (
    "VRM",
    "VRMC_",
    "KHR_materials_",
    "KHR_texture_",
    "KHR_mesh_quantization",
    "KHR_lights_",
    "EXT_texture_",
)
"""Extensions that refer to no accessor or buffer view; with others nothing is taken out of the file."""

Slot = tuple[dict[str, Any], str]
"""An object and its key that holds an index."""


def format_avatar(motion: Motion, avatar: Avatar) -> bytes:
    """The bytes of a GLB of the avatar with one animation.

    Args:
        motion: On the avatar's skeleton.
        avatar: The avatar.

    Raises:
        FigureError: The motion is on another skeleton.
        FormatError: An image or a buffer of the avatar is missing.
    """
    rig, skeleton = avatar.rig, avatar.figure.skeleton
    if motion.skeleton is not skeleton and motion.skeleton.names != skeleton.names:
        raise FigureError(
            f"the motion is on another skeleton ({len(motion.skeleton)} joints) than the avatar "
            f"{avatar.name!r} ({len(skeleton)}): pose the avatar's figure from the motion's six points"
        )
    builder = _copy(avatar.document)
    keys = Keys(builder, len(motion), motion.rate, motion.name)
    local = rig.leave(motion.rotations)
    nodes = builder.content["nodes"]
    for joint, node in enumerate(rig.nodes):
        if node < 0:
            _add_root(builder.content, skeleton.names[0], [rig.nodes[c] for c in skeleton.children[0]])
            still = np.zeros(3), rot.IDENTITY
        else:
            still = rig.tree.translations[node], rig.tree.rotations[node]
        if "matrix" in nodes[node]:  # matrices cannot be animated
            del nodes[node]["matrix"]
            nodes[node]["translation"] = rig.tree.translations[node].tolist()
            nodes[node]["rotation"] = rig.tree.rotations[node].tolist()
            nodes[node]["scale"] = rig.tree.scales[node].tolist()
        if joint in motion.moving:
            place = motion.translations[:, motion.moving.index(joint)]
            there = rig.leave_place(joint, place)
            keys.add(node % len(nodes), "translation", there, still[0], whole=joint == 0)
        keys.add(node % len(nodes), "rotation", local[:, joint], still[1])
    keys.finish()
    return builder.to_glb()


def _add_root(content: dict[str, Any], name: str, children: list[int]) -> None:
    """Append a node above the roots of a body that has several."""
    content["nodes"].append({"name": name, "children": children})
    for scene in content.get("scenes", []):
        roots = scene.get("nodes", [])
        if any(node in roots for node in children):
            scene["nodes"] = [n for n in roots if n not in children] + [len(content["nodes"]) - 1]


def _copy(document: Document) -> Builder:
    """The document without animations, as far as possible without what only these used, in one buffer."""
    content = copy.deepcopy(document.content)
    content.pop("animations", None)
    views = content.pop("bufferViews", [])
    content.pop("buffers", None)
    builder = Builder(content)
    extensions = content.get("extensionsUsed", [])
    if all(name.startswith(KNOWN) for name in extensions):
        _keep_used(content, "accessors", list(_accessor_slots(content)))
        slots = list(_view_slots(content))
        kept = sorted({owner[key] for owner, key in slots})
    else:
        slots, kept = [], list(range(len(views)))
    for index in kept:
        view = views[index]
        start = view.get("byteOffset", 0)
        data = document.buffer(view["buffer"])[start : start + view["byteLength"]]
        more = {k: v for k, v in view.items() if k not in ("buffer", "byteOffset", "byteLength", "target")}
        builder.add_view(data, view.get("target"), **more)
    renumbered = {old: new for new, old in enumerate(kept)}
    for owner, key in slots:
        owner[key] = renumbered[owner[key]]
    for index, image in enumerate(content.get("images", [])):
        if "uri" in image:
            picture, kind = read_image(document, index)
            image.pop("uri")
            image |= {"bufferView": builder.add_view(picture), "mimeType": kind}
    return builder


def _keep_used(content: dict[str, Any], kind: str, slots: list[Slot]) -> None:
    """Drop the objects of an array to which no slot refers, and renumber."""
    kept = sorted({owner[key] for owner, key in slots})
    renumbered = {old: new for new, old in enumerate(kept)}
    items = content.pop(kind, [])
    if kept:
        content[kind] = [items[k] for k in kept]
    for owner, key in slots:
        owner[key] = renumbered[owner[key]]


def _accessor_slots(content: dict[str, Any]) -> Iterator[Slot]:
    for mesh in content.get("meshes", []):
        for primitive in mesh["primitives"]:
            for table in (primitive["attributes"], *primitive.get("targets", [])):
                yield from ((table, key) for key in table)
            if "indices" in primitive:
                yield primitive, "indices"
    for skin in content.get("skins", []):
        if "inverseBindMatrices" in skin:
            yield skin, "inverseBindMatrices"


def _view_slots(content: dict[str, Any]) -> Iterator[Slot]:
    for accessor in content.get("accessors", []):
        if "bufferView" in accessor:
            yield accessor, "bufferView"
        for part in ("indices", "values"):
            found = accessor.get("sparse", {}).get(part, {})
            if isinstance(found, dict) and isinstance(found.get("bufferView"), int):
                yield found, "bufferView"
    for image in content.get("images", []):
        if "bufferView" in image:
            yield image, "bufferView"
