"""Markers on the built-in figure: recordings whose truth is known."""

from __future__ import annotations

import warnings

import numpy as np

import sixpoint as sp
from sixpoint.body import rotations as rot
from sixpoint.body.markers.recording import Event, Markers
from sixpoint.body.motion import FileSpace
from sixpoint.samples import make_sample

# Label without its side -> joint, and offset of the left one in the neutral pose [m]: X left, Y up, Z front.
SIDED = {
    "FWT": ("pelvis", (0.12, 0.03, 0.09)),
    "BWT": ("pelvis", (0.05, 0.05, -0.10)),
    "THI": ("hip", (0.07, -0.22, 0.02)),
    "KNE": ("hip", (0.05, -0.42, 0.0)),
    "SHN": ("knee", (0.05, -0.20, 0.01)),
    "ANK": ("knee", (0.04, -0.43, 0.0)),
    "HEE": ("ankle", (0.0, -0.04, -0.06)),
    "TOE": ("ankle", (0.01, -0.04, 0.14)),
    "MT5": ("ankle", (0.06, -0.05, 0.10)),
    "FHD": ("head", (0.07, 0.10, 0.09)),
    "BHD": ("head", (0.07, 0.08, -0.08)),
    "SHO": ("clavicle", (0.15, 0.05, 0.0)),
    "UPA": ("shoulder", (0.04, -0.15, 0.0)),
    "ELB": ("shoulder", (0.04, -0.30, 0.0)),
    "FRM": ("elbow", (0.03, -0.13, 0.0)),
    "WRA": ("elbow", (0.0, -0.26, 0.03)),
    "WRB": ("elbow", (0.0, -0.26, -0.03)),
    "FIN": ("wrist", (0.02, -0.08, 0.0)),
}
MIDDLE = {
    "C7": ("chest", (0.0, 0.05, -0.06)),
    "T10": ("chest", (0.0, -0.20, -0.10)),
    "CLAV": ("chest", (0.0, -0.02, 0.10)),
    "STRN": ("chest", (0.0, -0.18, 0.12)),
    "RBAC": ("chest", (-0.08, -0.10, -0.10)),
}


def place_markers(motion: sp.Motion, figure: sp.Figure) -> Markers:
    """CMU's 41 markers on a motion of the built-in figure, exactly."""
    roles, (positions, world) = figure.roles, motion.transforms
    names, columns = [], []
    for label, (where, offset) in MIDDLE.items():
        joint = roles.spine[-1]
        assert where == "chest"
        names.append(label)
        columns.append(positions[:, joint] + rot.mul_vec(world[:, joint], offset))
    for label, (where, offset) in SIDED.items():
        joints = getattr(roles, where)
        for k, (side, mirror) in enumerate((("L", 1.0), ("R", -1.0))):
            joint = joints if isinstance(joints, int) else joints[k]
            names.append(side + label)
            columns.append(
                positions[:, joint] + rot.mul_vec(world[:, joint], np.multiply(offset, [mirror, 1, 1]))
            )
    events = (Event("Foot Strike", 0.25, "Left"), Event("Foot Off", 0.75, "Right"))
    space = FileSpace(0.001, "z")
    return Markers(tuple(names), np.stack(columns, axis=1), motion.rate, None, events, space, "walk")


def walking_markers(frames: int = 120) -> Markers:
    """A walk with CMU's 41 markers, without gaps."""
    figure = sp.Figure.from_stature(1.75)
    return place_markers(make_sample("walk", figure).sliced(slice(0, frames)), figure)


def misplaced_roles(markers: Markers, roles: dict[str, str]) -> list[str]:
    """What is wrong with the places of markers in an upright recording, by anatomy; empty if nothing is.

    Args:
        markers: In metres, Y up.
        roles: Role -> label.
    """
    at = {role: markers.positions[:, markers.index(label)] for role, label in roles.items()}

    def share(condition: np.ndarray, known: np.ndarray) -> float:
        return float(condition[known].mean()) if known.any() else 1.0

    def both(a: str, b: str) -> bool:
        return a in at and b in at

    wrong = []
    pairs = [role[2:] for role in at if role.startswith("l_") and f"r_{role[2:]}" in at]
    backs = [at[role] for role in ("l_psis", "r_psis", "sacrum") if role in at]
    if backs:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # frames in which none is seen
            front = np.nanmean([at["l_asis"], at["r_asis"]], axis=0) - np.nanmean(backs, axis=0)
    else:
        toe = "toe" if "l_toe" in at else "toe_tip"
        front = at[f"l_{toe}"] - at["l_heel"] + at[f"r_{toe}"] - at["r_heel"]
    front = front * [1, 0, 1]
    front /= np.linalg.norm(front, axis=1, keepdims=True)
    left = np.cross([0.0, 1.0, 0.0], front)
    for name in pairs:  # limbs cross the middle: mostly is enough
        across = np.sum((at[f"l_{name}"] - at[f"r_{name}"]) * left, axis=1)
        least = 0.9 if name in ("asis", "psis", "hip_centre", "acromion") else 0.6
        if share(across > 0, np.isfinite(across)) < least:
            wrong.append(f"left {name} is not on the left")
    heights = ["heel", "ankle_lateral", "knee_lateral", "asis", "acromion", "head_front"]
    for s in "lr":
        rows = [f"{s}_{name}" for name in heights if f"{s}_{name}" in at]
        for low, high in zip(rows, rows[1:], strict=False):
            up = at[high][:, 1] - at[low][:, 1]
            if share(up > 0, np.isfinite(up)) < 0.6:  # heels rise above ankles
                wrong.append(f"{high} is not above {low}")
        for back, ahead in (
            ("psis", "asis"),
            ("heel", "toe"),
            ("heel", "fifth_metatarsal"),
            ("head_back", "head_front"),
        ):
            if both(f"{s}_{back}", f"{s}_{ahead}"):
                way = np.sum((at[f"{s}_{ahead}"] - at[f"{s}_{back}"]) * front, axis=1)
                if share(way > 0, np.isfinite(way)) < 0.6:
                    wrong.append(f"{s}_{ahead} is not in front of {s}_{back}")
        for a, b, least, most in (
            ("knee_lateral", "ankle_lateral", 0.3, 0.55), ("elbow_lateral", "wrist_radial", 0.15, 0.35),
            ("elbow_lateral", "wrist_ulnar", 0.15, 0.35), ("acromion", "elbow_lateral", 0.2, 0.42),
            ("knee_lateral", "knee_medial", 0.06, 0.18), ("ankle_lateral", "ankle_medial", 0.04, 0.14),
            ("wrist_radial", "wrist_ulnar", 0.03, 0.2), ("heel", "toe", 0.12, 0.3),
            ("hip_centre", "knee_centre", 0.3, 0.55),
        ):  # fmt: skip
            if both(f"{s}_{a}", f"{s}_{b}"):
                way = np.nanmedian(np.linalg.norm(at[f"{s}_{a}"] - at[f"{s}_{b}"], axis=1))
                if not least < way < most:
                    wrong.append(f"{s}_{a} and {s}_{b} are {way:.2f} m apart")
        for a, b, far in (
            ("thigh", "knee_lateral", 0.5),
            ("shank", "knee_lateral", 0.45),
            ("forearm", "elbow_lateral", 0.3),
        ):
            if both(f"{s}_{a}", f"{s}_{b}"):
                way = np.nanmedian(np.linalg.norm(at[f"{s}_{a}"] - at[f"{s}_{b}"], axis=1))
                if way > far:
                    wrong.append(f"{s}_{a} is {way:.2f} m from {s}_{b}")
    return wrong
