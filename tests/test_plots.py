"""Pictures are valid, of the expected size, and written whole or not at all."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.body.skeleton import Skeleton
from sixpoint.samples import make_sample
from sixpoint.study.plots import compute_distances, draw_comparison, draw_error_curves, draw_poses

FIGURE = Figure.from_stature(1.75)
TRUTH = make_sample("reach", FIGURE).sliced(slice(0, 300, 5))
BENT = rot.from_axis_angle([0.0, 1.0, 0.0], np.full(len(TRUTH), 0.2))


def turned(motion):
    """The same motion with its left shoulder turned."""
    rotations = motion.rotations.copy()
    shoulder = FIGURE.roles.shoulder[0]
    rotations[:, shoulder] = rot.mul(BENT, rotations[:, shoulder])
    return replace(motion, rotations=rotations)


def other_rig():
    """A 17-joint rig with other names, no clavicles, no feet below the ankles, and its motion."""
    rows = [
        ("Hips", -1, (0, 1, 0)),
        ("Spine", 0, (0, 0.2, 0)),
        ("Chest", 1, (0, 0.2, 0)),
        ("Head", 2, (0, 0.25, 0)),
    ]
    for side, sign in (("Left", 1), ("Right", -1)):
        at = len(rows)
        rows += [
            (f"{side}UpLeg", 0, (0.1 * sign, -0.05, 0)),
            (f"{side}Leg", at, (0, -0.42, 0.01)),
            (f"{side}Foot", at + 1, (0, -0.42, -0.01)),
            (f"{side}Arm", 2, (0.18 * sign, 0.1, 0)),
            (f"{side}ForeArm", at + 3, (0.28 * sign, 0, -0.01)),
            (f"{side}Hand", at + 4, (0.26 * sign, 0, 0.01)),
        ]
    names, parents, offsets = zip(*rows, strict=True)
    skeleton = Skeleton(names, np.array(parents), np.array(offsets, float))
    rotations = np.tile(rot.IDENTITY, (9, len(rows), 1))
    return skeleton, Motion(skeleton, rotations, np.tile([0.0, 1.0, 0.0], (9, 1, 1)), 30.0)


def assert_picture(path):
    """A PNG 1600 pixels wide with ink on white, and nothing else in its folder."""
    image = imread(path)
    assert image.shape[1] == 1600
    assert image.shape[0] > 300
    assert np.allclose(image[0, 0, :3], 1.0)
    assert image[..., :3].min() < 0.5
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_comparison_is_a_picture(tmp_path):
    """A comparison is a PNG of the full width, and its path is returned."""
    path = tmp_path / "comparison.png"
    assert draw_comparison(FIGURE, TRUTH, turned(TRUTH), path) == path
    assert_picture(path)


def test_comparison_of_chosen_frames(tmp_path):
    """Frames, even one alone, and a title can be given."""
    path = tmp_path / "one.png"
    draw_comparison(FIGURE, TRUTH, turned(TRUTH), path, frames=[3], title="One frame")
    assert_picture(path)


def test_perfect_result_can_be_drawn(tmp_path):
    """A result without any error has a curve at zero."""
    path = tmp_path / "same.png"
    draw_comparison(FIGURE, TRUTH, TRUTH, path)
    assert_picture(path)


def test_film_strip_is_a_picture(tmp_path):
    """A film strip of one motion is a PNG of the full width."""
    path = tmp_path / "poses.png"
    assert draw_poses(FIGURE, TRUTH, path, [0, 10, 20]) == path
    assert_picture(path)


def test_other_rig_is_drawn(tmp_path):
    """A rig with other joints and no sites is drawn as well."""
    skeleton, motion = other_rig()
    figure = Figure.from_skeleton(skeleton)
    path = tmp_path / "rig.png"
    draw_comparison(figure, motion, motion, path)
    assert_picture(path)


@pytest.mark.parametrize("count", [0, 1, 9])
def test_error_curves_are_a_picture(tmp_path, count):
    """Any number of curves makes a picture, more than there are colours as well."""
    times = np.linspace(0, 5, 50)
    curves = {f"method {k}": (times, 2 + np.sin(times + k)) for k in range(count)}
    path = tmp_path / "curves.png"
    assert draw_error_curves(curves, path, ylabel="distance [cm]", title="Curves") == path
    assert_picture(path)


def test_failed_write_leaves_the_old_picture(tmp_path, monkeypatch):
    """If writing breaks, the picture that was there stays, and no temporary file does."""
    path = tmp_path / "curves.png"
    path.write_bytes(b"old")

    def broken(*args, **kwargs):
        raise OSError("disk full")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", broken)
    with pytest.raises(OSError, match="disk full"):
        draw_error_curves({"a": ([0, 1], [1, 2])}, path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_distance_is_the_mean_over_posed_joints():
    """A shifted motion is as far away as it was shifted; the truth itself is at zero."""
    shifted = replace(TRUTH, translations=TRUTH.translations + np.array([0.0, 0.03, 0.04]))
    assert np.allclose(compute_distances(FIGURE, TRUTH, shifted), 0.05)
    assert np.allclose(compute_distances(FIGURE, TRUTH, TRUTH), 0.0)
