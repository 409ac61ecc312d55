"""The FLEXT study writes what it says, and its numbers say what the paper does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sixpoint.cli import main
from sixpoint.errors import FormatError
from sixpoint.jobs.flext_study.job import PICTURES, REPORT, FlextStudy, study_flext
from sixpoint.jobs.flext_study.limb import ITERATIONS


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the study is."""
    return tmp_path_factory.mktemp("place") / "a" / "flext"


@pytest.fixture(scope="module")
def study(folder: Path) -> FlextStudy:
    """The study, run once."""
    said = []
    done = study_flext(folder, progress=lambda *report: said.append(report[1:]))
    assert said[0][0] == 0
    assert said[-1][0] == said[-1][1]
    assert [a for a, _ in said] == sorted(a for a, _ in said)
    return done


def straight(study: FlextStudy, method: str) -> list:
    """Runs from exact full extension."""
    return [run for run in study.limb if run.method == method and not run.bend]


def test_files_are_written(study, folder):
    """Four small pictures and the report that shows them, and nothing else."""
    assert sorted(p.name for p in folder.iterdir()) == sorted([*PICTURES, REPORT])
    assert sorted(study.files) == sorted(folder.iterdir())
    text = (folder / REPORT).read_text("utf-8")
    assert all(f"({name})" in text for name in PICTURES)
    assert sum(p.stat().st_size for p in folder.iterdir()) < 1.5e6
    assert "nan" not in text
    assert max(len(line) for line in text.splitlines() if line[:1] != "|") <= 110


def test_flext_flexes_from_full_extension(study):
    """Within 1 cm after 6 iterations and 1 mm after 12, also to the side; errors always fall."""
    runs = straight(study, "FLEXT")
    assert {run.goal for run in runs} == {"front", "side"}
    for run in runs:
        assert run.errors.shape == (ITERATIONS + 1,)
        assert run.errors[6] < 1e-2
        assert run.errors[12] < 1e-3
        assert np.all(np.diff(run.errors[:12]) < 0)
        assert run.rank == 3


def test_a_plain_constraint_is_stuck(study):
    """The distance along a straight limb never changes: its three rows have rank two."""
    for run in straight(study, "plain"):
        assert run.errors[-1] > 0.16
        assert run.rank == 2
    for run in study.limb:
        if run.bend:
            assert run.errors[-1] < 1e-3, "but a bent limb frees itself"


def test_the_hand_keeps_its_rotation(study):
    """FLEXT leaves room for an orientation constraint."""
    assert study.turned.errors[12] < 1e-3
    assert study.turned_angle < 1e-3


def test_feet_stay_and_knees_do_not_pop(study):
    """With a tracked pelvis feet stay within a millimetre, and knees are as smooth as the true ones."""
    plain, flext = study.kick[:2]
    assert (plain.method, flext.method) == ("plain", "FLEXT")
    for run in (*study.reach[1:3], flext):
        assert run.slip < 1e-3
        assert run.miss < 1e-2
        assert np.abs(run.knees - run.truth).max() < np.radians(0.5)
    true = np.abs(np.diff(flext.truth, 2, axis=0)).max(axis=0) * 3600
    assert np.all(flext.peaks < 2 * true)
    assert np.any(plain.peaks > 3 * true)


def test_a_folder_that_is_not_empty_is_refused(study, folder):
    """Nothing is written over without force, and a file is no folder."""
    before = {p: p.stat().st_mtime_ns for p in folder.iterdir()}
    with pytest.raises(FormatError, match="--force"):
        study_flext(folder)
    with pytest.raises(FormatError, match="folder"):
        study_flext(folder / REPORT)
    assert before == {p: p.stat().st_mtime_ns for p in folder.iterdir()}


def test_command(study, tmp_path, monkeypatch, capsys):
    """The command prints the tables and where the files are; mistakes are one line."""
    monkeypatch.setattr("sixpoint.jobs.flext_study.job.study_flext", lambda out, **_: study)
    monkeypatch.chdir(tmp_path)
    assert main(["study", "flext"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    for word in ("straight", "FLEXT legs", "written to study/flext/", *PICTURES, REPORT):
        assert word in out
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    Path("x").mkdir()
    Path("x/y").touch()
    assert main(["study", "flext", "--out", "x"]) == 2
    err = capsys.readouterr().err
    assert (err.count("\n"), "--force" in err) == (1, True)
