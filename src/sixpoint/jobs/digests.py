"""Short names of what a result was made of: bytes, files, a user's module, our own code.

Equal names mean that a result need not be made again.
"""

from __future__ import annotations

import hashlib
import importlib
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path

import sixpoint
from sixpoint.errors import FormatError
from sixpoint.formats import find_skeleton

CODE_SUFFIXES = (".py", ".toml", ".npz")
"""Files of the package that decide results: code, tables and fitted numbers."""


def digest(data: bytes) -> str:
    """A short name of some bytes."""
    return hashlib.sha256(data).hexdigest()[:16]


def digest_file(path: Path | None) -> str:
    """Of a file's content; of none, and of what cannot be read, a word that is no digest."""
    try:
        return "" if path is None else digest(path.read_bytes())
    except (OSError, ValueError):
        return "unreadable"


def digest_module(solver: str) -> str:
    """Of the source of a user's own method ``module:Class``; of ours, nothing."""
    module = solver.partition(":")[0]
    if ":" not in solver:
        return ""
    source = getattr(importlib.import_module(module), "__file__", None)
    return digest_file(Path(source)) if source else ""


@lru_cache(maxsize=8)
def digest_code(places: tuple[str, ...]) -> str:
    """Of parts of the package.

    Args:
        places: Folders and files relative to it; ``""`` is all of it.
    """
    package = Path(sixpoint.__file__).parent
    found = hashlib.sha256()
    for name in places:
        for path in _sources(package / name):
            found.update(path.read_bytes())
    return found.hexdigest()[:16]


def _sources(place: Path) -> Iterable[Path]:
    if not place.is_dir():
        return [place]
    return sorted(path for path in place.rglob("*") if path.suffix in CODE_SUFFIXES)


def find_beside(file: Path) -> Path | None:
    """The .asf that an .amc will be read with, if there is one."""
    if file.suffix.lower() != ".amc":
        return None
    try:
        return find_skeleton(file)
    except FormatError:
        return None
