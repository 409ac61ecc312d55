"""Whole batches on processes of this machine, by the command line."""

from __future__ import annotations

import csv
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import sixpoint as sp
from batches import METHODS, leftovers, make_library, records, results
from sixpoint.cli import main
from sixpoint.cli.batch import parse_job
from sixpoint.jobs.batch.job import batch
from sixpoint.jobs.reconstruct import reconstruct
from sixpoint.jobs.solving import Solving


@pytest.fixture
def library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a small library and the methods of ``batches.py``."""
    make_library(tmp_path / "library", ["17/take.bvh", "18/take.bvh", "18/long.amc"])
    (tmp_path / "batch_methods.py").write_text(METHODS)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a batch."""
    capsys.readouterr()
    code = main(["batch", *words])
    out, err = capsys.readouterr()
    assert "Traceback" not in out + err
    return code, out, err


def wait_until_gone(group: int) -> None:
    """No process of a group may be left after a moment."""
    for _ in range(500):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return
        time.sleep(0.02)
    raise AssertionError("workers are left")


def rows(out: str = "out") -> dict[str, dict[str, str]]:
    """Lines of the summary by file."""
    with (Path(out) / "summary.csv").open() as stream:
        return {row["file"]: row for row in csv.DictReader(stream)}


def test_a_batch_does_all_and_goes_on(library, capsys):
    """Good files among bad ones are done, failures named with reasons; a second run does what changed."""
    (library / "library/17/bad.bvh").write_text("HIERARCHY\nnonsense")
    (library / "library/19").mkdir()
    (library / "library/19/x_1.amc").write_bytes((library / "library/18/long.amc").read_bytes())
    words = ["library/**/*.bvh", "library/**/*.amc", "-o", "out", "--method", "sik", "--no-limits"]
    code, out, err = run(capsys, *words, "--workers", "2")
    assert code == 2
    assert err.count("failed: ") == 2
    assert "17/bad.bvh" in err and "bad.bvh:2" in err and "19/x_1.amc" in err and "needs its skeleton" in err
    assert "2 of 5 failed" in err
    assert re.search(r"done +3 in .* by 2 workers", out)
    assert sorted(results(Path("out"))) == ["17/take.bvh", "18/long.bvh", "18/take.bvh"]
    table = rows()
    assert [row["status"] for _, row in sorted(table.items())] == ["failed", "done", "done", "done", "failed"]
    assert table["17/take.bvh"]["position"] != table["18/take.bvh"]["position"]
    for name in ("17/take.bvh", "18/long.amc"):
        alone = library / "alone.bvh"
        solving = Solving("sik", limits=False)
        reconstruct(library / "library" / name, alone, solving=solving, force=True)
        assert alone.read_bytes() == (Path("out") / name).with_suffix(".bvh").read_bytes()
    (library / "library/17/bad.bvh").write_bytes((library / "library/17/take.bvh").read_bytes())
    (library / "library/19/x_1.asf").write_bytes((library / "library/18/long.asf").read_bytes())
    code, out, err = run(capsys, *words)
    assert code == 0, err
    assert re.search(r"done +2 in", out) and re.search(r"known +3", out)
    assert {row["status"] for row in rows().values()} == {"done"}
    before = {name: path.stat().st_mtime_ns for name in results(Path("out")) for path in [Path("out") / name]}
    code, out, _ = run(capsys, *words, "--job", "reconstruct")
    assert code == 0 and re.search(r"known +5", out) and "done  " not in out
    assert before == {name: (Path("out") / name).stat().st_mtime_ns for name in before}


def test_a_worker_that_dies_costs_one_file_at_most(library, capsys):
    """A file whose worker dies twice is given up, one whose worker dies once is done; nothing is left."""
    make_library(library / "library", ["17/poison.bvh", "17/victim.bvh"])
    code, out, err = run(capsys, "library/", "--method", "batch_methods:Deadly", "--workers", "2")
    assert code == 2
    assert "17/poison.bvh: its worker died 2 times (SIGKILL" in err
    assert "17/victim.bvh: its worker died (SIGKILL" in err and "begun again" in err
    assert "1 of 5 failed" in err and "4 in" in out
    assert records(Path("out")) == {
        "17/poison.bvh": "failed",
        **dict.fromkeys(["17/take.bvh", "17/victim.bvh", "18/long.amc", "18/take.bvh"], "done"),
    }
    assert not leftovers(Path("out"))
    assert rows()["17/poison.bvh"]["status"] == "failed"


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_interrupted_it_goes_on(library, capsys):
    """Ctrl-C ends workers too and keeps what is done; the same command does the rest, and only that."""
    make_library(library / "library", [f"17/{k}.bvh" for k in range(6)])
    words = ["library/", "-o", "out", "--method", "batch_methods:Slow", "--workers", "2"]
    command = [sys.executable, "-m", "sixpoint", "batch", *words]
    source = str(Path(sp.__file__).parents[1])
    process = subprocess.Popen(
        command,
        env={**os.environ, "PYTHONPATH": source},
        stderr=subprocess.PIPE,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # ignored in a shell's background
    )
    deadline = time.monotonic() + 60
    while len(records(Path("out"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all
    _, err = process.communicate(timeout=30)
    done = records(Path("out"))
    assert process.returncode == 130, err
    assert b"interrupted" in err and b"goes on from there" in err and b"Traceback" not in err
    assert 2 <= len(done) < 9
    assert not leftovers(Path("out"))
    wait_until_gone(process.pid)
    assert set(rows()) == set(done)
    code, out, _ = run(capsys, *words)
    assert code == 0 and re.search(rf"known +{len(done)}", out)
    assert len(rows()) == 9


def test_other_formats_and_twins(library, capsys):
    """--out-format .amc has its .asf; files that differ in their suffix have results of their own."""
    sp.save_targets(
        sp.Figure.from_stature().targets(sp.make_sample("walk").sliced(slice(0, 9))), "library/17/take.csv"
    )
    code, _, err = run(capsys, "library/17", "-o", "out", "--out-format", ".amc", "--stature", "1.6")
    assert code == 0, err
    assert sorted(results(Path("out"))) == ["take.bvh.amc", "take.bvh.asf", "take.csv.amc", "take.csv.asf"]
    assert len(sp.load("out/take.csv.amc")) == 9
    assert rows()["take.csv"]["position"] == ""


def test_compare_makes_one_report(library, capsys):
    """A row per file and method, one report; a file that cannot be read fails with each."""
    (library / "library/17/bad.bvh").write_text("nonsense")
    words = ["library/17", "--job", "compare", "--methods", "sik,kma", "-o", "report"]
    code, out, err = run(capsys, *words)
    assert code == 2
    assert "bad.bvh, sik" in err and "bad.bvh, kma" in err and "2 of 4 failed" in err
    assert "report.html" in out
    with Path("report/results.csv").open() as stream:
        table = [(row["clip"], row["method"], bool(row["error"])) for row in csv.DictReader(stream)]
    assert table == [(n, m, n == "bad.bvh") for n in ("bad.bvh", "take.bvh") for m in ("sik", "kma")]
    assert "take.bvh" in Path("report/report.md").read_text("utf-8")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["library/**/*.c3d"], "which holds"),
        (["absent/*.bvh"], "does not exist"),
        (["library", "--metod", "sik"], "Unknown option: --metod"),
        (["library", "--method", "magic"], "no method named 'magic'"),
        (["library", "--job", "dance"], "reconstruct, track, compare"),
        (["library", "--workers", "0"], "at least 1"),
        (["library", "--workers", "2", "--scheduler", "tcp://x:1"], "cluster has its own"),
        (["library", "--out-format", ".fbx"], ".bvh, .amc"),
        (["library", "--job", "compare", "--out-format", ".bvh"], "names its files itself"),
        (["library", "-o", "library"], "folder of its own"),
        (["library", "-o", "batch_methods.py"], "this is a file"),
        (["library", "-o", "batch_methods.py/out"], "folder cannot be made"),
        (["library", "-o", "full"], "not empty"),
        (["library", "--skeleton", "absent.asf"], "absent.asf"),
        (["library", "--job", "compare", "--methods", "magic"], "no method named 'magic'"),
        (["library", "--job", "compare", "--study", "paper"], "--study names its own clips"),
        (["library", "--avatar", "hero.glb"], "--avatar does not go with a batch"),
        (["library", "--retarget", "absolute"], "--retarget does not go with a batch"),
        (["library", "--picture", "a.png"], "summary.csv"),
        (["library", "--job", "track", "--avatar", "hero.glb"], "--avatar does not go with a batch"),
        (["library", "--job", "track", "--save-model", "a.toml"], "a person of its own"),
        (["library", "--job", "track", "--report", "r"], "--report does not go with a batch"),
        (["library", "--job", "track", "--live"], "a replay is of one file"),
        (["library", "--job", "track", "--method", "pik"], "add --six"),
        ([], "no files"),
    ],
)
def test_bad_input_is_one_line(library, capsys, words, message):
    """What cannot be is said before anything is done, in one line that names it."""
    (library / "full").mkdir()
    (library / "full" / "letter.txt").touch()
    code, _, err = run(capsys, *words)
    assert code == 2
    assert err.splitlines()[-1].startswith("error: ")
    assert message in err
    assert not (library / "out").exists()


def test_options_of_the_job_are_its_command_s(library):
    """They are read as `sixpoint reconstruct` reads them, before and after files."""
    patterns, options = parse_job(
        "reconstruct", ["--method", "sik", "a/**", "--frames", "-5:", "b", "--rate", "30"]
    )
    assert patterns == ["a/**", "b"]
    assert options == {"method": "sik", "frames": "-5:", "rate": 30.0}
    assert parse_job("compare", ["a", "--no-limits"]) == (["a"], {"no_limits": True})
    assert parse_job("track", ["a", "--six", "--picture", "x.png"])[1] == {
        "six": True,
        "picture": Path("x.png"),
    }
    with pytest.raises(Exception, match="Unknown option"):
        parse_job("reconstruct", ["a", "--out", "x"])  # the batch's own


def test_force_does_all_again(library):
    """From Python: force makes known results anew, and takes a folder over."""
    first = batch(["library/17"], Path("out"), workers=1)
    assert (len(first.outcomes), first.known, first.failures) == (1, 0, ())
    assert batch(["library/17"], Path("out")).known == 1
    again = batch(["library/17"], Path("out"), workers=1, force=True)
    assert again.known == 0
    assert again.outcomes[0].files == first.outcomes[0].files
