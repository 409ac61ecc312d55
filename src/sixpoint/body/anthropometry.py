"""The built-in figure: 34 H-Anim joints from a stature or from the paper's segment parameters.

Limbs hang straight down in the rest pose, which is the neutral pose: every frame is world-aligned.

Reference: H-Anim (ISO/IEC 19774); Unzueta et al. 2008, section 9; numbers in ``data/proportions.toml``.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from sixpoint.body.skeleton import Skeleton
from sixpoint.body.tables import read_shipped
from sixpoint.errors import FigureError, listed

MEAN_STATURE = 1.75


@cache
def _proportions() -> dict[str, Any]:
    return read_shipped("proportions.toml")


def segments_of_stature(stature: float) -> dict[str, float]:
    """The eleven segment lengths [m] of a person of a stature [m].

    Raises:
        FigureError: The stature is not a human's (0.4 to 2.8 m).
    """
    if not 0.4 <= stature <= 2.8:
        raise FigureError(f"stature is in metres, 0.4 to 2.8, got {stature:g}")
    return {name: fraction * stature for name, fraction in _proportions()["segments"].items()}


def segments_of_skeleton(skeleton: Skeleton) -> dict[str, float]:
    """The segment lengths [m] from which ``build_skeleton`` makes a skeleton: its inverse.

    Raises:
        FigureError: It was not made so.
    """
    names = list(segments_of_stature(MEAN_STATURE))
    ones = dict.fromkeys(names, 1.0)
    zero = build_skeleton(ones)
    if skeleton.names != zero.names:
        raise FigureError("only the built-in figure has segment lengths; this skeleton has other joints")
    grown = [build_skeleton(ones | {name: 2.0}).offsets - zero.offsets for name in names]
    lengths = np.linalg.lstsq(
        np.reshape(grown, (len(names), -1)).T, skeleton.offsets.reshape(-1), rcond=None
    )[0]
    segments = dict(zip(names, map(float, lengths), strict=True))
    if not np.allclose(build_skeleton(segments).offsets, skeleton.offsets, atol=1e-6):
        raise FigureError("this skeleton has the built-in figure's joints, but in other places")
    return segments


def build_skeleton(segments: Mapping[str, float] | None = None) -> Skeleton:
    """The 34-joint figure with its soles on the floor (y = 0).

    Args:
        segments: Segment lengths [m] by name; those not given follow from the mean stature.

    Raises:
        FigureError: An unknown segment, or a length that is not positive.
    """
    lengths = segments_of_stature(MEAN_STATURE)
    unknown = [name for name in segments or {} if name not in lengths]
    if unknown:
        raise FigureError(f"unknown segments: {listed(unknown)}; segments: {listed(lengths)}")
    lengths |= {name: float(value) for name, value in (segments or {}).items()}
    wrong = [f"{n} = {v:g}" for n, v in lengths.items() if not (np.isfinite(v) and v > 0)]
    if wrong:
        raise FigureError(f"segment lengths must be positive [m]: {listed(wrong)}")
    return _assemble(lengths, _proportions()["shape"])


def _assemble(length: Mapping[str, float], shape: Mapping[str, Any]) -> Skeleton:
    names: list[str] = []
    parents: list[int] = []
    offsets: list[tuple[float, float, float]] = []
    sites: list[tuple[str, int, tuple[float, float, float]]] = []

    def add(name: str, parent: str | None, x: float, y: float, z: float) -> None:
        parents.append(-1 if parent is None else names.index(parent))
        names.append(name)
        offsets.append((x, y, z))

    def add_site(name: str, parent: str, x: float, y: float, z: float) -> None:
        sites.append((name, names.index(parent), (x, y, z)))

    leg = length["thigh"] + length["calf"] + length["pelvis_length"]
    stature = length["thigh"] / _proportions()["segments"]["thigh"]
    ankle = shape["ankle_height"] * stature
    add("humanoid_root", None, 0.0, leg + ankle, 0.0)
    add("sacroiliac", "humanoid_root", 0.0, 0.0, 0.0)
    foot = length["foot"]
    for side, sign in (("l", 1.0), ("r", -1.0)):
        half = sign * length["pelvis_width"] / 2
        add(f"{side}_hip", "sacroiliac", half, -length["pelvis_length"], shape["hip_forward"] * stature)
        add(f"{side}_knee", f"{side}_hip", 0.0, -length["thigh"], 0.0)
        add(f"{side}_ankle", f"{side}_knee", 0.0, -length["calf"], 0.0)
        add(f"{side}_subtalar", f"{side}_ankle", 0.0, -0.35 * ankle, -0.02 * foot)
        add(f"{side}_midtarsal", f"{side}_subtalar", 0.0, -0.1 * ankle, 0.22 * foot)
        add(f"{side}_metatarsal", f"{side}_midtarsal", 0.0, -0.4 * ankle, 0.25 * foot)
        toe = (1.0 - shape["ankle_behind"] - 0.45) * foot
        add_site(f"{side}_toe_tip", f"{side}_metatarsal", 0.0, -0.15 * ankle, toe)
        add_site(f"{side}_heel", f"{side}_ankle", 0.0, -ankle, -shape["ankle_behind"] * foot)
    add("vl5", "humanoid_root", 0.0, 0.0, 0.0)
    _add_column(add, "vl5", shape["spine"], length["torso_length"])
    _add_column(add, "vt1", shape["neck"], length["neck"])
    add_site("skull_tip", "skullbase", 0.0, shape["skull_height"] * stature, -shape["skull_back"] * stature)
    torso, hand = length["torso_length"], length["hand"]
    for side, sign in (("l", 1.0), ("r", -1.0)):
        half, inner = sign * length["torso_width"] / 2, shape["sternoclavicular_side"]
        up, forward = shape["sternoclavicular"]
        add(f"{side}_sternoclavicular", "vt1", inner * half, up * torso, forward * torso)
        up, forward = shape["shoulder"]
        add(f"{side}_shoulder", f"{side}_sternoclavicular", (1 - inner) * half, up * torso, forward * torso)
        add(f"{side}_elbow", f"{side}_shoulder", 0.0, -length["upper_arm"], 0.0)
        add(f"{side}_wrist", f"{side}_elbow", 0.0, -length["forearm"], 0.0)
        for finger, reach, front in (("thumb1", 0.2, 0.2), ("index1", 0.5, 0.12), ("pinky1", 0.46, -0.16)):
            add(f"{side}_{finger}", f"{side}_wrist", 0.0, -reach * hand, front * hand)
            tip = -0.34 * hand if finger == "thumb1" else -0.46 * hand
            add_site(f"{side}_{finger[:-1]}_tip", f"{side}_{finger}", 0.0, tip, 0.3 * front * hand)
    return Skeleton(
        tuple(names),
        np.array(parents),
        np.array(offsets),
        tuple(s[0] for s in sites),
        np.array([s[1] for s in sites]),
        np.array([s[2] for s in sites]),
    )


def _add_column(add: Any, base: str, rows: list[list[Any]], scale: float) -> None:
    """Stack joints given as [name, up, forward] from the base joint."""
    parent, at = base, np.zeros(2)
    for name, up, forward in rows:
        place = np.array([up, forward]) * scale
        add(name, parent, 0.0, float(place[0] - at[0]), float(place[1] - at[1]))
        parent, at = name, place
