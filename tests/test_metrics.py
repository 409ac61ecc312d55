"""The error metrics have the properties that the paper's definition implies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sixpoint as sp
from sixpoint.study.metrics import measured_joints

FIGURE = sp.Figure.from_stature(1.75)
MOTION = sp.make_sample("boxing", FIGURE).sliced(slice(0, 60))


def shifted(motion: sp.Motion, by: list[float]) -> sp.Motion:
    translations = motion.translations.copy()
    translations[:, 0] += by
    return replace(motion, translations=translations)


def turned(motion: sp.Motion, joint: int, vector: list[float]) -> sp.Motion:
    rotations = motion.rotations.copy()
    after = Rotation.from_quat(rotations[:, joint]) * Rotation.from_rotvec(vector)
    rotations[:, joint] = after.as_quat()
    return replace(motion, rotations=rotations)


def test_a_motion_has_no_error_to_itself():
    """Identical motions have zero errors."""
    errors = sp.compute_errors(FIGURE, MOTION, MOTION)
    assert errors.position == errors.orientation == errors.position_pooled == 0.0


def test_there_are_22_joints():
    """On the built-in figure 22 joints count, three of them at the root, none beyond wrists and ankles."""
    errors = sp.compute_errors(FIGURE, MOTION, MOTION)
    assert len(errors.joints) == 22
    assert {"humanoid_root", "vl5", "skullbase", "l_wrist", "r_ankle"} < set(errors.joints)
    assert not {"l_index1", "r_midtarsal"} & set(errors.joints)


def test_a_shift_costs_its_length_over_the_height():
    """A rigid translation by v gives |v| / H, and no orientation error."""
    errors = sp.compute_errors(FIGURE, MOTION, shifted(MOTION, [0.03, 0.0, -0.04]))
    assert errors.position == pytest.approx(0.05 / FIGURE.height, rel=1e-9)
    assert errors.orientation == 0.0


def test_the_height_is_the_sum_of_segments():
    """H is calf + thigh + pelvis + torso + neck, as in section 9, not the stature."""
    skeleton = FIGURE.skeleton
    parts = ["l_ankle", "l_knee", "vl1", "vt6", "vt1", "vc4", "skullbase"]
    total = sum(np.linalg.norm(skeleton.offsets[skeleton.index(name)]) for name in parts)
    total += abs(skeleton.offsets[skeleton.index("l_hip")][1])
    assert FIGURE.height == pytest.approx(total, rel=1e-12)


def test_an_error_in_one_joint_counts_one_22nd():
    """A constant angle a in one joint gives a / 22, whichever joint and axis; children do not add to it."""
    for name in ("vt6", "l_shoulder", "r_knee", "humanoid_root"):
        result = turned(MOTION, FIGURE.skeleton.index(name), [0.12, -0.16, 0.0])
        errors = sp.compute_errors(FIGURE, MOTION, result)
        assert errors.orientation == pytest.approx(0.2 / 22, rel=1e-9)


def test_fixed_joints_between_do_not_matter():
    """Rotation of a joint without a role counts at the next joint that has one."""
    result = turned(MOTION, FIGURE.skeleton.index("sacroiliac"), [0.0, 0.3, 0.0])
    errors = sp.compute_errors(FIGURE, MOTION, result)
    assert errors.orientation == pytest.approx(2 * 0.3 / 22, rel=1e-9)  # both hips


def test_scale_cancels():
    """Truth and result scaled alike, on a scaled figure, have the same position error."""
    large = sp.Figure.from_stature(1.75 * 1.2)
    pair = [MOTION, turned(MOTION, 14, [0.2, 0.0, 0.0])]
    scaled = [sp.Motion(large.skeleton, m.rotations, m.translations * 1.2, m.rate) for m in pair]
    first, second = sp.compute_errors(FIGURE, *pair), sp.compute_errors(large, *scaled)
    assert second.position == pytest.approx(first.position, rel=1e-9)
    assert second.orientation == pytest.approx(first.orientation, rel=1e-9)


def test_against_a_second_computation():
    """On a real reconstruction the numbers agree with the definition written out with SciPy matrices."""
    from independent import world_matrices

    result = sp.SequentialIK(FIGURE).solve_motion(FIGURE.targets(MOTION))
    errors = sp.compute_errors(FIGURE, MOTION, result)
    joints = measured_joints(FIGURE)
    (p, g), (q, h) = world_matrices(MOTION), world_matrices(result)
    distances = np.linalg.norm(p - q, axis=-1)[:, [0, *joints]]
    total = np.zeros(len(MOTION))
    for joint in joints:
        above = [j for j in FIGURE.skeleton.path(0, joint)[:-1] if j in joints]
        a, b = g[:, joint], h[:, joint]
        if above:
            a = np.swapaxes(g[:, above[-1]], 1, 2) @ a
            b = np.swapaxes(h[:, above[-1]], 1, 2) @ b
        total += Rotation.from_matrix(np.swapaxes(a, 1, 2) @ b).magnitude()
    position = np.sqrt(np.mean((distances.sum(axis=1) / 22 / FIGURE.height) ** 2))
    assert errors.position == pytest.approx(position, rel=1e-9)
    assert errors.orientation == pytest.approx(np.sqrt(np.mean((total / 22) ** 2)), rel=1e-7)
    assert errors.position >= errors.position_curve.mean()
    assert errors.orientation <= np.pi


def test_motions_of_another_rig_are_refused():
    """Other joints or another number of frames are errors that say so."""
    other = sp.Motion(
        sp.Skeleton(("a",), np.array([-1]), np.zeros((1, 3))), [[[0, 0, 0, 1]]], [[[0, 0, 0]]], 60
    )
    with pytest.raises(sp.SkeletonError, match="rig"):
        sp.compute_errors(FIGURE, MOTION, other)
    with pytest.raises(sp.SkeletonError, match="60 frames"):
        sp.compute_errors(FIGURE, MOTION, MOTION.sliced(slice(0, 10)))
