"""Sequential IK step by step: the facts of Unzueta et al. 2008 that its parts must show."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import sixpoint as sp
from independent import anatomical
from sixpoint.kernels import quaternion as qt
from sixpoint.solvers.sequential.bending import flat_chord, search_angle
from sixpoint.solvers.sequential.clavicle import solve_clavicle
from sixpoint.solvers.sequential.limb import solve_limb
from sixpoint.solvers.sequential.spine import bending_axis, chord_of, place_trunk, stretch
from sixpoint.solvers.six_points.model import build_model
from sixpoint.solvers.six_points.pelvis import estimate_x
from sixpoint.solvers.six_points.solver import weights_at_rate
from test_solvers import FIGURE, as_motion, points_of

MODEL = build_model(FIGURE)
coordinates = st.floats(-0.7, 0.7)


def known(points: np.ndarray) -> np.ndarray:
    """Points as the compiled code has them, all of them tracked."""
    return np.column_stack([points, np.ones(6)])


def rig(spine: int, clavicles: bool = True) -> sp.Skeleton:
    """A standing rig with so many joints between pelvis and head, the head included."""
    names, parents, offsets = ["pelvis"], [-1], [[0.0, 1.0, 0.0]]

    def add(name: str, parent: str, offset: list[float]) -> None:
        names.append(name)
        parents.append(names.index(parent))
        offsets.append(offset)

    for k in range(spine):
        bulge = 0.03 * np.sin(np.pi * k / max(spine - 1, 1))
        name = "head" if k == spine - 1 else f"spine{k}"
        add(name, names[-1], [0.0, 0.6 / spine, bulge - (0.03 if k else 0.0)])
    chest = names[max(0, len(names) - 2)]
    for side, sign in (("l", 1.0), ("r", -1.0)):
        if clavicles:
            add(f"{side}_clavicle", chest, [sign * 0.03, 0.0, 0.0])
        add(f"{side}_shoulder", names[-1] if clavicles else chest, [sign * 0.17, 0.0, 0.0])
        add(f"{side}_elbow", f"{side}_shoulder", [0.0, -0.3, 0.0])
        add(f"{side}_wrist", f"{side}_elbow", [0.0, -0.27, 0.0])
        add(f"{side}_hip", "pelvis", [sign * 0.1, -0.08, 0.0])
        add(f"{side}_knee", f"{side}_hip", [0.0, -0.43, 0.0])
        add(f"{side}_ankle", f"{side}_knee", [0.0, -0.42, 0.0])
        add(f"{side}_toes", f"{side}_ankle", [0.0, -0.07, 0.15])
    return sp.Skeleton(tuple(names), np.array(parents), np.array(offsets))


# --- pelvis --------------------------------------------------------------------------------------


@given(st.lists(coordinates, min_size=18, max_size=18), st.floats(0.1, 3.0))
def test_pelvis_axis_is_a_unit_vector_across_the_trunk(values, scale):
    """X is perpendicular to Y, has unit length, and does not depend on where the figure stands."""
    points = np.reshape(values, (6, 3)) + 1e-3 * np.arange(18).reshape(6, 3)
    y = points[1] - points[0]
    y = tuple(y / np.linalg.norm(y))
    x = estimate_x(known(points), y, (0.0, 0.0, 0.0), False, 1.0, 1.0, 0.0)
    assert np.linalg.norm(x) == pytest.approx(1.0, abs=1e-9)
    assert np.dot(x, y) == pytest.approx(0.0, abs=1e-9)
    moved = estimate_x(known(points + [1.0, -2.0, 0.5]), y, (0.0, 0.0, 0.0), False, 1.0, 1.0, 0.0)
    np.testing.assert_allclose(moved, x, atol=1e-6)


def test_opposed_lines_keep_the_previous_axis():
    """When wrists and ankles say opposite things the pelvis keeps its axis; short lines say nothing."""
    points = np.array([[0, 1, 0], [0, 1.6, 0], [0.3, 1, 0], [-0.3, 1, 0], [-0.1, 0, 0], [0.1, 0, 0]], float)
    before = (0.6, 0.0, 0.8)
    kept = estimate_x(known(points), (0.0, 1.0, 0.0), before, True, 1.0, 1.0, 0.0)
    np.testing.assert_allclose(kept, before)
    points[4:, 0] = [0.004, -0.004]
    assert estimate_x(known(points), (0.0, 1.0, 0.0), before, True, 1.0, 1.0, 0.0) == (1.0, 0.0, 0.0)


@given(st.floats(0.01, 2), st.floats(0.01, 2), st.floats(0.01, 2), st.floats(1 / 240, 1 / 20))
def test_memory_does_not_depend_on_the_frame_rate(w1, w2, w3, dt):
    """Two frames of half the time forget as much as one; at 120 Hz the weights are the paper's."""
    np.testing.assert_allclose(weights_at_rate((w1, w2, w3), 1 / 120), (w1, w2, w3), rtol=1e-9)
    kept = []
    for step in (dt, dt / 2):
        a, b, c = weights_at_rate((w1, w2, w3), step)
        assert a / b == pytest.approx(w1 / w2)
        kept.append(c / (a + b + c))
    assert kept[1] ** 2 == pytest.approx(kept[0], rel=1e-9)


# --- spine ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("joints", [5, 6, 25])
def test_bending_law_has_the_closed_form(joints):
    """Eqs 1 and 2 for equal segments: D = L sin((n-1) phi/2) / sin(phi/2), no sideways drift."""
    segments = joints - 1
    flat = np.column_stack([np.ones(segments), np.zeros(segments)])
    bend = np.zeros((segments, 4))
    bend[:, 3] = 1.0 - 2.0 * np.arange(segments) / (segments - 1)
    for root in (0.2, 0.7, 1.2):
        phi = 2 * root / (joints - 2)
        expected = np.sin((joints - 1) * phi / 2) / np.sin(phi / 2)
        assert np.sqrt(flat_chord(bend, flat, root)[0]) == pytest.approx(expected, rel=1e-12)


@given(st.floats(0.5, 0.999), st.floats(-0.2, 0.2))
def test_exact_search_meets_the_chord_and_agrees_with_scipy(share, tilt):
    """Newton's method finds SciPy's root; the literal steps end within 0.01 rad of it."""
    segments = np.array([[0.12, -0.02], [0.11, 0.02], [0.1, 0.03], [0.07, 0.02], [0.06, 0.03]])
    flat = segments @ np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]])
    length = float(np.linalg.norm(flat.sum(axis=0)))
    wanted = share * length
    phi, met = search_angle(MODEL.segments, flat, 0.0, wanted, False)
    assert met
    assert np.sqrt(flat_chord(MODEL.segments, flat, phi)[0]) == pytest.approx(wanted, abs=1e-9)
    step = 0.1 * np.sign(phi)
    root = brentq(
        lambda p: flat_chord(MODEL.segments, flat, p)[0] - wanted**2, phi - step, phi + step, xtol=1e-13
    )
    assert phi == pytest.approx(root, abs=1e-6)
    literal, met = search_angle(MODEL.segments, flat, 0.0, wanted, True)
    assert met and abs(literal - phi) < 0.0101
    assert abs(np.sqrt(flat_chord(MODEL.segments, flat, literal)[0]) - wanted) < 0.005


def head_path(frames: int = 240) -> np.ndarray:
    """A nod, side bend and circling of the head that shortens the trunk by up to 12 cm and comes back."""
    t = np.linspace(0, 2 * np.pi, frames)
    points = np.tile(points_of(FIGURE), (frames, 1, 1))
    down = 0.06 * (1 - np.cos(3 * t))
    points[:, 1] += np.stack([0.15 * np.sin(2 * t), -down, 0.25 * np.sin(t)], axis=1)
    return points


@pytest.mark.parametrize("search", ["exact", "literal"])
def test_bending_and_coming_back_meets_the_chord(search):
    """Over a long bend and return the trunk is never more than 5 mm too long or short."""
    points = head_path()
    solver = sp.SequentialIK(FIGURE, limits=False, search=search, weights=(1, 1, 0))
    solved = solver.solve_frames(sp.Targets(points, 60))
    neutral = float(MODEL.chords[0])
    bent = np.linalg.norm(points[:, 1] - points[:, 0], axis=1) < neutral
    assert bent.mean() > 0.6
    assert 2 * solved.residual[bent, :2].max() < 0.005
    np.testing.assert_allclose(solved.residual[:, 0], solved.residual[:, 1], atol=1e-12)  # line 17


def test_literal_and_exact_search_agree():
    """The two searches give the same bend within the paper's fine step."""
    targets = sp.Targets(head_path()[:100], 60)
    angles = []
    for search in ("exact", "literal"):
        motion = sp.SequentialIK(FIGURE, limits=False, search=search).solve_motion(targets)
        chain = FIGURE.spine_chain.joints
        local = anatomical(FIGURE, motion, chain[1], chain[0])
        angles.append(Rotation.from_matrix(local).as_rotvec())
    assert np.linalg.norm(angles[0] - angles[1], axis=1).max() < 0.03


def test_a_straight_trunk_bends_forward():
    """A head that sinks straight down bends the trunk forward, not backward or sideways."""
    points = points_of(FIGURE)
    points[1, 1] -= 0.1
    motion = as_motion(FIGURE, sp.SequentialIK(FIGURE, limits=False).solve(points))
    chain = FIGURE.spine_chain.joints
    for above, joint in zip(chain[:-1], chain[1:], strict=True):
        vector = Rotation.from_matrix(anatomical(FIGURE, motion, joint, above)[0]).as_rotvec()
        assert vector[0] > 0.05
        np.testing.assert_allclose(vector[1:], 0.0, atol=1e-6)


def test_stretching_is_unique_monotone_and_ends_straight():
    """The stretch poses grow from the neutral chord to the sum of segments, every segment along the chord."""
    assert (np.diff(MODEL.chords) >= 0).all()
    total = np.linalg.norm(MODEL.segments[:, :3], axis=1).sum()
    assert MODEL.chords[-1] == pytest.approx(total, rel=1e-6)
    count = len(MODEL.segments)
    local, world, segs = np.tile([0.0, 0, 0, 1], (count, 1)), np.empty((count, 4)), np.empty((count, 3))
    for wanted in np.linspace(MODEL.chords[0], MODEL.chords[-1], 20):
        local[:] = [0.0, 0, 0, 1]
        stretch(MODEL.turns, MODEL.chords, wanted, local)
        place_trunk(MODEL.segments, local, world, segs)
        assert np.linalg.norm(chord_of(segs)) == pytest.approx(wanted, abs=1e-4)
    directions = segs / np.linalg.norm(segs, axis=1, keepdims=True)
    np.testing.assert_allclose(directions, np.tile(directions[0], (count, 1)), atol=1e-6)


@pytest.mark.parametrize("clavicles", [True, False])
@pytest.mark.parametrize("spine", [1, 2, 3, 6, 12, 25])
def test_any_number_of_spine_joints(spine, clavicles):
    """Rigs with 1 to 25 spine joints, with or without clavicles, stand neutrally and bend to the head."""
    figure = sp.Figure.from_skeleton(rig(spine, clavicles))
    assert len(figure.roles.spine) == spine
    points = points_of(figure)
    assert sp.SequentialIK(figure).solve(points).status is sp.Status.CONVERGED
    solver = sp.SequentialIK(figure, weights=(1, 1, 0), limits=False)
    if spine <= 2:
        return  # one bone cannot bend, and two near-parallel ones barely can
    points[1] += [0.0, -0.06, 0.1]
    solution = solver.solve(points)
    assert solution.residual[:2].max() < 1e-6
    assert solver.solve(points_of(figure), previous=solution).residual[:2].max() < 2.5e-3


# --- limbs and clavicles -------------------------------------------------------------------------


@given(coordinates, coordinates, coordinates, st.sampled_from([-1.0, 1.0]))
def test_limb_closes_in_the_plane_of_its_hinge(x, y, z, h):
    """Without limits the end is at the target when reachable; the hinge only flexes, in its own plane."""
    l1, l2 = 0.31, 0.27
    target = (x, y, z)
    distance = float(np.linalg.norm(target))
    root, hinge, end = solve_limb(target, l1, l2, h, False, MODEL.balls, 0, 0.0, 3.0)
    posed = Rotation.from_quat(root)
    middle = posed.apply([0.0, -l1, 0.0])
    reached = middle + (posed * Rotation.from_quat(hinge)).apply([0.0, -l2, 0.0])
    np.testing.assert_allclose(reached, end, atol=1e-9)
    if l1 - l2 <= distance <= l1 + l2:
        np.testing.assert_allclose(end, target, atol=1e-9)
    assert h * hinge[0] >= 0.0 and hinge[1:3] == (0.0, 0.0) and hinge[3] >= 0.0
    bend = posed.apply([0.0, 0.0, 1.0]) @ (reached - middle)
    assert -h * bend >= -1e-9  # elbows fold forward, knees backward


@settings(max_examples=300)
@given(coordinates, coordinates, coordinates)
def test_clamped_limb_comes_as_near_as_its_plane_allows(x, y, z):
    """With limits the reported end is where the clamped joints put it, and the flexion is in range."""
    l1, l2, row = 0.31, 0.27, len(MODEL.segments) + 2
    low, high = MODEL.limbs[0, 2:]
    root, hinge, end = solve_limb((x, y, z), l1, l2, -1.0, True, MODEL.balls, row, low, high)
    posed = Rotation.from_quat(root)
    reached = posed.apply([0.0, -l1, 0.0]) + (posed * Rotation.from_quat(hinge)).apply([0.0, -l2, 0.0])
    np.testing.assert_allclose(reached, end, atol=1e-9)
    flexion = -2.0 * np.arctan2(hinge[0], hinge[3])
    assert low - 1e-9 <= flexion <= high + 1e-9


@given(coordinates, coordinates, coordinates, st.booleans())
def test_clavicle_moves_only_when_the_arm_cannot_reach(x, y, z, far):
    """It stays neutral within reach; beyond it turns just enough, or points at a target too far for that."""
    clavicle, reach = np.array([0.15, 0.02, -0.03]), 0.55
    target = np.array([x, y, z]) * (2.0 if far else 0.5)
    turned = solve_clavicle(qt.IDENTITY, tuple(clavicle), tuple(target), reach, False, MODEL.balls, 0)
    gap = np.linalg.norm(target - clavicle)
    shoulder = Rotation.from_quat(turned).apply(clavicle)
    c, d = np.linalg.norm(clavicle), np.linalg.norm(target)
    if gap <= reach:
        assert turned == qt.IDENTITY
    elif d <= c + reach and np.linalg.norm(np.cross(clavicle, target)) > 1e-6:
        assert np.linalg.norm(target - shoulder) == pytest.approx(reach, abs=1e-7)
    elif np.linalg.norm(np.cross(clavicle, target)) > 1e-6:
        assert np.linalg.norm(target - shoulder) == pytest.approx(d - c, abs=1e-7)


def test_held_clavicles_do_not_relax():
    """With ``clavicles="hold"`` a raised clavicle stays up; by default it returns to rest."""
    points = points_of(FIGURE)
    points[2:4] += [0.0, 0.05, 0.05]  # well within reach
    reaching = points.copy()
    reaching[2] = points[1] + [0.25, 0.55, 0.1]
    joint = FIGURE.roles.clavicle[0]
    for option, stays in (("hold", True), ("neutral", False)):
        solver = sp.SequentialIK(FIGURE, limits=False, clavicles=option, weights=(1, 1, 0))
        raised = solver.solve(reaching)
        after = solver.solve(points, previous=raised)
        turned = [Rotation.from_quat(s.pose.rotations[joint]).magnitude() for s in (raised, after)]
        assert turned[0] > 0.1
        assert bool(turned[1] > 0.1) is stays
        assert stays or turned[1] == pytest.approx(0.0, abs=1e-6)


def test_limbs_have_no_memory():
    """The same six points give the same limbs whatever came before, once the trunk is the same."""
    points = points_of(FIGURE)
    points[2:4, 2] += 0.3
    points[1, 1] += 0.001  # beyond the neutral chord the trunk has one shape only
    solver = sp.SequentialIK(FIGURE, weights=(1, 1, 0))
    other = points_of(FIGURE)
    other[2] += [0.3, 0.5, 0.2]
    fresh = solver.solve(points)
    after = solver.solve(points, previous=solver.solve(other))
    np.testing.assert_allclose(after.pose.rotations, fresh.pose.rotations, atol=1e-9)


def test_align_pelvis_brings_the_axis_back():
    """The optional twist about the chord leaves the chord and makes the pelvis' X nearest to its estimate."""
    path = head_path()
    points = path[np.argmin(np.linalg.norm(path[:, 1] - path[:, 0], axis=1))]
    poses = []
    for align in (False, True):
        solution = sp.SequentialIK(FIGURE, limits=False, align_pelvis=align, weights=(1, 1, 0)).solve(points)
        poses.append(Rotation.from_quat(solution.pose.rotations[0]).as_matrix()[:, 0])
        assert solution.residual[:2].max() < 1e-6
    y = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    x = estimate_x(known(points), tuple(y), (0.0, 0.0, 0.0), False, 1.0, 1.0, 0.0)
    assert poses[1] @ np.array(x) >= poses[0] @ np.array(x) - 1e-12


@pytest.mark.parametrize(
    "options",
    [
        {"weights": (0, 0, 0)},
        {"weights": (1, 1)},
        {"weights": (1, -1, 0)},
        {"search": "fast"},
        {"clavicles": ""},
    ],
)
def test_impossible_options_are_refused(options):
    """A wrong option is an error when the solver is made."""
    with pytest.raises(sp.SixpointError):
        sp.SequentialIK(FIGURE, **options)


@pytest.mark.parametrize("blind", [[0, 1, 2, 3, 4, 5], [2, 3, 4, 5], [2, 3, 4]])
def test_a_blind_start_decides_nothing(blind):
    """Frames that do not tell the yaw do not weigh in once it is told: no spin when the trackers come up."""
    targets = FIGURE.targets(sp.make_sample("walk", FIGURE).sliced(slice(0, 20)))
    positions = targets.positions @ np.diag([-1.0, 1.0, -1.0])  # facing the other way
    solver = sp.SequentialIK(FIGURE)
    first = np.array(positions[0])
    first[blind] = np.nan
    late = solver.solve(positions[1], previous=solver.solve(first))
    fresh = solver.solve(positions[1])
    turned = [Rotation.from_quat(s.pose.rotations[0]).as_matrix() for s in (late, fresh)]
    np.testing.assert_allclose(turned[0], turned[1], atol=1e-6)


def test_the_memory_begins_with_both_lines_alike():
    """With a memory, the first frame weighs wrists and ankles the same, whatever w1 and w2."""
    points = points_of(FIGURE)
    points[2:4] = points[2:4] @ Rotation.from_rotvec([0, 0.6, 0]).as_matrix().T
    y = (0.0, 1.0, 0.0)
    axes = [
        estimate_x(known(points), y, (0.0, 0.0, 0.0), False, *w) for w in ((0.1, 0.9, 1.0), (0.5, 0.5, 1.0))
    ]
    np.testing.assert_allclose(axes[0], axes[1])
    assert not np.allclose(axes[0], estimate_x(known(points), y, (0.0, 0.0, 0.0), False, 0.1, 0.9, 0.0))


def test_parallel_chords_keep_the_previous_plane():
    """A bent trunk whose chord is already along the target stays in the plane it was bent in."""
    local = np.tile([0.0, 0, 0, 1], (len(MODEL.segments), 1))
    local[1] = Rotation.from_rotvec([0.1, 0.0, 0.05]).as_quat()
    world, segs = np.empty((len(local), 4)), np.empty((len(local), 4))
    place_trunk(MODEL.segments, local, world, segs)
    chord, plane = chord_of(segs), tuple(np.array([0.8, 0.0, 0.6]))
    assert bending_axis(chord, chord, local, world, plane) == plane


def test_a_knee_may_hyperextend_where_the_table_says_so():
    """A negative least flexion is kept as it is, and the neutral pose stays neutral."""
    table = tomllib.loads(sp.Limits.text())
    table["knee"]["flexion"] = [-10, 150]
    table["elbow"]["flexion"] = [-5, 140]
    figure = FIGURE.with_limits(sp.Limits(table))
    limbs = np.degrees(build_model(figure).limbs[:, 2:])
    np.testing.assert_allclose(limbs, [[-5, 140], [-5, 140], [-10, 150], [-10, 150]])
    solution = sp.SequentialIK(figure).solve(points_of(figure))
    np.testing.assert_allclose(solution.residual, 0.0, atol=1e-9)
