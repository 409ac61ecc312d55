"""The whole way from trackers worn anywhere to a pose, as benchmarks/trackers.py measures it."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import sixpoint as sp

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

import trackers  # noqa: E402

SEED = 3


@pytest.fixture(scope="module")
def way() -> tuple[trackers.Clip, trackers.Worn, dict[str, sp.Targets], sp.Calibration]:
    """Half of the built-in boxing by a person of 1.68 m, at each stage."""
    figure = sp.Figure.from_stature(1.68)
    truth = sp.make_sample("boxing", figure).sliced(slice(0, 240))
    worn = trackers.Worn.draw(SEED)
    return (figure, truth), worn, *trackers.stages((figure, truth), worn, SEED)


@pytest.mark.parametrize("solver", sorted(trackers.SOLVERS))
def test_calibrated_trackers_pose_nearly_as_well_as_exact_joints(way, solver):
    """Calibrate, apply, solve: at most 5 mm of mean joint error and 2 degrees more than from exact joints."""
    clip, _, given, found = way
    exact, chain = (trackers.pose(clip, given[s], solver) for s in (trackers.EXACT, trackers.CHAIN))
    assert found.unobserved == {}
    assert (chain[0] - exact[0]) * clip[0].height < 0.005
    assert chain[1] - exact[1] < np.radians(2)
    smoothed = trackers.pose(clip, given[trackers.SMOOTHED], solver)
    assert smoothed[0] < chain[0]


def test_uncalibrated_trackers_do_not(way):
    """Without calibration the same trackers pose the figure several times worse."""
    clip, worn, given, found = way
    raw = replace(
        found,
        mounts={n: replace(m, offset=np.zeros(3)) for n, m in found.mounts.items()},
    )
    wrong = trackers.pose(clip, raw.apply(worn.report(clip[0].targets(clip[1]))), "sik+")
    assert wrong[0] > 2 * trackers.pose(clip, given[trackers.CHAIN], "sik+")[0]


def test_known_mounts_without_noise_give_the_joints(way):
    """What trackers report is p = joint + R offset and R = segment * mount: taken back, it is the joints."""
    (figure, truth), worn, given, found = way
    back = worn.known(found).apply(worn.report(figure.targets(truth), noise=0.0))
    assert_allclose(back.positions, given[trackers.EXACT].positions, atol=1e-9)
    turned = Rotation.from_quat(back.rotations.reshape(-1, 4)).inv() * Rotation.from_quat(
        given[trackers.EXACT].rotations.reshape(-1, 4)
    )
    assert turned.magnitude().max() < 1e-6


def test_the_recording_has_its_own_noise(way):
    """Noise of 2 mm and 1 degree per axis, drawn anew for every report."""
    (figure, truth), worn, _, _ = way
    joints = figure.targets(truth)
    one, other, clean = worn.report(joints), worn.report(joints), worn.report(joints, noise=0.0)
    assert abs(np.std(one.positions - clean.positions) - 0.002) < 1e-4
    assert abs(np.std(one.positions - other.positions) - 0.002 * np.sqrt(2)) < 1e-4
    turn = Rotation.from_quat(clean.rotations.reshape(-1, 4)).inv() * Rotation.from_quat(
        one.rotations.reshape(-1, 4)
    )
    assert abs(np.std(turn.as_rotvec()) - np.radians(1)) < 1e-3


def test_what_was_not_found_is_lost_or_stands_in(way):
    """`apply` loses a point without an offset and keeps its rotation; a stand-in is the tracker itself."""
    (figure, truth), worn, _, found = way
    head = replace(found.mounts["head"], offset=np.full(3, np.nan))
    found = replace(found, mounts=found.mounts | {"head": head})
    reported = worn.report(figure.targets(truth))
    lost, instead = found.apply(reported), trackers.stand_in(found).apply(reported)
    assert not lost.tracked[:, 1].any()
    assert lost.tracked[:, [0, 2, 3, 4, 5]].all()
    assert np.isfinite(lost.rotations).all()
    assert_allclose(instead.positions[:, 1], reported.positions[:, 1])
    assert np.isfinite(trackers.pose((figure, truth), lost, "sik+")).all()


def test_tables_have_a_row_for_every_stage_and_solver():
    """Both tables on one short clip: all rows, no average of the paper's without its clips."""
    figure = sp.Figure.from_stature(1.75)
    sets = {"walk": [(figure, sp.make_sample("walk", figure).sliced(slice(0, 30)))]}
    exact, chain = trackers.rotations_table(sets), trackers.chain_tables(sets, seeds=1)
    assert exact.count("\n") == 1 + len(trackers.GIVEN) * len(trackers.SOLVERS)
    for stage in trackers.STAGES:
        assert chain.count(f"| {stage} |") == len(trackers.SOLVERS)
    assert trackers.AVERAGE not in exact + chain
    assert "nan" not in exact + chain
