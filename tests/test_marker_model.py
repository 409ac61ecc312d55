"""Marker models: what they hold, and their file."""

from __future__ import annotations

import numpy as np
import pytest

from sixpoint.body.anthropometry import build_skeleton, segments_of_skeleton, segments_of_stature
from sixpoint.body.figure import Figure
from sixpoint.body.markers.model import MarkerModel
from sixpoint.calibration.markers.text import format_marker_model, parse_marker_model
from sixpoint.errors import FigureError, FormatError
from sixpoint.jobs.marker_models import load_marker_model, save_marker_model
from worn_markers import wear


def model() -> MarkerModel:
    found = wear(seed=5, motion=lambda figure: figure.compute_motion(*still(figure), 30.0)).model
    spread = np.array([0.001 * k for k in range(len(found.names))])
    spread[3] = np.nan
    return MarkerModel(found.figure, found.names, found.joints, found.offsets, spread, ("head",))


def still(figure: Figure) -> tuple[np.ndarray, np.ndarray]:
    return np.tile([0.0, 0, 0, 1], (1, len(figure.skeleton), 1)), np.zeros((1, 3))


def test_a_model_survives_its_file(tmp_path):
    """Names, joints, offsets and spread to the last bit; lengths to a nanometre."""
    before, path = model(), tmp_path / "person.toml"
    save_marker_model(before, path)
    after = load_marker_model(path)
    assert after.names == before.names and after.missing == before.missing
    np.testing.assert_array_equal(after.joints, before.joints)
    np.testing.assert_array_equal(after.offsets, before.offsets)
    np.testing.assert_array_equal(after.spread, before.spread)
    np.testing.assert_allclose(after.figure.skeleton.offsets, before.figure.skeleton.offsets, atol=1e-9)


def test_files_are_not_overwritten(tmp_path):
    """Only with force; and nothing is left of an attempt."""
    path = tmp_path / "person.toml"
    path.write_text("mine")
    with pytest.raises(FormatError, match="exists"):
        save_marker_model(model(), path)
    assert [p.name for p in tmp_path.iterdir()] == ["person.toml"] and path.read_text() == "mine"
    save_marker_model(model(), path, force=True)
    assert load_marker_model(path).names == model().names


def test_odd_labels_are_quoted():
    """Dots, spaces, quotes and other alphabets are labels, too."""
    some = model()
    names = ("R.Knee Lat", 'a "b"', "膝", *some.names[3:])
    odd = MarkerModel(some.figure, names, some.joints, some.offsets, some.spread)
    assert parse_marker_model(format_marker_model(odd)).names == names


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("version = 1", "version = 2", "version"),
        ("version = 1", "version = true", "version"),
        ("[markers]", "[marker]", "unknown key marker"),
        ('joint = "skullbase"', 'joint = "skull"', "a joint of the built-in figure"),
        ("offset = [", "offset = [9.0, ", "3 numbers from -1 to 1"),
        ("thigh = 0", "thigh = -0", "a length in metres"),
        ('missing = ["head"]', 'missing = ["tail"]', "missing"),
        ("[segments]", "[segments", "not a TOML file"),
    ],
)
def test_mistakes_in_a_file_are_located(old, new, message):
    """Each complaint names the key and what is expected there."""
    text = format_marker_model(model())
    assert old in text
    with pytest.raises(FormatError, match=message):
        parse_marker_model(text.replace(old, new, 1), "person.toml")


def test_a_file_that_is_not_there_is_said(tmp_path):
    """Which file, and why."""
    with pytest.raises(FormatError, match=r"nobody.toml.*cannot be read"):
        load_marker_model(tmp_path / "nobody.toml")


def test_lengths_of_a_skeleton_are_those_it_was_made_of():
    """The inverse of building; other skeletons are refused."""
    segments = {name: 1.1 * length for name, length in segments_of_stature(1.6).items()}
    found = segments_of_skeleton(build_skeleton(segments))
    assert found == pytest.approx(segments, abs=1e-12)
    skeleton = build_skeleton()
    bent = type(skeleton)(skeleton.names, skeleton.parents, skeleton.offsets + 0.01 * np.eye(34, 3))
    with pytest.raises(FigureError, match="in other places"):
        segments_of_skeleton(bent)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"names": ("a", "a")}, "distinct"),
        ({"joints": np.array([0])}, "need joints"),
        ({"joints": np.array([0, 34])}, "does not exist"),
        ({"offsets": np.full((2, 3), np.nan)}, "finite"),
    ],
)
def test_a_model_is_consistent(change, message):
    """Shapes, names and joints are checked."""
    values = {
        "figure": Figure.from_stature(1.7),
        "names": ("a", "b"),
        "joints": np.array([0, 1]),
        "offsets": np.zeros((2, 3)),
        "spread": np.zeros(2),
    }
    with pytest.raises(FigureError, match=message):
        MarkerModel(**(values | change))
