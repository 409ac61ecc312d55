"""Batches on a Dask cluster: a scheduler and workers as processes of their own, some of which do not last."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

import sixpoint as sp
from batches import METHODS, leftovers, make_library, records, results
from sixpoint.cli import main
from sixpoint.jobs.batch import cluster
from sixpoint.jobs.batch.job import batch
from sixpoint.jobs.batch.task import Task
from sixpoint.jobs.reconstruct import reconstruct
from sixpoint.jobs.solving import Solving

pytest.importorskip("distributed", reason='Dask is not installed: pip install "sixpoint[cluster]"')

SOURCE = Path(sp.__file__).parents[1]
START = [sys.executable, "-m"]
NAMES = [f"{folder}/{take}.bvh" for folder in ("02", "17") for take in ("a", "b", "c", "d")]
OPTIONS = ["--method", "batch_methods:Slow"]

Worker = Callable[[Path], subprocess.Popen[bytes]]


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a library and methods, where everything runs."""
    folder = tmp_path_factory.mktemp("cluster")
    make_library(folder / "library", NAMES)
    (folder / "batch_methods.py").write_text(METHODS)
    return folder


@pytest.fixture(scope="module")
def scheduler(library: Path) -> Iterator[str]:
    """The address of a scheduler."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    words = ["--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
    with (library / "scheduler.log").open("wb") as log:
        process = subprocess.Popen(
            [*START, "distributed.cli.dask_scheduler", *words],
            cwd=library,
            env={**os.environ, "PYTHONPATH": str(SOURCE)},
            stdout=log,
            stderr=log,
        )
        yield f"tcp://127.0.0.1:{port}"
        process.kill()
        process.wait()


@pytest.fixture
def start_worker(library: Path, scheduler: str) -> Iterator[Worker]:
    """Starts workers of one thread with a copy of sixpoint; they end with the test."""
    started: list[subprocess.Popen[bytes]] = []

    def start(source: Path = SOURCE) -> subprocess.Popen[bytes]:
        words = [scheduler, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1"]
        log = (library / "workers.log").open("ab")
        started.append(
            subprocess.Popen(
                [*START, "distributed.cli.dask_worker", *words, "--local-directory", str(library)],
                cwd=library,
                env={**os.environ, "PYTHONPATH": str(source)},
                stdout=log,
                stderr=log,
            )
        )
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.wait()


@pytest.fixture
def here(library: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same folder, as the current one."""
    monkeypatch.chdir(library)
    return library


def test_a_killed_worker_costs_nothing(here, scheduler, start_worker):
    """One of two workers is killed in the middle: every file is done once, with the bytes of a plain run."""
    for name in NAMES:
        (here / "plain" / name).parent.mkdir(parents=True, exist_ok=True)
        reconstruct(here / "library" / name, here / "plain" / name, solving=Solving("sik"))
    workers = {worker.pid: worker for worker in (start_worker(SOURCE), start_worker(SOURCE))}
    words = ["library/**/*.bvh", "-o", "out", "--scheduler", scheduler, *OPTIONS]
    process = subprocess.Popen(
        [*START, "sixpoint", "batch", *words],
        env={**os.environ, "PYTHONPATH": str(SOURCE)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    deadline = time.monotonic() + 60
    while not records(here / "out") and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    (first,) = list((here / "out" / ".batch" / "records").rglob("*.json"))[:1]
    who = json.loads(first.read_bytes())["worker"]
    workers[int(who.split(":")[1])].send_signal(signal.SIGKILL)  # one that is at its next file
    said, _ = process.communicate(timeout=60)
    assert process.returncode == 0, said.decode()
    with (here / "out" / "summary.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["file"] for row in rows] == sorted(NAMES)
    assert {row["status"] for row in rows} == {"done"}
    assert who in {row["worker"] for row in rows} and len({row["worker"] for row in rows}) == 2
    assert records(here / "out") == dict.fromkeys(NAMES, "done")
    assert results(here / "out") == results(here / "plain")
    again = batch(["library"], Path("out"), options={"method": "batch_methods:Slow"}, scheduler=scheduler)
    assert again.known == len(NAMES)


def test_a_poison_file_is_given_up(here, scheduler, start_worker, monkeypatch):
    """A file that kills every worker that takes it is a failure in the end, the others are done."""
    make_library(here / "poisoned", ["poison.bvh", "x.bvh"])
    workers = [start_worker(SOURCE)]
    monkeypatch.setattr(cluster, "ALONE", 60.0)
    check = cluster._Watch.check

    def revive(watch: cluster._Watch) -> None:
        if workers[-1].poll() is not None:
            workers.append(start_worker(SOURCE))
        check(watch)

    monkeypatch.setattr(cluster._Watch, "check", revive)
    options = {"method": "batch_methods:Deadly"}
    done = batch(["poisoned"], Path("poisoned-out"), options=options, scheduler=scheduler)
    assert [outcome.name for outcome in done.failures] == ["poison.bvh"]
    assert "its worker died" in done.failures[0].error
    assert records(Path("poisoned-out")) == {"poison.bvh": "failed", "x.bvh": "done"}


def test_another_version_is_refused(here, scheduler, start_worker, tmp_path, capsys):
    """A worker with other code is named, with both versions."""
    shutil.copytree(SOURCE / "sixpoint", tmp_path / "sixpoint", ignore=shutil.ignore_patterns("__pycache__"))
    code = tmp_path / "sixpoint" / "__init__.py"
    code.write_text(code.read_text().replace(f'"{sp.__version__}"', '"9.9.9"'))
    start_worker(tmp_path)
    assert main(["batch", "library", "-o", "other", "--scheduler", scheduler]) == 2
    error = capsys.readouterr().err
    assert "9.9.9" in error and sp.__version__ in error and "install the same on both" in error
    assert records(Path("other")) == {}


def test_no_scheduler_is_said(here, capsys, monkeypatch):
    """An address where nothing answers is an error after a while, with what to start."""
    monkeypatch.setattr(cluster, "CONNECT", 0.5)
    said = {
        "tcp://127.0.0.1:1": "no Dask scheduler answers at tcp://127.0.0.1:1",
        "nonsense": "is tcp://host:port",
    }
    for address, message in said.items():
        assert main(["batch", "library", "-o", "none", "--scheduler", address]) == 2
        assert message in capsys.readouterr().err


def test_no_workers_is_said(here, scheduler, capsys, monkeypatch):
    """A scheduler alone does nothing, which is said after a while."""
    monkeypatch.setattr(cluster, "GATHER", 0.5)
    assert main(["batch", "library", "-o", "none", "--scheduler", scheduler]) == 2
    assert "has no workers" in capsys.readouterr().err


@pytest.mark.parametrize("status", ["lost", "pending"])
def test_a_result_that_died_with_its_worker_is_waited_for(status):
    """Between the worker's end and the same file done elsewhere, there is no outcome, and no failure."""
    task = Task("reconstruct", "a.bvh", Path("a.bvh"), Path("out"))
    assert cluster._outcome(SimpleNamespace(status=status), task) is None
    with pytest.raises(sp.SixpointError, match=r"scheduler was lost: it cancelled a\.bvh"):
        cluster._outcome(SimpleNamespace(status="cancelled"), task)


def test_a_worker_looks_for_the_files(tmp_path):
    """Without the same file system a worker says what it does not see."""
    probe, source = tmp_path / ".batch" / "probe.txt", tmp_path / "walk.bvh"
    assert cluster.look(probe, source)[2] == str(tmp_path)
    probe.parent.mkdir()
    probe.write_text(str(probe))
    assert cluster.look(probe, source)[2] == str(source)
    source.touch()
    assert cluster.look(probe, source)[1:] == (cluster.own_code(), "")
    assert not leftovers(tmp_path)
