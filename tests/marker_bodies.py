"""Markers on the built-in figure: recordings whose truth is known."""

from __future__ import annotations

import numpy as np

import sixpoint as sp
from sixpoint.body import rotations as rot
from sixpoint.body.markers import Event, Markers
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
