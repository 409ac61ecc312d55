"""What is switched off in docs/results.md, and the moments of the jump kick."""

from __future__ import annotations

import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import sixpoint as sp
from sixpoint.study.metrics import measured_joints

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

import ablation  # noqa: E402
import kick  # noqa: E402
from marked import rewrite  # noqa: E402


def test_every_constant_is_switched_off_alone():
    """Each habit has a row of its own; two sides of a share are two rows."""
    alone = {
        name for rows in ablation.VARIANTS.values() for v in rows if len(v.habits) == 1 for name in v.habits
    }
    assert alone == {field.name for field in fields(sp.Habits)}


def test_rows_are_measured_like_the_library_does():
    """The errors of a row are those of its solver, limits off and without rotations unless it says so."""
    figure = sp.Figure.from_stature(1.75)
    recordings = []
    for column, sample in zip(ablation.SETS, ("walk", "boxing", "reach"), strict=True):
        truth = sp.make_sample(sample, figure).sliced(slice(0, 60))
        recordings.append(ablation.Recording(column, figure, truth, figure.targets(truth), sp.FIGHTING))
    for variant, solver in (
        (ablation.FULL, sp.SequentialIKPlus(figure, limits=False)),
        (
            ablation.off("x", reach=0.0),
            sp.SequentialIKPlus(figure, limits=False, habits=sp.Habits(reach=0.0)),
        ),
        (ablation.Variant("x", method="sik"), sp.SequentialIK(figure, limits=False, weights=sp.FIGHTING)),
        (ablation.Variant("x", limits=True), sp.SequentialIKPlus(figure)),
        (
            ablation.off_turned("x", head_hold=0.0),
            sp.SequentialIKPlus(
                figure, limits=False, habits=sp.Habits(head_hold=0.0), rotations=sp.EFFECTORS
            ),
        ),
    ):
        found, shaken = ablation.measure(variant, recordings), []
        for own, r in zip(found[:-1], recordings, strict=True):
            turned = r.targets.rotations if variant.rotations else None
            result = solver.solve_motion(sp.Targets(r.targets.positions, r.targets.rate, turned))
            errors = sp.compute_errors(figure, r.truth, result)
            assert own == pytest.approx([errors.position, errors.orientation], abs=1e-12)
            own, true = (m.positions[:, measured_joints(figure)] for m in (result, r.truth))
            off = (own[2:] - 2 * own[1:-1] + own[:-2]) - (true[2:] - 2 * true[1:-1] + true[:-2])
            size = np.sqrt((off**2).sum(axis=-1)) * r.truth.rate**2
            shaken.append([size.mean(), np.sqrt((size**2).mean())])
        assert found[-1] == pytest.approx(np.mean(shaken, axis=0))


def test_moments_of_a_jump_are_in_order():
    """Feet that leave the floor at 1 s and land at 1.5 s, the left one highest at 1.2 s; a hop before."""
    times = np.arange(240) / 120
    points = np.zeros((240, 6, 3))
    points[:, 4:, 1] = 0.1
    air = np.clip(1 - np.abs(times - 1.25) / 0.25, 0, 1)
    points[:, 4, 1] += 2.0 * np.clip(1 - np.abs(times - 1.2) / 0.2, 0, 1) + 0.2 * (air > 0)
    points[:, 5, 1] += 0.5 * (air > 0) + 0.3 * np.clip(1 - np.abs(times - 0.5) / 0.1, 0, 1)
    points[:, 4, 1] += 0.3 * np.clip(1 - np.abs(times - 0.5) / 0.1, 0, 1)
    moments = kick.find_moments(points)
    assert moments.names == ("turning hop", "take-off", "spin", "kick", "landing")
    np.testing.assert_allclose(times[list(moments.frames)], [0.5, 1.0, 1.1, 1.2, 1.5], atol=0.02)


def test_the_kick_is_drawn(data, tmp_path):
    """The picture is made, and what is said of it has the numbers of both methods."""
    said = kick.draw(data / "paper" / "90_05_repaired.bvh", tmp_path / "kick.png")
    assert (tmp_path / "kick.png").stat().st_size > 50_000
    assert all(f"error of `{method}` is highest at" in said for method in kick.METHODS)


def test_marked_parts_are_replaced_and_nothing_else(tmp_path):
    """Text outside the marks stays; a missing mark ends the run and changes nothing."""
    page = tmp_path / "page.md"
    page.write_text("a\n<!-- x: begin -->\nold\n<!-- x: end -->\nb\n<!-- y: begin -->\n<!-- y: end -->\n")
    rewrite(page, {"x": "new", "y": "other"})
    text = "a\n<!-- x: begin -->\nnew\n<!-- x: end -->\nb\n<!-- y: begin -->\nother\n<!-- y: end -->\n"
    assert page.read_text() == text
    with pytest.raises(SystemExit, match="z: begin"):
        rewrite(page, {"x": "newer", "z": "?"})
    assert page.read_text() == text
