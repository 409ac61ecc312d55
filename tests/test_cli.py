"""The command line: what it writes, what it says, and that nothing a user does ends in a traceback."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import sixpoint as sp
from sixpoint.cli import main
from sixpoint.solvers.registry import DEFAULT

SNAKE = """HIERARCHY
ROOT a
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT b
  {
    OFFSET 0 1 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 1 0
    }
  }
}
MOTION
Frames: 1
Frame Time: 0.0083333
0 0 0 0 0 0 0 0 0
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording, its six points and a rig that is not human."""
    folder = tmp_path_factory.mktemp("files")
    motion = sp.make_sample("walk").sliced(slice(0, 40))
    sp.save(motion, folder / "walk.bvh")
    sp.save_targets(sp.Figure.from_motion(motion).targets(motion), folder / "walk.csv")
    (folder / "snake.bvh").write_text(SNAKE)
    return folder


@pytest.fixture
def place(files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A current folder that holds copies of the files."""
    for path in files.iterdir():
        shutil.copy(path, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a command line."""
    capsys.readouterr()
    code = main(words)
    out, err = capsys.readouterr()
    assert "Traceback" not in out + err
    return code, out, err


def test_demo_writes_files_and_refuses_to_overwrite_them(tmp_path, monkeypatch, capsys):
    """The demo writes four files a clip, and a second run needs --force."""
    monkeypatch.chdir(tmp_path)
    code, out, _ = run(capsys, "demo", "--sample", "walk", "--stature", "1.6")
    assert code == 0
    written = sorted(path.name for path in (tmp_path / "demo").iterdir())
    assert written == ["walk.png", "walk_points.csv", "walk_result.bvh", "walk_truth.bvh"]
    assert "walk" in out
    assert "us/frame" in out
    assert "next:" in out
    code, _, err = run(capsys, "demo", "--sample", "walk")
    assert (code, err.count("\n")) == (2, 1)
    assert "--force" in err
    assert run(capsys, "demo", "--sample", "walk", "--force", "--no-limits")[0] == 0


def test_reconstruct_keeps_rig_and_frames(place, capsys):
    """A recording is reconstructed on its own rig, frame for frame, and measured."""
    code, out, _ = run(capsys, "reconstruct", "walk.bvh")
    assert code == 0
    truth, result = sp.load("walk.bvh"), sp.load("walk_sik+.bvh")
    assert result.skeleton.names == truth.skeleton.names
    assert len(result) == len(truth)
    assert result.rate == truth.rate
    np.testing.assert_allclose(result.skeleton.offsets[1:], truth.skeleton.offsets[1:], atol=1e-5)
    for word in ("position error", "orientation error", "us per frame", "found by names", "skullbase"):
        assert word in out


def test_the_default_method_is_sik_plus(place, capsys):
    """Without --method the result is that of `sik+`, byte for byte; `sik` with weights is another."""
    assert run(capsys, "reconstruct", "walk.bvh", "-o", "x.bvh")[0] == 0
    assert run(capsys, "reconstruct", "walk.bvh", "-o", "y.bvh", "--method", DEFAULT)[0] == 0
    assert Path("x.bvh").read_bytes() == Path("y.bvh").read_bytes()
    assert run(capsys, "reconstruct", "walk.bvh", "--method", "sik", "--weights", "1,1,0")[0] == 0
    assert Path("walk_sik.bvh").read_bytes() != Path("x.bvh").read_bytes()


def test_reconstruct_slices_frames(place, capsys):
    """--frames takes a Python slice, also one that starts with a minus."""
    for text, count in (("1:", 39), ("::2", 20), ("-1", 1), ("7", 1)):
        assert run(capsys, "reconstruct", "walk.bvh", "-o", "x.bvh", "--frames", text, "--force")[0] == 0
        assert len(sp.load("x.bvh")) == count


def test_reconstruct_points_with_a_stature(place, capsys):
    """Six points alone are posed on the built-in figure, whose stature is said aloud."""
    code, out, _ = run(capsys, "reconstruct", "walk.csv", "--stature", "1.6", "-o", "x.bvh")
    assert code == 0
    assert "1.6 m tall" in out
    assert "position error" not in out
    assert "1.75 m tall" in run(capsys, "reconstruct", "walk.csv")[1]
    assert len(sp.load("x.bvh")) == len(sp.load("walk_sik+.bvh")) == 40


def test_reconstruct_points_on_a_rig(place, capsys):
    """Six points are posed on the rig of --skeleton; AMC output has its ASF beside it."""
    assert run(capsys, "reconstruct", "walk.csv", "--skeleton", "walk.bvh", "-o", "x.amc")[0] == 0
    assert len(sp.load("x.amc")) == 40
    assert Path("x.asf").exists()


def test_reconstruct_lost_points(place, capsys):
    """Gaps in the targets are no error: the frames are reported."""
    targets = sp.load_targets("walk.csv")
    points = targets.positions.copy()
    points[5:15, 3] = np.nan
    sp.save_targets(sp.Targets(points, targets.rate), "gaps.csv")
    code, out, _ = run(capsys, "reconstruct", "gaps.csv")
    assert code == 0
    assert "10 with lost points" in out
    assert "r_wrist in 10 frames" in out
    sp.save_targets(sp.Targets(np.full_like(points, np.nan), targets.rate), "nothing.csv")
    code, out, _ = run(capsys, "reconstruct", "nothing.csv")
    assert code == 0
    assert "nothing tracked" in out


def test_reconstruct_draws_a_picture_and_copies_extras(place, capsys):
    """--picture and --extras work with a recording."""
    assert run(capsys, "reconstruct", "walk.bvh", "--picture", "x.png", "--extras")[0] == 0
    assert Path("x.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("reconstruct absent.bvh", "no such file"),
        ("reconstruct absent.amc", "no such file"),
        ("reconstruct .", "folder"),
        ("reconstruct a.fbx", "Blender"),
        ("reconstruct a.txt", ".csv"),
        ("reconstruct [red]a.bvh", "[red]a.bvh"),
        ("reconstruct walk.bvh --frames x", "start:stop:step"),
        ("reconstruct walk.bvh --frames ::0", "start:stop:step"),
        ("reconstruct walk.bvh --frames 1000:", "there are 40"),
        ("reconstruct walk.bvh --method magic", "methods: sik"),
        ("reconstruct walk.bvh --weights 1,1,0", "'sik+' has no option weights; sik, tgbsik"),
        ("reconstruct walk.bvh --weights 1,1,0", "add --method sik"),
        ("reconstruct walk.bvh --search literal", "add --method sik"),
        ("reconstruct walk.bvh --method pik --weights 1,1,0", "add --method sik"),
        ("reconstruct walk.bvh --weights 1,2", "three numbers"),
        ("reconstruct walk.bvh --weights 1,2,x", "three numbers"),
        ("reconstruct walk.bvh --method sik --weights 0,0,0", "three numbers"),
        ("reconstruct walk.bvh --search slow", "literal"),
        ("reconstruct walk.bvh --limits absent.toml", "absent.toml"),
        ("reconstruct walk.bvh --avoid knees", "elbows, forearms"),
        ("reconstruct walk.bvh --avoid elbows --method dls", "sik, sik+"),
        ("reconstruct walk.bvh --mapping absent.toml", "absent.toml"),
        ("reconstruct walk.bvh --limits a.toml --no-limits", "exclude"),
        ("reconstruct walk.bvh --stature 1.7", "its own rig"),
        ("reconstruct walk.bvh --skeleton walk.bvh", ".amc"),
        ("reconstruct walk.bvh --unit parsec", "units"),
        ("reconstruct walk.bvh --rate 0", "rate"),
        ("reconstruct walk.bvh -o walk.bvh", "--force"),
        ("reconstruct walk.bvh -o x.csv", "convert"),
        ("reconstruct walk.bvh -o none/x.bvh", "does not exist"),
        ("reconstruct walk.bvh --picture x.svg", ".png"),
        ("reconstruct walk.csv --extras", "recording"),
        ("reconstruct walk.csv --picture x.png", "recording"),
        ("reconstruct walk.csv --stature 17", "metres"),
        ("reconstruct walk.csv --stature 1.7 --skeleton walk.bvh", "exclude"),
        ("reconstruct walk.csv --skeleton walk.csv", "rig"),
        ("reconstruct walk.csv --mapping x.toml", "--skeleton"),
        ("reconstruct snake.bvh", "not found"),
        ("reconstruct", "FILE"),
        ("reconstruct walk.bvh --speed", "--speed"),
        ("reconstruct walk.bvh -o walk.bvh --force", "being read"),
        ("reconstruct walk.csv --unit cm", "metres and Y up"),
        ("reconstruct walk.csv --stature 0", "metres"),
        ("convert walk.bvh walk.bvh --force", "being read"),
        ("convert walk.csv x.npz --up z", "metres and Y up"),
        ("convert walk.csv x.bvh", "reconstruct"),
        ("convert walk.bvh x.png", "formats"),
        ("convert walk.bvh x", "suffix"),
        ("convert walk.bvh x.csv --out-unit cm", "metres"),
        ("convert snake.bvh x.csv", "not found"),
        ("info absent.csv", "no such file"),
        ("demo --sample waltz", "boxing"),
        ("demo --stature 17", "metres"),
        ("demo --out walk.bvh", "folder"),
        ("waltz", "reconstruct"),
    ],
)
def test_mistakes_are_one_line(place, capsys, words, said):
    """Every mistake ends in exit code 2 and one line that helps, and writes nothing."""
    before = sorted(place.iterdir())
    code, _, err = run(capsys, *words.split())
    assert code == 2
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert said in err
    assert sorted(place.iterdir()) == before


def test_convert_motion_round_trip(place, capsys):
    """BVH to AMC and back keeps the motion."""
    assert run(capsys, "convert", "walk.bvh", "x.amc")[0] == 0
    assert run(capsys, "convert", "x.amc", "y.bvh", "--out-unit", "m", "--out-up", "z")[0] == 0
    truth, back = sp.load("walk.bvh"), sp.load("y.bvh")
    assert back.space.up == "z"
    assert back.space.unit == 1.0
    np.testing.assert_allclose(back.positions, truth.positions, atol=1e-4)


def test_convert_points_round_trip(place, capsys):
    """A motion's six points survive CSV and NPZ."""
    assert run(capsys, "convert", "walk.bvh", "x.csv", "--frames", "10:")[0] == 0
    assert run(capsys, "convert", "x.csv", "y.npz")[0] == 0
    motion = sp.load("walk.bvh")
    points = sp.Figure.from_motion(motion).targets(motion).positions[10:]
    np.testing.assert_allclose(sp.load_targets("y.npz").positions, points, atol=1e-6)
    assert sp.load_targets("x.csv").rotations is None
    assert run(capsys, "convert", "walk.bvh", "z.npz", "--rotations")[0] == 0
    assert sp.load_targets("z.npz").rotations is not None


def test_info_prints_roles(place, capsys):
    """Info names the joints of the roles, and how they and the unit were found."""
    code, out, _ = run(capsys, "info", "walk.bvh", "--tree")
    assert code == 0
    for word in ("40 frames at 60 Hz", "(0.01 m), guessed", "by names", "left l_knee, right r_knee", "vl5"):
        assert word in out


def test_info_of_a_rig_that_is_not_human(place, capsys):
    """A motion without a human is no error: info says what is missing."""
    code, out, _ = run(capsys, "info", "snake.bvh")
    assert code == 0
    assert "no human figure" in out
    assert "l_hip" in out


def test_info_of_targets(place, capsys):
    """Info of six points gives the tracked share and the range of each."""
    code, out, _ = run(capsys, "info", "walk.csv")
    assert code == 0
    assert out.count("100.0 %") == 6


def test_mapping_names_the_joints_of_an_unusual_rig(place, capsys):
    """A mapping helps where names say nothing."""
    text = Path("walk.bvh").read_text()
    for word in ("l_hip", "l_knee", "l_ankle"):
        text = text.replace(f"JOINT {word}\n", f"JOINT odd{word[2:]}\n")
    Path("odd.bvh").write_text(text)
    Path("map.toml").write_text('l_hip = "oddhip"\nl_knee = "oddknee"\nl_ankle = "oddankle"\n')
    code, out, _ = run(capsys, "info", "odd.bvh", "--mapping", "map.toml")
    assert code == 0
    assert "left oddknee" in out
    assert run(capsys, "reconstruct", "odd.bvh", "--mapping", "map.toml")[0] == 0


def test_interrupt_is_quiet(place, capsys, monkeypatch):
    """Ctrl-C ends with one line and exit code 130."""

    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sixpoint.jobs.info.inspect", interrupt)
    code, _, err = run(capsys, "info", "walk.bvh")
    assert (code, err) == (130, "error: interrupted\n")


def test_reader_warnings_are_one_line(place, capsys):
    """A warning of a reader is one line on stderr, without code around it."""
    text = Path("walk.bvh").read_text().replace("Frames: 40", "Frames: 39")
    Path("more.bvh").write_text(text)
    code, _, err = run(capsys, "info", "more.bvh")
    assert code == 0
    assert err.startswith("warning: more.bvh:")
    assert err.count("\n") == 1


def test_compilation_is_announced(place, capsys, monkeypatch):
    """A first run says why it takes a moment."""
    monkeypatch.setattr("sixpoint.solvers.six_points.solver.is_cached", lambda name: False)
    code, _, err = run(capsys, "reconstruct", "walk.bvh")
    assert (code, err) == (0, "note: compiling kernels, once (about ten seconds)\n")


def shell(*words: str, **env: str) -> subprocess.CompletedProcess[str]:
    """A command line in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "sixpoint", *words], capture_output=True, text=True, env={**os.environ, **env}
    )


def test_program_prints_version_and_help():
    """Version and help need no file, and piped output has no colour codes."""
    assert shell("--version").stdout.strip() == sp.__version__
    done = shell("reconstruct", "--help")
    assert done.returncode == 0
    assert "sixpoint reconstruct 17_10.amc" in done.stdout
    assert "\x1b" not in done.stdout


def test_program_exits_2_and_debug_shows_the_traceback(tmp_path):
    """A mistake ends the process with 2; SIXPOINT_DEBUG=1 shows where it was noticed."""
    done = shell("info", str(tmp_path / "absent.bvh"))
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "Traceback" in shell("info", str(tmp_path / "absent.bvh"), SIXPOINT_DEBUG="1").stderr
