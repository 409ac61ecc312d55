"""Meshes that are skinned to a skeleton, as one surface."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.surface.shape import Shape
from sixpoint.errors import FormatError
from sixpoint.formats.source import LARGEST
from sixpoint.formats.usd.matrices import ALIKE
from sixpoint.formats.usd.rig import Rig

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def read_shape(usd: Any, rig: Rig, binding: Any, path: Path, sizes: Array) -> Shape | None:
    """All meshes skinned to the rig as one surface in its bind pose, in the world's size; None without any.

    Polygons become triangles, fans about their first corner. Blend shapes are left out, and dual-quaternion
    skinning is taken as linear.

    Args:
        usd: The modules of usd-core.
        rig: The skeleton.
        binding: What is bound to it, ``UsdSkel.Binding``; None without any.
        path: For messages.
        sizes: (J,) scale of each joint in the animated world.

    Raises:
        FormatError: A mesh is damaged, or its skinning does not fit the skeleton.
    """
    parts = []
    for query in binding.GetSkinningTargets() if binding is not None else []:
        prim = query.GetPrim()
        if prim.IsA(usd.UsdGeom.Mesh) and query.HasJointInfluences():
            parts.append(_read_mesh(usd, rig, query, path))
    parts = [part for part in parts if len(part[0])]
    if not parts:
        return None
    most = max(part[2].shape[1] for part in parts)
    starts = np.cumsum([0, *(len(part[0]) for part in parts)])
    if not rig.bind.is_uniform.all():
        raise FormatError(path, f"bindTransforms of {rig.path} are scaled unevenly")
    growth = sizes / rig.bind.scales.mean(axis=-1)
    if np.ptp(growth) > ALIKE * growth.max():
        raise FormatError(
            path,
            f"joints of {rig.path} are scaled against the bind pose by {growth.min():g} to {growth.max():g}; "
            "only one scale for all can be read",
        )
    scale = float(growth.mean()) if np.abs(growth - 1.0).max() > ALIKE / 4 else 1.0
    turned = rot.mul(rig.bind.rotations, rot.inv(rig.rest_world))
    return Shape(
        np.concatenate([part[0] for part in parts]) * scale,
        np.concatenate([part[1] + start for part, start in zip(parts, starts, strict=False)]),
        np.concatenate([_widened(part[2], most) for part in parts]),
        np.concatenate([_widened(part[3], most) for part in parts]),
        rig.bind.translations * scale,
        rot.normalised(turned),
        parts[0][4],
    )


def _read_mesh(usd: Any, rig: Rig, query: Any, path: Path) -> tuple[Array, Index, Index, Array, str]:
    """Vertices in the bind pose, triangles, joints, weights and name of one mesh."""
    prim = query.GetPrim()
    mesh, at = usd.UsdGeom.Mesh(prim), str(prim.GetPath())
    time = usd.Usd.TimeCode.EarliestTime()
    points = np.array(mesh.GetPointsAttr().Get(time) or np.zeros((0, 3)), float)
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get(time) or [], np.int64)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get(time) or [], np.int64)
    if counts.sum() != len(corners) or np.any(counts < 0):
        raise FormatError(
            path, f"{at}: faceVertexCounts ask for {counts.sum()} corners, there are {len(corners)}"
        )
    if len(corners) and not (corners.min() >= 0 and corners.max() < len(points)):
        raise FormatError(path, f"{at}: a face has a point that does not exist; there are {len(points)}")
    if not np.all(np.abs(points) < LARGEST):
        raise FormatError(path, f"{at}: points are not finite or far too large")
    triangles = triangulate(counts, corners)
    if mesh.GetOrientationAttr().Get() == usd.UsdGeom.Tokens.leftHanded:
        triangles = triangles[:, ::-1]
    joints, weights = _read_influences(rig, query, len(points), at, path)
    geometry = np.array(query.GetGeomBindTransform(), float)
    if not np.all(np.abs(geometry) < LARGEST):
        raise FormatError(path, f"{at}: geomBindTransform is not finite or far too large")
    vertices = points @ geometry[:3, :3] + geometry[3, :3]
    if np.linalg.det(geometry[:3, :3]) < 0:
        triangles = triangles[:, ::-1]
    return vertices, triangles, joints, weights, prim.GetDisplayName() or prim.GetName()


def _read_influences(rig: Rig, query: Any, count: int, at: str, path: Path) -> tuple[Index, Array]:
    found = query.ComputeVaryingJointInfluences(count)
    if not found or len(found[0]) % max(count, 1) or len(found[0]) != len(found[1]) or not len(found[0]):
        raise FormatError(path, f"{at}: joint indices and weights do not fit its {count} points")
    joints = np.array(found[0], np.int64).reshape(count, -1)
    weights = np.array(found[1], float).reshape(count, -1)
    own = query.GetJointOrder()
    if own:  # the mesh names its joints in an order of its own
        names = [str(name) for name in own]
        unknown = [name for name in names if name not in rig.index]
        if unknown:
            raise FormatError(path, f"{at} is bound to the joint {unknown[0]!r}, which {rig.path} lacks")
        order = np.array([rig.index[name] for name in names])
    else:
        order = np.arange(len(rig.index)) + rig.added
    if joints.min() < 0 or joints.max() >= len(order):
        raise FormatError(path, f"{at} is bound to joint {joints.max()}; there are {len(order)}")
    if not np.all(np.abs(weights) < LARGEST):
        raise FormatError(path, f"{at}: weights are not finite or far too large")
    weights = np.maximum(weights, 0.0)
    total = weights.sum(axis=1, keepdims=True)
    weights[total[:, 0] <= 0, 0] = 1.0  # carried by nobody: by the first
    return order[joints], weights / weights.sum(axis=1, keepdims=True)


def triangulate(counts: Index, corners: Index) -> Index:
    """(T, 3) triangles of polygons given by their numbers of corners: fans about the first one."""
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)
    fans = np.maximum(counts - 2, 0)
    first = np.repeat(starts, fans)
    step = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
    return np.stack([corners[first], corners[first + step + 1], corners[first + step + 2]], axis=1)


def _widened(values: NDArray[Any], columns: int) -> NDArray[Any]:
    return np.pad(values, ((0, 0), (0, columns - values.shape[1])))
