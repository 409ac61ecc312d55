"""What a job writes: places are checked before the work, so that no work is lost to a bad place."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.body.surface.appearance import Appearance
from sixpoint.body.surface.flesh import build_shape
from sixpoint.errors import FormatError, listed
from sixpoint.formats import SHAPE_OUTPUTS, save
from sixpoint.formats.atomic import check_writable
from sixpoint.render.colours import paint


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


def save_dressed(figure: Figure, motion: Motion, out: Path, force: bool) -> None:
    """Write a motion; where the file can hold a surface, with the figure's, or the built-in one.

    Raises:
        FormatError: Nothing was written; the message says why.
    """
    suffix = out.suffix.lower()
    if suffix not in SHAPE_OUTPUTS:
        save(motion, out, force=force)
        return
    shape = figure.shape or build_shape(figure)
    colours = Appearance(paint(figure, shape)) if suffix == ".glb" else None
    save(motion, out, force=force, shape=shape, appearance=colours)


def prepare_folder(out: Path, force: bool, *, ours: bool = False) -> None:
    """Make a folder to write several files into.

    Args:
        out: The folder.
        force: It may hold other files.
        ours: It is known to hold an earlier result, which may be gone on with.

    Raises:
        FormatError: It is a file, is not empty, or cannot be made.
    """
    if out.exists() and not out.is_dir():
        raise FormatError(out, "this is a file; give a folder")
    try:
        if not force and not ours and out.exists() and any(out.iterdir()):
            raise FormatError(
                out, "exists and is not empty; choose another folder, or use --force to write into it"
            )
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FormatError(out, f"the folder cannot be made: {error.strerror}") from error


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
