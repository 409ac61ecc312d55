"""Do a job on many files, by processes of this machine or of a Dask cluster; go on where it stopped."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sixpoint.errors import SixpointError, listed
from sixpoint.jobs.batch.cluster import run_on_cluster
from sixpoint.jobs.batch.folder import (
    SUMMARY,
    begin,
    find_done,
    read_records,
    write_record,
    write_summary,
)
from sixpoint.jobs.batch.keys import own_code, task_key
from sixpoint.jobs.batch.library import Library, find_files
from sixpoint.jobs.batch.pool import run_here
from sixpoint.jobs.batch.registry import Job, find_job
from sixpoint.jobs.batch.task import DONE, FAILED, Outcome, Task
from sixpoint.jobs.progress import Progress, silent

log = logging.getLogger("sixpoint")

WRITTEN_EVERY = 10.0
"""How often the summary is written while work goes on [s]."""


@dataclass(frozen=True, eq=False)
class Batch:
    """What a batch left behind.

    Attributes:
        outcomes: One per task of this run, by name; those that were known too.
        known: Tasks that were done before with the same files, options and code.
        files: The summary, and what the job made of all.
        library: The files.
        workers: Processes that did tasks now.
        seconds: Time all took [s].
        cpu: Processor time of the tasks done now [s].
    """

    outcomes: tuple[Outcome, ...]
    known: int
    files: tuple[Path, ...]
    library: Library
    workers: int
    seconds: float
    cpu: float

    @property
    def failures(self) -> tuple[Outcome, ...]:
        """Tasks that gave no result."""
        return tuple(outcome for outcome in self.outcomes if outcome.status == FAILED)


def batch(
    patterns: Sequence[str],
    out: Path,
    *,
    job: str = "reconstruct",
    options: Mapping[str, Any] | None = None,
    out_format: str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Batch:
    """Do a job on all files that patterns name.

    Results lie in ``out`` as the files lie in their library. What was done before with the same content,
    options and code is not done again; what failed is. A file that fails, or whose worker dies twice, is an
    outcome with a reason, and the others are done. An interrupted batch goes on where it was.

    In a script, call this below ``if __name__ == "__main__":``, as for every process pool.

    Args:
        patterns: ``library/**/*.amc``, files, or folders.
        out: The folder to write into; it is made.
        job: Name of ``registry.JOBS``.
        options: Of the job, by the names of its command's parameters.
        out_format: Suffix of the results; by default the job's.
        workers: Processes on this machine; by default one per core.
        scheduler: Address of a Dask scheduler, ``tcp://host:port``, in place of processes on this machine.
        force: Do all again, also in the folder of another batch or one that is not ours.
        progress: Told how many tasks are done.

    Raises:
        SixpointError: Nothing could be begun, or the cluster was lost; what is done is kept.
    """
    start = time.perf_counter()
    chosen = find_job(job)
    options = {name: _absolute(value) for name, value in (options or {}).items()}
    _check(chosen, options, out_format, workers, scheduler)
    out = Path(os.path.abspath(out))  # noqa: PTH100  links stay
    library = find_files(patterns, chosen.suffixes, out)
    for note in library.notes:
        log.info(note)
    begin(out, job, library.root, force)
    suffix = out_format or next(iter(chosen.formats), "")
    tasks, known = _plan(chosen, library, out, options, suffix, progress)
    todo = sorted((task for task in tasks if task.label not in known), key=lambda task: -task.size)
    count = min(workers or count_cores(), len(todo))
    if scheduler is not None:
        came = run_on_cluster(todo, scheduler, job, options, log.info)
    else:
        came = run_here(todo, count, job, options, log.info)
    table = {outcome.label: outcome for outcome in read_records(out)}
    fresh = _follow(came, len(tasks), len(known), out, table, progress)
    outcomes = tuple((known | fresh)[task.label] for task in tasks)
    gather = chosen.find("gather") if any(outcome.status == DONE for outcome in outcomes) else None
    sources = {task.name: task.source for task in tasks}
    made = gather(outcomes, sources, out, options, progress) if gather else []
    ran = len({outcome.worker for outcome in fresh.values()} - {""})
    seconds, cpu = time.perf_counter() - start, sum(outcome.cpu for outcome in fresh.values())
    return Batch(outcomes, len(known), (out / SUMMARY, *made), library, ran, seconds, cpu)


def count_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _absolute(value: Any) -> Any:
    """Paths as workers need them, whatever folder they run in."""
    return Path(os.path.abspath(value)) if isinstance(value, Path) else value  # noqa: PTH100


def _check(
    job: Job, options: Mapping[str, Any], out_format: str | None, workers: int | None, scheduler: str | None
) -> None:
    """Refuse what cannot be, before anything is looked for."""
    if out_format is not None and out_format not in job.formats:
        which = f"writes {listed(job.formats)}" if job.formats else "names its files itself"
        raise SixpointError(f"--out-format {out_format}: the job {job.name!r} {which}")
    if workers is not None and scheduler is not None:
        raise SixpointError("--workers is for this machine; a cluster has its own (see: dask worker --help)")
    if workers is not None and workers < 1:
        raise SixpointError(f"--workers must be at least 1, got {workers}")
    check = job.find("check")
    if check is not None:
        check(options)


def _plan(
    job: Job, library: Library, out: Path, options: Mapping[str, Any], suffix: str, progress: Progress
) -> tuple[list[Task], dict[str, Outcome]]:
    """All tasks, and by label the outcomes of those that need not be done again."""
    find_parts = job.find("parts")
    parts = find_parts(options) if find_parts else {"": options}
    tasks: list[Task] = []
    known: dict[str, Outcome] = {}
    for number, file in enumerate(library.files):
        progress("looking at files", number, len(library.files))
        target = library.target(file, suffix, job.suffixes) if suffix else ""
        for part, own in parts.items():
            task = Task(job.name, library.name(file), file, out, target, own, part, code=own_code())
            task = replace(task, key=task_key(task), size=file.stat().st_size)
            tasks.append(task)
            done = find_done(task)
            if done is not None:
                known[task.label] = done
    progress("looking at files", len(library.files), len(library.files))
    _check_targets(tasks)
    return tasks, known


def _check_targets(tasks: Sequence[Task]) -> None:
    """No two files may have one result; ``Library.target`` sees to it but for names made to defeat it."""
    owners: dict[str, str] = {}
    for task in tasks:
        owner = owners.setdefault(task.target, task.name) if task.target else task.name
        if owner != task.name:
            raise SixpointError(f"{owner} and {task.name} would both become {task.target}: rename one")


def _follow(
    came: Generator[Outcome],
    total: int,
    done: int,
    out: Path,
    table: dict[str, Outcome],
    progress: Progress,
) -> dict[str, Outcome]:
    """Take outcomes as they come, by label; the summary is written now and then, and whatever ends this."""
    fresh: dict[str, Outcome] = {}
    written = time.monotonic()
    progress("batch", done, total)
    try:
        with closing(came):
            for outcome in came:
                if not outcome.worker:  # nobody lived to write it down
                    write_record(out, outcome)
                fresh[outcome.label] = table[outcome.label] = outcome
                progress("batch", done + len(fresh), total)
                if time.monotonic() - written > WRITTEN_EVERY:
                    _write(out, table)
                    written = time.monotonic()
    except (KeyboardInterrupt, SixpointError):
        table |= {
            outcome.label: outcome for outcome in read_records(out)
        }  # also what nobody was told any more
        count = done + sum(outcome.status == DONE for outcome in fresh.values())
        if fresh:
            log.warning(f"{count} of {total} are done; the same command goes on from there")
        raise
    finally:
        _write(out, table)
    return fresh


def _write(out: Path, table: Mapping[str, Outcome]) -> None:
    write_summary(out, sorted(table.values(), key=lambda outcome: (outcome.name, outcome.part)))
