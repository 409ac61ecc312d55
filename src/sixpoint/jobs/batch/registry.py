"""The jobs a batch can do. A job is a module with a few functions; here is where, and what it takes.

| function of the module | |
|---|---|
| ``run_one(source, out, options) -> dict`` | does one file; returns metrics, and the ``files`` it wrote |
| ``check(options)`` | refuses impossible options before anything is done; may be left out |
| ``warm_up(options)`` | compiles what ``run_one`` needs, once on each machine; may be left out |
| ``parts(options) -> dict`` | part -> its options, where a file is several tasks; may be left out |
| ``gather(outcomes, sources, out, options, progress)`` | makes files of all, at the end; may be left out |

``run_one`` heeds what ``check`` lets through: what makes no sense for many files is refused (``refuse``).

``options`` are the command's, by the names of its parameters, only those that were given.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from sixpoint.errors import SixpointError, listed
from sixpoint.formats import MOTION_SUFFIXES, TARGET_SUFFIXES

MOTIONS = tuple(suffix for suffix in MOTION_SUFFIXES if suffix != ".asf")


@dataclass(frozen=True)
class Job:
    """What a batch knows of a job.

    Attributes:
        name: What users call it.
        module: Where its functions are.
        suffixes: Of the files it takes.
        formats: Suffixes of what it writes for each file, the usual one first; none where it names its files.
        headline: Metrics whose mean and worst are shown at the end, larger is worse -> how they are called.
    """

    name: str
    module: str
    suffixes: tuple[str, ...]
    formats: tuple[str, ...]
    headline: tuple[tuple[str, str], ...] = ()

    def load(self) -> ModuleType:
        """Its module.

        Raises:
            SixpointError: This version of sixpoint does not have it.
        """
        try:
            return importlib.import_module(self.module)
        except ModuleNotFoundError as error:
            if error.name != self.module:
                raise
            raise SixpointError(f"the job {self.name!r} is not in this version of sixpoint") from None

    def find(self, function: str) -> Callable[..., Any] | None:
        """One of its functions; None where it was left out."""
        return getattr(self.load(), function, None)


JOBS = {
    job.name: job
    for job in (
        Job(
            "reconstruct",
            "sixpoint.jobs.batch.reconstructing",
            (*MOTIONS, *TARGET_SUFFIXES),
            (".bvh", ".amc"),
            (("position", "position error over H"), ("orientation", "orientation error [rad]")),
        ),
        Job(
            "track",
            "sixpoint.jobs.batch.tracking",
            (".c3d", ".trc", ".csv", ".json", ".npz"),
            (".bvh", ".amc", ".mot", ".csv"),
            (("residual", "marker residual, RMS [m]"),),
        ),
        Job("compare", "sixpoint.jobs.batch.comparing", MOTIONS, ()),
    )
}
"""Name -> job."""


def find_job(name: str) -> Job:
    """A job by its name.

    Raises:
        SixpointError: There is none; the message lists those there are.
    """
    if name not in JOBS:
        raise SixpointError(f"no job named {name!r}; jobs: {listed(JOBS)}")
    return JOBS[name]


def refuse(options: Mapping[str, Any], reasons: Mapping[str, str]) -> None:
    """Refuse options of a command that a batch would not heed.

    Args:
        options: What was given.
        reasons: Name of a parameter -> why not, and what to do instead.

    Raises:
        SixpointError: The message names the option and the reason.
    """
    for name, reason in reasons.items():
        if options.get(name) not in (None, False):
            raise SixpointError(f"--{name.replace('_', '-')} does not go with a batch: {reason}")
