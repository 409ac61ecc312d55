"""Do one task, in whatever process this is: results first, then the record; whatever fails is an outcome."""

from __future__ import annotations

import logging
import os
import socket
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sixpoint.errors import SixpointError
from sixpoint.formats.atomic import without_waiting
from sixpoint.jobs.batch.folder import find_done, make_folder, write_record
from sixpoint.jobs.batch.keys import own_code, task_key
from sixpoint.jobs.batch.registry import find_job
from sixpoint.jobs.batch.task import DONE, Outcome, Task
from sixpoint.jobs.digests import digest_file

CHANGED = "the file changed while the batch ran, or this worker sees another one: run the batch again"


def run_task(task: Task) -> Outcome:
    """Do a task, unless it is done already: by another worker that could not say so.

    Never raises but what ends a process; doing a task twice, also at once, does no harm. Nothing waits for
    the disk: what a power failure damages has another digest than its record, and is done again.
    """
    start, cpu, notes = time.perf_counter(), time.thread_time(), list[str]()
    metrics, files, error = dict[str, Any](), dict[str, str](), ""
    try:
        with _collecting(notes.append), without_waiting():
            _check(task)
            known = find_done(task)
            if known is not None:
                return known
            metrics, files = _do(task)
    except SixpointError as problem:
        error = str(problem)
    except Exception as problem:  # of one file, also a bug: the others go on
        error = f"{type(problem).__name__}: {problem}"
    spent = {"seconds": time.perf_counter() - start, "cpu": time.thread_time() - cpu}
    more: dict[str, Any] = {**spent, "worker": worker_name(), "notes": tuple(dict.fromkeys(notes))}
    if error:
        outcome = Outcome.failed(task, error, **more)
    else:
        outcome = Outcome(task.name, task.part, DONE, task.key, metrics=metrics, files=files, **more)
    try:
        with without_waiting():
            write_record(task.out, outcome)
    except SixpointError as problem:
        return Outcome.failed(task, str(problem), **more)
    return outcome


def _check(task: Task) -> None:
    """Refuse to work with other code, or on another file, than the batch was started with."""
    if own_code() != task.code:
        raise SixpointError(f"this worker has sixpoint {own_code()}, the batch was started by {task.code}")
    if task_key(task) != task.key:
        raise SixpointError(CHANGED if task.source.exists() else f"{task.source}: no such file here")


def _do(task: Task) -> tuple[dict[str, Any], dict[str, str]]:
    """Metrics, and digests of the files that were written."""
    out = task.out / task.target
    make_folder(out.parent)
    run_one = find_job(task.job).find("run_one")
    assert run_one is not None, task.job
    metrics = dict(run_one(task.source, out, task.options))
    written = [Path(path) for path in metrics.pop("files", [out])]
    if task_key(task) != task.key:
        raise SixpointError(CHANGED)
    return metrics, {path.relative_to(task.out).as_posix(): digest_file(path) for path in written}


def warm_up(job: str, options: Mapping[str, Any], say: Callable[[str], None]) -> float:
    """Compile what a job needs, so that other processes of this machine load it; returns the time [s]."""
    start = time.perf_counter()
    function = find_job(job).find("warm_up")
    with _collecting(say):
        if function is not None:
            function(options)
    return time.perf_counter() - start


def worker_name() -> str:
    """Where this runs."""
    return f"{socket.gethostname()}:{os.getpid()}"


class _Listener(logging.Handler):
    """Log records as texts."""

    def __init__(self, say: Callable[[str], None]) -> None:
        super().__init__(logging.INFO)
        self.say = say

    def emit(self, record: logging.LogRecord) -> None:
        self.say(" ".join(record.getMessage().split()))


@contextmanager
def _collecting(say: Callable[[str], None]) -> Iterator[None]:
    """Tell of what is logged and warned about, in place of writing it to the stderr of a worker."""
    log = logging.getLogger("sixpoint")
    listener, level, propagate = _Listener(say), log.level, log.propagate
    log.addHandler(listener)
    log.setLevel(logging.INFO)
    log.propagate = False
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", UserWarning)
            warnings.showwarning = lambda message, *_: say(str(message))
            yield
    finally:
        log.removeHandler(listener)
        log.setLevel(level)
        log.propagate = propagate
