"""What a row of a comparison was measured of, as a short name: files, options and code.

A row with the same key need not be measured again.
"""

from __future__ import annotations

from pathlib import Path

from sixpoint.jobs.compare.study import Study
from sixpoint.jobs.digests import digest, digest_code, digest_file, digest_module, find_beside

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
    code = digest_code(MEASURED_BY)
    table = "" if limits_file is None else digest(limits_file.read_bytes())
    keys = {}
    for clip in study.clips:
        files = [
            digest_file(path) for path in (clip.file, clip.skeleton or find_beside(clip.file), clip.mapping)
        ]
        subject = (files, clip.frames, clip.weights, clip.sample, study.limits, table)
        for method in study.methods:
            own = digest_module(method.solver)
            text = repr((code, subject, method.solver, sorted(method.options.items()), own))
            keys[clip.name, method.name] = digest(text.encode())
    return keys
