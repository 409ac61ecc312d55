"""The decorators of compiled code, and where its machine code is kept.

``helper`` marks a function called from other compiled code; without compilation it stays plain Python,
so it can be tested and debugged as such. ``algebra`` is a helper for sums over rows, ``specialised`` one with
parts that an argument None leaves out. ``entry`` marks the few functions called from Python.

Numba does not notice an edit to a callee in another file, so the cache folder is named by a hash of all
compiled sources. Where no folder can be written, code is compiled anew in each process.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.extending import register_jitable

F = TypeVar("F", bound=Callable[..., Any])

PACKAGE = Path(__file__).resolve().parents[1]
COMPILED_ROOMS = ("kernels", "solvers")


OPTIONS = {
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
    "no_rewrites": True,  # no array expressions to fuse, so do not look for them
    "_nrt": False,  # compiled code allocates nothing: Numba refuses what would
}


def helper(function: F) -> F:
    """Mark a function for use inside compiled code; from Python it is an ordinary function."""
    return register_jitable(no_cpython_wrapper=True, **OPTIONS)(function)  # type: ignore[no-any-return]


def algebra(function: F) -> F:
    """A helper for sums over rows: the compiler may reorder them, so they run several numbers at a time."""
    reorder = {"reassoc", "contract", "nsz"}
    return register_jitable(no_cpython_wrapper=True, fastmath=reorder, **OPTIONS)(function)  # type: ignore[no-any-return]


def specialised(function: F) -> F:
    """A helper in which the compiler decides ``if a is None``: what that leaves out costs nothing.

    The condition must stand alone: with ``and`` beside it, it is not seen.
    """
    pruned = OPTIONS | {"no_rewrites": False}
    return register_jitable(no_cpython_wrapper=True, **pruned)(function)  # type: ignore[no-any-return]


def entry(function: F) -> F:
    """Compile a function that Python calls; its machine code is kept between processes."""
    previous = numba.config.CACHE_DIR
    if CACHE is not None:
        numba.config.CACHE_DIR = str(CACHE)
    try:
        return numba.njit(cache=CACHE is not None, nogil=True, **OPTIONS)(function)
    finally:
        numba.config.CACHE_DIR = previous


def is_cached(name: str = "") -> bool:
    """Whether compiled code (of functions whose name contains ``name``) is already on disk."""
    return CACHE is not None and any(CACHE.rglob(f"*{name}*.nbc"))


def _source_hash() -> str:
    digest = hashlib.sha256(f"{numba.__version__} {sys.version}".encode())
    for room in COMPILED_ROOMS:
        for path in sorted((PACKAGE / room).rglob("*.py")):
            source = path.read_bytes()
            if room == "kernels" or b"\n@helper" in source or b"\n@entry" in source:
                digest.update(source)
    return digest.hexdigest()[:16]


def _cache_folder() -> Path | None:
    """A writable folder named by the sources: NUMBA_CACHE_DIR, the user's cache, else a temporary one."""
    name = f"kernels-{_source_hash()}"
    user = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    candidates = [
        os.environ.get("NUMBA_CACHE_DIR"),
        user and os.path.join(user, "sixpoint"),  # noqa: PTH118
        os.path.expanduser("~/.cache/sixpoint"),  # noqa: PTH111
        os.path.join(tempfile.gettempdir(), f"sixpoint-{_user_id()}"),  # noqa: PTH118
    ]
    for parent in candidates:
        if not parent or parent.startswith("~"):
            continue
        folder = Path(parent) / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError:
            continue
    return None


def _user_id() -> str:
    getuid = getattr(os, "getuid", None)
    return str(getuid()) if getuid else os.environ.get("USERNAME", "user")


CACHE = _cache_folder()
