"""Mounts and lengths from movement: what is observable is found, what is not is said."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import sixpoint as sp
from sixpoint.calibration.estimate import Estimate
from sixpoint.calibration.lengths import compute_stature
from sixpoint.calibration.pivots import Rest, fit_pivot
from sixpoint.samples.range_of_motion import range_of_motion
from sixpoint.signals.smoothing import smooth

STATURE = 1.68
POSITION, ROTATION = 0.002, np.radians(1.0)
LEGS = ("pelvis", "l_ankle", "r_ankle")


@cache
def movement(seed: int, sloppy: float = 0.03) -> tuple[sp.Figure, sp.Targets]:
    """A person of 1.68 m and the joints of the movement that calibration asks for."""
    figure = sp.Figure.from_stature(STATURE)
    return figure, figure.targets(range_of_motion(figure, seed, sloppy=sloppy))


def track(joints: sp.Targets, seed: int, noise: float = 1.0) -> tuple[sp.Targets, np.ndarray, Rotation]:
    """Trackers at offsets of 2 to 12 cm and any rotation, with noise; SciPy's rotations, not ours."""
    rng = np.random.default_rng(seed)
    points, turned = np.array(joints.positions), np.array(joints.rotations)
    offsets = rng.normal(size=(6, 3))
    offsets *= (rng.uniform(0.02, 0.12, 6) / np.linalg.norm(offsets, axis=1))[:, None]
    mounts = Rotation.random(6, random_state=rng)
    for k in range(6):
        rotation = Rotation.from_quat(turned[:, k]) * mounts[k]
        points[:, k] += rotation.apply(offsets[k])
        errors = Rotation.from_rotvec(rng.normal(scale=noise * ROTATION, size=(len(points), 3)))
        turned[:, k] = (rotation * errors).as_quat()
    points += rng.normal(scale=noise * POSITION, size=points.shape)
    return sp.Targets(points, joints.rate, turned), offsets, mounts


def errors(found: sp.Calibration, offsets: np.ndarray) -> dict[str, float]:
    """Offset errors [m] by effector."""
    return {n: float(np.linalg.norm(found.mounts[n].offset - offsets[k])) for k, n in enumerate(sp.EFFECTORS)}


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_offsets_are_found_to_a_centimetre(seed):
    """With 2 mm and 1 degree of noise and offsets up to 12 cm, all six are found and called observed."""
    figure, joints = movement(seed)
    targets, offsets, _ = track(joints, seed)
    found = sp.calibrate(targets, figure)
    assert max(errors(found, offsets).values()) < 0.01
    assert found.unobserved == {}


@pytest.mark.parametrize("seed", [4, 5])
def test_an_unknown_person_is_measured(seed):
    """Without a figure hands and feet are found as well; pelvis and head are said to be known less well."""
    _, joints = movement(seed)
    targets, offsets, _ = track(joints, seed)
    found = sp.calibrate(targets)
    error = errors(found, offsets)
    assert max(error[name] for name in sp.EFFECTORS if name != "pelvis") < 0.012
    assert error["pelvis"] < 3 * found.mounts["pelvis"].std
    assert set(found.unobserved) == {"pelvis offset", "head offset"}
    assert abs(found.stature - STATURE) < 0.03
    assert abs(found.figure().height / sp.Figure.from_stature(STATURE).height - 1) < 0.02


def test_errors_are_within_three_standard_deviations():
    """The standard deviation means what it says."""
    inside = []
    for seed in range(6):
        figure, joints = movement(seed)
        targets, offsets, _ = track(joints, seed + 50)
        found = sp.calibrate(targets, figure)
        inside += [e < 3 * found.mounts[name].std for name, e in errors(found, offsets).items()]
    assert np.mean(inside) > 0.9


def test_mount_rotations_come_from_the_pose():
    """Standing exactly neutral, mount rotations are found to 3 degrees, the error being one of heading."""
    figure, joints = movement(0)
    targets, _, mounts = track(joints, 7)
    found = sp.calibrate(targets, figure)
    for k, name in enumerate(sp.EFFECTORS):
        wrong = (Rotation.from_quat(found.mounts[name].rotation) * mounts[k].inv()).as_rotvec()
        assert np.linalg.norm(wrong) < np.radians(3)
        assert np.linalg.norm(wrong[[0, 2]]) < np.radians(0.6)  # tilt


def test_a_head_that_is_an_end_site_is_found(data):
    """The head's point may be 17 cm above the joint that it turns about: its offset counts from the point."""
    figure = sp.Figure.from_motion(sp.load(data / "xsens" / "example_2.bvh"))
    assert np.linalg.norm(figure.head_offset) > 0.15
    targets, offsets, _ = track(figure.targets(range_of_motion(figure, 0, sloppy=0.03)), 0)
    assert errors(sp.calibrate(targets, figure), offsets)["head"] < 0.012
    moving = targets.sliced(slice(200, None))  # nobody stands still: no mounts, so the pivot does not tell it
    assert "head offset" in sp.calibrate(moving, figure).unobserved


def test_a_t_pose_turns_the_hands_by_a_quarter():
    """In a T-pose, facing anywhere, all mount rotations differ by the same small error of heading."""
    figure = sp.Figure.from_stature(STATURE)
    turned = np.tile([0.0, 0.0, 0.0, 1.0], (120, len(figure.skeleton), 1))
    for joint, angle in zip(figure.roles.shoulder, (np.pi / 2, -np.pi / 2), strict=True):
        turned[:, joint] = Rotation.from_euler("z", angle).as_quat()
    turned[:, figure.roles.pelvis] = Rotation.from_euler("y", 0.8).as_quat()
    motion = figure.compute_motion(turned, np.zeros((120, 3)), 60.0)
    targets, _, mounts = track(figure.targets(motion), 3, noise=0.0)
    found = sp.calibrate(targets, figure)
    rotations = [Rotation.from_quat(found.mounts[name].rotation) for name in sp.EFFECTORS]
    wrong = [(one * mounts[k].inv()).magnitude() for k, one in enumerate(rotations)]
    assert max(wrong) < np.radians(6)  # offsets of 12 cm turn the line from wrist to wrist
    assert_allclose(wrong, wrong[0], atol=1e-6)


def test_applying_a_calibration_gives_the_joints():
    """Trackers go in, joints and segment rotations come out, frame by frame."""
    figure, joints = movement(1)
    targets, offsets, mounts = track(joints, 1, noise=0.0)
    found = sp.calibrate(targets, figure)
    exact = {
        name: replace(found.mounts[name], offset=offsets[k], rotation=mounts[k].as_quat())
        for k, name in enumerate(sp.EFFECTORS)
    }
    out = replace(found, mounts=exact).apply(targets)
    assert_allclose(out.positions, joints.positions, atol=1e-12)
    assert_allclose(np.abs(np.sum(out.rotations * joints.rotations, axis=-1)), 1.0, atol=1e-12)
    assert np.linalg.norm(found.apply(targets).positions - joints.positions, axis=-1).max() < 0.012


def test_a_turned_world_gives_the_same_calibration():
    """Turning world and person about the vertical changes no offset and no mount rotation."""
    figure, joints = movement(2)
    targets, _, _ = track(joints, 2)
    turn = Rotation.from_euler("y", 1.1)
    turned = sp.Targets(
        turn.apply(np.array(targets.positions).reshape(-1, 3)).reshape(-1, 6, 3) + [2.0, 0.0, -1.0],
        targets.rate,
        (turn * Rotation.from_quat(np.array(targets.rotations).reshape(-1, 4))).as_quat().reshape(-1, 6, 4),
    )
    a, b = sp.calibrate(targets, figure), sp.calibrate(turned, figure)
    for name in sp.EFFECTORS:
        assert_allclose(a.mounts[name].offset, b.mounts[name].offset, atol=1e-6)
        between = (
            Rotation.from_quat(a.mounts[name].rotation) * Rotation.from_quat(b.mounts[name].rotation).inv()
        )
        assert between.magnitude() < 1e-6


def test_a_lost_tracker_costs_only_itself():
    """A hand lost for good is unobserved; gaps of the others are bridged."""
    figure, joints = movement(3)
    targets, offsets, _ = track(joints, 3)
    points = np.array(targets.positions)
    whole = errors(sp.calibrate(targets, figure), offsets)
    points[200:, 2] = np.nan  # after the still pose
    points[::37, 5] = np.nan
    found = sp.calibrate(replace(targets, positions=points), figure)
    error = errors(found, offsets)
    assert np.isnan(error["l_wrist"])
    assert "circle the hand" in found.unobserved["l_wrist offset"]
    assert np.isnan(found.apply(targets).positions[:, 2]).all()
    assert all(abs(error[n] - whole[n]) < 0.01 for n in sp.EFFECTORS if n != "l_wrist")


def test_what_does_not_move_is_not_guessed():
    """From standing alone no offset is handed out, however long one stands."""
    figure, joints = movement(0)
    targets, _, _ = track(joints.sliced(slice(0, 120)), 0)
    found = sp.calibrate(targets, figure)
    assert all(np.isnan(mount.offset).all() for mount in found.mounts.values())
    assert {f"{name} offset" for name in sp.EFFECTORS} <= set(found.unobserved)


@pytest.mark.parametrize("name", sp.SAMPLES)
def test_other_movement_is_not_taken_for_circles(name):
    """Boxing, walking, climbing hold no joint still: nothing is called observed that is wrong by 3 cm."""
    figure = sp.Figure.from_stature(1.75)
    targets, offsets, _ = track(figure.targets(sp.make_sample(name, figure)), 1)
    found = sp.calibrate(targets, figure)
    for effector, error in errors(found, offsets).items():
        assert found.mounts[effector].std > 0.01 or error < 0.03


# --- lengths ---------------------------------------------------------------------------------------


def still(figure: sp.Figure, posture: str) -> sp.Targets:
    """Two seconds of a still pose, positions only, exact."""
    turned = np.tile([0.0, 0.0, 0.0, 1.0], (120, len(figure.skeleton), 1))
    if posture == "t":
        for joint, angle in zip(figure.roles.shoulder, (np.pi / 2, -np.pi / 2), strict=True):
            turned[:, joint] = Rotation.from_euler("z", angle).as_quat()
    place = np.tile([0.3, 1.0, -0.2], (120, 1))
    joints = figure.targets(figure.compute_motion(turned, place, 60.0))
    return replace(joints, rotations=None)


@pytest.mark.parametrize("posture", ["neutral", "t"])
@pytest.mark.parametrize("stature", [1.5, 1.75, 1.95])
def test_lengths_of_an_average_person_are_exact(posture, stature):
    """Without noise stature and all lengths of the built-in figure come back to 1e-6."""
    figure = sp.Figure.from_stature(stature)
    found = sp.calibrate(still(figure, posture))
    truth = sp.Figure.from_stature(stature)
    assert abs(found.stature - stature) < 1e-6
    assert_allclose(found.figure().skeleton.offsets, truth.skeleton.offsets, atol=1e-6)
    assert "mounts" in found.unobserved


def test_a_long_leg_is_measured_not_assumed():
    """Legs and arms that are not average are found; their split is a proportion, and is called so."""
    figure = sp.Figure.from_segments(thigh=0.47, calf=0.46, upper_arm=0.33, forearm=0.29)
    found = sp.calibrate(still(figure, "t"))
    arm = found.segments["upper_arm"] + found.segments["forearm"]
    width = found.segments["torso_width"]
    span = 2 * (0.33 + 0.29) + sp.Figure.from_segments().rest_positions[figure.roles.shoulder[0], 0] * 2
    assert abs(2 * arm + width - span) < 1e-6
    assert "split by proportion" in found.sources["thigh"]
    assert found.sources["foot"] == "proportion"


@given(scale=st.floats(0.8, 1.2))
@settings(max_examples=10)
def test_lengths_scale_with_the_person(scale):
    """Positions times s give lengths times s."""
    joints = still(sp.Figure.from_segments(thigh=0.46, neck=0.16), "neutral")
    a = sp.calibrate(joints)
    b = sp.calibrate(replace(joints, positions=joints.positions * scale))
    assert abs(b.stature - scale * a.stature) < 1e-9
    assert_allclose(list(b.segments.values()), scale * np.array(list(a.segments.values())), atol=1e-9)


def test_stature_is_proportional_to_the_heads_height():
    """The head joint's height over the ankles is a fixed share of the stature."""
    assert abs(compute_stature(1.6) - 2 * compute_stature(0.8)) < 1e-12


# --- clear refusals --------------------------------------------------------------------------------


def test_too_little_is_refused_with_a_reason():
    """Too short, nobody standing, or nothing tracked: the error says what is missing."""
    figure, joints = movement(0)
    with pytest.raises(sp.SixpointError, match="ten seconds"):
        sp.calibrate(joints.sliced(slice(0, 20)))
    lying = joints.positions[..., [1, 0, 2]]
    with pytest.raises(sp.SixpointError, match="standing pose"):
        sp.calibrate(sp.Targets(lying, joints.rate))
    with pytest.raises(sp.SixpointError, match="standing pose"):
        sp.calibrate(sp.Targets(np.full((300, 6, 3), np.nan), 60.0))
    nothing = sp.Targets(np.full((300, 6, 3), np.nan), 60.0, np.full((300, 6, 4), np.nan))
    assert len(sp.calibrate(nothing, figure).unobserved) == 12


# --- parts -----------------------------------------------------------------------------------------


def test_a_pivot_at_rest_is_exact():
    """A tracker that circles about a fixed point is found without noise to 1e-6."""
    t = np.arange(60) / 30
    turns = Rotation.from_euler("xz", np.stack([np.sin(6 * t), np.cos(6 * t)], axis=1) * 0.5)
    offset = np.array([0.05, -0.03, 0.08])
    found = fit_pivot(
        turns.apply(offset) + [1.0, 2.0, 3.0],
        turns.as_matrix(),
        turns.as_matrix(),
        30.0,
        None,
        Rest(0.27, 0.05, 0.02),
    )
    assert found is not None
    assert_allclose(found.offset, offset, atol=1e-6)


def test_a_turn_about_one_axis_is_no_pivot():
    """One axis leaves the offset along it open: no estimate."""
    turns = Rotation.from_euler("x", np.sin(np.arange(60.0)[:, None] / 5.0))
    points = turns.apply([0.05, -0.03, 0.08])
    assert fit_pivot(points, turns.as_matrix(), turns.as_matrix(), 30.0, None, Rest(0.27, 0.05, 0.02)) is None


def test_fused_estimates_are_as_sure_as_they_agree():
    """Two equal estimates have the standard deviation over sqrt 2; contradicting ones a larger one."""
    one = Estimate(np.zeros(3), np.eye(3) / 0.01**2)
    other = Estimate(np.full(3, 0.1), np.eye(3) / 0.01**2)
    assert_allclose(Estimate.fuse([one, one]).std, 0.01 / np.sqrt(2))
    assert Estimate.fuse([one, other]).std > 0.03
    assert Estimate.fuse([]).std == np.inf


def test_smoothing_keeps_what_is_smooth_and_bridges_gaps():
    """Constants stay, noise shrinks, short gaps close, long ones stay open."""
    noisy = np.random.default_rng(0).normal(size=(400, 2))
    assert_allclose(smooth(np.full((50, 2), 3.0), 90.0, 0.05), 3.0)
    assert smooth(noisy, 90.0, 0.05).std() < 0.4
    noisy[100] = np.nan
    noisy[200:300] = np.nan
    out = smooth(noisy, 90.0, 0.05)
    assert np.isfinite(out[90:110]).all()
    assert np.isnan(out[210:290]).all()
