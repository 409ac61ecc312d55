from __future__ import annotations

import re
import time
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from conftest import recordings
from independent import read_bvh_positions
from sixpoint import formats
from sixpoint.body.anthropometry import build_skeleton
from sixpoint.body.motion import FileSpace, Motion
from sixpoint.body.roles import find_roles
from sixpoint.body.skeleton import Skeleton
from sixpoint.errors import FormatError
from sixpoint.formats.space import UNITS, guess_unit

BVH = """HIERARCHY
ROOT Hips
{
\tOFFSET 0 0 0
\tCHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
\tJOINT Left Leg
\t{
\t\tOFFSET 10 -5 0
\t\tCHANNELS 2 Yrotation Xrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0 -80 0
\t\t}
\t}
\tJOINT Spine
\t{
\t\tOFFSET 0 10 0
\t\tCHANNELS 6 Xposition Yposition Zposition Xrotation Yrotation Zrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0 60 0
\t\t}
\t}
}
MOTION
Frames: 2
Frame Time: .0083333
0 90 0 10 20 30 5 6 1 12 3 7 8 9
1 91 2 11 21 31 15 16 4 15 6 -7 -8 -9
"""


def make_motion(seed: int = 0, joints: int = 12, frames: int = 7, moving: int = 3, **space: object) -> Motion:
    """A motion on a random tree with sites on leaves, on branches and twice on one joint."""
    rng = np.random.default_rng(seed)
    parents = np.array([-1, *(rng.integers(max(0, j - 4), j) for j in range(1, joints))])
    offsets = rng.normal(size=(joints, 3)) * 0.3
    leaves = [j for j in range(joints) if j not in parents]
    carriers = np.array(sorted([*leaves, 0, 1, 1]))
    names = tuple(f"joint{j}" for j in range(joints))
    sites = tuple(f"joint{j}_end" for j in carriers)
    place = rng.normal(size=(len(carriers), 3)) * 0.1
    skeleton = Skeleton(names, parents, offsets, sites, carriers, place)
    rotations = Rotation.random(frames * joints, random_state=seed).as_quat().reshape(frames, joints, 4)
    movers = (0, *sorted(rng.choice(np.arange(1, joints), moving, replace=False)))
    translations = rng.normal(size=(frames, len(movers), 3))
    return Motion(
        skeleton,
        rotations,
        translations,
        60.0,
        tuple(map(int, movers)),
        space=FileSpace(**space),  # type: ignore[arg-type]
    )


def assert_same(first: Motion, second: Motion, tolerance: float = 1e-6) -> None:
    """Same joints (by name, in any order), rotations, positions and sites."""
    order = [second.skeleton.index(name) for name in first.skeleton.names]
    assert len(first) == len(second) and second.rate == pytest.approx(first.rate, rel=1e-9)
    assert len(order) == len(second.skeleton)
    parents = second.skeleton.parents[order[1:]]
    assert [second.skeleton.names[p] for p in parents] == [
        first.skeleton.names[p] for p in first.skeleton.parents[1:]
    ]
    turned = Rotation.from_quat(first.rotations.reshape(-1, 4)).inv() * Rotation.from_quat(
        second.rotations[:, order].reshape(-1, 4)
    )
    assert turned.magnitude().max() < tolerance
    np.testing.assert_allclose(second.positions[:, order], first.positions, atol=tolerance)
    ends = [sorted(m.skeleton.compute_sites(*m.transforms)[0].round(5).tolist()) for m in (first, second)]
    np.testing.assert_allclose(ends[0], ends[1], atol=2e-5)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "small.bvh"
    path.write_text(BVH)
    return path


def test_numbers_of_a_small_file(file: Path) -> None:
    """Names, offsets, sites, channels and rate are those of the file."""
    motion = formats.load(file, unit="cm", up="y")
    assert motion.skeleton.names == ("Hips", "Left Leg", "Spine")
    assert motion.skeleton.site_names == ("Left Leg_end", "Spine_end")
    assert motion.moving == (0, 2) and motion.rate == 120.0 and motion.name == "small"
    np.testing.assert_allclose(motion.skeleton.offsets[1], [0.1, -0.05, 0])
    np.testing.assert_allclose(motion.translations[1], [[0.01, 0.91, 0.02], [0.04, 0.15, 0.06]])
    expected = Rotation.from_euler("YX", [15, 16], degrees=True).as_quat()
    np.testing.assert_allclose(motion.rotations[1, 1], expected, atol=1e-12)


def test_layout_does_not_matter(file: Path) -> None:
    """CRLF, lower case, braces on the keyword's line, comments and blank lines change nothing."""
    first = formats.load(file, unit="cm")
    text = re.sub(r"\n\s*{", " {", BVH).lower().replace("motion\n", "motion\n\n").replace("\n", "\r\n")
    text = "# a comment\r\n" + text.replace("xposition", "XPOSITION").replace("\r\n1 91", "\r\n\r\n1 91")
    file.write_bytes(b"\xef\xbb\xbf" + text.encode())
    second = formats.load(file, unit="cm")
    np.testing.assert_array_equal(first.rotations, second.rotations)
    np.testing.assert_array_equal(first.translations, second.translations)


def test_still_position_channels_become_the_offset(file: Path) -> None:
    """Position channels replace the offset; where they never change the joint does not move."""
    file.write_text(BVH.replace("4 15 6 -7 -8 -9", "1 12 3 -7 -8 -9"))
    motion = formats.load(file, unit="cm")
    assert motion.moving == (0,)
    np.testing.assert_allclose(motion.skeleton.offsets[2], [0.01, 0.12, 0.03])


@pytest.mark.parametrize("order", ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"])
@pytest.mark.parametrize("up", ["y", "z"])
def test_round_trip_in_every_order(tmp_path: Path, order: str, up: str) -> None:
    """What is written in any Euler order and up axis is read back to 1e-6, moving joints and sites too."""
    for seed, unit in enumerate(["m", "cm", "mm", "inch", "cmu"]):
        motion = make_motion(seed, unit=UNITS[unit], up=up)
        formats.save(motion, tmp_path / "a.bvh", force=True, order=order)
        assert_same(motion, formats.load(tmp_path / "a.bvh", unit=unit, up=up))


def test_round_trip_at_gimbal_lock(tmp_path: Path) -> None:
    """Rotations at and next to gimbal lock come back to 1e-6 rad."""
    motion = make_motion(frames=200)
    rng = np.random.default_rng(1)
    angles = rng.uniform(-180, 180, size=(200, 12, 3))
    angles[..., 1] = 90.0 + rng.choice([0, 1e-9, -1e-7, 1e-5, 1e-3], size=(200, 12))
    quats = Rotation.from_euler("ZYX", angles.reshape(-1, 3), degrees=True).as_quat().reshape(200, 12, 4)
    motion = replace(motion, rotations=quats)
    formats.save(motion, tmp_path / "a.bvh")
    assert_same(motion, formats.load(tmp_path / "a.bvh", unit="cm", up="y"), 3e-6)


def test_large_worlds_keep_their_precision(tmp_path: Path) -> None:
    """Positions ten kilometres from the origin come back to 1e-7 m."""
    motion = make_motion()
    motion = replace(motion, translations=motion.translations + np.array([1e4, -2e4, 3e3]))
    formats.save(motion, tmp_path / "a.bvh")
    again = formats.load(tmp_path / "a.bvh", unit="cm", up="y")
    np.testing.assert_allclose(again.translations[:, 0], motion.translations[:, 0], rtol=0, atol=1e-7)


@pytest.mark.parametrize("seed", range(3))
def test_written_file_means_the_same_to_another_reader(tmp_path: Path, seed: int) -> None:
    """An independent reader with rotation matrices finds the joints where the motion has them."""
    motion = make_motion(seed, unit=0.01)
    formats.save(motion, tmp_path / "a.bvh", order="XZY")
    found = read_bvh_positions(tmp_path / "a.bvh")
    for joint, name in enumerate(motion.skeleton.names):
        np.testing.assert_allclose(found[name] * 0.01, motion.positions[:, joint], atol=1e-6)


@pytest.mark.parametrize("path", recordings("**/*.bvh"))
def test_recordings_are_human(path: Path) -> None:
    """Every real file loads with a human's size and its head above its ankles."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        motion = formats.load(path)
    roles = find_roles(motion.skeleton)
    height = motion.positions[:, roles.head, 1] - motion.positions[:, list(roles.ankle), 1].mean(axis=1)
    assert height.mean() > 0.8
    assert 1.3 < 1.2 * height.max() < 2.0
    assert 20 < motion.rate < 130 and motion.rate == round(motion.rate)


RIGS = [*recordings("misc/*.bvh"), *recordings("xsens/*.bvh"), *recordings("bandai/*bow*.bvh")]


@pytest.mark.parametrize("path", RIGS)
def test_recordings_survive_writing(path: Path, tmp_path: Path) -> None:
    """Read, write, read gives the same motion, unit and up axis."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        motion = formats.load(path).sliced(slice(0, 300))
    formats.save(motion, tmp_path / path.name)
    again = formats.load(tmp_path / path.name)
    assert again.space == motion.space and again.moving == motion.moving
    assert again.skeleton.names == motion.skeleton.names
    assert_same(motion, again)


def test_extra_frames_are_read_with_a_warning(data: Path, file: Path) -> None:
    """A file with more rows than declared is read whole, and that is said."""
    with pytest.warns(UserWarning, match="3069 frames declared, but the file holds 3070"):
        assert len(formats.load(data / "misc" / "assimp_Boxing_Toes.bvh")) == 3070
    file.write_text(BVH.replace("Frames: 2", "Frames: 1"))
    with pytest.warns(UserWarning, match=":26: 1 frames declared"):
        assert len(formats.load(file)) == 2


def test_long_recordings_are_quick(tmp_path: Path) -> None:
    """4510 frames of 31 joints are written and read in a few seconds even on a busy machine."""
    motion = make_motion(joints=31, frames=4510, moving=1)
    start = time.perf_counter()
    formats.save(motion, tmp_path / "a.bvh")
    formats.load(tmp_path / "a.bvh")
    assert time.perf_counter() - start < 8.0


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("HIERARCHY\n", "", 1, "HIERARCHY"),
        ("ROOT Hips", "ROOT", 2, "without a name"),
        ("OFFSET 10 -5 0", "OFFSET 10 -5", 8, "expected 3 numbers"),
        ("OFFSET 10 -5 0", "OFFSET 10 x 0", 8, "not a number"),
        ("OFFSET 10 -5 0", "OFFSET 10 nan 0", 8, "not finite"),
        ("OFFSET 10 -5 0", "", 14, "no OFFSET"),
        ("CHANNELS 2 Y", "CHANNELS 3 Y", 9, "differ"),
        ("2 Yrotation", "2 Wrotation", 9, "unknown channel"),
        ("2 Yrotation", "2 Xrotation", 9, "repeats"),
        ("JOINT Spine", "JOINT Hips", 15, "declared in line 2"),
        ("JOINT Spine", "JOIN Spine", 15, "unknown keyword"),
        ("JOINT Spine", "ROOT Spine", 15, "more than one ROOT"),
        ("\t}\n}\nMOTION", "\t}\nMOTION", 24, "still open are Hips"),
        ("\t}\n}\nMOTION", "\t}\n}\n}\nMOTION", 25, "outside of a joint"),
        ("Frames: 2", "Frames: two", 26, "frame count"),
        ("Frames: 2", "Frames: 5", 29, "truncated"),
        ("Frame Time: .0083333", "Frame Time: 0", 27, "positive"),
        ("Frame Time: .0083333", "Frame Time: -1", 27, "positive"),
        ("Frame Time: .0083333", "Frame Time: nan", 27, "not finite"),
        ("Frame Time: .0083333", "", 28, "frame time"),
        (" -8 -9", " -8", 29, "incomplete"),
        ("8 9\n", "8\n", 28, "wrong number of values"),
        ("8 9\n", "8 inf\n", 28, "not finite"),
        ("8 9\n", "8 1e13\n", 28, "far too large"),
        ("8 9\n", "8 1e400\n", 28, "not finite"),
        ("8 9\n", "8 abc\n", 28, "not a number"),
    ],
)
def test_mistakes_have_a_line(file: Path, old: str, new: str, line: int, message: str) -> None:
    """Each mistake is a FormatError at its line."""
    file.write_text(BVH.replace(old, new, 1))
    with pytest.raises(FormatError, match=message) as caught:
        formats.load(file)
    assert caught.value.line == line


def test_a_cut_file_says_so(file: Path) -> None:
    """A file cut anywhere is an error, and one cut between frames hints at it."""
    for end in (10, 200, BVH.index("MOTION"), BVH.index("0 90"), BVH.index("1 91")):
        file.write_text(BVH[:end])
        with pytest.raises(FormatError):
            formats.load(file)
    with pytest.raises(FormatError, match=r"truncated.*write Frames: 1"):
        formats.load(file)


@pytest.mark.parametrize("content", [b"", b"  \n", b"\0\1\2", BVH.encode("utf-16"), b"\xff\xfe\xfd"])
def test_other_content_is_refused(file: Path, content: bytes) -> None:
    """Empty and binary files are FormatErrors."""
    file.write_bytes(content)
    with pytest.raises(FormatError):
        formats.load(file)


def test_other_places_are_refused(tmp_path: Path) -> None:
    """Missing files, folders, unknown and planned suffixes say what is wrong and what would work."""
    (tmp_path / "folder.bvh").mkdir()
    for name, message in {
        "folder.bvh": "folder",
        "none.bvh": "no such file",
        "a.xyz": r"unknown suffix '\.xyz'.*\.bvh, \.amc, \.asf",
        "a.fbx": "Blender",
        "a.c3d": "holds markers, not motions; follow them with: sixpoint track",
        "a.csv": "does not hold motions",
    }.items():
        with pytest.raises(FormatError, match=message):
            formats.load(tmp_path / name)
    with pytest.raises(FormatError, match="unknown unit 'parsec'; units: m, cm"):
        (tmp_path / "a.bvh").write_text(BVH)
        formats.load(tmp_path / "a.bvh", unit="parsec")
    with pytest.raises(FormatError, match="up axis"):
        formats.load(tmp_path / "a.bvh", up="x")
    with pytest.raises(FormatError, match="unknown Euler order"):
        formats.save(make_motion(), tmp_path / "b.bvh", order="ABC")
    with pytest.raises(FormatError, match=r"belongs to an \.amc"):
        formats.load(tmp_path / "a.bvh", skeleton="a.asf")


def test_existing_files_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No overwriting without force, no missing folder is made, and no failure leaves anything behind."""
    path = tmp_path / "a.bvh"
    path.write_text("precious")
    with pytest.raises(FormatError, match="exists; choose another name, or use --force"):
        formats.save(make_motion(), path)
    with pytest.raises(FormatError, match="does not exist"):
        formats.save(make_motion(), tmp_path / "none" / "a.bvh")

    def fail(self: Path, target: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(FormatError, match="No space left"):
        formats.save(make_motion(), path, force=True)
    assert path.read_text() == "precious" and list(tmp_path.iterdir()) == [path]
    monkeypatch.undo()
    formats.save(make_motion(), path, force=True)
    assert path.read_text().startswith("HIERARCHY") and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(("stature", "unit"), [(1.7, 1.0), (170, 0.01), (1700, 0.001), (31, 0.0254 / 0.45)])
def test_unit_from_stature(stature: float, unit: float) -> None:
    """A human's size tells the unit."""
    assert guess_unit(stature) == pytest.approx(unit)
    assert guess_unit(67) == 0.0254 and guess_unit(17.0) == 0.1 and guess_unit(0.0) == 1.0


@pytest.mark.parametrize("unit", list(UNITS))
@pytest.mark.parametrize("up", ["y", "z"])
def test_space_of_a_human_is_found(tmp_path: Path, unit: str, up: str) -> None:
    """A standing figure tells its own unit and up axis, and is the same figure whatever they were."""
    skeleton = build_skeleton()
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (3, len(skeleton), 1))
    motion = Motion(skeleton, rotations, np.tile(skeleton.offsets[0], (3, 1, 1)), 30.0)
    formats.save(motion, tmp_path / "a.bvh", unit=unit, up=up)
    again = formats.load(tmp_path / "a.bvh")
    assert again.space.up == up and again.space.unit == pytest.approx(UNITS[unit])
    assert again.space.unit_source == again.space.up_source == "guessed"
    assert_same(motion, again)


def test_very_deep_trees_load(tmp_path: Path) -> None:
    """Thousands of nested joints are no problem."""
    joints = "".join(f"JOINT j{k}\n{{\nOFFSET 0 1 0\n" for k in range(3000))
    head = "HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n"
    (tmp_path / "deep.bvh").write_text(f"{head}{joints}{'}' * 3001}\nMOTION\nFrames: 1\nFrame Time: 0.1\n3\n")
    assert len(formats.load(tmp_path / "deep.bvh").skeleton) == 3001
