"""Files are written whole or not at all.

Everything goes to a temporary file in the same folder, which then takes the place of the target in one
step. Existing files are refused unless ``force``; after a failure neither half a file nor a temporary one
is left behind.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from sixpoint.errors import FormatError

SPARE = re.compile(r"\..+\.[0-9a-f]{12}\.tmp", re.DOTALL)
"""Names of temporary files."""
_DURABLE = ContextVar("durable", default=True)


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
            if not os.access(path.parent, os.W_OK):
                raise FormatError(path, f"the folder {path.parent} may not be written to")
            if not force and (path.exists() or path.is_symlink()):
                raise FormatError(
                    path, "exists; choose another name, or use --force / force=True to overwrite it"
                )
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
            spare = target.with_name(f"{_spare_prefix(target)}{secrets.token_hex(6)}.tmp")
            temporary[target] = spare
            with spare.open("xb") as stream:
                stream.write(data)
                if _DURABLE.get():
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


@contextmanager
def without_waiting() -> Iterator[None]:
    """Within, writing does not wait until the disk has a file: for what is checked when it is read again."""
    token = _DURABLE.set(False)
    try:
        yield
    finally:
        _DURABLE.reset(token)


def remove_leftovers(place: Path, age: float = 0.0) -> None:
    """Delete temporary files whose writer was killed.

    Args:
        place: A target; or a folder, for all targets below it.
        age: How old they must be [s]: younger ones may be of another process that is writing.
    """
    folder = place.is_dir()
    prefix, oldest = "" if folder else _spare_prefix(place), time.time() - age
    for spare in place.rglob(".*.tmp") if folder else place.parent.glob(".*.tmp"):
        if SPARE.fullmatch(spare.name) and spare.name.startswith(prefix):
            with contextlib.suppress(OSError):
                if spare.stat().st_mtime <= oldest:
                    spare.unlink()


def _spare_prefix(target: Path) -> str:
    return f".{target.name[:100]}."
