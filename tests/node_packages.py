"""Packages of the npm registry for tests: installed once into a temporary folder that is kept."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import pytest

SECONDS = 120


@cache
def _install(names: tuple[str, ...]) -> tuple[Path | None, str]:
    """The folder node_modules, or None and why there is none."""
    if not shutil.which("node") or not shutil.which("npm"):
        return None, "node and npm are not installed"
    folder = Path(tempfile.gettempdir()) / "sixpoint-node-packages"
    folder.mkdir(exist_ok=True)
    modules = folder / "node_modules"
    if not all((modules / name).is_dir() for name in names):
        call = ["npm", "install", "--no-audit", "--no-fund", "--ignore-scripts", *names]
        try:
            done = subprocess.run(
                call, cwd=folder, capture_output=True, text=True, timeout=SECONDS, check=False
            )
        except subprocess.TimeoutExpired:
            return None, f"npm install {' '.join(names)} took too long"
        if done.returncode:
            return None, f"npm install {' '.join(names)} failed: {done.stderr.strip()[-200:]}"
    return modules, ""


def node_modules(*names: str) -> Path:
    """The folder with these packages; skips the test where they cannot be had."""
    modules, reason = _install(names)
    if modules is None:
        pytest.skip(reason)
    return modules
