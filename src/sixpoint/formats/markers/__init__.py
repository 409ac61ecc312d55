"""Marker files to ``Markers`` and back: C3D, TRC, CSV, NPZ, and landmarks of pose estimators as JSON.

Readers return what the file says (``raw.py``); ``space.py`` brings it to metres and Y up. Whatever was
assumed, renamed or left out is said as a warning; nothing is filled or filtered here.
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import numpy as np

from sixpoint.body.markers.recording import Markers
from sixpoint.body.targets import EFFECTORS
from sixpoint.errors import FormatError, Remark, SixpointError, listed
from sixpoint.formats.atomic import check_writable, write_files
from sixpoint.formats.markers.archive import format_marker_npz, read_marker_npz
from sixpoint.formats.markers.c3d import read_c3d
from sixpoint.formats.markers.c3d_write import format_c3d
from sixpoint.formats.markers.landmarks import read_landmarks
from sixpoint.formats.markers.raw import mend_names, open_gaps
from sixpoint.formats.markers.space import AXES, enter_world, turn_from
from sixpoint.formats.markers.tables import find_marker_columns, format_marker_csv, read_marker_csv
from sixpoint.formats.markers.trc import format_trc, read_trc
from sixpoint.formats.space import UNITS, parse_unit

_READERS = {
    ".c3d": read_c3d,
    ".trc": read_trc,
    ".csv": read_marker_csv,
    ".npz": read_marker_npz,
    ".json": read_landmarks,
    ".jsonl": read_landmarks,
}

MARKER_SUFFIXES = tuple(_READERS)
"""Files that may hold markers; .csv and .npz may also hold six points."""

MARKER_OUTPUTS = (".c3d", ".trc", ".csv", ".npz")


def load_markers(
    path: str | Path, *, unit: str | float | None = None, up: str | None = None, rate: float | None = None
) -> Markers:
    """Read markers from a .c3d, .trc, .csv, .npz or .json file.

    Args:
        path: The file.
        unit: Metres per file unit, or one of m, cm, mm, inch, cmu. By default the file's, unless the body
            would be three times too large or small with it; guessed from the body where it states none.
        up: Up axis of the file: x, y, z, or one of them with a minus. By default guessed from the body,
            else the file's, else the convention of the format.
        rate: Frames per second [Hz] in place of the file's.

    Returns:
        The markers in metres and Y up, gaps as NaN; ``markers.space`` says what the file had.

    Raises:
        FormatError: The file cannot be read; the message says where and what was expected there.

    Warns:
        Remark: What was assumed, renamed or left out.
    """
    path = Path(path)
    reader = _READERS.get(path.suffix.lower())
    if path.is_dir():
        raise FormatError(path, "this is a folder; for all files in it: sixpoint batch FOLDER --job track")
    if reader is None:
        kind = f"a {path.suffix} file holds no markers" if path.suffix else "a file of markers has a suffix"
        raise FormatError(path, f"{kind}; formats: {listed(MARKER_SUFFIXES)}")
    if rate is not None and not 1e-3 <= rate <= 1e6:
        raise FormatError(path, f"the rate is frames per second, 0.001 to 1000000, got {rate}")
    raw = reader(path)
    try:
        mend_names(raw)
        open_gaps(path, raw)
        markers = enter_world(path, raw, unit, up, rate)
    except SixpointError as error:
        raise error if isinstance(error, FormatError) else FormatError(path, str(error)) from error
    for note in raw.notes:
        warnings.warn(f"{path}: {note}", Remark, stacklevel=2)
    return markers


def save_markers(
    markers: Markers,
    path: str | Path,
    *,
    force: bool = False,
    unit: str | float | None = None,
    up: str | None = None,
) -> None:
    """Write markers as .c3d, .trc, .csv or .npz.

    Args:
        markers: In metres, Y up.
        path: The file.
        force: Overwrite an existing file.
        unit: Unit of the file; by default that of the source. NPZ is always in metres.
        up: Up axis of the file; by default that of the source, but Y for TRC, which cannot say it.

    Raises:
        FormatError: Nothing was written; the message says why.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in MARKER_OUTPUTS:
        raise FormatError(path, f"markers are written as {listed(MARKER_OUTPUTS)}")
    check_writable([path], force)
    metres = markers.space.unit if unit is None else parse_unit(path, unit)
    axis = up or ("y" if suffix == ".trc" else markers.space.up)
    if axis not in AXES:
        raise FormatError(path, f"unknown up axis {axis!r}; axes: {listed(AXES)}")
    name = next(
        (name for name, size in UNITS.items() if math.isclose(size, metres, rel_tol=1e-6)), f"{metres:.9g}"
    )
    positions = np.asarray(markers.positions @ turn_from(axis) / metres)
    if suffix == ".npz":
        data = format_marker_npz(markers)
    elif suffix == ".c3d":
        data = format_c3d(markers, positions, name, metres, axis)
    elif suffix == ".trc":
        data = format_trc(markers, positions, name).encode()
    else:
        data = format_marker_csv(markers, positions, name, axis).encode()
    write_files({path: data}, force)


def holds_markers(path: Path) -> bool:
    """Whether a file holds markers, not six points or a motion: by its suffix, or by the names in it."""
    suffix = path.suffix.lower()
    if suffix not in (".csv", ".npz"):
        return suffix in MARKER_SUFFIXES
    try:
        if suffix == ".npz":
            return bool(read_marker_npz(path).names)
        return not find_marker_columns(path) <= set(EFFECTORS)
    except FormatError:
        return False
