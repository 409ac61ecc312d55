"""Jacobian methods: the Jacobian itself, the five step rules, and the loop around them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

import sixpoint as sp
from sixpoint.solvers.jacobian import frame, steps
from sixpoint.solvers.six_points.model import build_model
from sixpoint.solvers.six_points.tree import BALL, ENDS, FIXED, HINGE, Tree, build_tree, place_joints
from test_solvers import FIGURE, measured, points_of

MODEL = build_model(FIGURE)
RULES = {
    "transpose": steps.TRANSPOSE,
    "pseudoinverse": steps.PSEUDOINVERSE,
    "dls": steps.DLS,
    "dls-svd": steps.DLS_SVD,
    "sdls": steps.SDLS,
}
NAMES = ("jt", "pinv", "dls", "dls-svd", "sdls")
CAPS = np.radians([30, 5, 45, 45, 45])
LAMBDA = 0.075
seeds = st.integers(0, 2**32 - 1)


# --- an independent model: angles -> places by SciPy matrices -----------------------------------------


def make_tree(free_root: bool = False) -> Tree:
    tree = build_tree(FIGURE, MODEL)
    if free_root:
        tree.kind[0] = BALL
    return tree


def starts_of(tree: Tree) -> tuple[np.ndarray, int]:
    """First angle of each joint, and how many there are."""
    sizes = np.array([{FIXED: 0, BALL: 3, HINGE: 1}[int(kind)] for kind in tree.kind])
    return np.cumsum(sizes) - sizes, int(sizes.sum())


def place_ends(tree: Tree, local: np.ndarray, root: np.ndarray) -> np.ndarray:
    """Where the five ends are (5, 3) for local rotation matrices (rows, 3, 3)."""
    rows = len(tree.parents)
    world, places = np.array(local), np.tile(root, (rows, 1))
    for j in range(1, rows):
        p = tree.parents[j]
        places[j] = places[p] + world[p] @ tree.offsets[j, :3]
        world[j] = world[p] @ local[j]
    return np.array([places[j] + world[j] @ tree.offsets[rows + k, :3] for k, j in enumerate(tree.ends)])


def turned(tree: Tree, q: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """Local matrices at the angles q, R = Rx Ry Rz; fixed joints keep theirs."""
    starts, _ = starts_of(tree)
    local = np.array(fixed)
    for j, kind in enumerate(tree.kind):
        if kind == BALL:
            local[j] = Rotation.from_euler("XYZ", q[starts[j] : starts[j] + 3]).as_matrix()
        elif kind == HINGE:
            local[j] = Rotation.from_euler("X", q[starts[j]]).as_matrix()
    return local


def random_posture(
    tree: Tree, rng: np.random.Generator, locked: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Angles (n,) and local matrices; a share of ball joints is in gimbal lock, their last angle zero."""
    starts, n = starts_of(tree)
    q = rng.uniform(-1.2, 1.2, n)
    for j in np.flatnonzero(tree.kind == BALL):
        if rng.uniform() < locked:
            q[starts[j] + 1 : starts[j] + 3] = rng.choice([-np.pi / 2, np.pi / 2]), 0.0
    fixed = np.tile(np.eye(3), (len(tree.kind), 1, 1))
    if tree.kind[0] == FIXED:
        fixed[0] = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    return [q, turned(tree, q, fixed)]


def jacobian_of(tree: Tree, local: np.ndarray, known: np.ndarray | None = None) -> tuple[np.ndarray, ...]:
    """The Jacobian (15, n) and levers (5, n) that the solver fills, and its place of the ends."""
    rows, (starts, n) = len(tree.kind), starts_of(tree)
    quats = Rotation.from_matrix(local).as_quat()
    world, positions = np.zeros((rows, 4)), np.zeros((rows, 4))
    filled = np.zeros((6, 4))
    filled[:, 3] = 1.0 if known is None else known
    place_joints(tree.offsets, tree.parents, quats, (0.3, 1.0, -0.2), world, positions)
    jacobian, levers = np.full((frame.M, n), np.nan), np.full((ENDS, n), np.nan)
    frame.fill_jacobian(tree, starts, filled, quats, world, positions, jacobian, levers)
    return jacobian, levers


def real_jacobian(rng: np.random.Generator, lost: bool = False) -> np.ndarray:
    """Of the figure in a random posture; straight arms and legs or lost wrists make it lose rank."""
    tree = make_tree()
    _, local = random_posture(tree, rng)
    if lost:
        local[tree.kind == HINGE] = np.eye(3)
    known = np.array([1, 1, 0, 1, 1, 0]) if lost else None
    return jacobian_of(tree, local, known)[0]


def random_jacobian(rng: np.random.Generator, blocks: int | None = None, n: int | None = None) -> np.ndarray:
    m = 3 * int(rng.integers(1, 5) if blocks is None else blocks)
    return rng.normal(size=(m, int(rng.integers(1, 25)) if n is None else n))


def step_of(
    rule: str, jacobian: np.ndarray, error: np.ndarray, damping: float = LAMBDA, cap: bool = True
) -> np.ndarray:
    """A step of the joint angles by one of the rules."""
    m, n = jacobian.shape
    rows, small, step = np.zeros((2 * m, n)), np.zeros((2 * m + steps.EXTRA, m)), np.full(n, np.nan)
    rows[:m], small[steps.error_row(small)] = jacobian, error
    levers = np.linalg.norm(jacobian.reshape(-1, 3, n), axis=1)
    if cap:
        steps.compute_step(RULES[rule], rows, m, small, damping, levers, np.zeros(n), step)
    elif rule == "transpose":
        steps.transpose_step(rows, m, small, step)
    elif rule == "dls":
        steps.solve_normal(rows, m, small, damping)
        steps.combine(rows, 0, m, small, steps.answer_row(small), step)
    else:
        steps.filtered_step(rows, m, small, RULES[rule], damping, step)
    return step


def textbook_sdls(jacobian: np.ndarray, e: np.ndarray, most: float = np.pi / 4) -> np.ndarray:
    """Selectively damped least squares as in the paper of Buss and Kim 2005, section 4."""
    u, sigma, vt = np.linalg.svd(jacobian, full_matrices=False)
    rho = np.linalg.norm(jacobian.reshape(-1, 3, jacobian.shape[1]), axis=1)

    def clamp(w: np.ndarray, largest: float) -> np.ndarray:
        return w if np.abs(w).max() <= largest else w * (largest / np.abs(w).max())

    total = np.zeros(jacobian.shape[1])
    for i in np.flatnonzero(sigma > 1e-10):
        n_i = np.linalg.norm(u[:, i].reshape(-1, 3), axis=1).sum()
        m_i = (np.abs(vt[i]) * rho).sum() / sigma[i]
        gamma = min(1.0, n_i / m_i) * most
        total += clamp((u[:, i] @ e) / sigma[i] * vt[i], gamma)
    return clamp(total, most)


# --- Jacobian and angles ------------------------------------------------------------------------------


@pytest.mark.parametrize("free_root", [False, True])
@pytest.mark.parametrize("locked", [0.0, 0.4])
def test_the_jacobian_is_that_of_forward_kinematics(free_root, locked):
    """Each column is the central difference of all ends by one XYZ angle, in gimbal lock as well."""
    tree, h = make_tree(free_root), 1e-5
    for seed in range(3):
        q, local = random_posture(tree, np.random.default_rng(seed), locked)
        jacobian, levers = jacobian_of(tree, local)
        expected = np.empty_like(jacobian)
        for c in range(len(q)):
            change = h * (np.arange(len(q)) == c)
            ends = [place_ends(tree, turned(tree, q + s * change, local), np.zeros(3)) for s in (1, -1)]
            expected[:, c] = ((ends[0] - ends[1]) / (2 * h)).ravel()
        np.testing.assert_allclose(jacobian, expected, atol=1e-6)
        np.testing.assert_allclose(levers, np.linalg.norm(expected.reshape(5, 3, -1), axis=1), atol=1e-6)
        assert np.abs(jacobian).max(axis=0).min() > 1e-3  # no angle without an effect


def test_a_lost_end_asks_for_nothing():
    """Rows of lost wrists and ankles are zero, the others are what they were."""
    tree = make_tree()
    _, local = random_posture(tree, np.random.default_rng(5))
    whole, _ = jacobian_of(tree, local)
    part, levers = jacobian_of(tree, local, np.array([1, 1, 0, 1, 0, 1]))
    lost = np.repeat([False, True, False, True, False], 3)
    assert not part[lost].any() and not levers[[1, 3]].any()
    np.testing.assert_array_equal(part[~lost], whole[~lost])


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_euler_angles_are_those_of_scipy(seed):
    """Angles of R = Rx Ry Rz and back, as SciPy's intrinsic XYZ."""
    q = Rotation.random(random_state=seed)
    angles = frame.euler_angles(tuple(q.as_quat()))
    np.testing.assert_allclose(angles, q.as_euler("XYZ"), atol=1e-7)
    back = np.array(frame.from_euler(*angles))
    assert (Rotation.from_quat(back).inv() * q).magnitude() < 1e-9
    assert np.linalg.norm(back) == pytest.approx(1.0, abs=1e-12)
    free = np.random.default_rng(seed).uniform(-9, 9, 3)
    turn = Rotation.from_quat(frame.from_euler(*free)).inv() * Rotation.from_euler("XYZ", free)
    assert turn.magnitude() < 1e-9


@settings(max_examples=60, deadline=None)
@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1), st.sampled_from([-1, 1]), st.floats(0, 3e-7))
def test_gimbal_lock_has_no_third_angle(a, c, sign, short):
    """With the middle angle at 90 degrees the third is zero and the rotation is kept."""
    q = Rotation.from_euler("XYZ", [a, sign * (np.pi / 2 - short), c])
    angles = frame.euler_angles(tuple(q.as_quat()))
    assert angles[2] == 0.0
    assert angles[1] == pytest.approx(sign * np.pi / 2, abs=1e-6)
    assert (Rotation.from_quat(frame.from_euler(*angles)).inv() * q).magnitude() <= 2 * short + 1e-7


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_a_step_turns_every_joint_by_its_angles(seed):
    """Applying dq gives the joints at q + dq, and fixed joints stay."""
    rng = np.random.default_rng(seed)
    tree = make_tree()
    q, local = random_posture(tree, rng)
    starts, n = starts_of(tree)
    dq, quats = rng.uniform(-0.3, 0.3, n), Rotation.from_matrix(local).as_quat()
    frame.apply_step(tree, MODEL.balls, starts, False, dq, quats)
    np.testing.assert_allclose(Rotation.from_quat(quats).as_matrix(), turned(tree, q + dq, local), atol=1e-9)


# --- step rules ---------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(seeds, st.booleans())
def test_the_transpose_step_is_an_exact_line_search(seed, real):
    """Along J^T e no other length leaves a smaller error, and the error shrinks."""
    rng = np.random.default_rng(seed)
    jacobian = real_jacobian(rng) if real else random_jacobian(rng)
    e = 0.1 * rng.normal(size=len(jacobian))
    gradient, dq = jacobian.T @ e, step_of("transpose", jacobian, e, cap=False)
    length = (dq @ gradient) / (gradient @ gradient)
    np.testing.assert_allclose(dq, length * gradient, atol=1e-12 * np.abs(dq).max())
    moved = jacobian @ gradient
    best = minimize_scalar(lambda a: np.sum((e - a * moved) ** 2), method="brent", tol=1e-12).x
    assert length == pytest.approx(best, rel=1e-4)  # as flat as it is, the minimum is not sharper
    assert moved @ (e - length * moved) == pytest.approx(0.0, abs=1e-9 * np.abs(moved @ e))
    capped = step_of("transpose", jacobian, e)
    for step in (dq, capped):
        assert np.linalg.norm(e - jacobian @ step) < np.linalg.norm(e)


@settings(max_examples=40, deadline=None)
@given(seeds, st.sampled_from(["random", "real", "lost"]))
def test_the_pseudoinverse_is_that_of_numpy(seed, kind):
    """J^+ e with singular values below 1 % of the largest dropped, as numpy.linalg.pinv does."""
    rng = np.random.default_rng(seed)
    jacobian = random_jacobian(rng) if kind == "random" else real_jacobian(rng, kind == "lost")
    sigma = np.linalg.svd(jacobian, compute_uv=False)
    if np.any(np.abs(sigma / sigma[0] - 0.01) < 1e-6):
        return  # on the very cut
    e = rng.normal(size=len(jacobian))
    expected = np.linalg.pinv(jacobian, rcond=0.01) @ e
    np.testing.assert_allclose(
        step_of("pseudoinverse", jacobian, e, cap=False), expected, atol=1e-9 * np.abs(expected).max()
    )


def test_the_cut_of_the_pseudoinverse_is_one_percent():
    """A singular value just above 1 % of the largest counts, one just below does not."""
    rng = np.random.default_rng(0)
    u, v = (np.linalg.qr(rng.normal(size=(k, 3)))[0] for k in (3, 8))
    e = u @ [1.0, 1.0, 1.0]
    for least, counts in ((0.0101, True), (0.0099, False)):
        dq = step_of("pseudoinverse", u @ np.diag([1.0, 0.5, least]) @ v.T, e, cap=False)
        assert v[:, 2] @ dq == pytest.approx(1 / least if counts else 0.0, abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(seeds, st.sampled_from(["random", "real", "lost"]), st.floats(0.01, 2.0))
def test_damped_least_squares_are_the_direct_solution(seed, kind, damping):
    """Both ways give J^T (J J^T + lambda^2 I)^-1 e, also where J has lost rank."""
    rng = np.random.default_rng(seed)
    jacobian = random_jacobian(rng) if kind == "random" else real_jacobian(rng, kind == "lost")
    e = rng.normal(size=len(jacobian)) * 0.1
    normal = jacobian @ jacobian.T + damping**2 * np.eye(len(jacobian))
    expected = jacobian.T @ np.linalg.solve(normal, e)
    for rule in ("dls", "dls-svd"):
        np.testing.assert_allclose(step_of(rule, jacobian, e, damping, cap=False), expected, atol=1e-10)
    plain, singular = (step_of(rule, jacobian, e, damping) for rule in ("dls", "dls-svd"))
    np.testing.assert_allclose(plain, singular, atol=1e-10)


@pytest.mark.parametrize("rule", ["dls", "dls-svd"])
def test_damping_leads_from_the_pseudoinverse_to_the_gradient(rule):
    """Without damping it is the pseudoinverse; with much of it J^T e / lambda^2."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        jacobian, e = random_jacobian(rng, 2, 15), 0.1 * rng.normal(size=6)
        inverse = np.linalg.pinv(jacobian) @ e
        np.testing.assert_allclose(step_of(rule, jacobian, e, 1e-6, cap=False), inverse, atol=1e-9)
        assert not np.allclose(step_of(rule, jacobian, e, 1.0, cap=False), inverse, rtol=1e-2)
        gradient = jacobian.T @ e / 1e8
        np.testing.assert_allclose(
            step_of(rule, jacobian, e, 1e4, cap=False), gradient, atol=1e-6 * np.abs(gradient).max()
        )


@settings(max_examples=30, deadline=None)
@given(seeds, st.sampled_from(["random", "real", "lost"]), st.floats(-2, 1))
def test_selective_damping_is_that_of_the_paper(seed, kind, scale):
    """Every singular direction is clamped by how far it moves the ends, and the sum once more."""
    rng = np.random.default_rng(seed)
    jacobian = random_jacobian(rng) if kind == "random" else real_jacobian(rng, kind == "lost")
    e = 10.0**scale * rng.normal(size=len(jacobian))
    np.testing.assert_allclose(step_of("sdls", jacobian, e), textbook_sdls(jacobian, e), atol=1e-9)


def test_each_clamp_of_selective_damping_is_met():
    """Among the cases above are steps with no clamp, clamped directions only, and a clamped sum."""
    seen = set()
    for seed in range(60):
        rng = np.random.default_rng(seed)
        jacobian, e = random_jacobian(rng), 10.0 ** rng.uniform(-3, 1) * rng.normal()
        e = e * rng.normal(size=len(jacobian))
        step, plain = step_of("sdls", jacobian, e), np.linalg.pinv(jacobian) @ e
        if np.allclose(step, plain, rtol=1e-9):
            seen.add("none")
        else:
            seen.add("sum" if np.abs(step).max() > np.pi / 4 - 1e-9 else "directions")
    assert seen == {"none", "sum", "directions"}


@settings(max_examples=30, deadline=None)
@given(seeds, st.booleans())
def test_a_small_selective_step_is_the_pseudoinverse(seed, real):
    """Where nothing has to be clamped, SDLS is J^+ e."""
    rng = np.random.default_rng(seed)
    jacobian = real_jacobian(rng) if real else random_jacobian(rng)
    if np.linalg.cond(jacobian) > 1e4:
        return
    e = 1e-7 * rng.normal(size=len(jacobian))
    expected = np.linalg.pinv(jacobian) @ e
    np.testing.assert_allclose(step_of("sdls", jacobian, e), expected, rtol=1e-6, atol=1e-14)


numbers = st.one_of(st.floats(-3, 3), st.just(0.0), st.floats(-1e-9, 1e-9))
errors = st.one_of(st.floats(-1e12, 1e12), st.floats(-1, 1), st.just(0.0))


@pytest.mark.parametrize("rule", RULES)
@settings(max_examples=40, deadline=None)
@given(arrays(float, (6, 7), elements=numbers), arrays(float, 6, elements=errors))
def test_no_step_is_larger_than_its_cap(rule, jacobian, error):
    """Whatever Jacobian and errors, no joint turns by more than 30, 5, 45, 45, 45 degrees."""
    step = step_of(rule, jacobian, error)
    assert np.abs(step).max() <= CAPS[RULES[rule]] * (1 + 1e-12)


@pytest.mark.parametrize("rule", RULES)
def test_a_capped_step_keeps_its_direction(rule):
    """A huge error turns the fastest joint by exactly the cap, all others in proportion."""
    rng = np.random.default_rng(2)
    jacobian, e = random_jacobian(rng, 2, 9), 1e3 * rng.normal(size=6)
    step = step_of(rule, jacobian, e)
    assert np.abs(step).max() == pytest.approx(CAPS[RULES[rule]], abs=1e-12)
    if rule != "sdls":
        free = step_of(rule, jacobian, e, cap=False)
        np.testing.assert_allclose(step, free * (CAPS[RULES[rule]] / np.abs(free).max()), atol=1e-12)


@pytest.mark.parametrize("rule", RULES)
@settings(max_examples=15, deadline=None)
@given(seeds, st.floats(0.05, 20), st.booleans())
def test_units_of_length_do_not_matter(rule, seed, scale, real):
    """Lengths, errors and damping in other units give the same angles."""
    rng = np.random.default_rng(seed)
    jacobian = real_jacobian(rng) if real else random_jacobian(rng)
    e = 0.1 * rng.normal(size=len(jacobian))
    step = step_of(rule, jacobian, e)
    scaled = step_of(rule, scale * jacobian, scale * e, scale * LAMBDA)
    np.testing.assert_allclose(scaled, step, atol=1e-9)
    assert np.abs(step).max() > 0


@pytest.mark.parametrize("rule", RULES)
def test_frozen_joints_do_not_turn(rule):
    """A joint that moves no end gets no part of the step."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        jacobian = random_jacobian(rng, 3, 14)
        frozen = rng.uniform(size=14) < 0.4
        jacobian[:, frozen] = 0.0
        step = step_of(rule, jacobian, rng.normal(size=9))
        assert (step[frozen] == 0.0).all() and (step[~frozen] != 0.0).all()


@pytest.mark.parametrize("rule", RULES)
def test_nothing_to_do_is_no_step(rule):
    """Without an error, or without any way to move, the step is zero."""
    rng = np.random.default_rng(1)
    assert not step_of(rule, random_jacobian(rng, 2, 9), np.zeros(6)).any()
    assert not step_of(rule, np.zeros((6, 9)), rng.normal(size=6)).any()


# --- the loop -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("kind", [HINGE, BALL])
def test_one_joint_reaches_a_target_in_its_plane(rule, kind):
    """One joint with one end turns to a target 60 degrees away, as far off, in a few iterations."""
    angle, lever = np.radians(60), np.array([0.0, 0.0, 0.4])
    offsets = np.zeros((1 + ENDS, 4))
    offsets[1, :3] = lever
    tree = Tree(offsets, np.zeros((1, 2)), np.array([-1]), np.zeros(ENDS, int), np.array([kind]))
    starts, n = starts_of(tree)
    goal = Rotation.from_rotvec([angle, 0, 0]).apply(lever)
    local, filled = np.array([[0.0, 0, 0, 1]]), np.zeros((6, 4))
    filled[:2, 3], filled[1, :3] = 1.0, goal
    world, positions = np.zeros((1, 4)), np.zeros((1, 4))
    few = 20 if rule == "pseudoinverse" else 8  # its cap of 5 degrees alone asks for twelve
    for _ in range(few):
        place_joints(offsets, tree.parents, local, (0.0, 0.0, 0.0), world, positions)
        jacobian, levers = np.zeros((frame.M, n)), np.zeros((ENDS, n))
        frame.fill_jacobian(tree, starts, filled, local, world, positions, jacobian, levers)
        small = np.zeros((frame.SMALL_ROWS, frame.M))
        largest = frame.write_errors(tree, filled, world, positions, 0.1, small)
        if largest < 0.01:
            break
        e = small[steps.error_row(small)]
        frame.apply_step(tree, MODEL.balls, starts, False, step_of(rule, jacobian, e), local)
    reached = Rotation.from_quat(local[0]).apply(lever)
    assert np.linalg.norm(reached - goal) < 0.01
    assert Rotation.from_quat(local[0]).as_rotvec()[0] == pytest.approx(angle, abs=0.03)


def test_each_error_is_shortened_on_its_own():
    """An end is asked to move by at most the reach, in its own direction; the whole error is what counts."""
    tree, rows = make_tree(), len(MODEL.segments) + 10
    _, local = random_posture(tree, np.random.default_rng(3))
    world, positions, filled = np.zeros((rows, 4)), np.zeros((rows, 4)), np.ones((6, 4))
    quats = Rotation.from_matrix(local).as_quat()
    place_joints(tree.offsets, tree.parents, quats, (0.0, 0.0, 0.0), world, positions)
    ends = place_ends(tree, local, np.zeros(3))
    gaps = np.array([[0.03, 0, 0], [0, 0.04, 0.03], [0.3, 0.4, 0], [0, 0, -0.2], [0.06, 0.0, 0.08]])
    filled[1:, :3], filled[4, 3] = ends + gaps, 0.0  # the left ankle is lost
    small = np.zeros((frame.SMALL_ROWS, frame.M))
    assert frame.write_errors(tree, filled, world, positions, 0.1, small) == pytest.approx(0.5)
    expected = np.array([gaps[0], gaps[1], gaps[2] / 5, [0, 0, 0], gaps[4]])
    np.testing.assert_allclose(small[steps.error_row(small)], expected.ravel(), atol=1e-12)


@pytest.mark.parametrize("limits", [True, False])
@pytest.mark.parametrize("sample", sorted(sp.SAMPLES))
def test_both_ways_of_damping_give_the_same_motion(sample, limits):
    """DLS and DLS with singular values are one method: all joints agree in every frame."""
    targets = FIGURE.targets(sp.make_sample(sample, FIGURE))
    places = [sp.make_solver(n, FIGURE, limits=limits).solve_motion(targets).positions for n in NAMES[2:4]]
    np.testing.assert_allclose(places[0], places[1], atol=1e-8)


@pytest.mark.parametrize("name", NAMES)
def test_iterations_end_by_the_papers_rule(name):
    """At most 20, one where it is within 1 cm at once, two where nothing is gained any more."""
    far = points_of(FIGURE)
    far[2:4] += [[0.2, 0.3, 0.4], [-0.2, 0.3, 0.4]]
    limited = [sp.make_solver(name, FIGURE, reach=r, limits=False).solve(far) for r in (0.01, 1e-4)]
    assert [s.iterations for s in limited] == [20, 2]
    solver, solution = sp.make_solver(name, FIGURE, limits=False), None
    for _ in range(100):
        solution = solver.solve(points_of(FIGURE), previous=solution)
    assert solution.iterations == 1 and solution.residual.max() < 0.01
    targets, used, solution = FIGURE.targets(sp.make_sample("jump_kick", FIGURE)), [], None
    for points in targets.positions[:150]:
        solution = solver.solve(points, previous=solution)
        used.append(solution.iterations)
    assert 1 <= min(used) < max(used) <= 20


@pytest.mark.parametrize("name", NAMES)
def test_what_the_trunk_misses_is_shared(name):
    """Pelvis and head miss their targets alike (Algorithm 2, line 17)."""
    targets = FIGURE.targets(sp.make_sample("boxing", FIGURE))
    residual = sp.make_solver(name, FIGURE).solve_frames(targets).residual
    np.testing.assert_allclose(residual[:, 0], residual[:, 1], atol=1e-12)
    assert residual[:, 0].max() > 1e-3


def leaning_back() -> np.ndarray:
    """Six points of a figure whose pelvis is upright and whose spine alone leans back, 12 degrees a joint."""
    local = np.tile([0.0, 0.0, 0.0, 1.0], (1, len(FIGURE.skeleton), 1))
    for joint in FIGURE.spine_chain.joints[1:]:
        local[0, joint] = Rotation.from_euler("X", -12, degrees=True).as_quat()
    return measured(FIGURE, FIGURE.compute_motion(local, np.zeros((1, 3)), 60.0))[0]


@pytest.mark.parametrize("name", NAMES)
def test_a_solved_root_mends_a_wrong_pelvis(name):
    """A pelvis estimated 11 degrees off is turned back by ``solve_root``, and the points are met better."""
    solutions = [
        sp.make_solver(name, FIGURE, weights=(1, 1, 0), solve_root=free).solve(leaning_back())
        for free in (False, True)
    ]
    off = [Rotation.from_quat(s.pose.rotations[0]).magnitude() for s in solutions]
    assert off[0] == pytest.approx(np.radians(11.2), abs=0.01)  # the estimate, kept
    assert off[1] < 0.6 * off[0]
    assert solutions[1].residual.max() < 0.75 * solutions[0].residual.max()


@pytest.mark.parametrize("sample", sorted(sp.SAMPLES))
def test_more_damping_meets_the_points_worse(sample):
    """Over the sweep of damping factors the points are missed by more and more, and never lost."""
    targets = FIGURE.targets(sp.make_sample(sample, FIGURE))
    solved = [
        sp.make_solver("dls", FIGURE, damping=damping, limits=False).solve_frames(targets)
        for damping in (0.03, 0.075, 0.15, 0.3, 0.75)
    ]
    missed = np.array([np.median(s.residual.max(axis=1)) for s in solved])
    assert (np.diff(missed) > 1e-4).all()
    assert all(np.isfinite(s.motion.rotations).all() and s.residual.max() < 0.5 for s in solved)


def test_options_that_a_rule_does_not_use_change_nothing():
    """Damping belongs to DLS alone; the reach belongs to all."""
    targets = FIGURE.targets(sp.make_sample("reach", FIGURE).sliced(slice(0, 60)))
    for name in NAMES:
        plain, damped, short = (
            sp.make_solver(name, FIGURE, **o).solve_motion(targets).rotations
            for o in ({}, {"damping": 0.5}, {"reach": 0.02})
        )
        assert np.array_equal(plain, damped) == (name not in ("dls", "dls-svd"))
        assert not np.array_equal(plain, short)


@pytest.mark.parametrize(
    "options",
    [
        {"step": "newton"},
        {"step": "DLS"},
        {"damping": 0.0},
        {"damping": -0.1},
        {"damping": np.nan},
        {"damping": np.inf},
        {"reach": 0.0},
        {"reach": np.nan},
        {"reach": -1.0},
        {"weights": (0, 0, 0)},
    ],
)
def test_wrong_options_are_refused(options):
    """Unknown rules, and lengths that are none, are errors that say what would work."""
    with pytest.raises(sp.SixpointError, match=r"sdls|metres|weights"):
        sp.JacobianIK(FIGURE, **options)
