"""What a job reads: motions, targets and markers, with the options of reading that all jobs share."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from sixpoint.body.figure import Figure
from sixpoint.body.limits import Limits
from sixpoint.body.markers.recording import Markers
from sixpoint.body.motion import Motion
from sixpoint.body.targets import Targets
from sixpoint.errors import FormatError, SixpointError, listed
from sixpoint.formats import (
    GLTF_SUFFIXES,
    MARKER_SUFFIXES,
    MOTION_SUFFIXES,
    SHAPE_SUFFIXES,
    TARGET_SUFFIXES,
    find_skeleton,
    holds_markers,
    load,
    load_avatar,
    load_markers,
    load_shape,
    load_targets,
)

ALL = slice(None)


@dataclass(frozen=True)
class Reading:
    """How to read a file.

    Attributes:
        skeleton: The .asf of an .amc; by default it is looked for beside it.
        unit: Metres per file unit, or a unit's name; by default the file's, or guessed.
        up: "y" or "z"; by default the file's, or guessed.
        rate: Frames per second [Hz] in place of the file's.
        frames: Which frames to take.
    """

    skeleton: Path | None = None
    unit: str | float | None = None
    up: str | None = None
    rate: float | None = None
    frames: slice = field(default_factory=lambda: ALL)


@dataclass(frozen=True, eq=False)
class Opened:
    """A motion that was read.

    Attributes:
        motion: The frames asked for.
        whole: All frames of the file.
        skeleton: The ASF that was used, if any.
        searched: Whether that ASF was found beside the file rather than named.
        avatar: The file, where it is one that may hold an avatar.
        surface: The file, where it may hold a surface, but no avatar.
    """

    motion: Motion
    whole: Motion
    skeleton: Path | None = None
    searched: bool = False
    avatar: Path | None = None
    surface: Path | None = None

    def find_figure(self, mapping: Path | None = None, limits: Limits | None = None) -> Figure:
        """The anatomy of the motion's rig; an avatar's humanoid map and shape come along.

        Args:
            mapping: A TOML table role -> joint name for what cannot be found.
            limits: Joint limits; the shipped table by default.

        Raises:
            SixpointError: It was not found.
        """
        if self.avatar is not None:
            return load_avatar(self.avatar, mapping, limits).figure
        figure = Figure.from_motion(self.whole, mapping, limits)
        return figure if self.surface is None else figure.with_shape(load_shape(self.surface))


def parse_frames(text: str) -> slice:
    """Frames as Python writes them: ``10``, ``1:``, ``0:600``, ``::4``, ``-100:``."""
    parts = text.split(":")
    try:
        numbers = [int(part) if part.strip() else None for part in parts]
        if len(parts) > 3 or numbers == [None] or (len(parts) == 3 and numbers[2] == 0):
            raise ValueError
    except ValueError:
        raise SixpointError(
            f"frames are start:stop:step or one number, counted from 0, e.g. 1: or 0:600:2; got {text!r}"
        ) from None
    if len(parts) == 1 and numbers[0] is not None:
        return slice(numbers[0], numbers[0] + 1 or None)
    return slice(*numbers)


def is_targets(path: Path) -> bool:
    """Whether a file holds targets rather than a motion, by its suffix.

    Raises:
        FormatError, SixpointError: It is a folder, or holds neither; the message lists the formats.
    """
    if path.is_dir():
        raise FormatError(path, "this is a folder, not a file")
    suffix = path.suffix.lower()
    if suffix not in (*MOTION_SUFFIXES, *TARGET_SUFFIXES):
        try:
            load(path)
        except FormatError as error:
            formats = f"of targets: {listed(TARGET_SUFFIXES)}; of markers: {listed(MARKER_SUFFIXES)}"
            raise SixpointError(f"{error}; {formats}") from None
    return suffix in TARGET_SUFFIXES


def open_motion(path: Path, reading: Reading) -> Opened:
    """Read a motion and take the frames asked for."""
    skeleton, searched = reading.skeleton, False
    if path.suffix.lower() == ".amc" and skeleton is None and path.is_file():
        skeleton, searched = find_skeleton(path), True
    whole = load(path, skeleton=skeleton, unit=reading.unit, up=reading.up, rate=reading.rate)
    _check_frames(path, reading.frames, len(whole))
    motion = whole if reading.frames == ALL else whole.sliced(reading.frames)
    suffix = path.suffix.lower()
    avatar = path if suffix in GLTF_SUFFIXES else None
    surface = path if suffix in SHAPE_SUFFIXES and avatar is None else None
    return Opened(motion, whole, skeleton, searched, avatar, surface)


def open_targets(path: Path, reading: Reading) -> Targets:
    """Read targets and take the frames asked for; they are always in metres and Y up."""
    if reading.unit is not None or reading.up is not None:
        raise FormatError(path, "six points are always in metres and Y up: leave out --unit and --up")
    targets = load_targets(path, rate=reading.rate)
    _check_frames(path, reading.frames, len(targets))
    return targets if reading.frames == ALL else targets.sliced(reading.frames)


def open_markers(path: Path, reading: Reading) -> Markers:
    """Read markers and take the frames asked for."""
    if reading.skeleton is not None:
        raise FormatError(path, "a skeleton file belongs to an .amc, not to markers: leave it out")
    if _is_six_points(path):
        raise FormatError(path, "these are six points, not markers; pose a body with: sixpoint reconstruct")
    markers = load_markers(path, unit=reading.unit, up=reading.up, rate=reading.rate)
    _check_frames(path, reading.frames, len(markers))
    return markers if reading.frames == ALL else markers.sliced(reading.frames)


def _is_six_points(path: Path) -> bool:
    if path.suffix.lower() not in TARGET_SUFFIXES or not path.is_file() or holds_markers(path):
        return False
    try:
        load_targets(path)
    except SixpointError:
        return False
    return True


def _check_frames(path: Path, frames: slice, count: int) -> None:
    if not len(range(*frames.indices(count))):
        parts = [frames.start, frames.stop, frames.step]
        asked = ":".join("" if part is None else str(part) for part in parts[: 2 if parts[2] is None else 3])
        raise SixpointError(f"{path}: frames {asked} hold nothing: there are {count}, 0 to {count - 1}")
