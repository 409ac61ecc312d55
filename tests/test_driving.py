"""Avatars driven by somebody else's motion or points: reconstructed, written, drawn."""

from __future__ import annotations

import numpy as np
import pytest

import sixpoint as sp
from body_rigs import family_skeleton
from conftest import recordings
from gltf_avatars import EXTENSIONS, PLACES, make_avatar
from sixpoint.body import rotations as rot
from sixpoint.body.surface.flesh import build_shape
from sixpoint.cli import main
from sixpoint.errors import FormatError
from sixpoint.formats import load, load_avatar, save
from sixpoint.jobs.driving import drive, is_on, open_avatar
from sixpoint.jobs.reading import Reading
from sixpoint.jobs.reconstruct import Body, reconstruct

FEW = Reading(frames=slice(0, 40, 4))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A boxing motion and its points, a child with a built-in surface, and small avatars of several kinds."""
    folder = tmp_path_factory.mktemp("avatars")
    figure = sp.Figure.from_stature(1.80)
    boxing = sp.make_sample("boxing", figure).sliced(slice(0, 40))
    sp.save(boxing, folder / "boxing.bvh")
    sp.save_targets(figure.targets(boxing), folder / "points.csv")
    child = sp.Figure.from_stature(1.20)
    still = child.compute_motion(np.tile(rot.IDENTITY, (1, len(child.skeleton), 1)), np.zeros((1, 3)), 30.0)
    save(still, folder / "child.glb", shape=build_shape(child))
    for style in ("vrm0", "vrm1", "cesium", "robot", "bones"):
        (folder / f"{style}{EXTENSIONS.get(style, '.glb')}").write_bytes(make_avatar(style))
    return folder


def angles(figure, motion):
    """Knees and elbows (F, 4) [rad]."""
    bent = []
    for a, b, c in figure.roles.limbs:
        p = motion.positions
        one, two = rot.unit(p[:, b] - p[:, a]), rot.unit(p[:, c] - p[:, b])
        bent.append(np.arccos(np.clip(np.einsum("fk,fk->f", one, two), -1, 1)))
    return np.stack(bent, axis=-1)


def test_a_tall_boxer_moves_a_child(folder, tmp_path):
    """Elbows and knees bend as the boxer's: within 5 degrees in the mean; no errors are claimed.

    Six points do not tell the shoulders, so an elbow may be off by more.
    """
    out = tmp_path / "child.glb"
    done = reconstruct(folder / "boxing.bvh", out, body=Body(avatar=folder / "child.glb"))
    assert done.errors is None
    assert done.solved.solution.residual.max() < 0.01
    boxing = load(folder / "boxing.bvh")
    own = angles(sp.Figure.from_motion(boxing), boxing)
    result = load(out)
    off = np.degrees(np.abs(angles(load_avatar(out).figure, result) - own))
    assert off.mean() < 5.0
    assert off.max() < 20.0
    assert np.ptp(result.positions[:, :, 1]) < 0.75 * np.ptp(boxing.positions[:, :, 1])


@pytest.mark.parametrize("style", ["vrm0", "vrm1", "cesium", "robot"])
def test_what_is_written_is_what_was_solved(folder, tmp_path, style):
    """The avatar's file with our animation gives the solved joints back within 1e-4 m, with its own mesh."""
    avatar = folder / f"{style}{EXTENSIONS.get(style, '.glb')}"
    done = reconstruct(folder / "boxing.bvh", tmp_path / "a.glb", reading=FEW, body=Body(avatar=avatar))
    back = load(tmp_path / "a.glb")
    assert back.skeleton.names == done.figure.skeleton.names
    np.testing.assert_allclose(back.positions, done.solved.solution.motion.positions, atol=1e-4)
    assert len(load_avatar(tmp_path / "a.glb").figure.shape.triangles) == len(done.figure.shape.triangles)


@pytest.mark.parametrize("suffix", [".glb", ".vrma", ".bvh"])
def test_points_drive_an_avatar(folder, tmp_path, suffix):
    """Six points of a person of known stature, into every format that an avatar is written as."""
    out = tmp_path / f"a{suffix}"
    words = ["reconstruct", str(folder / "points.csv"), "--avatar", str(folder / "vrm1.vrm"), "-o", str(out)]
    assert main([*words, "--stature", "1.8", "--frames", "0:10"]) == 0
    motion = load(out)
    assert len(motion) == 10
    assert np.isfinite(motion.positions).all()


def test_the_default_name_says_who_does_what(folder, tmp_path, monkeypatch, capsys):
    """Without -o the result is <motion>_<avatar>.glb in this folder; the avatar is described."""
    monkeypatch.chdir(tmp_path)
    words = ["reconstruct", str(folder / "boxing.bvh"), "--frames", "0:4"]
    assert main([*words, "--avatar", str(folder / "vrm1.vrm"), "--retarget", "absolute"]) == 0
    assert (tmp_path / "boxing_vrm1.glb").exists()
    assert "VRM 1.0" in capsys.readouterr().out


def test_a_glb_of_a_rig_has_the_built_in_surface(folder, tmp_path):
    """Without an avatar a .glb holds the figure with its surface, in its colours."""
    reconstruct(folder / "boxing.bvh", tmp_path / "a.glb", reading=FEW)
    avatar = load_avatar(tmp_path / "a.glb")
    assert len(avatar.figure.shape.triangles) == len(build_shape(sp.Figure.from_stature(1.8)).triangles)
    assert np.ptp(avatar.appearance.colours[:, 0]) > 0.3


def test_driving_on_the_same_body_changes_next_to_nothing(folder):
    """A figure driven by its own points has them again, to the millimetre."""
    figure = sp.Figure.from_stature(1.80)
    motion = load(folder / "boxing.bvh")
    targets, solved = drive(figure, motion, sp.Figure.from_motion(motion))
    np.testing.assert_allclose(targets.positions, figure.targets(motion).positions, atol=2e-3)
    assert solved.solution.residual.max() < 0.01


def test_names_alone_do_not_make_the_same_body():
    """A child's motion is not on a tall figure of the same joint names; its own is."""
    tall, child = sp.Figure.from_stature(1.8), sp.Figure.from_stature(1.2)
    assert not is_on(sp.make_sample("walk", child), tall)
    assert is_on(sp.make_sample("walk", tall), tall)
    assert not is_on(sp.make_sample("walk", tall), sp.Figure.from_skeleton(family_skeleton("unity")))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["boxing.bvh", "--avatar", "boxing.bvh"], "an avatar is one of"),
        (["boxing.bvh", "--avatar", "none.glb"], "none.glb"),
        (["boxing.bvh", "--avatar", "child.glb", "--extras"], "--extras"),
        (["boxing.bvh", "--avatar", "child.glb", "--picture", "a.png"], "--picture"),
        (["points.csv", "--avatar", "child.glb", "--skeleton", "boxing.bvh"], "leave out --skeleton"),
        (["boxing.bvh", "--avatar", "child.glb", "--stature", "1.8"], "--stature"),
        (["boxing.bvh", "--retarget", "absolute"], "give it with --avatar"),
        (["boxing.bvh", "--avatar", "child.glb", "-o", "a.amc"], ".glb, .vrma, .bvh"),
        (["boxing.bvh", "--avatar", "child.glb", "-o", "child.glb", "--force"], "being read"),
    ],
)
def test_what_an_avatar_cannot_be_given_is_said(folder, monkeypatch, capsys, words, message):
    """Each ends in one line that names the option or file, and nothing is written."""
    monkeypatch.chdir(folder)
    before = {p: p.stat().st_mtime_ns for p in folder.iterdir()}
    assert main(["reconstruct", *words]) == 2
    assert message in capsys.readouterr().err
    assert {p: p.stat().st_mtime_ns for p in folder.iterdir()} == before


def test_an_avatar_without_size_is_named(folder, tmp_path, monkeypatch):
    """A body of a millimetre, as of a wrong unit, is an error that says which file it is in."""
    monkeypatch.setattr("gltf_avatars.PLACES", PLACES * 1e-3)
    (tmp_path / "tiny.vrm").write_bytes(make_avatar("vrm1"))
    with pytest.raises(FormatError, match=r"tiny\.vrm: .*no length"):
        open_avatar(tmp_path / "tiny.vrm")


def test_an_avatar_is_drawn_in_its_own_colours_and_size(folder, tmp_path):
    """A driven avatar is red and blue as its texture is; drawn from the recording or from its own file."""
    pytest.importorskip("embreex", reason="pictures need the extra [render]")
    image = pytest.importorskip("PIL.Image", reason="pictures need the extra [render]")
    words = ["--size", "80x96", "--pictures", "2"]
    one, two = tmp_path / "a.png", tmp_path / "b.png"
    avatar = ["--avatar", str(folder / "vrm1.vrm")]
    assert main(["render", str(folder / "boxing.bvh"), *avatar, "-o", str(one), *words]) == 0
    reconstruct(folder / "boxing.bvh", tmp_path / "a.glb", body=Body(avatar=folder / "vrm1.vrm"))
    assert main(["render", str(tmp_path / "a.glb"), "-o", str(two), *words]) == 0
    assert main(["render", str(tmp_path / "a.glb"), *avatar, "-o", str(tmp_path / "c.png"), *words]) == 0
    first, second, third = (
        np.asarray(image.open(p).convert("RGB")).astype(int) for p in (one, two, tmp_path / "c.png")
    )
    assert (first[..., 0] - first[..., 2] > 100).sum() > 20
    assert (first[..., 2] - first[..., 0] > 100).sum() > 20
    assert np.abs(first - second).mean() < 1.0
    assert np.abs(first - third).mean() < 1.0


def test_bones_without_a_mesh_have_the_built_in_surface(folder, tmp_path):
    """An avatar of bones only is driven and drawn, with the surface that any rig has."""
    pytest.importorskip("embreex", reason="pictures need the extra [render]")
    image = pytest.importorskip("PIL.Image", reason="pictures need the extra [render]")
    words = ["render", str(folder / "boxing.bvh"), "--avatar", str(folder / "bones.vrm")]
    assert main([*words, "-o", str(tmp_path / "a.png"), "--size", "80x96", "--pictures", "1"]) == 0
    picture = np.asarray(image.open(tmp_path / "a.png").convert("RGB")).astype(int)
    assert (picture[..., 0] - picture[..., 2] > 60).sum() > 20  # the right side is orange


def test_an_avatar_is_one_of_some_files(folder):
    """Points are no avatar."""
    with pytest.raises(FormatError, match="an avatar is one of"):
        open_avatar(folder / "points.csv")


@pytest.mark.parametrize("path", recordings("mesh/*.glb") + recordings("mesh/*.vrm"))
def test_real_avatars_are_driven(path, folder, tmp_path):
    """Every avatar of the data folder takes the boxing motion: targets are met, skin stays finite."""
    done = reconstruct(folder / "boxing.bvh", tmp_path / "a.glb", reading=FEW, body=Body(avatar=path))
    assert np.mean(done.solved.solution.residual < 1e-3) > 0.95
    back = load(tmp_path / "a.glb")
    np.testing.assert_allclose(back.positions, done.solved.solution.motion.positions, atol=1e-4)
    if done.figure.shape is not None:
        assert np.isfinite(done.figure.shape.place(*(a[0] for a in back.transforms))).all()


@pytest.mark.parametrize("path", recordings("mesh/*.glb") + recordings("mesh/*.vrm"))
def test_real_avatars_box_as_recorded(path, data):
    """The paper's boxing clip: elbows and knees bend as recorded, within 4 and 2.5 degrees in the mean."""
    clip = load(data / "paper" / "17_10.amc").sliced(slice(0, 1200, 12))
    owner, figure = sp.Figure.from_motion(clip), load_avatar(path).figure
    solved = drive(figure, clip, owner)[1]
    assert np.mean(solved.solution.residual < 1e-3) > 0.95
    off = np.degrees(np.abs(angles(figure, solved.solution.motion) - angles(owner, clip)).mean(axis=0))
    assert np.all(off < [4.0, 4.0, 2.5, 2.5])
