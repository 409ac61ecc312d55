"""CMU's 41 markers on people of known lengths, placed as a careful laboratory does: not exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixpoint.body import rotations as rot
from sixpoint.body.anthropometry import segments_of_stature
from sixpoint.body.figure import Figure
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.markers.recording import Markers
from sixpoint.body.markers.roles import find_marker_roles
from sixpoint.body.motion import Motion
from sixpoint.calibration.markers.kinematics import SEGMENTS, Kinematics
from sixpoint.calibration.markers.places import place_markers

SIDED = (
    "FHD", "BHD", "SHO", "UPA", "ELB", "FRM", "WRA", "WRB", "FIN",
    "FWT", "BWT", "THI", "KNE", "SHN", "ANK", "HEE", "TOE", "MT5",
)  # fmt: skip
CMU = (*(side + label for label in SIDED for side in "LR"), "C7", "T10", "CLAV", "STRN", "RBAC")


@dataclass(frozen=True, eq=False)
class Worn:
    """A recording and its truth."""

    markers: Markers
    model: MarkerModel
    motion: Motion


def wear(labels=CMU, *, stature=1.8, seed=0, misplaced=0.5, motion=None, noise=0.0) -> Worn:
    """Markers on a moving person, misplaced by this share of what anatomy leaves open; noise in metres."""
    rng = np.random.default_rng(seed)
    segments = {
        name: length * float(np.exp(0.05 * rng.normal()))
        for name, length in segments_of_stature(stature).items()
    }
    kinematics, figure = Kinematics(), Figure.from_segments(**segments)
    places = place_markers(find_marker_roles(labels), stature, kinematics)
    lengths = np.array([segments[name] for name in SEGMENTS])
    off = places.offsets + misplaced * rng.normal(size=places.std.shape) * np.minimum(places.std, 0.03)
    model = MarkerModel(
        figure, places.names, places.carriers, off + places.reach @ lengths, np.zeros(len(off))
    )
    movement = (motion or every_joint)(figure)
    points = model.place(*movement.transforms)
    points = points + noise * rng.normal(size=points.shape)
    return Worn(Markers(places.names, points, movement.rate, name="worn"), model, movement)


def every_joint(figure: Figure, seconds: float = 6.0, rate: float = 10.0, seed: int = 0) -> Motion:
    """Every joint sweeps a good part of its range, each at its own pace."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate)) / rate
    roles = figure.roles
    turned = np.tile(rot.IDENTITY, (len(t), len(figure.skeleton), 1))

    def sweep(degrees: float) -> np.ndarray:
        wave = np.sin(2 * np.pi * rng.uniform(0.2, 0.6) * t + rng.uniform(0, 2 * np.pi))
        return np.radians(degrees) * wave

    def turn(joint: int, order: str, *angles: np.ndarray) -> None:
        turned[:, joint] = rot.from_euler(order, np.stack(angles, axis=1))

    rest = np.zeros_like(t)
    turn(roles.pelvis, "YXZ", sweep(60), sweep(20), sweep(15))
    for joint in roles.spine[:4]:
        turn(joint, "XYZ", sweep(8) + 0.05, sweep(6), sweep(5))
    for joint in roles.spine[4:]:
        turn(joint, "XYZ", sweep(15), sweep(25), sweep(10))
    for k, sign in enumerate((1.0, -1.0)):
        turn(roles.hip[k], "XZY", sweep(35) - 0.6, sweep(15) + 0.2 * sign, sweep(15))
        turn(roles.knee[k], "XZY", sweep(45) + 0.9, rest, rest)
        turn(roles.ankle[k], "XZY", sweep(20), sweep(8), rest)
        turn(roles.clavicle[k], "ZYX", sweep(6), sweep(6), rest)
        turn(roles.shoulder[k], "XZY", sweep(50) - 0.5, sweep(25) + 0.6 * sign, sweep(30))
        turn(roles.elbow[k], "XYZ", -sweep(50) - 0.95, sweep(40), rest)
        turn(roles.wrist[k], "ZXY", sweep(25), sweep(12), rest)
    pelvis = np.stack([sweep(50), 1.0 + sweep(5), sweep(50)], axis=1)
    return figure.compute_motion(turned, pelvis, rate)
