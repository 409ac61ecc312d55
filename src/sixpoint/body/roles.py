"""Which joint of a rig is the knee? Roles from joint names, else from the structure of the tree.

Only limbs and head are looked for. The pelvis is where legs and head part, the spine is the path from
there to the head, and the clavicle is what lies between the spine and a shoulder.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.motion import Motion
from sixpoint.body.rig_names import SIDES, find_named, is_chain
from sixpoint.body.skeleton import Skeleton
from sixpoint.body.structure import find_limbs
from sixpoint.errors import FigureError, listed

Array = NDArray[np.float64]

LIMB_ROLES = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
MAPPING_ROLES = (
    "pelvis",
    "head",
    *(f"{side}_{role}" for role in ("clavicle", *LIMB_ROLES) for side in SIDES),
)
"""Roles that a mapping may name."""
LIMB_JOINTS = tuple(f"{side}_{role}" for role in LIMB_ROLES for side in SIDES)


@dataclass(frozen=True)
class Roles:
    """The anatomical roles of a rig's joints; pairs are (left, right).

    Attributes:
        pelvis: Joint that carries the pelvis effector; legs and spine part there.
        spine: Joints above the pelvis up to the one that carries the head, which is the last.
        head_offset: Head effector in the frame of the last spine joint [m]; zero where a head joint
            exists, the end site's offset where the head is an end site.
        clavicle: Sternoclavicular joints; empty where the rig has none.
        shoulder: Shoulders.
        elbow: Elbows.
        wrist: Wrists.
        hip: Hips.
        knee: Knees.
        ankle: Ankles.
        found_by: How the roles were found: "names", "structure" or "mapping".
    """

    pelvis: int
    spine: tuple[int, ...]
    head_offset: tuple[float, float, float]
    clavicle: tuple[int, ...]
    shoulder: tuple[int, int]
    elbow: tuple[int, int]
    wrist: tuple[int, int]
    hip: tuple[int, int]
    knee: tuple[int, int]
    ankle: tuple[int, int]
    found_by: str = "names"

    @property
    def head(self) -> int:
        """Joint that carries the head effector."""
        return self.spine[-1]

    @property
    def limbs(self) -> tuple[tuple[int, int, int], ...]:
        """Left arm, right arm, left leg, right leg as (root, middle, end)."""
        arms = zip(self.shoulder, self.elbow, self.wrist, strict=True)
        legs = zip(self.hip, self.knee, self.ankle, strict=True)
        return (*arms, *legs)

    def named(self) -> dict[str, int]:
        """Role name -> joint, for printing and for tests."""
        out = {"pelvis": self.pelvis}
        out |= {f"spine_{k + 1}": joint for k, joint in enumerate(self.spine[:-1])}
        out["head"] = self.head
        for role in ("clavicle", *LIMB_ROLES):
            out |= {f"{side}_{role}": j for side, j in zip(SIDES, getattr(self, role), strict=False)}
        return out


def find_roles(
    skeleton: Skeleton, mapping: Mapping[str, str] | None = None, motion: Motion | None = None
) -> Roles:
    """Find the anatomical roles of a rig.

    Args:
        skeleton: Any rig.
        mapping: Role -> joint name, for the roles that should not be searched (``MAPPING_ROLES``).
        motion: A recording on the rig. It tells left from right where neither names nor rest pose do.

    Raises:
        FigureError: A role was not found; the message lists the joints and the missing roles.
    """
    given = _checked(skeleton, mapping or {})
    found = find_named(skeleton)
    by = "names"
    if not all(role in found | given for role in LIMB_JOINTS):
        structural = find_limbs(skeleton, None if motion is None else motion.rotations)
        if structural:
            found, by = _joined(structural, found), "structure"
    if given:
        by = f"{by} and mapping"
    found |= given
    missing = [role for role in LIMB_JOINTS if role not in found]
    if missing:
        raise FigureError(
            f"these roles were not found: {listed(missing)}. Joints of the rig: {listed(skeleton.names)}. "
            'Name them in a mapping file, e.g. l_hip = "LeftThigh"'
        )
    return _assemble(skeleton, found, by)


def _joined(structural: Mapping[str, int], named: Mapping[str, int]) -> dict[str, int]:
    """What names told goes first; where they contradict the sides of the structure, these are swapped."""
    mirrored = {f"{'lr'[role[0] == 'l']}{role[1:]}": joint for role, joint in structural.items()}
    votes = [(structural[r] == j) - (mirrored[r] == j) for r, j in named.items() if r in structural]
    return {**(structural if sum(votes) >= 0 else mirrored), **named}


def _checked(skeleton: Skeleton, mapping: Mapping[str, str]) -> dict[str, int]:
    unknown = [role for role in mapping if role not in MAPPING_ROLES]
    if unknown:
        raise FigureError(f"unknown roles in the mapping: {listed(unknown)}; roles: {listed(MAPPING_ROLES)}")
    absent = [f"{role} = {name!r}" for role, name in mapping.items() if name not in skeleton.names]
    if absent:
        raise FigureError(
            f"the mapping names joints that the rig lacks: {listed(absent)}; joints: {listed(skeleton.names)}"
        )
    return {role: skeleton.index(name) for role, name in mapping.items()}


def _assemble(skeleton: Skeleton, found: Mapping[str, int], by: str) -> Roles:
    pairs = {r: (found[f"l_{r}"], found[f"r_{r}"]) for r in LIMB_ROLES}
    for chain in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")):
        for k, side in enumerate(SIDES):
            joints = [pairs[r][k] for r in chain]
            if not is_chain(skeleton, joints):
                names = " > ".join(skeleton.names[j] for j in joints)
                raise FigureError(f"{side}_{', '.join(chain)} are not one below the other: {names}")
    upper = skeleton.common_ancestor(pairs["shoulder"])
    pelvis = found.get("pelvis", skeleton.common_ancestor([*pairs["hip"], upper]))
    if not skeleton.path(pelvis, upper) or not all(skeleton.path(pelvis, j) for j in pairs["hip"]):
        raise FigureError(f"hips and shoulders do not hang below the pelvis {skeleton.names[pelvis]!r}")
    head, offset = _find_head(skeleton, found, pairs, upper)
    spine = tuple(skeleton.path(pelvis, head)[1:])
    if not spine:
        raise FigureError(
            f"no spine between pelvis {skeleton.names[pelvis]!r} and head {skeleton.names[head]!r}; "
            f"joints: {listed(skeleton.names)}"
        )
    clavicle = tuple(
        joint
        for side, shoulder in zip(SIDES, pairs["shoulder"], strict=True)
        for joint in _find_clavicle(skeleton, found.get(f"{side}_clavicle"), {pelvis, *spine}, shoulder)
    )
    if len(clavicle) != 2:
        clavicle = ()
    return Roles(pelvis, spine, offset, clavicle, **pairs, found_by=by)


def _find_clavicle(skeleton: Skeleton, named: int | None, trunk: set[int], shoulder: int) -> tuple[int, ...]:
    """The joint between trunk and shoulder: the named one, else the first that is not in the trunk."""
    path = skeleton.path(0, shoulder)
    below = max((k for k, joint in enumerate(path) if joint in trunk), default=-1) + 1
    between = path[below:-1]
    if named in between:
        return (int(named),)
    return tuple(between[:1])


def _find_head(
    skeleton: Skeleton, found: Mapping[str, int], pairs: Mapping[str, tuple[int, int]], upper: int
) -> tuple[int, tuple[float, float, float]]:
    """Head joint, else the end site at the top of the neck."""
    zero = (0.0, 0.0, 0.0)
    if "head" in found:
        return found["head"], zero
    necks = [c for c in skeleton.children[upper] if not any(skeleton.path(c, s) for s in pairs["shoulder"])]
    joint = max(necks, key=lambda c: _reach(skeleton, c), default=upper)
    while joint != upper and skeleton.children[joint]:
        *others, ahead = sorted(skeleton.children[joint], key=lambda c: _reach(skeleton, c))
        if others and _reach(skeleton, others[-1]) > 0.4 * _reach(skeleton, ahead):
            break  # eyes, jaw and hair branch off: this is the head
        joint = ahead
    sites = skeleton.sites_of(joint)
    lengths = np.linalg.norm(skeleton.site_offsets[sites], axis=1)
    if lengths.max(initial=0.0) > 1e-6:
        x, y, z = (float(v) for v in skeleton.site_offsets[sites[np.argmax(lengths)]])
        return joint, (x, y, z)
    if joint == upper:
        raise FigureError(
            "this role was not found: head (no joint is named so, and nothing rises between the arms). "
            f'Joints of the rig: {listed(skeleton.names)}. Name it in a mapping file: head = "..."'
        )
    return joint, zero


def _reach(skeleton: Skeleton, joint: int) -> float:
    """Longest way from the parent of ``joint`` down through it."""
    return float(np.linalg.norm(skeleton.offsets[joint]) + skeleton.ways_down[0][joint])
