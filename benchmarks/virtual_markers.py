"""CMU's 41 labels as virtual markers on any figure, at known places: recordings whose truth is known."""

from __future__ import annotations

import numpy as np

import sixpoint as sp
from sixpoint.body import rotations as rot
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.markers.recording import Markers

Array = np.ndarray

ARM = ("SHO", "UPA", "ELB", "FRM", "WRA", "WRB", "FIN")
LEG = ("THI", "KNE", "SHN", "ANK", "HEE", "TOE", "MT5")


def place_virtual(figure: sp.Figure) -> MarkerModel:
    """Where the markers sit: on the skin of a person of the figure's lengths."""
    roles, rest = figure.roles, figure.rest_positions
    parents = figure.skeleton.parents
    placed: list[tuple[str, int, Array]] = []

    def add(label: str, joint: int, offset: object) -> None:
        placed.append((label, int(joint), np.asarray(offset, float)))

    hips = rest[list(roles.hip)].mean(axis=0) - rest[roles.pelvis]
    for label, offset in (
        ("LFWT", (0.12, 0.08, 0.09)), ("RFWT", (-0.12, 0.08, 0.09)),
        ("LBWT", (0.05, 0.1, -0.1)), ("RBWT", (-0.05, 0.1, -0.1)),
    ):  # fmt: skip
        add(label, roles.pelvis, hips + offset)
    chest = int(parents[roles.clavicle[0] if roles.clavicle else roles.shoulder[0]])
    shoulders = rest[list(roles.shoulder)].mean(axis=0) - rest[chest]
    for label, offset in (
        ("C7", (0, 0.06, -0.08)), ("CLAV", (0, 0, 0.1)), ("STRN", (0, -0.15, 0.13)),
        ("T10", (0, -0.2, -0.12)), ("RBAC", (-0.1, -0.1, -0.12)),
    ):  # fmt: skip
        add(label, chest, shoulders + offset)
    for label, offset in (
        ("LFHD", (0.07, 0.1, 0.1)), ("RFHD", (-0.07, 0.1, 0.1)),
        ("LBHD", (0.07, 0.1, -0.08)), ("RBHD", (-0.07, 0.1, -0.08)),
    ):  # fmt: skip
        add(label, roles.head, offset)
    for k, (side, out) in enumerate((("L", 1.0), ("R", -1.0))):
        top, middle, end = roles.shoulder[k], roles.elbow[k], roles.wrist[k]
        collar = roles.clavicle[k] if roles.clavicle else chest
        upper, fore = rest[middle] - rest[top], rest[end] - rest[middle]
        add(f"{side}SHO", collar, rest[top] - rest[collar] + [0, 0.05, 0])
        add(f"{side}UPA", top, 0.5 * upper + np.array([out * 0.06, 0, 0]))
        add(f"{side}ELB", top, upper + np.array([out * 0.045, 0, 0]))
        add(f"{side}FRM", middle, 0.5 * fore + np.array([out * 0.04, 0, 0]))
        add(f"{side}WRA", middle, fore + np.array([0, 0, 0.04]))
        add(f"{side}WRB", middle, fore + np.array([0, 0, -0.04]))
        add(f"{side}FIN", end, 0.09 * rot.unit(fore) + [out * 0.01, 0, 0.02])
        top, middle, end = roles.hip[k], roles.knee[k], roles.ankle[k]
        thigh, shank = rest[middle] - rest[top], rest[end] - rest[middle]
        add(f"{side}THI", top, 0.55 * thigh + np.array([out * 0.08, 0, 0.03]))
        add(f"{side}KNE", top, thigh + np.array([out * 0.055, 0, 0]))
        add(f"{side}SHN", middle, 0.5 * shank + np.array([out * 0.05, 0, 0.02]))
        add(f"{side}ANK", middle, shank + np.array([out * 0.045, 0, 0]))
        for label, offset in (
            ("HEE", (0, -0.04, -0.06)),
            ("TOE", (0, -0.05, 0.16)),
            ("MT5", (out * 0.05, -0.06, 0.1)),
        ):
            add(side + label, end, offset)
    labels, joints, offsets = zip(*placed, strict=True)
    index = np.array(joints)
    rigged = rot.mul_vec(rot.inv(figure.neutral[index]), np.array(offsets))
    return MarkerModel(figure, labels, index, rigged, np.full(len(labels), 0.005))


def record(model: MarkerModel, motion: sp.Motion, noise: float, seed: int) -> Markers:
    """The markers on a motion, with noise [m]."""
    rng = np.random.default_rng(seed)
    places = model.place(*motion.transforms)
    return Markers(model.names, places + rng.normal(0, noise, places.shape), motion.rate, name=motion.name)


def misplace(model: MarkerModel, by: float, seed: int) -> MarkerModel:
    """The model with every place wrong by so much along each axis [m], as a calibration may be."""
    rng = np.random.default_rng(seed)
    return MarkerModel(
        model.figure,
        model.names,
        model.joints,
        model.offsets + rng.normal(0, by, model.offsets.shape),
        model.spread,
    )


def drop(markers: Array, rate: float, seed: int, share: float = 0.2) -> Array:
    """Delete a share of every marker's samples in bursts of 0.05 to 1 s."""
    rng, out = np.random.default_rng(seed), markers.copy()
    for i in range(out.shape[1]):
        left = round(share * len(out))
        while left > 0:
            length = max(1, min(int(rng.uniform(0.05, 1.0) * rate), left, len(out)))
            start = int(rng.integers(0, len(out) - length + 1))
            left -= int(np.isfinite(out[start : start + length, i, 0]).sum())
            out[start : start + length, i] = np.nan
    return out
