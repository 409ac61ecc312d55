"""Which joint of a rig is the knee? Roles from joint names, else from the structure of the tree.

Only limbs and head are looked for. The pelvis is where legs and head part, the spine is the path from
there to the head, and the clavicle is what lies between the spine and a shoulder.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.skeleton import Skeleton
from sixpoint.body.structure import find_limbs
from sixpoint.errors import FigureError, listed

Array = NDArray[np.float64]

SIDES = ("l", "r")
LIMB_ROLES = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
MAPPING_ROLES = (
    "pelvis",
    "head",
    *(f"{side}_{role}" for role in ("clavicle", *LIMB_ROLES) for side in SIDES),
)
"""Roles that a mapping may name."""


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


def find_roles(skeleton: Skeleton, mapping: Mapping[str, str] | None = None) -> Roles:
    """Find the anatomical roles of a rig.

    Args:
        skeleton: Any rig.
        mapping: Role -> joint name, for the roles that should not be searched (``MAPPING_ROLES``).

    Raises:
        FigureError: A role was not found; the message lists the joints and the missing roles.
    """
    given = _checked(skeleton, mapping or {})
    found = _from_names(skeleton)
    by = "names"
    if not all(f"{s}_{r}" in found | given for r in LIMB_ROLES for s in SIDES):
        structural = find_limbs(skeleton)
        if structural:
            found, by = structural | {k: v for k, v in found.items() if k == "head"}, "structure"
    if given:
        by = f"{by} and mapping"
    found |= given
    missing = [f"{s}_{r}" for r in LIMB_ROLES for s in SIDES if f"{s}_{r}" not in found]
    if missing:
        raise FigureError(
            f"these roles were not found: {listed(missing)}. Joints of the rig: {listed(skeleton.names)}. "
            "Name them in a mapping file, e.g. l_hip = \"LeftThigh\""
        )
    return _assemble(skeleton, found, by)


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


# --- names ---------------------------------------------------------------------------------------


@cache
def _tables() -> dict[str, Any]:
    text = resources.files("sixpoint.body").joinpath("data/rig_names.toml").read_text("utf-8")
    return tomllib.loads(text)


@cache
def _vocabulary() -> frozenset[str]:
    tables = _tables()
    words = {w for row in tables["legs"] + tables["arms"] for words in row.values() for w in words}
    return frozenset(words | set(tables["clavicle"]))


def split_name(name: str) -> tuple[str, str]:
    """Joint name -> (side "l", "r" or "", base in lower case): ``"LeftUpLeg"`` -> ``("l", "upleg")``."""
    name = name.rsplit(":", 1)[-1].rsplit("|", 1)[-1]
    tokens = [t.lower() for t in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name)]
    for k, token in enumerate(tokens):
        if token in ("left", "l", "right", "r"):
            return token[0], "".join(tokens[:k] + tokens[k + 1 :])
    base = "".join(tokens)
    for side, word in (("l", "left"), ("r", "right")):
        if base.startswith(word):
            return side, base[len(word) :]
    if base[:1] in SIDES and base[1:] in _vocabulary():
        return base[0], base[1:]
    return "", base


def _from_names(skeleton: Skeleton) -> dict[str, int]:
    """Roles found by name: whole legs, whole arms, clavicles and head."""
    named: dict[tuple[str, str], int] = {}
    for joint, name in enumerate(skeleton.names):
        named.setdefault(split_name(name), joint)
    tables = _tables()
    found: dict[str, int] = {}
    prefix = ""
    for rows in (tables["legs"], tables["arms"]):
        for row in rows:
            match, match_prefix = _match_row(skeleton, named, row)
            if match:
                found, prefix = found | match, match_prefix
                break
    for side in SIDES:
        for word in tables["clavicle"]:
            joint = named.get((side, prefix + word))
            if joint is not None and joint != found.get(f"{side}_shoulder"):
                found[f"{side}_clavicle"] = joint
                break
    for word in tables["head"]:
        joint = named.get(("", prefix + word), named.get(("", word)))
        if joint is not None:
            found["head"] = joint
            break
    return found


def _match_row(
    skeleton: Skeleton, named: Mapping[tuple[str, str], int], row: Mapping[str, list[str]]
) -> tuple[dict[str, int], str]:
    """Match one naming family on both sides under one common prefix."""
    bases = {base for side, base in named if side}
    first = next(iter(row.values()))
    prefixes = {base[: -len(word)] for base in bases for word in first if base.endswith(word)}
    for prefix in sorted(prefixes, key=len):
        found: dict[str, int] = {}
        for side in SIDES:
            for role, words in row.items():
                joints = [named[(side, prefix + w)] for w in words if (side, prefix + w) in named]
                if joints:
                    found[f"{side}_{role}"] = joints[0]
        complete = len(found) == 2 * len(row)
        if complete and all(_is_chain(skeleton, [found[f"{s}_{r}"] for r in row]) for s in SIDES):
            return found, prefix
    return {}, ""


def _is_chain(skeleton: Skeleton, joints: Iterable[int]) -> bool:
    joints = list(joints)
    return all(
        a != b and bool(skeleton.path(a, b)) for a, b in zip(joints[:-1], joints[1:], strict=True)
    )


# --- from limbs to the whole ---------------------------------------------------------------------


def _assemble(skeleton: Skeleton, found: Mapping[str, int], by: str) -> Roles:
    pairs = {r: (found[f"l_{r}"], found[f"r_{r}"]) for r in LIMB_ROLES}
    for chain in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")):
        for k, side in enumerate(SIDES):
            joints = [pairs[r][k] for r in chain]
            if not _is_chain(skeleton, joints):
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


def _find_clavicle(
    skeleton: Skeleton, named: int | None, trunk: set[int], shoulder: int
) -> tuple[int, ...]:
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
    arms = {c for c in skeleton.children[upper] for s in pairs["shoulder"] if skeleton.path(c, s)}
    neck = [c for c in skeleton.children[upper] if c not in arms]
    if not neck:
        raise FigureError(
            "this role was not found: head (no joint is named so, and nothing rises between the arms). "
            f"Joints of the rig: {listed(skeleton.names)}. Name it in a mapping file: head = \"...\""
        )
    joint = max(neck, key=lambda c: _reach(skeleton, c))
    while skeleton.children[joint]:
        joint = max(skeleton.children[joint], key=lambda c: _reach(skeleton, c))
    sites = [s for s in skeleton.sites_of(joint) if np.linalg.norm(skeleton.site_offsets[s]) > 1e-6]
    if not sites:
        return joint, zero
    x, y, z = (float(v) for v in skeleton.site_offsets[sites[0]])
    return joint, (x, y, z)


def _reach(skeleton: Skeleton, joint: int) -> float:
    below = [_reach(skeleton, c) for c in skeleton.children[joint]]
    return float(np.linalg.norm(skeleton.offsets[joint])) + max(below, default=0.0)
