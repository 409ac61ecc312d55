"""``sixpoint track`` from files to files, with a marker model that was saved."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

import sixpoint as sp
from marker_bodies import walking_markers
from sixpoint.body.limits import Limits
from sixpoint.body.markers.recording import Markers
from sixpoint.cli.app import main
from sixpoint.cli.batch import parse_job
from sixpoint.errors import Remark, SixpointError
from sixpoint.formats import load_shape
from sixpoint.formats.markers import save_markers
from sixpoint.jobs.marker_models import load_marker_model, save_marker_model
from sixpoint.jobs.solving import Solving
from sixpoint.jobs.track.feet import _is_still, find_stances, hold_feet
from sixpoint.jobs.track.job import track
from sixpoint.jobs.track.options import Following, parse_labels
from sixpoint.jobs.track.replay import replay
from sixpoint.jobs.track.report import describe_tracking
from sixpoint.jobs.writing import save_dressed
from sixpoint.live.frames import play_frames
from sixpoint.live.statistics import Statistics
from sixpoint.study.tracking import LOST, REFUSED, USED, draw_residuals, overall, summarise_markers
from track_bodies import body

FRAMES = 90


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A walk as C3D with a gap and a ghost, and the model of its markers."""
    folder = tmp_path_factory.mktemp("track")
    case = body("walk", noise=0.001)
    markers = case.markers[:FRAMES].copy()
    markers[20:40, 3] = np.nan
    markers[50:55, 9] += 0.3
    recording = Markers(case.model.names, markers, case.motion.rate, name="walk")
    save_markers(recording, folder / "walk.c3d")
    save_marker_model(case.model, folder / "model.toml")
    return folder / "walk.c3d", folder / "model.toml"


def following(files: tuple[Path, Path], **options: object) -> Following:
    return replace(Following(model=files[1]), **options)  # type: ignore[arg-type]


def test_a_recording_is_followed_and_written(files, tmp_path):
    """The BVH that is written has the joints where they were, within millimetres."""
    done = track(files[0], tmp_path / "walk.bvh", following=following(files))
    motion, truth = sp.load(tmp_path / "walk.bvh"), body("walk").motion
    names = [truth.skeleton.names[j] for j in body("walk").posed]
    ours = motion.positions[:, [motion.skeleton.names.index(name) for name in names]]
    theirs = truth.positions[:FRAMES, body("walk").posed]
    assert np.linalg.norm(ours - theirs, axis=-1).mean() < 5e-3
    assert np.sum(done.tracked.flags == REFUSED) == 5 and np.sum(done.tracked.flags == LOST) == 20


def test_the_command_says_what_became_of_the_markers(files, tmp_path, capsys):
    """Residuals worst first, gaps and ghosts are on the screen and in the report; nothing is overwritten."""
    words = ["track", str(files[0]), "--model", str(files[1]), "-o", str(tmp_path / "a.bvh")]
    words += ["--report", str(tmp_path / "report"), "--picture", str(tmp_path / "a.png")]
    assert main(words) == 0
    text = capsys.readouterr().out
    name = body("walk").model.names[9]
    assert re.search(rf"^{name} .* 5 +0$", text, re.M) and "5 (" + name in text and "times real time" in text
    report = (tmp_path / "report" / "report.md").read_text()
    assert name in report and (tmp_path / "report" / "pictures" / "residuals.png").stat().st_size > 10_000
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert main(words) == 2 and "exists" in capsys.readouterr().err


def test_the_person_is_saved_for_another_time(files, tmp_path):
    """A saved model is the one that was followed, and is not written over."""
    saved = tmp_path / "anna.toml"
    done = track(files[0], tmp_path / "a.bvh", following=following(files), save_model=saved)
    np.testing.assert_allclose(load_marker_model(saved).offsets, done.model.offsets, atol=1e-6)
    assert saved in done.files
    with pytest.raises(SixpointError, match="exists"):
        track(files[0], tmp_path / "b.bvh", following=following(files), save_model=saved)


def test_a_report_folder_in_use_is_refused_before_the_work(files, tmp_path):
    """Nothing is written where the report cannot be."""
    (tmp_path / "report").mkdir()
    (tmp_path / "report" / "mine.txt").write_text("mine")
    with pytest.raises(SixpointError, match="not empty"):
        track(files[0], tmp_path / "a.bvh", following=following(files), report=tmp_path / "report")
    assert not (tmp_path / "a.bvh").exists()


def test_joint_angles_are_written(files, tmp_path):
    """A .mot holds the knees' angles of every frame."""
    track(files[0], tmp_path / "walk.mot", following=following(files))
    assert "nRows=90" in (tmp_path / "walk.mot").read_text().replace(" ", "")


def test_a_dressed_body_is_written(files, tmp_path):
    """A .glb holds the motion and a surface, and is read again with the joints where they were."""
    done = track(files[0], tmp_path / "walk.glb", following=following(files))
    assert load_shape(tmp_path / "walk.glb") is not None
    motion = sp.load(tmp_path / "walk.glb")
    figure = done.model.figure
    ours = motion.positions[
        :, [motion.skeleton.names.index(figure.skeleton.names[j]) for j in body("walk").posed]
    ]
    assert np.abs(ours - done.tracked.motion.positions[:, body("walk").posed]).max() < 1e-3


def test_limits_of_ones_own_are_kept(files, tmp_path):
    """--limits FILE is taken as it is; without it limits that cost something are widened, which is said."""
    table = tmp_path / "limits.toml"
    table.write_text(re.sub(r"(?ms)(\[knee\].*?flexion = )\[[^]]*\]", r"\1[0, 20]", Limits.text()))
    tight = track(files[0], tmp_path / "a.bvh", following=following(files, limits_file=table))
    free = track(files[0], tmp_path / "b.bvh", following=following(files))
    assert not tight.widened and not free.widened
    kick = body("jump_kick")
    save_markers(Markers(kick.model.names, kick.markers, kick.motion.rate), tmp_path / "kick.npz")
    save_marker_model(kick.model, tmp_path / "kick.toml")
    wide = track(tmp_path / "kick.npz", tmp_path / "c.bvh", following=Following(model=tmp_path / "kick.toml"))
    assert wide.widened and "limits" in dict(describe_tracking(wide))
    figure = tight.model.figure
    bent = []
    for done in (tight, free):
        hip, knee, ankle = (done.tracked.motion.positions[:, j] for j in figure.roles.limbs[2])
        thigh, shank = knee - hip, ankle - knee
        cosine = (
            np.sum(thigh * shank, axis=-1) / np.linalg.norm(thigh, axis=-1) / np.linalg.norm(shank, axis=-1)
        )
        bent.append(np.degrees(np.arccos(cosine)).max())
    assert bent[0] < 21 and bent[1] > 40
    with pytest.raises(SixpointError, match="exclude each other"):
        track(files[0], tmp_path / "c.bvh", following=following(files, limits_file=table, limits=False))


def test_an_avatar_moves_as_the_person(files, tmp_path):
    """--avatar writes the avatar with its meshes; its hands are above its feet as the person's are."""
    hero = tmp_path / "hero.glb"
    save_dressed(
        sp.Figure.from_stature(1.2), sp.make_sample("walk", sp.Figure.from_stature(1.2)), hero, False
    )
    done = track(files[0], tmp_path / "moved.glb", following=following(files), avatar=hero)
    moved = sp.load(tmp_path / "moved.glb")
    assert done.avatar is not None and len(moved) == FRAMES and load_shape(tmp_path / "moved.glb") is not None
    with pytest.raises(SixpointError, match="an avatar is written as one of these"):
        track(files[0], tmp_path / "moved.mot", following=following(files), avatar=hero)


def test_notes_of_a_reader_are_notes(tmp_path, files, capsys):
    """A marker that is never seen is a plain note on the screen, no warning."""
    markers = body("walk").markers[:30].copy()
    markers[:, 3] = np.nan
    save_markers(Markers(body("walk").model.names, markers, 60.0, name="x"), tmp_path / "x.c3d")
    assert (
        main(["track", str(tmp_path / "x.c3d"), "--model", str(files[1]), "-o", str(tmp_path / "x.bvh")]) == 0
    )
    err = capsys.readouterr().err
    assert "note: " in err and "never seen: t10" in err and "arning" not in err


def test_a_recording_of_markers_is_shown(files, monkeypatch):
    """``sixpoint view FILE.c3d`` is the replay of ``track --view``; what tells who moves is refused."""
    from sixpoint.cli import view

    shown = []
    monkeypatch.setattr(view, "replay_markers", lambda screen, *words, **place: shown.append((words, place)))
    assert main(["view", str(files[0]), "--port", "8123"]) == 0
    assert shown[0][0][0] == files[0] and shown[0][0][3] and shown[0][1]["port"] == 8123
    assert main(["view", str(files[0]), "--stature", "1.8"]) == 2
    assert main(["view", str(files[0]), str(files[0])]) == 2 and len(shown) == 1


def test_six_points_of_markers(files, tmp_path):
    """The six points are the joints', within millimetres; any method poses by them."""
    done = track(files[0], tmp_path / "six.bvh", following=following(files), six=Solving("sik"))
    assert done.six is not None
    targets, _, borrowed = done.six
    case = body("walk")
    truth = case.model.figure.targets(case.motion).positions[:FRAMES]
    off = np.linalg.norm(targets.positions - truth, axis=-1)
    assert np.nanmean(off, axis=0).max() < 0.01 and np.isfinite(off).all()
    assert borrowed == ()


def test_feet_that_stand_are_held(files, tmp_path):
    """A standing ankle moves two fifths as much as without --lock-feet, but where holding fades in or out."""
    free = track(files[0], tmp_path / "a.bvh", following=following(files))
    held = track(files[0], tmp_path / "b.bvh", following=following(files, lock_feet=True))
    assert held.stances is not None
    stances = find_stances(free.model, free.tracked.motion)
    assert stances.any()
    drift = []
    for done in (free, held):
        ankles = done.tracked.motion.positions[:, done.model.figure.roles.ankle][..., [0, 2]]
        inner = binary_erosion(stances, np.ones((7, 1)))[1:]
        drift.append(np.linalg.norm(np.diff(ankles, axis=0), axis=-1)[inner].mean())
    assert drift[1] < 0.4 * drift[0]


def test_feet_that_creep_are_not_dragged_back():
    """A foot that stands for seconds, but creeps by 8 cm, is held within 2 cm of where it is."""
    case = body("walk")
    pose = case.motion.sliced(slice(0, 1))
    shift = np.zeros((240, 1, 3))
    shift[:, 0, 0] = np.linspace(0.0, 0.08, 240)
    root = np.flatnonzero(np.asarray(pose.skeleton.parents) < 0)[0]
    moved = np.repeat(pose.translations, 240, axis=0)
    moved[:, list(pose.moving).index(root)] += shift[:, 0]
    still = replace(pose, rotations=np.repeat(pose.rotations, 240, axis=0), translations=moved)
    markers = np.repeat(case.markers[:1], 240, axis=0) + shift
    held, stances = hold_feet(case.model, still, markers)
    moved_by = np.linalg.norm(held - markers, axis=-1)
    assert stances.mean() > 0.9 and 0.005 < moved_by.max() < 0.0201


def test_a_foot_that_turns_slowly_does_not_stand():
    """An ankle that moves by 0.2 m/s is slow enough for a contact, but nothing that stands."""
    still = np.zeros((60, 2, 3))
    creeping = still + 0.2 * np.arange(60)[:, None, None] / 60 * [1.0, 0.0, 0.0]
    assert _is_still(still, 4).all() and not _is_still(creeping, 4).any()


def test_frames_with_nobody_are_named(files, tmp_path):
    """The command says where nobody is seen; the curve of residuals has a gap there."""
    case = body("walk")
    positions = case.markers[:60].copy()
    positions[:10] = positions[30:41] = positions[59] = np.nan
    save_markers(Markers(case.model.names, positions, 60.0), tmp_path / "gaps.npz")
    done = track(tmp_path / "gaps.npz", tmp_path / "a.bvh", following=following(files))
    assert "frames 0 to 9, 30 to 40, 59:" in dict(describe_tracking(done))["nobody"]
    residual, flags = done.tracked.residual, done.tracked.flags
    rows = summarise_markers(done.model.names, residual, flags)
    canvas = draw_residuals(rows, residual, flags, 60.0, "")
    curve = canvas.axes[1].lines[0].get_ydata()
    assert np.isnan(curve[[0, 35, 59]]).all() and np.isfinite(curve[[10, 29, 41]]).all()


def test_a_choice_of_markers(files, tmp_path):
    """--markers follows these alone; an unknown one is an error that lists the others."""
    names = parse_labels("l_asis, r_asis,l_psis,r_psis,l_heel,l_toe,l_ankle")
    done = track(files[0], tmp_path / "a.bvh", following=following(files, markers=names))
    assert done.model.names == names and done.tracked.flags.shape == (FRAMES, 7)
    with pytest.raises(SixpointError, match="no marker KNEE in the model; there are: c7"):
        track(files[0], tmp_path / "b.bvh", following=following(files, markers=("KNEE",)))
    with pytest.raises(SixpointError, match=r"l_asis, r_asis: 2 of the model's 41 markers.*at least 3"):
        track(files[0], tmp_path / "b.bvh", following=following(files, markers=names[:2]))


def test_a_shipped_layout_goes_by_its_name(files, tmp_path, capsys, monkeypatch):
    """--layout takes markers24 as it takes a file; another name lists those that ship."""
    from sixpoint.jobs.batch import tracking

    monkeypatch.chdir(tmp_path)
    tracking.check({"layout": "markers24"})
    words = ["walk.c3d", "--layout"]
    assert parse_job("track", [*words, "markers24"])[1] == {"layout": "markers24"}
    assert parse_job("track", [*words, "mine.toml"])[1] == {"layout": Path("mine.toml")}  # known by content
    assert main(["track", str(files[0]), "--layout", "markers99"]) == 2
    assert "one that ships: markers24" in capsys.readouterr().err
    save_markers(walking_markers(120), tmp_path / "cmu.c3d")
    assert main(["track", "cmu.c3d", "--layout", "markers24", "-o", "a.bvh"]) == 0
    assert "over 24 markers" in capsys.readouterr().out


def test_what_excludes_each_other_is_said(files, tmp_path):
    """A model with a static trial, another's markers, and a cutoff of nothing are clear errors."""
    with pytest.raises(SixpointError, match="leave out --static"):
        track(files[0], tmp_path / "a.bvh", following=following(files, static=files[0]))
    with pytest.raises(SixpointError, match="cutoff"):
        track(files[0], tmp_path / "a.bvh", following=following(files, cutoff=0.0))
    stranger = Markers(("A", "B", "C"), np.random.default_rng(0).normal(0, 1, (5, 3, 3)), 100.0, name="x")
    save_markers(stranger, tmp_path / "x.npz")
    with pytest.raises(SixpointError, match="only 0 of the model's 41 markers"):
        track(tmp_path / "x.npz", tmp_path / "a.bvh", following=following(files))
    assert not (tmp_path / "a.bvh").exists()


def test_a_static_trial_of_other_labels_is_refused(tmp_path, capsys):
    """With too few labels in common the message names both files, labels of each, and what would work."""
    walk = walking_markers(20)
    save_markers(walk, tmp_path / "walk.c3d")
    others = replace(walk, names=tuple(f"P{k}" for k in range(len(walk.names))), name="x")
    two = replace(walk, names=(*walk.names[:2], *others.names[2:]), name="x")
    for static, said in ((others, "no label with a role"), (two, "only C7, T10 with a role")):
        save_markers(static, tmp_path / "other.c3d", force=True)
        words = [str(tmp_path / "walk.c3d"), "-o", str(tmp_path / "a.bvh")]
        assert main(["track", *words, "--static", str(tmp_path / "other.c3d")]) == 2
        err = " ".join(capsys.readouterr().err.split())
        assert said in err and f"{tmp_path / 'other.c3d'}: a static trial" in err
        assert "walk has C7, T10" in err and "P5" in err and "leave out the static trial" in err
    assert not (tmp_path / "a.bvh").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--live", "-o", "a.bvh", "--six"], "leave out --out, --six"),
        (["--view", "--report", "r", "--picture", "a.png"], "leave out --report, --picture"),
        (["--live", "--save-model", "a.toml", "--avatar", "a.glb"], "--save-model, --avatar"),
        (["--live", "--cutoff", "6", "--lock-feet"], "--cutoff, --lock-feet"),
        (["--method", "pik"], "--method pik says how six points are solved: add --six"),
    ],
)
def test_options_that_would_do_nothing_are_refused(files, words, said, tmp_path, monkeypatch, capsys):
    """A replay writes nothing, and a method is of the six points alone."""
    monkeypatch.chdir(tmp_path)
    assert main(["track", str(files[0]), "--model", str(files[1]), *words]) == 2
    assert said in " ".join(capsys.readouterr().err.split())
    assert not list(tmp_path.iterdir())


def test_a_recording_without_samples_says_so(files, tmp_path):
    """Frames with two markers are an error that says what a body needs."""
    names = body("walk").model.names
    positions = np.full((4, len(names), 3), np.nan)
    positions[:, :2] = body("walk").markers[:4, :2]
    empty = Markers(names, positions, 100.0, name="empty")
    save_markers(empty, tmp_path / "empty.npz")
    with (
        pytest.warns(Remark, match="never seen"),
        pytest.raises(SixpointError, match="no frame has three of the model's markers"),
    ):
        track(tmp_path / "empty.npz", tmp_path / "a.bvh", following=following(files))


def test_a_batch_follows_markers(files, tmp_path):
    """The job of a batch takes the command's options and tells what a summary needs."""
    from sixpoint.jobs.batch import tracking

    options = {"model": files[1], "frames": "0:30", "no_limits": True}
    tracking.check(options)
    told = tracking.run_one(files[0], tmp_path / "a.bvh", options)
    assert told["frames"] == 30 and told["residual"] < 0.005 and told["markers"] == 41
    with pytest.raises(SixpointError, match="no such file"):
        tracking.check({"model": tmp_path / "none.toml"})


def test_a_replay_keeps_the_pace(files):
    """Replayed live, every frame that is not left out is solved, and poses are those of a stream."""
    with replay(files[0], following=following(files)) as session:
        last = session.run()
        assert (
            last is not None
            and session.statistics.poses + session.statistics.counts["frames left out"] == FRAMES
        )


def test_a_late_loop_leaves_frames_out():
    """A solver slower than the frames skips to the newest, and is told the time that passed."""
    import time

    seen = []

    def slow(frame, previous, dt):
        time.sleep(0.03)
        seen.append((int(frame[0, 0]), dt))
        return 0

    frames = np.tile(np.arange(60.0)[:, None, None], (1, 2, 3))
    statistics = Statistics()
    play_frames(frames, 200.0, slow, statistics=statistics)
    assert len(seen) < 40 and statistics.counts["frames left out"] == 60 - len(seen)
    for (before, _), (now, dt) in zip(seen, seen[1:], strict=False):
        assert dt == pytest.approx((now - before) / 200.0)


def test_a_summary_counts_used_frames_alone():
    """RMS and worst come from used samples; markers never used are at the end."""
    residual = np.array([[0.01, 0.5, 0.0], [0.03, 0.02, 0.0]])
    flags = np.array([[USED, REFUSED, LOST], [USED, USED, LOST]])
    rows = summarise_markers(("a", "b", "c"), residual, flags)
    assert [row.name for row in rows] == ["a", "b", "c"]
    assert rows[0].rms == pytest.approx(np.sqrt(5e-4)) and rows[1].worst == 0.02 and rows[1].refused == 1
    assert np.isnan(rows[2].rms) and rows[2].seen == 0.0
    assert overall(residual, flags) == pytest.approx(np.sqrt((1e-4 + 9e-4 + 4e-4) / 3))
