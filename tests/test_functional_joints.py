"""Centres and axes of joints from movement alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sixpoint.calibration.markers.functional import fit_axis, fit_centre, fit_common_centre
from sixpoint.calibration.markers.kinematics import SEGMENTS, Kinematics, exponential, left_jacobian

CENTRE = np.array([0.09, -0.08, 0.02])
ON_THIGH = np.array([[0.08, -0.2, 0.03], [0.05, -0.42, 0.0], [-0.04, -0.4, 0.05]])


def swinging(frames: int = 300, seed: int = 0) -> Rotation:
    angles = np.random.default_rng(seed).uniform(-1, 1, (frames, 3)) * [0.5, 0.3, 0.3]
    return Rotation.from_euler("XYZ", angles)


def test_a_sphere_has_its_centre():
    """Without noise the centre is exact, whatever the markers' distances."""
    points = np.stack([CENTRE + swinging().apply(p) for p in ON_THIGH[:2]], axis=1)
    found = fit_centre(points)
    np.testing.assert_allclose(found.position, CENTRE, atol=1e-9)
    assert found.std < 1e-6 and found.spread < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_noise_moves_the_centre_by_what_is_said(seed):
    """Three millimetres of noise and gaps: within three standard deviations, and a centimetre."""
    rng = np.random.default_rng(seed)
    points = np.stack([CENTRE + swinging(seed=seed).apply(p) for p in ON_THIGH[:2]], axis=1)
    points += 0.003 * rng.normal(size=points.shape)
    points[rng.random(points.shape[:2]) < 0.2] = np.nan
    found = fit_centre(points)
    error = np.linalg.norm(found.position - CENTRE)
    assert error < min(3 * found.std, 0.01)


def test_a_movement_in_a_plane_tells_nothing_across():
    """A hinge's sphere has no centre along its axis: the deviation says so."""
    turned = Rotation.from_rotvec(np.outer(np.linspace(0, 1, 100), [0.8, 0, 0]))
    points = CENTRE + turned.apply(ON_THIGH[0])[:, None]
    points += 0.001 * np.random.default_rng(0).normal(size=points.shape)
    assert fit_centre(points).std > 0.03


def test_two_moving_segments_share_a_point():
    """The common point in the frame of each, both moving."""
    first, second = swinging(seed=1), swinging(seed=2)
    place = np.random.default_rng(3).normal(size=(300, 3))
    joint = place + first.apply(CENTRE)
    here, there = fit_common_centre(
        (first.as_matrix(), place), (second.as_matrix(), joint - second.apply(ON_THIGH[0]))
    )
    np.testing.assert_allclose(here.position, CENTRE, atol=1e-9)
    np.testing.assert_allclose(there.position, ON_THIGH[0], atol=1e-9)


def test_a_hinge_has_its_axis():
    """Markers of the shank move across the knee's axis."""
    axis = np.array([0.98, 0.1, -0.17]) / np.linalg.norm([0.98, 0.1, -0.17])
    turned = Rotation.from_rotvec(np.outer(np.linspace(0, 1.2, 80), axis))
    points = np.stack([CENTRE + turned.apply(p) for p in ON_THIGH], axis=1)
    found, ratio = fit_axis(points)
    assert abs(found @ axis) > 1 - 1e-12 and ratio > 1e3


def test_too_few_frames_tell_nothing():
    """Nine frames are not a movement."""
    assert np.isinf(fit_centre(np.zeros((9, 2, 3))).std)


def test_derivatives_of_the_figure_are_those_of_differences():
    """Joint positions change with every coordinate and length as finite differences say."""
    kinematics, rng = Kinematics(), np.random.default_rng(0)
    lengths = rng.uniform(0.1, 0.5, len(SEGMENTS))
    pose = 0.6 * rng.normal(size=(2, kinematics.size))
    placed = kinematics.place(lengths, pose)
    dof, joint = kinematics.columns
    arms = placed.positions[:, :, None] - placed.positions[:, None, joint]
    moved = np.cross(placed.axes[:, None], arms) * kinematics.carried[None, :, :, None]
    step = 1e-6
    for d in range(3, kinematics.size):
        shift = step * (np.arange(kinematics.size) == d)
        change = (
            kinematics.place(lengths, pose + shift).positions
            - kinematics.place(lengths, pose - shift).positions
        )
        np.testing.assert_allclose(moved[:, :, dof == d].sum(axis=2), change / (2 * step), atol=1e-7)
    for k in range(len(SEGMENTS)):
        shift = step * (np.arange(len(SEGMENTS)) == k)
        change = kinematics.place(lengths + shift, pose).positions - placed.positions
        np.testing.assert_allclose(placed.growth[..., k], change / step, atol=1e-6)


def test_rotation_vectors_are_scipys():
    """The exponential is SciPy's; its left Jacobian is its derivative."""
    vectors = np.random.default_rng(0).normal(size=(20, 3))
    np.testing.assert_allclose(exponential(vectors), Rotation.from_rotvec(vectors).as_matrix(), atol=1e-12)
    small = 1e-6 * np.random.default_rng(1).normal(size=(20, 3))
    turned = Rotation.from_rotvec((left_jacobian(vectors) @ small[..., None])[..., 0])
    np.testing.assert_allclose(
        exponential(vectors + small), (turned * Rotation.from_rotvec(vectors)).as_matrix(), atol=1e-10
    )
