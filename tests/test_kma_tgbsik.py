"""KMA and TGBSIK: limbs in closed form at a fixed swivel angle, or at that of least effort."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import sixpoint as sp
from independent import anatomical, world_matrices
from sixpoint.solvers.kma.frame import reference_of
from sixpoint.solvers.six_points.model import build_model
from sixpoint.solvers.tgb.swivel import solve_easiest
from test_solvers import FIGURE, as_motion, measured, points_of

MODEL = build_model(FIGURE)
ROLES = FIGURE.roles
SAMPLES = pytest.mark.parametrize("sample", sorted(sp.SAMPLES))
MIRROR = np.diag([-1.0, 1.0, 1.0])
DOWN = np.array([0.0, -1.0, 0.0])
LENGTHS = (0.31, 0.27)
NARROW = 8.5
"""Effort [rad^2] above which the upper segment is nearly straight up, where valleys are narrow."""
seeds = st.integers(0, 2**32 - 1)


def targets_of(sample: str) -> sp.Targets:
    return FIGURE.targets(sp.make_sample(sample, FIGURE))


def kma(**options: object) -> sp.Solver:
    """KMA whose pelvis has no memory."""
    return sp.make_solver("kma", FIGURE, **{"weights": (1, 1, 0), **options})


def limb_places(motion: sp.Motion) -> np.ndarray:
    """Root, middle and end of the four limbs (4, 3, F, 3), by SciPy matrices."""
    positions, _ = world_matrices(motion)
    return np.array([[positions[:, j] for j in chain] for chain in ROLES.limbs])


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def across(v: np.ndarray, n: np.ndarray) -> np.ndarray:
    """Part of vectors (F, 3) across unit vectors (F, 3)."""
    return v - np.sum(v * n, axis=-1, keepdims=True) * n


# --- KMA ----------------------------------------------------------------------------------------------


@SAMPLES
@pytest.mark.parametrize("limits", [True, False])
def test_kma_has_no_memory(sample, limits):
    """Backwards, shuffled or alone, the same points are the same pose."""
    targets = targets_of(sample)
    solver = kma(limits=limits)
    forward = solver.solve_motion(targets)
    order = np.random.default_rng(0).permutation(len(targets))
    for frames in (np.arange(len(targets))[::-1], order):
        there = solver.solve_motion(sp.Targets(targets.positions[frames], targets.rate))
        np.testing.assert_array_equal(there.rotations, forward.rotations[frames])
        np.testing.assert_array_equal(there.translations, forward.translations[frames])
    for frame in (0, 31, 200):
        alone = solver.solve(targets.positions[frame])
        np.testing.assert_array_equal(alone.pose.rotations, forward.rotations[frame])


def test_the_pelvis_alone_remembers():
    """With a remembering pelvis the order does matter, and it is the pelvis where it begins."""
    targets = targets_of("boxing")
    solver = sp.make_solver("kma", FIGURE)
    forward = solver.solve_motion(targets).rotations
    backward = solver.solve_motion(sp.Targets(targets.positions[::-1].copy(), targets.rate)).rotations[::-1]
    assert np.abs(np.sum(forward[:, 0] * backward[:, 0], axis=1)).min() < 0.999


@SAMPLES
def test_clavicles_stay_at_rest(sample):
    """Whatever the arms reach for, KMA does not move the clavicles."""
    motion = kma().solve_motion(targets_of(sample))
    for clavicle in ROLES.clavicle:
        local = anatomical(FIGURE, motion, clavicle, int(FIGURE.skeleton.parents[clavicle]))
        np.testing.assert_allclose(local, np.tile(np.eye(3), (len(motion), 1, 1)), atol=1e-9)


@pytest.mark.parametrize("limits", [True, False])
@pytest.mark.parametrize("reach", [0.6, 0.8, 0.95])
def test_in_a_t_pose_elbows_are_below_the_line(reach, limits):
    """Arms held out sideways have their elbows below the line from shoulder to wrist."""
    solver, points = kma(limits=limits), points_of(FIGURE)
    for _ in range(3):  # the shoulders' height follows from the pose itself
        roots = limb_places(as_motion(FIGURE, solver.solve(points)))[:2, 0, 0]
        points[2:4] = roots + reach * MODEL.limbs[0, :2].sum() * np.array([[1, 0, 0], [-1, 0, 0]])
    for root, middle, end in limb_places(as_motion(FIGURE, solver.solve(points)))[:2, :, 0]:
        line = root + np.clip((middle - root) @ unit(end - root), 0, None) * unit(end - root)
        assert (middle - line)[1] < -0.05
        assert abs((middle - line)[2]) < 0.2 * abs((middle - line)[1])


@SAMPLES
def test_middle_joints_are_on_the_side_of_the_reference(sample):
    """Elbows are on the pelvis' down side, knees on its front; where limbs run along, the other reference."""
    targets = targets_of(sample)
    motion = kma(limits=False).solve_motion(targets)
    _, world = world_matrices(motion)
    neutral = Rotation.from_quat(FIGURE.neutral).as_matrix()
    _, y, z = np.moveaxis(world[:, ROLES.pelvis] @ neutral[ROLES.pelvis].T, 2, 0)
    checked = []
    for limb, (root, middle, end) in enumerate(limb_places(motion)):
        n = unit(end - root)
        first, second = (-y, -z) if limb < 2 else (z, y)
        aligned = np.linalg.norm(np.cross(first, n), axis=1) < 0.05
        side = across(np.where(aligned[:, None], second, first), n)
        bend = across(middle - root, n)
        bent = np.linalg.norm(bend, axis=1) > 1e-3
        if bent.any():
            assert np.sum(unit(side[bent]) * unit(bend[bent]), axis=1).min() > 1 - 1e-6
        checked.append(bent.sum())
    assert sum(checked) > 100


def test_the_reference_switches_at_three_degrees():
    """The second reference takes over where the sine to the first is below 0.05, for arms and legs."""
    pelvis = Rotation.from_rotvec([0.3, -0.8, 0.2])
    x, y, z = pelvis.as_matrix().T
    for limb, first, second in ((0, -y, -z), (1, -y, -z), (2, z, y), (3, z, y)):
        for sine, expected in ((0.0501, first), (0.0499, second), (0.7, first), (0.0, second)):
            for sign in (1, -1):
                n = sign * (np.sqrt(1 - sine**2) * first + sine * x)
                got = reference_of(limb, tuple(pelvis.as_quat()), tuple(n))
                np.testing.assert_allclose(got, expected, atol=1e-12)


@pytest.mark.parametrize(("tilt", "jump"), [((0, -1), 180), ((1, 0), 90), ((-1, 0), 90), ((0, 1), 0)])
def test_the_elbow_jumps_where_the_reference_switches(tilt, jump):
    """An arm that swings past three degrees off the pelvis' down turns its elbow by up to a half circle."""
    solver, points = kma(limits=False, weights=(0, 1, 0)), points_of(FIGURE)
    pose = as_motion(FIGURE, solver.solve(points))
    shoulder = limb_places(pose)[0, 0, 0]
    _, world = world_matrices(pose)
    neutral = Rotation.from_quat(FIGURE.neutral).as_matrix()
    pelvis = world[0, ROLES.pelvis] @ neutral[ROLES.pelvis].T
    sides, wrists = [], []
    for sine in (0.0499, 0.0501):
        n = pelvis @ np.array([sine * tilt[0], -np.sqrt(1 - sine**2), sine * tilt[1]])
        points[2] = shoulder + 0.8 * MODEL.limbs[0, :2].sum() * n
        root, middle, end = limb_places(as_motion(FIGURE, solver.solve(points)))[0, :, 0]
        np.testing.assert_allclose(root, shoulder, atol=1e-12)  # the trunk does not feel the arm
        np.testing.assert_allclose(end, points[2], atol=1e-9)
        sides.append(unit(across(middle - root, n)))
        wrists.append(end)
    assert np.linalg.norm(wrists[0] - wrists[1]) < 2e-4
    assert np.degrees(np.arccos(np.clip(sides[0] @ sides[1], -1, 1))) == pytest.approx(jump, abs=4)


@SAMPLES
def test_the_spine_of_kma_starts_from_the_standing_pose(sample):
    """It is that of CCD's first frame: CCD alone remembers the last pose."""
    targets = targets_of(sample)
    chain = list(FIGURE.spine_chain.joints)
    solvers = kma(), sp.make_solver("ccd", FIGURE, weights=(1, 1, 0))
    for frame in range(0, len(targets), 40):
        poses = [solver.solve(targets.positions[frame]).pose for solver in solvers]
        np.testing.assert_array_equal(poses[0].rotations[chain], poses[1].rotations[chain])
    moving = [solver.solve_motion(targets).rotations[:, chain] for solver in solvers]
    assert not np.allclose(*moving, atol=1e-3)


# --- TGBSIK -------------------------------------------------------------------------------------------


def effort(matrices: np.ndarray, weight: float = 1.0) -> np.ndarray:
    """Swing^2 + weight twist^2 of rotations (F, 3, 3) of a limb along -Y, without quaternions."""
    segment = -matrices[:, :, 1]
    swing = np.arctan2(np.linalg.norm(np.cross(DOWN, segment), axis=1), segment @ DOWN)
    axis = np.cross(DOWN, segment)
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    arc = Rotation.from_rotvec(
        np.where(length > 1e-12, axis / np.maximum(length, 1e-12), 0.0) * swing[:, None]
    )
    twist = (arc.inv() * Rotation.from_matrix(matrices)).as_rotvec() @ DOWN
    return swing**2 + weight * twist**2


def postures(target: np.ndarray, lengths: tuple[float, float], h: float, phi: np.ndarray) -> np.ndarray:
    """Root rotations (F, 3, 3) at swivel angles (F,) from any direction (, in NumPy)."""
    l1, l2 = lengths
    n, d = unit(target), np.clip(np.linalg.norm(target), abs(l1 - l2), l1 + l2)
    cosine = (l1**2 + d**2 - l2**2) / (2 * l1 * d)
    sine = np.sqrt(max(1 - cosine**2, 0.0))
    u = unit(across(np.eye(3)[np.argmin(np.abs(n))], n))
    r = np.outer(np.cos(phi), u) + np.outer(np.sin(phi), np.cross(n, u))
    x, y = h * np.cross(r, n), -(cosine * n + sine * r)
    return np.stack([x, y, np.cross(x, y)], axis=2)


def easiest(
    target: np.ndarray, h: float, weight: float = 1.0, lengths: tuple[float, float] = LENGTHS
) -> tuple[np.ndarray, np.ndarray]:
    """Root rotation (3, 3) that TGBSIK takes, and the end that it says."""
    goal = tuple(float(x) for x in target)
    root, hinge, end = solve_easiest(goal, *lengths, h, weight, False, MODEL.balls, 0, 0.0, np.pi)
    posed = Rotation.from_quat(root)
    reached = posed.apply([0.0, -lengths[0], 0.0])
    reached = reached + (posed * Rotation.from_quat(hinge)).apply([0.0, -lengths[1], 0.0])
    np.testing.assert_allclose(reached, end, atol=1e-9)
    return posed.as_matrix(), np.array(end)


def random_target(rng: np.random.Generator, least: float = 0.1) -> np.ndarray:
    return unit(rng.normal(size=3)) * rng.uniform(least, 0.999) * sum(LENGTHS)


@pytest.mark.parametrize("weight", [0.0, 1.0, 3.0])
@pytest.mark.parametrize("h", [-1.0, 1.0])
@settings(max_examples=60, deadline=None)
@given(seeds)
def test_no_swivel_angle_is_easier(h, weight, seed):
    """Of 1000 random angles none has an effort less by 1e-3, where twist weighs more 6e-3."""
    rng = np.random.default_rng(seed)
    target = random_target(rng)
    root, end = easiest(target, h, weight)
    np.testing.assert_allclose(end, target, atol=1e-9)
    others = effort(postures(target, LENGTHS, h, rng.uniform(0, 2 * np.pi, 1000)), weight)
    if others.min() < NARROW:
        assert effort(root[None], weight)[0] <= others.min() + (6e-3 if weight > 1 else 1e-3)


@pytest.mark.parametrize("h", [-1.0, 1.0])
def test_a_hanging_limb_costs_nothing(h):
    """The neutral limb has no swing and no twist; a little bent it has little of them."""
    root, end = easiest(sum(LENGTHS) * DOWN, h)
    np.testing.assert_allclose(root, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(end, sum(LENGTHS) * DOWN, atol=1e-12)
    bent, _ = easiest(0.98 * sum(LENGTHS) * DOWN, h)
    assert 0.01 < effort(bent[None])[0] < 0.1
    assert h * -bent[2, 1] > 0.1  # the elbow goes back, the knee forward


@pytest.mark.parametrize("h", [-1.0, 1.0])
@settings(max_examples=60, deadline=None)
@given(seeds)
def test_left_and_right_are_mirror_images(h, seed):
    """The mirrored target has the mirrored posture."""
    target = random_target(np.random.default_rng(seed))
    target[0] += np.copysign(0.01, target[0])  # in the plane of symmetry the two sides may be alike
    here, there = easiest(target, h)[0], easiest(MIRROR @ target, h)[0]
    np.testing.assert_allclose(MIRROR @ there @ MIRROR, here, atol=1e-9)


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_the_weight_is_that_of_twist(seed):
    """More weight never gives more twist, and never less swing."""
    target = random_target(np.random.default_rng(seed), 0.4)
    swings, twists = [], []
    for weight in (0.0, 1.0, 10.0):
        root = easiest(target, -1.0, weight)[0][None]
        swings.append(np.sqrt(effort(root, 0.0)[0]))
        twists.append(np.sqrt(max(effort(root, 1.0)[0] - swings[-1] ** 2, 0.0)))
    if max(swings) < 2.6:
        assert (np.diff(swings) >= -0.02).all() and (np.diff(twists) <= 0.02).all()


@pytest.mark.parametrize("limits", [True, False])
@SAMPLES
def test_trunk_and_clavicles_are_those_of_sequential_ik(sample, limits):
    """TGBSIK and Sequential IK differ in the limbs alone, to the last bit."""
    targets = targets_of(sample)
    motions = [sp.make_solver(n, FIGURE, limits=limits).solve_motion(targets) for n in ("tgbsik", "sik")]
    shared = [ROLES.pelvis, *ROLES.spine, *ROLES.clavicle]
    np.testing.assert_array_equal(*(m.rotations[:, shared] for m in motions))
    np.testing.assert_array_equal(*(m.translations for m in motions))
    limbs = [*ROLES.shoulder, *ROLES.hip]
    assert sample == "walk" or not np.allclose(*(m.rotations[:, limbs] for m in motions), atol=0.05)


@SAMPLES
def test_reachable_wrists_and_ankles_are_met_with_least_effort(sample):
    """Without limits each is met to 1e-9, and no other swivel angle costs shoulder or hip less."""
    targets = targets_of(sample)
    motion = sp.make_solver("tgbsik", FIGURE, limits=False).solve_motion(targets)
    ends, rng = measured(FIGURE, motion), np.random.default_rng(3)
    frames = np.arange(0, len(targets), 12)
    _, world = world_matrices(motion)
    neutral = Rotation.from_quat(FIGURE.neutral).as_matrix()
    costs = 0
    for limb, (root, middle, end) in enumerate(ROLES.limbs):
        lengths = tuple(float(x) for x in MODEL.limbs[limb, :2])
        places = limb_places(motion)[limb, 0]
        goal = targets.positions[:, 2 + limb]
        reach = np.linalg.norm(goal - places, axis=1)
        near = (reach <= sum(lengths)) & (reach >= abs(lengths[0] - lengths[1]))
        gap = np.linalg.norm(ends[:, 2 + limb] - goal, axis=1)
        assert near.any() and gap[near].max() < 1e-9
        parent = int(FIGURE.skeleton.parents[root])
        local = anatomical(FIGURE, motion, root, parent)
        frame = world[:, parent] @ neutral[parent].T
        for f in frames[near[frames]]:
            target = frame[f].T @ (goal[f] - places[f])
            phi = rng.uniform(0, 2 * np.pi, 300)
            others = effort(postures(target, lengths, -1.0 if limb < 2 else 1.0, phi))
            if others.min() < NARROW:
                assert effort(local[f : f + 1])[0] <= others.min() + 1e-3
                costs += 1
        assert middle != end
    assert costs > 50


def test_wrong_options_are_refused():
    """A weight is a number from 0 on."""
    for weight in (-1.0, np.nan, np.inf):
        with pytest.raises(sp.SixpointError, match="weight of twist"):
            sp.make_solver("tgbsik", FIGURE, twist_weight=weight)
    with pytest.raises(sp.SixpointError, match="weights"):
        kma(weights=(0, 0, 0))
