"""Facts of one prioritized step: strict order, projectors, damping, and limits inside the loop."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import sixpoint as sp
from independent import limit_excess
from prioritized_bodies import (
    BODIES,
    EFFECTORS,
    Body,
    figure,
    limb,
    random_stack,
    rig,
    robot,
    snake,
    textbook_step,
)
from sixpoint.kernels import linear

ALL = pytest.mark.parametrize("make", BODIES, ids=lambda make: make.__name__)
SEEDS = pytest.mark.parametrize("seed", range(3))
seeds = st.integers(0, 2**32 - 1)


def linear_step(body: Body, seed: int, count: int = 5, reach: float = 0.3, **options: object):
    """A random stack of tasks at a random pose, and its linear step."""
    rng = np.random.default_rng(seed)
    state = body.random(rng)
    tasks, goals = random_stack(body, state, rng, count, reach)
    return body.solver(tasks, **options).compute_step(goals, start=body.pose(state)), tasks, goals, state


# --- projectors ------------------------------------------------------------------------------------


@ALL
@SEEDS
def test_the_projector_is_that_of_the_stacked_jacobian(make, seed):
    """I - V^T V is I - J^+ J of all rows: symmetric, idempotent, and no row is left in it."""
    step, *_ = linear_step(make(), seed, limits=False)
    n, jacobian = len(step.step), step.jacobian[step.active]
    projector = np.eye(n) - step.basis.T @ step.basis
    np.testing.assert_allclose(projector, np.eye(n) - np.linalg.pinv(jacobian, 1e-7) @ jacobian, atol=1e-9)
    np.testing.assert_allclose(projector, projector.T, atol=1e-12)
    np.testing.assert_allclose(projector @ projector, projector, atol=1e-10)
    np.testing.assert_allclose(projector @ jacobian.T, 0.0, atol=1e-9)
    assert round(np.trace(projector)) == n - np.linalg.matrix_rank(jacobian, 1e-6)


@ALL
@SEEDS
@pytest.mark.parametrize("limits", [True, False])
def test_the_step_is_the_textbook_recursion(make, seed, limits):
    """The step is what singular values and explicit projectors give, level by level."""
    step, *_ = linear_step(make(), seed, limits=limits)
    expected, _ = textbook_step(step)
    np.testing.assert_allclose(step.step, expected, atol=1e-7)


@ALL
@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=seeds, reach=st.sampled_from([1e-3, 0.1, 3.0]))
def test_a_less_important_task_changes_nothing_above_it(make, seed, reach):
    """Without the tasks from some level on, the others' J dq is the same to 1e-9."""
    body = make()
    step, tasks, goals, state = linear_step(body, seed, 6, reach, limits=False)
    levels = sorted({task.level for task in tasks})
    for level in levels[1:]:
        fewer = [task for task in tasks if task.level < level]
        own = {task.label: goals[task.label] for task in fewer}
        alone = body.solver(fewer, limits=False).compute_step(own, start=body.pose(state))
        kept = np.isin(step.task, [k for k, task in enumerate(tasks) if task.level < level])
        np.testing.assert_allclose(
            step.jacobian[kept] @ step.step, alone.jacobian @ alone.step, rtol=0, atol=1e-9
        )


@ALL
def test_the_posture_changes_no_task(make):
    """What the posture adds lies in the null space of every task."""
    body = make()
    step, tasks, goals, state = linear_step(body, 4, limits=False)
    with_posture = body.solver([*tasks, sp.PostureTask()], limits=False)
    drifting = with_posture.compute_step(goals, start=body.pose(state))
    np.testing.assert_allclose(step.jacobian @ (drifting.step - step.step), 0.0, atol=1e-9)


def test_compatible_tasks_are_all_met_and_only_with_compensation():
    """Small wishes of independent tasks at several levels are met exactly; without what is above, not."""
    body = figure()
    tasks = [sp.PositionTask(at, level=k) for k, at in enumerate(("l_wrist", "head", "r_wrist", "l_ankle"))]
    state = body.random(np.random.default_rng(0))
    positions, _ = body.world(state)
    goals = {at: positions[body.joint(at)] + 0.01 for at in ("l_wrist", "r_wrist", "l_ankle")}
    goals["head"] = positions[body.joint("head")] + body.model.head_offset + [0.0, 0.01, 0.0]
    step = body.solver(tasks, limits=False).compute_step(goals, start=body.pose(state))
    np.testing.assert_allclose(step.jacobian @ step.step, step.wanted, atol=1e-9)
    free, naive = np.eye(len(step.step)), np.zeros(len(step.step))
    for k in range(4):
        rows = step.jacobian[step.level == k]
        inverse = np.linalg.pinv(rows @ free)
        naive += inverse @ step.wanted[step.level == k]
        free = free - inverse @ rows @ free
    assert np.abs(step.jacobian @ naive - step.wanted).max() > 1e-4


@ALL
@SEEDS
def test_a_single_level_is_the_pseudoinverse(make, seed):
    """A small wish at one level: the least-norm solution pinv(J) dx."""
    body, rng = make(), np.random.default_rng(seed)
    state = body.random(rng)
    at = EFFECTORS[body.name][0]
    solver = body.solver([sp.PositionTask(at, weight=2.0)], limits=False)
    goal = body.world(state)[0][body.joint(at)] + rng.normal(size=3) * 1e-3
    step = solver.compute_step({at: goal}, start=body.pose(state))
    assert np.linalg.svd(step.jacobian)[1].min() > 1e-2
    np.testing.assert_allclose(step.step, np.linalg.pinv(step.jacobian) @ step.wanted, atol=1e-10)


def test_the_posture_alone_is_a_plain_gradient_step():
    """Without other tasks every hinge moves by its share of the way, and so does a ball's rotation vector."""
    body = limb()
    state = body.moved(body.rest(), np.array([0.1, 0.2, -0.1, -0.3]))
    posture = sp.PostureTask(step=0.2, weights={"elbow": 0.5})
    step = body.solver([posture]).compute_step({}, start=body.pose(state))
    np.testing.assert_allclose(step.step, [-0.02, -0.04, 0.02, 0.2 * 0.5 * 0.3], atol=1e-12)


# --- damping ---------------------------------------------------------------------------------------


@ALL
@settings(max_examples=25, deadline=None)
@given(seed=seeds, reach=st.sampled_from([0.1, 1.0, 30.0]))
def test_the_part_of_each_level_is_bounded(make, seed, reach):
    """However singular the pose and far the goals: no level's part of the step is longer than 0.4."""
    body = make()
    _, tasks, goals, state = linear_step(body, seed, 6, reach, limits=False)
    before = np.zeros(len(body.columns))
    for level in sorted({task.level for task in tasks}):
        kept = [task for task in tasks if task.level <= level]
        own = {task.label: goals[task.label] for task in kept}
        step = body.solver(kept, limits=False).compute_step(own, start=body.pose(state)).step
        assert np.linalg.norm(step - before) < 0.4 + 1e-9
        before = step


@given(st.floats(1e-3, 1e3), st.floats(1e-3, 1e3), st.floats(1.0, 1e3))
def test_damping_bounds_the_gain_of_every_larger_singular_value(sigma, wanted, more):
    """The gain s / (s^2 + lambda^2) is at most 1 / wanted, which bounds the solution, for all s >= sigma."""
    shrink = linear.damping(sigma, wanted)
    s = sigma * more
    assert s / (s * s + shrink * shrink) <= (1.0 + 1e-9) / wanted or shrink == 0.0
    assert 1.0 / sigma <= (1.0 + 1e-12) / wanted or shrink > 0.0


@given(st.floats(1e-3, 1e3))
def test_damping_is_continuous(wanted):
    """It begins at zero where the singular value falls below the wish, and has no step at half of it."""
    for sigma in (wanted, 0.5 * wanted):
        below, above = (linear.damping(sigma * (1 + e), wanted) for e in (-1e-10, 1e-10))
        assert below == pytest.approx(above, abs=2e-5 * wanted)
    assert linear.damping(wanted, wanted) == 0.0
    assert linear.damping(0.0, wanted) == 0.5 * wanted


# --- limits ----------------------------------------------------------------------------------------


def at_the_edge(body: Body, seed: int):
    """A pose close to its limits with goals far away: the step, the state, and the pose one step later."""
    rng = np.random.default_rng(seed)
    state = body.random(rng, share=0.98)
    for j, dof in body.dofs.joints.items():
        if isinstance(dof, sp.Hinges):
            near = np.where(rng.random(dof.size) < 0.5, dof.lower + 0.01, dof.upper - 0.01)
            state = body.set_angles(state, j, near)
    tasks, goals = random_stack(body, state, rng, 4, 1.0)
    solver = body.solver(tasks, iterations=1, cold_iterations=1)
    start = body.pose(state)
    return solver.compute_step(goals, start=start), state, solver.solve(goals, start=start).pose


def hinge_columns(body: Body):
    """(column, joint, number) of every hinge."""
    return [(c, j, k) for c, (j, k) in enumerate(body.columns) if isinstance(body.dofs[j], sp.Hinges)]


@pytest.mark.parametrize("make", [figure, rig, limb, robot], ids=lambda make: make.__name__)
def test_locked_hinges_go_exactly_to_their_bound(make):
    """Of every hinge the step stays within its range; a locked one gets exactly what is left to its bound."""
    body, locked = make(), 0
    for seed in range(12):
        step, state, _ = at_the_edge(body, seed)
        for c, j, k in hinge_columns(body):
            low, high = body.dofs[j].lower[k], body.dofs[j].upper[k]
            there = state.angles[j, k] + step.step[c]
            assert low - 1e-8 <= there <= high + 1e-8
            if step.locked[c]:
                assert min(abs(there - low), abs(there - high)) < 1e-12
                locked += 1
    assert locked > 4


def signed_room(limit: sp.SwingTwist, matrix: np.ndarray) -> np.ndarray:
    """How far inside its swing limit a rotation is, and inside its twist limits [rad]; negative outside."""
    segment = matrix @ limit.axis
    psi = np.arccos(np.clip(segment @ limit.axis, -1, 1))
    swing = Rotation.from_rotvec(np.cross(limit.axis, segment) * psi / np.sin(psi)).as_matrix()
    twist = (Rotation.from_matrix(swing.T @ matrix)).as_rotvec() @ limit.axis
    theta = np.arctan2(segment @ limit.side, segment @ limit.forward)
    return np.array([limit.compute_limit(theta) - psi, min(twist - limit.twist[0], limit.twist[1] - twist)])


def test_locked_directions_meet_the_linearised_limit():
    """A locked direction of a ball is the gradient of a limit, and the step takes that limit to zero."""
    body, met = figure(), 0
    for seed in range(10):
        step, state, _ = at_the_edge(body, seed)
        for j in {body.columns[int(np.flatnonzero(row)[0])][0] for row in step.directions}:
            columns = [c for c, (i, _) in enumerate(body.columns) if i == j]
            own = step.directions[:, columns]
            own = own[np.linalg.norm(own, axis=1) > 0.5]
            limit, here = body.dofs[j].limit, Rotation.from_quat(state.local[j])
            turn, room = step.step[columns], signed_room(limit, here.as_matrix())
            h = 1e-4
            slope = np.stack(
                [
                    signed_room(limit, (Rotation.from_rotvec(h * e) * here).as_matrix())
                    - signed_room(limit, (Rotation.from_rotvec(-h * e) * here).as_matrix())
                    for e in np.eye(3)
                ]
            ) / (2 * h)
            spanned = np.linalg.norm(own @ slope, axis=0) > (1 - 1e-4) * np.linalg.norm(slope, axis=0)
            after = room + turn @ slope
            assert spanned.any() and np.abs(after[spanned]).max() < 1e-5
            met += 1
    assert met > 5


@pytest.mark.parametrize("make", [figure, rig, limb, robot], ids=lambda make: make.__name__)
def test_no_joint_leaves_its_limits(make):
    """Whatever is asked for, every pose is within its hinge ranges, swing cones and twists."""
    body = make()
    for seed in range(12):
        _, _, pose = at_the_edge(body, seed)
        local = body.locals(pose)
        for j, dof in body.dofs.joints.items():
            if isinstance(dof, sp.Hinges):
                angles = dof.compute_angles(Rotation.from_matrix(local[j]).as_quat())
                assert np.all(angles > dof.lower - 1e-7) and np.all(angles < dof.upper + 1e-7)
            elif isinstance(dof, sp.Ball) and dof.limit is not None:
                assert max(excess[0] for excess in limit_excess(dof.limit, local[j][None])) < 1e-6


def test_a_joint_leaves_its_limit_again():
    """An elbow that was pressed against its end opens when the goal goes back, and is used until then."""
    body = limb(low=-1.2)
    solver = body.solver([sp.PositionTask("hand")])
    bent = body.set_angles(body.rest(), 1, -0.6)
    near = solver.solve({"hand": (0.0, -0.1, 0.1)}, start=body.pose(bent))
    assert near.state[0][-2, 0] == -1.2
    assert near.gave_way["hand"] == ("joint limits",)
    far = solver.solve({"hand": (0.0, -0.5, 0.15)}, previous=near)
    assert far.status is sp.Status.CONVERGED and far.residual[0] < 1e-3
    assert far.state[0][-2, 0] > -1.1


def test_a_pose_outside_its_limits_is_taken_inside_first():
    """Started beyond a limit, the joint is at the limit before the first step."""
    body = limb()
    state = body.set_angles(body.rest(), 1, 0.5)
    solution = body.solver(
        [sp.PositionTask("hand")], iterations=0, least_iterations=0, cold_iterations=0
    ).solve({"hand": (0.0, -0.5, 0.0)}, start=body.pose(state))
    np.testing.assert_allclose(body.locals(solution.pose)[1], np.eye(3), atol=1e-12)


# --- conflicts -------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_of_two_conflicting_tasks_the_less_important_is_at_its_constrained_optimum(seed):
    """The first is met to 1 mm; no pose that keeps it brings the second nearer (SciPy's SLSQP)."""
    body, rng = robot(), np.random.default_rng(seed)
    there = body.random(rng, 0.5)
    goal = body.world(there)[0][body.joint("tip")]
    wish = body.world(there)[0][body.joint("wrist")] + rng.normal(size=3) * 0.15
    tasks = [sp.PositionTask("tip", level=0), sp.PositionTask("wrist", level=1)]
    solver = body.solver(tasks, iterations=200, cold_iterations=200)
    solution = None
    for _ in range(5):
        solution = solver.solve({"tip": goal, "wrist": wish}, previous=solution)
    assert solution.residual[0] < 1e-3
    assert solution.gave_way.get("wrist", ("tip",))[0] == "tip"

    def place(q: np.ndarray, at: str) -> np.ndarray:
        return body.world(body.moved(body.rest(), q))[0][body.joint(at)]

    angles = solution.state[0][len(body.skeleton) + 1 :]
    start = np.array([angles[j, k] for j, k in body.columns])
    bounds = [(body.dofs[j].lower[k], body.dofs[j].upper[k]) for j, k in body.columns]
    best = minimize(
        lambda q: 0.5 * np.sum((place(q, "wrist") - wish) ** 2),
        start,
        method="SLSQP",
        bounds=bounds,
        constraints={"type": "eq", "fun": lambda q: place(q, "tip") - goal},
        options={"maxiter": 100, "ftol": 1e-10},
    )
    nearest = np.linalg.norm(place(best.x, "wrist") - wish)
    assert nearest > 0.02  # they do conflict
    assert solution.residual[1] < nearest + 2e-3


@pytest.mark.parametrize("gain", [1.0, 0.5])
def test_a_hopeless_task_does_not_keep_a_more_important_one_from_being_met(gain):
    """The end of a snake gets where it should to 1 mm although its middle is drawn elsewhere."""
    body = snake()
    tasks = [sp.PositionTask("s20"), sp.PositionTask("s10", level=1)]
    solver = body.solver(tasks, gain=gain, iterations=100, cold_iterations=100)
    goals = {"s20": (0.0, 0.0, 1.7), "s10": (0.0, 0.9, 0.6)}
    start = body.random(np.random.default_rng(0), 0.1)
    assert solver.solve(goals, start=body.pose(start)).residual[0] < 1e-3


# --- linear algebra --------------------------------------------------------------------------------


class Rows:
    """Random rows of a given rank beside an orthonormal basis, split by the code under test."""

    def __init__(self, seed: int, count: int, rank: int, size: int = 0) -> None:
        rng = np.random.default_rng(seed)
        self.rank = min(rank, count)
        self.rows = rng.normal(size=(count, self.rank)) @ rng.normal(size=(self.rank, 14))
        self.basis = np.linalg.qr(rng.normal(size=(14, size)))[0].T if size else np.zeros((0, 14))
        self.right, self.count = rng.normal(size=count), count
        work = np.vstack([self.rows, self.basis, np.zeros((count, 14))])
        self.small = np.zeros((2 * count + 3, count))
        self.found = linear.extend_basis(work, 0, count, count, size, self.small, 1e-6)
        self.whole = work[count : count + size + self.found]

    def solve(self, largest: float) -> np.ndarray:
        """Damped solution in all columns."""
        right, answer = 2 * self.count, 2 * self.count + 2
        self.small[right] = self.right
        linear.solve_damped(self.small, self.count, self.found, right, answer, largest, 1e-6)
        return self.small[answer, : self.found] @ self.whole


@settings(max_examples=60, deadline=None)
@given(seed=seeds, count=st.integers(1, 6), size=st.integers(0, 6), rank=st.integers(0, 6))
def test_the_basis_spans_what_is_added(seed, count, size, rank):
    """New rows are orthonormal, orthogonal to the old ones, and L V restores what was added beside them."""
    r = Rows(seed, count, rank, size)
    beside = r.rows - r.rows @ r.basis.T @ r.basis
    assert r.found == r.rank == np.linalg.matrix_rank(beside, 1e-6)
    np.testing.assert_allclose(r.whole @ r.whole.T, np.eye(size + r.found), atol=1e-12)
    np.testing.assert_allclose(r.whole[:size], r.basis)
    np.testing.assert_allclose(r.small[:count, : r.found] @ r.whole[size:], beside, atol=1e-5)


@settings(max_examples=80, deadline=None)
@given(
    seed=seeds,
    count=st.integers(1, 6),
    rank=st.integers(1, 6),
    largest=st.sampled_from([1e-2, 0.4, 3.0, 1e3]),
)
def test_solutions_are_damped_least_squares(seed, count, rank, largest):
    """The answer minimises |J x - r|^2 + lambda^2 |x|^2, of any rank, and is no longer than asked for."""
    r = Rows(seed, count, rank)
    least = np.linalg.svd(r.rows)[1][: r.rank].min()
    shrink = linear.damping(least, np.linalg.norm(r.right) / largest)
    u, s, v = np.linalg.svd(r.rows, full_matrices=False)
    u, s, v = u[:, : r.rank], s[: r.rank], v[: r.rank]
    found = r.solve(largest)
    np.testing.assert_allclose(found, v.T @ (s / (s**2 + shrink**2) * (u.T @ r.right)), rtol=1e-6, atol=1e-7)
    assert np.linalg.norm(found) <= largest * (1 + 1e-9)


@settings(max_examples=60, deadline=None)
@given(seed=seeds, count=st.integers(1, 6), rank=st.integers(1, 6))
def test_undamped_solutions_are_the_pseudoinverse(seed, count, rank):
    """Without a bound the answer is pinv(J) r, of full rank and of less."""
    r = Rows(seed, count, rank)
    expected = np.linalg.pinv(r.rows, 1e-9) @ r.right
    np.testing.assert_allclose(r.solve(1e12), expected, rtol=1e-5, atol=1e-7)
