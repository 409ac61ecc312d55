"""Tasks on a Dask cluster: all of it needs this package, and workers the same file system; nothing else.

A task whose worker died is done again by another worker, as often as the scheduler allows
(``distributed.scheduler.allowed-failures``, 3); one that was not to blame for that has a last try alone.
"""

from __future__ import annotations

import logging
import os
import re
import secrets
import socket
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sixpoint.errors import SixpointError, listed
from sixpoint.formats.atomic import write_files
from sixpoint.jobs.batch.folder import OURS
from sixpoint.jobs.batch.keys import own_code
from sixpoint.jobs.batch.running import run_task, warm_up
from sixpoint.jobs.batch.task import Outcome, Task

if TYPE_CHECKING:
    from distributed import Client, Future

CONNECT, GATHER, ALONE = 10.0, 20.0, 30.0
"""How long to wait for the scheduler, for the first worker, and for a new one when all are gone [s]."""
POLL = 0.05
LOST = "the Dask scheduler was lost"
PROBE = f"{OURS}/probe.txt"
ADDRESS = re.compile(r"(\w+://)?\S+:\d+")


def run_on_cluster(
    tasks: Sequence[Task],
    address: str,
    job: str,
    options: Mapping[str, Any],
    say: Callable[[str], None],
) -> Generator[Outcome]:
    """Do tasks on the workers of a Dask scheduler.

    Args:
        tasks: What to do; the first begin.
        address: Of the scheduler, ``tcp://host:port``.
        job: The job of all.
        options: Its options.
        say: Told of workers, and of what is compiled.

    Yields:
        Outcomes as they come.

    Raises:
        SixpointError: There is no scheduler or worker, workers have other code or do not see the files, or
            all were lost.
    """
    if not tasks:
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise SixpointError('--scheduler needs Dask: pip install "sixpoint[cluster]"') from error
    if not ADDRESS.fullmatch(address):
        raise SixpointError(f"the address of a Dask scheduler is tcp://host:port, got {address!r}")
    client = None
    try:
        _quieten()
        client = Client(address, timeout=CONNECT, set_as_default=False)
        hosts = _check_workers(client, tasks, say)
        _prepare(client, hosts, job, options, say)
        yield from _run(client, tasks)
    except (OSError, TimeoutError, ValueError) as error:
        if client is not None:
            raise SixpointError(f"{LOST}: {type(error).__name__}: {error}") from error
        raise SixpointError(
            f"no Dask scheduler answers at {address} ({type(error).__name__}); start one with: dask scheduler"
        ) from error
    finally:
        if client is not None:
            client.close(timeout=5)


def _quieten() -> None:
    """What is lost we say ourselves, in a line and without traces."""
    for name in ("distributed", "distributed.client", "distributed.core", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL)


def look(probe: Path, source: Path) -> tuple[str, str, str]:
    """What a worker is and sees: its host, its code, and what of the files is missing to it."""
    try:
        text = probe.read_text("utf-8")
    except OSError:
        text = ""
    missing = "" if source.is_file() else str(source)
    if text != str(probe):
        missing = str(probe.parent.parent)
    elif not os.access(probe.parent, os.W_OK):
        missing = f"{probe.parent.parent} for writing"
    return socket.gethostname(), own_code(), missing


def prepare(job: str, options: Mapping[str, Any]) -> list[str]:
    """Compile what a job needs, for all workers of a machine; returns what was said."""
    said: list[str] = []
    warm_up(job, options, said.append)
    return said


def _check_workers(client: Client, tasks: Sequence[Task], say: Callable[[str], None]) -> dict[str, str]:
    """Worker -> host, once all have our code and see our files."""
    try:
        client.wait_for_workers(1, timeout=GATHER)
    except TimeoutError:
        raise SixpointError(
            f"the scheduler has no workers after {GATHER:g} s; start some: dask worker {_address(client)}"
        ) from None
    try:
        _check_code("the scheduler", client.run_on_scheduler(own_code))
    except ImportError as error:
        raise SixpointError(f"the scheduler has no sixpoint ({error}): install it there") from None
    probe = tasks[0].out / PROBE
    write_files({probe: str(probe).encode()}, force=True)
    found = client.run(look, probe, tasks[0].source, on_error="return")
    hosts = {}
    for worker, answer in found.items():
        if "ImportError" in repr(answer) or "ModuleNotFoundError" in repr(answer):
            raise SixpointError(f"the worker {worker} has no sixpoint ({answer}): install it there")
        if isinstance(answer, BaseException):
            say(f"the worker {worker} does not answer: {answer}")
            continue
        hosts[worker], code, missing = answer
        _check_code(f"the worker {worker}", code)
        if missing:
            raise SixpointError(
                f"the worker {worker} does not see {missing}: client and workers need the same file system"
            )
    if not hosts:
        raise SixpointError(f"no worker answers: {listed(str(answer) for answer in found.values())}")
    machines = Counter(hosts.values())
    say("workers: " + listed(f"{count} on {host}" for host, count in machines.items()))
    return hosts


def _check_code(who: str, code: str) -> None:
    if code != own_code():
        raise SixpointError(f"{who} has sixpoint {code}, here it is {own_code()}: install the same on both")


def _prepare(
    client: Client, hosts: Mapping[str, str], job: str, options: Mapping[str, Any], say: Callable[[str], None]
) -> None:
    """Have one worker of each machine compile, the others find the machine code on disk."""
    first = {host: worker for worker, host in hosts.items()}
    asked = {
        host: client.submit(
            prepare, job, options, workers=[worker], allow_other_workers=True, pure=False, priority=1_000_000
        )
        for host, worker in first.items()
    }
    for host, future in asked.items():
        try:
            said = future.result()
        except SixpointError:
            raise
        except Exception:  # that worker was lost: what is not compiled now will be later
            continue
        for text in said:
            say(f"{host}: {text}, before the other tasks begin")


def _run(client: Client, tasks: Sequence[Task]) -> Iterator[Outcome]:
    """Outcomes as they come; tasks that were blamed for dead workers together are tried once more alone."""
    blamed: list[tuple[Task, Outcome]] = []
    for task, outcome in _come(client, tasks):
        if outcome.worker:
            yield outcome
        else:
            blamed.append((task, outcome))
    for task, outcome in blamed:
        again = _come(client, [task]) if len(blamed) > 1 else [(task, outcome)]
        yield from (outcome for _, outcome in again)


def _come(client: Client, tasks: Sequence[Task]) -> Iterator[tuple[Task, Outcome]]:
    from distributed import as_completed

    run = secrets.token_hex(4)  # another run must not get our results
    waiting: dict[Any, Task] = {}
    futures = []
    for number, task in enumerate(tasks):
        key = f"{task.job}-{task.label}-{task.key}-{run}"
        futures.append(client.submit(run_task, task, key=key, pure=False, retries=2, priority=-number))
        waiting[key] = task
    coming = as_completed(futures, loop=client.loop)
    watch = _Watch(client)
    try:
        while waiting:
            batch = coming.next_batch(block=False)
            if not batch:
                watch.check()
                time.sleep(POLL)
            for future in batch:
                task = waiting[future.key]
                outcome = _outcome(future, task)
                if outcome is None:
                    coming.add(future)
                    continue
                del waiting[future.key]
                yield task, outcome
                future.release()
    finally:
        client.cancel([future for future in futures if future.key in waiting])


def _outcome(future: Future[Outcome], task: Task) -> Outcome | None:
    """What came of a task; None where its worker took the result along: it is looked up by another."""
    if future.status in ("lost", "pending"):
        return None
    if future.status == "cancelled":
        raise SixpointError(f"{LOST}: it cancelled {task.label}")
    try:
        return future.result(timeout=CONNECT)
    except TimeoutError:
        return None
    except Exception as error:  # of Dask: ours are outcomes
        if type(error).__name__ == "KilledWorker":
            return Outcome.failed(task, "its worker died, also when others did it again (out of memory?)")
        return Outcome.failed(task, f"the cluster could not do it: {type(error).__name__}: {error}")


class _Watch:
    """Notices that nobody is left to work."""

    def __init__(self, client: Client) -> None:
        self.client = client
        self.seen = self.looked = time.monotonic()

    def check(self) -> None:
        """Look now and then.

        Raises:
            SixpointError: The scheduler is lost, or all workers are and none came in time.
        """
        now = time.monotonic()
        if now - self.looked < 1.0:
            return
        self.looked = now
        if self.client.status not in ("running", "connecting"):
            raise SixpointError(f"{LOST}: the client is {self.client.status}")
        if self.client.nthreads():
            self.seen = time.monotonic()
        elif now - self.seen > ALONE:
            raise SixpointError(f"all workers are gone, and no new one came in {ALONE:g} s")


def _address(client: Client) -> str:
    return str(client.scheduler.address) if client.scheduler else ""
