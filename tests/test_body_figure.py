"""A figure converts between anatomical rotations and rigs, and can be built from lengths."""

from dataclasses import replace

import numpy as np
import pytest

import sixpoint as sp
from body_rigs import anatomical, exercise, load, random_quaternions, real_rigs
from sixpoint.body import rotations as rot
from sixpoint.body.anthropometry import segments_of_stature

RIGS = [pytest.param(p, id=p.name) for p in real_rigs()] or [
    pytest.param(None, marks=pytest.mark.skip(reason="no recordings: set $SIXPOINT_DATA"))
]


@pytest.mark.parametrize("path", RIGS)
def test_anatomical_rotations_survive_the_rig(path):
    """compute_motion and reading back anatomical rotations are inverse; the pelvis is where asked."""
    figure = sp.Figure.from_motion(load(path))
    rng = np.random.default_rng(0)
    local = np.tile(rot.IDENTITY, (3, len(figure.skeleton), 1))
    below = figure.skeleton.subtree(figure.roles.pelvis)
    local[:, below] = random_quaternions(rng, 3, len(below))
    pelvis = rng.normal(size=(3, 3))
    motion = figure.compute_motion(local, pelvis, 30.0)
    expected = figure.skeleton.compute_transforms(local)[1]
    error = rot.angle(rot.mul(rot.inv(expected), anatomical(figure, motion)))[:, below]
    assert error.max() < 1e-6
    assert motion.positions[:, figure.roles.pelvis] == pytest.approx(pelvis, abs=1e-9)
    assert figure.targets(motion).positions[:, 0] == pytest.approx(pelvis, abs=1e-9)


def test_extras_are_copied():
    """Fingers, toes and face come from the recording, all else from the rotations."""
    figure = sp.Figure.from_stature()
    motion = exercise(figure, frames=4)
    fingers = replace(motion, rotations=random_quaternions(np.random.default_rng(0), 4, 34))
    plain = np.tile(rot.IDENTITY, (4, 34, 1))
    result = figure.compute_motion(plain, motion.root_positions, 60.0, extras=fingers)
    extra = figure.extremities
    assert len(extra) == 12
    assert np.array_equal(result.rotations[:, extra], fingers.rotations[:, extra])
    rest = np.setdiff1d(np.arange(34), extra)
    assert result.rotations[:, rest] == pytest.approx(plain[:, rest])
    with pytest.raises(sp.FigureError, match="same rig and length"):
        figure.compute_motion(plain[:2], motion.root_positions[:2], 60.0, extras=fingers)


def test_targets_need_the_same_rig():
    """A motion of another rig is refused."""
    figure = sp.Figure.from_stature()
    other = replace(figure.skeleton, names=tuple(f"x{j}" for j in range(34)))
    motion = sp.Motion(other, exercise(figure).rotations, exercise(figure).translations, 60.0)
    with pytest.raises(sp.FigureError, match="another skeleton"):
        figure.targets(motion)


@pytest.mark.parametrize("stature", [0.8, 1.5, 1.75, 2.1])
def test_the_built_in_figure_is_as_tall_as_asked(stature):
    """34 joints; skull tip above sole is the stature within 2 %; left mirrors right."""
    figure = sp.Figure.from_stature(stature)
    s = figure.skeleton
    assert len(s) == 34
    positions, world = s.compute_transforms(np.tile(rot.IDENTITY, (34, 1)))
    sites = dict(zip(s.site_names, s.compute_sites(positions, world), strict=True))
    tall = sites["skull_tip"][1] - min(sites["l_heel"][1], sites["l_toe_tip"][1])
    assert tall == pytest.approx(stature, rel=0.02)
    places = dict(zip(s.names, positions, strict=True)) | sites
    for name in [n for n in places if n.startswith("l_")]:
        assert places["r_" + name[2:]] == pytest.approx(places[name] * [-1, 1, 1])


def test_segments_are_as_asked():
    """Eleven lengths set the figure's bones; those not given follow from the mean stature."""
    assert len(segments_of_stature(1.75)) == 11
    given = {"thigh": 0.5, "calf": 0.4, "upper_arm": 0.33, "forearm": 0.22, "pelvis_width": 0.3}
    figure = sp.Figure.from_segments(**given)
    r = figure.roles
    assert np.linalg.norm(figure.offset_between(r.hip[0], r.knee[0])) == pytest.approx(0.5)
    assert np.linalg.norm(figure.offset_between(r.knee[1], r.ankle[1])) == pytest.approx(0.4)
    assert np.linalg.norm(figure.offset_between(r.shoulder[0], r.elbow[0])) == pytest.approx(0.33)
    assert np.linalg.norm(figure.offset_between(r.elbow[1], r.wrist[1])) == pytest.approx(0.22)
    assert np.linalg.norm(figure.offset_between(r.hip[0], r.hip[1])) == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("wrong", "word"),
    [({"tail": 1.0}, "upper_arm"), ({"calf": 0.0}, "calf"), ({"foot": float("nan")}, "foot")],
)
def test_bad_segments_are_errors(wrong, word):
    """Unknown names list the known ones; lengths must be positive."""
    with pytest.raises(sp.FigureError, match=word):
        sp.Figure.from_segments(**wrong)


@pytest.mark.parametrize("stature", [0.0, 175.0, float("nan")])
def test_bad_statures_are_errors(stature):
    """A stature in centimetres is refused with the unit that is meant."""
    with pytest.raises(sp.FigureError, match="metres"):
        sp.Figure.from_stature(stature)


def test_a_figure_is_immutable():
    """Arrays of a figure are read-only and what the caller passed is not touched."""
    figure = sp.Figure.from_stature()
    for array in (figure.neutral, figure.offsets, figure.skeleton.offsets, figure.spine_chain.segments):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0
