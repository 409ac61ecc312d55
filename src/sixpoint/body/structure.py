"""Find legs and arms from the shape of the tree alone, for rigs whose names say nothing.

Two long branches that part at one joint are a pair. Along the longest way down a branch, the bones of a
limb are told by their share of its length: about equal thigh and shank, upper arm and forearm, with little
before and after. Feet and knees point forward, which tells left from right: in the rest pose, or in a
recording where the rest pose is not a posture at all.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.skeleton import Skeleton

Array = NDArray[np.float64]
Limb = tuple[int, int, int]
Fit = tuple[float, Array, tuple[Limb, Limb]]  # cost, lengths of upper and lower bone, joints of both sides

# Shares of a branch's length, from the joint where the pair parts to finger or toe tip: before the limb,
# upper bone, lower bone, after it; from data/proportions.toml. What is before and after varies among rigs.
LEG_SHARES = np.array([0.14, 0.34, 0.34, 0.18])
ARM_SHARES = np.array([0.22, 0.31, 0.28, 0.19])
SHARE_WEIGHTS = np.array([0.25, 1.0, 1.0, 0.25])
ARM_TO_LEG = np.array([0.35, 0.31])  # upper arm and forearm over thigh + shank
SIZE_WEIGHT = 0.07  # of squared log ratios of sizes, against squared differences of shares
NO_FORK = 0.03  # cost of a wrist or ankle where nothing branches though fingers, toes or a heel do elsewhere
LONG = 0.35  # branches shorter than this share of the longest pair are fingers, toes, hair, breasts
ALIKE = 0.35  # largest log ratio of a bone left and right
UNEVEN = 1.2  # largest log ratio of branches left and right: one hand may hold a sword
NEAR = 0.02  # joints nearer than this share of a branch are at one place
MOST_PLACES = 12  # joints looked at along a branch
MOST_BRANCHES = 12  # branches looked at below a joint
MAX_FRAMES = 100  # frames looked at to tell left from right


def find_limbs(skeleton: Skeleton, frames: Array | None = None) -> dict[str, int]:
    """Limb roles (``l_hip`` ... ``r_wrist``) by structure; empty where the tree is not a human's.

    Args:
        skeleton: Any rig.
        frames: (F, J, 4) local rotations of a recording, to tell left from right; else the rest pose is
            looked at.
    """
    best: tuple[float, tuple[Limb, Limb], tuple[Limb, Limb]] | None = None
    for (pelvis, *legs), (chest, *arms) in permutations(_branch_pairs(skeleton), 2):
        if pelvis == chest or skeleton.path(chest, pelvis) or any(skeleton.path(leg, chest) for leg in legs):
            continue
        leg = _fit(skeleton, legs, LEG_SHARES)
        arm = None if leg is None else _fit(skeleton, arms, ARM_SHARES, ARM_TO_LEG * leg[1].sum())
        if leg is not None and arm is not None and (best is None or leg[0] + arm[0] < best[0]):
            best = leg[0] + arm[0], leg[2], arm[2]
    return {} if best is None else _tell_sides(skeleton, best[1], best[2], frames)


def _branch_pairs(skeleton: Skeleton) -> list[tuple[int, int, int]]:
    """(parent, branch, branch) of long branches of like length that part at one joint."""
    way, _ = skeleton.ways_down
    length = way + np.linalg.norm(skeleton.offsets, axis=1)
    pairs = []
    for parent, children in enumerate(skeleton.children):
        longest = sorted(children, key=lambda c: -length[c])[:MOST_BRANCHES]
        pairs += [(parent, a, b) for a, b in combinations(longest, 2) if length[b] > 0]
    pairs = [p for p in pairs if abs(np.log(length[p[1]] / length[p[2]])) < UNEVEN]
    least = LONG * max((length[b] for _, _, b in pairs), default=0.0)
    return [p for p in pairs if length[p[2]] >= least]


def _fit(skeleton: Skeleton, branches: list[int], shares: Array, sizes: Array | None = None) -> Fit | None:
    """The limb joints of a pair of branches whose bones come nearest to human shares (and sizes)."""
    sides = [_places(skeleton, branch) for branch in branches]
    best: Fit | None = None
    for triple in combinations(range(min(len(side.ways) for side in sides)), 3):
        bones = np.array([side.bones(triple) for side in sides])
        mirror = np.log(bones[0, 1:3] / bones[1, 1:3])
        if np.any(np.abs(mirror) > ALIKE):
            continue
        mean = np.append(bones[:, :3].mean(axis=0), bones[:, 3].min())
        cost = float(SHARE_WEIGHTS @ (mean / mean.sum() - shares) ** 2 + SIZE_WEIGHT * np.sum(mirror**2))
        if sizes is not None:
            cost += SIZE_WEIGHT * float(np.sum(np.log(mean[1:3] / sizes) ** 2))
        cost += NO_FORK * (not any(side.forks[triple[2]] for side in sides))
        if best is None or cost < best[0]:
            best = cost, mean[1:3], (sides[0].limb(triple), sides[1].limb(triple))
    return best


@dataclass(frozen=True)
class _Places:
    """Distinct places along a branch: first and last joint there, way from its parent, whether ways part."""

    first: list[int]
    last: list[int]
    ways: list[float]
    forks: list[bool]
    total: float

    def bones(self, triple: tuple[int, ...]) -> Array:
        """(4,) lengths before, upper, lower and after a limb."""
        return np.diff([0.0, *(self.ways[k] for k in triple), self.total])

    def limb(self, triple: tuple[int, ...]) -> Limb:
        """The joints of a limb; of several at one place a hip or shoulder is the last, others the first."""
        root, middle, end = triple
        return self.last[root], self.first[middle], self.first[end]


def _places(skeleton: Skeleton, branch: int) -> _Places:
    chain = skeleton.longest_chain(branch)
    way = float(np.linalg.norm(skeleton.offsets[branch]))
    lengths = [float(np.linalg.norm(bone)) for _, bone in chain]
    total = way + sum(lengths)
    near = NEAR * total
    first, last, ways, forks = [branch], [branch], [way], [_forks(skeleton, branch, near)]
    for (above, _), (joint, _), length in zip(chain, chain[1:], lengths, strict=False):
        way += length
        if length > near:
            first, last, ways = [*first, joint], [*last, joint], [*ways, way]
            forks.append(_forks(skeleton, above, near, joint))
        else:
            last[-1] = joint
        forks[-1] |= _forks(skeleton, joint, near)
        if len(ways) == MOST_PLACES:
            break
    return _Places(first, last, ways, forks, total)


def _forks(skeleton: Skeleton, joint: int, near: float, place: int | None = None) -> bool:
    """Whether several ways part at a joint, or at the place of its child ``place``; helpers do not count."""
    ways = [skeleton.offsets[c] for c in skeleton.children[joint] if skeleton.ways_down[0][c] > near]
    if place is not None:
        return sum(bool(np.linalg.norm(w - skeleton.offsets[place]) < near) for w in ways) > 1
    ways += [w for w in skeleton.site_offsets[skeleton.sites_of(joint)] if np.linalg.norm(w) > near]
    apart = [w for w in ways if np.linalg.norm(w) < near or np.linalg.norm(w - ways[0]) > near]
    return len(ways) > 1 and len(apart) > 0  # else all of them part at the next place


# --- left and right ------------------------------------------------------------------------------


def _tell_sides(
    skeleton: Skeleton, legs: tuple[Limb, Limb], arms: tuple[Limb, Limb], frames: Array | None
) -> dict[str, int]:
    """Names for both pairs; empty where neither feet nor knees tell which way is forward."""
    if frames is None:
        frames = np.tile(rot.IDENTITY, (1, len(skeleton), 1))
    positions, world = skeleton.compute_transforms(frames[:: max(1, len(frames) // MAX_FRAMES)])
    hips, shoulders = (positions[:, [a[0], b[0]]] for a, b in (legs, arms))
    up = rot.unit(shoulders.mean(axis=1) - hips.mean(axis=1))
    across = rot.unit(hips[:, 0] - hips[:, 1])
    forward = np.zeros_like(up)
    for hip, knee, ankle in legs:
        leg = positions[:, ankle] - positions[:, hip]
        half = positions[:, knee] - positions[:, hip]
        thigh, shank = (np.linalg.norm(v, axis=1, keepdims=True) for v in (half, leg - half))
        forward += half / thigh - leg / (thigh + shank)  # the knee is in front of the line hip - ankle
        foot = foot_direction(skeleton, ankle)
        if foot is not None:
            forward += 0.5 * rot.mul_vec(world[:, ankle], foot)
    left = np.cross(up, forward)
    vote = float(np.sum(left * across))
    if abs(vote) < 0.02 * len(up):
        return {}
    if vote < 0:
        legs, across = legs[::-1], -across
    for joint in range(3):  # shoulders may be at one place: then elbows or wrists tell
        apart = float(np.sum((positions[:, arms[0][joint]] - positions[:, arms[1][joint]]) * across))
        if abs(apart) > 1e-3 * len(up) * float(np.linalg.norm(hips[0, 0] - hips[0, 1])):
            break
    if apart < 0:
        arms = arms[::-1]
    roles = (("hip", "knee", "ankle"), legs), (("shoulder", "elbow", "wrist"), arms)
    return {
        f"{side}_{role}": joint
        for names, pair in roles
        for side, limb in zip(("l", "r"), pair, strict=True)
        for role, joint in zip(names, limb, strict=True)
    }


def foot_direction(skeleton: Skeleton, ankle: int, local: Array | None = None) -> Array | None:
    """Unit vector from the ankle to the toe tip in the ankle's frame; None without toes.

    Args:
        skeleton: The rig.
        ankle: The ankle.
        local: (J, 4) local rotations of the joints below the ankle; at rest by default.
    """
    turn, tip = rot.IDENTITY, np.zeros(3)
    for k, (joint, bone) in enumerate(skeleton.longest_chain(ankle)):
        if k and local is not None:
            turn = rot.mul(turn, local[joint])
        tip = tip + rot.mul_vec(turn, bone)
    length = float(np.linalg.norm(tip))
    return tip / length if length > 1e-6 else None
