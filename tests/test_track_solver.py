"""Following markers: SciPy places them, and says how near one can get to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.rigid import fit_rigid
from sixpoint.errors import FigureError, SixpointError, TargetError
from sixpoint.kernels.linear import solve_normal
from sixpoint.solvers.tracking.gaps import bridge
from sixpoint.solvers.tracking.limits import widen_limits
from sixpoint.solvers.tracking.priorities import find_parts
from sixpoint.solvers.tracking.solver import LOST, REJECTED, SWAPPED, MarkerTracker
from track_bodies import body, drop, markers_of

FREE = {"feet": 1e3, "pelvis": 1e3, "hands": 1e3, "head": 1e3}


@pytest.fixture(scope="module")
def tracker() -> MarkerTracker:
    return MarkerTracker(body("walk").model)


def joint_errors(result, truth):
    return np.linalg.norm(result.motion.positions - truth.positions, axis=-1)


@pytest.mark.parametrize("name", ["walk", "boxing", "jump_kick", "reach"])
def test_exact_markers_give_back_the_motion(name):
    """Markers placed on a motion of the same figure are followed within millimetres; limits aside."""
    case = body(name)
    result = MarkerTracker(case.model, limits=False).solve_frames(case.markers, case.motion.rate)
    used = case.posed
    assert joint_errors(result, case.motion)[:, used].mean() < 5e-3
    assert np.sqrt(np.mean(result.residual**2)) < 8e-3
    assert not result.flags.any()


def test_one_frame_is_a_least_squares_solution():
    """With noisy markers SciPy, starting from the tracker's pose, finds nothing better than by a percent."""
    case = body("walk", noise=0.01)
    model, skeleton = case.model, case.model.figure.skeleton
    tracker = MarkerTracker(model, limits=False, flext=False, tolerances=FREE, iterations=30, damping=1e-3)
    frame = tracker.solve(case.markers[30])
    for _ in range(20):
        frame = tracker.solve(case.markers[30], frame, 1e-4)
    moving = [int(j) for j, dof in tracker.body.dofs.joints.items() if dof.size == 3]
    pose = frame.pose

    def residuals(x):
        local = pose.rotations.copy()
        turns = Rotation.from_rotvec(x[3:].reshape(-1, 3))
        local[moving] = (turns * Rotation.from_quat(local[moving])).as_quat()
        positions, world = skeleton.compute_transforms(local, pose.translations + x[:3], pose.moving)
        return (model.place(positions, world) - case.markers[30]).ravel()

    start = residuals(np.zeros(3 + 3 * len(moving)))
    best = least_squares(residuals, np.zeros(3 + 3 * len(moving)), max_nfev=30)
    assert np.sum(start**2) < 1.01 * 2 * best.cost


def test_one_at_a_time_is_all_at_once(tracker):
    """``solve`` frame by frame gives the bits of ``solve_frames``, one-sided."""
    case, frame = body("walk"), None
    markers = drop(case.markers, 1)[:40]
    whole = tracker.solve_frames(markers, 60.0, two_sided=False)
    for k, row in enumerate(markers):
        frame = tracker.solve(row, frame, 1 / 60)
        assert np.array_equal(frame.pose.rotations, whole.motion.rotations[k])
        assert np.array_equal(frame.flags, whole.flags[k])


def test_limits_hold_to_the_last_bit():
    """Knees and elbows stay within their ranges though the markers ask for more."""
    case = body("boxing", noise=0.03)
    tracker = MarkerTracker(case.model)
    motion = tracker.solve_frames(case.markers[:120], 60.0, two_sided=False).motion
    states = tracker.body.states_of(motion.rotations, motion.positions[:, tracker.body.base])
    joints = len(motion.skeleton)
    for joint, dof in tracker.body.dofs.joints.items():
        if dof.size in (1, 2):
            angles = states[:, joints + 1 + joint, : dof.size]
            assert np.all(angles >= dof.lower - 1e-6) and np.all(angles <= dof.upper + 1e-6)


def test_feet_come_first():
    """Where two parts contradict each other by decimetres, feet keep their place and the head gives way."""
    case = body("walk")
    markers = case.markers[:1].copy()
    parts = np.array(MarkerTracker(case.model).parts)
    markers[:, parts == "head"] += [0, 0.15, 0]
    tracker = MarkerTracker(case.model, gate=np.inf)
    frame = tracker.solve(markers[0])
    for _ in range(30):
        frame = tracker.solve(markers[0], frame, 0.01)
    off = [frame.residual[parts == part].mean() for part in ("feet", "pelvis", "head")]
    assert off[0] < 0.03 and off[2] > off[0]


def test_a_ghost_is_refused_and_counted(tracker):
    """A marker that jumps 30 cm is refused in these frames only, and moves the pose by millimetres."""
    case = body("walk")
    markers = case.markers.copy()
    markers[100:110, 7] += [0.2, 0.2, 0.1]
    result = tracker.solve_frames(markers, 60.0, two_sided=False)
    assert np.all(result.flags[100:110, 7] == REJECTED) and np.sum(result.flags == REJECTED) == 10
    assert joint_errors(result, case.motion)[:, case.posed].max() < 0.03


def test_swapped_markers_are_found(tracker):
    """Two labels that change places are followed under each other's names, and reported."""
    case = body("walk")
    a, b = (case.model.names.index(name) for name in ("l_heel", "l_toe"))
    markers = case.markers.copy()
    markers[50:80, [a, b]] = markers[50:80, [b, a]]
    result = tracker.solve_frames(markers, 60.0, two_sided=False)
    assert np.all(result.flags[50:80, [a, b]] == SWAPPED)
    assert np.sum(result.flags == SWAPPED) == 60 and not np.any(result.flags == REJECTED)
    assert joint_errors(result, case.motion)[:, case.posed].max() < 0.03


@pytest.mark.parametrize("two_sided", [False, True])
@pytest.mark.parametrize("part", ["l_arm", "r_leg"])
def test_a_lost_limb_does_not_jump(tracker, part, two_sided):
    """A second without a limb's markers: no joint moves 5 cm further in a frame than in the recording."""
    case = body("walk")
    markers = case.markers.copy()
    markers[120:180, case.limb(part)] = np.nan
    result = tracker.solve_frames(markers, 60.0, two_sided=two_sided)
    steps = np.linalg.norm(np.diff(result.motion.positions, axis=0), axis=-1)
    truth = np.linalg.norm(np.diff(case.motion.positions, axis=0), axis=-1)
    assert steps[:, case.posed].max() < max(0.05, truth[:, case.posed].max() + 0.02)


@pytest.mark.parametrize(
    ("name", "part", "start", "two_sided"),
    [
        ("boxing", "l_arm", 89, False),
        ("boxing", "r_arm", 125, False),
        ("boxing", "l_arm", 41, True),
        ("reach", "l_arm", 45, True),
        ("climb_and_hang", "r_leg", 401, False),
        ("climb_and_hang", "l_arm", 225, True),
    ],
)
def test_the_worst_gaps_do_not_jump(name, part, start, two_sided):
    """Gaps of a second that once jumped by up to 120 cm: nothing moves 5 cm further than in the truth."""
    case = body(name, noise=0.001, misplaced=0.008)
    dofs, _ = widen_limits(case.model, case.markers, 60.0)
    markers = case.markers.copy()
    markers[start : start + 60, case.limb(part)] = np.nan
    result = MarkerTracker(case.model, dofs=dofs).solve_frames(markers, 60.0, two_sided=two_sided)
    ours, theirs = (
        np.linalg.norm(np.diff(motion.positions[:, case.posed], axis=0), axis=-1)
        for motion in (result.motion, case.motion)
    )
    assert (ours - theirs).max() < 0.05
    later = joint_errors(result, case.motion)[start + 120 :, case.posed]
    assert later.mean() < 0.02


def test_a_gap_is_crossed_the_shorter_way():
    """SciPy's slerp between the ends lies on the path of a joint that rested on both sides of a gap."""
    case = body("walk")
    tracker = MarkerTracker(case.model)
    body_, joint = tracker.body, case.model.figure.roles.shoulder[0]
    ends = Rotation.from_rotvec([[0.3, 0.2, 0.1], [-1.5, 1.0, 1.4]])
    states = np.tile(body_.rest_state(), (40, 1, 1))
    states[:10, joint], states[10:, joint] = ends[0].as_quat(), -ends[1].as_quat()
    told = np.ones((40, len(body_.tree)), bool)
    told[10:30, joint] = False
    out = Rotation.from_quat(bridge(body_, states, told, body_.rest_state(), 60.0)[:, joint])
    share = (out[10:30] * ends[0].inv()).magnitude() / (ends[1] * ends[0].inv()).magnitude()
    assert np.all(np.diff(share) > 0) and 0 < share[0] < 0.02 and 0.98 < share[-1] < 1
    for k, x in enumerate(share):
        slerp = Rotation.from_rotvec(x * (ends[1] * ends[0].inv()).as_rotvec()) * ends[0]
        assert (slerp.inv() * out[10 + k]).magnitude() < 1e-9


def test_limits_widen_where_markers_contradict_them():
    """An ankle that turns 20 degrees beyond the table is followed, its limits say by how much, knees stay."""
    case = body("jump_kick")
    dofs, grown = widen_limits(case.model, case.markers, 60.0)
    roles, names = case.model.figure.roles, case.model.figure.skeleton.names
    assert np.degrees(grown[names[roles.ankle[0]]]) > 10
    assert not {names[j] for j in roles.knee} & set(grown)
    strict = MarkerTracker(case.model).solve_frames(case.markers, 60.0)
    wide = MarkerTracker(case.model, dofs=dofs).solve_frames(case.markers, 60.0)
    assert np.sqrt(np.mean(wide.residual**2)) < 0.5 * np.sqrt(np.mean(strict.residual**2))
    assert np.all(dofs[roles.knee[0]].lower == case.model.figure.full_dofs()[roles.knee[0]].lower)


@pytest.mark.parametrize(
    "pair", [("l_knee", "r_knee"), ("l_heel", "l_toe"), ("l_head_front", "r_head_front")]
)
def test_labels_swapped_from_the_first_frame_on_are_found(tracker, pair):
    """A pair that begins swapped is exchanged and reported, until it is right."""
    case = body("walk")
    a, b = (case.model.names.index(name) for name in pair)
    markers = case.markers[:90].copy()
    markers[:50, [a, b]] = markers[:50, [b, a]]
    result = tracker.solve_frames(markers, 60.0, two_sided=False)
    assert np.all(result.flags[:50, [a, b]] == SWAPPED) and np.sum(result.flags == SWAPPED) == 100
    assert np.linalg.norm(result.motion.positions - case.motion.positions[:90], axis=-1).max() < 0.03


def test_gaps_cost_little():
    """A fifth of the samples deleted in bursts up to a second: the joint error grows by at most 30 %."""
    case = body("walk", noise=0.001, misplaced=0.008)
    tracker = MarkerTracker(case.model)
    whole = joint_errors(tracker.solve_frames(case.markers, 60.0), case.motion)[:, case.posed].mean()
    gappy = drop(case.markers, 3)
    assert np.isnan(gappy[..., 0]).mean() == pytest.approx(0.2, abs=0.02)
    broken = joint_errors(tracker.solve_frames(gappy, 60.0), case.motion)[:, case.posed].mean()
    assert broken < 1.3 * whole


def test_a_part_without_markers_stays_neutral():
    """Without any marker on the arms these hang, and do not drift."""
    case = body("walk")
    keep = [i for i in range(len(case.model.names)) if i not in (*case.limb("l_arm"), *case.limb("r_arm"))]
    result = MarkerTracker(case.only(keep)).solve_frames(case.markers[:, keep], 60.0)
    figure, positions = case.model.figure, result.motion.positions
    for shoulder, wrist in zip(figure.roles.shoulder, figure.roles.wrist, strict=True):
        assert np.all(positions[:, wrist, 1] < positions[:, shoulder, 1] - 0.4)


def test_nothing_seen_is_survived(tracker):
    """Frames without a single marker, and a recording that begins with some, give finite poses."""
    case = body("walk")
    markers = case.markers[:60].copy()
    markers[:5] = np.nan
    markers[30:40] = np.nan
    result = tracker.solve_frames(markers, 60.0)
    assert np.all(np.isfinite(result.motion.positions)) and np.all(result.flags[:5] == LOST)
    empty = tracker.solve(np.full_like(markers[0], np.nan))
    assert np.all(np.isfinite(empty.pose.rotations)) and np.all(empty.flags == LOST)


def test_one_frame_is_enough(tracker):
    """A recording of a single frame is posed, also when a marker is missing."""
    markers = body("walk").markers[:1].copy()
    assert len(tracker.solve_frames(markers, 100.0).motion) == 1
    markers[0, 3] = np.nan
    assert len(tracker.solve_frames(markers, 100.0).motion) == 1


@given(
    arrays(float, (3, 41, 3), elements=st.floats(allow_nan=True, allow_infinity=True)),
    st.floats(allow_nan=True, allow_infinity=True),
)
@settings(max_examples=25)
def test_no_input_breaks_it(markers, dt):
    """Any numbers give finite poses."""
    tracker, frame = MarkerTracker(body("walk").model), None
    for row in markers:
        frame = tracker.solve(row, frame, dt)
        assert np.all(np.isfinite(frame.pose.rotations)) and np.all(np.isfinite(frame.pose.translations))


def test_the_frame_rate_matters_little():
    """At 30 Hz the same movement is followed, and nothing is refused."""
    case = body("walk")
    result = MarkerTracker(case.model).solve_frames(case.markers[::2], 30.0)
    assert not result.flags.any()
    assert np.linalg.norm(result.motion.positions - case.motion.positions[::2], axis=-1).mean() < 5e-3


def test_rigid_fits_are_those_of_scipy():
    """``fit_rigid`` finds SciPy's aligned rotation; lines and pairs of points give NaN."""
    rng = np.random.default_rng(0)
    local, turn = rng.normal(0, 0.1, (5, 3)), Rotation.random(random_state=1)
    world = turn.apply(local) + [1, 2, 3] + rng.normal(0, 1e-3, (5, 3))
    quat, shift = fit_rigid(local, world)
    known = Rotation.align_vectors(world - world.mean(axis=0), local - local.mean(axis=0))[0]
    assert (known.inv() * Rotation.from_quat(quat)).magnitude() < 1e-9
    assert np.allclose(shift, world.mean(axis=0) - known.apply(local.mean(axis=0)))
    line = np.outer(np.arange(4), [0.1, 0, 0])
    assert np.isnan(fit_rigid(line, line)[0]).all()
    world[2:] = np.nan
    assert np.isnan(fit_rigid(local, world)[0]).all()


def test_parts_follow_from_where_markers_sit():
    """Malleoli are the feet's though the shank carries them; elbows are not the hands'."""
    case = body("walk")
    model = case.model
    places = model.place(*model.figure.neutral_pose.compute_transforms())
    parts = dict(zip(model.names, find_parts(model.figure, model.joints, places), strict=True))
    assert parts["l_ankle"] == parts["l_toe"] == "feet" and parts["l_wrist_a"] == parts["l_hand"] == "hands"
    assert parts["l_elbow"] == parts["l_shank"] == "rest" and parts["l_asis"] == "pelvis"
    assert parts["l_head_front"] == "head"


def test_mistakes_are_named(tracker):
    """Wrong shapes, unknown parts, nonsense options and models without markers are clear errors."""
    model = tracker.model
    with pytest.raises(TargetError, match=r"\(41, 3\)"):
        tracker.solve(np.zeros((5, 3)))
    with pytest.raises(TargetError, match="rate"):
        tracker.solve_frames(np.zeros((1, 41, 3)), 0.0)
    with pytest.raises(SixpointError, match="no part named hand"):
        MarkerTracker(model, priorities={"hand": 0})
    with pytest.raises(SixpointError, match="level of 'feet'"):
        MarkerTracker(model, priorities={"feet": -1})
    with pytest.raises(SixpointError, match="tolerance of 'feet'"):
        MarkerTracker(model, tolerances={"feet": 0.0})
    with pytest.raises(SixpointError, match="iterations"):
        MarkerTracker(model, iterations=0)
    with pytest.raises(SixpointError, match="gate"):
        MarkerTracker(model, gate=-1.0)
    with pytest.raises(FigureError, match="no markers"):
        MarkerTracker(replace(model, names=(), joints=[], offsets=np.zeros((0, 3)), spread=[]))
    other = MarkerTracker(body("walk").only([0, 1, 2, 3]))
    first = other.solve(np.zeros((4, 3)))
    with pytest.raises(SixpointError, match="another model"):
        tracker.solve(np.zeros((41, 3)), first)


def test_markers_of_a_motion_are_where_the_model_says():
    """The test's own placing and ``MarkerModel.place`` agree."""
    case = body("walk")
    assert isinstance(case.model, MarkerModel)
    assert np.allclose(markers_of(case.model, case.motion), case.model.place(*case.motion.transforms))


def test_damped_least_squares_are_those_of_numpy():
    """``solve_normal`` minimises |L y - b|^2 + d^2 |y|^2."""
    rng, count, rank, damping = np.random.default_rng(0), 7, 4, 0.3
    small = np.zeros((2 * count + 3, count))
    left, right = rng.normal(size=(count, rank)), rng.normal(size=count)
    small[:count, :rank], small[-3, :count] = left, right
    solve_normal(small, count, rank, 2 * count, 2 * count + 2, damping)
    stacked = np.vstack([left, damping * np.eye(rank)])
    best = np.linalg.lstsq(stacked, np.append(right, np.zeros(rank)), rcond=None)[0]
    assert np.allclose(small[-1, :rank], best)
