"""The built-in motions are human: within the limits of joints, floor and speed, and free of any solver."""

from pathlib import Path

import numpy as np
import pytest

import sixpoint.samples
from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Ball, Hinges
from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError
from sixpoint.samples import SAMPLES, make_sample
from sixpoint.samples.keyframes import ballistic, curve
from sixpoint.samples.limb import HARD, SOFT, X, Y, Z, compute_pole, limit_reach, solve_two_bones
from sixpoint.samples.tracks import BALL, Foot, compute_ankle

FIGURE = Figure.from_stature(1.75)
MOTIONS = {name: make_sample(name, FIGURE) for name in SAMPLES}
each = pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)


def anatomical(motion):
    above = FIGURE.neutral[np.maximum(FIGURE.skeleton.parents, 0)]
    return rot.mul(rot.mul(above, motion.rotations), rot.inv(FIGURE.neutral))


def excess(dof, local):
    """How far (F,) [rad] rotations (F, 4) are outside of a joint's limits; not positive inside."""
    if isinstance(dof, Hinges):
        angle = 2 * np.arctan2(local[:, :3] @ dof.axes[0], local[:, 3])
        return np.maximum(angle - dof.upper[0], dof.lower[0] - angle)
    limit = dof.limit
    segment = rot.mul_vec(local, limit.axis)
    swing = np.arccos(np.clip(segment @ limit.axis, -1, 1))
    around = np.arctan2(segment @ limit.side, segment @ limit.forward)
    twist = 2 * np.arctan2(local[:, :3] @ limit.axis, local[:, 3])
    twist = (twist + np.pi) % (2 * np.pi) - np.pi
    beyond = np.maximum(twist - limit.twist[1], limit.twist[0] - twist)
    return np.maximum(swing - limit.compute_limit(around), beyond)


@each
def test_joints_stay_within_their_limits(motion):
    """Every joint is inside its limits in 97 % of the frames and never more than 15 degrees outside."""
    local = anatomical(motion)
    for joint, dof in FIGURE.dofs.joints.items():
        if isinstance(dof, Ball) and dof.limit is None:
            continue
        outside = excess(dof, local[:, joint])
        name = FIGURE.skeleton.names[joint]
        assert np.mean(outside > 1e-3) <= 0.03, name
        assert outside.max() < np.radians(15), name


@each
def test_nothing_sinks_below_the_floor(motion):
    """No joint and no site is lower than 2 cm below the floor."""
    sites = FIGURE.skeleton.compute_sites(*motion.transforms)
    assert min(sites[..., 1].min(), motion.positions[..., 1].min()) > -0.02


@each
def test_motion_is_smooth(motion):
    """Joints move slower than 12 m/s and turn less than 25 degrees a frame."""
    speed = np.linalg.norm(np.diff(motion.positions, axis=0), axis=-1) * motion.rate
    turned = rot.angle(rot.mul(rot.inv(motion.rotations[:-1]), motion.rotations[1:]))
    assert speed.max() < 12.0
    assert np.degrees(turned.max()) < 25.0


@each
def test_bones_keep_their_lengths(motion):
    """The distance between a joint and its parent never changes."""
    parents = FIGURE.skeleton.parents[1:]
    bones = np.linalg.norm(motion.positions[:, 1:] - motion.positions[:, parents], axis=-1)
    assert np.ptp(bones, axis=0).max() < 1e-9


@each
def test_motion_is_5_to_10_seconds_at_60_hz(motion):
    """All clips are short and at one rate; every number is finite and every quaternion is unit."""
    assert motion.rate == 60.0
    assert 5.0 <= motion.duration <= 10.0
    assert np.allclose(np.linalg.norm(motion.rotations, axis=-1), 1.0)


@each
def test_motion_moves_what_six_points_do_not_show(motion):
    """Pelvis, spine, both shoulders' girdles, wrists and ankles all turn, by more than 2 degrees."""
    roles = FIGURE.roles
    local = anatomical(motion)
    for joint in (roles.pelvis, roles.spine[1], roles.spine[2], *roles.clavicle, *roles.wrist, *roles.ankle):
        turned = rot.angle(rot.mul(rot.inv(local[0, joint]), local[:, joint]))
        assert np.degrees(turned.max()) > 2.0, FIGURE.skeleton.names[joint]


@pytest.mark.parametrize("name", SAMPLES)
def test_samples_are_deterministic(name):
    """The same name gives the same numbers."""
    again = make_sample(name, FIGURE)
    assert np.array_equal(again.rotations, MOTIONS[name].rotations)
    assert np.array_equal(again.translations, MOTIONS[name].translations)
    assert again.name == name


@pytest.mark.parametrize("name", SAMPLES)
def test_samples_scale_with_the_figure(name):
    """A figure of another stature makes the same movement, larger or smaller."""
    small = make_sample(name, Figure.from_stature(1.40))
    ratio = 1.40 / 1.75
    assert np.allclose(small.positions, MOTIONS[name].positions * ratio, atol=2e-3)


def test_unknown_sample_lists_the_names():
    """A misspelt name is an error that tells the right ones."""
    with pytest.raises(SixpointError, match="boxing, jump_kick, climb_and_hang, walk, reach"):
        make_sample("boxxing")


def test_stance_feet_do_not_slide():
    """While the sole is down in the walk, the ball of the foot stays within 5 mm."""
    motion = MOTIONS["walk"]
    for side in "lr":
        ball = motion.positions[:, FIGURE.skeleton.index(f"{side}_metatarsal")]
        heel = FIGURE.skeleton.site_names.index(f"{side}_heel")
        heel = FIGURE.skeleton.compute_sites(*motion.transforms)[:, heel]
        down = (ball[:, 1] < 0.0105) & (heel[:, 1] < 0.03)
        stances = np.split(np.flatnonzero(down), np.flatnonzero(np.diff(np.flatnonzero(down)) > 1) + 1)
        assert len(stances) >= 4
        for frames in stances:
            assert np.ptp(ball[frames][:, [0, 2]], axis=0).max() < 0.005


def test_walk_has_the_authored_speed():
    """Before the curve the pelvis moves at 1.3 m/s."""
    pelvis = MOTIONS["walk"].root_positions
    assert (pelvis[132, 2] - pelvis[0, 2]) / 2.2 == pytest.approx(1.3, abs=0.03)


def test_hands_hold_the_bar():
    """While hanging, both wrists stay where the bar is, within 2 cm."""
    motion = MOTIONS["climb_and_hang"]
    held = motion.positions[int(4.2 * 60) : int(6.9 * 60)][:, list(FIGURE.roles.wrist)]
    assert np.ptp(held, axis=0).max() < 0.02
    assert held[..., 1].min() > 2.3


def test_jump_is_a_parabola():
    """In the air the pelvis falls with 9.81 m/s^2."""
    height = MOTIONS["jump_kick"].root_positions[107:143, 1]
    assert np.allclose(np.diff(height, 2) * 60**2, -9.81, atol=1e-6)


def test_two_bones_meet_the_end_point():
    """The chain of both bones ends at the given vector, and flexion is about X, never backwards."""
    rng = np.random.default_rng(7)
    vector = rot.unit(rng.normal(size=(200, 3))) * rng.uniform(0.25, 0.55, (200, 1))
    for bend, pole in ((1.0, Z), (-1.0, -Z)):
        towards = compute_pole(rot.unit(vector), -Y, pole, rng.uniform(-1, 1, 200))
        rotation, flexion = solve_two_bones(vector, towards, 0.30, 0.27, bend)
        lower = rot.mul(rotation, rot.from_axis_angle(X, bend * flexion))
        end = rot.mul_vec(rotation, -0.30 * Y) + rot.mul_vec(lower, -0.27 * Y)
        middle = rot.mul_vec(rotation, -0.30 * Y)
        assert np.allclose(end, vector, atol=1e-9)
        assert np.all(np.sum(middle * towards, axis=1) > 0)
        assert np.all(flexion >= 0)


def test_reach_is_limited_smoothly():
    """Near vectors are kept, far ones end just below the limb's length, in the same direction."""
    far = limit_reach(np.array([[0.0, -5.0, 0.0], [0.0, 0.0, SOFT - 0.1]]), 1.0)
    assert SOFT < -far[0, 1] <= HARD
    assert np.allclose(far[1], [0, 0, SOFT - 0.1])


def test_foot_rolls_over_its_ball():
    """A foot whose heel rises keeps its ball in place."""
    turn = np.radians(np.array([[20.0, 0, 0], [20.0, 12, 0], [20.0, 50, 0]]))
    foot = Foot(np.tile([0.3, 0.0, 0.1], (3, 1)), turn, *np.zeros((3, 3)))
    ball = compute_ankle(foot) + rot.mul_vec(rot.from_euler("YXZ", turn), BALL)
    assert np.allclose(ball, ball[0], atol=1e-9)


def test_curves_meet_their_keys_and_do_not_overshoot():
    """A curve goes through its keys, holds its ends and stays between neighbouring keys."""
    at = np.linspace(-1, 4, 501)
    values = curve({0: 0, 1: 1, 2: 1, 3: 0}, at)
    assert values[0] == 0.0
    assert values.max() <= 1.0
    assert np.allclose(values[(at >= 1) & (at <= 2)], 1.0)
    assert np.allclose(curve({0.1: 2, 0.6: 5}, np.array([0.1, 1.1, 0.6, -0.4]), 1.0), [2, 2, 5, 5])
    assert np.allclose(ballistic({0.0: (0, 1), 1.0: (0, -1)}, np.array([0.5])), 0.25)


def test_samples_do_not_use_a_solver():
    """The truth is not made with what it judges: no file of the samples mentions the solvers."""
    for file in Path(sixpoint.samples.__file__).parent.glob("*.py"):
        assert "sixpoint.solvers" not in file.read_text("utf-8")
        assert "sixpoint.kernels" not in file.read_text("utf-8")
