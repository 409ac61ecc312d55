"""Joint limits as data: read the TOML table, hand out swing and twist limits per role.

Reference: Unzueta et al. 2008, section 7; the sources of the numbers are in ``data/joint_limits.toml``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.dofs import Ball, Hinges, SwingTwist
from sixpoint.body.tables import read_shipped, read_table, shipped_text
from sixpoint.errors import FormatError

Array = NDArray[np.float64]

X, Y, Z = np.eye(3)
SUBTALAR = np.array([0.0, np.sin(np.radians(42.0)), np.cos(np.radians(42.0))])
"""The foot rolls about an axis that rises by 42 degrees to the front: Inman 1976, "The joints of the ankle".

Its deviation inward, 23 degrees, is left out: hinges of one joint are at right angles.
"""


@dataclass(frozen=True)
class Limits:
    """Ranges of motion of the human joints, in degrees, as read from TOML.

    Attributes:
        table: The parsed file: ``shoulder``, ``hip``, ``clavicle``, ``elbow``, ``knee``, ``spine``.
        source: Where it came from, for messages.
    """

    table: Mapping[str, Any]
    source: str = "joint_limits.toml"

    @classmethod
    def default(cls) -> Limits:
        """The table that ships with sixpoint."""
        return cls(read_shipped("joint_limits.toml"))

    @staticmethod
    def text() -> str:
        """The table that ships with sixpoint as TOML, to copy and edit."""
        return shipped_text("joint_limits.toml")

    @classmethod
    def load(cls, path: str | Path) -> Limits:
        """A user's own table; every entry must be there and make sense."""
        limits = cls(read_table(path), str(path))
        try:
            limits.check()
        except KeyError as error:
            raise FormatError(
                path,
                f"the entry {error} is missing; copy the shipped joint_limits.toml and edit it",
            ) from error
        except Exception as error:
            raise FormatError(path, f"not a table of joint limits: {error}") from error
        return limits

    def check(self) -> None:
        """Build every limit once, so that a wrong number is found here."""
        for side in (1.0, -1.0):
            self.shoulder(side)
            self.hip(side)
            self.clavicle(side * X, side)
            self.forearm(side)
            self.wrist(side)
            self.ankle(side)
        for hinge in (self.elbow(), self.knee()):
            if not -np.pi <= hinge.lower[0] <= hinge.upper[0] <= np.pi:
                raise ValueError("flexion is two numbers between -180 and 180 degrees, the smaller first")
        for region in ("lumbar", "thoracic", "cervical"):
            ranges = np.asarray(self.table["spine"][region], float)
            if ranges.shape != (4,) or not np.all((ranges >= 0) & (ranges <= 180)):
                raise ValueError(f"[spine] {region} is four numbers between 0 and 180 degrees")
        self.spine([0.0, 1.0])

    def shoulder(self, side: float) -> Ball:
        """Shoulder of the left (+1) or right (-1) side."""
        return self._limb("shoulder", side)

    def hip(self, side: float) -> Ball:
        """Hip of the left (+1) or right (-1) side."""
        return self._limb("hip", side)

    def _limb(self, role: str, side: float) -> Ball:
        entry = self.table[role]
        # A twist of -Y turns the left limb's front towards the body's midline: internal rotation.
        # About the axis -Y internal rotation is positive on the left, negative on the right.
        internal, external = np.radians([entry["internal_rotation"], entry["external_rotation"]])
        twist = (-external, internal) if side > 0 else (-internal, external)
        return self._ball(entry["swing"], -Y, Z, side * X, twist)

    def clavicle(self, axis: Array, side: float) -> Ball:
        """Sternoclavicular joint whose neutral segment points along ``axis`` (3,), a unit vector."""
        entry = self.table["clavicle"]
        forward = Z - (Z @ axis) * axis
        forward /= np.linalg.norm(forward)
        up = np.cross(axis, forward) * -side
        twist = np.radians(entry["twist"])
        return self._ball(entry["swing"], axis, forward, up, (-twist, twist))

    def elbow(self) -> Hinges:
        """Flexion is negative about +X (the forearm swings to +Z)."""
        least, most = np.radians(self.table["elbow"]["flexion"])
        return Hinges(X, -most, -least)

    def knee(self) -> Hinges:
        """Flexion is positive about +X (the shank swings to -Z)."""
        least, most = np.radians(self.table["knee"]["flexion"])
        return Hinges(X, least, most)

    def forearm(self, side: float) -> Hinges:
        """Elbow with the twist of the forearm: flexion about +X, then pronation about the bone."""
        flexion, entry = self.elbow(), self._extremity("forearm")
        # The palm turns backward in pronation: about +Y that is negative on the left, positive on the right.
        inward, outward = np.radians([entry["pronation"], entry["supination"]])
        low, high = (-inward, outward) if side > 0 else (-outward, inward)
        return _two_hinges(X, Y, (flexion.lower[0], flexion.upper[0]), (low, high))

    def wrist(self, side: float) -> Hinges:
        """Flexion towards the palm (about Z), then deviation towards the thumb (negative about +X)."""
        entry = self._extremity("wrist")
        flexion, extension, radial, ulnar = np.radians(
            [entry[name] for name in ("flexion", "extension", "radial", "ulnar")]
        )
        low, high = (-flexion, extension) if side > 0 else (-extension, flexion)
        return _two_hinges(Z, X, (low, high), (-radial, ulnar))

    def ankle(self, side: float) -> Hinges:
        """Dorsiflexion (negative about +X), then inversion about the subtalar axis: the sole turns inward."""
        entry = self._extremity("ankle")
        dorsal, plantar, inner, outer = np.radians(
            [entry[name] for name in ("dorsiflexion", "plantarflexion", "inversion", "eversion")]
        )
        low, high = (-inner, outer) if side > 0 else (-outer, inner)
        return _two_hinges(X, SUBTALAR, (-dorsal, plantar), (low, high))

    def _extremity(self, role: str) -> Mapping[str, float]:
        """Ranges that a user's table may leave to the shipped one."""
        entry: Mapping[str, float] = self.table.get(role) or read_shipped("joint_limits.toml")[role]
        return entry

    def spine(self, heights: list[float] | Array) -> list[Ball]:
        """Limits of a spine of any number of joints.

        Each of the 25 vertebral levels is absorbed by the nearest joint, so the ranges of all joints
        always add up to those of the whole spine.

        Args:
            heights: Place of each joint along the spine, 0 (pelvis) to 1 (head), not decreasing.
        """
        levels = self._levels()
        names = [row[0] for row in self.table["spine"]["levels"]]
        known = [(height, names.index(name)) for name, height in self.table["spine"]["places"]]
        place = np.interp(heights, *np.transpose(known))
        tie = 1e-9 * np.arange(len(place))
        nearest = [int(np.argmin(np.abs(place - level) + tie)) for level in range(len(levels))]
        balls = []
        for joint in range(len(place)):
            flexion, extension, lateral, axial = np.minimum(
                levels[[n == joint for n in nearest]].sum(axis=0), 180.0
            )
            knots = [[-180, extension], [-90, lateral], [0, flexion], [90, lateral], [180, extension]]
            twist = np.radians(axial)
            balls.append(self._ball(knots, Y, Z, X, (-twist, twist)))
        return balls

    def _levels(self) -> Array:
        """(25, 4) flexion, extension, lateral, axial [deg] of each level, scaled to the regions' ranges."""
        entry = self.table["spine"]
        names = [row[1] for row in entry["levels"]]
        shape = np.array([row[2:] for row in entry["levels"]], float)[:, [0, 0, 1, 2]]
        out = np.zeros_like(shape)
        for region in ("lumbar", "thoracic", "cervical"):
            rows = np.array([n == region for n in names])
            out[rows] = shape[rows] / shape[rows].sum(axis=0) * np.asarray(entry[region], float)
        return out

    def _ball(self, knots: Any, axis: Array, forward: Array, side: Array, twist: tuple[float, float]) -> Ball:
        theta, psi = np.radians(np.asarray(knots, float)).T
        return Ball(SwingTwist(axis, forward, side, theta, psi, np.array(twist)))


def _two_hinges(
    first: Array, second: Array, first_range: tuple[float, float], second_range: tuple[float, float]
) -> Hinges:
    ranges = np.array([first_range, second_range])
    return Hinges(np.array([first, second]), ranges[:, 0], ranges[:, 1])
