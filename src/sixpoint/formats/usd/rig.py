"""The skeleton of a stage: joints, rest pose, bind pose, and what animates it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.errors import FormatError, listed
from sixpoint.formats.usd import SITES
from sixpoint.formats.usd.matrices import Similarity, decompose

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Sites = tuple[tuple[str, ...], Index, Array]

SHIFT = "root"
"""Name of the root that is added where a skeleton has several."""


@dataclass(frozen=True, eq=False)
class Rig:
    """A skeleton of a stage.

    Attributes:
        path: Of its prim, for messages.
        prim: The prim.
        names: J distinct names.
        parents: (J,).
        index: Joint path, as animations name it -> joint.
        added: Whether joint 0 was added above several roots.
        rest: Local rest pose (J,), in the frames and units of the file.
        rest_world: (J, 4) world rotations of the rest pose.
        rest_above: (J, 4) those of the parents.
        bind: Bind pose (J,), in the file's world.
        sites: Names, joints and offsets, those of our own files.
        animation: A ``UsdSkel.AnimQuery``, or None.
        is_placed_over_time: Whether prims above the skeleton move it.
    """

    path: str
    prim: Any
    names: tuple[str, ...]
    parents: Index
    index: dict[str, int]
    added: bool
    rest: Similarity
    rest_world: Array
    rest_above: Array
    bind: Similarity
    sites: Sites
    animation: Any
    is_placed_over_time: bool


def read_rig(usd: Any, stage: Any, path: Path) -> tuple[Rig, Any]:
    """The first animated skeleton of a stage, else the first, and its ``UsdSkel.Binding``, if it has meshes.

    Raises:
        FormatError: There is none, or its joints, rest or bind pose are missing or wrong.
    """
    predicate = usd.Usd.TraverseInstanceProxies(usd.Usd.PrimDefaultPredicate)
    prims = list(stage.Traverse(predicate))
    skeletons = [usd.UsdSkel.Skeleton(p) for p in prims if p.IsA(usd.UsdSkel.Skeleton)]
    if not skeletons:
        kinds = Counter(str(p.GetTypeName()) for p in prims if p.GetTypeName())
        held = listed(f"{count} {kind}" for kind, count in kinds.items()) or "nothing"
        raise FormatError(path, f"there is no UsdSkel Skeleton in this stage; it holds: {held}")
    cache = usd.UsdSkel.Cache()
    bindings: dict[str, Any] = {}
    for prim in prims:
        if prim.IsA(usd.UsdSkel.Root):
            root = usd.UsdSkel.Root(prim)
            cache.Populate(root, predicate)
            for binding in cache.ComputeSkelBindings(root, predicate):
                bindings.setdefault(str(binding.GetSkeleton().GetPath()), binding)
    animations = [_find_animation(usd, cache.GetSkelQuery(s)) for s in skeletons]
    loose = [usd.UsdSkel.Animation(p) for p in prims if p.IsA(usd.UsdSkel.Animation)]
    if not any(animations) and loose:  # nobody says whose it is
        animations[0] = cache.GetAnimQuery(loose[0])
    chosen = next((k for k, found in enumerate(animations) if found), 0)
    skeleton = skeletons[chosen]
    rig = _read_joints(usd, skeleton, cache.GetSkelQuery(skeleton), animations[chosen], path)
    return rig, bindings.get(rig.path)


def _find_animation(usd: Any, query: Any) -> Any:
    """The animation that is bound to a skeleton, or None."""
    found = query.GetAnimQuery() if query else None
    return found or None


def _read_joints(usd: Any, skeleton: Any, query: Any, animation: Any, path: Path) -> Rig:
    at = str(skeleton.GetPath())
    order = [str(token) for token in skeleton.GetJointsAttr().Get() or []]
    if not order:
        raise FormatError(path, f"{at} has no joints")
    topology = usd.UsdSkel.Topology(order)
    valid, why = topology.Validate()
    if not valid:
        raise FormatError(path, f"the joints of {at} are no tree with parents before children: {why}")
    parents = np.array(topology.GetParentIndices(), np.int64)
    rest, bind = skeleton.GetRestTransformsAttr().Get(), skeleton.GetBindTransformsAttr().Get()
    for name, matrices in (("rest", rest), ("bind", bind)):
        if matrices is not None and len(matrices) not in (0, len(order)):
            raise FormatError(
                path, f"{at} has {len(order)} joints, but {len(matrices)} matrices in {name}Transforms"
            )
    if not rest and not bind:
        raise FormatError(path, f"{at} has neither restTransforms nor bindTransforms")
    bind_matrices = np.array(bind if bind else _chain(np.array(rest), parents))
    rest_matrices = np.array(rest) if rest else _unchain(bind_matrices, parents)
    names = _find_names(skeleton, order)
    added = int(np.count_nonzero(parents < 0)) > 1
    index = {token: k + added for k, token in enumerate(order)}
    if added:
        parents = np.array([-1, *(parents + 1)])
        rest_matrices, bind_matrices = (np.stack([np.eye(4), *m]) for m in (rest_matrices, bind_matrices))
        names = (_unused(SHIFT, names), *names)
    poses = [decompose(matrices) for matrices in (rest_matrices, bind_matrices)]
    for pose, what in zip(poses, ("rest", "bind"), strict=True):
        if pose is None:
            raise FormatError(path, f"{what}Transforms of {at} have a shear, a mirror or no size")
    rest_pose, bind_pose = poses
    assert rest_pose is not None
    assert bind_pose is not None
    world = rest_pose.rotations.copy()
    for joint in range(1, len(parents)):
        world[joint] = rot.mul(world[parents[joint]], world[joint])
    above = np.where((parents < 0)[:, None], rot.IDENTITY, world[np.maximum(parents, 0)])
    return Rig(
        at,
        skeleton.GetPrim(),
        names,
        parents,
        index,
        added,
        rest_pose,
        world,
        above,
        bind_pose,
        _read_sites(skeleton.GetPrim(), world, len(names)),
        animation,
        _moves(usd, skeleton.GetPrim()),
    )


def _find_names(skeleton: Any, order: list[str]) -> tuple[str, ...]:
    """Names as they are said, else the last parts of the paths, else the paths, if they are distinct."""
    said = [str(name) for name in skeleton.GetJointNamesAttr().Get() or []]
    for names in (said, [token.rsplit("/", 1)[-1] for token in order]):
        if len(set(names)) == len(names) == len(order):
            return tuple(names)
    return tuple(order)


def _unused(name: str, names: tuple[str, ...]) -> str:
    while name in names:
        name += "_"
    return name


def _chain(local: Array, parents: Index) -> Array:
    world = local.copy()
    for joint, parent in enumerate(parents):
        if parent >= 0:
            world[joint] = local[joint] @ world[parent]
    return world


def _unchain(world: Array, parents: Index) -> Array:
    above = np.where((parents < 0)[:, None, None], np.eye(4), world[np.maximum(parents, 0)])
    return np.asarray(world @ np.linalg.inv(above))


def _read_sites(prim: Any, world: Array, joints: int) -> Sites:
    """End sites of files that we wrote; none of others."""
    parts: list[Any] = [
        prim.GetAttribute(f"{SITES}:{name}").Get() if prim.HasAttribute(f"{SITES}:{name}") else None
        for name in ("names", "joints", "offsets")
    ]
    counts = {len(part or []) for part in parts}
    carriers = np.array(parts[1] or [], np.int64)
    if len(counts) > 1 or not np.all((carriers >= 0) & (carriers < joints)) or not len(carriers):
        return (), np.zeros(0, np.int64), np.zeros((0, 3))
    offsets = rot.mul_vec(world[carriers], np.array(parts[2], float))
    return tuple(str(name) for name in parts[0]), carriers, offsets


def _moves(usd: Any, prim: Any) -> bool:
    while prim and not prim.IsPseudoRoot():
        place = usd.UsdGeom.Xformable(prim)
        if place and place.TransformMightBeTimeVarying():
            return True
        prim = prim.GetParent()
    return False
