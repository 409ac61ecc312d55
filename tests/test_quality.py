"""The measures of a reconstruction are what they say: known changes give known numbers."""

from __future__ import annotations

from dataclasses import asdict, replace
from math import isnan, nan

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sixpoint as sp
from body_rigs import random_quaternions, reframed
from independent import anatomical, limit_excess, world_matrices
from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Ball, Hinges
from sixpoint.kernels.swing_twist import build_ball_rows, clamp
from sixpoint.signals.contacts import find_contacts
from sixpoint.signals.swivel import compute_swivel_steps
from sixpoint.study.limit_excess import compute_limit_excess
from sixpoint.study.metrics import measured_joints
from sixpoint.study.movement import (
    compute_bend_top,
    compute_local_rotations,
    compute_turning,
    find_swivel_jumps,
)
from sixpoint.study.quality import Quality, measure_quality

FIGURE = sp.Figure.from_stature(1.75)
BOXING = sp.make_sample("boxing", FIGURE).sliced(slice(0, 90))
WALK = sp.make_sample("walk", FIGURE).sliced(slice(0, 150))
LIMITED = [j for j, dof in FIGURE.dofs.joints.items() if isinstance(dof, Ball) and dof.limit is not None]
HINGED = [j for j, dof in FIGURE.dofs.joints.items() if isinstance(dof, Hinges)]


def held(frames: int) -> sp.Motion:
    """One pose of the boxing sample, elbows and knees bent."""
    return replace(
        BOXING, rotations=BOXING.rotations[[7] * frames], translations=BOXING.translations[[7] * frames]
    )


STILL = held(40)


def measure(truth: sp.Motion, result: sp.Motion, figure: sp.Figure = FIGURE) -> Quality:
    return measure_quality(figure, truth, result, figure.targets(truth))


def assert_same(first: Quality, second: Quality) -> None:
    assert asdict(first) == pytest.approx(asdict(second), rel=1e-7, abs=1e-9, nan_ok=True)


def moved(motion: sp.Motion, yaw: object, by: object) -> sp.Motion:
    """Turned about the vertical through the origin by angles, then shifted; numbers or one per frame."""
    turn = Rotation.from_rotvec(np.multiply.outer(np.broadcast_to(yaw, len(motion)), [0.0, 1.0, 0.0]))
    rotations, translations = motion.rotations.copy(), motion.translations.copy()
    rotations[:, 0] = (turn * Rotation.from_quat(rotations[:, 0])).as_quat()
    translations[:, 0] = turn.apply(translations[:, 0]) + by
    return replace(motion, rotations=rotations, translations=translations)


def swivelled(motion: sp.Motion, limb: int, angles: np.ndarray) -> sp.Motion:
    """A limb turned about its line by angles (F,) [rad], its end kept in place."""
    root, _, end = FIGURE.roles.limbs[limb]
    positions, world = world_matrices(motion)
    line = positions[:, end] - positions[:, root]
    turn = Rotation.from_rotvec(line / np.linalg.norm(line, axis=1, keepdims=True) * angles[:, None])
    above = Rotation.from_matrix(world[:, FIGURE.skeleton.parents[root]])
    rotations = motion.rotations.copy()
    rotations[:, root] = (above.inv() * turn * Rotation.from_matrix(world[:, root])).as_quat()
    return replace(motion, rotations=rotations)


def posed(changes: dict[int, np.ndarray], frames: int = 1) -> sp.Motion:
    """The neutral pose with some anatomical local rotations (F, 4)."""
    local = np.tile(rot.IDENTITY, (frames, len(FIGURE.skeleton), 1))
    for joint, quats in changes.items():
        local[:, joint] = quats
    return FIGURE.compute_motion(local, np.tile([0.0, 1.0, 0.0], (frames, 1)), 60.0)


def swing(limit: sp.SwingTwist, theta: object, psi: object) -> Rotation:
    """Rotations that swing the segment by psi towards theta."""
    lean = np.multiply.outer(np.cos(theta), limit.forward) + np.multiply.outer(np.sin(theta), limit.side)
    return Rotation.from_rotvec(np.cross(limit.axis, lean) * np.asarray(psi)[..., None])


# --- the whole -----------------------------------------------------------------------------------


def test_a_motion_against_itself():
    """Identical motions have no residual, a jerk ratio of one, and on both sides the same numbers."""
    for motion in (BOXING, WALK):
        q = measure(motion, motion)
        assert q.residual_mean == q.residual_p95 == q.residual_max == q.missed == 0.0
        assert q.jerk_ratio == 1.0
        for name in ("swivel_jumps", "clavicle", "bend_top", "skate"):
            ours, theirs = getattr(q, name), getattr(q, name + "_truth")
            assert ours == theirs or (isnan(ours) and isnan(theirs))
    assert q.skate > 0.0 and q.clavicle > 0.0 and 0.0 < q.bend_top < 1.0


def test_nothing_depends_on_where_and_whereto():
    """Turned about the vertical and shifted as a whole, everything measures the same."""
    result = sp.SequentialIK(FIGURE).solve_motion(FIGURE.targets(WALK))
    here = measure(WALK, result)
    assert_same(here, measure(*(moved(m, 2.2, [1.5, 0.4, -3.0]) for m in (WALK, result))))
    assert here.residual_max > 0.0 and here.skate > 0.0


def test_nothing_depends_on_the_rigs_frames():
    """The same body and movement on a rig with other axes and rest pose measures the same."""
    result = sp.SequentialIK(FIGURE).solve_motion(FIGURE.targets(WALK))
    frames = random_quaternions(np.random.default_rng(3), len(FIGURE.skeleton))
    truth, same = reframed(WALK, frames), reframed(result, frames)
    figure = replace(FIGURE, skeleton=truth.skeleton, neutral=rot.mul(FIGURE.neutral, frames))
    assert_same(measure(WALK, result), measure(truth, same, figure))
    np.testing.assert_allclose(compute_turning(figure, truth), compute_turning(FIGURE, WALK), atol=1e-9)


def test_local_rotations_by_matrices():
    """On a rig with any axes anatomical local rotations are those by SciPy; the root's against the world."""
    frames = random_quaternions(np.random.default_rng(9), len(FIGURE.skeleton))
    motion = reframed(BOXING, frames)
    figure = replace(FIGURE, skeleton=motion.skeleton, neutral=rot.mul(FIGURE.neutral, frames))
    joints = range(len(figure.skeleton))
    local = compute_local_rotations(figure, motion, joints)
    for joint in joints[1:]:
        expected = anatomical(figure, motion, joint, int(figure.skeleton.parents[joint]))
        np.testing.assert_allclose(Rotation.from_quat(local[:, joint]).as_matrix(), expected, atol=1e-9)
    root = world_matrices(motion)[1][:, 0] @ Rotation.from_quat(figure.neutral[0]).as_matrix().T
    np.testing.assert_allclose(Rotation.from_quat(local[:, 0]).as_matrix(), root, atol=1e-9)


def test_one_frame_and_few():
    """Clips of one to three frames are measured; what needs more frames is NaN, not a warning."""
    for frames in (1, 2, 3):
        motion = BOXING.sliced(slice(0, frames))
        q = measure(motion, sp.SequentialIK(FIGURE).solve_motion(FIGURE.targets(motion)))
        assert isnan(q.jerk_ratio)
        assert q.swivel_jumps == 0
        undefined = {name for name, value in asdict(q).items() if not np.isfinite(value)}
        assert undefined <= {"jerk_ratio", "skate", "skate_truth"}
        assert compute_turning(FIGURE, motion).shape == (frames,)
    one = BOXING.sliced(slice(0, 1))
    assert isnan(measure(one, one).skate)
    assert compute_turning(FIGURE, one).tolist() == [0.0]


def test_other_rigs_and_lengths_are_refused():
    """Motions of another rig, and another number of frames, are errors that say so."""
    rig = sp.Skeleton(("a",), np.array([-1]), np.zeros((1, 3)))
    other = sp.Motion(rig, np.tile(rot.IDENTITY, (90, 1, 1)), np.zeros((90, 1, 3)), 60)
    targets = FIGURE.targets(BOXING)
    for pair in ((BOXING, other), (other, BOXING)):
        with pytest.raises(sp.SkeletonError, match="rig"):
            measure_quality(FIGURE, *pair, targets)
    short = BOXING.sliced(slice(0, 10))
    for given in (
        (short, BOXING, targets),
        (BOXING, short, targets),
        (BOXING, BOXING, FIGURE.targets(short)),
    ):
        with pytest.raises(sp.SkeletonError, match="frames"):
            measure_quality(FIGURE, *given)


# --- residuals -----------------------------------------------------------------------------------


def test_the_residual_is_the_largest_distance_to_a_known_target():
    """Targets moved by 3 cm in 30 of 90 frames, by 0.4 cm in all; a lost one does not count."""
    targets = FIGURE.targets(BOXING)
    points = targets.positions.copy()
    points[:30, 3, 0] += 0.03
    points[:, 5, 1] -= 0.004
    points[:, 1] += 5.0
    points[:, 1, 2] = nan
    q = measure_quality(FIGURE, BOXING, BOXING, replace(targets, positions=points))
    assert q.residual_mean == pytest.approx((30 * 0.03 + 60 * 0.004) / 90)
    assert q.residual_p95 == pytest.approx(0.03)
    assert q.residual_max == pytest.approx(0.03)
    assert q.missed == pytest.approx(1 / 3)


def test_frames_without_targets_do_not_count():
    """Where all six points are lost there is no residual; where they always are, it is undefined."""
    targets = FIGURE.targets(BOXING)
    points = targets.positions + [0.02, 0.0, 0.0]
    points[10:] = nan
    q = measure_quality(FIGURE, BOXING, BOXING, replace(targets, positions=points))
    assert (q.residual_mean, q.missed) == (pytest.approx(0.02), 1.0)
    q = measure_quality(FIGURE, BOXING, BOXING, replace(targets, positions=points * nan))
    assert all(isnan(v) for v in (q.residual_mean, q.residual_p95, q.residual_max, q.missed))


def test_the_solvers_residuals_are_measured():
    """The residual recomputed from the written motion is the one that the solver reports."""
    targets = FIGURE.targets(BOXING)
    solved = sp.SequentialIK(FIGURE).solve_frames(targets)
    q = measure_quality(FIGURE, BOXING, solved.motion, targets)
    worst = np.asarray(solved.residual).max(axis=1)
    assert q.residual_max == pytest.approx(worst.max(), abs=1e-9)
    assert q.residual_mean == pytest.approx(worst.mean(), abs=1e-9)


# --- limits --------------------------------------------------------------------------------------


def test_clamped_rotations_are_inside():
    """What ``clamp`` returns is inside, for random rotations and for limbs close to overhead."""
    rng = np.random.default_rng(0)
    frames = 600
    limits = [FIGURE.dofs[joint].limit for joint in LIMITED]
    rows = build_ball_rows(limits)
    changes = {}
    for b, (joint, limit) in enumerate(zip(LIMITED, limits, strict=True)):
        quats = random_quaternions(rng, frames)
        near = np.pi - np.radians(30) * rng.uniform(0, 1, 300) ** 3
        twist = Rotation.from_rotvec(np.outer(rng.uniform(-3, 3, 300), limit.axis))
        quats[:300] = (swing(limit, rng.uniform(-np.pi, np.pi, 300), near) * twist).as_quat()
        assert _excess_of(joint, quats).max() > 0.3
        changes[joint] = np.array([clamp(rows, b, tuple(q))[0] for q in quats])
    for joint in HINGED:
        angles = rng.uniform(FIGURE.dofs[joint].lower[0], FIGURE.dofs[joint].upper[0], frames)
        changes[joint] = rot.from_axis_angle(FIGURE.dofs[joint].axes[0], angles)
    motion = posed(changes, frames)
    q = measure(motion, motion)
    assert q.limit_worst < 1e-7
    assert q.limit_frames == 0.0


def _excess_of(joint: int, quats: np.ndarray) -> np.ndarray:
    return compute_limit_excess(FIGURE, posed({joint: quats}, len(quats)))[:, joint]


@pytest.mark.parametrize("joint", LIMITED, ids=lambda j: FIGURE.skeleton.names[j])
def test_a_swing_pushed_out_is_measured(joint):
    """A swing 0.1 rad beyond its limit, in any direction, is 0.1 rad out, whatever the allowed twist."""
    limit = FIGURE.dofs[joint].limit
    theta = np.linspace(-np.pi, np.pi, 73)
    theta = theta[limit.compute_limit(theta) < np.radians(140)]
    twist = Rotation.from_rotvec(np.outer(np.resize(0.9 * limit.twist, len(theta)), limit.axis))
    out = swing(limit, theta, limit.compute_limit(theta) + 0.1) * twist
    np.testing.assert_allclose(_excess_of(joint, out.as_quat()), 0.1, atol=1e-9)
    inside = swing(limit, theta, limit.compute_limit(theta) - 1e-9) * twist
    assert _excess_of(joint, inside.as_quat()).max() == 0.0


@pytest.mark.parametrize("joint", LIMITED, ids=lambda j: FIGURE.skeleton.names[j])
def test_a_twist_pushed_out_is_measured(joint):
    """A twist 0.2 rad beyond either end is 0.2 rad out, at any allowed swing; also past half a turn."""
    limit = FIGURE.dofs[joint].limit
    theta = np.linspace(-np.pi, np.pi, 73)
    bent = swing(limit, theta, 0.5 * limit.compute_limit(theta))
    for tau in (limit.twist[0] - 0.2, limit.twist[1] + 0.2):
        twisted = bent * Rotation.from_rotvec(tau * np.array(limit.axis))
        np.testing.assert_allclose(_excess_of(joint, twisted.as_quat()), 0.2, atol=1e-9)
    opposite = 0.5 * limit.twist.sum() + np.pi
    for tau in (opposite - 0.01, opposite + 0.01):
        quat = Rotation.from_rotvec(tau * np.array(limit.axis)).as_quat()[None]
        assert _excess_of(joint, quat) == pytest.approx(np.pi - 0.01 - 0.5 * np.ptp(limit.twist))


@pytest.mark.parametrize("joint", HINGED, ids=lambda j: FIGURE.skeleton.names[j])
def test_a_hinge_pushed_out_is_measured(joint):
    """A hinge 0.3 rad beyond either end of its range is 0.3 rad out."""
    hinge = FIGURE.dofs[joint]
    angles = np.array([hinge.lower[0] - 0.3, hinge.lower[0], 0.5 * hinge.upper[0], hinge.upper[0] + 0.3])
    found = _excess_of(joint, rot.from_axis_angle(hinge.axes[0], angles))
    np.testing.assert_allclose(found, [0.3, 0.0, 0.0, 0.3], atol=1e-9)


def test_an_arm_overhead_and_behind_is_out_by_what_it_is_behind():
    """Five degrees behind straight up is five degrees out; straight up is inside with any twist."""
    joint = FIGURE.roles.shoulder[0]
    behind = Rotation.from_euler("X", 175, degrees=True).as_quat()[None]
    assert _excess_of(joint, behind) == pytest.approx(np.radians(5), abs=1e-9)
    up = Rotation.from_euler("X", 180, degrees=True) * Rotation.from_rotvec([[0, t, 0] for t in range(6)])
    assert _excess_of(joint, up.as_quat()).max() < 1e-6


def test_excess_agrees_with_a_second_computation():
    """On random poses swing and twist excess are those by SciPy matrices, the shorter way round."""
    rng = np.random.default_rng(5)
    motion = posed({joint: random_quaternions(rng, 400) for joint in LIMITED}, 400)
    found = compute_limit_excess(FIGURE, motion)
    for joint in LIMITED:
        limit = FIGURE.dofs[joint].limit
        matrices = anatomical(FIGURE, motion, joint, int(FIGURE.skeleton.parents[joint]))
        out, twist = limit_excess(limit, matrices)
        segment = matrices @ limit.axis
        psi = np.arccos(np.clip(segment @ limit.axis, -1, 1))
        out = np.minimum(out, 2 * np.pi - psi - limit.psi.max())
        twist = np.where(twist > 0, np.minimum(twist, 2 * np.pi - np.ptp(limit.twist) - twist), 0)
        np.testing.assert_allclose(found[:, joint], np.maximum(out, twist), atol=1e-7)
    others = [j for j in range(len(FIGURE.skeleton)) if j not in LIMITED]
    assert not found[:, others].any()


def test_frames_outside_are_counted():
    """One knee 0.2 rad overextended in 9 of 90 frames, 0.05 degrees in all: a tenth, and 0.2 rad."""
    motion = posed({}, 90)
    over = np.full(90, np.radians(0.05))
    over[20:29] = 0.2
    knee = FIGURE.roles.knee[1]
    result = posed({knee: rot.from_axis_angle([1.0, 0, 0], -over)}, 90)
    q = measure(motion, result)
    assert (q.limit_frames, q.limit_worst) == (pytest.approx(0.1), pytest.approx(0.2))


@pytest.mark.parametrize("sample", sorted(sp.SAMPLES))
def test_solved_within_limits_is_measured_within_limits(sample):
    """Sequential IK with limits has no frame outside them; without, the measure can tell."""
    motion = sp.make_sample(sample, FIGURE)
    targets = FIGURE.targets(motion)
    inside = sp.SequentialIK(FIGURE).solve_motion(targets)
    assert measure_quality(FIGURE, motion, inside, targets).limit_frames == 0.0
    tight = sp.Limits({**sp.Limits.default().table, "knee": {"flexion": [0, 1]}})
    outside = measure_quality(FIGURE.with_limits(tight), motion, inside, targets)
    assert outside.limit_frames > 0.5 and outside.limit_worst > 0.1


# --- smoothness and feet -------------------------------------------------------------------------


def test_the_jerk_ratio_is_that_of_third_differences():
    """The ratio agrees with third differences of positions by SciPy matrices; noise raises it."""
    noisy = BOXING.rotations + np.random.default_rng(2).normal(scale=0.01, size=BOXING.rotations.shape)
    result = replace(BOXING, rotations=rot.normalised(noisy))
    jerks = []
    for motion in (BOXING, result):
        p = world_matrices(motion)[0][:, measured_joints(FIGURE)]
        third = p[3:] - 3 * p[2:-1] + 3 * p[1:-2] - p[:-3]
        jerks.append(np.linalg.norm(third, axis=-1).mean())
    assert measure(BOXING, result).jerk_ratio == pytest.approx(jerks[1] / jerks[0])
    assert jerks[1] > 2 * jerks[0]


def test_a_still_truth_has_no_jerk_to_compare_with():
    """Against a truth that stands still the ratio is undefined; a still result has ratio zero."""
    assert isnan(measure(STILL, BOXING.sliced(slice(0, 40))).jerk_ratio)
    assert measure(BOXING.sliced(slice(0, 40)), STILL).jerk_ratio == pytest.approx(0.0, abs=1e-9)


def test_a_foot_that_slides_with_a_known_speed():
    """A drift of 0.6 m/s while the truth stands is 1 cm per frame of 1/60 s; height does not matter."""
    time = np.arange(40) / 60
    drift = np.stack([0.36 * time, np.sin(9 * time), -0.48 * time], axis=-1)
    q = measure(STILL, moved(STILL, 0.0, drift))
    assert q.skate == pytest.approx(0.01)
    assert q.skate_truth == pytest.approx(0.0, abs=1e-12)


def test_only_frames_of_true_contact_count():
    """A drift while the true feet are in the air costs nothing; without a contact nothing is defined."""
    time = np.arange(60) / 60
    fast = np.outer(np.where(time < 0.5, 0.0, 2.0 * (time - 0.5)), [1.0, 0.0, 0.0])
    truth = moved(held(60), 0.0, fast)
    late = np.where(time < 0.7, 0.0, 3.0 * (time - 0.7))
    q = measure(truth, moved(truth, 0.0, np.outer(late, [0.0, 0.0, 1.0])))
    assert q.skate == q.skate_truth
    flying = moved(truth, 0.0, np.outer(5.0 * time, [0.0, 0.0, 1.0]))
    q = measure(flying, truth)
    assert isnan(q.skate) and isnan(q.skate_truth)


def test_skating_frame_by_frame():
    """On a solved walk the skate is the mean of steps that begin and end in contact, by SciPy positions."""
    result = sp.SequentialIK(FIGURE).solve_motion(FIGURE.targets(WALK))
    ankles = list(FIGURE.roles.ankle)
    found = find_contacts(WALK.positions[:, ankles], WALK.rate)
    for motion, name in ((WALK, "skate_truth"), (result, "skate")):
        x, _, z = np.moveaxis(world_matrices(motion)[0][:, ankles], 2, 0)
        ways = [
            np.hypot(x[t, k] - x[t - 1, k], z[t, k] - z[t - 1, k])
            for k in range(2)
            for t in range(1, len(motion))
            if found[t - 1, k] and found[t, k]
        ]
        assert len(ways) > 50
        assert getattr(measure(WALK, result), name) == pytest.approx(np.mean(ways))


# --- swivel --------------------------------------------------------------------------------------


@pytest.mark.parametrize("limb", range(4))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_swivel_flip_is_counted(limb, sign):
    """A flip by 31 degrees counts once, twice when it returns; 29 degrees do not. Found where it is."""
    spun = moved(STILL, np.arange(40) * 0.01, np.outer(np.arange(40), [0.01, 0.0, 0.02]))
    frame = np.arange(40)
    for degrees, count in ((31, 1), (29, 0), (170, 1)):
        for end, times in ((40, 1), (25, 2)):
            flip = sign * np.radians(degrees) * ((frame >= 15) & (frame < end))
            result = swivelled(spun, limb, flip)
            q = measure(spun, result)
            assert (q.swivel_jumps, q.swivel_jumps_truth) == (count * times, 0)
            found = np.argwhere(find_swivel_jumps(FIGURE, result)).tolist()
            assert found == [[15, limb], [25, limb]][: count * times]


@pytest.mark.parametrize(("radius", "defined"), [(0.019, False), (0.021, True)])
def test_straight_limbs_have_no_swivel(radius, defined):
    """A half turn of an elbow counts if its circle is wider than 2 cm in both frames."""
    middle = np.array([[radius, -0.3, 0.0], [-0.1, -0.3, 0.0]])
    for order in (middle, middle[::-1]):
        steps = compute_swivel_steps(np.zeros((2, 3)), order, np.tile([0.0, -0.6, 0.0], (2, 1)))
        assert np.isfinite(steps[0]) == defined
        assert not defined or abs(steps[0]) == pytest.approx(np.pi)


def test_a_line_that_reverses_has_no_swivel():
    """If the line of a limb turns by more than 90 degrees, or has no length, nothing is said."""
    middle, end = np.array([0.2, 0.2, 0.1]), np.array([0.0, 0.5, 0.0])
    for turned, defined in ((80, True), (100, False)):
        turn = Rotation.from_euler("X", [[0], [turned]], degrees=True)
        steps = compute_swivel_steps(np.zeros((2, 3)), turn.apply(middle), turn.apply(end))
        assert np.isfinite(steps[0]) == defined
    assert np.isnan(compute_swivel_steps(np.zeros((2, 3)), np.tile(middle, (2, 1)), np.zeros((2, 3))))[0]


def test_swivel_steps_by_rotation_matrices():
    """Carried by SciPy's shortest rotation of the line, random limbs give the same signed angles."""
    rng = np.random.default_rng(4)
    root = rng.normal(size=(300, 3))
    middle, end = root + rng.normal(size=(300, 3)), root + [0, -1, 0] + 0.4 * rng.normal(size=(300, 3))
    steps = compute_swivel_steps(root, middle, end)
    line = (end - root) / np.linalg.norm(end - root, axis=1, keepdims=True)
    for t in np.flatnonzero(np.isfinite(steps)):
        n, m = line[t], line[t + 1]
        axis = np.cross(n, m)
        axis *= np.arccos(n @ m) / np.linalg.norm(axis)
        carried = Rotation.from_rotvec(axis).apply(middle[t] - root[t])
        goal = Rotation.from_rotvec(steps[t] * m).apply(carried)
        across = [v - (v @ m) * m for v in (goal, middle[t + 1] - root[t + 1])]
        across = [v / np.linalg.norm(v) for v in across]
        np.testing.assert_allclose(*across, atol=1e-7)
    assert np.isfinite(steps).mean() > 0.9


# --- clavicles and trunk -------------------------------------------------------------------------


def test_the_clavicles_angle_is_their_mean():
    """One clavicle shrugged by 0.2 rad in half of the frames is a mean of 0.05 rad; none has none."""
    quats = rot.from_axis_angle([0.0, 0.6, 0.8], np.where(np.arange(40) < 20, 0.2, 0.0))
    q = measure(STILL, posed({FIGURE.roles.clavicle[0]: quats}, 40))
    assert q.clavicle == pytest.approx(0.05)
    bare = replace(FIGURE, roles=replace(FIGURE.roles, clavicle=()))
    assert isnan(measure_quality(bare, STILL, STILL, FIGURE.targets(STILL)).clavicle)


def test_the_share_of_the_upper_trunk():
    """Bending of one joint belongs to its half, of the middle one to both; twist is no bending."""
    chain = FIGURE.spine_chain.joints
    count = len(chain) - 1
    for k, joint in enumerate(chain[1:]):
        where = np.sign(2 * k - (count - 1))
        bend = Rotation.from_rotvec([0.3, 0.0, -0.1]) * Rotation.from_rotvec([0.0, 0.7, 0.0])
        motion = posed({joint: bend.as_quat(), chain[1]: bend.as_quat()} if k else {joint: bend.as_quat()})
        share = compute_bend_top(FIGURE, motion)
        assert share == pytest.approx(0.25 * (1 + where) if k else 0.0, abs=1e-9)
    even = rot.from_axis_angle([1.0, 0.0, 0.0], 0.1)
    assert compute_bend_top(FIGURE, posed(dict.fromkeys(chain[1:], even))) == pytest.approx(0.5)
    twisted = rot.from_axis_angle([0.0, 1.0, 0.0], 0.1)
    assert isnan(compute_bend_top(FIGURE, posed(dict.fromkeys(chain[1:], twisted))))


def test_the_share_by_matrices():
    """On a sample the share is that of angles between the trunk joints' vertical axes, by SciPy matrices."""
    chain = FIGURE.spine_chain.joints
    angles = []
    for below, above in zip(chain[:-1], chain[1:], strict=True):
        local = anatomical(FIGURE, BOXING, above, below)
        angles.append(np.arccos(np.clip(local[:, 1, 1], -1, 1)).sum())
    weights = [np.clip(k + 1 - len(angles) / 2, 0, 1) for k in range(len(angles))]
    assert sorted(set(weights)) in ([0.0, 1.0], [0.0, 0.5, 1.0])
    assert measure(BOXING, BOXING).bend_top == pytest.approx(
        np.dot(angles, weights) / np.sum(angles), rel=1e-6
    )


def test_a_trunk_of_two_joints_has_no_halves():
    """With fewer than two interior joints the share is undefined."""
    short = replace(FIGURE, roles=replace(FIGURE.roles, spine=FIGURE.roles.spine[-2:]))
    assert len(short.spine_chain.joints) < 3
    assert isnan(compute_bend_top(short, BOXING))


# --- turning -------------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [30.0, 120.0])
@pytest.mark.parametrize("speed", [0.0, 1.5, -6.0])
def test_turning_is_the_speed_about_the_vertical(rate, speed):
    """A body that turns evenly has that speed in all frames, standing and lying on its back."""
    frames = 3 * int(rate)
    for lean in (0.0, -90.0, 40.0):
        quat = Rotation.from_euler("X", lean, degrees=True).as_quat()
        motion = replace(posed({FIGURE.roles.pelvis: quat}, frames), rate=rate)
        found = compute_turning(FIGURE, moved(motion, speed * np.arange(frames) / rate, 0.0))
        np.testing.assert_allclose(found, abs(speed), atol=1e-9)


def test_turning_is_held_where_there_is_no_heading():
    """Rolling once about the line of sight, as in a cartwheel, is no turning, though the heading flips."""
    for rate in (30, 120):
        roll = Rotation.from_euler("Z", np.linspace(0, 2 * np.pi, 2 * rate)[:, None])
        tilted = Rotation.from_euler("Y", 0.7) * roll * Rotation.from_euler("X", 0.05)
        motion = replace(posed({FIGURE.roles.pelvis: tilted.as_quat()}, 2 * rate), rate=rate)
        assert compute_turning(FIGURE, motion).max() < 1.0


def test_a_frame_without_a_heading_adds_none():
    """Frames in which the body lies on its side, whatever way it points, are no turning."""
    rotations = Rotation.from_euler("Y", np.full((60, 1), 0.4)).as_quat()
    rotations[[20, 41, 42]] = Rotation.from_euler("YZ", [[2.0, 1.5], [-1.0, 1.45], [3.0, -1.5]]).as_quat()
    motion = posed({FIGURE.roles.pelvis: rotations}, 60)
    np.testing.assert_allclose(compute_turning(FIGURE, motion), 0.0, atol=1e-9)


def test_marker_noise_does_not_look_like_turning():
    """A third of a degree of white noise in the heading at 120 Hz stays below 0.4 rad/s, mostly below 0.1."""
    yaw = np.random.default_rng(6).normal(scale=np.radians(0.33), size=600)
    motion = replace(moved(posed({}, 600), yaw, 0.0), rate=120.0)
    assert compute_turning(FIGURE, motion).max() < 0.4
    assert np.median(compute_turning(FIGURE, motion)) < 0.1


# --- recordings ----------------------------------------------------------------------------------


def test_a_recordings_measures(data):
    """On a slice of the boxing recording everything is finite and plausible."""
    motion = sp.load(data / "paper" / "17_10.amc").sliced(slice(0, 1200, 2))
    figure = sp.Figure.from_motion(motion)
    result = sp.SequentialIK(figure).solve_motion(figure.targets(motion))
    q = measure(motion, result, figure)
    assert np.isfinite(list(asdict(q).values())).all()
    assert q.limit_frames == 0.0 and q.swivel_jumps_truth == 0
    assert 0.0 < q.residual_mean <= q.residual_p95 <= q.residual_max < 0.5
    assert 1.0 < q.jerk_ratio < 3.0
    assert 0.0 < q.skate_truth < 0.25 / motion.rate * 1.5


def test_recordings_of_other_rigs_are_measured(data):
    """Rigs with other trunks, at 30 and 120 Hz, are measured, with the identity as the perfect result."""
    for name in ("bandai/dataset-1_walk_normal_001.bvh", "xsens/example_2.bvh"):
        motion = sp.load(data / name).sliced(slice(0, 300))
        figure = sp.Figure.from_motion(motion)
        q = measure(motion, motion, figure)
        assert q.residual_max == 0.0 and q.jerk_ratio == 1.0
        assert q.skate > 0.0 and 0.0 < q.bend_top < 1.0
        assert np.isfinite(compute_turning(figure, motion)).all()
