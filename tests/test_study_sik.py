"""The study of Sequential IK writes what it says, and its numbers are those of its postures."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure as Canvas
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from independent import world_matrices
from sixpoint import Figure, Limits, Motion, SequentialIK, make_sample
from sixpoint.cli import main
from sixpoint.errors import FormatError
from sixpoint.jobs.sik_study.clips import CLIPS, find_recording, run_clip
from sixpoint.jobs.sik_study.job import PICTURES, REPORT, SikStudy, study_sik
from sixpoint.study.sik_figures import limits as sik_limits
from sixpoint.study.sik_figures.hierarchy import _lay_out
from sixpoint.study.sik_figures.samples import choose_samples


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the study is."""
    return tmp_path_factory.mktemp("place") / "a" / "sik"


@pytest.fixture(scope="module")
def study(folder: Path) -> SikStudy:
    """The study, run once."""
    said = []
    done = study_sik(folder, progress=lambda *report: said.append(report[1:]))
    assert said[0][0] == 0
    assert said[-1][0] == said[-1][1]
    assert [a for a, _ in said] == sorted(a for a, _ in said)
    return done


@pytest.fixture(scope="module")
def text(study: SikStudy, folder: Path) -> str:
    """The report on one line."""
    return " ".join((folder / REPORT).read_text("utf-8").split())


def joints(motion: Motion, *names: str) -> list[np.ndarray]:
    """Places (F, 3) of joints by matrices."""
    places, _ = world_matrices(motion)
    return [places[:, motion.skeleton.names.index(name)] for name in names]


def length(v: np.ndarray) -> np.ndarray:
    return np.linalg.norm(v, axis=-1)


def between(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Angles [degrees] of vectors (F, 3)."""
    return np.degrees(np.arccos(np.clip((u * v).sum(-1) / length(u) / length(v), -1, 1)))


def test_files_are_written(study, folder):
    """Eight pictures and the report that shows them, and nothing else; small, and without a NaN."""
    assert sorted(p.name for p in folder.iterdir()) == sorted([*PICTURES, REPORT])
    assert sorted(study.files) == sorted(folder.iterdir())
    lines = (folder / REPORT).read_text("utf-8").splitlines()
    assert all(any(f"({name})" in line for line in lines) for name in PICTURES)
    assert sum(p.stat().st_size for p in folder.iterdir()) < 1.6e6
    assert not any("nan" in line for line in lines)
    assert max(len(line) for line in lines if line[:1] != "|") <= 110


def test_spine_has_the_asked_chords(study, text):
    """Pelvis and head are where they are known to be; what the straight trunk lacks is shared by both."""
    case = study.spine
    pelvis, head = joints(case.motion, "humanoid_root", "skullbase")
    asked, chords = length(case.goals[:, 1] - case.goals[:, 0]), length(head - pelvis)
    np.testing.assert_allclose(case.asked, asked)
    np.testing.assert_allclose(case.chords, chords)
    np.testing.assert_allclose(chords[1:], asked[1:], atol=1e-6)
    np.testing.assert_allclose(np.stack([pelvis, head], 1)[1:], case.goals[1:], atol=1e-6)
    np.testing.assert_allclose(np.stack([pelvis, head])[..., 0], 0, atol=1e-9)
    assert np.all(np.diff(asked) < 0)
    missed = np.stack([length(pelvis - case.goals[:, 0]), length(head - case.goals[:, 1])], axis=1)
    assert missed[0, 0] == pytest.approx(missed[0, 1], abs=1e-9)
    assert chords[0] + missed[0].sum() == pytest.approx(asked[0], abs=1e-9)
    for name, a, c in zip(case.names, asked, chords, strict=True):
        assert f"| {name} | {100 * a:.2f} | {100 * c:.2f} |" in text


def test_spine_bends_evenly_until_limits_stop_it(study):
    """Joints between pelvis and head turn by one angle (Eq. 1), measured between the segments they join."""
    case, figure = study.spine, study.figure
    segments = np.diff(np.stack(joints(case.motion, "humanoid_root", *case.joints, "skullbase")), axis=0)
    rest = figure.spine_chain.segments
    turned = np.arctan2(segments[..., 2], segments[..., 1]) - np.arctan2(rest[:, 2], rest[:, 1])[:, None]
    turns = np.abs(np.diff(turned, axis=0)).T
    np.testing.assert_allclose(case.bends, turns, atol=1e-9)
    assert np.ptp(turns[2:5], axis=1).max() < 1e-6
    assert turns[4].min() > 0.2
    assert np.all(case.bends <= case.allowed + 1e-6)
    assert np.ptp(turns[-1]) > 0.1, "in the deepest posture some joints stand at their limits"


def test_clavicle_brings_the_shoulder_within_reach(study, text):
    """With the clavicle free, shoulder and goal are exactly the arm's length apart; held, it misses."""
    case = study.clavicle
    base, shoulder, elbow, wrist = joints(
        case.motion, "l_sternoclavicular", "l_shoulder", "l_elbow", "l_wrist"
    )
    reach = length(elbow - shoulder) + length(wrist - elbow)
    gaps, misses = length(case.goal - shoulder), length(case.goal - wrist)
    np.testing.assert_allclose(reach, case.reach)
    np.testing.assert_allclose(gaps, case.gaps)
    assert gaps[0] == pytest.approx(reach[0] + 0.06)
    assert gaps[1] == pytest.approx(reach[1], abs=1e-9)
    assert misses[0] == pytest.approx(0.06)
    assert misses[1] < 1e-6
    np.testing.assert_allclose(base[0], base[1], atol=1e-12)
    angle = between(shoulder[:1] - base[:1], shoulder[1:] - base[1:])[0]
    assert np.degrees(case.angle) == pytest.approx(angle)
    assert 10 < angle < np.degrees(case.limit) <= 40.0 + 1e-9
    assert f"turns by {angle:.1f}°" in text
    assert f"misses by {100 * misses[0]:.1f} cm" in text


def test_limb_angles_follow_from_the_lengths(study, text):
    """Law of cosines; at every swivel the same triangle, its elbow on a circle about shoulder and wrist."""
    case = study.limb
    shoulder, elbow, wrist = joints(case.motion, "r_shoulder", "r_elbow", "r_wrist")
    l1, l2, d = length(elbow - shoulder)[0], length(wrist - elbow)[0], length(case.goal - shoulder[0])
    psi = np.degrees(np.arccos((l1**2 + d**2 - l2**2) / (2 * l1 * d)))
    flexion = 180 - np.degrees(np.arccos((l1**2 + l2**2 - d**2) / (2 * l1 * l2)))
    np.testing.assert_allclose(between(elbow - shoulder, case.goal - shoulder), psi, atol=1e-6)
    np.testing.assert_allclose(between(elbow - shoulder, wrist - elbow), flexion, atol=1e-6)
    np.testing.assert_allclose(np.degrees([case.psi, case.flexion]), [psi, flexion], atol=1e-6)
    np.testing.assert_allclose(wrist, np.tile(case.goal, (len(wrist), 1)), atol=1e-9)
    centre = shoulder[0] + l1 * np.cos(np.radians(psi)) * (case.goal - shoulder[0]) / d
    np.testing.assert_allclose(length(elbow - centre), case.radius)
    assert length(elbow[:, None] - elbow[None])[np.triu_indices(len(elbow), 1)].min() > 0.1
    assert f"ψ = {psi:.1f}°" in text
    assert f"φ = {flexion:.1f}°" in text


@pytest.mark.parametrize("name", ["shoulder", "hip"])
def test_drawn_curve_passes_through_the_knots(study, name):
    """The line is SciPy's cubic spline with the end slopes of Eq. 3 through the knots of the table."""
    theta, psi = np.array(tomllib.loads(Limits.text())[name]["swing"], float).T
    slope = np.diff(psi) / np.diff(theta)
    end = (slope[0] + slope[-1]) / 2
    spline = CubicSpline(theta, psi, bc_type=((1, end), (1, end)))
    axes = Canvas().add_subplot()
    sik_limits._draw_curves(axes, {name: getattr(study.limits, name)})
    free, curve, knots = (np.array(line.get_data()).T for line in axes.get_lines()[:3])
    np.testing.assert_allclose(knots, np.stack([theta, psi], axis=1), atol=1e-9)
    np.testing.assert_allclose(np.interp(theta, *curve.T), psi, atol=1e-9)
    np.testing.assert_allclose(free[:, 1], spline(free[:, 0]), atol=1e-6)
    np.testing.assert_allclose(curve[:, 1], np.clip(spline(curve[:, 0]), psi.min(), psi.max()), atol=1e-6)


def test_report_lists_the_knots(text):
    """The table of the report is the shipped one."""
    table = tomllib.loads(Limits.text())
    for (theta, shoulder), (same, hip) in zip(table["shoulder"]["swing"], table["hip"]["swing"], strict=True):
        assert theta == same
        assert f"| {theta} | {shoulder} | {hip} |" in text


def test_arm_stops_at_the_curve(study):
    """The upper arm keeps its direction theta, and its swing is the spline's value there."""
    case = study.limits
    shoulder, elbow = joints(case.motion, "l_shoulder", "l_elbow")
    way = (elbow - shoulder) / length(elbow - shoulder)[:, None]
    psi = np.degrees(np.arccos(-way[:, 1]))
    theta = np.degrees(np.arctan2(way[:, 0], way[:, 2]))
    knots = np.array(tomllib.loads(Limits.text())["shoulder"]["swing"], float).T
    slope = np.diff(knots[1]) / np.diff(knots[0])
    end = (slope[0] + slope[-1]) / 2
    spline = CubicSpline(*knots, bc_type=((1, end), (1, end)))
    np.testing.assert_allclose(np.abs(theta), np.abs(np.degrees(case.asked[:, 0])), atol=1e-4)
    np.testing.assert_allclose(psi, spline(theta), atol=1e-4)
    assert np.all(psi < np.degrees(case.asked[:, 1]) - 10)


def test_clips_are_measured_again(study, text):
    """Position error by matrices, and how many frames reach their points."""
    assert [run.source for run in study.clips] == ["boxing", "jump_kick", "climb_and_hang"]
    for run in study.clips:
        truth = make_sample(run.source, study.figure)
        solved = SequentialIK(study.figure, weights=run.clip.weights).solve_frames(
            study.figure.targets(truth)
        )
        counted = [n for n in run.errors.joints if n != "(sacroiliac)"]
        off = length(np.stack(joints(truth, *counted), 1) - np.stack(joints(solved.motion, *counted), 1))
        off = np.concatenate([off[:, :1], off], axis=1)
        error = np.sqrt(np.mean((off.mean(axis=1) / study.figure.height) ** 2))
        np.testing.assert_allclose(run.errors.position, error)
        points = ("humanoid_root", "skullbase", "l_wrist", "r_wrist", "l_ankle", "r_ankle")
        gaps = length(np.stack(joints(solved.motion, *points), 1) - np.stack(joints(truth, *points), 1))
        assert run.reached == np.all(gaps <= 0.01, axis=1).sum()
        assert run.missed_frames == (gaps > 0.01).sum(axis=0).max()
        assert f"| {run.frames} at {run.rate:g} Hz | {error:.4f} |" in text
        assert f"{100 * off.mean():.1f} cm off on average" in text


def test_samples_are_unlike_each_other():
    """Samples are in order, all different, and do not depend on where a clip is or faces."""
    figure = Figure.from_stature(1.75)
    motion = make_sample("jump_kick", figure)
    chosen = choose_samples(figure, motion, 5)
    assert len(set(chosen)) == 5
    assert chosen == sorted(chosen)
    assert len(choose_samples(figure, motion.sliced(slice(0, 3)), 5)) == 3
    turn = Rotation.from_euler("y", 70, degrees=True)
    rotations = motion.rotations.copy()
    rotations[:, 0] = (turn * Rotation.from_quat(rotations[:, 0])).as_quat()
    places = turn.apply(np.array(motion.translations[:, 0])) + [3, 0, 1]
    moved = Motion(motion.skeleton, rotations, places[:, None], 60.0)
    assert choose_samples(figure, moved, 5) == chosen


def test_tree_has_every_joint_at_a_place_of_its_own(study):
    """Children are one level below their parent, and leaves keep apart."""
    at, parents = _lay_out(study.figure), study.figure.skeleton.parents
    assert len({(round(x, 6), y) for x, y in at}) == len(parents) == 34
    np.testing.assert_array_equal(at[1:, 1], at[parents[1:], 1] + 1)
    for level in range(int(at[:, 1].max()) + 1):
        across = np.sort(at[at[:, 1] == level, 0])
        assert np.diff(across).min(initial=1.0) > 0.05


def test_a_folder_that_is_not_empty_is_refused(study, folder):
    """Nothing is written over without force, and a file is no folder."""
    before = {p: p.stat().st_mtime_ns for p in folder.iterdir()}
    with pytest.raises(FormatError, match="--force"):
        study_sik(folder)
    with pytest.raises(FormatError, match="folder"):
        study_sik(folder / REPORT)
    assert before == {p: p.stat().st_mtime_ns for p in folder.iterdir()}


def test_a_missing_recording_is_named_before_any_work(tmp_path):
    """The error names the file and where it can be had; nothing is made."""
    with pytest.raises(FormatError, match=r"17_10\.amc.*mocap\.cs\.cmu\.edu.*sixpoint data cmu 17_10"):
        study_sik(tmp_path / "out", data=tmp_path)
    (tmp_path / "17_10.amc").touch()
    with pytest.raises(FormatError, match=r"90_05_repaired\.bvh"):
        study_sik(tmp_path / "out", data=tmp_path)
    assert not (tmp_path / "out").exists()


def test_recordings_are_found_where_they_are_kept(tmp_path):
    """Side by side as they are fetched, else in paper/, where the kick has an added T-pose."""
    (tmp_path / "paper").mkdir()
    (tmp_path / "paper" / "90_05_repaired.bvh").touch()
    assert find_recording(None, CLIPS[1]) is None
    assert find_recording(tmp_path, CLIPS[1]) == (tmp_path / "paper" / "90_05_repaired.bvh", 1)
    (tmp_path / "90_05.amc").touch()
    assert find_recording(tmp_path, CLIPS[1]) == (tmp_path / "90_05.amc", 0)


@pytest.mark.parametrize("clip", CLIPS, ids=[clip.trial for clip in CLIPS])
def test_recordings_come_out_as_in_the_paper(data, clip, tmp_path):
    """Position errors are within 3 % of those of Table 1."""
    run = run_clip(clip, find_recording(data, clip), Figure.from_stature(1.75), tmp_path)
    assert run.frames == {"17_10": 2783, "90_05": 513, "01_03": 4510}[clip.trial]
    assert run.errors.position == pytest.approx(clip.paper[0], rel=0.03)
    assert (tmp_path / clip.picture).stat().st_size > 2e4


def test_command(study, tmp_path, monkeypatch, capsys):
    """The command prints the tables and where the files are; mistakes are one line."""
    asked = []
    monkeypatch.setattr(
        "sixpoint.jobs.sik_study.job.study_sik", lambda out, **options: asked.append((out, options)) or study
    )
    monkeypatch.chdir(tmp_path)
    assert main(["study", "sik"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    for word in ("stretched", "jump_kick", "written to study/sik/", *PICTURES, REPORT):
        assert word in out
    assert main(["study", "sik", "--data", "d", "--out", "o", "--force"]) == 0
    assert [(str(o), str(x["data"]), x["force"]) for o, x in asked] == [
        ("study/sik", "None", False),
        ("o", "d", True),
    ]
    capsys.readouterr()
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    Path("x").mkdir()
    Path("x/y").touch()
    for words, hint in ((["--out", "x"], "--force"), (["--data", "x"], "17_10.amc")):
        assert main(["study", "sik", *words]) == 2
        err = capsys.readouterr().err
        assert (err.count("\n"), hint in err) == (1, True)
