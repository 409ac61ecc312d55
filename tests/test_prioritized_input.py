"""Odd and wrong input of prioritized IK: an error that names the remedy, or a defined finite pose."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import sixpoint as sp
from prioritized_bodies import BODIES, EFFECTORS, Body, X, Y, figure, limb, robot, snake

ALL = pytest.mark.parametrize("make", BODIES, ids=lambda make: make.__name__)
NAN = float("nan")


def assert_finite(body: Body, solution: sp.Solution) -> None:
    """Unit rotations, finite positions and residuals, and a status."""
    np.testing.assert_allclose(np.linalg.norm(solution.pose.rotations, axis=1), 1.0, atol=1e-9)
    assert np.isfinite(solution.pose.translations).all()
    assert np.isfinite(body.world(solution.pose)[0]).all()
    assert np.isfinite(solution.residual).all() and (solution.residual >= 0.0).all()
    assert solution.status in set(sp.Status)


def stack(body: Body) -> list:
    """One task of every kind that fits the body."""
    first, second = EFFECTORS[body.name][:2]
    tasks = [
        sp.PositionTask(first, offset=(0.0, 0.05, 0.0)),
        sp.OrientationTask(first, level=3),
        sp.LookAtTask(second, level=3, weight=0.5),
        sp.AlignTask(second, level=7),
        sp.PlaneTask(first, level=0, goal=None),
        sp.ObstacleTask(second, sp.Capsule(0.1, 0.2), level=1),
        sp.BalanceTask(level=7, target="point", name="mass"),
        sp.PostureTask(),
    ]
    if body.name != "snake":
        end, kind = {"robot": ("tip", {"root": "arm"})}.get(body.name, (first, {}))
        tasks.append(sp.FlextTask(end, level=4, drag=True, name="flexed", **kind))
    if body.name in ("figure", "rig"):
        tasks += [sp.CouplingTask("l_elbow", "r_elbow", level=2), sp.BalanceTask(level=1)]
    return tasks


numbers = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True),
    st.floats(-2, 2),
    st.sampled_from([0.0, 1.0, NAN, 1e8, 1e300]),
)


@pytest.fixture(scope="module")
def solvers() -> dict[str, tuple[Body, sp.PrioritizedIK]]:
    """A solver with all kinds of tasks for every body."""
    return {make.__name__: (make(), make().solver(stack(make()))) for make in BODIES}


@ALL
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_no_goals_break_it(make, solvers, data):
    """Any numbers at all, in two frames one after the other, give finite poses and a status."""
    body, solver = solvers[make.__name__]
    goals = arrays(float, (len(solver.goal_names), 7), elements=numbers)
    first = solver.solve(data.draw(goals))
    assert_finite(body, first)
    assert_finite(body, solver.solve(data.draw(goals), previous=first))


@ALL
def test_goals_that_are_not_numbers_are_off(make, solvers):
    """NaN and absurd goals: nothing is asked for, the pose stays, and the frame is LOST; infinity is off."""
    body, solver = solvers[make.__name__]
    for value in (NAN, np.inf, -np.inf, 1e300):
        solution = solver.solve(np.full((len(solver.goal_names), 7), value))
        assert (solution.status is sp.Status.LOST) == (not np.isinf(value))
        assert_finite(body, solution)


# --- odd, but defined ------------------------------------------------------------------------------


def curled() -> sp.Pose:
    """The snake out of its singular rest pose."""
    return snake().pose(snake().random(np.random.default_rng(0), 0.2))


@pytest.mark.parametrize("level", [0, 1])
def test_contradictory_tasks_on_one_point(level):
    """Two goals for one point: at one level the middle, else the more important one; both are reported.

    Goals farther away than a step pull alike, so that the middle holds for near ones.
    """
    body = snake()
    tasks = [sp.PositionTask("s20", name="a"), sp.PositionTask("s20", name="b", level=level)]
    goals = {"a": (0.1, 0.0, 1.0), "b": (-0.1, 0.0, 1.0)}
    solution = body.solver(tasks).solve(goals, start=curled())
    assert_finite(body, solution)
    assert solution.status is sp.Status.UNREACHABLE
    expected = [0.1, 0.1] if level == 0 else [0.0, 0.2]
    np.testing.assert_allclose(solution.residual, expected, atol=0.01)
    assert solution.gave_way["b"] == ("a",)
    assert ("a" in solution.gave_way) == (level == 0)


def test_weights_share_one_level():
    """Of two goals for one point at one level the weights say where between them it ends (squared)."""
    body = snake()
    tasks = [sp.PositionTask("s20", name="a", weight=2.0), sp.PositionTask("s20", name="b")]
    solution = body.solver(tasks).solve({"a": (0.1, 0.0, 1.0), "b": (-0.05, 0.0, 1.0)}, start=curled())
    np.testing.assert_allclose(solution.residual, [0.03, 0.12], atol=5e-3)


def test_a_goal_at_the_root_of_the_limb():
    """The plain task and FLEXT fold as far as the hinge allows."""
    body = limb()
    bent = body.pose(body.set_angles(body.rest(), 1, -0.5))
    least = np.sqrt(0.3**2 + 0.27**2 + 2 * 0.3 * 0.27 * np.cos(2.6))
    for task in (sp.PositionTask("hand"), sp.FlextTask("hand")):
        solution = body.solver([task], iterations=60).solve({"hand": (0.0, 0.0, 0.0)}, start=bent)
        assert_finite(body, solution)
        assert solution.residual[0] == pytest.approx(least, abs=0.01)


def test_a_hundred_tasks():
    """A hundred tasks at fifty levels with gaps: finite, every task has a residual, the first is met."""
    body = figure()
    rng = np.random.default_rng(0)
    names = [n for n in body.model.roles.named() if n not in ("pelvis", "head")]
    tasks = [sp.PositionTask("l_wrist", name="first")]
    for k in range(99):
        at = names[k % len(names)]
        tasks.append(
            sp.PositionTask(at, name=f"t{k}", level=3 + 7 * (k // 2), offset=tuple(0.1 * rng.normal(size=3)))
        )
    goals = {task.label: 0.5 * rng.normal(size=3) for task in tasks}
    goals["first"] = (0.2, 0.2, 0.3)
    solution = body.solver(tasks).solve(goals)
    assert_finite(body, solution)
    assert len(solution.residual) == 100 and solution.residual[0] < 0.01


def test_gaps_between_levels_do_not_matter():
    """Levels 0, 1, 2 and 0, 400, 90000 give the same bits; so does the order in which tasks are listed."""
    body = robot()
    poses = []
    for levels in ((0, 1, 2), (0, 400, 90_000)):
        tasks = [
            sp.PositionTask("tip"),
            sp.AlignTask("tool", level=levels[1]),
            sp.PositionTask("wrist", level=levels[2]),
        ]
        goals = {"tip": (0.3, 0.7, 0.4), "tool axis": (0.0, 0.0, 1.0), "wrist": (0.1, 0.8, 0.2)}
        for order in (tasks, tasks[::-1]):
            poses.append(body.solver(order).solve(goals).pose.rotations)
    for pose in poses[1:]:
        np.testing.assert_array_equal(pose, poses[0])


@pytest.mark.parametrize(
    "shape", [sp.Sphere(0.3), sp.Capsule(0.2, 0.4), sp.Box((0.5, 0.5, 0.5)), sp.HalfSpace()]
)
def test_an_obstacle_that_contains_the_shoulder(shape):
    """What cannot get out is pushed as far as it goes; what can is out. Finite, and the frame says so."""
    body = limb()
    avoid = sp.ObstacleTask("hand", shape, points=("elbow", "shoulder"), goal=(0.0, 0.0, 0.0))
    solution = body.solver([avoid, sp.PositionTask("hand", level=1)]).solve({"hand": (0.1, -0.2, 0.1)})
    assert_finite(body, solution)
    if not isinstance(shape, sp.HalfSpace):
        assert solution.status is sp.Status.UNREACHABLE


def test_a_zero_length_limb():
    """A point on its own joint is a task like others; FLEXT of such a limb is an error that says so."""
    skeleton = sp.Skeleton(("a", "b", "c"), [-1, 0, 1], [[0, 0, 0], [0, 0, 0], [0, 0, 0]])
    dofs = sp.Dofs({0: sp.Ball(), 1: sp.Hinges(X, -2.0, 0.0)}, free_root=False)
    body = Body("point", skeleton, dofs)
    solution = body.solver([sp.PositionTask("c"), sp.OrientationTask("b", level=1)]).solve(
        {"c": (1.0, 0.0, 0.0), "b orientation": (0.0, 1.0, 0.0, 0.0)}
    )
    assert_finite(body, solution)
    assert solution.residual[0] == pytest.approx(1.0)
    with pytest.raises(sp.SixpointError, match="FLEXT needs a hinge"):
        body.solver([sp.FlextTask("c")])
    with pytest.raises(sp.SixpointError, match="no length"):
        body.solver([sp.FlextTask("c", offset=(0, 0.2, 0), root="a", middle="b")])


def test_a_gaze_at_the_eye_and_an_axis_along_nothing_are_off():
    """A goal that gives no direction asks for nothing: the frame is LOST, the pose stays."""
    body = figure()
    place = body.world(body.rest())[0][body.joint("head")] + body.model.head_offset
    tasks = [sp.LookAtTask("head"), sp.AlignTask("l_wrist")]
    start = body.pose(body.rest())
    solution = body.solver(tasks).solve({"head gaze": place, "l_wrist axis": (0, 0, 0)}, start=start)
    assert solution.status is sp.Status.LOST
    np.testing.assert_allclose(body.world(solution.pose)[0], body.world(start)[0], atol=1e-12)


def test_opposite_directions_turn_round():
    """A gaze and an axis that point exactly away from their goal find a way round."""
    body = figure()
    place = body.world(body.rest())[0][body.joint("pelvis")]
    tasks = [sp.AlignTask("pelvis"), sp.PositionTask("pelvis", level=1), sp.LookAtTask("head", level=2)]
    solution = body.solver(tasks).solve(
        {"pelvis axis": -Y, "pelvis": place, "head gaze": place - [0, 0, 5.0]}, start=body.pose(body.rest())
    )
    assert solution.residual[0] < 0.01 and solution.residual[2] < 0.05


def test_an_orientation_need_not_be_normalised():
    """A quaternion of any length but zero is a rotation; zero is none, and the pose stays finite."""
    body = figure()
    solver = body.solver([sp.OrientationTask("l_wrist")])
    goal = np.array([0.1, 0.2, 0.3, 0.9])
    poses = [solver.solve({"l_wrist orientation": scale * goal}).pose.rotations for scale in (1.0, -3.0)]
    np.testing.assert_allclose(np.abs(np.sum(poses[0] * poses[1], axis=1)), 1.0, atol=1e-6)
    assert_finite(body, solver.solve({"l_wrist orientation": 0.0 * goal}))


# --- wrong constructions ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tasks", "message"),
    [
        ([], "PositionTask"),
        ([sp.PositionTask("l_paw")], "l_paw.*joints: humanoid_root"),
        ([sp.PositionTask("head"), sp.PositionTask("head")], "name="),
        ([sp.PositionTask("head", level=-1)], "whole numbers from 0"),
        ([sp.PositionTask("head", level=0.5)], "whole numbers from 0"),
        ([sp.PositionTask("head", level=NAN)], "whole numbers from 0"),
        ([sp.FlextTask("l_wrist", tangential_level=-2)], "whole numbers from 0"),
        ([sp.PositionTask("head", weight=0.0)], "positive"),
        ([sp.PositionTask("head", weight=NAN)], "positive"),
        ([sp.PositionTask("head", tolerance=0.0)], "positive"),
        ([sp.PositionTask("head", offset=(0, NAN, 0))], "three finite numbers"),
        ([sp.PositionTask("head", offset=(0, 1))], "three finite numbers"),
        ([sp.PositionTask("head", goal=(1.0, 2.0))], r"position \(3,\)"),
        ([sp.LookAtTask("head", axis=(0, 0, 0))], "axis is three numbers"),
        ([sp.AlignTask("head", axis=(0, 1))], "axis is three numbers"),
        ([sp.PlaneTask("head", margin=-1.0)], "lengths from 0"),
        ([sp.ObstacleTask("head", sp.Sphere(-1.0))], "lengths from 0"),
        ([sp.ObstacleTask("head", sp.Box((1.0, 2.0)))], "lengths from 0"),
        ([sp.ObstacleTask("head", "a wall")], "Sphere, Capsule, Box, HalfSpace or Mesh"),
        ([sp.ObstacleTask("head", buffer=NAN)], "lengths from 0"),
        ([sp.BalanceTask(target="middle")], "'polygon' or 'point'"),
        ([sp.BalanceTask(), sp.BalanceTask(name="again")], "one balance task"),
        ([sp.BalanceTask(support=("l_paw",))], "l_paw"),
        ([sp.BalanceTask(margin=NAN)], "margin"),
        ([sp.CouplingTask("l_elbow", "l_elbow")], "two joints of one kind"),
        ([sp.CouplingTask("l_elbow", "l_shoulder")], "two joints of one kind"),
        ([sp.CouplingTask("l_elbow", "r_elbow", ratio=NAN)], "finite"),
        ([sp.FlextTask("head")], "FLEXT needs a hinge"),
        ([sp.FlextTask("l_wrist", middle="l_shoulder")], "not a hinge"),
        ([sp.FlextTask("l_wrist", root="r_shoulder")], "not above it; there are"),
        ([sp.FlextTask("l_wrist", form="cosine")], "tangent, exponential, hinge"),
        ([sp.PositionTask("head", level=3), sp.PostureTask(level=2)], "level above 3"),
        ([sp.PostureTask(), sp.PostureTask()], "one posture task"),
        ([sp.PostureTask(pose="lazy")], "'relaxed', 'middle' or a pose"),
        ([sp.PostureTask(weights={"head": -1.0})], "from 0"),
        ([sp.PostureTask(weights={"l_paw": 1.0})], "l_paw"),
        ([sp.PostureTask(step=NAN)], "step"),
        ([object()], "not a task"),
    ],
)
def test_wrong_tasks_say_what_would_work(tasks, message):
    """Every wrong task is an error when the solver is made, and the message names what would do."""
    with pytest.raises(sp.SixpointError, match=f"(?s){message}"):
        figure().solver(tasks)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"gain": 0.0}, "gain"),
        ({"gain": NAN}, "gain"),
        ({"gain": 1.5}, "gain"),
        ({"iterations": -1}, "iterations"),
        ({"iterations": 3, "least_iterations": 4}, "iterations"),
        ({"max_angle": 0.0}, "max_angle"),
        ({"max_angle": NAN}, "max_angle"),
        ({"max_shift": -1.0}, "max_shift"),
        ({"rank_threshold": -1.0}, "rank_threshold"),
        ({"rank_threshold": NAN}, "rank_threshold"),
    ],
)
def test_wrong_options_are_errors(options, message):
    """An option out of its range is an error that names it."""
    with pytest.raises(sp.SixpointError, match=message):
        figure().solver([sp.PositionTask("head")], **options)


@pytest.mark.parametrize(
    ("goals", "message"),
    [
        ({"hed": (0, 0, 0)}, "there are: head, l_wrist"),
        ({"head": (0, 0)}, r"position \(3,\)"),
        ({"head": "up"}, r"position \(3,\)"),
        (np.zeros((3, 3)), r"\(2, 3\) or \(2, 7\)"),
        (np.zeros(3), r"\(2, 3\)"),
        ([[0, 0, 0], [0, 0]], r"\(2, 3\)"),
        (None, r"\(2, 3\)"),
    ],
)
def test_wrong_goals_say_what_would_work(goals, message):
    """Unknown names and wrong shapes are errors that list the names or shapes there are."""
    solver = figure().solver([sp.PositionTask("head"), sp.PositionTask("l_wrist", level=1)])
    with pytest.raises(sp.TargetError, match=message):
        solver.solve(goals)


def test_other_bodies_are_refused():
    """A previous solution, a start or a skeleton that does not fit is an error."""
    body, other = figure(), snake()
    solver = body.solver([sp.PositionTask("head")])
    stranger = other.solver([sp.PositionTask("s20")]).solve({"s20": (0, 0, 1)})
    with pytest.raises(sp.SixpointError, match="previous=None"):
        solver.solve({"head": (0, 1, 0)}, previous=stranger)
    with pytest.raises(sp.SixpointError, match="another skeleton"):
        solver.solve({"head": (0, 1, 0)}, start=stranger.pose)
    with pytest.raises(sp.SixpointError, match="dofs="):
        sp.PrioritizedIK(other.model, [sp.PositionTask("s20")])
    with pytest.raises(sp.SixpointError, match="nothing can move"):
        sp.PrioritizedIK(other.model, [sp.PositionTask("s20")], dofs=sp.Dofs({}, free_root=False))
    with pytest.raises(sp.SixpointError, match="21 joints"):
        sp.PrioritizedIK(other.model, [sp.PositionTask("s20")], dofs=sp.Dofs({40: sp.Ball()}))
    with pytest.raises(sp.SixpointError, match="support="):
        other.solver([sp.BalanceTask()])
