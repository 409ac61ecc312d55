"""Find legs and arms from the shape of the tree alone, for rigs whose names say nothing.

Two branches that part at one joint and have mirrored bone lengths are a pair. Of the two longest pairs
the one that parts nearer the root is the legs. Within a branch, the two longest neighbouring bones are
thigh and shank, or upper arm and forearm. The feet point forward, which tells left from right.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.skeleton import Skeleton

Array = NDArray[np.float64]
Chain = list[tuple[int, Array]]


def find_limbs(skeleton: Skeleton) -> dict[str, int]:
    """Limb roles (``l_hip`` ... ``r_wrist``) by structure; empty where the tree is not a human's."""
    pairs = _mirrored_pairs(skeleton)
    for first, second in combinations(pairs, 2):
        a, b = first[0], second[0]
        branches = {*first[1:], *second[1:]}
        nested = any(skeleton.path(x, y) for x in branches for y in branches if x != y)
        if a == b or (nested and not skeleton.path(a, b) and not skeleton.path(b, a)):
            continue
        legs, arms = (first, second) if skeleton.path(a, b) else (second, first)
        if any(skeleton.path(leg, arms[0]) for leg in legs[1:]):
            continue  # the "legs" would contain the arms
        found = _name_limbs(skeleton, legs[1:], arms[1:])
        if found:
            return found
    return {}


def _longest_chain(skeleton: Skeleton, joint: int) -> Chain:
    """Joints of the longest way down from ``joint`` with each bone (offset to the next point)."""
    best: tuple[float, Chain] = (0.0, [])
    for child in skeleton.children[joint]:
        below = _longest_chain(skeleton, child)
        chain = [(joint, skeleton.offsets[child]), *below]
        length = sum(float(np.linalg.norm(bone)) for _, bone in chain)
        if length > best[0]:
            best = (length, chain)
    for site in skeleton.sites_of(joint):
        length = float(np.linalg.norm(skeleton.site_offsets[site]))
        if length > best[0]:
            best = (length, [(joint, skeleton.site_offsets[site])])
    return best[1]


def _lengths(chain: Chain) -> Array:
    return np.array([np.linalg.norm(bone) for _, bone in chain])


def _mirrored_pairs(skeleton: Skeleton) -> list[tuple[int, int, int]]:
    """(parent, branch, branch) with matching bone lengths, longest first."""
    found: list[tuple[float, int, int, int]] = []
    for parent, children in enumerate(skeleton.children):
        for a, b in combinations(children, 2):
            first, second = (_lengths(_longest_chain(skeleton, c)) for c in (a, b))
            if len(first) < 2 or len(second) < 2:
                continue
            count = min(len(first), len(second), 4)
            p, q = np.sort(first)[-count:], np.sort(second)[-count:]
            bones = p[p > 0.02 * p.sum()], q[q > 0.02 * q.sum()]
            if len(bones[0]) == len(bones[1]) and np.allclose(*bones, rtol=0.15):
                found.append((float(first.sum() + second.sum()), parent, a, b))
    found.sort(reverse=True)
    return [(parent, a, b) for _, parent, a, b in found]


def _name_limbs(skeleton: Skeleton, legs: tuple[int, ...], arms: tuple[int, ...]) -> dict[str, int]:
    chains = [_limb_joints(skeleton, branch) for branch in (*legs, *arms)]
    if any(len(c) != 3 for c in chains):
        return {}
    positions, _ = skeleton.compute_transforms(np.tile(rot.IDENTITY, (len(skeleton), 1)))
    hips, ankles = [c[0] for c in chains[:2]], [c[2] for c in chains[:2]]
    up = positions[[c[0] for c in chains[2:]]].mean(axis=0) - positions[ankles].mean(axis=0)
    feet = [bone for a in ankles for bone in [foot_direction(skeleton, a)] if bone is not None]
    if not feet:
        return {}
    left = np.cross(up, np.sum(feet, axis=0))
    across = positions[hips[0]] - positions[hips[1]]
    if abs(left @ across) < 1e-6 * np.linalg.norm(left) * np.linalg.norm(across):
        return {}
    leg_sides = ("l", "r") if left @ across > 0 else ("r", "l")
    roots = [positions[c[2]] for c in chains[2:]]
    arm_sides = ("l", "r") if left @ (roots[0] - roots[1]) > 0 else ("r", "l")
    out: dict[str, int] = {}
    for side, chain in zip((*leg_sides, *arm_sides), chains, strict=True):
        roles = ("hip", "knee", "ankle") if chain in chains[:2] else ("shoulder", "elbow", "wrist")
        out |= {f"{side}_{role}": joint for role, joint in zip(roles, chain, strict=True)}
    return out


def _limb_joints(skeleton: Skeleton, branch: int) -> list[int]:
    """The joints at the ends of the two longest neighbouring bones of a branch."""
    chain = _longest_chain(skeleton, branch)
    lengths = _lengths(chain)
    joints = [joint for joint, _ in chain]
    if len(joints) < 3:
        return []
    k = int(np.argmax(lengths[:-1] + lengths[1:]))
    return joints[k : k + 3]


def foot_direction(skeleton: Skeleton, ankle: int) -> Array | None:
    """Unit vector from the ankle to the toe tip in the ankle's frame at rest; None without toes."""
    chain = _longest_chain(skeleton, ankle)
    bone = np.sum([b for _, b in chain], axis=0) if chain else np.zeros(3)
    length = float(np.linalg.norm(bone))
    return bone / length if length > 1e-6 else None
