from __future__ import annotations

import logging
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from conftest import recordings
from sixpoint import formats
from sixpoint.body.dofs import Hinges
from sixpoint.body.motion import Motion
from sixpoint.errors import FormatError
from sixpoint.formats.acclaim_bones import WIDE_OPEN
from sixpoint.formats.asf import read_asf
from test_formats_bvh import assert_same, make_motion

ASF = """# a comment
:version 1.10
:name small
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
   free text, : anything
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name hip
     direction 1 0 0
     length 2
     axis 0 0 0 XYZ
  end
  begin
     id 2
     name thigh
     direction 0 -1 0
     length 7
     axis 0 0 20 XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-60.0 70.0)
  end
  begin
     id 3
     name shin
     direction 0 -1 0
     length 6
     axis 90 10 20 XYZ
    dof rx
  end
:hierarchy
  begin
    root hip
    hip thigh
    thigh shin
  end
"""

AMC = """#!OML:ASF somewhere
:FULLY-SPECIFIED
:DEGREES
1
root 1 2 3 10 20 30
thigh 11 22 33
shin 44
2
root 1.5 2 3 10 20 30
thigh -11 22 33
shin 45
3
root 2 2 3 10 20 30
thigh -11 22 -33
shin 46
"""

UNIT = 0.0254 / 0.45


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "s.asf").write_text(ASF)
    path = tmp_path / "s_01.amc"
    path.write_text(AMC)
    return path


def test_numbers_of_a_small_file(file: Path) -> None:
    """Bones start at their parent's end; rotations turn in the bone's axis frame; one unit is 1/0.45 inch."""
    motion = formats.load(file)
    assert motion.skeleton.names == ("root", "hip", "thigh", "shin")
    np.testing.assert_allclose(motion.skeleton.offsets / UNIT, [[0, 0, 0], [0, 0, 0], [2, 0, 0], [0, -7, 0]])
    assert motion.skeleton.site_names == ("shin_end",)
    np.testing.assert_allclose(motion.root_positions[1] / UNIT, [1.5, 2, 3])
    axis = Rotation.from_euler("xyz", [90, 10, 20], degrees=True)
    expected = axis * Rotation.from_euler("x", 46, degrees=True) * axis.inv()
    np.testing.assert_allclose(motion.rotations[2, 3], expected.as_quat(), atol=1e-12)
    root = Rotation.from_euler("xyz", [10, 20, 30], degrees=True)
    np.testing.assert_allclose(motion.rotations[0, 0], root.as_quat(), atol=1e-12)
    assert motion.rate == 120.0 and motion.space.unit == pytest.approx(UNIT)


def test_dofs_give_the_rotations(file: Path) -> None:
    """The hinges of the file, at the file's angles in reverse order, give the local rotations; limits too."""
    motion = formats.load(file)
    thigh = motion.dofs[2]
    assert isinstance(thigh, Hinges) and 1 not in motion.dofs.joints and 0 not in motion.dofs.joints
    np.testing.assert_allclose(np.rad2deg(thigh.lower), [-60, -70, -160])
    np.testing.assert_allclose(np.rad2deg(thigh.upper), [70, 70, 20])
    assert motion.dofs[3].upper == [WIDE_OPEN]  # type: ignore[union-attr]
    q = np.deg2rad([33, 22, 11, 44])
    rotations = motion.dofs.compute_rotations(q, 4)
    np.testing.assert_allclose(rotations[2:], motion.rotations[0, 2:], atol=1e-12)


def test_radians_and_limits_without_end(file: Path) -> None:
    """Files in radians mean the same; inf is a limit that is wide open."""
    motion = formats.load(file)
    rows = []
    for line in AMC.replace(":DEGREES", ":RADIANS").split("\n"):
        name, *values = line.split() or [""]
        angles = values[3:] if name == "root" else values if name in ("thigh", "shin") else []
        head = values[: len(values) - len(angles)]
        rows.append(" ".join([name, *head, *(repr(np.deg2rad(float(v)).item()) for v in angles)]))
    file.write_text("\n".join(rows))
    file.with_name("s.asf").write_text(ASF.replace("(-160.0 20.0)", "(-inf inf)"))
    again = formats.load(file)
    assert_same(motion, again, 1e-9)
    assert again.dofs[2].upper[2] == WIDE_OPEN  # type: ignore[union-attr]


def test_asf_alone_is_its_rest_pose(file: Path) -> None:
    """An ASF loads as one frame without rotations."""
    motion = formats.load(file.with_name("s.asf"))
    assert len(motion) == 1 and np.all(motion.rotations[..., 3] == 1.0)
    np.testing.assert_allclose(motion.positions[0, 3] / UNIT, [2, -7, 0])


def test_skeleton_is_found_and_said(file: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Same stem first, then the subject, then the only one; several or none is an error that lists them."""
    folder = file.parent
    with caplog.at_level(logging.INFO, "sixpoint"):
        formats.load(file)
    assert "s.asf" in caplog.text
    assert formats.find_skeleton(folder / "other.amc") == folder / "s.asf"
    (folder / "s_01.ASF").write_text(ASF)
    assert formats.find_skeleton(file) == folder / "s_01.ASF"
    with pytest.raises(FormatError, match=r"s\.asf, s_01\.ASF|s_01\.ASF, s\.asf.*--skeleton FILE\.asf"):
        formats.find_skeleton(folder / "other.amc")
    with pytest.raises(FormatError, match=r"no \.asf beside it"):
        formats.find_skeleton(folder / "none" / "other.amc")
    assert len(formats.load(file, skeleton=folder / "s.asf")) == 3


@pytest.mark.parametrize("seed", range(6))
def test_any_motion_survives_writing(tmp_path: Path, seed: int) -> None:
    """Branches, sites, moving joints, root name and rate come back to 1e-6 from ASF and AMC."""
    motion = make_motion(seed, moving=seed % 4, unit=[1.0, 0.01, 0.0254][seed % 3])
    formats.save(motion, tmp_path / "a.amc")
    again = formats.load(tmp_path / "a.amc")
    assert again.skeleton.names == motion.skeleton.names and again.moving == motion.moving
    np.testing.assert_array_equal(again.skeleton.parents, motion.skeleton.parents)
    np.testing.assert_allclose(again.skeleton.offsets, motion.skeleton.offsets, atol=1e-9)
    assert sorted(again.skeleton.site_names) == sorted(motion.skeleton.site_names)
    assert_same(motion, again)


def test_fixed_bones_have_no_dofs(tmp_path: Path, file: Path) -> None:
    """Only bones that ever rotate get dofs, and an AMC of a CMU-like rig needs no helper bones."""
    formats.save(formats.load(file), tmp_path / "b.amc")
    text = (tmp_path / "b.asf").read_text()
    assert text.count("dof rx ry rz") == 2 and "__" not in text.replace("shin_end", "")
    assert "# rate 120.0" in (tmp_path / "b.amc").read_text()
    assert_same(formats.load(file), formats.load(tmp_path / "b.amc"))


def test_stretching_bones_move_their_children(file: Path) -> None:
    """The dof l lengthens a bone: what hangs on its end moves."""
    file.with_name("s.asf").write_text(ASF.replace("dof rx ry rz", "dof rx ry l"))
    motion = formats.load(file)
    assert motion.moving == (0, 3)
    np.testing.assert_allclose(motion.translations[:, 1, 1] / UNIT, [-40, -40, 26])


def test_z_up_motions_are_written_y_up(tmp_path: Path) -> None:
    """An AMC is Y up whatever the source was; asking for Z up is an error."""
    motion = make_motion(unit=0.01, up="z")
    formats.save(motion, tmp_path / "a.amc")
    assert_same(motion, formats.load(tmp_path / "a.amc"))
    with pytest.raises(FormatError, match="Y up"):
        formats.save(motion, tmp_path / "b.amc", up="z")


def test_neither_file_is_overwritten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An existing ASF protects both files; a failure half way removes what was written."""
    (tmp_path / "a.asf").write_text("precious")
    with pytest.raises(FormatError, match=r"a\.asf: exists"):
        formats.save(make_motion(), tmp_path / "a.amc")
    assert [p.name for p in tmp_path.iterdir()] == ["a.asf"]
    replace_file = Path.replace

    def fail(self: Path, target: Path) -> Path:
        if target.suffix == ".asf":
            raise OSError(28, "No space left on device")
        return replace_file(self, target)

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(FormatError, match="No space"):
        formats.save(make_motion(), tmp_path / "a.amc", force=True)
    assert [p.name for p in tmp_path.iterdir()] == ["a.asf"]
    assert (tmp_path / "a.asf").read_text() == "precious"


def test_names_that_asf_cannot_hold(tmp_path: Path) -> None:
    """Clashing names are refused; spaces become underscores; helper names of our own are no joints' end."""
    motion = make_motion()

    def renamed(name: str) -> Motion:
        names = (*motion.skeleton.names[:-1], name)
        return replace(motion, skeleton=replace(motion.skeleton, names=names))

    for name in ("root", "begin", "#x", "joint3"):
        if name != "joint3":
            with pytest.raises(FormatError, match="cannot hold"):
                formats.save(renamed(name), tmp_path / "a.amc")
    for name, expected in {"my joint": "my_joint", "x__link": "x__link", "y__site": "y__site"}.items():
        formats.save(renamed(name), tmp_path / "a.amc", force=True)
        assert formats.load(tmp_path / "a.amc").skeleton.names[-1] == expected


def test_same_take_in_two_formats(data: Path) -> None:
    """Pelvis, legs and lower spine of 02_05 agree between AMC and BVH to 1e-4 m."""
    amc, bvh = formats.load(data / "cmu" / "02_05.amc"), formats.load(data / "cmu" / "02_05.bvh")
    pairs = {
        "root": "Hips",
        "lfemur": "LeftUpLeg",
        "ltibia": "LeftLeg",
        "lfoot": "LeftFoot",
        "rfemur": "RightUpLeg",
        "rtibia": "RightLeg",
        "rfoot": "RightFoot",
        "upperback": "Spine",
        "thorax": "Spine1",
    }
    for bone, joint in pairs.items():
        first = amc.positions[:, amc.skeleton.index(bone)]
        second = bvh.positions[1:, bvh.skeleton.index(joint)]
        np.testing.assert_allclose(first, second, atol=2e-4)


@pytest.mark.parametrize("path", recordings("*/*.asf"))
def test_recorded_skeletons(path: Path) -> None:
    """Every real ASF has 31 joints, is in CMU units and declares its hinges with limits."""
    rig = read_asf(path)
    assert len(rig.skeleton) == 31 and rig.unit == pytest.approx(UNIT)
    assert sum(dof.size for dof in rig.dofs.joints.values()) == 56
    assert max(np.max(dof.upper) for dof in rig.dofs.joints.values()) <= np.pi  # type: ignore[union-attr]


@pytest.mark.parametrize("path", recordings("cmu/*_01.amc") + recordings("paper/*.amc"))
def test_recordings_survive_writing(path: Path, tmp_path: Path) -> None:
    """Real takes come back from AMC, and from BVH in the same unit."""
    motion = formats.load(path).sliced(slice(0, 200))
    formats.save(motion, tmp_path / "a.amc")
    assert_same(motion, formats.load(tmp_path / "a.amc"))
    formats.save(motion, tmp_path / "a.bvh")
    again = formats.load(tmp_path / "a.bvh")
    assert again.space.unit == pytest.approx(motion.space.unit)
    assert_same(motion, again)


def test_long_recordings_are_quick(data: Path) -> None:
    """4510 frames are read in a few seconds even on a busy machine."""
    start = time.perf_counter()
    motion = formats.load(data / "paper" / "01_03.amc")
    assert len(motion) == 4510 and time.perf_counter() - start < 5.0


def test_frames_may_be_in_any_layout(file: Path) -> None:
    """Bones in another order per frame, comments and blank lines change nothing."""
    motion = formats.load(file)
    text = AMC.replace("thigh -11 22 33\nshin 45", "# note\n\nshin 45\nthigh -11 22 33")
    file.write_text(text.replace("\n", "\r\n"))
    assert_same(motion, formats.load(file), 1e-12)


def test_jumping_frame_numbers_are_said(file: Path) -> None:
    """Frames that are not numbered one by one are read with a warning."""
    file.write_text(AMC.replace("\n3\n", "\n5\n"))
    with pytest.warns(UserWarning, match=":12: frame 5 follows frame 2"):
        assert len(formats.load(file)) == 3


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("thigh -11 22 33", "thig -11 22 33", 10, "no moving bone 'thig'.*root, thigh, shin"),
        ("thigh -11 22 33", "hip -11 22 33", 10, "no moving bone 'hip'"),
        ("thigh -11 22 33", "thigh -11 22", 10, "expected 3 numbers, got '2'"),
        ("thigh -11 22 33", "thigh -11 nan 33", 10, "not finite"),
        ("thigh -11 22 33", "thigh -11 1e400 33", 10, "not finite"),
        ("thigh -11 22 33", "thigh -11 x 33", 10, "not a number"),
        ("thigh -11 22 33", "shin 45", 11, "shin is listed twice in frame 2"),
        ("thigh -11 22 33\n", "", 11, "frame 2 lacks thigh"),
        ("shin 46\n", "", 14, "frame 3 lacks shin: truncated"),
        ("\n3\n", "\n2\n", 12, "must increase"),
        ("\n3\n", "\n", 12, "listed twice"),
        (":DEGREES\n1\n", ":DEGREES\n", 4, "expected a frame number"),
        (AMC, ":DEGREES\n", 2, "no frames"),
        (AMC, "hello\n", 1, "not an AMC"),
        (":DEGREES", "# rate x", 3, "not a number"),
    ],
)
def test_mistakes_in_amc_have_a_line(file: Path, old: str, new: str, line: int, message: str) -> None:
    """Each mistake in an AMC is a FormatError at its line."""
    file.write_text(AMC.replace(old, new, 1))
    with pytest.raises(FormatError, match=message) as caught:
        formats.load(file)
    assert caught.value.line == line and caught.value.path == file


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        (ASF, "hello\n", 1, "not an ASF"),
        ("length 0.45", "length 0", 6, "positive"),
        ("angle deg", "angle grad", 7, "deg or rad"),
        ("order TX TY TZ RX", "order TX TY TZ XX", 11, "bad order"),
        ("axis XYZ\n   pos", "axis XXZ\n   pos", 12, "axis order"),
        ("position 0 0 0", "position 0 0", 13, "expected 3 numbers"),
        ("name thigh", "name hip", 25, "declared twice"),
        ("direction 1 0 0", "direction 1 0", 19, "expected 3 numbers"),
        ("length 7", "length seven", 27, "not a number"),
        ("length 7", "lenght 7", 23, "no length"),
        ("axis 90 10 20 XYZ", "axis 90 inf 20 XYZ", 39, "not finite"),
        ("dof rx ry rz", "dof rx ry rw", 29, "bad dof"),
        ("           (-60.0 70.0)\n", "", 30, "expected 3 pairs"),
        ("(-60.0 70.0)", "(70.0 -60.0)", 30, "above"),
        ("  end\n:hier", ":hier", 34, "no end"),
        ("hip thigh", "hip thig", 45, "not declared: thig"),
        ("    hip thigh\n", "", 23, "do not hang on the root: thigh, shin"),
        ("thigh shin\n", "thigh shin hip\n", 46, "two bones"),
        ("root hip\n    hip thigh\n    thigh shin", "hip thigh\n    thigh shin\n    shin hip", 16, "root"),
        (ASF[ASF.index(":hierarchy") :], "", 41, "hierarchy is missing"),
    ],
)
def test_mistakes_in_asf_have_a_line(file: Path, old: str, new: str, line: int, message: str) -> None:
    """Each mistake in an ASF is a FormatError at its line."""
    path = file.with_name("s.asf")
    path.write_text(ASF.replace(old, new, 1))
    with pytest.raises(FormatError, match=message) as caught:
        formats.load(file)
    assert caught.value.line == line and caught.value.path == path
