"""Facts that hold for every solver: posed six points in, a whole pose out, whatever the input."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

import sixpoint as sp
from independent import anatomical, limit_excess, world_matrices
from sixpoint.body.dofs import Ball, Hinges

FIGURE = sp.Figure.from_stature(1.75)
NAMES = sorted(sp.SOLVERS)
MET = {"sik": 1e-9, "pik": 1.1e-3, "pik-flext": 1.1e-3}
"""Distance [m] at which a method counts a point as met: prioritized IK stops iterating at 1 mm."""
REST = {"sik": 1e-12, "pik": 5e-3, "pik-flext": 5e-3}
"""1 - cos(half angle) that the neutral pose may be off: prioritized IK relaxes elbows and knees."""
STRETCHED = {"sik": 1e-6, "pik": 4e-2, "pik-flext": 4e-2}
"""How far the unit vector along a stretched limb may be off."""
SETTLED = {"sik": 1, "pik": 60, "pik-flext": 60}
"""Frames after which a method stands still before a world that no pose can meet."""
SCALED = {"sik": 1e-5, "pik": 0.02, "pik-flext": 0.2}
"""Angle [rad] by which the pose of a scaled body may differ: thresholds are in metres."""
MIRROR = np.diag([-1.0, 1.0, 1.0])
SWAPPED = [0, 1, 3, 2, 5, 4]


def points_of(figure: sp.Figure) -> np.ndarray:
    """The six points of the neutral pose."""
    roles = figure.roles
    points = figure.rest_positions[[roles.pelvis, roles.head, *roles.wrist, *roles.ankle]].copy()
    points[1] += figure.head_offset
    return points


def measured(figure: sp.Figure, motion: sp.Motion) -> np.ndarray:
    """Where the effectors of a motion are (F, 6, 3), by independent forward kinematics."""
    positions, _ = world_matrices(motion)
    roles = figure.roles
    return positions[:, [roles.pelvis, roles.head, *roles.wrist, *roles.ankle]]


def as_motion(figure: sp.Figure, solution: sp.Solution) -> sp.Motion:
    return sp.Motion.from_poses([solution.pose], 60.0)


@pytest.fixture(scope="module")
def clips() -> dict[str, tuple[sp.Motion, sp.Targets]]:
    motions = {name: sp.make_sample(name, FIGURE) for name in sp.SAMPLES}
    return {name: (motion, FIGURE.targets(motion)) for name, motion in motions.items()}


@pytest.mark.parametrize("limits", [True, False])
@pytest.mark.parametrize("name", NAMES)
def test_neutral_points_give_the_neutral_pose(name, limits):
    """The neutral pose's own points give the neutral pose back."""
    solution = sp.make_solver(name, FIGURE, limits=limits).solve(points_of(FIGURE))
    assert solution.status is sp.Status.CONVERGED
    np.testing.assert_allclose(np.abs(solution.pose.rotations[:, 3]), 1.0, atol=REST[name])
    np.testing.assert_allclose(solution.residual, 0.0, atol=max(1e-12, MET[name] if name != "sik" else 0.0))


@pytest.mark.parametrize("name", NAMES)
def test_reachable_points_are_met(name, clips):
    """Without limits, wrists and ankles within the limb's length of its root are met."""
    for _, targets in clips.values():
        solved = sp.make_solver(name, FIGURE, limits=False).solve_frames(targets)
        positions, _ = world_matrices(solved.motion)
        ends = measured(FIGURE, solved.motion)
        for effector, (root, middle, end) in zip((2, 3, 4, 5), FIGURE.roles.limbs, strict=True):
            reach = np.linalg.norm(FIGURE.offset_between(root, middle))
            reach += np.linalg.norm(FIGURE.offset_between(middle, end))
            goal = targets.positions[:, effector]
            near = np.linalg.norm(goal - positions[:, root], axis=1) <= reach
            assert near.mean() > 0.6
            gap = np.linalg.norm(ends[:, effector] - goal, axis=1)
            assert gap[near].max() < MET[name]


@pytest.mark.parametrize("limits", [True, False])
@pytest.mark.parametrize("name", NAMES)
def test_residuals_are_what_forward_kinematics_measures(name, limits, clips):
    """The reported residual is the distance between target and effector of the written rotations."""
    for _, targets in clips.values():
        solved = sp.make_solver(name, FIGURE, limits=limits).solve_frames(targets)
        gap = np.linalg.norm(measured(FIGURE, solved.motion) - targets.positions, axis=-1)
        np.testing.assert_allclose(solved.residual, gap, atol=1e-9)
        expected = np.where((gap > 0.01).any(axis=1), sp.Status.UNREACHABLE, sp.Status.CONVERGED)
        np.testing.assert_array_equal(solved.status, expected)


@pytest.mark.parametrize("name", NAMES)
def test_limits_hold(name, clips):
    """With limits on no joint leaves its range, by rotation matrices and SciPy's spline."""
    parents = FIGURE.skeleton.parents
    for _, targets in clips.values():
        motion = sp.make_solver(name, FIGURE, limits=True).solve_motion(targets)
        for joint, dof in FIGURE.dofs.joints.items():
            if isinstance(dof, Ball) and dof.limit is None:
                continue
            local = anatomical(FIGURE, motion, joint, int(parents[joint]))
            if isinstance(dof, Hinges):
                vector = Rotation.from_matrix(local).as_rotvec()
                np.testing.assert_allclose(vector[:, 1:], 0.0, atol=1e-9)
                assert vector[:, 0].min() > dof.lower[0] - 1e-9
                assert vector[:, 0].max() < dof.upper[0] + 1e-9
            else:
                swing, twist = limit_excess(dof.limit, local)
                assert swing.max() < 1e-6 and twist.max() < 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_unreachable_points_stretch_the_limb(name):
    """A wrist or ankle target out of reach gives a straight limb towards it, and says so."""
    points = points_of(FIGURE)
    points[2] += [2.0, 0.5, 1.0]
    points[5] += [-1.0, -2.0, 0.5]
    solver, solution = sp.make_solver(name, FIGURE, limits=False), None
    for _ in range(SETTLED[name]):
        solution = solver.solve(points, previous=solution)
    assert solution.status is sp.Status.UNREACHABLE
    positions = as_motion(FIGURE, solution).positions[0]
    for effector, limb in ((2, 0), (5, 3)):
        root, middle, end = positions[list(FIGURE.roles.limbs[limb])]
        direction = (points[effector] - root) / np.linalg.norm(points[effector] - root)
        for segment in (middle - root, end - middle):
            np.testing.assert_allclose(segment / np.linalg.norm(segment), direction, atol=STRETCHED[name])


@pytest.mark.parametrize("limits", [True, False])
@pytest.mark.parametrize("name", NAMES)
def test_mirrored_points_give_the_mirrored_pose(name, limits, clips):
    """Left and right are treated alike."""
    for _, targets in clips.values():
        solver = sp.make_solver(name, FIGURE, limits=limits)
        plain = solver.solve_motion(targets).positions
        flipped = sp.Targets((targets.positions @ MIRROR)[:, SWAPPED], targets.rate)
        mirrored = solver.solve_motion(flipped).positions
        names = FIGURE.skeleton.names
        other = {"l": "r", "r": "l"}
        twin = [names.index(other[n[0]] + n[1:]) if n[:2] in ("l_", "r_") else names.index(n) for n in names]
        gap = np.abs(mirrored[:, twin] @ MIRROR - plain).max(axis=(1, 2))
        assert np.median(gap) < 1e-9
        assert np.mean(gap < 1e-6) > 0.99  # a limit's discontinuity may split rounding errors


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("vector", [(0, 2.1, 0), (0.4, -1.0, 0.7)])
def test_a_moved_world_gives_the_moved_pose(name, vector, clips):
    """The same points in another place and orientation give the same pose there."""
    turn, shift = Rotation.from_rotvec(vector), np.array([3.0, -1.0, 2.0])
    for _, targets in clips.values():
        solver = sp.make_solver(name, FIGURE, limits=False)
        moved = targets.positions @ turn.as_matrix().T + shift
        plain = solver.solve_motion(targets).positions
        there = solver.solve_motion(sp.Targets(moved, targets.rate)).positions
        expected = plain @ turn.as_matrix().T + shift
        gap = np.abs(there - expected).max(axis=(1, 2))
        assert np.median(gap) < 1e-7
        assert np.mean(gap < 1e-6) > 0.99


@pytest.mark.parametrize("name", NAMES)
def test_a_larger_body_takes_the_same_pose(name, clips):
    """Figure and points scaled alike give the same rotations (thresholds in metres aside)."""
    large = sp.Figure.from_stature(1.75 * 1.1)
    _, targets = clips["reach"]
    plain = sp.make_solver(name, FIGURE, limits=False).solve_motion(targets).rotations
    scaled = sp.Targets(targets.positions * 1.1, targets.rate)
    there = sp.make_solver(name, large, limits=False).solve_motion(scaled).rotations
    turned = Rotation.from_quat(plain.reshape(-1, 4)).inv() * Rotation.from_quat(there.reshape(-1, 4))
    assert turned.magnitude().max() < SCALED[name]


@pytest.mark.parametrize("name", NAMES)
def test_bone_lengths_never_change(name, clips):
    """Whatever the points, every joint keeps its distance to its parent."""
    _, targets = clips["boxing"]
    motion = sp.make_solver(name, FIGURE).solve_motion(targets)
    positions, _ = world_matrices(motion)
    parents = FIGURE.skeleton.parents[1:]
    lengths = np.linalg.norm(positions[:, 1:] - positions[:, parents], axis=-1)
    expected = np.linalg.norm(FIGURE.skeleton.offsets[1:], axis=-1)
    np.testing.assert_allclose(lengths, np.tile(expected, (len(motion), 1)), atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_the_same_input_gives_the_same_bits(name, clips):
    """Two runs agree to the last bit, and frame by frame is the same as all at once."""
    _, targets = clips["jump_kick"]
    solver = sp.make_solver(name, FIGURE)
    first, second = solver.solve_motion(targets), solver.solve_motion(targets)
    np.testing.assert_array_equal(first.rotations, second.rotations)
    solution = None
    for frame in range(40):
        solution = solver.solve(targets.positions[frame], previous=solution, dt=1 / targets.rate)
        np.testing.assert_array_equal(solution.pose.rotations, first.rotations[frame])
        np.testing.assert_array_equal(solution.pose.translations, first.translations[frame])


@pytest.mark.parametrize("name", NAMES)
def test_input_is_left_alone(name, clips):
    """Neither the points nor the previous solution are changed, so a frame can be solved twice."""
    _, targets = clips["walk"]
    solver = sp.make_solver(name, FIGURE)
    points = targets.positions[0].copy()
    kept = points.copy()
    first = solver.solve(points)
    state = [s.copy() for s in first.state]
    again = [solver.solve(targets.positions[1], previous=first) for _ in range(2)]
    np.testing.assert_array_equal(points, kept)
    for before, after in zip(state, first.state, strict=True):
        np.testing.assert_array_equal(before, after)
    np.testing.assert_array_equal(again[0].pose.rotations, again[1].pose.rotations)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("effector", range(6))
def test_a_lost_point_leaves_the_others_met(name, effector, clips):
    """While one point is lost the frame says so, the others are still met and nothing is NaN."""
    _, targets = clips["reach"]
    positions = targets.positions.copy()
    positions[100:140, effector] = np.nan
    solved = sp.make_solver(name, FIGURE, limits=False).solve_frames(sp.Targets(positions, 60))
    assert (solved.status[100:140] == sp.Status.LOST).all()
    assert not (solved.status[:100] == sp.Status.LOST).any()
    gap = np.linalg.norm(measured(FIGURE, solved.motion) - positions, axis=-1)[100:140]
    others = [e for e in range(6) if e != effector]
    assert np.nanmax(gap[:, others]) < 0.03
    jump = np.abs(np.diff(solved.motion.positions[98:102], axis=0)).max()
    assert jump < 0.1  # what is lost is held, it does not fall to a default


@pytest.mark.parametrize("name", NAMES)
def test_everything_lost_holds_the_pose(name, clips):
    """With all points lost the figure stands still as it was; from the first frame, neutrally."""
    _, targets = clips["walk"]
    solver = sp.make_solver(name, FIGURE)
    seen = solver.solve(targets.positions[10])
    blind = solver.solve(np.full((6, 3), np.nan), previous=seen)
    assert blind.status is sp.Status.LOST
    before, after = as_motion(FIGURE, seen).positions, as_motion(FIGURE, blind).positions
    np.testing.assert_allclose(after, before, atol=0.02)
    first = solver.solve(np.full((6, 3), np.nan))
    assert np.isfinite(first.pose.rotations).all()
    assert as_motion(FIGURE, first).positions[0, FIGURE.roles.head, 1] > 0.5


numbers = st.floats(allow_nan=True, allow_infinity=True, width=64)
worlds = arrays(float, (4, 6, 3), elements=st.one_of(numbers, st.floats(-3, 3), st.just(0.0)))


@pytest.mark.parametrize("limits", [True, False])
@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=300, deadline=None)
@given(positions=worlds)
def test_no_input_breaks_it(name, limits, positions):
    """Any numbers at all give finite unit rotations, finite positions and a status."""
    solved = sp.make_solver(name, FIGURE, limits=limits).solve_frames(sp.Targets(positions, 60))
    assert np.isfinite(solved.motion.translations).all()
    np.testing.assert_allclose(np.linalg.norm(solved.motion.rotations, axis=-1), 1.0, atol=1e-9)
    assert np.isfinite(solved.residual).all()
    assert set(solved.status) <= set(sp.Status)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("points", ["equal", "far", "line", "upside down"])
def test_odd_worlds_have_a_defined_result(name, points):
    """Coinciding, collinear, inverted and kilometres-away points give a finite pose that stays put."""
    base = points_of(FIGURE)
    world = {
        "equal": np.zeros((6, 3)) + [1.0, 2.0, 3.0],
        "far": base + [4e3, -2e3, 7e3],
        "line": np.linspace([0, 0, 0], [0, 2, 0], 6),
        "upside down": base * [1, -1, -1],
    }[points]
    solver = sp.make_solver(name, FIGURE)
    solution = None
    for _ in range(SETTLED[name]):
        solution = solver.solve(world, previous=solution)
    again = solver.solve(world, previous=solution)
    assert np.isfinite(again.pose.rotations).all() and np.isfinite(again.residual).all()
    first, second = (as_motion(FIGURE, s).positions for s in (solution, again))
    assert np.abs(first - second).max() < 0.05
    if points == "far":
        np.testing.assert_allclose(solution.residual, 0.0, atol=max(1e-6, MET[name]))


@pytest.mark.parametrize("name", NAMES)
def test_wrong_constructions_say_what_would_work(name):
    """Wrong shapes, frame times and options are errors that name the remedy."""
    solver = sp.make_solver(name, FIGURE)
    with pytest.raises(sp.TargetError, match=r"\(6, 3\)"):
        solver.solve(np.zeros((5, 3)))
    with pytest.raises(sp.TargetError, match="NaN"):
        solver.solve([None, "x"])
    other = sp.Figure.from_stature(1.2)
    stranger = sp.make_solver(name, other).solve(points_of(other))
    with pytest.raises(sp.SixpointError, match="previous"):
        solver.solve(points_of(FIGURE), previous=stranger)
    with pytest.raises(sp.SixpointError, match="sik"):
        sp.make_solver("no such method", FIGURE)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("dt", [0.0, -1.0, np.nan, np.inf, 1e-9, 1e9])
def test_any_time_step_is_survived(name, dt, clips):
    """Two packets of one instant, a clock set back or a long pause give a finite pose."""
    _, targets = clips["walk"]
    solver = sp.make_solver(name, FIGURE)
    first = solver.solve(targets.positions[0])
    solution = solver.solve(targets.positions[1], previous=first, dt=dt)
    assert np.isfinite(solution.pose.rotations).all() and solution.residual.max() < 0.1


@pytest.mark.parametrize("name", NAMES)
def test_progress_is_reported(name, clips):
    """Long work reports the frames done, and the result does not depend on it."""
    _, targets = clips["reach"]
    done: list[int] = []
    solver = sp.make_solver(name, FIGURE)
    reported = solver.solve_frames(targets, progress=done.append)
    assert done[-1] == len(targets) and done == sorted(done)
    np.testing.assert_array_equal(reported.motion.rotations, solver.solve_motion(targets).rotations)
