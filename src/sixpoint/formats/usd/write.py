"""A motion, and the surface on its rig, as a USD stage."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.motion import Motion
from sixpoint.body.skeleton import Skeleton
from sixpoint.body.surface.shape import Shape
from sixpoint.errors import FormatError
from sixpoint.formats.usd import SITES
from sixpoint.formats.usd.library import import_usd
from sixpoint.formats.usd.matrices import compose

Array = NDArray[np.float64]

CHUNK = 256  # frames whose vertices are placed at once to find how far they go


def format_usd(motion: Motion, path: Path, shape: Shape | None = None) -> bytes:
    """The bytes of a .usd, .usda or .usdc file: metres, Y up, one time code per frame.

    Args:
        motion: In metres, Y up.
        path: Its suffix says text or binary; its stem names the root.
        shape: A surface bound to the motion's joints.

    Raises:
        FormatError: usd-core is missing, or the shape is bound to another number of joints.
    """
    usd = import_usd(path)
    joints = len(motion.skeleton)
    if shape is not None and len(shape.bind_positions) != joints:
        raise FormatError(
            path, f"the shape is bound to {len(shape.bind_positions)} joints, the motion has {joints}"
        )
    stage = usd.Usd.Stage.CreateInMemory()
    usd.UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    usd.UsdGeom.SetStageUpAxis(stage, usd.UsdGeom.Tokens.y)
    stage.SetTimeCodesPerSecond(motion.rate)
    stage.SetFramesPerSecond(motion.rate)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(len(motion) - 1)
    stage.SetMetadata("comment", "Written by sixpoint")

    root = usd.UsdSkel.Root.Define(stage, f"/{usd.Tf.MakeValidIdentifier(path.stem)}")
    stage.SetDefaultPrim(root.GetPrim())
    at = root.GetPath()
    paths = joint_paths(usd, motion.skeleton)
    skeleton = _write_skeleton(usd, stage, at.AppendChild("Skeleton"), motion.skeleton, paths, shape)
    animation = _write_animation(usd, stage, at.AppendChild("Animation"), motion, paths)
    binding = usd.UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    if shape is not None:
        _write_mesh(usd, stage, at.AppendChild("Mesh"), skeleton, shape)
    low, high = find_extent(motion, shape)
    root.CreateExtentAttr(usd.Vt.Vec3fArray.FromNumpy(np.array([low, high], np.float32)))
    return _export(stage, path)


def joint_paths(usd: Any, skeleton: Skeleton) -> list[str]:
    """A path of valid USD names for each joint, ``Hips/Spine/Head``; distinct."""
    taken: set[str] = set()
    paths: list[str] = []
    for joint, name in enumerate(skeleton.names):
        valid = name if usd.Sdf.Path.IsValidIdentifier(name) else usd.Tf.MakeValidIdentifier(name)
        free, count = valid, 1
        while free in taken:
            count += 1
            free = f"{valid}_{count}"
        taken.add(free)
        paths.append(free if joint == 0 else f"{paths[skeleton.parents[joint]]}/{free}")
    return paths


def find_extent(motion: Motion, shape: Shape | None) -> tuple[Array, Array]:
    """The corners (3,) and (3,) of a box that holds joints and surface in all frames [m]."""
    positions, world = motion.transforms
    low, high = positions.min(axis=(0, 1)), positions.max(axis=(0, 1))
    if shape is not None:
        for start in range(0, len(motion), CHUNK):
            placed = shape.place(positions[start : start + CHUNK], world[start : start + CHUNK])
            low = np.minimum(low, placed.min(axis=(0, 1)))
            high = np.maximum(high, placed.max(axis=(0, 1)))
    return low, high


def _write_skeleton(
    usd: Any, stage: Any, at: Any, skeleton: Skeleton, paths: list[str], shape: Shape | None
) -> Any:
    prim = usd.UsdSkel.Skeleton.Define(stage, at)
    prim.CreateJointsAttr(paths)
    prim.CreateJointNamesAttr(list(skeleton.names))
    still = np.tile(rot.IDENTITY, (len(skeleton), 1))
    rest = compose(still, skeleton.offsets)
    bind = (
        compose(still, skeleton.compute_transforms(still)[0])
        if shape is None
        else compose(shape.bind_rotations, shape.bind_positions)
    )
    prim.CreateRestTransformsAttr(usd.Vt.Matrix4dArray.FromNumpy(rest))
    prim.CreateBindTransformsAttr(usd.Vt.Matrix4dArray.FromNumpy(bind))
    if skeleton.site_names:
        types = usd.Sdf.ValueTypeNames
        for name, kind, value in (
            ("names", types.StringArray, list(skeleton.site_names)),
            ("joints", types.IntArray, usd.Vt.IntArray.FromNumpy(skeleton.site_parents.astype(np.int32))),
            ("offsets", types.Double3Array, usd.Vt.Vec3dArray.FromNumpy(skeleton.site_offsets)),
        ):
            prim.GetPrim().CreateAttribute(f"{SITES}:{name}", kind, True).Set(value)
    return prim


def _write_animation(usd: Any, stage: Any, at: Any, motion: Motion, paths: list[str]) -> Any:
    prim = usd.UsdSkel.Animation.Define(stage, at)
    prim.CreateJointsAttr(paths)
    rotations = prim.CreateRotationsAttr()
    translations = prim.CreateTranslationsAttr()
    quats = _continuous(motion.rotations).astype(np.float32)
    places = np.broadcast_to(motion.skeleton.offsets, (len(motion), *motion.skeleton.offsets.shape)).copy()
    places[:, list(motion.moving)] = motion.translations
    places = places.astype(np.float32)
    prim.CreateScalesAttr(usd.Vt.Vec3hArray(len(paths), usd.Gf.Vec3h(1)))
    for frame in range(len(motion)):
        rotations.Set(usd.Vt.QuatfArray.FromNumpy(quats[frame]), frame)
        translations.Set(usd.Vt.Vec3fArray.FromNumpy(places[frame]), frame)
    return prim


def _continuous(rotations: Array) -> Array:
    """The same rotations (F, J, 4) without jumps of sign, for readers that interpolate numbers."""
    dots = np.sum(rotations[1:] * rotations[:-1], axis=-1)
    flips = np.cumprod(np.where(dots < 0, -1.0, 1.0), axis=0)
    return np.concatenate([rotations[:1], rotations[1:] * flips[..., None]])


def _write_mesh(usd: Any, stage: Any, at: Any, skeleton: Any, shape: Shape) -> None:
    mesh = usd.UsdGeom.Mesh.Define(stage, at)
    vt, types, interpolation = usd.Vt, usd.Sdf.ValueTypeNames, usd.UsdGeom.Tokens.vertex
    mesh.CreatePointsAttr(vt.Vec3fArray.FromNumpy(shape.vertices.astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr(vt.IntArray.FromNumpy(np.full(len(shape.triangles), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(vt.IntArray.FromNumpy(shape.triangles.astype(np.int32).ravel()))
    mesh.CreateSubdivisionSchemeAttr(usd.UsdGeom.Tokens.none)
    mesh.CreateOrientationAttr(usd.UsdGeom.Tokens.rightHanded)
    if len(shape.vertices):
        corners = np.array([shape.vertices.min(axis=0), shape.vertices.max(axis=0)], np.float32)
        mesh.CreateExtentAttr(vt.Vec3fArray.FromNumpy(corners))
    mesh.GetPrim().SetDisplayName(shape.name)
    binding = usd.UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateGeomBindTransformAttr(usd.Gf.Matrix4d(1.0))
    primvars = usd.UsdGeom.PrimvarsAPI(mesh)
    influences = shape.joints.shape[1]
    for name, kind, value in (
        ("skel:jointIndices", types.IntArray, vt.IntArray.FromNumpy(shape.joints.astype(np.int32).ravel())),
        (
            "skel:jointWeights",
            types.FloatArray,
            vt.FloatArray.FromNumpy(shape.weights.astype(np.float32).ravel()),
        ),
    ):
        primvars.CreatePrimvar(name, kind, interpolation, influences).Set(value)


def _export(stage: Any, path: Path) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"stage{path.suffix.lower()}"
        if not stage.GetRootLayer().Export(str(file)):
            raise FormatError(path, "usd-core could not write the stage")
        return file.read_bytes()
