"""The study that fits the prior: its input, its card and, where PyTorch is there, the fit itself."""

from __future__ import annotations

import builtins

import numpy as np
import pytest

import sixpoint as sp
from sixpoint.cli import main
from sixpoint.jobs import prior_study
from sixpoint.jobs.prior_study import Score, find_recordings, shipped_recordings, study_prior


@pytest.fixture
def folder(tmp_path):
    """Two people of the built-in figure: cmu/02 by a listed trial and one that is not, and a data set."""
    figure = sp.Figure.from_stature(1.75)
    for name in ("cmu/02_01.amc", "cmu/02_99.amc", "cmu/77_01.amc", "mine/walk.bvh"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        sp.save(sp.make_sample("walk", figure).sliced(slice(0, 40)), path, force=True)
        if path.suffix == ".amc":
            path.with_suffix(".asf").replace(path.with_name(f"{path.stem[:2]}.asf"))
    return tmp_path


def test_recordings_are_those_of_the_list(folder):
    """Of people the shipped prior was fitted on the listed trials, of others all; also without a folder."""
    assert [p.name for p in find_recordings(folder, "cmu/02")] == ["02_01.amc"]
    assert [p.name for p in find_recordings(folder / "cmu", "cmu/77")] == ["77_01.amc"]
    assert [p.name for p in find_recordings(folder, "mine")] == ["walk.bvh"]
    assert find_recordings(folder, "cmu/05") == []
    assert set(shipped_recordings()) == set(sp.SequentialIKPrior.fitted_on)


def test_the_list_is_what_the_shipped_prior_saw(data):
    """Every listed recording is there, and nobody whom a figure is reported of."""
    for person in sp.SequentialIKPrior.fitted_on:
        assert len(find_recordings(data, person)) == len(shipped_recordings()[person])
    assert not set(shipped_recordings()) & {"cmu/01", "cmu/14", "cmu/17", "cmu/90", "bandai", "xsens"}


def test_without_pytorch_the_study_says_how_to_get_it(folder, tmp_path, monkeypatch, capsys):
    """The rest of sixpoint needs no PyTorch; fitting names the extra."""
    real = builtins.__import__

    def refuse(name, *args, **kwargs):
        if name.split(".")[0] == "torch" or name == "sixpoint.study.prior.fitting":
            raise ImportError("No module named 'torch'")
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(sp.SixpointError, match=r"sixpoint\[fit\]"):
        study_prior(tmp_path / "out", folder, people=["cmu/02"])
    assert main(["study", "prior", "--data", str(folder), "--out", str(tmp_path / "out")]) == 2
    assert "sixpoint[fit]" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_scores_say_whom_the_prior_knows():
    """A row of the card."""
    row = Score("cmu/02", True, 7, ((0.0281, 0.331), (0.02, 0.3)))
    assert row.cells == ["cmu/02 (fitted on)", "7", "0.0281 / 0.331", "0.0200 / 0.300"]
    assert Score("cmu/14", False, 5, ()).cells == ["cmu/14", "5"]


def test_the_card_that_ships_is_of_the_shipped_people():
    """docs/prior.md names everybody the prior was fitted on."""
    card = (prior_study.Path(__file__).resolve().parents[1] / "docs" / "prior.md").read_text("utf-8")
    for person in sp.SequentialIKPrior.fitted_on:
        assert f"| {person} (fitted on) |" in card


def test_a_fit_can_be_repeated(folder, tmp_path):
    """The same seed gives the same numbers, another one others; the solver takes them."""
    pytest.importorskip("torch", reason="fitting needs PyTorch: pip install 'sixpoint[fit]'")
    found = []
    for name, seed in (("a", 0), ("b", 0), ("c", 1)):
        study_prior(tmp_path / name, folder, people=["cmu/02", "mine"], steps=2, seed=seed)
        with np.load(tmp_path / name / "prior.npz") as arrays:
            found.append({key: arrays[key].copy() for key in arrays.files})
    for key in found[0]:
        np.testing.assert_array_equal(found[0][key], found[1][key])
    assert any(np.any(found[0][key] != found[2][key]) for key in found[0])
    figure = sp.Figure.from_stature(1.75)
    targets = figure.targets(sp.make_sample("walk", figure))
    solver = sp.SequentialIKPrior(figure, prior=tmp_path / "a" / "prior.npz")
    assert np.isfinite(solver.solve_motion(targets).rotations).all()
    with pytest.raises(sp.SixpointError, match="no recording of cmu/05"):
        study_prior(tmp_path / "d", folder, people=["cmu/05"])
