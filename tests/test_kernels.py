"""The compiled helpers are plain Python too, and agree with SciPy."""

from __future__ import annotations

import os
import subprocess
import sys
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from independent import limit_excess
from sixpoint import Limits
from sixpoint.kernels import jit
from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.swing_twist import build_ball_rows, clamp, swing_limit

finite = st.floats(-1, 1)
rotations = arrays(float, 4, elements=finite).filter(lambda q: np.linalg.norm(q) > 0.1)
rotations = rotations.map(lambda q: tuple(q / np.linalg.norm(q)))
units = arrays(float, 3, elements=finite).filter(lambda v: np.linalg.norm(v) > 0.1)
units = units.map(lambda v: tuple(v / np.linalg.norm(v)))

LIMITS = Limits.default()
BALLS = [
    LIMITS.shoulder(1.0),
    LIMITS.hip(-1.0),
    LIMITS.clavicle(np.array([1.0, 0, 0]), 1.0),
    *LIMITS.spine([0, 1]),
]
ROWS = build_ball_rows([ball.limit for ball in BALLS])


@given(rotations, rotations, units)
def test_products_agree_with_scipy(a, b, v):
    """Products, inverse products and rotated vectors are SciPy's."""
    first, second = Rotation.from_quat(a), Rotation.from_quat(b)
    for ours, theirs in ((qt.mul(a, b), first * second), (qt.inv_mul(a, b), first.inv() * second)):
        assert (Rotation.from_quat(ours) * theirs.inv()).magnitude() < 1e-12
    np.testing.assert_allclose(qt.mul_vec(a, v), first.apply(v), atol=1e-12)
    np.testing.assert_allclose(qt.inv_mul_vec(a, v), first.inv().apply(v), atol=1e-12)


@given(rotations)
def test_axes_and_fractions_agree_with_scipy(q):
    """Matrix columns, the way back from them, and fractions of a turn are SciPy's."""
    matrix = Rotation.from_quat(q).as_matrix()
    columns = qt.x_axis(q), qt.y_axis(q), qt.z_axis(q)
    np.testing.assert_allclose(np.transpose(columns), matrix, atol=1e-12)
    assert (Rotation.from_quat(qt.from_axes(*columns)) * Rotation.from_quat(q).inv()).magnitude() < 1e-7
    vector = Rotation.from_quat(q).as_rotvec()
    if np.linalg.norm(vector) < pi - 1e-6:
        half = Rotation.from_quat(qt.scaled(q, 0.5))
        np.testing.assert_allclose(half.as_rotvec(), 0.5 * vector, atol=1e-9)


@given(units, units)
def test_arc_takes_one_direction_to_the_other_the_short_way(u, v):
    """The shortest rotation maps u to v and turns by the angle between them."""
    q = qt.arc(u, v, vec.unit(vec.cross(u, (0.3, 0.5, -0.8))))
    np.testing.assert_allclose(qt.mul_vec(q, u), v, atol=1e-6)
    angle = np.arctan2(np.linalg.norm(np.cross(u, v)), np.dot(u, v))
    assert Rotation.from_quat(q).magnitude() == pytest.approx(angle, abs=1e-6)


@given(units, st.floats(-3.1, 3.1))
def test_twist_of_a_turn_about_the_axis_is_its_angle(axis, angle):
    """A rotation about the twist axis is all twist."""
    assert qt.twist_angle(qt.from_axis_angle(axis, angle), axis) == pytest.approx(angle, abs=1e-9)


@given(rotations, st.integers(0, len(BALLS) - 1))
def test_clamp_stays_within_the_limits_and_is_idempotent(q, b):
    """A clamped rotation is inside, by matrices and SciPy; clamping it again changes nothing."""
    once, _ = clamp(ROWS, b, q)
    swing, twist = limit_excess(BALLS[b].limit, Rotation.from_quat(once).as_matrix()[None])
    assert swing[0] < 1e-6 and twist[0] < 1e-6
    again, changed = clamp(ROWS, b, once)
    assert not changed or (Rotation.from_quat(again) * Rotation.from_quat(once).inv()).magnitude() < 1e-7


@given(st.floats(-pi, pi), st.floats(0, 1), st.floats(-1, 1), st.integers(0, len(BALLS) - 1))
def test_clamp_leaves_what_is_inside(theta, share, turn, b):
    """A rotation inside its limits is returned untouched."""
    limit = BALLS[b].limit
    psi = 0.999 * share * float(limit.compute_limit(theta))
    lean = np.cos(theta) * limit.forward + np.sin(theta) * limit.side
    twist = 0.999 * (limit.twist[1] if turn > 0 else -limit.twist[0]) * turn
    q = Rotation.from_rotvec(np.cross(limit.axis, lean) * psi) * Rotation.from_rotvec(limit.axis * twist)
    clamped, changed = clamp(ROWS, b, tuple(q.as_quat()))
    assert not changed
    np.testing.assert_array_equal(clamped, q.as_quat())


@given(st.floats(-pi, pi), st.floats(0, 2.6), st.integers(0, len(BALLS) - 1))
def test_clamp_keeps_the_direction_of_the_swing(theta, psi, b):
    """Outside, the segment comes back along its great circle: theta stays."""
    limit = BALLS[b].limit
    lean = np.cos(theta) * limit.forward + np.sin(theta) * limit.side
    q = Rotation.from_rotvec(np.cross(limit.axis, lean) * psi)
    clamped, changed = clamp(ROWS, b, tuple(q.as_quat()))
    if changed:
        segment = Rotation.from_quat(clamped).apply(np.array(limit.axis))
        assert np.arccos(np.clip(segment @ limit.axis, -1, 1)) == pytest.approx(
            float(limit.compute_limit(theta)), abs=1e-6
        )
        across = segment - (segment @ limit.axis) * limit.axis
        np.testing.assert_allclose(across / np.linalg.norm(across), lean, atol=1e-6)


def test_an_arm_overhead_and_behind_stays_up():
    """Five degrees behind straight up is clamped to straight up, not to the back."""
    q = Rotation.from_euler("X", 175, degrees=True)  # -Y swings backward and up
    clamped, changed = clamp(ROWS, 0, tuple(q.as_quat()))
    assert changed
    np.testing.assert_allclose(Rotation.from_quat(clamped).apply([0, -1, 0]), [0, 1, 0], atol=1e-9)


@pytest.mark.parametrize("b", range(len(BALLS)))
def test_swing_limit_is_the_spline(b):
    """The compiled cubic is SciPy's spline with the end slopes of eq. 3, clipped to its knots."""
    limit = BALLS[b].limit
    slopes = np.diff(limit.psi) / np.diff(limit.theta)
    end = (1, 0.5 * (slopes[0] + slopes[-1]))
    spline = CubicSpline(limit.theta, limit.psi, bc_type=(end, end))
    theta = np.linspace(-pi, pi, 721)
    expected = np.clip(spline(theta), limit.psi.min(), limit.psi.max())
    np.testing.assert_allclose([swing_limit(ROWS[b], t) for t in theta], expected, atol=1e-12)
    np.testing.assert_allclose(limit.compute_limit(theta), expected, atol=1e-12)


def test_cache_folder_changes_with_the_sources(tmp_path, monkeypatch):
    """Compiled code is kept under a hash of the compiled sources, so an edit is never missed."""
    (tmp_path / "kernels").mkdir()
    (tmp_path / "kernels" / "a.py").write_text("x = 1\n")
    monkeypatch.setattr(jit, "PACKAGE", tmp_path)
    before = jit._source_hash()
    (tmp_path / "kernels" / "a.py").write_text("x = 2\n")
    assert jit._source_hash() != before


def test_unwritable_places_are_passed_over(tmp_path, monkeypatch):
    """Where neither home nor temporary folder can be written, there is no cache and no error."""
    blocked = tmp_path / "file"
    blocked.write_text("")
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA", "HOME"):
        monkeypatch.setenv(name, str(blocked))
    monkeypatch.setattr(jit.tempfile, "gettempdir", lambda: str(blocked))
    assert jit._cache_folder() is None


def test_the_solver_runs_without_compilation():
    """With compilation switched off the same code runs as Python and gives the same pose."""
    program = (
        "import numpy as np, sixpoint as sp\n"
        "figure = sp.Figure.from_stature(1.75)\n"
        "motion = sp.make_sample('reach', figure).sliced(slice(0, 60, 20))\n"
        "print(sp.SequentialIK(figure).solve_motion(figure.targets(motion)).positions.sum())"
    )
    sums = [
        float(
            subprocess.run(
                [sys.executable, "-c", program],
                env=os.environ | {"NUMBA_DISABLE_JIT": off},
                capture_output=True,
                text=True,
                check=True,
            ).stdout
        )
        for off in ("1", "0")
    ]
    assert sums[0] == pytest.approx(sums[1], abs=1e-6)
