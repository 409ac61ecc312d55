"""How busy does a batch keep the cores, and is everything done once when a worker of a cluster is killed?

    python benchmarks/batch.py                       # all AMC files of ../shared/data/cmu
    python benchmarks/batch.py --data FOLDER         # all AMC files of a folder
    python benchmarks/batch.py --made 150            # as many files made of the built-in motions
    python benchmarks/batch.py --cluster             # two Dask workers, one of them killed half way

Busy: processor seconds of the command and its workers over its time times the workers, start and end too. On
a shared machine others take their part, so also: without the time in which a worker could have run but was
kept waiting (a quiet machine shows at least that); and how much of their lives, from start to end, workers
ran or wanted to (Linux, ``/proc/PID/schedstat``). The cluster's results must be those of the pool, byte for
byte; needs ``pip install "sixpoint[cluster]"``.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

import sixpoint as sp

DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "cmu"
SECONDS, SPREAD = 3.2, 0.85  # of made files: median [s] and spread of the logarithm, mean 4.6 s at 120 Hz
BATCH = [sys.executable, "-m", "sixpoint", "batch"]
KILL_AT = 0.3  # share of the files that is done when a worker is killed


def make_library(folder: Path, count: int) -> None:
    """AMC files of the built-in motions, as long as takes of the CMU database; each with its own ASF."""
    rng = np.random.default_rng(0)
    names = list(sp.SAMPLES)
    for number in range(count):
        person, take = divmod(number, 15)
        figure = sp.Figure.from_stature(1.6 + 0.03 * person)
        motion = sp.make_sample(names[number % len(names)], figure)
        frames = np.arange(int(120 * SECONDS * np.exp(SPREAD * rng.normal()))) % len(motion)
        motion = replace(
            motion, rotations=motion.rotations[frames], translations=motion.translations[frames], rate=120.0
        )
        sp.save(motion, folder / f"{person + 2:02d}_{take + 1:02d}.amc")


class Watch(threading.Thread):
    """Sums what a command and its workers run, and wait for a core while they could [s].

    Attributes:
        own: What the command itself ran.
        alone: What it waited before and after there were workers: all of them would wait with it.
        ran, waited, lived: Sums over workers.
    """

    def __init__(self, command: int) -> None:
        super().__init__(daemon=True)
        self.command, self.over = command, threading.Event()
        self.own = self.alone = self.ran = self.waited = self.lived = 0.0
        self.start()

    def run(self) -> None:
        """Look until it is over."""
        children = Path(f"/proc/{self.command}/task/{self.command}/children")
        seen: dict[str, tuple[float, float]] = {}
        born: dict[str, float] = {}
        lived: dict[str, float] = {}
        before = 0.0
        while not self.over.wait(0.02):
            with contextlib.suppress(OSError):
                workers = [pid for pid in children.read_text().split() if is_worker(pid)]
                self.own, waited = read_schedule(str(self.command))
                self.alone += 0.0 if workers else waited - before
                before = waited
                for pid in workers:
                    seen[pid] = read_schedule(pid)
                    now = time.monotonic()
                    lived[pid] = now - born.setdefault(pid, now)
        self.ran, self.waited = (sum(times[k] for times in seen.values()) for k in (0, 1))
        self.lived = sum(lived.values())

    def stop(self) -> None:
        """The command has ended."""
        self.over.set()
        self.join()


def is_worker(pid: str) -> bool:
    """Whether a child does tasks; another one only keeps the books of multiprocessing."""
    return b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()


def read_schedule(pid: str) -> tuple[float, float]:
    """How long a process ran, and waited for a core while it could [s]."""
    ran, waited, _ = map(int, Path(f"/proc/{pid}/schedstat").read_text().split())
    return ran / 1e9, waited / 1e9


def measure_pool(data: Path, out: Path, workers: int, options: list[str]) -> None:
    """Run the pool and print how busy it was."""
    shutil.rmtree(out, ignore_errors=True)
    command = [*BATCH, f"{data}/**/*.amc", "-o", str(out), "--workers", str(workers), *options]
    start = time.perf_counter()
    process = subprocess.Popen(command)
    watch = Watch(process.pid)
    code = process.wait()
    wall = time.perf_counter() - start
    watch.stop()
    ran, kept = watch.own + watch.ran, watch.waited + workers * watch.alone
    print(
        f"pool: exit code {code}, {wall:.1f} s; {workers} workers and the command ran {ran:.1f} s: "
        f"{100 * ran / (wall * workers):.1f} % busy; others kept them waiting {kept:.1f} s, without that "
        f"{100 * ran / (wall * workers - kept):.1f} %; workers ran or wanted to for "
        f"{100 * (watch.ran + watch.waited) / watch.lived:.1f} % of their lives; "
        f"load {os.getloadavg()[0]:.1f}",
        flush=True,
    )


@contextmanager
def cluster(folder: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and two workers of one thread each; without nannies, which would revive them."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    dask = [sys.executable, "-m", "distributed.cli.dask_"]
    address = f"tcp://127.0.0.1:{port}"
    log = (folder / "dask.log").open("wb")
    here = ["--host", "127.0.0.1", "--no-dashboard"]
    head = [*dask[:2], f"{dask[2]}scheduler", *here, "--port", str(port)]
    worker = [*dask[:2], f"{dask[2]}worker", address, *here, "--nthreads", "1", "--no-nanny"]
    worker += ["--local-directory", str(folder)]
    started = [subprocess.Popen(head, stdout=log, stderr=log)]
    try:
        started += [subprocess.Popen(worker, stdout=log, stderr=log) for _ in range(2)]
        yield address, started[1:]
    finally:
        for process in reversed(started):
            process.kill()
            process.wait()
        log.close()


def measure_cluster(data: Path, out: Path, pool: Path, options: list[str]) -> None:
    """Kill a worker in the middle, and compare the results with the pool's."""
    shutil.rmtree(out, ignore_errors=True)
    total = sum(1 for _ in data.rglob("*.amc"))
    with tempfile.TemporaryDirectory() as folder, cluster(Path(folder)) as (address, workers):
        start = time.perf_counter()
        command = [*BATCH, f"{data}/**/*.amc", "-o", str(out), "--scheduler", address, *options]
        batch = subprocess.Popen(command)
        while batch.poll() is None and len(records(out)) < KILL_AT * total:
            time.sleep(0.02)
        killed = len(records(out))
        workers[0].send_signal(signal.SIGKILL)
        code = batch.wait()
        wall = time.perf_counter() - start
    rows = list(csv.DictReader((out / "summary.csv").open()))
    names = [row["file"] for row in rows]
    expected, got = contents(pool), contents(out)
    print(
        f"cluster: {wall:.1f} s, exit code {code}; a worker was killed after {killed} of {total} files; "
        f"{len(rows)} rows, {len(set(names))} files, {sum(row['status'] == 'done' for row in rows)} done; "
        f"results equal to the pool's byte for byte: {expected == got} ({len(got)} files)",
        flush=True,
    )


def records(out: Path) -> list[Path]:
    """Records of tasks that are done."""
    return list((out / ".batch" / "records").rglob("*.json"))


def contents(out: Path) -> dict[str, bytes]:
    """Results by name; without the summary, which has times."""
    files = (path for path in out.rglob("*") if path.is_file() and ".batch" not in path.parts)
    return {str(p.relative_to(out)): p.read_bytes() for p in files if p.name != "summary.csv"}


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--made", type=int, help="use this many made files")
    parser.add_argument("--workers", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--cluster", action="store_true")
    parser.add_argument("--keep", type=Path, help="folder to work in, and to leave")
    chosen, options = parser.parse_known_args()
    with tempfile.TemporaryDirectory() as spare:
        folder = chosen.keep or Path(spare)
        data = chosen.data
        if chosen.made:
            data = folder / "library"
            if not data.exists():
                data.mkdir(parents=True)
                make_library(data, chosen.made)
        files = list(data.rglob("*.amc"))
        if not files:
            raise SystemExit(f"no .amc files in {data}: give --data FOLDER or --made 150")
        size = sum(path.stat().st_size for path in files) / 1e6
        print(
            f"{len(files)} files, {size:.0f} MB, of {'built-in motions' if chosen.made else data}", flush=True
        )
        for _ in range(chosen.repeat):
            measure_pool(data, folder / "pool", chosen.workers, options)
        rows = [json.loads(path.read_bytes()) for path in records(folder / "pool")]
        frames = sum(row["metrics"].get("frames", 0) for row in rows)
        print(f"{frames} frames, {sum(row['status'] == 'done' for row in rows)} of {len(rows)} done")
        if chosen.cluster:
            measure_cluster(data, folder / "cluster", folder / "pool", options)


if __name__ == "__main__":
    main()
