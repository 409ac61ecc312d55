"""What a result is made of, as a short name: the file and all that is read with it, options, and our code."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import sixpoint
from sixpoint.jobs.batch.task import Task
from sixpoint.jobs.digests import digest, digest_code, digest_file, digest_module, find_beside
from sixpoint.solvers.registry import find_solver

MADE_BY = ("kernels", "solvers", "body", "signals", "calibration", "formats", "study", "jobs", "errors.py")
"""What of our code decides results."""
METHODS = ("method", "methods")
"""Options that may name a user's own code."""


def own_code() -> str:
    """The version of sixpoint with a digest of its code: the same on all workers of a batch."""
    return f"{sixpoint.__version__} ({digest_code(MADE_BY)})"


def task_key(task: Task) -> str:
    """What a task's result is made of; where the files are does not matter.

    Raises:
        SixpointError: A user's own method cannot be imported.
    """
    files = [digest_file(path) for path in (task.source, find_beside(task.source))]
    return digest(repr((task.job, task.target, own_code(), files, _options(task.options))).encode())


def _options(options: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Options, with files by their content and a user's method by its source."""
    found = []
    for name, value in sorted(options.items()):
        text = digest_file(value) if isinstance(value, Path) else repr(value)
        if name in METHODS:
            for method in (word for word in str(value).split(",") if ":" in word):
                find_solver(method)  # which imports it
                text += digest_module(method)
        found.append((name, text))
    return found
