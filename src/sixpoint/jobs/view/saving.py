"""Saving from the page: into one folder named at the start, under a plain name, never over anything."""

from __future__ import annotations

import re
from pathlib import Path

from sixpoint.body.motion import Motion
from sixpoint.errors import SixpointError
from sixpoint.formats import save

PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _-]{0,59}")
MOST = 999
"""Files of one name; a page must not fill a disk."""


def save_numbered(motion: Motion, folder: Path, name: str) -> Path:
    """Write a BVH under a plain name; where that is taken, with the next number.

    Args:
        motion: What to write.
        folder: Where to.
        name: What somebody typed into the page: no path, no suffix but .bvh.

    Raises:
        SixpointError: The name is not plain, or nothing could be written.
    """
    stem = name.strip().removesuffix(".bvh")
    if not PLAIN.fullmatch(stem):
        raise SixpointError(
            "a name is letters, digits, spaces, - and _, at most 60; it goes into the folder of --out"
        )
    for number in range(1, MOST + 1):
        path = folder / (f"{stem}.bvh" if number == 1 else f"{stem}_{number}.bvh")
        if not (path.exists() or path.is_symlink()):
            save(motion, path)
            return path
    raise SixpointError(f"there are {MOST} files named {stem}; choose another name")
