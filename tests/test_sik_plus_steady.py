"""SIK+ in motion: elbows, knees and pelvis do not jump, and limits cost no target that they allow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import sixpoint as sp
from sixpoint.solvers.sequential_plus import limbs
from sixpoint.solvers.six_points.packing import limb_row
from sixpoint.study.movement import compute_local_rotations, find_swivel_jumps
from test_sik_plus import MODEL
from test_solvers import FIGURE, points_of

HABITS = sp.Habits()
UNIT = st.lists(st.floats(-1, 1), min_size=3, max_size=3).filter(lambda v: np.linalg.norm(v) > 0.1)


def unit(v: object) -> np.ndarray:
    v = np.asarray(v, float)
    return v / np.linalg.norm(v)


def solve_limb(target, pole, began, upper, hinge, limb=0, limits=False, dt=1 / 120):
    """A limb's root and hinge, and its end, with the figure's lengths and limits."""
    l1, l2, low, high = MODEL.limbs[limb]
    row, h = limb_row(len(MODEL.segments), limb), -1.0 if limb < 2 else 1.0
    habits = (0.0, HABITS.swivel_memory, HABITS.swivel_speed)
    numbers = (*habits, dt, limits, MODEL.balls, row, low, high)
    return limbs.solve_by_pole(
        tuple(target), l1, l2, h, tuple(pole), began, tuple(upper), tuple(hinge), *numbers
    )


def sweep(points: np.ndarray, rate: float) -> sp.Targets:
    """Still points, the left wrist along a path (F, 3)."""
    whole = np.tile(points_of(FIGURE), (len(points), 1, 1))
    whole[:, 2] = points
    return sp.Targets(whole, rate)


@given(UNIT, UNIT, UNIT, st.floats(0.1, 0.99))
@settings(max_examples=200, deadline=None)
def test_a_swivel_angle_changes_no_faster_than_it_may(first, second, pole, reach):
    """From one line to another close by the elbow swivels by the largest speed at most, whatever the pole."""
    length = MODEL.limbs[0, :2].sum() * reach
    n = unit(first)
    m = unit(n + 0.1 * unit(second))
    upper, hinge, _ = solve_limb(n * length, pole, False, (0, 0, 0, 1), (0, 0, 0, 1))
    axis = Rotation.from_quat(upper).apply([1.0, 0, 0])
    turned, _, end = solve_limb(m * length, unit(second), True, upper, hinge)
    arc = np.cross(n, m)
    carried = Rotation.from_rotvec(arc * (np.arccos(np.clip(n @ m, -1, 1)) / max(np.linalg.norm(arc), 1e-12)))
    there = Rotation.from_quat(turned).apply([1.0, 0, 0])
    step = np.arccos(np.clip(carried.apply(axis) @ there, -1, 1))
    assert step <= HABITS.swivel_speed / 120 + 1e-6
    np.testing.assert_allclose(end, m * length, atol=1e-9)


@given(UNIT, UNIT, UNIT, st.floats(0.3, 0.98), st.sampled_from([0, 1, 2, 3]))
@settings(max_examples=200, deadline=None)
def test_limits_cost_no_target_that_they_allow(first, second, pole, reach, limb):
    """Wherever the limb was before: if a fair range of swivel angles is allowed it ends within 1 cm."""
    l1, l2, low, high = MODEL.limbs[limb]
    row, h = limb_row(len(MODEL.segments), limb), -1.0 if limb < 2 else 1.0
    before, target = unit(first) * (l1 + l2) * 0.8, unit(second) * (l1 + l2) * reach
    upper, hinge, _ = solve_limb(before, pole, False, (0, 0, 0, 1), (0, 0, 0, 1), limb, True)
    _, _, end = solve_limb(target, pole, True, upper, hinge, limb, True)
    n, distance = limbs.direction(tuple(target))
    _, cosine, sine, flexion = limbs.triangle(distance, l1, l2)
    u = limbs.across(tuple(pole), n)
    circle = np.radians(np.arange(0, 360, 2))
    free = [limbs.is_free(n, u, cosine, sine, h, phi, MODEL.balls, row) for phi in circle]
    run = np.convolve(np.tile(free, 2), np.ones(8), "valid").max()
    if run == 8 and low <= flexion <= high:
        assert np.linalg.norm(np.array(end) - target) <= 0.01 + 1e-9


@pytest.mark.parametrize("limits", [True, False])
@pytest.mark.parametrize("aside", [0.0, 0.01, -0.02])
def test_a_hand_that_passes_behind_the_elbows_pole_turns_nothing_over(aside, limits):
    """A hand that is led down past the direction in which elbows point: no swivel angle jumps."""
    shoulder = FIGURE.rest_positions[FIGURE.roles.shoulder[0]]
    angle = np.linspace(-1.2, 1.2, 120)  # about X, from before the body to behind it
    path = shoulder + 0.45 * np.column_stack([0 * angle + aside, -np.cos(angle), -np.sin(angle)])
    motion = sp.SequentialIKPlus(FIGURE, limits=limits).solve_motion(sweep(path, 120.0))
    assert not find_swivel_jumps(FIGURE, motion).any()


def test_a_limb_that_straightens_keeps_its_side():
    """Through a straight arm and back the elbow's axis goes nowhere near a half turn."""
    shoulder = FIGURE.rest_positions[FIGURE.roles.shoulder[0]]
    reach = 0.5 * (1.0 - np.abs(np.linspace(-0.6, 0.6, 60))) + 0.08
    path = shoulder + reach[:, None] * unit([0.3, -0.2, 1.0])
    motion = sp.SequentialIKPlus(FIGURE, limits=False).solve_motion(sweep(path, 60.0))
    local = compute_local_rotations(FIGURE, motion, [FIGURE.roles.shoulder[0]])[:, 0]
    turn = Rotation.from_quat(local[:-1]).inv() * Rotation.from_quat(local[1:])
    assert turn.magnitude().max() < 0.35


@pytest.mark.parametrize("rate", [30.0, 60.0, 240.0])
def test_the_way_to_the_pole_takes_time_not_frames(rate):
    """An angle that the pole's direction moves is where it is after equal times at every frame rate."""

    def after(hertz: float) -> float:
        angle = 1.5
        for _ in range(round(0.1 * hertz)):
            angle = limbs.approach(angle, 0.4, 0.03, 0.02, 5.0, 1 / hertz)
        return angle

    assert after(rate) == pytest.approx(after(1000.0), abs=0.06)
    assert limbs.approach(0.3, 1.0, 0.0, 0.02, 50.0, 1 / 60) == 0.0
    assert limbs.approach(0.3, 0.5, 0.0, 0.02, 50.0, 0.0) == 0.3


def test_the_pelvis_turns_at_a_bounded_speed():
    """Points that turn around in one frame turn the pelvis by its largest speed; it arrives all the same."""
    points = np.tile(points_of(FIGURE), (60, 1, 1))
    points[:, 4:, 1] += 0.2  # legs that need not turn the pelvis to reach
    points[10:] *= [-1.0, 1.0, -1.0]
    solver = sp.SequentialIKPlus(FIGURE, limits=False, habits=replace(HABITS, memory=0.0))
    motion = solver.solve_motion(sp.Targets(points, 120.0))
    turned = Rotation.from_quat(compute_local_rotations(FIGURE, motion, [FIGURE.roles.pelvis])[:, 0])
    steps = (turned[:-1].inv() * turned[1:]).magnitude()
    assert steps.max() <= HABITS.turn_speed / 120 + 0.02
    assert turned[-1].magnitude() == pytest.approx(np.pi, abs=0.05)


def test_nothing_swivels_faster_than_people_do(data):
    """Limits off, on recordings: no elbow or knee jumps that does not jump in truth."""
    for path in sorted((data / "cmu").glob("14_0*.amc"))[:2] + [data / "cmu" / "05_16.amc"]:
        motion = sp.load(path)
        motion = motion.sliced(slice(0, min(1500, len(motion))))
        figure = sp.Figure.from_motion(motion)
        result = sp.SequentialIKPlus(figure, limits=False).solve_motion(figure.targets(motion))
        assert find_swivel_jumps(figure, result).sum() <= find_swivel_jumps(figure, motion).sum()
