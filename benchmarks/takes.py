"""A take that exists as markers and as a skeleton: where both have the same joint, and how far apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import sixpoint as sp
from sixpoint.body import rotations as rot
from sixpoint.body.rigid import fit_rigid

Array = np.ndarray

LIMBS = (  # ours, CMU's, and ours above: in its frame a difference is constant
    ("hip", "femur", None),
    ("knee", "tibia", "hip"),
    ("ankle", "foot", "knee"),
    ("shoulder", "humerus", "sternoclavicular"),
    ("elbow", "radius", "shoulder"),
    ("wrist", "hand", "elbow"),
)
SAME = {
    **{
        f"{s}_{ours}": ((f"{s}_{ours}",), (f"{s}{theirs}",), f"{s}_{above}" if above else "humanoid_root")
        for s in "lr"
        for ours, theirs, above in LIMBS
    },
    "pelvis": (("l_hip", "r_hip"), ("lfemur", "rfemur"), "humanoid_root"),
    "collar bones": (("l_sternoclavicular", "r_sternoclavicular"), ("lclavicle", "rclavicle"), "vt1"),
    "neck": (("vt1",), ("lowerneck",), "vt1"),
    "head": (("skullbase",), ("head",), "vc4"),
}
"""Joints of the built-in figure and of CMU's skeletons (ASF) that mean the same.

CMU's bones begin at the joint that bears their name. The forearm is two of them, radius and wrist (a third of
it), so the wrist is where the hand begins. The thorax ends in one point from which neck and both collar bones
leave: as the base of the neck it is our vt1, as the inner end of the collar bones the middle between our
sternoclavicular joints. Not compared are joints inside the trunk, whose length CMU divides into three equal
bones, the roots, which are conventions, and what has no counterpart: upperneck, toes and fingers.
"""


@dataclass(frozen=True, eq=False)
class Apart:
    """Distances of N joints.

    Attributes:
        names: Of the joints.
        distance: (F, N) after one rigid alignment of the whole take [m].
        constant: (N, 3) mean difference, ours minus theirs, in the frame of our segment that ends there [m].
        varying: (N,) root mean square of the rest [m].
        turned: Of the alignment, degrees: how far it is from upright.
    """

    names: tuple[str, ...]
    distance: Array
    constant: Array
    varying: Array
    turned: float

    @property
    def mean(self) -> float:
        """Over joints and frames [m]."""
        return float(self.distance.mean())


def compare_take(ours: sp.Motion, theirs: sp.Motion) -> Apart:
    """Compare a motion of the built-in figure with the same frames of a CMU skeleton."""
    frames = min(len(ours), len(theirs))
    a, b = (
        np.stack([middle(motion, joints[which])[:frames] for joints in SAME.values()], axis=1)
        for which, motion in enumerate((ours, theirs))
    )
    turn, shift = fit_rigid(a.reshape(-1, 3), b.reshape(-1, 3))
    off = rot.mul_vec(turn, a) + shift - b
    world = ours.transforms[1][:frames, [ours.skeleton.index(row[2]) for row in SAME.values()]]
    local = rot.mul_vec(rot.inv(world), rot.mul_vec(rot.inv(turn), off))
    constant = local.mean(axis=0)
    varying = np.sqrt(np.mean(np.sum((local - constant) ** 2, axis=2), axis=0))
    up = float(np.degrees(np.arccos(rot.mul_vec(turn, np.array([0.0, 1.0, 0.0]))[1])))
    return Apart(tuple(SAME), np.linalg.norm(off, axis=2), constant, varying, up)


def middle(motion: sp.Motion, names: tuple[str, ...]) -> Array:
    """(F, 3) mean of some joints."""
    return motion.positions[:, [motion.skeleton.index(name) for name in names]].mean(axis=1)


def find_lag(ours: sp.Motion, theirs: sp.Motion, most: int = 12) -> int:
    """By how many frames theirs is late: where the speeds of hands, feet and head agree best."""
    names = [name for name in SAME if name.split("_")[-1] in ("wrist", "ankle", "head")]
    speeds = [
        np.stack(
            [np.linalg.norm(np.diff(middle(motion, SAME[name][which]), axis=0), axis=1) for name in names]
        )
        for which, motion in enumerate((ours, theirs))
    ]
    frames = min(s.shape[1] for s in speeds) - 2 * most
    here = speeds[0][:, most : most + frames]
    costs = [np.sum((here - speeds[1][:, most + k : most + k + frames]) ** 2) for k in range(-most, most + 1)]
    return int(np.argmin(costs)) - most
