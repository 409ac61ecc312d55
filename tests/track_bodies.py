"""Forty-one virtual markers on motions of the built-in figure, at known places."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

import sixpoint as sp
from sixpoint.body import rotations as rot
from sixpoint.body.markers.model import MarkerModel
from sixpoint.samples import make_sample

# Name -> joint, and place in its anatomical frame [m]; of the sided ones that of the left side.
MIDDLE = {
    "c7": ("vt6", (0, 0.11, -0.09)),
    "sternum_notch": ("vt6", (0, 0.07, 0.1)),
    "sternum": ("vt6", (0, -0.1, 0.13)),
    "t10": ("vt6", (0, -0.12, -0.1)),
    "right_back": ("vt6", (-0.1, -0.04, -0.1)),
}
SIDED = {
    "asis": ("humanoid_root", (0.12, 0.0, 0.1)),
    "psis": ("humanoid_root", (0.05, 0.02, -0.1)),
    "head_front": ("skullbase", (0.07, 0.1, 0.1)),
    "head_back": ("skullbase", (0.07, 0.1, -0.08)),
    "acromion": ("{}_sternoclavicular", (0.12, 0.05, 0.0)),
    "upper_arm": ("{}_shoulder", (0.06, -0.15, 0.0)),
    "elbow": ("{}_shoulder", (0.045, -0.3, 0.0)),
    "forearm": ("{}_elbow", (0.04, -0.13, 0.0)),
    "wrist_a": ("{}_elbow", (0.0, -0.265, 0.04)),
    "wrist_b": ("{}_elbow", (0.0, -0.265, -0.04)),
    "hand": ("{}_wrist", (0.01, -0.09, 0.02)),
    "thigh": ("{}_hip", (0.08, -0.23, 0.03)),
    "knee": ("{}_hip", (0.055, -0.42, 0.0)),
    "shank": ("{}_knee", (0.05, -0.21, 0.02)),
    "ankle": ("{}_knee", (0.045, -0.43, 0.0)),
    "heel": ("{}_ankle", (0.0, -0.04, -0.06)),
    "toe": ("{}_ankle", (0.0, -0.05, 0.16)),
    "fifth": ("{}_ankle", (0.05, -0.06, 0.1)),
}
ARM = ("acromion", "upper_arm", "elbow", "forearm", "wrist_a", "wrist_b", "hand")
LEG = ("thigh", "knee", "shank", "ankle", "heel", "toe", "fifth")


@dataclass(frozen=True, eq=False)
class Case:
    """A motion, its markers (F, 41, 3) [m], and the model that is to follow them."""

    motion: sp.Motion
    model: MarkerModel
    markers: np.ndarray

    @property
    def posed(self) -> list[int]:
        """Joints from pelvis to wrists, ankles and head."""
        roles = self.model.figure.roles
        limbs = [j for limb in roles.limbs for j in limb]
        return [roles.pelvis, *roles.spine, *limbs]

    def limb(self, part: str) -> list[int]:
        """Columns of the markers of "l_arm", "r_leg" and so on."""
        side, kind = part.split("_")
        return [self.model.names.index(f"{side}_{name}") for name in (ARM if kind == "arm" else LEG)]

    def only(self, keep: list[int]) -> MarkerModel:
        """The model with some of its markers."""
        m = self.model
        return MarkerModel(
            m.figure, tuple(m.names[k] for k in keep), m.joints[keep], m.offsets[keep], m.spread[keep]
        )


def place_by_name(figure: sp.Figure) -> tuple[list[str], list[int], np.ndarray]:
    names, joints, offsets = [], [], []
    index = figure.skeleton.names.index
    for name, (joint, offset) in MIDDLE.items():
        names.append(name), joints.append(index(joint)), offsets.append(offset)
    for name, (joint, offset) in SIDED.items():
        for side, mirror in (("l", 1.0), ("r", -1.0)):
            names.append(f"{side}_{name}"), joints.append(index(joint.format(side)))
            offsets.append(np.multiply(offset, [mirror, 1, 1]))
    return names, joints, np.array(offsets, float)


def markers_of(model: MarkerModel, motion: sp.Motion) -> np.ndarray:
    """Where markers are on a motion, by SciPy's rotations."""
    positions, world = motion.transforms
    columns = []
    for joint, offset in zip(model.joints, model.offsets, strict=True):
        columns.append(positions[:, joint] + Rotation.from_quat(world[:, joint]).apply(np.array(offset)))
    return np.stack(columns, axis=1)


@cache
def body(name: str, noise: float = 0.0, misplaced: float = 0.0) -> Case:
    """A sample with markers: noisy by so much [m], the model's places wrong by so much [m]."""
    figure, rng = sp.Figure.from_stature(1.75), np.random.default_rng(5)
    motion = make_sample(name, figure)
    names, joints, offsets = place_by_name(figure)
    rigged = rot.mul_vec(rot.inv(figure.neutral[joints]), offsets)
    true = MarkerModel(figure, tuple(names), np.array(joints), rigged, np.full(len(names), 0.005))
    markers = markers_of(true, motion) + rng.normal(0, noise, (len(motion), len(names), 3))
    wrong = rigged + rng.normal(0, misplaced, rigged.shape)
    return Case(motion, MarkerModel(figure, tuple(names), np.array(joints), wrong, true.spread), markers)


def drop(markers: np.ndarray, seed: int, share: float = 0.2, longest: int = 60) -> np.ndarray:
    """Delete a share of every marker's samples in bursts."""
    rng, out = np.random.default_rng(seed), markers.copy()
    frames = len(out)
    for i in range(out.shape[1]):
        left = round(share * frames)
        while left > 0:
            length = min(int(rng.integers(3, longest + 1)), left)
            start = int(rng.integers(0, frames - length + 1))
            fresh = np.isfinite(out[start : start + length, i, 0])
            out[start : start + length, i] = np.nan
            left -= int(fresh.sum())
    return out
