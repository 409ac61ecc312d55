"""``info`` and ``convert`` of marker files, and joint angles by the command line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sixpoint as sp
from marker_bodies import walking_markers
from sixpoint.cli import main
from sixpoint.formats import holds_markers, load_markers, save_markers

WALK = walking_markers(120)


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A current folder with a C3D that has two gaps and a ghost, a motion and its six points."""
    monkeypatch.chdir(tmp_path)
    positions = np.array(WALK.positions)
    positions[20:40, 3] = positions[100:103, 10] = np.nan
    positions[60:63, 5] += 1.0
    names = tuple(f"nick:{name}" for name in WALK.names)
    save_markers(replace(WALK, positions=positions, names=names), tmp_path / "walk.c3d")
    motion = sp.make_sample("walk").sliced(slice(0, 20))
    sp.save(motion, tmp_path / "walk.bvh")
    sp.save_targets(sp.Figure.from_motion(motion).targets(motion), tmp_path / "points.csv")
    return tmp_path


def run(capsys, *words: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr."""
    capsys.readouterr()
    code = main(words)
    out, err = capsys.readouterr()
    assert "Traceback" not in out + err
    return code, out, err


def test_info_shows_roles_gaps_events_and_ghosts(place, capsys):
    """The set with its share, the subject, unit and axis with their sources, and the worst marker first."""
    code, out, err = run(capsys, "info", "walk.c3d")
    assert code == 0 and not err
    said = (
        "41 of 41 markers", "subject    nick", "mm (0.001 m), from the file", "z, from the file",
        "CMU 41, which names 100 % of the labels", "Left Foot Strike 0.25 s, Right Foot Off 0.75 s",
        "in frames 60 to 62", "l_knee_lateral",
    )  # fmt: skip
    for words in said:
        assert words in out, words
    rows = out[out.index("worst seen first") :].splitlines()
    assert rows[2].split()[:2] == ["nick:STRN", "sternum"] and "83.3 %" in rows[2] and "0.33 s" in rows[2]


def test_info_of_layouts_and_unknown_labels(place, capsys):
    """A layout is named; labels without a role are listed; labels of no set say what would help."""
    out = run(capsys, "info", "walk.c3d", "--layout", "markers24")[1]
    assert "24 markers, which names 59 % of the labels" in out and "24 of 41 markers" in out
    assert "unknown    nick:" in out and "nick:STRN" in out
    strange = replace(WALK, names=tuple(f"P{k}" for k in range(41)))
    save_markers(strange, place / "strange.trc")
    code, out, _ = run(capsys, "info", "strange.trc")
    assert code == 0 and "unknown: give the labels' roles by --layout" in out
    code, _, err = run(capsys, "info", "walk.c3d", "--layout", "markers99")
    assert code == 2 and "no such layout" in err


@pytest.mark.parametrize("suffix", ["trc", "csv", "npz", "c3d"])
def test_convert_markers(place, capsys, suffix):
    """Markers go from format to format, and nothing is filled or filtered unless it is asked for."""
    code, out, _ = run(capsys, "convert", "walk.c3d", f"x.{suffix}", "--out-unit", "m", "--frames", "10:")
    assert code == 0 and "41 markers, 110 frames at 60 Hz" in out and "filled" not in out
    back, truth = load_markers(f"x.{suffix}"), load_markers("walk.c3d").sliced(slice(10, None))
    assert holds_markers(place / f"x.{suffix}")
    np.testing.assert_array_equal(back.tracked, truth.tracked)
    np.testing.assert_allclose(back.positions, truth.positions, atol=1e-6)


def test_cleaning_is_said(place, capsys):
    """Short gaps are filled and the rest filtered on request; the numbers of samples are told."""
    code, out, _ = run(capsys, "convert", "walk.c3d", "x.trc", "--fill", "0.1", "--low-pass", "6")
    assert code == 0 and "filled 3 samples (most: nick:RTHI 3)" in out and "filtered at 6 Hz" in out
    back = load_markers("x.trc")
    assert (~back.tracked).sum() == 20
    np.testing.assert_allclose(back.positions[100:103, 10], WALK.positions[100:103, 10], atol=5e-3)
    assert run(capsys, "convert", "walk.c3d", "y.trc", "--low-pass", "99")[0] == 2


def test_joint_angles_by_suffix_and_by_option(place, capsys):
    """A .mot has the angles; a .csv does with --angles, and the six points without."""
    code, out, _ = run(capsys, "convert", "walk.bvh", "x.mot")
    assert code == 0 and "48 joint angles and coordinates, 20 frames" in out
    assert (place / "x.mot").read_text().count("\n") == 20 + 11
    assert run(capsys, "convert", "walk.bvh", "x.csv", "--angles")[0] == 0
    assert (place / "x.csv").read_text().startswith("time,pelvis_tilt,")
    assert run(capsys, "convert", "walk.bvh", "y.csv")[0] == 0
    assert (place / "y.csv").read_text().startswith("time,pelvis_x,")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("convert walk.c3d x.bvh", "markers hold no body; pose one with: sixpoint track"),
        ("convert walk.c3d x.mot", "markers hold no body"),
        ("convert walk.c3d walk.c3d --force", "this file is being read"),
        ("convert points.csv x.mot", "six points hold no body"),
        ("convert walk.bvh x.npz --angles", "joint angles are written as .mot or .csv"),
        ("convert walk.bvh x.bvh --fill 0.1", "only markers are filled and filtered"),
        ("convert walk.bvh x.trc", "cannot write '.trc' here"),
        ("info none.c3d", "no such file"),
        ("info walk.c3d --skeleton a.asf", "a skeleton file belongs to an .amc"),
        ("info walk.c3d --unit yard", "unknown unit 'yard'"),
        ("reconstruct walk.c3d --out x.bvh", "holds markers, not motions; follow them with: sixpoint track"),
    ],
)
def test_mistakes_are_one_line(place, capsys, words, said):
    """Exit code 2, and a line that says what would work."""
    code, _, err = run(capsys, *words.split())
    assert code == 2 and said in err and err.count("\n") == 1


def test_tables_are_told_apart(place):
    """Six points are no markers, with or without rotations; names above X, Y, Z are markers."""
    assert not holds_markers(place / "points.csv")
    motion = sp.load(place / "walk.bvh")
    sp.save_targets(sp.Figure.from_motion(motion).targets(motion), place / "turned.csv")
    assert not holds_markers(place / "turned.csv") and not holds_markers(place / "none.csv")
    (place / "m.csv").write_text("time,LASI_x,LASI_y,LASI_z\n0,x,2,3\n")
    assert holds_markers(place / "m.csv")


def test_what_another_command_takes_is_said(tmp_path, monkeypatch, capsys):
    """Markers in place of six points and the reverse, a folder, joint angles: it is said what would do."""
    monkeypatch.chdir(tmp_path)
    figure = sp.Figure.from_stature(1.75)
    sp.save_targets(figure.targets(sp.make_sample("walk", figure).sliced(slice(0, 9))), "six.csv")
    save_markers(walking_markers(9), Path("gait.csv"))
    save_markers(walking_markers(9), Path("gait.c3d"))
    Path("angles.mot").touch()
    Path("clips").mkdir()
    save_markers(walking_markers(9), Path("clips/gait.c3d"))
    for words, said in (
        (["reconstruct", "gait.csv"], "gait.csv:4: these are markers, not six points; follow them with: six"),
        (
            ["track", "six.csv"],
            "six.csv: these are six points, not markers; pose a body with: sixpoint recon",
        ),
        (
            ["track", "clips"],
            "clips: this is a folder; for all files in it: sixpoint batch FOLDER --job track",
        ),
        (["batch", "clips", "-o", "out"], "markers are followed with --job track"),
        (["info", "angles.mot"], "(.mot) are written, not read"),
        (["info", "a.xyz"], "of markers: .c3d, .trc"),
        (
            ["track", "gait.c3d", "--unit", "m", "--up", "z", "-o", "a.bvh"],
            "gait: these markers would be a person",
        ),
    ):
        assert main(words) == 2
        err = capsys.readouterr().err
        assert said in err and len(err) < 600
        assert list(tmp_path.glob("*.bvh")) == []


def test_the_table_of_markers_has_units_and_says_what_is_left_out(tmp_path, monkeypatch, capsys):
    """Centimetres stand above the numbers; who was followed is as tall as the figure that walked."""
    monkeypatch.chdir(tmp_path)
    save_markers(walking_markers(60), Path("gait.c3d"))
    assert main(["track", "gait.c3d", "-o", "a.bvh"]) == 0
    out = capsys.readouterr().out
    assert "RMS [cm]" in out and "29 better ones of 41 left out" in out
    assert "person" in out and 1.6 < float(out.split("person")[1].split()[0]) < 1.9
