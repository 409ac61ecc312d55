"""Files are written whole or not at all.

Everything goes to a temporary file in the same folder, which then takes the place of the target in one
step. Existing files are refused unless ``force``; after a failure neither half a file nor a temporary one
is left behind.
"""

from __future__ import annotations

import contextlib
import os
import secrets
from collections.abc import Iterable, Mapping
from pathlib import Path

from sixpoint.errors import FormatError


def check_writable(paths: Iterable[Path], force: bool) -> None:
    """Refuse targets that exist, and folders that do not, before any work is done.

    Raises:
        FormatError: Naming the file or folder and what would help.
    """
    for path in paths:
        try:
            if path.is_dir():
                raise FormatError(path, "this is a folder; give a file name")
            if not path.parent.is_dir():
                raise FormatError(path, f"the folder {path.parent} does not exist; create it first")
            if not force and (path.exists() or path.is_symlink()):
                raise FormatError(path, "exists; use --force / force=True to overwrite it")
        except (OSError, ValueError) as error:
            raise FormatError(path, f"cannot be written: {error}") from None


def write_files(contents: Mapping[Path, bytes], force: bool = False) -> None:
    """Write one or several files that belong together.

    Args:
        contents: Target -> content.
        force: Overwrite existing files.

    Raises:
        FormatError: Nothing was written; the message says why.
    """
    check_writable(contents, force)
    temporary: dict[Path, Path] = {}
    created: list[Path] = []
    try:
        for path, data in contents.items():
            target = path.resolve()
            spare = target.with_name(f".{target.name[:100]}.{secrets.token_hex(6)}.tmp")
            temporary[target] = spare
            with spare.open("xb") as stream:
                stream.write(data)
                stream.flush()
                os.fsync(stream.fileno())
        for target, spare in temporary.items():
            fresh = not target.exists()
            spare.replace(target)
            if fresh:
                created.append(target)
    except BaseException as error:
        for leftover in (*temporary.values(), *created):
            with contextlib.suppress(OSError):
                leftover.unlink()
        if isinstance(error, (OSError, ValueError)):
            path = next(iter(contents))
            reason = getattr(error, "strerror", None) or str(error)
            raise FormatError(path, f"cannot be written: {reason}") from error
        raise
