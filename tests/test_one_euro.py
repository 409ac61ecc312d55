"""The One Euro filter: what it must do to constants, steps, gaps and uneven times."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sixpoint.errors import TargetError
from sixpoint.signals.one_euro import SMOOTHINGS, OneEuro, Smoothing, compute_alpha, find_smoothing

STEADY = Smoothing(cutoff=1.0, beta=0.0, turn_cutoff=1.0, turn_beta=0.0)
TAU = 1.0 / (2.0 * np.pi)


def angle(a, b):
    return (Rotation.from_quat(a) * Rotation.from_quat(b).inv()).magnitude()


@pytest.mark.parametrize("name", SMOOTHINGS)
def test_a_constant_input_is_a_fixed_point(name):
    """What does not move comes out as it went in, position and rotation."""
    filter_ = OneEuro(find_smoothing(name))
    points, turn = np.array([[0.1, 1.0, -2.0]]), Rotation.from_rotvec([[0.3, -2.0, 1.0]]).as_quat()
    for k in range(50):
        np.testing.assert_allclose(filter_.filter_positions(points, k / 90), points, atol=1e-12)
        np.testing.assert_allclose(filter_.filter_rotations(turn, k / 90), turn, atol=1e-9)


@given(st.floats(1e-3, 1e3), st.floats(1e-6, 1e3))
def test_a_weight_is_a_share(cutoff, dt):
    """Every new sample counts, and none more than wholly; where no time passed, none counts."""
    assert 0.0 < compute_alpha(cutoff, dt) <= 1.0
    assert compute_alpha(cutoff, 0.0) == compute_alpha(cutoff, -1.0) == 0.0


@pytest.mark.parametrize("rate", [30.0, 90.0, 1000.0])
def test_a_step_reaches_63_percent_at_tau(rate):
    """At rest the answer to a step is 1 - exp(-t / tau), at any rate, in space and on the sphere."""
    filter_ = OneEuro(STEADY)
    rest = np.array([[0.0, 0.0, 0.0, 1.0]])
    turned = Rotation.from_rotvec([[0.0, 1.0, 0.0]]).as_quat()
    filter_.filter_positions(np.zeros((1, 3)), 0.0), filter_.filter_rotations(rest, 0.0)
    steps = max(1, round(TAU * rate))
    for k in range(1, steps + 1):
        out = filter_.filter_positions(np.ones((1, 3)), k / rate)
        q = filter_.filter_rotations(turned, k / rate)
    expected = 1.0 - np.exp(-steps / rate / TAU)
    np.testing.assert_allclose(out, expected, rtol=1e-9)
    np.testing.assert_allclose(angle(q[0], rest[0]), expected, rtol=1e-9)
    if rate == 1000.0:
        assert abs(expected - 0.632) < 0.002


def test_uneven_times_end_where_even_ones_do():
    """Halving some steps of a held value changes nothing."""
    even, uneven = OneEuro(STEADY), OneEuro(STEADY)
    for f in (even, uneven):
        f.filter_positions(np.zeros((1, 3)), 0.0)
    for t in (0.02, 0.04, 0.06):
        a = even.filter_positions(np.ones((1, 3)), t)
    for t in (0.005, 0.02, 0.023, 0.06):
        b = uneven.filter_positions(np.ones((1, 3)), t)
    np.testing.assert_allclose(a, b, rtol=1e-12)


def test_speed_raises_the_cutoff():
    """The faster, the less a filter lags, and rotations likewise."""
    lag = {}
    for speed in (0.1, 2.0):
        filter_ = OneEuro(SMOOTHINGS["strong"])
        for k in range(90):
            out = filter_.filter_positions([[speed * k / 90, 0.0, 0.0]], k / 90)
            turn = Rotation.from_rotvec([[0.0, speed * k / 90, 0.0]]).as_quat()
            q = filter_.filter_rotations(turn, k / 90)
        lag[speed] = (speed * 89 / 90 - out[0, 0]) / speed, angle(q[0], turn[0]) / speed
    assert lag[2.0][0] < 0.25 * lag[0.1][0]
    assert lag[2.0][1] < 0.5 * lag[0.1][1]


def test_jitter_shrinks_as_documented():
    """Of noise on still points light leaves less than half, strong less than a third."""
    rng = np.random.default_rng(0)
    noisy = rng.normal(0.0, 0.0015, (600, 6, 3))
    left = {}
    for name in SMOOTHINGS:
        filter_ = OneEuro(SMOOTHINGS[name])
        out = np.array([filter_.filter_positions(p, k / 90) for k, p in enumerate(noisy)])
        left[name] = np.sqrt(np.mean(out[100:] ** 2)) / 0.0015
    assert left["off"] > 0.98 and left["light"] < 0.5 and left["strong"] < 0.33, left


def test_unknown_values_pass_and_poison_nothing():
    """NaN in, NaN out, for that row and frame only; the row goes on from where it was."""
    filter_ = OneEuro(SMOOTHINGS["light"])
    value = np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]])
    turns = np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))
    for k in range(5):
        filter_.filter_positions(value, k / 90), filter_.filter_rotations(turns, k / 90)
    hole, gap = value.copy(), turns.copy()
    hole[0, 1], gap[0] = np.nan, 0.0
    out, q = filter_.filter_positions(hole, 5 / 90), filter_.filter_rotations(gap, 5 / 90)
    assert np.isnan(out[0]).all() and np.isnan(q[0]).all()
    np.testing.assert_allclose(out[1], value[1]), np.testing.assert_allclose(q[1], turns[1])
    np.testing.assert_allclose(filter_.filter_positions(value, 6 / 90), value, atol=1e-12)
    np.testing.assert_allclose(filter_.filter_rotations(turns, 6 / 90), turns, atol=1e-12)


def test_time_that_runs_backwards_changes_nothing():
    """A packet from the past leaves the output where it was."""
    filter_ = OneEuro(SMOOTHINGS["light"])
    filter_.filter_positions(np.zeros((1, 3)), 1.0)
    before = filter_.filter_positions(np.full((1, 3), 0.1), 1.1)
    np.testing.assert_array_equal(filter_.filter_positions(np.full((1, 3), 9.0), 1.05), before)


def test_rotations_come_out_on_the_inputs_side():
    """A sender that flips the sign of its quaternions turns nothing."""
    filter_ = OneEuro(SMOOTHINGS["strong"])
    q = Rotation.from_rotvec([[0.4, 0.2, -0.1]]).as_quat()
    for k in range(20):
        sign = -1.0 if k % 2 else 1.0
        np.testing.assert_allclose(filter_.filter_rotations(sign * q, k / 90), sign * q, atol=1e-9)


def test_wrong_constants_and_names_are_told():
    """The message says what a constant is, and which smoothings there are."""
    with pytest.raises(TargetError, match="off, light, strong"):
        find_smoothing("heavy")
    with pytest.raises(TargetError, match="cutoff is a frequency"):
        Smoothing(0.0, 1.0, 1.0, 1.0)
    with pytest.raises(TargetError, match="beta"):
        Smoothing(1.0, -1.0, 1.0, 1.0)
