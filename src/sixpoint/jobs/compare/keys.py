"""What a row of a comparison was measured of, as a short name: files, options and code.

A row with the same key need not be measured again.
"""

from __future__ import annotations

import hashlib
import importlib
from pathlib import Path

import sixpoint
from sixpoint.jobs.compare.study import Study

MEASURED_BY = (
    "kernels",
    "solvers",
    "body",
    "signals",
    "formats",
    "study/metrics.py",
    "study/quality.py",
    "study/movement.py",
    "study/limit_excess.py",
    "jobs/reading.py",
    "jobs/compare/run.py",
    "jobs/compare/methods.py",
)
"""What of our code decides a row."""


def row_keys(study: Study, limits_file: Path | None) -> dict[tuple[str, str], str]:
    """What is measured by each clip and method, as short names."""
    code = _code()
    table = "" if limits_file is None else digest(limits_file.read_bytes())
    keys = {}
    for clip in study.clips:
        files = [
            _file_digest(path) for path in (clip.file, clip.skeleton or _beside(clip.file), clip.mapping)
        ]
        subject = (files, clip.frames, clip.weights, clip.sample, study.limits, table)
        for method in study.methods:
            own = _module_digest(method.solver)
            text = repr((code, subject, method.solver, sorted(method.options.items()), own))
            keys[clip.name, method.name] = digest(text.encode())
    return keys


def _beside(file: Path) -> Path | None:
    """The .asf that an .amc will be read with, near enough to notice a change."""
    if file.suffix.lower() != ".amc":
        return None
    found = sorted(file.parent.glob(f"{file.stem.rpartition('_')[0]}.asf"))
    return found[0] if found else None


def digest(data: bytes) -> str:
    """A short name of some bytes."""
    return hashlib.sha256(data).hexdigest()[:16]


def _file_digest(path: Path | None) -> str:
    try:
        return "" if path is None else digest(path.read_bytes())
    except OSError:
        return "unreadable"


def _module_digest(solver: str) -> str:
    """Of the source of a user's own method."""
    module = solver.partition(":")[0]
    if ":" not in solver:
        return ""
    source = getattr(importlib.import_module(module), "__file__", None)
    return _file_digest(Path(source)) if source else ""


def _code() -> str:
    package = Path(sixpoint.__file__).parent
    digest = hashlib.sha256()
    for name in MEASURED_BY:
        place = package / name
        for path in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
