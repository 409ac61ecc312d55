"""Which anonymous tracker is what: ten poses, any order, small and tall, with and without a facing."""

from __future__ import annotations

import numpy as np
import pytest

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.targets import POINTS
from sixpoint.calibration.roles import KITS, assign_roles, facing_of_rotation, facing_of_step
from sixpoint.errors import TargetError
from start_poses import POSES, stand, with_offsets

FIGURES = {h: Figure.from_stature(h) for h in (1.2, 1.45, 1.7, 2.0)}


def trackers(kit, pose, stature, rng):
    """Shuffled trackers (n, 3), what each should be, and where the person faces, not exactly."""
    yaw = rng.uniform(-np.pi, np.pi)
    points, turns = stand(FIGURES[stature], pose, yaw)
    points = with_offsets(points, turns, rng)
    names = KITS[kit]
    order = rng.permutation(kit)
    shuffled = points[[POINTS.index(n) for n in names]][order]
    want = {n: int(np.flatnonzero(order == k)[0]) for k, n in enumerate(names)}
    off = yaw + np.radians(POSES[pose].get("gaze", 0.0)) + rng.uniform(-0.15, 0.15)
    return shuffled, want, np.array([np.sin(off), 0.0, np.cos(off)])


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("kit", [3, 4, 6, 11])
def test_roles_are_right_where_the_facing_is_known(kit, pose):
    """Every start pose, any order, 1.2 to 2.0 m, trackers up to 10 cm off their joints."""
    rng = np.random.default_rng([kit, list(POSES).index(pose)])
    for stature in FIGURES:
        for _ in range(3 if kit < 11 else 1):
            points, want, facing = trackers(kit, pose, stature, rng)
            head = want["head"] if kit == 3 else None  # three trackers are a headset and two hands
            found = assign_roles(points, facing=facing, head=head)
            assert found.roles == want and found.certain, (stature, found)


@pytest.mark.parametrize("pose", POSES)
def test_three_anonymous_trackers_are_right_or_reported(pose):
    """Without knowing the headset, hands before the body may look like a head: never silently."""
    rng = np.random.default_rng([3, 7, list(POSES).index(pose)])
    for stature in FIGURES:
        points, want, facing = trackers(3, pose, stature, rng)
        found = assign_roles(points, facing=facing)
        assert found.roles == want or not found.certain
        assert found.certain or (pose == "hands in front" and found.open)


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("kit", [3, 4, 6, 11])
def test_without_a_facing_nothing_is_guessed_silently(kit, pose):
    """Roles are right, or the result says what is open and what to do."""
    rng = np.random.default_rng([kit, 1, list(POSES).index(pose)])
    for stature in FIGURES if kit < 11 else (1.45, 1.7):
        points, want, _ = trackers(kit, pose, stature, rng)
        found = assign_roles(points)
        assert found.roles == want or not found.certain
        assert found.certain or (found.open and found.advice)


@pytest.mark.parametrize("pose", ["arms hanging", "T-pose", "A-pose", "feet apart", "feet together"])
def test_a_pose_that_looks_the_same_from_behind_is_ambiguous(pose):
    """Standing frontally is mirror-symmetric: left and right are open, and a step is advised."""
    rng = np.random.default_rng(5)
    points, _, _ = trackers(6, pose, 1.7, rng)
    found = assign_roles(points)
    assert not found.certain and "step forward" in found.advice
    assert {"l_wrist", "r_wrist", "l_ankle", "r_ankle"} == set(found.open)


def test_a_step_tells_the_facing():
    """The same pose a step later: the direction of the step is the facing, and settles the roles."""
    rng = np.random.default_rng(6)
    points, want, facing = trackers(6, "arms hanging", 1.7, rng)
    stepped = facing_of_step(points, points + 0.4 * facing + rng.normal(0.0, 0.02, (6, 3)))
    assert stepped @ facing > 0.97
    assert assign_roles(points, facing=stepped).roles == want
    with pytest.raises(TargetError, match="whole step"):
        facing_of_step(points, points + 0.05)


def test_a_rotation_tells_the_facing():
    """The headset's Z, or any tracker's with its mount; straight up is refused."""
    q = rot.from_axis_angle([0.0, 1.0, 0.0], 0.7)
    np.testing.assert_allclose(facing_of_rotation(q), [np.sin(0.7), 0.0, np.cos(0.7)], atol=1e-12)
    mount = rot.from_axis_angle([1.0, 0.0, 0.0], 1.1)
    np.testing.assert_allclose(
        facing_of_rotation(rot.mul(q, mount), mount), facing_of_rotation(q), atol=1e-12
    )
    with pytest.raises(TargetError, match="vertical"):
        facing_of_rotation(rot.from_axis_angle([1.0, 0.0, 0.0], np.pi / 2))


def test_two_seconds_of_frames_are_averaged_and_must_be_still():
    """Noise does no harm; a tracker that moves is named."""
    rng = np.random.default_rng(8)
    points, want, facing = trackers(6, "A-pose", 1.7, rng)
    frames = points + rng.normal(0.0, 0.003, (180, 6, 3))
    frames[10:20, 3] = np.nan
    assert assign_roles(frames, facing=facing).roles == want
    frames[:, 2, 0] += np.linspace(0.0, 0.5, 180)
    with pytest.raises(TargetError, match="tracker 2 moves"):
        assign_roles(frames, facing=facing)


def test_what_is_no_person_is_said():
    """Trackers in a heap, too few of them, unknown roles, and one that was never seen."""
    heap = np.random.default_rng(0).uniform(-0.05, 0.05, (6, 3))
    found = assign_roles(heap, facing=[0, 0, 1])
    assert not found.certain
    with pytest.raises(TargetError, match="3 to 11"):
        assign_roles(np.zeros((2, 3)))
    with pytest.raises(TargetError, match="elbow"):
        assign_roles(np.zeros((3, 3)), roles=("head", "l_hand", "r_wrist"))
    with pytest.raises(TargetError, match="not seen"):
        assign_roles(np.full((3, 3), np.nan))
    with pytest.raises(TargetError, match="index of a tracker"):
        assign_roles(np.zeros((3, 3)), head=7)
