"""From the unit and axes of a marker file to ours: metres, Y up.

A unit or an up axis that is stated is checked against the body: distances between markers of known roles,
and the head above the feet. Where the two disagree clearly the body is believed, and it is said.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.markers.recording import Markers
from sixpoint.body.markers.roles import MarkerRoles, find_marker_roles
from sixpoint.body.motion import FileSpace
from sixpoint.errors import FormatError, listed
from sixpoint.formats.markers.raw import RawMarkers
from sixpoint.formats.space import INCH, UNITS, parse_unit

Array = NDArray[np.float64]

AXES = ("x", "-x", "y", "-y", "z", "-z")
"""Axes of a file that may point up."""

_SPELLINGS = {
    **UNITS, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0, "dm": 0.1, "centimeter": 0.01,
    "centimeters": 0.01, "centimetre": 0.01, "centimetres": 0.01, "millimeter": 1e-3, "millimeters": 1e-3,
    "millimetre": 1e-3, "millimetres": 1e-3, "in": INCH, "inches": INCH, "ft": 0.3048, "feet": 0.3048,
}  # fmt: skip

# Distances between markers of an adult about 1.75 m tall [m]; they bend with no joint between them.
_BONES = (
    ("l_asis", "r_asis", 0.25), ("l_acromion", "r_acromion", 0.36),
    ("l_hip_centre", "l_knee_centre", 0.42), ("r_hip_centre", "r_knee_centre", 0.42),
    ("l_knee_centre", "l_ankle_centre", 0.41), ("r_knee_centre", "r_ankle_centre", 0.41),
    ("l_knee_lateral", "l_ankle_lateral", 0.41), ("r_knee_lateral", "r_ankle_lateral", 0.41),
    ("l_heel", "l_toe", 0.20), ("r_heel", "r_toe", 0.20),
    ("l_elbow_lateral", "l_wrist_radial", 0.25), ("r_elbow_lateral", "r_wrist_radial", 0.25),
    ("l_elbow_centre", "l_wrist_centre", 0.25), ("r_elbow_centre", "r_wrist_centre", 0.25),
    ("l_acromion", "l_elbow_lateral", 0.31), ("r_acromion", "r_elbow_lateral", 0.31),
    ("l_shoulder_centre", "l_elbow_centre", 0.28), ("r_shoulder_centre", "r_elbow_centre", 0.28),
    ("l_trochanter", "l_knee_lateral", 0.40), ("r_trochanter", "r_knee_lateral", 0.40),
)  # fmt: skip
_WRONG = 3.0  # a body this many times too large or small has another unit
_CLEARLY = 1.5  # the way from feet to trunk along one axis outweighs the others by this factor
_SAMPLES = 300
_HIGH = ("pelvis", "spine", "thorax", "head", "l_clavicle", "r_clavicle")
_LOW = ("l_shank", "r_shank", "l_foot", "r_foot", "l_toes", "r_toes")


def enter_world(
    path: Path, raw: RawMarkers, unit: str | float | None, up: str | None, rate: float | None
) -> Markers:
    """Markers in file units and file axes -> metres, Y up.

    Args:
        path: For messages, and for the name.
        raw: What the reader found; notes are added to it.
        unit: What the user says.
        up: What the user says.
        rate: What the user says [Hz].

    Raises:
        FormatError: Unit or axis are unknown, or there is no rate.
    """
    rate = raw.rate if rate is None else rate
    if rate is None:
        raise FormatError(path, "the file states no frame rate above zero; give it: --rate HZ, or rate=HZ")
    roles = find_marker_roles(raw.names)
    shown = raw.positions[np.unique(np.linspace(0, len(raw.positions) - 1, _SAMPLES).astype(int))]
    space = _find_space(path, raw, roles, shown, unit, up)
    turn = turn_from(space.up)
    positions = raw.positions @ turn.T * space.unit
    _check_sides(raw, roles, positions)
    return Markers(
        tuple(raw.names),
        positions,
        rate,
        None if raw.residuals is None else raw.residuals * space.unit,
        raw.events,
        space,
        path.stem,
    )


def turn_from(up: str) -> Array:
    """(3, 3) rotation of the world that brings an up axis of a file to +Y."""
    return np.array(
        {
            "y": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
            "-y": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
            "z": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
            "-z": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
            "x": [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
            "-x": [[0, 1, 0], [-1, 0, 0], [0, 0, 1]],
        }[up],
        float,
    )


def _find_space(
    path: Path, raw: RawMarkers, roles: MarkerRoles, shown: Array, unit: str | float | None, up: str | None
) -> FileSpace:
    if unit is not None:
        metres, unit_source = parse_unit(path, unit), "given"
    else:
        metres, unit_source = _choose_unit(raw, roles, shown)
    if up is not None:
        if up.lower().lstrip("+") not in AXES:
            raise FormatError(path, f"unknown up axis {up!r}; axes: {listed(AXES)}")
        return FileSpace(metres, up.lower().lstrip("+"), unit_source, "given")
    guessed = guess_up(roles, raw.names, shown)
    if raw.up and guessed not in ("", raw.up):
        raw.notes.append(f"the file says {raw.up} is up, but the body stands along {guessed}: that is taken")
    axis = guessed or raw.up or raw.usual_up
    source = "file" if axis == raw.up else "guessed" if guessed else "convention"
    return FileSpace(metres, axis, unit_source, source)


def _choose_unit(raw: RawMarkers, roles: MarkerRoles, shown: Array) -> tuple[float, str]:
    stated = _SPELLINGS.get(raw.unit.strip().lower())
    measured = measure_unit(roles, raw.names, shown)
    if stated is not None:
        if measured is None or 1.0 / _WRONG < measured / stated < _WRONG:
            return stated, "file"
        guessed = _nearest_unit(measured)
        size = 1.75 * stated / measured
        raw.notes.append(
            f"the file states {raw.unit!r}, with which the person would be about {size:.3g} m tall: "
            f"{_name(guessed)} is taken (unit= or --unit to overrule)"
        )
        return guessed, "guessed"
    if raw.unit:
        raw.notes.append(f"the unit {raw.unit!r} is unknown: guessed from the size of the body")
    return _nearest_unit(measured or _measure_extent(shown)), "guessed"


def measure_unit(roles: MarkerRoles, names: list[str], positions: Array) -> float | None:
    """Metres per file unit by the body's distances; None where fewer than two are known."""
    labels, ratios = roles.labels, []
    for a, b, length in _BONES:
        if a in labels and b in labels:
            ends = positions[:, names.index(labels[a])] - positions[:, names.index(labels[b])]
            ways = np.linalg.norm(ends, axis=1)
            ways = ways[np.isfinite(ways) & (ways > 1e-9)]
            if len(ways):
                ratios.append(length / float(np.median(ways)))
    return float(np.median(ratios)) if len(ratios) > 1 else None


def _measure_extent(positions: Array) -> float:
    """Metres per file unit if the markers of a frame spread as far as those of a body do."""
    flat = [frame[np.isfinite(frame[:, 0])] for frame in positions]
    ways = [float(np.ptp(frame, axis=0).max()) for frame in flat if len(frame) > 1]
    extent = float(np.median(ways)) if ways else 0.0
    return 1.5 / extent if extent > 1e-9 else 1.0


def _nearest_unit(measured: float) -> float:
    return min((1.0, 0.01, 0.001), key=lambda unit: abs(math.log(unit / measured)))


def _name(metres: float) -> str:
    return {1.0: "m", 0.01: "cm", 0.001: "mm"}[metres]


def guess_up(roles: MarkerRoles, names: list[str], positions: Array) -> str:
    """The axis along which trunk and head are above the feet; empty where that is not clear."""
    high = [names.index(label) for label, segment in roles.segments.items() if segment in _HIGH]
    low = [names.index(label) for label, segment in roles.segments.items() if segment in _LOW]
    if not (high and low):
        return ""
    ways = _mean_seen(positions[:, high]) - _mean_seen(positions[:, low])
    ways = ways[np.isfinite(ways[:, 0])]
    if not len(ways):
        return ""
    way = ways.mean(axis=0)
    order = np.argsort(-np.abs(way))
    if abs(way[order[0]]) < _CLEARLY * abs(way[order[1]]):
        return ""
    return ("-" if way[order[0]] < 0 else "") + "xyz"[order[0]]


def _mean_seen(points: Array) -> Array:
    """(F, 3) mean of the points (F, K, 3) that are seen; NaN where none is."""
    seen = np.isfinite(points[..., :1])
    count = seen.sum(axis=1)
    total = np.where(seen, points, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _check_sides(raw: RawMarkers, roles: MarkerRoles, positions: Array) -> None:
    """Note a mirrored file: the left markers on the right, as seen from heel to toe or back to front."""
    found = roles.labels
    for back, front in (("psis", "asis"), ("heel", "toe")):
        needed = [f"{side}_{end}" for end in (back, front) for side in "lr"]
        if all(role in found for role in needed):
            points = [positions[:, raw.names.index(found[role])] for role in needed]
            forward = points[2] + points[3] - points[0] - points[1]
            left = points[2] - points[3] if back == "psis" else points[0] - points[1]
            turned = forward[:, 2] * left[:, 0] - forward[:, 0] * left[:, 2]  # Y of forward x left
            turned = turned[np.isfinite(turned)]
            if len(turned) and np.mean(turned < 0) > 0.9:
                raw.notes.append("left and right look exchanged: the labels are swapped or the axes mirrored")
            return
