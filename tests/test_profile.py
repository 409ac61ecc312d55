"""Profiles: what is written is read, what is wrong is named, and another person is noticed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.targets import EFFECTORS, POINTS
from sixpoint.calibration.calibrate import calibrate
from sixpoint.calibration.misfits import find_misfits
from sixpoint.calibration.mounts import Mount
from sixpoint.calibration.profile import Profile, Worn, format_profile, parse_profile
from sixpoint.errors import FormatError, TargetError
from sixpoint.samples.range_of_motion import range_of_motion
from start_poses import stand

TURN = rot.from_axis_angle([0.0, 0.6, 0.8], 1.0)


def a_profile(stature: float = 1.7) -> Profile:
    worn = {
        f"LHR-{k}": Worn(n, Mount(np.full(3, 0.01 * k), TURN, 0.004, 0.09)) for k, n in enumerate(EFFECTORS)
    }
    return Profile(stature, {"thigh": 0.41}, {"thigh": 'measured, "well"\n'}, worn)


def same(a: Profile, b: Profile) -> bool:
    worn = a.trackers.keys() == b.trackers.keys() and all(
        x.point == y.point
        and np.array_equal(x.mount.offset, y.mount.offset, equal_nan=True)
        and np.array_equal(x.mount.rotation, y.mount.rotation, equal_nan=True)
        and (x.mount.std, x.mount.rotation_std) == (y.mount.std, y.mount.rotation_std)
        for x, y in zip(a.trackers.values(), b.trackers.values(), strict=True)
    )
    return worn and (a.stature, a.segments, a.sources) == (b.stature, b.segments, b.sources)


@given(st.text(st.characters(exclude_categories=["Cs"]), min_size=1), st.floats(0.4, 2.8), st.floats(-1, 1))
def test_text_and_back_is_the_same(serial, stature, offset):
    """Any serial and any number survive to the last bit."""
    mount = Mount(np.array([offset, 0.0, -offset]), TURN, abs(offset))
    before = Profile(stature, {}, {"stature": serial}, {serial: Worn("head", mount)})
    after = parse_profile(format_profile(before))
    assert after.trackers[serial].mount.std == abs(offset)
    np.testing.assert_array_equal(after.trackers[serial].mount.offset, mount.offset)
    assert after.stature == stature and after.sources == {"stature": serial}


def test_unknown_offsets_stay_unknown():
    """What was not found is not written, and comes back as unknown."""
    before = Profile(1.7, {}, {}, {"a": Worn("chest", Mount(np.full(3, np.nan), np.full(4, np.nan)))})
    assert same(before, parse_profile(format_profile(before)))
    assert same(a_profile(), parse_profile(format_profile(a_profile())))


WRONG = {
    "version": ("version = 1", "version = 2", "version .expected 1, got '2'"),
    "not toml": ("stature = 1.7", "stature = = 1", "not a TOML file"),
    "stature": ("stature = 1.7", "stature = 170", "stature .expected a stature in metres"),
    "boolean": ("stature = 1.7", "stature = true", "stature .expected"),
    "unknown key": ("stature = 1.7", "stature = 1.7\nheight = 1", "unknown key height"),
    "segment": ("thigh = 0.41", "thigh = nan", "segments.thigh .expected a length"),
    "effector": ('effector = "head"', 'effector = "nose"', "trackers.LHR-1.effector .expected one of pelvis"),
    "twice": ('effector = "head"', 'effector = "pelvis"', "LHR-0, LHR-1 .expected one tracker per effector"),
    "offset": ("offset = [0.01, 0.01, 0.01]", "offset = [0.01, 0.01]", "LHR-1.offset .expected 3 numbers"),
    "far": ("offset = [0.01, 0.01, 0.01]", "offset = [0.01, 0.01, 30]", "LHR-1.offset .expected"),
    "text": ("offset = [0.01, 0.01, 0.01]", 'offset = ["a", 0, 0]', "LHR-1.offset .expected"),
    "table": ("[segments]  # [m]\nthigh = 0.41", "segments = 3", "segments .expected a table"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_profiles_name_file_key_and_what_was_expected(case):
    """Every message has the file, the key, and what would have worked."""
    old, new, message = WRONG[case]
    text = format_profile(a_profile())
    assert old in text
    with pytest.raises(FormatError, match=message) as error:
        parse_profile(text.replace(old, new, 1), "me.toml")
    assert str(error.value).startswith("me.toml")


def test_a_rotation_must_be_one():
    """Four numbers that are no unit quaternion are refused."""
    text = format_profile(a_profile()).replace(repr(float(TURN[3])), "0.1")
    with pytest.raises(FormatError, match="unit quaternion"):
        parse_profile(text)


def test_a_calibration_is_kept():
    """The profile applies mounts one by one as the calibration does to all."""
    figure = Figure.from_stature(1.7)
    targets = figure.targets(range_of_motion(figure))
    found = calibrate(targets, figure)
    profile = Profile.from_calibration(found, {n: f"T{k}" for k, n in enumerate(EFFECTORS)})
    again = parse_profile(format_profile(profile))
    joints = found.apply(targets)
    for k, name in enumerate(EFFECTORS):
        serial = again.serial(name)
        assert serial == f"T{k}"
        p, q = again.apply(serial, targets.positions[300, k], targets.rotations[300, k])
        if np.isfinite(joints.positions[300, k]).all():
            np.testing.assert_allclose(p, joints.positions[300, k], atol=1e-12)
            assert abs(q @ joints.rotations[300, k]) > 1 - 1e-12
    p, q = np.full((11, 3), np.nan), np.full((11, 4), np.nan)
    p[:5], q[:4] = targets.positions[300, :5], targets.rotations[300, :4]
    points, turns = again.apply_all(p, q)
    np.testing.assert_allclose(points[:4], joints.positions[300, :4], atol=1e-12)
    np.testing.assert_array_equal(points[4], p[4])  # without a rotation the tracker is the joint
    assert np.isnan(points[5:]).all() and np.isnan(turns[4:]).all()
    with pytest.raises(TargetError, match="no points named nose"):
        Profile.from_calibration(found, {"nose": "x"})
    with pytest.raises(TargetError, match="each tracker is on one point"):
        Profile.from_calibration(found, {"head": "x", "pelvis": "x"})


def seen(stature, pose="T-pose"):
    points, _ = stand(Figure.from_stature(stature), pose)
    return {n: points[k] for k, n in enumerate(POINTS)}


def of(stature):
    plain = Mount(np.zeros(3), rot.IDENTITY, 0.005)
    return Profile(stature, {}, {}, {n: Worn(n, plain) for n in POINTS})


@pytest.mark.parametrize("pose", ["arms hanging", "T-pose", "sitting", "crouched", "one hand raised"])
def test_a_profile_fits_its_own_person(pose):
    """No warning in any pose of the same person."""
    assert find_misfits(of(1.7), seen(1.7, pose)) == ()


def test_other_people_and_other_places_are_noticed():
    """A taller person, trackers exchanged, missing or strange ones: said with what to do."""
    taller = find_misfits(of(1.55), seen(1.85))
    assert any("the head is" in text for text in taller) and "calibrate again" in taller[-1]
    exchanged = seen(1.7)
    exchanged["pelvis"], exchanged["l_ankle"] = exchanged["l_ankle"], exchanged["pelvis"]
    assert any("apart" in text for text in find_misfits(of(1.7), exchanged))
    fewer = seen(1.7)
    fewer["new"] = fewer.pop("chest")
    text = " ".join(find_misfits(of(1.7), fewer))
    assert "not seen: chest (chest)" in text and "does not know: new" in text and "again" not in text
