"""A Motion as a VRM animation (.vrma): humanoid bones only, which any VRM avatar can play.

The nodes are the bones in the T-pose, all frames aligned with the world, facing +Z, as the specification asks
of the rest pose; the hips also translate. Of a VRM avatar these are the bones of its humanoid map, with toes
and fingers; of any other figure its joints are shared out among bones as in ``body/human_bones.py``.

Reference: VRM consortium, VRMC_vrm_animation-1.0, README.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.human_bones import BonePoser
from sixpoint.body.motion import Motion
from sixpoint.body.soles import ankle_height
from sixpoint.errors import FigureError, listed
from sixpoint.formats.gltf.avatar import Avatar
from sixpoint.formats.gltf.builder import Builder
from sixpoint.formats.gltf.humanoid import REQUIRED
from sixpoint.formats.gltf.keys import Keys

Array = NDArray[np.float64]

NOT_WRITTEN = ("leftEye", "rightEye")
"""Bones that the specification keeps out of the map: where an avatar looks is said otherwise."""


@dataclass(frozen=True, eq=False)
class _Bones:
    """A movement of B humanoid bones.

    Attributes:
        names: As VRM calls them.
        parents: (B,) the hips' is -1.
        offsets: (B, 3) in the parent in the T-pose [m]; the hips' is their place.
        rotations: (F, B, 4) local, from the T-pose.
        hips: (F, 3) places of the hips [m].
    """

    names: list[str]
    parents: list[int]
    offsets: Array
    rotations: Array
    hips: Array


def format_vrma(motion: Motion, avatar: Avatar | None = None) -> bytes:
    """The bytes of a .vrma file.

    Args:
        motion: The movement.
        avatar: Whose movement it is; by default the anatomy is found in the motion.

    Raises:
        FigureError: The rig is not a human's, or lacks bones that VRM requires; or it is not the avatar's.
    """
    if avatar is not None:
        avatar.check_rig(motion)
    if avatar is not None and avatar.humanoid is not None:
        bones = _bones_of_map(motion, avatar)
    else:
        bones = _bones_of_figure(motion, Figure.from_motion(motion) if avatar is None else avatar.figure)
    missing = [bone for bone in REQUIRED if bone not in bones.names]
    if missing:
        raise FigureError(f"a VRM animation needs bones that this figure lacks: {listed(missing)}")
    builder = Builder()
    for k, name in enumerate(bones.names):
        node: dict[str, Any] = {"name": name, "translation": bones.offsets[k].tolist()}
        children = [c for c, parent in enumerate(bones.parents) if parent == k]
        builder.add("nodes", node | ({"children": children} if children else {}))
    keys = Keys(builder, len(motion), motion.rate, motion.name)
    hips = bones.names.index("hips")
    keys.add(hips, "translation", bones.hips, bones.offsets[hips], whole=True)
    for k in range(len(bones.names)):
        keys.add(k, "rotation", bones.rotations[:, k], rot.IDENTITY)
    keys.finish()
    found = {name: {"node": k} for k, name in enumerate(bones.names)}
    builder.content |= {
        "scene": 0,
        "scenes": [{"nodes": [hips]}],
        "extensionsUsed": ["VRMC_vrm_animation"],
        "extensions": {"VRMC_vrm_animation": {"specVersion": "1.0", "humanoid": {"humanBones": found}}},
    }
    return builder.to_glb()


def _bones_of_map(motion: Motion, avatar: Avatar) -> _Bones:
    """The bones of a humanoid map, whose rest pose is the T-pose already."""
    assert avatar.humanoid is not None
    skeleton, nodes = avatar.figure.skeleton, avatar.rig.nodes
    by_joint = {nodes.index(n): bone for bone, n in avatar.humanoid.bones.items() if bone not in NOT_WRITTEN}
    joints = sorted(by_joint)  # parents first
    parents = []
    for joint in joints:
        above = [j for j in skeleton.path(0, joint)[:-1] if j in by_joint]
        parents.append(joints.index(above[-1]) if above else -1)
    if parents.count(-1) != 1:
        raise FigureError("not all bones of the humanoid map hang on the hips")
    resting = skeleton.compute_transforms(np.tile(rot.IDENTITY, (len(skeleton), 1)))[0][joints]
    offsets = np.array([p - resting[up] if up >= 0 else p for p, up in zip(resting, parents, strict=True)])
    positions, world = motion.transforms
    turned = world[:, joints]
    local = np.stack(
        [
            rot.mul(rot.inv(turned[:, up]), turned[:, k]) if up >= 0 else turned[:, k]
            for k, up in enumerate(parents)
        ],
        axis=1,
    )
    return _Bones(
        [by_joint[j] for j in joints], parents, offsets, local, positions[:, joints[parents.index(-1)]]
    )


def _bones_of_figure(motion: Motion, figure: Figure) -> _Bones:
    poser = BonePoser(figure, upper_chest=True, chords=True)
    names = [_lowered(name) for name in poser.bones]
    parents = [names.index(_lowered(b.parent)) if b.parent else -1 for b in poser.bones.values()]
    offsets = poser.offsets.copy()
    offsets[0] = (0.0, _hips_height(figure), 0.0)
    return _Bones(names, parents, offsets, poser.follow_chords(motion), poser.compute_hips(motion))


def _lowered(name: str) -> str:
    """Unity's name of a bone as VRM spells it."""
    return name[0].lower() + name[1:]


def _hips_height(figure: Figure) -> float:
    """Height of the pelvis joint over the soles of the standing figure [m]."""
    rest, roles = figure.rest_positions, figure.roles
    return float(rest[roles.pelvis, 1] - rest[list(roles.ankle), 1].mean()) + ankle_height(figure)
