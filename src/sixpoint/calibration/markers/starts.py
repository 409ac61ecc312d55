"""Where the poses begin: segments laid through their markers, from the pelvis outwards.

Pelvis, thorax and head are turned as their markers are (Kabsch); a limb is laid through the markers of its
middle and its end, bent in their plane. This is a few centimetres wrong, and never the wrong way round.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.calibration.markers.kinematics import NECK, THORAX, TRUNK, Kinematics, exponential, logarithm
from sixpoint.calibration.markers.places import Places

Array = NDArray[np.float64]

LEAST_SPAN = 0.03  # markers that turn a segment are this far from a line [m]
BENT = 0.35  # sine of flexion at which the limb's plane and the parent's axis count alike


def start_poses(
    kinematics: Kinematics, places: Places, lengths: Array, offsets: Array, observed: Array
) -> Array:
    """Poses (F, D) of frames of markers (F, M, 3) [m]; NaN in frames whose pelvis is not determined."""
    poses = np.zeros((len(observed), kinematics.size))
    rest = kinematics.rest(lengths)
    model = rest[places.carriers] + places.reach @ lengths + offsets
    spine = places.on("thorax", "spine") + places.columns(
        "l_acromion", "r_acromion", "l_shoulder_centre", "r_shoulder_centre"
    )
    turned, place = lay_segment(model, observed, places.on("pelvis"))
    lost = np.isnan(turned[:, 0, 0])
    if lost.any():
        also = lay_segment(model, observed, places.on("pelvis") + spine)
        turned[lost], place[lost] = also[0][lost], also[1][lost]
    kept = np.isfinite(turned[:, 0, 0])
    turned = np.where(kept[:, None, None], turned, np.eye(3))
    poses[:, :3] = np.where(kept[:, None], place, np.nan)
    poses[:, 3:6] = logarithm(turned)
    poses[~kept, :3] = 0.0
    _lay_trunk(kinematics, places, model, observed, poses, turned, spine)
    for side in ("l", "r"):
        limb = (f"{side}_hip", f"{side}_knee", f"{side}_ankle")
        _lay_limb(kinematics, places, lengths, offsets, observed, poses, limb, 1.0)
        limb = (f"{side}_shoulder", f"{side}_elbow", f"{side}_wrist")
        _lay_limb(kinematics, places, lengths, offsets, observed, poses, limb, -1.0)
    poses[~kept] = np.nan
    return poses


def lay_segment(model: Array, observed: Array, columns: list[int]) -> tuple[Array, Array]:
    """Rigid fit of some markers: rotations (F, 3, 3) and places of the origin (F, 3); NaN where impossible.

    Reference: Kabsch 1976, Acta Cryst. A32, 922.
    """
    frames = len(observed)
    turned, place = np.full((frames, 3, 3), np.nan), np.full((frames, 3), np.nan)
    if len(columns) < 3:
        return turned, place
    points, seen = observed[:, columns], np.isfinite(observed[:, columns, 0])
    weight = seen / np.maximum(seen.sum(axis=1, keepdims=True), 1)
    points = np.where(seen[..., None], points, 0.0)
    centre = np.einsum("fm,fmx->fx", weight, points)
    origin = weight @ model[columns]
    a = (model[columns] - origin[:, None]) * weight[..., None]
    b = points - centre[:, None]
    left, sizes, right = np.linalg.svd(np.swapaxes(b, 1, 2) @ a)
    flip = np.ones((frames, 3))
    flip[:, 2] = np.linalg.det(left @ right)
    spanned = (seen.sum(axis=1) >= 3) & (sizes[:, 1] > LEAST_SPAN**2 / 9.0)
    turned[spanned] = ((left * flip[:, None]) @ right)[spanned]
    place[spanned] = (centre - (turned @ origin[..., None])[..., 0])[spanned]
    return turned, place


def _lay_trunk(
    kin: Kinematics,
    places: Places,
    model: Array,
    observed: Array,
    poses: Array,
    pelvis: Array,
    spine: list[int],
) -> None:
    thorax, _ = lay_segment(model, observed, spine)
    thorax = np.where(np.isnan(thorax), pelvis, thorax)
    bent = logarithm(np.swapaxes(pelvis, 1, 2) @ thorax)
    for block, share in ((TRUNK, 0.6), (THORAX, 0.4)):
        first = int(kin.starts[block])
        poses[:, first : first + 3] = share * bent
    head, _ = lay_segment(model, observed, places.on("head"))
    head = np.where(np.isnan(head), thorax, head)
    first = int(kin.starts[NECK])
    poses[:, first : first + 3] = logarithm(np.swapaxes(thorax, 1, 2) @ head)


def _lay_limb(
    kin: Kinematics,
    places: Places,
    lengths: Array,
    offsets: Array,
    observed: Array,
    poses: Array,
    limb: tuple[str, str, str],
    fold: float,
) -> None:
    """Turn hip and knee, or shoulder and elbow, in place; ``fold`` is the sign of flexion about X."""
    joints = [kin.skeleton.index(name) for name in limb]
    near = [_markers_near(kin, places, lengths, joint) for joint in joints]
    if not near[1]:
        return
    placed = kin.place(lengths, poses)
    above = placed.world[:, kin.skeleton.parents[joints[0]]]
    root = placed.positions[:, joints[0]]
    turned = above
    for _ in range(3):  # a single marker stands beside its joint, by what the turn so far says
        middle = _centre(observed, near[1], offsets, turned)
        end = _centre(observed, near[2], offsets, turned) if near[2] else np.full_like(middle, np.nan)
        upper, lower = rot.unit(middle - root), rot.unit(end - middle)
        bend = fold * np.nan_to_num(np.cross(upper, lower))
        across = np.sum(bend**2, axis=1, keepdims=True) / BENT * rot.unit(bend)
        side = rot.unit(across + BENT * above[..., 0] + _across(observed, places, limb[1]))
        y = -upper
        x = rot.unit(side - np.sum(side * y, axis=1, keepdims=True) * y)
        new = np.stack([x, y, np.cross(x, y)], axis=-1)
        good = np.asarray(np.isfinite(middle).all(axis=1))
        turned = np.where(good[:, None, None], new, above)
    poses[good, kin.dofs(limb[0])] = logarithm(np.swapaxes(above, 1, 2) @ turned)[good]
    flexion = np.arctan2(np.sum(bend * turned[..., 0], axis=1), np.sum(upper * lower, axis=1))
    flexed = good & np.isfinite(end).all(axis=1)
    hinge = kin.dofs(limb[1])
    poses[flexed, hinge.start] = fold * np.maximum(flexion, 0.0)[flexed]
    if fold < 0:
        _turn_forearm(kin, places, observed, poses, turned, limb[2], hinge)


def _turn_forearm(
    kin: Kinematics,
    places: Places,
    observed: Array,
    poses: Array,
    upper: Array,
    wrist: str,
    hinge: slice,
) -> None:
    """The thumb's side of the wrist is in front where the forearm is not turned."""
    pair = [places.columns(f"{wrist}_{side}") for side in ("radial", "ulnar")]
    if not (pair[0] and pair[1]):
        return
    front = observed[:, pair[0][0]] - observed[:, pair[1][0]]
    bent = upper @ exponential(poses[:, hinge.start, None] * np.array([1.0, 0.0, 0.0]))
    seen = (np.swapaxes(bent, 1, 2) @ front[..., None])[..., 0]
    twist = np.arctan2(seen[:, 0], seen[:, 2])
    good = np.isfinite(twist)
    poses[good, hinge.start + 1] = twist[good]


def _markers_near(kin: Kinematics, places: Places, lengths: Array, joint: int) -> list[int]:
    """Markers given from a joint's neutral place and close to it."""
    rest = kin.rest(lengths)
    anchors = rest[places.carriers] + places.reach @ lengths
    close = np.linalg.norm(anchors - rest[joint], axis=1) < 1e-6
    return [int(k) for k in np.flatnonzero(close & (places.std.max(axis=1) < 0.025))]


def _centre(observed: Array, columns: list[int], offsets: Array, turned: Array) -> Array:
    """(F, 3) mean of what markers say of their joint; NaN where none is seen."""
    said = observed[:, columns] - np.einsum("fxy,my->fmx", turned, offsets[columns])
    seen = np.isfinite(said[..., :1])
    count = seen.sum(axis=1)
    total = np.where(seen, said, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _across(observed: Array, places: Places, middle: str) -> Array:
    """(F, 3) from the medial to the lateral marker of a knee or elbow, to the figure's left; zero without."""
    pair = [places.columns(f"{middle}_{side}") for side in ("lateral", "medial")]
    if not (pair[0] and pair[1]):
        return np.zeros((len(observed), 3))
    sign = 1.0 if middle.startswith("l_") else -1.0
    return np.nan_to_num(sign * rot.unit(observed[:, pair[0][0]] - observed[:, pair[1][0]]))
