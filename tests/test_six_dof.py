"""Extremities that are turned too: their rows, and SIK+ with measured rotations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import sixpoint as sp
from body_rigs import anatomical, exercise, family_skeleton
from sixpoint.body import rotations as rot
from sixpoint.body.spine_chain import COINCIDENT
from sixpoint.cli import main
from sixpoint.solvers.six_points.model import build_model
from sixpoint.solvers.six_points.packing import LIMB_ROWS, end_row
from sixpoint.study.limit_excess import compute_limit_excess


def without_clavicles() -> sp.Skeleton:
    """A rig whose arms hang on the spine joint that carried the clavicles."""
    rig = family_skeleton("cmu-bvh")
    kept = [j for j, name in enumerate(rig.names) if not name.endswith("Shoulder")]
    parents, offsets = [], []
    for j in kept:
        parent, offset = int(rig.parents[j]), rig.offsets[j].copy()
        while parent >= 0 and parent not in kept:
            offset, parent = offset + rig.offsets[parent], int(rig.parents[parent])
        parents.append(kept.index(parent) if parent >= 0 else -1)
        offsets.append(offset)
    sites = np.array([kept.index(int(j)) for j in rig.site_parents])
    names = tuple(rig.names[j] for j in kept)
    return sp.Skeleton(names, np.array(parents), np.array(offsets), rig.site_names, sites, rig.site_offsets)


FIGURES = {
    "built-in": sp.Figure.from_stature(1.75),
    "no clavicles": sp.Figure.from_skeleton(without_clavicles()),
    "head an end site": sp.Figure.from_skeleton(family_skeleton("xsens")),
}


@pytest.mark.parametrize("name", FIGURES)
def test_only_who_asks_for_them_has_rows_of_the_ends(name):
    """Head, wrists and ankles follow the limbs' rows, and only where they are asked for."""
    figure = FIGURES[name]
    plain, model = build_model(figure), build_model(figure, ends=True)
    s, r = len(plain.segments), figure.roles
    assert len(plain.balls) == s + LIMB_ROWS and plain.row.max() < s + LIMB_ROWS
    assert len(model.balls) == s + LIMB_ROWS + 5
    for end, joint in enumerate((r.head, *r.wrist, *r.ankle)):
        site = joint == r.head and np.linalg.norm(figure.head_offset) > COINCIDENT
        assert model.row[joint] == (plain.row[joint] if site else end_row(s, end))
    others = np.delete(np.arange(len(model.row)), [r.head, *r.wrist, *r.ankle])
    np.testing.assert_array_equal(model.row[others], plain.row[others])


def turning(figure: sp.Figure, seed: int = 0, frames: int = 60) -> sp.Motion:
    """Limbs and trunk sway, and head, hands and feet turn on their own."""
    rng, t = np.random.default_rng(seed), np.linspace(0, 4 * np.pi, frames)
    base = exercise(figure, frames, seed)
    world = anatomical(figure, base)
    parents = np.maximum(figure.skeleton.parents, 0)
    local = rot.mul(rot.inv(world[:, parents]), world)
    local[:, 0] = world[:, 0]
    r = figure.roles
    for joint in (r.head, *r.wrist, *r.ankle):
        waves = np.sin(np.outer(t, [1, 2, 3]) + rng.uniform(0, 6, 3)) * (0.2 if joint == r.head else 0.6)
        local[:, joint] = rot.from_euler("XYZ", waves)
    return figure.compute_motion(local, base.positions[:, r.pelvis], base.rate)


def angles(figure: sp.Figure, motion: sp.Motion, rotations: np.ndarray) -> np.ndarray:
    """(F, 6) angle of each effector's world rotation to the wanted one [rad], by SciPy."""
    found = np.asarray(figure.targets(motion).rotations)
    turn = Rotation.from_quat(found.reshape(-1, 4)).inv() * Rotation.from_quat(rotations.reshape(-1, 4))
    return turn.magnitude().reshape(found.shape[:2])


@pytest.mark.parametrize("named", [sp.EFFECTORS, ("pelvis",), ("head", "r_ankle"), ("l_wrist",)])
@pytest.mark.parametrize("name", FIGURES)
def test_measured_rotations_are_met_exactly(name, named):
    """Without limits every named effector has its measured rotation; the six points are still met."""
    figure = FIGURES[name]
    targets = figure.targets(turning(figure))
    solved = sp.SequentialIKPlus(figure, limits=False, rotations=named).solve_frames(targets)
    off = angles(figure, solved.motion, np.asarray(targets.rotations))
    assert off[:, [sp.EFFECTORS.index(n) for n in named]].max() < 1e-6
    assert np.mean(solved.residual.max(axis=1) < 1e-3) > (0.9 if "pelvis" in named else 0.7)


def test_limits_hold_and_hands_are_met_with_them():
    """Wrists and ankles have no limits: their rotations are met with limits on; the head keeps its own."""
    figure = FIGURES["built-in"]
    targets = figure.targets(turning(figure))
    motion = sp.SequentialIKPlus(figure, rotations=sp.EFFECTORS).solve_motion(targets)
    assert angles(figure, motion, np.asarray(targets.rotations))[:, [0, 2, 3, 4, 5]].max() < 1e-6
    assert compute_limit_excess(figure, motion).max() < 1e-6


@given(st.integers(0, 1000), st.sets(st.sampled_from(sp.EFFECTORS), max_size=5))
@settings(max_examples=20, deadline=None)
def test_only_named_rotations_are_read(seed, named):
    """Whatever the rotations of the other effectors are, the pose is the same to the last bit."""
    figure, rng = FIGURES["built-in"], np.random.default_rng(seed)
    targets = figure.targets(turning(figure, frames=10))
    garbled = np.array(targets.rotations)
    others = [k for k, name in enumerate(sp.EFFECTORS) if name not in named]
    garbled[:, others] = rng.choice([np.nan, 1e9, 0.3], (10, len(others), 4))
    solver = sp.SequentialIKPlus(figure, rotations=tuple(named))
    one, two = (solver.solve_motion(replace(targets, rotations=r)) for r in (targets.rotations, garbled))
    np.testing.assert_array_equal(one.rotations, two.rotations)
    np.testing.assert_array_equal(one.translations, two.translations)


def test_a_frame_without_rotations_is_posed_by_positions():
    """A first frame without rotations is that of positions alone; later ones are met again at once."""
    figure = FIGURES["built-in"]
    targets = figure.targets(turning(figure))
    solver = sp.SequentialIKPlus(figure, limits=False, rotations=sp.EFFECTORS)
    points, unknown = targets.positions[0], np.full((6, 4), np.nan)
    plain = sp.SequentialIKPlus(figure, limits=False).solve(points).pose
    np.testing.assert_allclose(
        solver.solve(points, rotations=unknown).pose.rotations, plain.rotations, atol=1e-12
    )
    gaps = np.array(targets.rotations)
    gaps[20:40] = np.nan
    gaps[45, 1] = 0.0  # no rotation at all
    motion = solver.solve_motion(replace(targets, rotations=gaps))
    assert np.isfinite(motion.rotations).all()
    off = angles(figure, motion, np.asarray(targets.rotations))
    assert np.delete(off, [*range(20, 40), 45], axis=0).max() < 1e-6
    assert off[45, 0] < 1e-6


def test_single_frames_are_the_motion():
    """Frame by frame, with rotations given to each, is the same to the last bit."""
    figure = FIGURES["built-in"]
    targets = figure.targets(turning(figure))
    solver = sp.SequentialIKPlus(figure, rotations=("pelvis", "l_wrist"))
    whole, solution = solver.solve_motion(targets), None
    for k in range(15):
        rotations = np.asarray(targets.rotations)[k]
        solution = solver.solve(targets.positions[k], solution, 1 / targets.rate, rotations=rotations)
        np.testing.assert_array_equal(solution.pose.rotations, whole.rotations[k])


@pytest.mark.parametrize("limits", [True, False])
def test_mirrored_input_gives_the_mirrored_pose(limits):
    """Left and right exchanged, the body is posed as in a mirror."""
    figure = FIGURES["built-in"]
    targets = figure.targets(turning(figure))
    swap, flip = [0, 1, 3, 2, 5, 4], np.array([-1.0, 1.0, 1.0])
    turned = np.asarray(targets.rotations)[:, swap] * [1, -1, -1, 1]
    there = replace(targets, positions=targets.positions[:, swap] * flip, rotations=turned)
    solver = sp.SequentialIKPlus(figure, limits=limits, rotations=sp.EFFECTORS)
    one, two = solver.solve_motion(targets).positions, solver.solve_motion(there).positions
    r = figure.roles
    pairs = (r.shoulder, r.elbow, r.wrist, r.hip, r.knee, r.ankle)
    left, right = [pair[0] for pair in pairs], [pair[1] for pair in pairs]
    trunk = list(r.spine)
    np.testing.assert_allclose(two[:, right] * flip, one[:, left], atol=1e-6)
    np.testing.assert_allclose(two[:, left] * flip, one[:, right], atol=1e-6)
    np.testing.assert_allclose(two[:, trunk] * flip, one[:, trunk], atol=1e-6)


def test_rotations_bring_the_body_nearer_to_the_truth(data):
    """On recordings its constants never saw, each measured rotation more is a smaller orientation error."""
    for path in (data / "cmu" / "14_02.amc", data / "bandai" / "dataset-1_walk_normal_001.bvh"):
        motion = sp.load(path)
        motion = motion.sliced(slice(0, min(600, len(motion))))
        figure = sp.Figure.from_motion(motion)
        targets = figure.targets(motion)
        found = [
            sp.compute_errors(
                figure,
                motion,
                sp.SequentialIKPlus(figure, limits=False, rotations=named).solve_motion(targets),
            )
            for named in ((), ("pelvis",), sp.EFFECTORS)
        ]
        assert found[0].orientation > found[1].orientation > found[2].orientation
        assert found[0].position > found[1].position


def test_missing_and_unknown_rotations_are_errors():
    """Rotations that are asked for and missing, effectors that do not exist, methods that use none."""
    figure = FIGURES["built-in"]
    targets = figure.targets(turning(figure, frames=5))
    solver = sp.SequentialIKPlus(figure, rotations=("head", "pelvis"))
    assert solver.rotations == ("pelvis", "head")
    with pytest.raises(sp.TargetError, match="rotations of pelvis, head"):
        solver.solve_motion(replace(targets, rotations=None))
    with pytest.raises(sp.TargetError, match="rotations of pelvis, head"):
        solver.solve(targets.positions[0])
    gone = np.array(targets.rotations)
    gone[:, 1] = np.nan
    with pytest.raises(sp.TargetError, match="no rotation of head"):
        solver.solve_motion(replace(targets, rotations=gone))
    with pytest.raises(sp.TargetError, match="rotations must be"):
        solver.solve(targets.positions[0], rotations=np.zeros((5, 4)))
    with pytest.raises(sp.SixpointError, match=r"no effector named nose.*l_wrist"):
        sp.SequentialIKPlus(figure, rotations=("nose",))
    with pytest.raises(sp.SixpointError, match=r"'sik' has no option rotations; .*sik\+"):
        sp.make_solver("sik", figure, rotations=("head",))


def test_the_command_line_takes_rotations(tmp_path, monkeypatch, capsys):
    """--rotations of a recording or of points; other methods, and points without them, are refused."""
    monkeypatch.chdir(tmp_path)
    figure = FIGURES["built-in"]
    motion = turning(figure, frames=8)
    sp.save(motion, "turning.bvh")
    sp.save_targets(replace(figure.targets(motion), rotations=None), "points.csv")
    words = ["reconstruct", "turning.bvh", "--method", "sik+", "--no-limits", "-o", "x.bvh", "--force"]
    assert main([*words, "--rotations", "all"]) == 0
    off = angles(figure, sp.load("x.bvh"), np.asarray(figure.targets(motion).rotations))
    assert off.max() < 1e-3
    assert main([*words, "--rotations", "pelvis, head"]) == 0
    for wrong, message in (
        (["reconstruct", "turning.bvh", "--method", "sik", "--rotations", "head"], "sik+"),
        ([*words, "--rotations", "nose"], "l_wrist"),
        (["reconstruct", "points.csv", "--method", "sik+", "--rotations", "head"], "rotations of head"),
    ):
        capsys.readouterr()
        assert main(wrong) == 2
        assert message in capsys.readouterr().err
