"""The humanoid bone maps of VRM 0.x, VRM 1.0 and VRM animations: which node is which bone.

Bones are called as in VRM 1.0 ("leftUpperArm"); those that carry a role of a Figure are in ``BONE_ROLES``.

References: VRM 0.x specification, "vrm.humanoid"; VRMC_vrm-1.0, humanoid.md; VRMC_vrm_animation-1.0.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

from sixpoint.errors import listed
from sixpoint.formats.gltf.document import Document
from sixpoint.formats.gltf.nodes import NodeTree

BONE_ROLES = MappingProxyType(
    {"hips": "pelvis", "head": "head"}
    | {
        f"{side}{bone}": f"{side[0]}_{role}"
        for side in ("left", "right")
        for bone, role in (
            ("Shoulder", "clavicle"),
            ("UpperArm", "shoulder"),
            ("LowerArm", "elbow"),
            ("Hand", "wrist"),
            ("UpperLeg", "hip"),
            ("LowerLeg", "knee"),
            ("Foot", "ankle"),
        )
    }
)
"""VRM bone -> role of a mapping."""

REQUIRED = ("hips", "spine", *(b for b in BONE_ROLES if b != "hips" and not b.endswith("Shoulder")))
"""Bones that every VRM avatar must have (VRM 1.0; 0.x asks for chest and neck as well)."""

_THUMBS = {  # VRM 0.x calls the bones of the thumb as those of the fingers
    f"{side}Thumb{old}": f"{side}Thumb{new}"
    for side in ("left", "right")
    for old, new in (("Proximal", "Metacarpal"), ("Intermediate", "Proximal"))
}


@dataclass(frozen=True)
class Humanoid:
    """A humanoid bone map.

    Attributes:
        kind: "VRM 0.x", "VRM 1.0" or "VRM animation".
        bones: Bone -> node.
    """

    kind: str
    bones: dict[str, int]

    @property
    def faces_back(self) -> bool:
        """Whether the avatar looks along -Z, as those of VRM 0.x do."""
        return self.kind == "VRM 0.x"


def find_humanoid(document: Document, tree: NodeTree) -> Humanoid | None:
    """The humanoid bone map of a file; None where it has none.

    Raises:
        FormatError: Required bones are missing, two bones are one node, or a .vrm is not a VRM.
    """
    extensions = document.extensions
    suffix = document.path.suffix.lower()
    bones: dict[str, int]
    if "VRMC_vrm" in extensions:
        kind, found = "VRM 1.0", extensions["VRMC_vrm"].get("humanoid", {}).get("humanBones", {})
        bones = {bone: entry["node"] for bone, entry in found.items()}
    elif "VRM" in extensions:
        entries = extensions["VRM"].get("humanoid", {}).get("humanBones", [])
        kind = "VRM 0.x"
        pairs = [(str(e.get("bone", "")), int(e.get("node", -1))) for e in entries]
        bones = {_THUMBS.get(bone, bone): node for bone, node in pairs if bone and node >= 0}
    elif "VRMC_vrm_animation" in extensions:
        kind = "VRM animation"
        found = extensions["VRMC_vrm_animation"].get("humanoid", {}).get("humanBones", {})
        bones = {bone: entry["node"] for bone, entry in found.items()}
    elif suffix == ".vrm":
        raise document.error(
            "this .vrm is no VRM: it has neither the extension VRM (0.x) nor VRMC_vrm (1.0); "
            "if it is a plain glTF, call it .glb"
        )
    elif suffix == ".vrma":
        raise document.error("this .vrma is no VRM animation: the extension VRMC_vrm_animation is missing")
    else:
        return None
    _check(document, tree, kind, bones)
    return Humanoid(kind, bones)


def _check(document: Document, tree: NodeTree, kind: str, bones: dict[str, int]) -> None:
    absent = [f"{bone} (node {node})" for bone, node in bones.items() if node >= len(tree.names)]
    if absent:
        raise document.error(f"humanoid bones on nodes that do not exist: {listed(absent)}")
    missing = [bone for bone in REQUIRED if bone not in bones]
    if missing:
        have = f"; it has: {listed(bones)}" if bones else ""
        raise document.error(f"the humanoid map ({kind}) lacks required bones: {listed(missing)}{have}")
    by_node: dict[int, str] = {}
    for bone, node in bones.items():
        if node in by_node:
            label = document.label("nodes", node)
            raise document.error(f"the humanoid bones {by_node[node]} and {bone} are the same {label}")
        by_node[node] = bone
