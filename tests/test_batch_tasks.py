"""One task of a batch: what it writes, what it is known by, and that doing it twice does no harm."""

from __future__ import annotations

import csv
import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import sixpoint as sp
from batches import leftovers, make_library
from sixpoint.formats.atomic import remove_leftovers, write_files
from sixpoint.jobs.batch import keys, running
from sixpoint.jobs.batch.folder import (
    begin,
    find_done,
    read_records,
    record_path,
    write_record,
    write_summary,
)
from sixpoint.jobs.batch.keys import own_code, task_key
from sixpoint.jobs.batch.registry import JOBS, find_job
from sixpoint.jobs.batch.running import run_task
from sixpoint.jobs.batch.task import DONE, FAILED, Outcome, Task
from sixpoint.jobs.compare.job import compare
from sixpoint.jobs.compare.methods import choose_methods
from sixpoint.jobs.compare.study import study_of_files
from sixpoint.jobs.reconstruct import reconstruct
from sixpoint.jobs.solving import Solving


def make_task(source: Path, job: str = "reconstruct", **more: Any) -> Task:
    """A task whose result goes to a folder beside the source's."""
    out = source.parent.parent / "out"
    begin(out, job, source.parent, True)
    suffix = next(iter(JOBS[job].formats), "")
    target = source.with_suffix(suffix).name if suffix else ""
    task = Task(job, source.name, source, out, target, code=own_code(), **more)
    return replace(task, key=task_key(task))


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    """A short motion in a library."""
    return make_library(tmp_path / "library", ["walk.amc"]) / "walk.amc"


def test_a_task_is_the_job(walk):
    """The result is that of the job alone, byte for byte, and the metrics are the library's."""
    outcome = run_task(make_task(walk, options={"method": "sik", "no_limits": True}))
    assert outcome.status == DONE, outcome.error
    alone = walk.with_name("walk.bvh")
    done = reconstruct(walk, alone, solving=Solving("sik", limits=False))
    out = walk.parent.parent / "out" / "walk.bvh"
    assert out.read_bytes() == alone.read_bytes()
    assert done.errors is not None
    assert outcome.metrics["position"] == done.errors.position
    assert outcome.metrics["frames"] == sum(outcome.metrics[name] for name in ("reached", "missed", "lost"))
    assert list(outcome.files) == ["walk.bvh"]
    assert outcome.cpu <= outcome.seconds + 0.1


def test_a_task_done_twice_is_done_once(walk):
    """A second run finds the record; at the same time, both write the same and leave nothing behind."""
    task = make_task(walk)
    with ThreadPoolExecutor(3) as pool:
        outcomes = list(pool.map(run_task, [task] * 3))
    assert {outcome.status for outcome in outcomes} == {DONE}
    assert len({str(outcome.files) for outcome in outcomes}) == 1
    assert not leftovers(task.out)
    assert run_task(task) == find_done(task)


def test_what_changes_a_result_changes_its_key(walk, monkeypatch):
    """Content, skeleton, options, what they name, and code count; where a file is does not."""
    task = make_task(walk)
    limits = walk.with_name("limits.toml")
    limits.write_text(sp.Limits.text())
    same = replace(task, source=Path(str(walk.parent) + "/../library/walk.amc"), size=7)
    assert task_key(same) == task.key
    seen = {task.key}

    def is_new(changed: Task) -> bool:
        key = task_key(changed)
        new = key not in seen
        seen.add(key)
        return new

    assert is_new(replace(task, options={"method": "sik"}))
    assert is_new(replace(task, options={"limits": limits}))
    limits.write_text(sp.Limits.text() + "\n")
    assert is_new(replace(task, options={"limits": limits}))
    assert is_new(replace(task, target="walk.amc"))
    asf = walk.with_suffix(".asf")
    asf.write_text(asf.read_text() + "\n")
    assert is_new(task)
    walk.write_text(walk.read_text() + "\n")
    assert is_new(task)
    monkeypatch.setattr(keys, "own_code", lambda: "another version")
    assert is_new(task)


def test_a_method_of_the_user_counts_by_its_source(walk, tmp_path, monkeypatch):
    """An edit of the user's own method makes all its results anew."""
    monkeypatch.chdir(tmp_path)
    module = tmp_path / "own_method_of_a_batch.py"
    module.write_text("import sixpoint as sp\nclass Own(sp.SequentialIK): pass\n")
    task = make_task(walk, options={"method": "own_method_of_a_batch:Own"})
    assert run_task(task).status == DONE
    module.write_text(module.read_text() + "# edited\n")
    assert task_key(task) != task.key


@pytest.mark.parametrize("damage", ["result", "gone", "record", "empty"])
def test_what_is_not_whole_is_done_again(walk, damage):
    """A result that was changed or lost, or a damaged record, is no excuse."""
    task = make_task(walk)
    run_task(task)
    before = (task.out / task.target).read_bytes()
    if damage == "result":
        (task.out / task.target).write_bytes(before[:-9])
    elif damage == "gone":
        (task.out / task.target).unlink()
    else:
        record_path(task, task.out).write_text('{"name": 3' if damage == "record" else "{}")
    assert find_done(task) is None
    assert run_task(task).status == DONE
    assert (task.out / task.target).read_bytes() == before


def test_failures_are_outcomes_with_a_reason(walk, monkeypatch):
    """Unreadable, without its ASF, changed meanwhile, or by another version: said, recorded, never raised."""
    bad = walk.with_name("bad.bvh")
    bad.write_text("HIERARCHY\nnonsense")
    alone = walk.parent.parent / "other" / "x_1.amc"
    alone.parent.mkdir()
    alone.write_bytes(walk.read_bytes())
    gone = make_task(bad)
    for task, words in (
        (make_task(bad), "bad.bvh:2"),
        (make_task(alone), "needs its skeleton"),
        (replace(make_task(walk), key="of another content"), "changed while the batch ran"),
        (replace(gone, source=bad.with_name("gone.bvh")), "no such file here"),
        (replace(make_task(walk), code="0.0.1 (abc)"), "started by 0.0.1 (abc)"),
    ):
        outcome = run_task(task)
        assert (outcome.status, outcome.metrics, outcome.files) == (FAILED, {}, {})
        assert words in outcome.error
        assert Outcome.from_json(record_path(task, task.out).read_bytes()) == outcome
        assert find_done(task) is None

    def crash(*_: object) -> None:
        raise ZeroDivisionError("a bug\nof ours")

    monkeypatch.setattr("sixpoint.jobs.batch.reconstructing.run_one", crash)
    assert run_task(make_task(walk)).error == "ZeroDivisionError: a bug of ours"


def test_a_place_that_cannot_be_written_is_a_failure(walk):
    """A file where a folder is needed fails this task, with the reason."""
    task = replace(make_task(walk), target="folder/walk.bvh")
    task = replace(task, key=task_key(task))
    (task.out / "folder").touch()
    assert "folder cannot be made" in run_task(task).error


def test_what_is_said_meanwhile_is_kept(walk, monkeypatch):
    """Warnings and notes of a worker do not get lost, nor onto its stderr."""
    import logging
    import warnings

    def run_one(source: Path, out: Path, options: object) -> dict[str, Any]:
        warnings.warn("looks odd", stacklevel=1)
        logging.getLogger("sixpoint").info("guessed the unit")
        out.touch()
        return {}

    monkeypatch.setattr("sixpoint.jobs.batch.reconstructing.run_one", run_one)
    assert run_task(make_task(walk)).notes == ("looks odd", "guessed the unit")


NUMBERS = st.floats(allow_nan=False) | st.integers(-9, 9) | st.text(max_size=5)
OUTCOMES = st.builds(
    Outcome,
    name=st.text(min_size=1, max_size=9),
    part=st.text(max_size=3),
    status=st.sampled_from([DONE, FAILED]),
    key=st.text(max_size=3),
    error=st.text(max_size=9),
    seconds=st.floats(0, 1e6),
    metrics=st.dictionaries(st.text(min_size=1, max_size=5), NUMBERS, max_size=3),
    files=st.dictionaries(st.text(max_size=3), st.text(max_size=3), max_size=2),
    notes=st.lists(st.text(max_size=3), max_size=2).map(tuple),
)


@given(OUTCOMES)
def test_outcomes_survive_a_file(outcome):
    """A record reads back as it was, whatever names and reasons are."""
    assert Outcome.from_json(outcome.to_json()) == outcome
    assert outcome.to_json().count(b"\n") == 1


def test_the_summary_is_a_table(tmp_path):
    """A line per task; numbers in full, unknown ones empty; columns of all jobs' metrics."""
    rows = [
        Outcome("a", "", DONE, metrics={"position": 0.1 + 0.2, "lost": math.nan}, files={"a.bvh": "x"}),
        Outcome("b\ud800", "sik", FAILED, error='no, "why"', metrics={"other": 1}),
    ]
    path = write_summary(tmp_path, rows)
    first, second = csv.DictReader(path.open(encoding="utf-8"))
    assert float(first["position"]) == 0.1 + 0.2
    assert (first["lost"], first["files"], first["other"]) == ("", "a.bvh", "")
    assert (second["error"], second["status"], second["part"]) == ('no, "why"', FAILED, "sik")


def test_records_have_places_of_their_own(tmp_path):
    """Names in folders and parts with odd signs do not meet."""
    (tmp_path / ".batch" / "records").mkdir(parents=True)
    rows = [Outcome(n, p, DONE) for n in ("a", "x/a", "x/b.bvh") for p in ("", "sik+", "m:C", "m_C", "a/b")]
    for row in rows:
        write_record(tmp_path, row)
    assert sorted(map(str, read_records(tmp_path))) == sorted(map(str, rows))


def test_leftovers_of_a_dead_writer_go(tmp_path):
    """Temporary files of this target go, if they are old enough; all else stays."""
    target = tmp_path / "walk.bvh"
    dead = tmp_path / f".{target.name}.{'0a' * 6}.tmp"
    others = [tmp_path / name for name in (f".walk.amc.{'0a' * 6}.tmp", ".walk.bvh.tmp", "walk.bvh")]
    for path in (dead, *others):
        path.touch()
    remove_leftovers(target, age=3600)
    assert dead.exists()
    remove_leftovers(target)
    assert not dead.exists()
    assert all(path.exists() for path in others)
    remove_leftovers(tmp_path / "absent" / "x")
    dead.touch()
    (tmp_path / "deep").mkdir()
    deep = tmp_path / "deep" / f".a.csv.{'12' * 6}.tmp"
    deep.touch()
    remove_leftovers(tmp_path, age=3600)
    assert dead.exists() and deep.exists()
    remove_leftovers(tmp_path)
    assert [path.exists() for path in (dead, deep, others[0], others[1])] == [False, False, False, True]
    write_files({target: b"x"}, force=True)
    assert leftovers(tmp_path) == [others[1]]


def test_a_comparison_by_parts_is_the_comparison(walk):
    """Rows of single tasks are those that `compare` measures, but for the times."""
    options = {"methods": "sik,kma"}
    job = find_job("compare")
    parts = job.find("parts")
    gather = job.find("gather")
    assert parts is not None and gather is not None
    tasks = [make_task(walk, "compare", options=own, part=part) for part, own in parts(options).items()]
    outcomes = [run_task(task) for task in tasks]
    assert [(outcome.part, outcome.error) for outcome in outcomes] == [("sik", ""), ("kma", "")]
    files = gather(outcomes, {walk.name: walk}, tasks[0].out, options, lambda *_: None)
    assert [path.name for path in files] == ["results.csv", "report.html", "report.md"]
    study = replace(study_of_files([walk]), methods=choose_methods("sik,kma"))
    rows = compare(study, walk.parent.parent / "alone").rows
    written = list(csv.DictReader(files[0].open()))
    assert len(written) == len(rows) == 2
    for row, line in zip(rows, written, strict=True):
        assert (line["clip"], line["method"], line["key"]) == (walk.name, row.method, row.key)
        for name in ("position", "orientation", "residual_max", "jerk_ratio"):
            assert float(line[name]) == getattr(row, name)
    assert "times are of busy cores" in files[2].read_text("utf-8")


def test_every_job_has_its_functions():
    """A job of the registry that is in this version can be run; an unknown one is said."""
    for job in JOBS.values():
        try:
            module = job.load()
        except sp.SixpointError as error:
            assert job.name in str(error)
            continue
        assert callable(module.run_one)
    with pytest.raises(sp.SixpointError, match="reconstruct, track, compare"):
        find_job("dance")


def test_warming_up_says_what_it_compiles(monkeypatch):
    """What a job logs while it compiles is told at once."""
    import logging

    said: list[str] = []
    monkeypatch.setattr(
        "sixpoint.jobs.batch.reconstructing.warm_up",
        lambda options: logging.getLogger("sixpoint").warning("compiling"),
    )
    assert running.warm_up("reconstruct", {}, said.append) >= 0
    assert said == ["compiling"]
