"""Real recordings: every file is reconstructed without help, the paper's clips as well as it says."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import sixpoint as sp
from conftest import recordings
from independent import anatomical, limit_excess, read_bvh_positions, world_matrices
from sixpoint.body.dofs import Ball, Hinges

CLIPS = {
    "17_10.amc": (1.0, 1.0, 0.0),
    "90_05_repaired.bvh": (1.0, 1.0, 0.0),
    "01_03.amc": (0.1, 0.1, 1.0),
}


def load(path: Path, most: int = 400) -> sp.Motion:
    """At most so many frames, spread over the recording."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        motion = sp.load(path)
    return motion.sliced(slice(None, None, max(1, len(motion) // most)))


def load_clip(data: Path, name: str) -> sp.Motion:
    """One of the paper's clips; row 0 of the BVH is an added T-pose."""
    motion = sp.load(data / "paper" / name)
    return motion.sliced(slice(1, None)) if name.endswith(".bvh") else motion


def check_reconstruction(path: Path) -> None:
    motion = load(path)
    figure = sp.Figure.from_motion(motion)
    targets = figure.targets(motion)
    for limits in (False, True):
        solved = sp.SequentialIK(figure, limits=limits).solve_frames(targets)
        errors = sp.compute_errors(figure, motion, solved.motion)
        assert np.isfinite(solved.motion.rotations).all()
        assert solved.motion.skeleton.names == motion.skeleton.names
        assert errors.position < 0.07
        assert errors.orientation < 0.7
        if not limits:
            assert solved.residual.max() < 0.12  # trunk and limbs too short for a stretched pose


@pytest.mark.parametrize("path", recordings("*/*.bvh"))
def test_every_bvh_is_reconstructed(path):
    """Every BVH file gets its anatomy by itself and a reconstruction near the truth."""
    if "stance" in path.name:
        assert len(load(path)) == 2
        return
    check_reconstruction(path)


@pytest.mark.parametrize("path", recordings("*/*.amc"))
def test_every_amc_is_reconstructed(path):
    """Every ASF/AMC file likewise."""
    check_reconstruction(path)


@pytest.mark.parametrize(
    ("limits", "position", "orientation"), [(False, 0.0246, 0.296), (True, 0.0260, 0.300)]
)
def test_the_papers_clips(data, limits, position, orientation):
    """Average errors on the three clips are as good as printed in Table 1 (0.0246, 0.2942)."""
    found = []
    for name, weights in CLIPS.items():
        motion = load_clip(data, name)
        figure = sp.Figure.from_motion(motion)
        result = sp.SequentialIK(figure, weights=weights, limits=limits).solve_motion(figure.targets(motion))
        errors = sp.compute_errors(figure, motion, result)
        assert len(errors.joints) == 22
        found.append((errors.position, errors.orientation))
    mean = np.mean(found, axis=0)
    assert mean[0] <= position
    assert mean[1] <= orientation


@pytest.mark.parametrize("name", CLIPS)
def test_reachable_ends_are_met_where_limits_are_inactive(data, name):
    """Wrists and ankles within the limb's length are met to 1e-6 m in every frame."""
    motion = load_clip(data, name)
    figure = sp.Figure.from_motion(motion)
    targets = figure.targets(motion)
    free = sp.SequentialIK(figure, weights=CLIPS[name], limits=False).solve_frames(targets)
    positions, _ = world_matrices(free.motion)
    for effector, (root, middle, end) in zip((2, 3, 4, 5), figure.roles.limbs, strict=True):
        lengths = [np.linalg.norm(figure.offset_between(a, b)) for a, b in ((root, middle), (middle, end))]
        distance = np.linalg.norm(targets.positions[:, effector] - positions[:, root], axis=1)
        near = (distance <= sum(lengths)) & (distance >= abs(lengths[0] - lengths[1]))
        gap = np.linalg.norm(targets.positions[:, effector] - positions[:, end], axis=1)
        assert near.any() and gap[near].max() < 1e-6


@pytest.mark.parametrize("name", CLIPS)
def test_limits_hold_on_the_papers_clips(data, name):
    """With limits on no posed joint leaves its range in any frame, and the run is the same to the bit."""
    motion = load_clip(data, name)
    figure = sp.Figure.from_motion(motion)
    solver = sp.SequentialIK(figure, weights=CLIPS[name])
    targets = figure.targets(motion)
    result = solver.solve_motion(targets)
    np.testing.assert_array_equal(result.rotations, solver.solve_motion(targets).rotations)
    trunk = {*figure.spine_chain.joints, *figure.roles.clavicle, *figure.roles.shoulder, *figure.roles.hip}
    for joint in sorted(trunk | {*figure.roles.elbow, *figure.roles.knee}):
        dof = figure.dofs[joint]
        parent = int(figure.skeleton.parents[joint])
        if isinstance(dof, Hinges):
            local = anatomical(figure, result, joint, parent)
            angle = np.arctan2(local[:, 2, 1], local[:, 1, 1])
            assert angle.min() > dof.lower[0] - 1e-9 and angle.max() < dof.upper[0] + 1e-9
        elif isinstance(dof, Ball) and dof.limit is not None:
            swing, twist = limit_excess(dof.limit, anatomical(figure, result, joint, parent))
            assert swing.max() < 1e-6 and twist.max() < 1e-6


@pytest.mark.parametrize(
    "name", ["bandai/dataset-1_walk_normal_001.bvh", "xsens/example_2.bvh", "paper/17_10.amc"]
)
def test_written_result_means_the_same_to_another_reader(data, tmp_path, name):
    """A reconstruction written as BVH and read by another reader has its joints within 1e-5 m."""
    motion = load(data / name, 100)
    figure = sp.Figure.from_motion(motion)
    result = sp.SequentialIK(figure).solve_motion(figure.targets(motion))
    sp.save(result, tmp_path / "result.bvh", unit=1.0, up="y")
    found = read_bvh_positions(tmp_path / "result.bvh")
    for joint, joint_name in enumerate(figure.skeleton.names):
        np.testing.assert_allclose(found[joint_name], result.positions[:, joint], atol=1e-5)
