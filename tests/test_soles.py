"""Soles: where they are under any skin, and that those of driven figures are on the floor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import sixpoint as sp
from conftest import recordings
from sixpoint.body import rotations as rot
from sixpoint.body.soles import ankle_height, find_floor, measure_feet
from sixpoint.body.surface.flesh import build_shape
from sixpoint.formats import load_avatar
from sixpoint.jobs import driving
from sixpoint.jobs.solving import Solving
from sixpoint.live.feet import Floor, level_feet

TALL = sp.Figure.from_stature(1.80)
STOCKY = sp.Figure.from_segments(
    thigh=0.30, calf=0.33, upper_arm=0.2, forearm=0.21, torso_length=0.40, pelvis_width=0.2, torso_width=0.36
)
STOCKY = STOCKY.with_shape(build_shape(STOCKY))


def lowest_skin(figure, motion):
    """Height of the lowest vertex that hangs on the feet, per frame [m]."""
    shape = figure.shape
    feet = np.concatenate([figure.skeleton.subtree(ankle) for ankle in figure.roles.ankle])
    on_foot = np.sum(np.isin(shape.joints, feet) * shape.weights, axis=1) > 0.5
    frames = zip(*motion.transforms, strict=True)
    return np.array([shape.place(*placed)[on_foot, 1].min() for placed in frames])


@pytest.mark.parametrize("lift", [-0.03, 0.0, 0.05])
def test_ankles_are_as_high_as_the_skin_says(lift):
    """Thicker soles, or none, count in full, whatever the bones say."""
    shape = build_shape(TALL)
    vertices = shape.vertices.copy()
    low = (
        np.sum(np.isin(shape.joints, TALL.skeleton.subtree(TALL.roles.ankle[0])) * shape.weights, axis=1)
        > 0.5
    )
    low |= (
        np.sum(np.isin(shape.joints, TALL.skeleton.subtree(TALL.roles.ankle[1])) * shape.weights, axis=1)
        > 0.5
    )
    vertices[low, 1] -= lift
    figure = TALL.with_shape(replace(shape, vertices=vertices))
    assert ankle_height(figure) == pytest.approx(ankle_height(TALL.with_shape(shape)) + lift, abs=1e-9)
    assert ankle_height(TALL.with_shape(shape)) == pytest.approx(ankle_height(TALL), abs=0.01)
    assert measure_feet(figure)[1] > 0.1
    assert measure_feet(TALL) is None


def test_skin_is_measured_once_for_all_frames(monkeypatch):
    """Feet levelled without a floor at hand find their skin as it was at the first frame."""
    figure, placed = TALL.with_shape(build_shape(TALL)), []
    place = sp.Shape.place
    monkeypatch.setattr(sp.Shape, "place", lambda self, *where: placed.append(self) or place(self, *where))
    poses = [level_feet(figure, figure.neutral_pose) for _ in range(3)]
    assert placed == [figure.shape]
    given = level_feet(figure, figure.neutral_pose, Floor.under(figure))
    np.testing.assert_array_equal(poses[2].rotations, given.rotations)


def test_a_body_without_skin_on_its_feet_has_those_of_its_bones():
    """A ball on a skeleton, for example."""
    shape = build_shape(TALL)
    ball = replace(shape, joints=np.full_like(shape.joints, TALL.roles.pelvis))
    assert measure_feet(TALL.with_shape(ball)) is None
    assert ankle_height(TALL.with_shape(ball)) == ankle_height(TALL)


def driven(recording, level=True, **options):
    """The motion of the stocky body; ``level=False``: as it is solved."""
    with pytest.MonkeyPatch.context() as patch:
        if not level:
            patch.setattr(driving, "_level", lambda figure, motion, free: motion)
        return driving.drive(STOCKY, recording, TALL, **options)[1].solution.motion


def test_soles_of_a_driven_walker_are_on_the_floor():
    """Never in it and within 2 cm over it in a walk, though shanks lean; without levelling toes dig in."""
    walk = sp.make_sample("walk", TALL).sliced(slice(0, 120, 4))
    for recording, least in ((walk, -0.01), (replace(TALL.targets(walk), rotations=None), -0.001)):
        motion, plain = driven(recording), driven(recording, level=False)
        low = lowest_skin(STOCKY, motion)
        assert low.min() > least
        assert low.max() < 0.02
        assert lowest_skin(STOCKY, plain).min() < -0.03
        others = np.setdiff1d(np.arange(len(STOCKY.skeleton)), STOCKY.roles.ankle)
        np.testing.assert_array_equal(motion.rotations[:, others], plain.rotations[:, others])


def test_measured_feet_and_bodies_in_the_air_are_left_alone():
    """A foot with a rotation of its own keeps it where toes are not in the floor; high up there is none."""
    walk = sp.make_sample("walk", TALL).sliced(slice(0, 20, 4))
    feet = Solving(rotations=("l_ankle", "r_ankle"))
    level, plain = driven(walk, solving=feet), driven(walk, level=False, solving=feet)
    clear = lowest_skin(STOCKY, plain) > 0.0
    assert clear.any()
    np.testing.assert_allclose(level.rotations[clear], plain.rotations[clear], atol=1e-12)
    high = replace(walk, translations=walk.translations + [0.0, 3.0, 0.0])
    np.testing.assert_array_equal(driven(high).rotations, driven(high, level=False).rotations)


@pytest.mark.parametrize("height", [0.0, 0.4])
def test_the_floor_is_under_feet_that_stand(height):
    """Of a walk on a floor at any height, within a centimetre."""
    walk = sp.make_sample("walk", TALL)
    raised = replace(walk, translations=walk.translations + [0.0, height, 0.0])
    assert find_floor(TALL, raised) == pytest.approx(height, abs=0.01)


@pytest.mark.parametrize("path", recordings("mesh/*.[gv]*"))
def test_characters_of_others_walk_on_the_floor(path):
    """A walk on every avatar of the data folder that has feet: soles are on the floor, not in it."""
    figure = load_avatar(path).figure
    if measure_feet(figure) is None:
        pytest.skip("its feet have no skin")
    walk = sp.make_sample("walk", TALL).sliced(slice(0, 120, 4))
    low = lowest_skin(figure, driving.drive(figure, walk, TALL)[1].solution.motion)
    assert low.min() > -0.015
    assert np.median(low) < 0.02


def test_a_foot_is_flat_where_the_rest_pose_bends_the_knee():
    """Knees bent by 20 degrees at rest on flat feet: in the neutral pose legs hang and soles are level."""
    figure, bend = TALL, rot.from_axis_angle([1.0, 0.0, 0.0], 0.35)
    frames = figure.neutral_pose.compute_transforms()[1]
    offsets = figure.skeleton.offsets.copy()
    for hip, knee, ankle in zip(figure.roles.hip, figure.roles.knee, figure.roles.ankle, strict=True):
        assert np.allclose(frames[[hip, knee, ankle]], rot.IDENTITY)
        offsets[knee] = rot.mul_vec(rot.inv(bend), offsets[knee])
        offsets[ankle] = rot.mul_vec(bend, offsets[ankle])
    crouched = sp.Figure.from_skeleton(replace(figure.skeleton, offsets=offsets))
    for ankle in crouched.roles.ankle:
        np.testing.assert_allclose(np.abs(crouched.neutral[ankle]), rot.IDENTITY, atol=1e-6)
    assert ankle_height(crouched) == pytest.approx(ankle_height(figure), abs=1e-6)
