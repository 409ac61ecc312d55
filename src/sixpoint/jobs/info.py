"""What does a file hold? Reads it and looks for a human in it, or for the roles and gaps of its markers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sixpoint.body.figure import Figure
from sixpoint.body.markers.recording import Markers
from sixpoint.body.markers.roles import MarkerRoles, find_marker_roles
from sixpoint.body.targets import Targets
from sixpoint.errors import FigureError, FormatError
from sixpoint.formats import Avatar, holds_markers, load_avatar
from sixpoint.jobs.reading import Opened, Reading, is_targets, open_markers, open_motion, open_targets
from sixpoint.signals.gaps import Gaps, Ghost, find_gaps, find_ghosts


@dataclass(frozen=True, eq=False)
class MotionInfo:
    """A motion file.

    Attributes:
        path: The file.
        opened: What was read.
        figure: The anatomy of its rig; None where the rig is not a human's.
        problem: Why there is no figure.
        avatar: What the file is as an avatar, if it may be one.
    """

    path: Path
    opened: Opened
    figure: Figure | None
    problem: str = ""
    avatar: Avatar | None = None


@dataclass(frozen=True, eq=False)
class TargetsInfo:
    """A targets file."""

    path: Path
    targets: Targets


@dataclass(frozen=True, eq=False)
class MarkersInfo:
    """A file of markers.

    Attributes:
        path: The file.
        markers: What was read.
        roles: Which marker is where on the body.
        gaps: How well each marker was seen, in their order.
        ghosts: Short stretches that a marker jumps to, faster than people move.
    """

    path: Path
    markers: Markers
    roles: MarkerRoles
    gaps: list[Gaps]
    ghosts: list[Ghost]


def inspect(
    path: Path,
    *,
    reading: Reading | None = None,
    mapping: Path | None = None,
    layout: Path | str | None = None,
) -> MotionInfo | TargetsInfo | MarkersInfo:
    """Read a file and find out what it holds.

    Args:
        path: A motion, targets or markers.
        reading: How to read it.
        mapping: A TOML table role -> joint name for what cannot be found.
        layout: A layout of markers: a TOML file, or the name of one that ships.

    Raises:
        FormatError: It cannot be read, or the mapping cannot. A rig that is not a human's is no error.
    """
    reading = reading or Reading()
    if not path.is_dir() and holds_markers(path):
        markers = open_markers(path, reading)
        roles = find_marker_roles(markers.names, layout)
        positions = markers.positions
        return MarkersInfo(path, markers, roles, find_gaps(positions), find_ghosts(positions, markers.rate))
    if is_targets(path):
        return TargetsInfo(path, open_targets(path, reading))
    opened = open_motion(path, reading)
    if opened.avatar is not None:
        try:
            avatar = load_avatar(path, mapping)
        except FormatError as error:  # the motion was read: no human, or a mesh that is not supported
            return MotionInfo(path, opened, None, str(error).removeprefix(f"{path}: "))
        return MotionInfo(path, opened, avatar.figure, avatar=avatar)
    try:
        return MotionInfo(path, opened, Figure.from_motion(opened.whole, mapping))
    except FigureError as error:
        return MotionInfo(path, opened, None, str(error))
