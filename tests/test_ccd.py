"""Cyclic Coordinate Descent: one joint's step, sweeps, the whole body."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

import sixpoint as sp
from independent import anatomical, limit_excess, world_matrices
from sixpoint.body.dofs import Ball, Hinges
from sixpoint.solvers.ccd import frame
from sixpoint.solvers.six_points.model import build_model
from sixpoint.solvers.six_points.tree import BALL, Tree, build_tree, place_joints
from test_jacobian import MODEL, make_tree, place_ends, random_posture
from test_solvers import FIGURE, as_motion, points_of

TREE = make_tree()
TRUNK = len(MODEL.segments)
# First row, number of joints and rows between them, of the chain of each end: head, arms, legs.
CHAINS = (
    (1, TRUNK - 1, 1),
    *((TRUNK + k, 3, 2) for k in range(2)),
    *((TRUNK + 6 + k, 2, 2) for k in range(2)),
)
ORDERS = ("tip", "root")
seeds = st.integers(0, 2**32 - 1)


class Posture:
    """The joints of the tree as CCD works on them, and where their ends are by SciPy matrices."""

    def __init__(self, local: np.ndarray, tree: Tree = TREE) -> None:
        rows = len(tree.kind)
        self.tree, self.local = tree, np.array(local)
        self.world, self.positions = np.zeros((rows, 4)), np.zeros((rows, 4))
        place_joints(tree.offsets, tree.parents, self.local, (0.0, 0.0, 0.0), self.world, self.positions)

    @classmethod
    def random(cls, rng: np.random.Generator) -> Posture:
        """Every angle drawn."""
        return cls(Rotation.from_matrix(random_posture(TREE, rng)[1]).as_quat())

    @classmethod
    def neutral(cls, tree: Tree = TREE) -> Posture:
        """Standing, arms hanging."""
        return cls(np.tile([0.0, 0.0, 0.0, 1.0], (len(tree.kind), 1)), tree)

    def end(self, end: int) -> np.ndarray:
        """Where an end is, by SciPy."""
        return place_ends(self.tree, Rotation.from_quat(self.local).as_matrix(), np.zeros(3))[end]

    def arrays(self) -> tuple[np.ndarray, ...]:
        """What the compiled functions take."""
        return self.local, self.world, self.positions


def random_target(rng: np.random.Generator) -> tuple[float, ...]:
    return tuple(rng.uniform(-1, 1, 3).tolist())


def spine_angles(figure: sp.Figure, solution: sp.Solution) -> np.ndarray:
    """How far each spine joint is turned, from the lowest up [rad]."""
    motion, chain = as_motion(figure, solution), figure.spine_chain.joints
    turns = [anatomical(figure, motion, j, above)[0] for above, j in zip(chain[:-1], chain[1:], strict=True)]
    return Rotation.from_matrix(turns).magnitude()


# --- one joint ----------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_the_hinge_angle_is_the_best_there_is(seed):
    """No other turn about the axis brings a nearer to b: b . Rot(k, phi) a is largest."""
    rng = np.random.default_rng(seed)
    axis, a, b = rng.normal(size=(3, 3))
    axis /= np.linalg.norm(axis)

    def closeness(phi: float) -> float:
        return float(b @ Rotation.from_rotvec(phi * axis).apply(a))

    phi = frame.hinge_angle(tuple(axis), tuple(a), tuple(b))
    grid = np.linspace(-np.pi, np.pi, 73)
    start = grid[np.argmax([closeness(p) for p in grid])]
    best = minimize_scalar(
        lambda p: -closeness(p), bounds=(start - 0.1, start + 0.1), method="bounded", options={"xatol": 1e-9}
    )
    assert closeness(phi) == pytest.approx(-best.fun, abs=1e-9)
    assert np.cos(phi - best.x) == pytest.approx(1.0, abs=1e-6)


def test_a_lever_on_the_axis_turns_nothing():
    """An end on the hinge's axis, or a target there, asks for no turn; so does one at a ball joint."""
    assert frame.hinge_angle((1.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.1, 0.2, 0.4)) == 0.0
    assert frame.hinge_angle((1.0, 0.0, 0.0), (0.3, 0.1, 0.0), (0.2, 0.0, 0.0)) == 0.0
    still = (0.0, 0.0, 0.0, 1.0)
    assert frame.arc_between((1e-7, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 1.0)) == still
    assert frame.arc_between((0.3, 0.0, 0.0), (0.0, 1e-7, 0.0), (0.0, 0.0, 1.0)) == still


@settings(max_examples=60, deadline=None)
@given(seeds, st.integers(0, 4))
def test_one_step_does_what_it_can(seed, end):
    """A ball joint puts the end on the ray to the target, a hinge as near as it gets; never farther."""
    rng = np.random.default_rng(seed)
    posture, target = Posture.random(rng), random_target(rng)
    first, count, stride = CHAINS[end]
    place = posture.end(end)
    for j in range(first + stride * (count - 1), first - 1, -stride):
        before = np.linalg.norm(place - target)
        pivot, axis = posture.positions[j, :3].copy(), Rotation.from_quat(posture.world[j]).apply([1, 0, 0])
        arguments = (posture.tree, MODEL.balls, False, j, tuple(place), target)
        told = frame.turn_joint(*arguments, *posture.arrays())
        place = posture.end(end)
        np.testing.assert_allclose(told, place, atol=1e-12)
        after = np.linalg.norm(place - target)
        assert after <= before + 1e-12
        if TREE.kind[j] == BALL:
            arm, ray = place - pivot, target - pivot
            np.testing.assert_allclose(arm / np.linalg.norm(arm), ray / np.linalg.norm(ray), atol=1e-7)
        else:
            others = Rotation.from_rotvec(np.linspace(0, 2 * np.pi, 361)[:, None] * axis).apply(place - pivot)
            assert after <= np.linalg.norm(others + pivot - target, axis=1).min() + 1e-12


@pytest.mark.parametrize("from_root", [False, True])
@settings(max_examples=20, deadline=None)
@given(seeds, st.integers(0, 4))
def test_sweeps_never_lead_away(from_root, seed, end):
    """Without limits the error does not grow from sweep to sweep, and much of it goes."""
    rng = np.random.default_rng(seed)
    posture, target = Posture.random(rng), random_target(rng)
    errors = [np.linalg.norm(posture.end(end) - target)]
    for _ in range(6):
        told = frame.sweep(TREE, MODEL.balls, False, from_root, *CHAINS[end], end, target, *posture.arrays())
        np.testing.assert_allclose(told, posture.end(end), atol=1e-12)
        errors.append(np.linalg.norm(posture.end(end) - target))
    assert (np.diff(errors) <= 1e-12).all()


@settings(max_examples=20, deadline=None)
@given(seeds, st.integers(0, 4), st.booleans())
def test_a_clamped_step_is_told_as_it_is(seed, end, from_root):
    """With limits the place that a sweep returns is where the clamped joints put the end."""
    rng = np.random.default_rng(seed)
    posture, target = Posture.random(rng), random_target(rng)
    first, count, stride = CHAINS[end]
    told = frame.sweep(
        TREE, MODEL.balls, True, from_root, first, count, stride, end, target, *posture.arrays()
    )
    np.testing.assert_allclose(told, posture.end(end), atol=1e-9)


# --- limbs --------------------------------------------------------------------------------------------


def straight_limb(end: int, share: float) -> tuple[Posture, tuple[int, int], np.ndarray]:
    """A straight limb without its clavicle, and a target on its line at a share of its length."""
    posture, hinge = Posture.neutral(), int(TREE.ends[end])
    root = hinge - 2
    place = posture.positions[root, :3]
    return posture, (root, 2), place + share * (posture.end(end) - place)


@pytest.mark.parametrize("share", [0.9, 0.75, 0.4])
@pytest.mark.parametrize("from_root", [False, True])
@pytest.mark.parametrize("end", [1, 2, 3, 4])
def test_a_straight_limb_folds_to_a_target_on_its_line(end, from_root, share):
    """It gets off its dead point, beyond the middle joint and before: elbows forward, knees backward."""
    posture, (root, count), target = straight_limb(end, share)
    far = np.linalg.norm(posture.end(end) - target)
    _, error = frame.solve_chain(
        TREE, MODEL.balls, True, from_root, root, count, end, tuple(target), *posture.arrays()
    )
    bend = Rotation.from_quat(posture.local[root + 2]).as_rotvec()[0]
    assert error == pytest.approx(np.linalg.norm(posture.end(end) - target), abs=1e-12)
    assert error < max(0.15 * far, 0.012)
    assert (bend if end > 2 else -bend) > {0.9: 0.5, 0.75: 1.0, 0.4: 2.0}[share]


@pytest.mark.parametrize("end", [1, 3])
def test_a_straight_limb_that_is_there_stays_straight(end):
    """The way off the dead point is taken only where the target is not met."""
    posture, (root, count), target = straight_limb(end, 1.0)
    sweeps, error = frame.solve_chain(
        TREE, MODEL.balls, True, False, root, count, end, tuple(target), *posture.arrays()
    )
    assert sweeps == 1 and error == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(posture.local[root + 2], [0, 0, 0, 1], atol=1e-12)


def test_a_hinge_that_only_overextends_folds_that_way():
    """Where a straight limb cannot flex it is bent the other way."""
    tree = make_tree()
    tree.ranges[TREE.ends[3]] = -1.0, 0.0
    posture = Posture.neutral(tree)
    place = posture.positions[TREE.ends[3] - 2, :3]
    target = place + 0.4 * (posture.end(3) - place)
    frame.solve_chain(tree, MODEL.balls, True, False, CHAINS[3][0], 2, 3, tuple(target), *posture.arrays())
    assert Rotation.from_quat(posture.local[TREE.ends[3]]).as_rotvec()[0] == pytest.approx(-1.0)


# --- the stop rule ------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", ORDERS)
def test_sweeps_end_by_the_papers_rule(order):
    """At most 20 sweeps a chain: easy frames take one, hard ones many."""
    used = []
    for sample in ("boxing", "reach"):
        targets = FIGURE.targets(sp.make_sample(sample, FIGURE))
        solver, solution = sp.make_solver("ccd", FIGURE, order=order), None
        for points in targets.positions:
            solution = solver.solve(points, previous=solution)
            used.append(solution.iterations)
    assert min(used) == 1 and 10 < max(used) <= 20


def test_each_reason_to_stop_stops(monkeypatch):
    """Within 1 cm, or gaining less than 1 mm, or after 20 sweeps: nothing else ends a chain."""
    rng = np.random.default_rng(4)
    reasons, sweeps = set(), []
    for _ in range(150):
        posture, target = Posture.random(rng), random_target(rng)
        other, errors = Posture(posture.local), []
        count, error = frame.solve_chain(
            TREE, MODEL.balls, False, False, *CHAINS[3][:2], 3, target, *posture.arrays()
        )
        for _ in range(count):
            frame.sweep(TREE, MODEL.balls, False, False, *CHAINS[3], 3, target, *other.arrays())
            errors.append(np.linalg.norm(other.end(3) - target))
        assert errors[-1] == pytest.approx(error, abs=1e-9)
        done = [e < 0.01 for e in errors]
        stalled = [False, *(a - b < 1e-3 for a, b in zip(errors[:-1], errors[1:], strict=True))]
        assert not any(done[:-1]) and not any(stalled[:-1])
        assert done[-1] or stalled[-1] or count == 20
        reasons.add("met" if done[-1] else "stalled" if stalled[-1] else "tired")
        sweeps.append(count)
    assert reasons >= {"met", "stalled"} and max(sweeps) > 5
    monkeypatch.setattr(frame, "GAIN", -1.0)
    posture = Posture.neutral()
    count, _ = frame.solve_chain(
        TREE, MODEL.balls, False, False, *CHAINS[3][:2], 3, (0.0, -9.0, 0.0), *posture.arrays()
    )
    assert count == 20
    posture = Posture.neutral()
    arguments = (TREE, MODEL.balls, False, False, TRUNK, (0.0, 0.0, 0.0), (0.0, 9.0, 0.0))
    assert frame.solve_spine(*arguments, *posture.arrays())[1] == 20


@pytest.mark.parametrize("scale", [0.25, 8.0])
def test_units_do_not_matter_if_tolerances_have_them_too(scale, monkeypatch):
    """A body and tolerances in other units turn exactly alike, limb and spine."""
    large = TREE._replace(offsets=TREE.offsets * scale)
    results = []
    for tree, unit in ((TREE, 1.0), (large, scale)):
        for name in ("REACHED", "GAIN", "NEAR"):
            monkeypatch.setattr(frame, name, {"REACHED": 0.01, "GAIN": 1e-3, "NEAR": 1e-6}[name] * unit)
        rng, turns = np.random.default_rng(8), []
        for _ in range(10):
            posture = Posture(Posture.random(rng).local, tree)
            goals = [tuple(unit * np.array(random_target(rng))) for _ in range(2)]
            _, sweeps = frame.solve_spine(
                tree, MODEL.balls, True, False, TRUNK, (0.0, 0.0, 0.0), goals[0], *posture.arrays()
            )
            more, _ = frame.solve_chain(
                tree, MODEL.balls, True, False, *CHAINS[3][:2], 3, goals[1], *posture.arrays()
            )
            turns.append((posture.local, sweeps, more))
        results.append(turns)
    for (local, *counts), (there, *others) in zip(*results, strict=True):
        assert counts == others
        np.testing.assert_allclose(there, local, atol=1e-9)


def test_tolerances_are_metres():
    """A giant is solved to the same centimetre as a child: what it misses, in its own size, is less."""
    sample = sp.make_sample("reach", FIGURE)
    points, missed = FIGURE.targets(sample).positions, []
    for scale in (0.3, 0.7, 1.5):
        figure = sp.Figure.from_stature(1.75 * scale)
        solved = sp.make_solver("ccd", figure, limits=False).solve_frames(
            sp.Targets(scale * points, sample.rate)
        )
        np.testing.assert_array_equal(solved.status == sp.Status.CONVERGED, (solved.residual <= 0.01).all(1))
        missed.append(np.sqrt((solved.residual**2).mean()) / scale)
    assert missed[0] > 1.2 * missed[1] > 1.2 * 1.2 * missed[2]


# --- the whole body -----------------------------------------------------------------------------------


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("sample", sorted(sp.SAMPLES))
def test_both_orders_keep_lengths_limits_and_the_trunks_bargain(order, sample):
    """Bones keep their lengths, joints their limits, and pelvis and head miss their targets alike."""
    targets = FIGURE.targets(sp.make_sample(sample, FIGURE))
    solved = sp.make_solver("ccd", FIGURE, order=order).solve_frames(targets)
    positions, _ = world_matrices(solved.motion)
    parents = FIGURE.skeleton.parents
    lengths = np.linalg.norm(positions[:, 1:] - positions[:, parents[1:]], axis=-1)
    np.testing.assert_allclose(lengths - np.linalg.norm(FIGURE.skeleton.offsets[1:], axis=-1), 0, atol=1e-9)
    np.testing.assert_allclose(solved.residual[:, 0], solved.residual[:, 1], atol=1e-12)
    assert solved.residual[:, 0].max() > 1e-3
    checked = 0
    for joint, dof in FIGURE.dofs.joints.items():
        local = anatomical(FIGURE, solved.motion, joint, int(parents[joint]))
        if isinstance(dof, Hinges):
            vector = Rotation.from_matrix(local).as_rotvec()
            np.testing.assert_allclose(vector[:, 1:], 0.0, atol=1e-9)
            assert vector[:, 0].min() > dof.lower[0] - 1e-9 and vector[:, 0].max() < dof.upper[0] + 1e-9
        elif isinstance(dof, Ball) and dof.limit is not None:
            assert np.max(limit_excess(dof.limit, local)) < 1e-6
            checked += 1
    assert checked >= 10


def test_the_orders_differ():
    """From the root or from the tip is another motion, and other joints carry it."""
    targets = FIGURE.targets(sp.make_sample("boxing", FIGURE))
    tip, root = (sp.make_solver("ccd", FIGURE, order=o).solve_motion(targets).positions for o in ORDERS)
    assert np.linalg.norm(tip - root, axis=-1).max() > 0.1
    default = sp.make_solver("ccd", FIGURE).solve_motion(targets).positions
    np.testing.assert_array_equal(default, tip)


@pytest.mark.parametrize("limits", [True, False])
@pytest.mark.parametrize("way", [(0, -0.05, 0), (0, -0.06, 0.05), (0.05, -0.05, 0), (0, -0.05, -0.05)])
def test_the_spine_is_a_snake(way, limits):
    """When the head comes closer CCD bends the top of the spine most, Sequential IK all of it alike."""
    points = points_of(FIGURE)
    points[1] += way
    bends = [
        spine_angles(FIGURE, sp.make_solver(name, FIGURE, limits=limits).solve(points))
        for name in ("ccd", "sik")
    ]
    top = [b[-1] / b.sum() for b in bends]
    assert top[0] > 0.5 and top[1] < 0.35
    assert (np.diff(bends[0]) > 0).all()  # more and more from the pelvis up


def test_the_order_decides_where_the_spine_bends():
    """From the root the lowest joint turns more than it does from the tip."""
    points = points_of(FIGURE)
    points[1, 1] -= 0.05
    tip, root = (spine_angles(FIGURE, sp.make_solver("ccd", FIGURE, order=o).solve(points)) for o in ORDERS)
    assert root[0] > 2 * tip[0]


def test_a_rig_without_clavicles_moves_without_them():
    """A clavicle of no length is fixed, and the arm still reaches."""
    skeleton = FIGURE.skeleton
    offsets = np.array(skeleton.offsets)
    for clavicle, shoulder in zip(FIGURE.roles.clavicle, FIGURE.roles.shoulder, strict=True):
        offsets[clavicle] += offsets[shoulder]
        offsets[shoulder] = 0.0
    figure = sp.Figure.from_skeleton(sp.Skeleton(skeleton.names, skeleton.parents, offsets))
    tree = build_tree(figure, build_model(figure))
    fixed = [j for j in range(1, len(tree.kind)) if tree.kind[j] not in (1, 2)]
    points = points_of(figure)
    points[2:4] += [[0.1, 0.3, 0.3], [-0.1, 0.3, 0.3]]
    solution = sp.make_solver("ccd", figure, limits=False).solve(points)
    assert fixed == [TRUNK, TRUNK + 1] and solution.residual[2:4].max() < 0.03


def test_wrong_orders_are_refused():
    """There are two orders."""
    with pytest.raises(sp.SixpointError, match="'tip' or 'root'"):
        sp.make_solver("ccd", FIGURE, order="middle")
