"""A Motion as a VRM animation (.vrma): humanoid bones only, which any VRM avatar can play.

The nodes are the bones of a figure in the T-pose, all frames aligned with the world, facing +Z, as the
specification asks of the rest pose; the hips also translate. A figure's joints become bones as in
``body/human_bones.py``.

Reference: VRM consortium, VRMC_vrm_animation-1.0, README.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.human_bones import BonePoser
from sixpoint.body.motion import Motion
from sixpoint.errors import FigureError, listed
from sixpoint.formats.gltf.builder import Builder
from sixpoint.formats.gltf.humanoid import REQUIRED
from sixpoint.formats.gltf.keys import Keys

Array = NDArray[np.float64]


def format_vrma(motion: Motion, figure: Figure | None = None) -> bytes:
    """The bytes of a .vrma file.

    Args:
        motion: The movement.
        figure: The anatomy of its rig; found in the motion by default.

    Raises:
        FigureError: The rig is not a human's, or lacks bones that VRM requires.
    """
    figure = figure or Figure.from_motion(motion)
    poser = BonePoser(figure, upper_chest=True)
    names = [name[0].lower() + name[1:] for name in poser.bones]
    missing = [bone for bone in REQUIRED if bone not in names]
    if missing:
        raise FigureError(f"a VRM animation needs bones that this figure lacks: {listed(missing)}")
    parents = [
        names.index(b.parent[0].lower() + b.parent[1:]) if b.parent else -1 for b in poser.bones.values()
    ]
    offsets = poser.offsets.copy()
    offsets[0] = (0.0, _hips_height(figure), 0.0)
    builder = Builder()
    for k, name in enumerate(names):
        node: dict[str, Any] = {"name": name, "translation": offsets[k].tolist()}
        children = [c for c, parent in enumerate(parents) if parent == k]
        builder.add("nodes", node | ({"children": children} if children else {}))
    rotations = poser.compute_rotations(motion)
    keys = Keys(builder, len(motion), motion.rate, motion.name)
    keys.add(0, "translation", poser.compute_hips(motion), offsets[0], whole=True)
    for k in range(len(names)):
        keys.add(k, "rotation", rotations[:, k], rot.IDENTITY)
    keys.finish()
    bones = {name: {"node": k} for k, name in enumerate(names)}
    extension = {"specVersion": "1.0", "humanoid": {"humanBones": bones}}
    builder.content |= {
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "extensionsUsed": ["VRMC_vrm_animation"],
        "extensions": {"VRMC_vrm_animation": extension},
    }
    return builder.to_glb()


def _hips_height(figure: Figure) -> float:
    """Height of the pelvis joint over the lowest point of the standing figure [m]."""
    rest = figure.rest_positions
    sites = rest[figure.skeleton.site_parents] + rot.mul_vec(
        figure.neutral[figure.skeleton.site_parents], figure.skeleton.site_offsets
    )
    return float(rest[figure.roles.pelvis, 1] - min(rest[:, 1].min(), sites[:, 1].min(initial=np.inf)))
