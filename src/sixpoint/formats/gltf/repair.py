"""What many exporters get wrong, put right when an avatar is written: nothing that anybody would see.

Bounds of positions that are not those of the numbers, normals and rotations of another length than one,
weights that do not sum to one or name a joint twice, a skeleton that is not above its joints, empty lists.

Reference: Khronos glTF validator, ISSUES.md: errors of the kinds DATA and SEMANTIC.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.formats.gltf.accessors import read_floats, read_indices
from sixpoint.formats.gltf.builder import VERTICES, Builder
from sixpoint.formats.gltf.document import Document
from sixpoint.formats.gltf.nodes import NodeTree
from sixpoint.formats.gltf.weights import pack_weights

Array = NDArray[np.float64]

NOT_UNIT = 0.005
"""A vector whose length is off by more is no unit vector; the validator's limit is 0.0067."""
SUM_OFF = 1e-7
"""Weights of a vertex may miss one by this much for each joint; the validator's limit is 2e-7."""


@dataclass(frozen=True, eq=False)
class Repair:
    """An attribute that gets other numbers.

    Attributes:
        attributes: The attributes of a primitive, in the content that is written.
        name: Which; it was taken out of them.
        source: Accessors that it came from; what primitives shared stays shared.
        values: (V, 3) or (V, 4).
        dtype: Their component type.
    """

    attributes: dict[str, Any]
    name: str
    source: tuple[int, ...]
    values: NDArray[Any]
    dtype: str = "<f4"


def apply_repairs(builder: Builder, repairs: list[Repair]) -> None:
    """Add the numbers to the file and use them."""
    made: dict[tuple[str, tuple[int, ...]], int] = {}
    for repair in repairs:
        key = repair.name, repair.source
        if key not in made:
            made[key] = builder.add_accessor(repair.values, repair.dtype, target=VERTICES)
        repair.attributes[repair.name] = made[key]


def find_repairs(document: Document, content: dict[str, Any]) -> list[Repair]:
    """Put right what stands in the JSON, and find what other numbers are needed.

    Args:
        document: The file as it was read.
        content: A copy of its JSON with the same indices; it is changed.
    """
    repairs: list[Repair] = []
    for m, mesh in enumerate(content.get("meshes", [])):
        for p, primitive in enumerate(mesh["primitives"]):
            label = f"{document.label('meshes', m)}, primitive {p}"
            for table in (primitive["attributes"], *primitive.get("targets", [])):
                _set_bounds(document, content, table, label)
            repairs += _find_vectors(document, primitive["attributes"], label)
            repairs += _find_weights(document, primitive["attributes"], label)
    return repairs


def tidy(content: dict[str, Any], tree: NodeTree) -> None:
    """Put right nodes, skins and empty lists of a copy of the JSON."""
    for k, node in enumerate(content.get("nodes", [])):
        if "rotation" in node and abs(np.linalg.norm(node["rotation"]) - 1.0) > 1e-6:
            node["rotation"] = tree.rotations[k].tolist()
        if not node.get("children", True):
            del node["children"]
    for skin in content.get("skins", []):
        if not all(skin.get("skeleton", -1) in tree.path(joint) for joint in skin["joints"]):
            skin.pop("skeleton", None)
    for key in [key for key, value in content.items() if value in ([], {})]:
        del content[key]


def _plain(document: Document, index: int) -> bool:
    """Whether an accessor holds single precision numbers as they are."""
    accessor = document.items("accessors")[index]
    return accessor["componentType"] == 5126 and "sparse" not in accessor and "bufferView" in accessor


def _set_bounds(document: Document, content: dict[str, Any], table: dict[str, int], label: str) -> None:
    index = table.get("POSITION")
    if index is not None and _plain(document, index):
        values = read_floats(document, index, "VEC3", f"POSITION of {label}")
        if not len(values):
            return
        content["accessors"][index] |= {
            "min": values.min(axis=0).tolist(),
            "max": values.max(axis=0).tolist(),
        }


def _find_vectors(document: Document, attributes: dict[str, Any], label: str) -> Iterator[Repair]:
    """Normals that are no unit vectors; such tangents are left out, since viewers make their own."""
    if "NORMAL" in attributes and _plain(document, attributes["NORMAL"]):
        values = read_floats(document, attributes["NORMAL"], "VEC3", f"NORMAL of {label}")
        length = np.linalg.norm(values, axis=1, keepdims=True)
        if np.any(np.abs(length - 1.0) > NOT_UNIT):
            none = length < 1e-12
            source = (attributes.pop("NORMAL"),)
            values = np.where(none, (0.0, 1.0, 0.0), values / np.where(none, 1.0, length))
            yield Repair(attributes, "NORMAL", source, values)
    if "TANGENT" in attributes and _plain(document, attributes["TANGENT"]):
        values = read_floats(document, attributes["TANGENT"], "VEC4", f"TANGENT of {label}")
        length = np.linalg.norm(values[:, :3], axis=1)
        if np.any(np.abs(length - 1.0) > NOT_UNIT) or np.any(np.abs(values[:, 3]) != 1.0):
            del attributes["TANGENT"]


def _find_weights(document: Document, attributes: dict[str, Any], label: str) -> Iterator[Repair]:
    sets = [k for k in range(2) if f"JOINTS_{k}" in attributes and f"WEIGHTS_{k}" in attributes]
    if not sets or "JOINTS_2" in attributes:
        return
    joints = [
        read_indices(document, attributes[f"JOINTS_{k}"], "VEC4", f"JOINTS_{k} of {label}") for k in sets
    ]
    shares = [
        read_floats(document, attributes[f"WEIGHTS_{k}"], "VEC4", f"WEIGHTS_{k} of {label}") for k in sets
    ]
    if len({len(rows) for rows in (*joints, *shares)}) > 1 or not len(joints[0]):
        return
    picked, weights = np.hstack(joints), np.maximum(np.hstack(shares), 0.0)
    off = np.abs(weights.sum(axis=1) - 1.0) > SUM_OFF * np.sum(weights > 0, axis=1)
    ordered = np.sort(np.where(weights > 0, picked, -1 - np.arange(picked.shape[1])), axis=1)
    twice = np.any(np.diff(ordered, axis=1) == 0, axis=1)
    stray = np.any((weights == 0) & (picked != 0), axis=1)
    if not np.any(off | twice | stray):
        return
    weights[weights.sum(axis=1) == 0, 0] = 1.0
    packed, shared = pack_weights(picked, weights)
    source = tuple(attributes.pop(f"{name}_{k}") for k in sets for name in ("JOINTS", "WEIGHTS"))
    small = "<u1" if packed.max() < 256 else "<u2"
    for k in range(packed.shape[1] // 4):
        here = slice(4 * k, 4 * k + 4)
        yield Repair(attributes, f"JOINTS_{k}", source, packed[:, here], small)
        yield Repair(attributes, f"WEIGHTS_{k}", source, shared[:, here])
