"""The triangle of FLEXT (Boulic and Raunhardt 2009): posture variations that are exact in space."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sixpoint.solvers.prioritized.engine import flext

seeds = st.integers(0, 2**32 - 1)


def turned(point: np.ndarray, centre: np.ndarray, axis: np.ndarray, angle: float) -> np.ndarray:
    """A point turned about an axis through a centre."""
    return centre + Rotation.from_rotvec(axis * angle).apply(point - centre)


class Triangle:
    """A random limb in space: root, middle and end at random, a random flexion axis."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.axis = rng.normal(size=3)
        self.axis /= np.linalg.norm(self.axis)
        self.root, self.middle, self.end = rng.normal(size=(3, 3))
        self.share = rng.uniform(0.02, 0.98)
        self.sides = self.measure()

    def measure(self) -> tuple:
        """L1, L2, L3, sigma, alpha and offset by the code under test."""
        return flext.triangle(*(tuple(v) for v in (self.root, self.middle, self.end, self.axis)))

    def line(self) -> np.ndarray:
        """From root to end, in the plane."""
        away = self.end - self.root
        return away - (away @ self.axis) * self.axis

    def flex(self, turn: float, bend: float) -> None:
        """Turn at the root, bend at the hinge."""
        self.end = turned(self.end, self.middle, self.axis, bend)
        self.middle = turned(self.middle, self.root, self.axis, turn)
        self.end = turned(self.end, self.root, self.axis, turn)


@settings(max_examples=200, deadline=None)
@given(seed=seeds, standard=st.sampled_from([1.0, -1.0]))
def test_the_posture_variation_moves_the_end_along_the_line_exactly(seed, standard):
    """L3 changes by what was wanted; its direction and the offset from the plane stay, on either side."""
    t = Triangle(seed)
    l1, l2, l3, sigma, alpha, offset = t.sides
    before = t.line()
    wanted = abs(l1 - l2) + t.share * (l1 + l2 - abs(l1 - l2)) - l3
    turn, bend, todo, beyond = flext.solve_triangle(l1, l2, l3, sigma, alpha, wanted, standard, -np.pi, np.pi)
    t.flex(turn, bend)
    after = t.line()
    assert todo == 1.0 and beyond == pytest.approx(0.0, abs=1e-9)
    assert np.linalg.norm(after) == pytest.approx(l3 + wanted, abs=1e-9)
    direction = before / np.linalg.norm(before)
    np.testing.assert_allclose(after / np.linalg.norm(after), direction, atol=1e-7)
    assert (t.end - t.root) @ t.axis == pytest.approx(offset, abs=1e-12)


@given(seed=seeds, angles=st.tuples(*[st.floats(-3, 3)] * 3))
def test_lengths_are_those_of_the_plane(seed, angles):
    """L1 stays under any joint motion, L2 under those of root and hinge; L3 follows the cosine rule."""
    t = Triangle(seed)
    l1, l2, _, sigma, *_ = t.sides
    t.flex(*angles[:2])
    whole = Rotation.from_rotvec(np.array(angles))
    t.root, t.middle, t.end, t.axis = (whole.apply(v) for v in (t.root, t.middle, t.end, t.axis))
    one, two, three, bend, *_ = t.measure()
    assert (one, two) == pytest.approx((l1, l2), abs=1e-9)
    assert three == pytest.approx(np.sqrt(max(l1**2 + l2**2 + 2 * l1 * l2 * np.cos(bend), 0.0)), abs=1e-7)
    assert np.cos(bend - sigma - angles[1]) == pytest.approx(1.0, abs=1e-9)
    l1, l2, *_ = t.measure()
    bone = t.end - t.middle
    t.end = turned(t.end + 0.3 * np.cross(bone, t.axis), t.middle, bone / np.linalg.norm(bone), 1.0)
    assert t.measure()[0] == pytest.approx(l1, abs=1e-9)
    assert abs(t.measure()[1] - l2) > 1e-6  # off the twist axis it changes


@given(st.floats(0.05, 1.0), st.floats(0.05, 1.0), st.floats(-2.0, 2.0), st.floats(-1.5, 1.5))
def test_what_is_out_of_reach_is_clamped(l1, l2, sigma, wanted):
    """The end stays short of full extension and flexion, and ``beyond`` is what is missing."""
    l3 = flext.length_at(l1, l2, sigma)
    alpha = np.arctan2(-l2 * np.sin(sigma), l1 + l2 * np.cos(sigma))
    turn, bend, todo, beyond = flext.solve_triangle(l1, l2, l3, sigma, -alpha, wanted, 1.0, -np.pi, np.pi)
    there = flext.length_at(l1, l2, sigma + bend)
    slack = 2e-3 * (l1 + l2) if todo == 0.0 else 1e-6 * (l1 + l2)
    assert abs(l1 - l2) < there < l1 + l2
    assert there == pytest.approx(np.clip(l3 + wanted, abs(l1 - l2), l1 + l2), abs=slack + 2e-6 * (l1 + l2))
    expected = l3 + wanted - np.clip(l3 + wanted, abs(l1 - l2), l1 + l2)
    assert beyond == pytest.approx(expected, abs=3e-6 * (l1 + l2))
    assert np.hypot(turn, bend) > 1e-9  # a virtual displacement where nothing is to be done


def test_an_overextended_limb_comes_back_over_the_straight_one():
    """Bent 0.1 rad the wrong way and barred from more, it reaches an inner length on the normal side."""
    l1, l2, sigma = 0.3, 0.27, -0.1
    l3 = flext.length_at(l1, l2, sigma)
    alpha = np.arctan2(l2 * np.sin(sigma), l1 + l2 * np.cos(sigma))
    turn, bend, todo, _ = flext.solve_triangle(l1, l2, l3, sigma, alpha, -0.05, 1.0, -0.1, 2.6)
    assert todo == 1.0 and sigma + bend > 0.0
    assert flext.length_at(l1, l2, sigma + bend) == pytest.approx(l3 - 0.05, abs=1e-9)
    end = [
        l1 * np.cos(turn) + l2 * np.cos(turn + sigma + bend),
        l1 * np.sin(turn) + l2 * np.sin(turn + sigma + bend),
    ]
    assert np.arctan2(end[1], end[0]) == pytest.approx(alpha, abs=1e-9)


odd = st.one_of(st.floats(-3, 3), st.sampled_from([0.0, 1e-12, -1e-9, 0.3, np.pi, -np.pi]))


@settings(max_examples=300)
@given(
    st.tuples(*[odd] * 9),
    st.tuples(odd, odd, odd).filter(lambda v: np.linalg.norm(v) > 1e-3),
    odd,
    st.tuples(odd, odd).map(sorted),
)
def test_no_limb_gives_nan(points, axis, wanted, limits):
    """Straight, folded, coincident or in a line with the axis: always finite."""
    axis = tuple(np.array(axis) / np.linalg.norm(axis))
    found = flext.triangle(points[:3], points[3:6], points[6:], axis)
    answer = flext.solve_triangle(*found[:5], wanted, 1.0, *limits)
    assert np.isfinite(found).all() and np.isfinite(answer).all()


@given(
    st.tuples(*[st.floats(-1.7, 1.7)] * 3),
    st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    st.floats(-0.3, 0.3),
)
def test_the_exponential_form_is_the_difference_of_rotation_vectors(vector, axis, angle):
    """Carried through the derivative of the exponential map it is log(R') - log(R), on the nearest branch."""
    axis = np.array(axis) / np.linalg.norm(axis)
    here = Rotation.from_rotvec(vector)
    found = np.array(flext.exponential(tuple(here.as_quat()), tuple(axis), angle))
    v = here.as_rotvec()
    w = (Rotation.from_rotvec(axis * angle) * here).as_rotvec()
    length = np.linalg.norm(w)
    if length > 1e-9 and np.linalg.norm(w * (1 - 2 * np.pi / length) - v) < np.linalg.norm(w - v):
        w = w * (1 - 2 * np.pi / length)
    h = 1e-6
    ahead, back = (Rotation.from_rotvec(v + s * h * (w - v)) for s in (1, -1))
    np.testing.assert_allclose(found, (ahead * back.inv()).as_rotvec() / (2 * h), atol=1e-6)
