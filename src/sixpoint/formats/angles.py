"""Joint angles as OpenSim's .mot and as CSV: a column per angle in degrees, the pelvis' place in metres."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from sixpoint.body.joint_angles import JointAngles
from sixpoint.errors import FormatError, listed
from sixpoint.formats.atomic import check_writable, write_files

ANGLE_SUFFIXES = (".mot", ".csv")

_HEADER = """{name}
version=1
nRows={rows}
nColumns={columns}
inDegrees=yes

Units are S.I. units (second, meters, Newtons, ...)
If the header above contains a line with 'inDegrees', this indicates whether rotational values are in \
degrees (yes) or radians (no).

endheader
"""


def save_angles(angles: JointAngles, path: str | Path, force: bool = False) -> None:
    """Write joint angles as .mot or .csv.

    Args:
        angles: What ``compute_joint_angles`` found.
        path: The file.
        force: Overwrite an existing file.

    Raises:
        FormatError: Nothing was written; the message says why.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in ANGLE_SUFFIXES:
        raise FormatError(path, f"joint angles are written as {listed(ANGLE_SUFFIXES)}")
    check_writable([path], force)
    text = format_mot(angles) if suffix == ".mot" else format_table(angles, ",")
    write_files({path: text.encode("utf-8", "replace")}, force)


def format_mot(angles: JointAngles) -> str:
    """The text of a motion file of OpenSim."""
    name = re.sub(r"\s+", " ", angles.name).strip() or "motion"
    header = _HEADER.format(name=name, rows=len(angles), columns=len(angles.names) + 1)
    return header + format_table(angles, "\t")


def format_table(angles: JointAngles, separator: str) -> str:
    """A row of names and a row per frame, the time [s] first."""
    times = np.arange(len(angles)) / angles.rate
    row = separator.join(["%.8f"] * (len(angles.names) + 1))
    rows = [row % tuple(values) for values in np.column_stack([times, angles.values]).tolist()]
    return "\n".join([separator.join(("time", *angles.names)), *rows]) + "\n"
