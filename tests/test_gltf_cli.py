"""Avatars on the command line: what they are, and to other formats and back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sixpoint as sp
from gltf_avatars import make_avatar
from sixpoint.formats import load_avatar
from test_cli import run


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A current folder with a VRM avatar, and a knight that walks."""
    (tmp_path / "girl.vrm").write_bytes(make_avatar("vrm0"))
    (tmp_path / "still.glb").write_bytes(make_avatar("knight"))
    knight = load_avatar(tmp_path / "still.glb")
    figure = sp.Figure.from_stature()
    targets = figure.targets(sp.make_sample("walk", figure).sliced(slice(0, 60)))
    motion = sp.SequentialIKPlus(knight.figure).solve_motion(targets)
    sp.save(motion, tmp_path / "knight.glb", avatar=knight)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_info_says_what_an_avatar_is(place, capsys):
    """Kind, mesh, humanoid map, animations, roles."""
    code, out, _ = run(capsys, "info", "girl.vrm")
    assert code == 0
    for words in ("VRM 0.x", "126 vertices, 168 triangles", "21 bones mapped", "none: the pose of the nodes"):
        assert words in " ".join(out.split())
    assert "left leftHand, right rightHand" in " ".join(out.split())
    code, out, _ = run(capsys, "info", "knight.glb", "--tree")
    assert code == 0
    for words in ("glTF", "2 primitives", "1: walk; the first is read", "60 frames at 60 Hz"):
        assert words in " ".join(out.split())


def test_motions_go_to_other_formats_and_back(place, capsys):
    """GLB -> BVH -> GLB keeps the movement; GLB -> GLB keeps the mesh; a VRM animation is one."""
    for words in (
        ("knight.glb", "a.bvh"),
        ("a.bvh", "b.glb"),
        ("knight.glb", "c.glb"),
        ("knight.glb", "d.vrma"),
        ("d.vrma", "e.csv"),
    ):
        code, _, err = run(capsys, "convert", *words)
        assert code == 0, err
    truth = sp.load("knight.glb")
    np.testing.assert_allclose(sp.load("b.glb").positions, truth.positions, atol=1e-5)
    np.testing.assert_allclose(sp.load("c.glb").positions, truth.positions, atol=1e-5)
    before, after = load_avatar("knight.glb"), load_avatar("c.glb")
    np.testing.assert_array_equal(before.figure.shape.vertices, after.figure.shape.vertices)
    points = before.figure.targets(truth).positions
    np.testing.assert_allclose(sp.load_targets("e.csv").positions, points, atol=1e-4)


def test_an_avatars_movement_is_reconstructed_on_its_own_rig(place, capsys):
    """The six points of a GLB's animation pose its figure; a rig for six points may be an avatar."""
    code, out, err = run(capsys, "reconstruct", "knight.glb", "-o", "again.bvh")
    assert code == 0, err
    assert "position error" in out
    code, _, err = run(capsys, "convert", "knight.glb", "points.csv")
    assert code == 0, err
    code, _, err = run(capsys, "reconstruct", "points.csv", "--skeleton", "girl.vrm", "-o", "girl.bvh")
    assert code == 0, err
    assert sp.load("girl.bvh").skeleton.names == load_avatar("girl.vrm").figure.skeleton.names


def test_mistakes_are_said_without_a_traceback(place, capsys):
    """A file that is none, units, and formats that are not written."""
    (place / "bad.vrm").write_bytes(b"no avatar")
    for words, message in (
        (("info", "bad.vrm"), "no glTF file"),
        (("convert", "knight.glb", "x.vrm"), ".vrm"),
        (("convert", "knight.glb", "x.glb", "--out-unit", "cm"), "metres"),
        (("info", "knight.glb", "--unit", "cm"), "metres"),
    ):
        code, _, err = run(capsys, *words)
        assert code != 0
        assert message in err
        assert "Traceback" not in err
