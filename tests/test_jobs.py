"""Jobs: what the command line calls, from Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sixpoint as sp
from sixpoint.jobs.convert import convert
from sixpoint.jobs.demo import demo
from sixpoint.jobs.info import MotionInfo, TargetsInfo, inspect
from sixpoint.jobs.progress import silent
from sixpoint.jobs.reading import Reading, open_motion, parse_frames
from sixpoint.jobs.reconstruct import finish, reconstruct
from sixpoint.jobs.solving import Solving, parse_weights
from sixpoint.jobs.writing import check_output


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    """A short recording."""
    sp.save(sp.make_sample("walk").sliced(slice(0, 30)), tmp_path / "walk.bvh")
    return tmp_path / "walk.bvh"


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("5", slice(5, 6)),
        ("-1", slice(-1, None)),
        ("-2", slice(-2, -1)),
        ("1:", slice(1, None)),
        (":", slice(None)),
        ("::2", slice(None, None, 2)),
        ("0:9:3", slice(0, 9, 3)),
    ],
)
def test_frames_are_python_slices(text, frames):
    """Frames read as Python would read them between brackets."""
    count = list(range(20))
    assert count[parse_frames(text)] == count[frames]


@pytest.mark.parametrize("text", ["", "a", "1.5", "1:2:3:4", "::0", "1-5"])
def test_wrong_frames_are_refused(text):
    """What is no slice is an error that shows one."""
    with pytest.raises(sp.SixpointError, match="0:600:2"):
        parse_frames(text)


@pytest.mark.parametrize("text", ["", "1", "1,2", "1,2,3,4", "a,b,c"])
def test_wrong_weights_are_refused(text):
    """Weights are exactly three numbers."""
    with pytest.raises(sp.SixpointError, match="three numbers"):
        parse_weights(text)


def test_solving_is_checked_before_files_are_read(tmp_path):
    """An impossible method is reported even where the file is missing too."""
    with pytest.raises(sp.SixpointError, match="methods: "):
        reconstruct(tmp_path / "absent.bvh", solving=Solving(method="magic"))


def test_output_is_checked_before_files_are_read(tmp_path):
    """A bad output is reported even where the input is missing too."""
    with pytest.raises(sp.FormatError, match="does not exist"):
        reconstruct(tmp_path / "absent.bvh", tmp_path / "none" / "x.bvh")


def test_a_folder_without_permission_is_found_before_the_work(tmp_path, monkeypatch):
    """Where nothing may be written is said before anything is read or solved."""
    monkeypatch.setattr("os.access", lambda path, mode: Path(path) != tmp_path)
    with pytest.raises(sp.FormatError, match="may not be written to"):
        reconstruct(tmp_path / "absent.bvh", tmp_path / "x.bvh")


def test_output_lists_all_files(tmp_path):
    """An AMC has an ASF, and an existing ASF is not overwritten."""
    out = tmp_path / "x.amc"
    assert check_output(out, (".amc",), False) == [out, tmp_path / "x.asf"]
    (tmp_path / "x.asf").write_text("")
    with pytest.raises(sp.FormatError, match=r"x\.asf"):
        check_output(out, (".amc",), False)


def test_reconstruct_agrees_with_the_library(walk):
    """The job gives what load, solve and compute_errors give."""
    done = reconstruct(walk, walk.with_name("out.bvh"))
    motion = sp.load(walk)
    figure = sp.Figure.from_motion(motion)
    result = sp.SequentialIKPlus(figure).solve_motion(figure.targets(motion))
    errors = sp.compute_errors(figure, motion, result)
    assert done.errors is not None
    assert done.errors.position == pytest.approx(errors.position, abs=1e-12)
    written = sp.load(done.files[0])
    np.testing.assert_allclose(written.positions, result.positions, atol=1e-4)
    assert written.space.unit == motion.space.unit


def test_progress_counts_every_frame(walk):
    """Progress ends at the number of frames."""
    told: list[tuple[str, int, int]] = []
    reconstruct(walk, walk.with_name("out.bvh"), progress=lambda *step: told.append(step))
    assert told[-1] == ("solving", 30, 30)
    silent("solving", 1, 2)


def test_extras_are_the_recording_s(walk):
    """Fingers, toes and face come from the recording, all else from the result."""
    truth = sp.load(walk)
    figure = sp.Figure.from_motion(truth)
    result = sp.SequentialIK(figure).solve_motion(figure.targets(truth))
    ends = figure.extremities
    assert ends
    shaken = truth.rotations.copy()
    shaken[:, ends] = [0.0, 0.6, 0.0, 0.8]
    extras = sp.Motion(truth.skeleton, shaken, truth.translations, truth.rate)
    done = finish(result, figure, truth, extras)
    rest = [j for j in range(len(truth.skeleton)) if j not in ends]
    np.testing.assert_array_equal(done.rotations[:, ends], shaken[:, ends])
    np.testing.assert_array_equal(done.rotations[:, rest], result.rotations[:, rest])


def test_a_solver_refuses_options_it_lacks(monkeypatch):
    """Options that a method does not have are named."""

    class Plain:
        def __init__(self, figure: sp.Figure) -> None:
            self.figure = figure

    monkeypatch.setitem(sp.SOLVERS, "plain", Plain)
    with pytest.raises(sp.SixpointError, match="weights"):
        Solving(method="plain", weights=(1, 1, 0)).check()


@pytest.mark.parametrize("method", ["sik+", "sik", "pik"])
def test_the_demo_gives_weights_to_methods_that_have_them(tmp_path, method):
    """The kick of `sik` has the paper's weights for kicks; other methods are shown as they are."""
    clip = demo(tmp_path, names=["jump_kick"], solving=Solving(method=method))[0]
    figure = sp.Figure.from_stature(1.75)
    truth = sp.make_sample("jump_kick", figure)
    options = {"weights": sp.FIGHTING} if method == "sik" else {}
    result = sp.make_solver(method, figure, **options).solve_motion(figure.targets(truth))
    assert clip.errors.position == pytest.approx(sp.compute_errors(figure, truth, result).position, abs=1e-12)


def test_inspect_tells_motions_from_targets(walk):
    """A motion has a figure, its six points have none."""
    found = inspect(walk)
    assert isinstance(found, MotionInfo)
    assert found.figure is not None
    assert found.figure.roles.found_by == "names"
    points = walk.with_name("walk.csv")
    convert(walk, points)
    assert isinstance(inspect(points), TargetsInfo)


def test_amc_finds_its_skeleton(walk):
    """The ASF beside an AMC is used, and known."""
    amc = walk.with_name("walk_1.amc")
    convert(walk, amc)
    amc.with_suffix(".asf").rename(walk.with_name("walk.asf"))
    opened = open_motion(amc, Reading(frames=slice(0, 5)))
    assert opened.skeleton == walk.with_name("walk.asf")
    assert opened.searched
    assert (len(opened.motion), len(opened.whole)) == (5, 30)
