"""Roles from joint names: sides and naming families, as listed in ``data/rig_names.toml``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import cache
from itertools import pairwise
from typing import Any

from sixpoint.body.skeleton import Skeleton
from sixpoint.body.tables import read_shipped

SIDES = ("l", "r")
DIGITS = "0123456789"
_SIDE_WORDS = ("left", "l", "right", "r")

Named = dict[tuple[str, str], int]


@cache
def _tables() -> dict[str, Any]:
    return read_shipped("rig_names.toml")


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
        if token in _SIDE_WORDS:
            return token[0], "".join(tokens[:k] + tokens[k + 1 :])
    base = "".join(tokens)
    for side, word in (("l", "left"), ("r", "right")):
        if base.startswith(word):
            return side, base[len(word) :]
        if base.endswith(word):
            return side, base[: -len(word)]
    for k in range(len(tokens)):  # "lfemur", "LUArm": a letter glued to a known word
        before, rest = "".join(tokens[:k]), "".join(tokens[k:])
        if rest[:1] in SIDES and rest[1:].rstrip(DIGITS) in _vocabulary():
            return rest[0], before + rest[1:]
    return "", base


def find_named(skeleton: Skeleton) -> dict[str, int]:
    """Roles found by name: whole legs, whole arms, clavicles and head."""
    named = _read_names(skeleton)
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
    # "J_Bip_C_Head": a rig may mark what is in the middle.
    places = [("", middle + word) for word in tables["head"] for middle in (prefix, f"{prefix}c", "")]
    heads = [named[place] for place in places if place in named]
    return found | ({"head": heads[0]} if heads else {})


def _read_names(skeleton: Skeleton) -> Named:
    """(side, base) -> the first joint so called; a number at the end counts only where it must."""
    split = [split_name(name) for name in skeleton.names]
    named: Named = {}
    for joint, key in enumerate(split):
        named.setdefault(key, joint)
    for joint, (side, base) in enumerate(split):  # "upperleg01.L", "LeftUpLeg_056"
        named.setdefault((side, base.rstrip(DIGITS)), joint)
    return named


def _match_row(skeleton: Skeleton, named: Named, row: Mapping[str, list[str]]) -> tuple[dict[str, int], str]:
    """Match one naming family on both sides under one common prefix."""
    bases = {base for side, base in named if side}
    first = next(iter(row.values()))
    prefixes = {base[: -len(word)] for base in bases for word in first if base.endswith(word)}
    for prefix in sorted(prefixes, key=lambda p: (len(p), p)):
        found: dict[str, int] = {}
        for side in SIDES:
            for role, words in row.items():
                joints = [named[(side, prefix + w)] for w in words if (side, prefix + w) in named]
                if joints:
                    found[f"{side}_{role}"] = joints[0]
        complete = len(found) == 2 * len(row)
        if complete and all(is_chain(skeleton, [found[f"{s}_{r}"] for r in row]) for s in SIDES):
            return found, prefix
    return {}, ""


def is_chain(skeleton: Skeleton, joints: Iterable[int]) -> bool:
    """Whether each joint is strictly below the one before it."""
    return all(a != b and bool(skeleton.path(a, b)) for a, b in pairwise(joints))
