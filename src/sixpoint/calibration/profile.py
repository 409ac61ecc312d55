"""A person's profile: lengths, and which tracker sits where, as a small TOML text.

Trackers are known by their serials. Text goes in and out here; files belong to who has them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.anthropometry import segments_of_stature
from sixpoint.body.figure import Figure
from sixpoint.body.targets import POINTS
from sixpoint.calibration.mounts import Calibration, Mount
from sixpoint.calibration.toml import TableReader, toml_key, toml_number, toml_numbers, toml_text
from sixpoint.errors import FormatError, TargetError, listed

Array = NDArray[np.float64]

VERSION = 1
ROTATION_STD = float(np.radians(5.0))  # where the file does not say
UNIT = 1e-3  # how far from 1 the length of a rotation may be


@dataclass(frozen=True, eq=False)
class Worn:
    """One tracker.

    Attributes:
        point: What it is on, one of ``POINTS`` of ``body.targets``.
        mount: How it sits there.
    """

    point: str
    mount: Mount


@dataclass(frozen=True, eq=False)
class Profile:
    """What is kept of a person.

    Attributes:
        stature: [m].
        segments: Segment lengths by name [m]; empty for those of the stature.
        sources: Where each comes from.
        trackers: Serial -> what it is on, and how.
    """

    stature: float
    segments: dict[str, float] = field(default_factory=dict)
    sources: dict[str, str] = field(default_factory=dict)
    trackers: dict[str, Worn] = field(default_factory=dict)

    @classmethod
    def from_calibration(
        cls, found: Calibration, serials: Mapping[str, str], extra: Mapping[str, Mount] | None = None
    ) -> Profile:
        """Keep a calibration.

        Args:
            found: What ``calibrate`` found.
            serials: Point -> serial of its tracker.
            extra: Mounts of chest, elbows and knees; without offset where none is given.

        Raises:
            TargetError: A point is unknown, or a serial is given twice.
        """
        unknown = [point for point in serials if point not in POINTS]
        if unknown:
            raise TargetError(f"no points named {listed(unknown)}; there are: {listed(POINTS)}")
        if len(set(serials.values())) != len(serials):
            raise TargetError(f"each tracker is on one point; serials: {listed(serials.values())}")
        plain = Mount(np.zeros(3), rot.IDENTITY)
        mounts = {**found.mounts, **(extra or {})}
        worn = {serial: Worn(point, mounts.get(point, plain)) for point, serial in serials.items()}
        return cls(found.stature, dict(found.segments), dict(found.sources), worn)

    def figure(self) -> Figure:
        """The built-in figure with these lengths."""
        return Figure.from_segments(limits=None, **(self.segments or segments_of_stature(self.stature)))

    def serial(self, point: str) -> str | None:
        """Which tracker is on a point; None without one."""
        return next((s for s, worn in self.trackers.items() if worn.point == point), None)

    def apply(self, serial: str, position: ArrayLike, rotation: ArrayLike) -> tuple[Array, Array]:
        """A tracker's reading -> joint position (3,) [m] and segment rotation (4,).

        A part of the mount that is not known is taken as none; without a rotation the tracker is the joint.
        """
        row = POINTS.index(self.trackers[serial].point)
        points, turns = np.full((len(POINTS), 3), np.nan), np.full((len(POINTS), 4), np.nan)
        points[row], turns[row] = position, rotation
        points, turns = self.apply_all(points, turns)
        return points[row], turns[row]

    def apply_all(self, positions: Array, rotations: Array) -> tuple[Array, Array]:
        """All readings of a frame at once, as ``apply``.

        Args:
            positions: (11, 3) in the order of ``POINTS`` [m]; NaN where there is none.
            rotations: (11, 4) likewise, NaN where a tracker has none.
        """
        offsets, back = self._mounts
        known = np.isfinite(rotations).all(axis=1, keepdims=True)
        q = rot.normalised(np.where(known, rotations, rot.IDENTITY))
        joints = positions - np.where(known, rot.mul_vec(q, offsets), 0.0)
        return joints, np.where(known, rot.mul(q, back), np.nan)

    @cached_property
    def _mounts(self) -> tuple[Array, Array]:
        """Offsets (11, 3) and inverse rotations (11, 4) of the mounts; none where they are not known."""
        offsets, back = np.zeros((len(POINTS), 3)), np.tile(rot.IDENTITY, (len(POINTS), 1))
        for worn in self.trackers.values():
            row = POINTS.index(worn.point)
            if np.isfinite(worn.mount.offset).all():
                offsets[row] = worn.mount.offset
            if np.isfinite(worn.mount.rotation).all():
                back[row] = rot.inv(worn.mount.rotation)
        return offsets, back


def format_profile(profile: Profile) -> str:
    """A profile as TOML text; ``parse_profile`` gives it back to the last bit."""
    lines = [f"version = {VERSION}", f"stature = {toml_number(profile.stature)}  # [m]"]
    if profile.segments:
        lines += ["", "[segments]  # [m]"]
        lines += [f"{name} = {toml_number(length)}" for name, length in profile.segments.items()]
    if profile.sources:
        lines += ["", "[sources]"]
        lines += [f"{toml_key(name)} = {toml_text(source)}" for name, source in profile.sources.items()]
    for serial, worn in profile.trackers.items():
        mount = worn.mount
        lines += ["", f"[trackers.{toml_text(serial)}]", f"effector = {toml_text(worn.point)}"]
        if np.isfinite(mount.offset).all():
            lines.append(
                f"offset = {toml_numbers(mount.offset)}  # from the joint, in the tracker's frame [m]"
            )
        if np.isfinite(mount.rotation).all():
            lines.append(f"rotation = {toml_numbers(mount.rotation)}  # segment<-tracker, xyzw")
        if np.isfinite(mount.std):
            lines.append(f"std = {toml_number(mount.std)}  # of the offset [m]")
        if np.isfinite(mount.rotation_std):
            lines.append(f"rotation_std = {toml_number(mount.rotation_std)}  # [rad]")
    return "\n".join(lines) + "\n"


def parse_profile(text: str, path: str | Path = "profile") -> Profile:
    """Read a profile.

    Args:
        text: TOML.
        path: Its file, for messages.

    Raises:
        FormatError: It is not a profile; the message says at which key, what is expected and what is there.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FormatError(path, f"not a TOML file: {error}") from error
    read = TableReader(path)
    read.only(table, "", ("version", "stature", "segments", "sources", "trackers"))
    version = table.get("version")
    if version != VERSION or isinstance(version, bool):
        raise FormatError(path, "version", expected=f"{VERSION}", got=repr(version))
    stature = read.number(table, "stature", 0.4, 2.8, "a stature in metres, 0.4 to 2.8")
    lengths = read.table(table, "segments")
    known = segments_of_stature(1.75)
    read.only(lengths, "segments.", known)
    segments = {n: read.number(lengths, n, 0.005, 2.0, "a length in metres", "segments.") for n in lengths}
    sources = read.table(table, "sources")
    for name, source in sources.items():
        if not isinstance(source, str):
            raise FormatError(path, f"sources.{name}", expected="a text", got=repr(source))
    trackers = {serial: _worn(read, serial, entry) for serial, entry in read.table(table, "trackers").items()}
    points = [worn.point for worn in trackers.values()]
    twice = [serial for serial, worn in trackers.items() if points.count(worn.point) > 1]
    if twice:
        raise FormatError(path, f"trackers {listed(twice)}", expected="one tracker per effector")
    return Profile(stature, segments, sources, trackers)


# --- details -----------------------------------------------------------------------------------------


def _worn(read: TableReader, serial: str, entry: Any) -> Worn:
    where = f"trackers.{serial}."
    if not isinstance(entry, dict):
        raise FormatError(read.path, where[:-1], expected="a table", got=repr(entry))
    read.only(entry, where, ("effector", "offset", "rotation", "std", "rotation_std"))
    point = entry.get("effector")
    if point not in POINTS:
        raise FormatError(read.path, f"{where}effector", expected=f"one of {listed(POINTS)}", got=repr(point))
    offset, turn = np.full(3, np.nan), np.full(4, np.nan)
    std = rotation_std = float("inf")
    if "offset" in entry:
        offset = read.numbers(entry, "offset", 3, 1.0, where)
    if "rotation" in entry:
        turn = read.numbers(entry, "rotation", 4, 1.0 + UNIT, where)
        if abs(np.linalg.norm(turn) - 1.0) > UNIT:
            raise FormatError(
                read.path, f"{where}rotation", expected="a unit quaternion xyzw", got=f"{turn.tolist()}"
            )
        rotation_std = ROTATION_STD
    if "std" in entry:
        std = read.number(entry, "std", 0.0, 10.0, "a standard deviation in metres", where)
    if "rotation_std" in entry:
        rotation_std = read.number(entry, "rotation_std", 0.0, 10.0, "a standard deviation in radians", where)
    return Worn(str(point), Mount(offset, turn, std, rotation_std))
