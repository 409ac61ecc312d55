"""What a job writes: places are checked before the work, so that no work is lost to a bad place."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sixpoint.errors import FormatError, listed
from sixpoint.formats.atomic import check_writable


def check_output(path: Path, suffixes: Sequence[str], force: bool, hint: str = "") -> list[Path]:
    """Check that a file can be written.

    Args:
        path: The file.
        suffixes: What it may end with.
        force: It may exist.
        hint: Said after an unknown suffix.

    Returns:
        All files that will be written: an .amc has its .asf beside it.

    Raises:
        FormatError: It exists, its folder does not, or its suffix is unknown.
    """
    suffix = path.suffix.lower()
    if suffix not in suffixes:
        got = f"cannot write {suffix!r} here" if suffix else "the output needs a suffix"
        raise FormatError(path, f"{got}; formats: {listed(suffixes)}" + (f"; {hint}" if hint else ""))
    files = [path, path.with_suffix(".asf")] if suffix == ".amc" else [path]
    check_writable(files, force)
    return files


def keep_sources(files: Sequence[Path], sources: Sequence[Path | None]) -> None:
    """Refuse to write over what is read, even when overwriting is allowed: it could not be read again.

    Args:
        files: What will be written.
        sources: What is read; None for nothing.

    Raises:
        FormatError: A file is also a source.
    """
    read = {path.resolve() for path in sources if path is not None}
    for path in files:
        if path.resolve() in read:
            raise FormatError(path, "this file is being read; write to another name")
