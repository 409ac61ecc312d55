"""Each kind of task does what it says, its residual is what is measured, and goals mean what they say."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import sixpoint as sp
from prioritized_bodies import (
    BODIES,
    SHAPES,
    Body,
    State,
    Y,
    Z,
    figure,
    limb,
    mass_centre,
    outside,
    random_stack,
    robot,
    snake,
    support,
    unit,
)

ALL = pytest.mark.parametrize("make", BODIES, ids=lambda make: make.__name__)

# --- tasks do what they say ------------------------------------------------------------------------


def solve(body: Body, tasks: list, goals: dict, start: State | None = None, **options: object):
    """Solve one frame from the neutral pose; the solution and where everything is."""
    start = body.rest() if start is None else start
    solution = body.solver(tasks, **options).solve(goals, start=body.pose(start))
    return solution, *body.world(solution.pose)


def standing(body: Body) -> tuple[list, dict]:
    """Both feet stay where they are in the neutral pose."""
    positions, _ = body.world(body.rest())
    feet = ("l_ankle", "r_ankle")
    return [sp.PositionTask(at) for at in feet], {at: positions[body.joint(at)] for at in feet}


def test_the_gaze_hits_its_target():
    """The line from the eye along the gaze passes the target within what 0.01 rad allows."""
    body = figure()
    tasks, goals = standing(body)
    eye, target = np.array([0.0, 0.05, 0.1]), np.array([1.0, 1.3, 1.5])
    gaze = sp.LookAtTask("head", offset=tuple(eye), level=1)
    solution, positions, world = solve(body, [*tasks, gaze], {**goals, "head gaze": target})
    head = body.joint("head")
    start = positions[head] + world[head] @ (eye + body.model.head_offset)
    along = world[head] @ Z
    assert (target - start) @ along > 0.0
    assert np.linalg.norm(np.cross(target - start, along)) < 0.01 * np.linalg.norm(target - start)
    assert solution.status is sp.Status.CONVERGED


def test_an_axis_and_a_rotation_are_taken():
    """The hand's axis points down the goal's direction; the other hand has the goal's rotation."""
    body = figure()
    turn = Rotation.from_euler("XYZ", [-0.5, 0.4, 0.3])
    tasks = [sp.AlignTask("r_wrist", axis=(0, 1, 0)), sp.OrientationTask("l_wrist")]
    goals = {"r_wrist axis": (0.0, 0.3, 0.9), "l_wrist orientation": turn.as_quat()}
    _, _, world = solve(body, tasks, goals)
    axis = world[body.joint("r_wrist")] @ Y
    assert np.arccos(axis @ unit(np.array([0.0, 0.3, 0.9]))) < 0.01
    assert (Rotation.from_matrix(world[body.joint("l_wrist")]) * turn.inv()).magnitude() < 0.01


def below_the_floor():
    """A standing figure's hand drawn below a floor at 0.2 m."""
    body = figure()
    tasks, goals = standing(body)
    floor = sp.PlaneTask("l_wrist", goal=(0.0, 0.2, 0.0, 0.0, 0.0, 0.0, 1.0), margin=0.03)
    tasks = [*tasks, floor, sp.PositionTask("l_wrist", level=1)]
    return body, *solve(body, tasks, {**goals, "l_wrist": (0.3, 0.0, 0.4)}, iterations=100)


def test_the_floor_is_not_penetrated():
    """A hand drawn below the floor ends on it, above its goal."""
    body, solution, positions, _ = below_the_floor()
    assert positions[body.joint("l_wrist"), 1] == pytest.approx(0.23, abs=2e-3)
    assert np.linalg.norm(positions[body.joint("l_wrist"), [0, 2]] - [0.3, 0.4]) < 0.01
    assert solution.status is sp.Status.UNREACHABLE


def test_the_floor_is_named():
    """What the hand gave way to is the floor it rests on."""
    _, solution, *_ = below_the_floor()
    assert "l_wrist plane" in solution.gave_way["l_wrist"]


def inside(hull: ConvexHull, point: np.ndarray) -> float:
    """How far a point is inside a hull; negative outside."""
    return -float((hull.equations[:, :2] @ point + hull.equations[:, 2]).max())


def test_balance_keeps_the_mass_above_the_feet():
    """Reaching forward the mass stays well inside the feet's hull; without the task it leaves it.

    The heels lift, and a hull too narrow for the margin of 2 cm is shrunk by half of what it has.
    """
    body = figure()
    tasks, goals = standing(body)
    reach = sp.PositionTask("l_wrist", level=1)
    goals["l_wrist"] = body.world(body.rest())[0][body.joint("l_wrist")] + [0.0, 0.1, 1.0]
    margins = []
    for more in ([sp.BalanceTask()], []):
        _, positions, world = solve(body, [*tasks, *more, reach], goals)
        centre = mass_centre(body, positions[None], world[None])[0, [0, 2]]
        margins.append(inside(support(body, positions, world), centre))
    assert margins[0] > 0.015
    assert margins[1] < 0.0


def test_balance_above_a_point():
    """The centre of mass goes above the given point."""
    body = figure()
    tasks, goals = standing(body)
    balance = sp.BalanceTask(target="point", level=1)
    _, positions, world = solve(body, [*tasks, balance], {**goals, "balance": (0.05, 0.0, 0.08)})
    centre = mass_centre(body, positions[None], world[None])[0]
    np.testing.assert_allclose(centre[[0, 2]], [0.05, 0.08], atol=1.5e-3)


def test_a_balanced_reach_goes_on_to_its_goal():
    """Feet and balance held, a hand reaches 0.7 m forward: plain repeated steps get there within 30."""
    body = figure()
    tasks, goals = standing(body)
    goals["l_wrist"] = body.world(body.rest())[0][body.joint("l_wrist")] + [0.0, 0.1, 0.7]
    tasks += [sp.BalanceTask(), sp.PositionTask("l_wrist", level=1)]
    solution, *_ = solve(body, tasks, goals, gain=0.5, iterations=60)
    assert solution.residual.max() < 0.01


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_obstacles_are_kept_out_of(shape):
    """A hand drawn into an obstacle stays out of it by the margin, and so does the observed elbow."""
    body = figure()
    tasks, goals = standing(body)
    positions, _ = body.world(body.rest())
    turn = Rotation.from_rotvec([-0.5 * np.pi, 0.0, 0.0])  # its Y axis points back, towards the body
    place = positions[body.joint("l_wrist")] + [0.0, 0.15, 0.35]
    goal = np.concatenate([place, turn.as_quat()])
    avoid = sp.ObstacleTask("l_wrist", shape, goal=goal, margin=0.02, points=("l_elbow",))
    tasks += [avoid, sp.PositionTask("l_wrist", level=1)]
    solution, positions, _ = solve(body, tasks, {**goals, "l_wrist": place})
    assert solution.status is sp.Status.UNREACHABLE
    local = turn.inv().apply(positions[[body.joint("l_wrist"), body.joint("l_elbow")]] - place)
    assert outside(shape, local).min() > 0.02 - 1.5e-3


@pytest.mark.parametrize("gap", [0.01, 0.025, 0.04])
def test_approaches_are_slowed_in_the_buffer(gap):
    """Inside the buffer the speed towards the obstacle is the share of the buffer that is left."""
    body = limb()
    state = body.set_angles(body.rest(), 1, -0.8)
    hand = body.world(state)[0][2]
    wall = sp.ObstacleTask("hand", goal=hand - [0.0, gap, 0.0], buffer=0.05)
    reach = sp.PositionTask("hand", level=1)
    steps = [
        body.solver(tasks, limits=False).compute_step({"hand": hand - [0, 0.02, 0]}, start=body.pose(state))
        for tasks in ([wall, reach], [reach])
    ]
    free, slowed = (step.jacobian[-2] @ step.step for step in reversed(steps))
    assert free == pytest.approx(-0.02, abs=1e-9)
    assert slowed == pytest.approx(free * gap / 0.05, abs=1e-9)


@pytest.mark.parametrize(
    ("make", "at", "other", "end"), [(snake, "s3", "s9", "s20"), (robot, "turret", "wrist", "tip")]
)
def test_coupled_joints_keep_their_ratio(make, at, other, end):
    """While the end goes to its goal, one joint turns 0.6 times as far as the other, about the same axis."""
    body = make()
    there = body.random(np.random.default_rng(3), 0.5)
    goal = body.world(there)[0][body.joint(end)]
    tasks = [sp.CouplingTask(at, other, ratio=0.6), sp.PositionTask(end, level=1)]
    solution, *_ = solve(body, tasks, {end: goal}, body.random(np.random.default_rng(4), 0.2))
    local = body.locals(solution.pose)
    one, two = (Rotation.from_matrix(local[body.joint(name)]).as_rotvec() for name in (at, other))
    if make is robot:
        one, two = one.sum(), two.sum()
    assert np.linalg.norm(two) > 0.05
    np.testing.assert_allclose(one, 0.6 * two, atol=0.01)
    assert solution.residual[1] < 0.01


def test_the_posture_is_reached_where_tasks_leave_room():
    """Alone the posture is reached; with a hand held in its place, nothing else differs from it."""
    body = figure()
    there = body.random(np.random.default_rng(5), 0.4)
    posture = sp.PostureTask(pose=body.pose(there))
    hand = sp.PositionTask("l_wrist")
    solver = body.solver([hand, posture], least_iterations=200, iterations=200, cold_iterations=200)
    goal = body.world(there)[0][body.joint("l_wrist")]
    solution = solver.solve({"l_wrist": goal})
    local, wished = body.locals(solution.pose), Rotation.from_quat(there.local).as_matrix()
    off = [Rotation.from_matrix(a @ b.T).magnitude() for a, b in zip(local, wished, strict=True)]
    assert max(angle for j, angle in enumerate(off) if j != body.base) < 0.02
    assert solution.residual[0] < 1e-3


# --- residuals, goals, status ----------------------------------------------------------------------


@ALL
@pytest.mark.parametrize("seed", range(4))
def test_residuals_are_measured_errors(make, seed):
    """Residuals are distances and angles of the written pose, by independent forward kinematics."""
    body, rng = make(), np.random.default_rng(seed)
    state = body.random(rng)
    tasks, goals = random_stack(body, state, rng, 5, 0.3)
    solution, positions, world = solve(body, tasks, goals, state)
    for task, residual in zip(tasks, solution.residual, strict=True):
        j, goal = body.joint(task.at), np.asarray(goals[task.label])
        offset = np.array(task.offset)
        if task.at == "head" and isinstance(body.model, sp.Figure):
            offset = offset + body.model.head_offset
        place = positions[j] + world[j] @ offset
        if isinstance(task, sp.PositionTask):
            error = np.linalg.norm(goal - place)
        elif isinstance(task, sp.OrientationTask):
            error = (Rotation.from_quat(goal) * Rotation.from_matrix(world[j]).inv()).magnitude()
        else:
            wanted = unit(goal - place) if isinstance(task, sp.LookAtTask) else unit(goal)
            along = world[j] @ unit(np.array(task.axis))
            error = np.arctan2(np.linalg.norm(np.cross(along, wanted)), along @ wanted)
        assert residual == pytest.approx(error, abs=1e-8)


def test_goals_by_name_and_by_array_agree():
    """A mapping and an array in the order of ``goal_names`` give the same bits; so do frames at once."""
    body, rng = figure(), np.random.default_rng(0)
    state = body.random(rng)
    tasks, goals = random_stack(body, state, rng, 5, 0.2)
    tasks += [sp.CouplingTask("l_elbow", "r_elbow", level=9), sp.BalanceTask(level=9)]
    solver = body.solver(tasks)
    assert solver.goal_names == tuple(goals) and len(solver.names) == 7
    array = solver.compute_goals(goals)[:5]
    by_name, by_array = solver.solve(goals), solver.solve(array)
    np.testing.assert_array_equal(by_name.pose.rotations, by_array.pose.rotations)
    both = solver.solve_frames(np.stack([array, array]))
    np.testing.assert_array_equal(both.motion.rotations[0], by_name.pose.rotations)
    again = solver.solve(goals, previous=by_name)
    np.testing.assert_array_equal(both.motion.rotations[1], again.pose.rotations)


def test_an_unknown_goal_switches_its_task_off():
    """With one goal NaN the frame is LOST, the other task is met, and nothing moves for the lost one."""
    body = robot()
    start = body.random(np.random.default_rng(1), 0.5)
    goal = body.world(body.random(np.random.default_rng(2), 0.5))[0][body.joint("wrist")]
    tasks = [sp.PositionTask("tip"), sp.PositionTask("wrist", level=1)]
    solution, positions, _ = solve(body, tasks, {"tip": (np.nan, 1.0, 0.0), "wrist": goal}, start)
    alone, *_ = solve(body, tasks[1:], {"wrist": goal}, start)
    assert solution.status is sp.Status.LOST and solution.residual[0] == 0.0
    assert np.linalg.norm(positions[body.joint("wrist")] - goal) < 1e-3
    np.testing.assert_array_equal(solution.pose.rotations, alone.pose.rotations)
    missing = body.solver(tasks).solve({"wrist": goal}, start=body.pose(start))
    np.testing.assert_array_equal(missing.pose.rotations, solution.pose.rotations)


def test_the_task_that_wins_is_named():
    """A snake's middle and end cannot both be where they should: the loser names the winner, and only it."""
    body = snake()
    tasks = [sp.PositionTask("s20", level=0), sp.PositionTask("s10", level=1), sp.AlignTask("s2", level=2)]
    goals = {"s20": (0.0, 0.0, 1.7), "s10": (0.0, 0.9, 0.6), "s2 axis": (0.0, 1.0, 0.0)}
    solution, *_ = solve(body, tasks, goals, body.random(np.random.default_rng(0), 0.1))
    assert solution.status is sp.Status.UNREACHABLE
    assert solution.gave_way["s10"] == ("s20",)
    assert not {"s20", "s2 axis"} & set(solution.gave_way)


def test_a_frame_continues_the_one_before():
    """From its own solution a frame needs one iteration at most, from ``begin`` of its pose as well."""
    body = figure()
    tasks, goals = standing(body)
    solver = body.solver([*tasks, sp.PositionTask("head", level=1)], least_iterations=0)
    goals["head"] = body.world(body.rest())[0][body.joint("head")] + [0.1, 0.0, 0.1]
    first = solver.solve(goals)
    assert first.iterations > 1
    assert solver.solve(goals, previous=first).iterations == 0
    assert solver.solve(goals, start=first.pose).iterations <= 1


@ALL
def test_input_is_left_alone_and_runs_repeat(make):
    """Goals and the previous solution are not changed, so a frame solved twice has the same bits."""
    body, rng = make(), np.random.default_rng(2)
    state = body.random(rng)
    tasks, goals = random_stack(body, state, rng, 4, 0.2)
    solver = body.solver([*tasks, sp.PostureTask()])
    first = solver.solve(goals, start=body.pose(state))
    kept = first.state[0].copy()
    given = {name: np.array(goal) for name, goal in goals.items()}
    again = [solver.solve(goals, previous=first) for _ in range(2)]
    np.testing.assert_array_equal(first.state[0], kept)
    for name, goal in given.items():
        np.testing.assert_array_equal(goals[name], goal)
    np.testing.assert_array_equal(again[0].pose.rotations, again[1].pose.rotations)
    other = body.solver([*tasks, sp.PostureTask()]).solve(goals, start=body.pose(state))
    np.testing.assert_array_equal(first.pose.rotations, other.pose.rotations)
