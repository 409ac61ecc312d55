"""Where each marker of a recording is expected on the built-in figure, and how sure that is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.markers.roles import MarkerRoles
from sixpoint.body.tables import read_shipped
from sixpoint.calibration.markers.kinematics import Kinematics

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Places:
    """M markers on the figure.

    A marker is at ``reach @ lengths + offset`` in the frame of its carrier: the first term leads to the joint
    that its place is given from, at the end of the bone.

    Attributes:
        names: Labels in the recording.
        roles: What they are.
        segments: What they are fixed to.
        carriers: (M,) joint of each.
        reach: (M, 3, K) per segment length.
        offsets: (M, 3) expected [m].
        std: (M, 3) standard deviations of these [m].
        skin: (M,) how far the skin slides under each marker, relative to what is usual.
    """

    names: tuple[str, ...]
    roles: tuple[str, ...]
    segments: tuple[str, ...]
    carriers: NDArray[np.int64]
    reach: Array
    offsets: Array
    std: Array
    skin: Array

    def columns(self, *roles: str) -> list[int]:
        """Markers with any of some roles."""
        return [k for k, role in enumerate(self.roles) if role in roles]

    def on(self, *segments: str) -> list[int]:
        """Markers on any of some segments."""
        return [k for k, segment in enumerate(self.segments) if segment in segments]


@cache
def _table() -> dict[str, Any]:
    return read_shipped("marker_places.toml")


def place_markers(found: MarkerRoles, stature: float, kinematics: Kinematics) -> Places:
    """Expected places of all markers with roles.

    Args:
        found: Roles of the labels.
        stature: Of the person [m]; offsets are proportional.
        kinematics: The figure.
    """
    scale = stature / _table()["stature"] / 100.0
    rows = [_row(role, found.segments[label]) for label, role in found.roles.items()]
    joint = kinematics.skeleton.index
    carriers = np.array([joint(row[0]) for row in rows], np.int64)
    return Places(
        tuple(found.roles),
        tuple(found.roles.values()),
        tuple(found.segments[label] for label in found.roles),
        carriers,
        np.array([_anchor(kinematics, row[1]) - _anchor(kinematics, row[0]) for row in rows]),
        np.array([row[2] for row in rows], float) * scale,
        np.array([row[3] for row in rows], float) * scale,
        np.array([_skin(found.segments[label]) for label in found.roles]),
    )


def _anchor(kinematics: Kinematics, name: str) -> Array:
    """(3, K) neutral place of a joint, or of the middle between the hips, per segment length."""
    rest, joint = kinematics.rest_per_length, kinematics.skeleton.index
    if name == "hips":
        return np.asarray(0.5 * (rest[joint("l_hip")] + rest[joint("r_hip")]))
    return np.asarray(rest[joint(name)])


def _row(role: str, segment: str) -> tuple[str, str, list[float], list[float]]:
    """Carrier, anchor, offset and deviation [cm] of a role, mirrored for the right side."""
    tables, side, bare = _table(), role[:2], role[2:]
    middle: Mapping[str, Any] = tables["middle"]
    sided: Mapping[str, Any] = tables["sided"]
    if side in ("l_", "r_") and bare in sided:
        row = sided[bare]
    elif role in middle:
        side, row = "", middle[role]
    elif segment in tables["segments"]:
        side, row = "", tables["segments"][segment]
    else:
        side, row = segment[:2], tables["segments"]["*" + segment[1:]]
    carrier, anchor, offset, std = row
    mirror = -1.0 if side == "r_" else 1.0
    place = [mirror * offset[0], offset[1], offset[2]]
    return carrier.replace("*_", side), anchor.replace("*_", side), place, std


def _skin(segment: str) -> float:
    """How far skin slides on a segment [cm], relative to a usual one [cm]."""
    skin: Mapping[str, float] = _table()["skin"]
    bare = segment[2:] if segment[:2] in ("l_", "r_") else segment
    return float(skin.get(bare, skin["usual"])) / float(skin["usual"])


def pelvic_tilt() -> float:
    """Forward tilt of the plane of the iliac spines in the neutral pose [rad]."""
    return float(np.radians(_table()["pelvic_tilt"]))
