"""Six points to and from files."""

from __future__ import annotations

from pathlib import Path

from sixpoint.body.targets import Targets
from sixpoint.formats.atomic import check_writable, write_files
from sixpoint.formats.npz import format_npz, read_npz
from sixpoint.formats.suffixes import TARGET_SUFFIXES, check_rate, check_suffix
from sixpoint.formats.tables import format_csv, read_csv


def load_targets(path: str | Path, *, rate: float | None = None) -> Targets:
    """Read six-point targets from a .csv or .npz file.

    Args:
        path: The file; metres, Y up.
        rate: Frames per second [Hz] in place of the file's.

    Raises:
        FormatError: The file cannot be read; the message has the line and what was expected there.
    """
    path = Path(path)
    suffix = check_suffix(path, TARGET_SUFFIXES, "targets")
    check_rate(path, rate)
    return read_csv(path, rate) if suffix == ".csv" else read_npz(path, rate)


def save_targets(targets: Targets, path: str | Path, force: bool = False) -> None:
    """Write six-point targets as .csv or .npz.

    Args:
        targets: In metres, Y up.
        path: The file.
        force: Overwrite an existing file.

    Raises:
        FormatError: Nothing was written; the message says why.
    """
    path = Path(path)
    suffix = check_suffix(path, TARGET_SUFFIXES, "targets")
    check_writable([path], force)
    data = format_csv(targets).encode() if suffix == ".csv" else format_npz(targets)
    write_files({path: data}, force)
