"""Tasks on several processes of this machine.

Each process has a pipe of its own and does its tasks in order: when it dies (out of memory, a crash), it is
known which task it was at, and the others go on. A ``ProcessPoolExecutor`` only says that one of all died.
"""

from __future__ import annotations

import os
import signal
import threading
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any

from sixpoint.errors import SixpointError
from sixpoint.jobs.batch.folder import sweep
from sixpoint.jobs.batch.registry import find_job
from sixpoint.jobs.batch.running import run_task, warm_up
from sixpoint.jobs.batch.task import Outcome, Task

TRIES = 2
"""How often a task is begun whose worker died."""
SLOW = 5.0
"""Kernels that take longer to get ready were compiled, not loaded [s]."""
AHEAD = 2
"""Tasks that a worker has at once, while there is plenty."""
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Set to 1 for workers: there is a process for each core."""
SPAWN = get_context("spawn")  # a fork would copy threads' locks


@dataclass(frozen=True)
class WarmUp:
    """Asks a worker to compile what a job needs; it answers with the time [s], and may say things before."""

    job: str
    options: Mapping[str, Any]


@dataclass(frozen=True)
class Begin:
    """Asks a worker to import what a job needs; it does not answer."""

    job: str


def serve(link: Connection) -> None:
    """Do what is asked for until the pipe ends; the life of a worker."""
    while True:
        try:
            asked = link.recv()
            if isinstance(asked, Task):
                link.send(run_task(asked))
            elif isinstance(asked, WarmUp):
                link.send(_warm_up(asked, link))
            else:
                find_job(asked.job).load()
        except (EOFError, OSError):
            return  # the parent is gone


def _warm_up(asked: WarmUp, link: Connection) -> float | SixpointError:
    try:
        return warm_up(asked.job, asked.options, link.send)
    except SixpointError as error:
        return SixpointError(str(error))


class Worker:
    """A process, and the tasks it was given: the first is under way."""

    def __init__(self) -> None:
        self.link, other = SPAWN.Pipe()
        self.process = SPAWN.Process(target=serve, args=(other,), daemon=True, name="sixpoint batch")
        with _as_workers_begin():
            self.process.start()
        other.close()
        self.tasks: deque[Task] = deque()

    def ask(self, what: Task | WarmUp | Begin) -> None:
        """Hand over something to do; what is wrong with the worker shows when it is to answer."""
        if isinstance(what, Task):
            self.tasks.append(what)
        try:
            self.link.send(what)
        except OSError:
            return

    def answer(self) -> Any:
        """What it says.

        Raises:
            EOFError: It died.
        """
        try:
            return self.link.recv()
        except OSError as error:
            raise EOFError from error

    def say_why(self) -> str:
        """How it died, once it is ended."""
        code = self.process.exitcode
        if code is not None and code < 0:
            name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
            return f"{name}{', out of memory?' if name == 'SIGKILL' else ''}"
        return f"exit code {code}"

    def end(self, now: bool = False) -> None:
        """End it: when it has nothing to do, or now."""
        self.link.close()
        if now:
            self.process.kill()
        self.process.join()


def run_here(
    tasks: Iterable[Task],
    workers: int,
    job: str,
    options: Mapping[str, Any],
    say: Callable[[str], None],
) -> Generator[Outcome]:
    """Do tasks in the order given, several at a time.

    Args:
        tasks: What to do.
        workers: Number of processes.
        job: The job of all.
        options: Its options.
        say: Told what is compiled before the other workers begin.

    Yields:
        Outcomes as they come. A task whose worker died is begun again once.

    Raises:
        SixpointError: Workers cannot be started.
    """
    waiting, tries = deque(tasks), Counter[str]()
    pool: list[Worker] = []
    if not waiting:
        return
    try:
        pool += [Worker() for _ in range(min(workers, len(waiting)))]
        for worker in pool[1:]:
            worker.ask(Begin(job))  # meanwhile
        _prepare(pool[0], WarmUp(job, options), say)
        for worker in pool:
            _feed(worker, waiting, len(pool))
        while pool:
            ready = wait([worker.link for worker in pool])
            for worker in [worker for worker in pool if worker.link in ready]:
                task = worker.tasks.popleft()
                try:
                    outcome = worker.answer()
                except EOFError:
                    pool.remove(worker)
                    worker.end()
                    sweep(task)
                    waiting.extendleft(worker.tasks)  # not begun
                    tries[task.label] += 1
                    outcome = Outcome.failed(task, f"its worker died {TRIES} times ({worker.say_why()})")
                    if tries[task.label] < TRIES:
                        say(f"{task.label}: its worker died ({worker.say_why()}); it is begun again")
                        waiting.append(task)
                    if waiting:
                        pool.append(Worker())
                        _feed(pool[-1], waiting, len(pool))
                    if tries[task.label] < TRIES:
                        continue
                else:
                    _feed(worker, waiting, len(pool))
                    if not worker.tasks:
                        pool.remove(worker)
                        worker.end()
                yield outcome
    finally:
        for worker in pool:
            worker.end(now=True)
            for task in worker.tasks:
                sweep(task)


def _feed(worker: Worker, waiting: deque[Task], workers: int) -> None:
    """See that a worker has something to do, and next while there is plenty: so it never waits for us."""
    ahead = AHEAD if len(waiting) > AHEAD * workers else 1
    while waiting and len(worker.tasks) < ahead:
        worker.ask(waiting.popleft())


def _prepare(worker: Worker, warm: WarmUp, say: Callable[[str], None]) -> None:
    """Have the first worker compile; the others find the machine code on disk."""
    worker.ask(warm)
    told = False
    try:
        while not isinstance(answer := worker.answer(), float):
            if isinstance(answer, SixpointError):
                raise answer
            say(f"{answer}, before the other workers begin")
            told = True
        if answer > SLOW and not told:
            say(f"compiled kernels in {answer:.0f} s, once, before the other workers began")
    except EOFError:
        worker.process.join()
        raise SixpointError(
            f"the first worker died before it did anything ({worker.say_why()}); a script must start a batch "
            'below  if __name__ == "__main__":'
        ) from None


@contextmanager
def _as_workers_begin() -> Iterator[None]:
    """Processes started within have one thread each for linear algebra, and leave Ctrl-C to their parent."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    try:
        with _inheriting_no_interrupt():
            yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name)
            else:
                os.environ[name] = value


@contextmanager
def _inheriting_no_interrupt() -> Iterator[None]:
    """Processes started within never see Ctrl-C; ours is not lost, but comes afterwards (but on Windows)."""
    if hasattr(signal, "pthread_sigmask"):
        resource_tracker.ensure_running()  # it unblocks the signal when it begins
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
    elif threading.current_thread() is threading.main_thread():
        interrupt = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, interrupt)
    else:
        yield
