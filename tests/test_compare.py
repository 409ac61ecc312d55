"""Comparing methods: studies, the results file, resuming, and what happens when something fails."""

from __future__ import annotations

import csv
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sixpoint as sp
from independent import world_matrices
from sixpoint.cli import main
from sixpoint.jobs.compare import job
from sixpoint.jobs.compare.job import compare
from sixpoint.jobs.compare.methods import METHODS, Method, choose_methods
from sixpoint.jobs.compare.study import find_study, read_study, shipped_studies, study_of_files
from sixpoint.study.comparison.model import Row
from sixpoint.study.comparison.results import COLUMNS, rows_from_csv, rows_to_csv

FIGURE = sp.Figure.from_stature(1.75)
HEIGHT = float(np.median(FIGURE.targets(sp.make_sample("boxing", FIGURE)).positions[:40, 2, 1]))
OWN = f'''
import sixpoint as sp

HEIGHT = {HEIGHT}

class Own(sp.SequentialIK):
    """Sequential IK by another name."""

class Fails:
    def __init__(self, figure):
        raise RuntimeError("no licence")

class Licensed(sp.SequentialIK):
    def __init__(self, figure):
        import pathlib
        if not pathlib.Path("licence").exists():
            raise RuntimeError("no licence")
        super().__init__(figure)

class Least:
    """Only what is needed."""

    def __init__(self, figure):
        self._inner = sp.SequentialIK(figure)

    def solve(self, points, previous=None, dt=1 / 60):
        return self._inner.solve(points, previous, dt)

class Stumbles(sp.SequentialIK):
    """Cannot solve frames that begin with a raised hand."""

    def solve_frames(self, targets, progress=None):
        raise ValueError("not all at once")

    def solve(self, points, previous=None, dt=1 / 60):
        if points[2][1] > HEIGHT:
            raise ValueError("too high")
        return super().solve(points, previous, dt)
'''


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """A folder with two short recordings and a module of methods, which is the current one."""
    for name, frames in (("boxing", slice(0, 40)), ("walk", slice(0, 30))):
        sp.save(sp.make_sample(name, FIGURE).sliced(frames), tmp_path / f"{name}.bvh")
    (tmp_path / "own_methods.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    sys.modules.pop("own_methods", None)


@pytest.fixture
def undrawn(monkeypatch) -> list[object]:
    """The comparisons that would have been drawn."""
    drawn: list[object] = []

    def write(comparison, out, progress):
        drawn.append(comparison)
        for name in job.REPORT:
            (out / name).write_text("report")
        return []

    monkeypatch.setattr(job, "write_report", write)
    return drawn


def study_of(folder: Path, methods: str = "sik,kma", *names: str):
    files = [folder / f"{name}.bvh" for name in names or ("boxing", "walk")]
    return replace(study_of_files(files), methods=choose_methods(methods))


# --- running -------------------------------------------------------------------------------------


def test_rows_hold_what_other_code_measures(folder, undrawn):
    """Errors, residuals and misses of a row are those of the same solver's motion, measured apart."""
    done = compare(study_of(folder), folder / "report")
    assert [(row.clip, row.method) for row in done.rows] == [
        (clip, method) for clip in ("boxing", "walk") for method in ("sik", "kma")
    ]
    for row in done.rows:
        truth = sp.load(folder / f"{row.clip}.bvh")
        figure = sp.Figure.from_motion(truth)
        result = sp.make_solver(row.method, figure).solve_motion(figure.targets(truth))
        errors = sp.compute_errors(figure, truth, result)
        assert row.position == pytest.approx(errors.position, rel=1e-12)
        assert row.orientation == pytest.approx(errors.orientation, rel=1e-12)
        assert row.position_p95 == pytest.approx(np.percentile(errors.position_curve, 95))
        r = figure.roles
        joints = [r.pelvis, r.head, *r.wrist, *r.ankle]
        there, here = (world_matrices(motion)[0][:, joints] for motion in (truth, result))
        gap = np.linalg.norm(here - there, axis=-1).max(axis=1)
        assert row.residual_max == pytest.approx(gap.max(), abs=1e-9)
        assert row.missed == pytest.approx(np.mean(gap > 0.01))
        assert row.frames == len(truth) and not row.error and row.failed_frames == 0
        assert 0 < row.batch_us < 2 * row.median_us and row.median_us <= row.p99_us
        assert row.options == "limits=True"


def test_a_second_run_measures_and_draws_nothing(folder, undrawn):
    """What is known is not measured again, and an up-to-date report is left alone."""
    first = compare(study_of(folder), folder / "report")
    before = (folder / "report/results.csv").read_bytes()
    second = compare(study_of(folder), folder / "report")
    assert (first.measured, second.measured) == (4, 0)
    assert (first.drawn, second.drawn) == (True, False) and len(undrawn) == 1
    assert (folder / "report/results.csv").read_bytes() == before
    assert rows_to_csv(first.rows) == rows_to_csv(second.rows)


def test_an_interrupted_run_goes_on(folder, undrawn):
    """After Ctrl-C in the middle only the rest is measured, and nothing is lost."""

    def stop(what, done, total):
        if what == "walk: sik":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        compare(study_of(folder), folder / "report", progress=stop)
    assert len(rows_from_csv(folder / "report/results.csv")) == 2
    assert not undrawn
    assert compare(study_of(folder), folder / "report").measured == 2
    assert len(undrawn) == 1


def test_an_interruption_before_the_first_row_leaves_a_folder_of_ours(folder, undrawn):
    """The next run goes on in it without force, also where a spreadsheet has saved the results."""

    def stop(what, done, total):
        raise KeyboardInterrupt

    out = folder / "report"
    with pytest.raises(KeyboardInterrupt):
        compare(study_of(folder), out, progress=stop)
    assert compare(study_of(folder), out).measured == 4
    (out / "results.csv").write_text("\ufeff" + (out / "results.csv").read_text(), "utf-8")
    assert compare(study_of(folder), out).measured == 0
    (out / "results.csv").unlink()
    assert compare(study_of(folder), out).measured == 0
    assert len(rows_from_csv(out / "results.csv")) == 4


def test_what_failed_is_tried_again(folder, undrawn):
    """A failure is no knowledge: once its cause is gone, the method has its row."""
    study = study_of(folder, "sik,own_methods:Licensed", "walk")
    assert compare(study, folder / "report").rows[1].error == "RuntimeError: no licence"
    (folder / "licence").touch()
    done = compare(study, folder / "report")
    assert done.measured == 1 and not done.rows[1].error


def test_damaged_curves_are_measured_again(folder, undrawn):
    """A cut file of curves costs its row, not the comparison."""
    out = folder / "report"
    compare(study_of(folder), out)
    victim = next((out / "runs").glob("*.npz"))
    victim.write_bytes(victim.read_bytes()[:100])
    assert compare(study_of(folder), out).measured == 1
    assert compare(study_of(folder), out).measured == 0


def test_clips_of_the_same_content_have_rows_of_their_own(folder, undrawn):
    """A copy of a clip is known at once, and stands in the results by its own name."""
    (folder / "copy.bvh").write_bytes((folder / "walk.bvh").read_bytes())
    done = compare(study_of(folder, "sik", "walk", "copy"), folder / "report")
    assert done.measured == 1
    assert [row.clip for row in rows_from_csv(folder / "report/results.csv")] == ["walk", "copy"]


def test_a_methods_own_options_win(folder, undrawn):
    """Limits and weights that a study gives to one method are that method's, and the row says so."""
    text = """
    [[clips]]
    file = "boxing.bvh"
    weights = [1, 1, 0]
    """
    free = '{ name = "free", solver = "sik", limits = false }'
    slow = '{ name = "slow", solver = "sik", weights = [0, 0.1, 1] }'
    study = read_study(write_study(folder, f'methods = ["sik", {free}, {slow}]' + text))
    sik, free, slow = compare(study, folder / "report").rows
    assert (sik.options, free.options) == ("limits=True weights=1,1,0", "limits=False weights=1,1,0")
    assert slow.options == "limits=True weights=0,0.1,1"
    assert len({sik.position, free.position, slow.position}) == 3


def test_a_method_needs_solve_alone(folder, undrawn):
    """Neither ``solve_frames`` nor ``warm_up`` nor ``figure`` is needed; there is no time of a batch then."""
    sik, least = compare(study_of(folder, "sik,own_methods:Least", "walk"), folder / "report").rows
    assert not least.error and least.failed_frames == 0
    assert least.position == pytest.approx(sik.position) and np.isnan(least.batch_us) and least.median_us > 0


def test_what_changed_is_measured_again(folder, undrawn):
    """A changed recording, another method, other options or weights are other rows; the old ones are kept."""
    out = folder / "report"
    compare(study_of(folder), out)
    sp.save(sp.make_sample("walk", FIGURE).sliced(slice(5, 35)), folder / "walk.bvh", force=True)
    assert compare(study_of(folder), out).measured == 2
    assert compare(study_of(folder, "sik,kma,ccd"), out).measured == 2
    assert compare(replace(study_of(folder), limits=False), out).measured == 4
    weighted = study_of_files([folder / "boxing.bvh"], weights=(1.0, 1.0, 0.0))
    assert compare(replace(weighted, methods=choose_methods("sik")), out).measured == 1
    assert len(rows_from_csv(out / "results.csv")) == 1  # of this study alone
    again = compare(study_of(folder), out)  # what was known is still known
    assert again.measured == 0 and rows_to_csv(again.rows) == (out / "results.csv").read_text()


def test_a_changed_module_is_measured_again(folder, undrawn):
    """Rows of a user's own method belong to its source."""
    study = study_of(folder, "own_methods:Own", "walk")
    assert compare(study, folder / "report").measured == 1
    assert compare(study, folder / "report").measured == 0
    (folder / "own_methods.py").write_text(OWN + "# changed\n")
    assert compare(study, folder / "report").measured == 1


def test_a_method_of_ones_own_is_compared(folder, undrawn):
    """``module:Class`` is a method like ours."""
    sik, own = compare(study_of(folder, "sik,own_methods:Own", "walk"), folder / "report").rows
    assert own.method == "Own" and own.position == pytest.approx(sik.position)


def test_a_failing_method_is_a_row(folder, undrawn):
    """A method that cannot be made says why in its row; the others have theirs."""
    study = study_of(folder, "own_methods:Fails,sik", "walk")
    failed, sik = compare(study, folder / "report").rows
    assert failed.error == "RuntimeError: no licence" and failed.failed_frames == failed.frames == 30
    assert np.isnan(failed.position) and not sik.error
    assert set(undrawn[0].clips[0].runs) == {"sik"}


def test_failing_frames_are_counted_and_the_rest_is_measured(folder, undrawn):
    """A frame that raises keeps the pose before; the row says how many did."""
    row = compare(study_of(folder, "own_methods:Stumbles", "boxing"), folder / "report").rows[0]
    truth = sp.load(folder / "boxing.bvh")
    high = sp.Figure.from_motion(truth).targets(truth).positions[:, 2, 1] > HEIGHT
    assert 0 < row.failed_frames == high.sum() < 40
    assert not row.error and np.isfinite(row.position) and np.isnan(row.batch_us)


def test_a_clip_that_cannot_be_read_or_mapped_is_rows(folder, undrawn):
    """The comparison goes on with the other clips, and the rows say what was wrong."""
    (folder / "chair.bvh").write_text(
        "HIERARCHY\nROOT seat\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\n"
        "OFFSET 0 1 0\n}\n}\nMOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0\n"
    )
    (folder / "broken.bvh").write_text("HIERARCHY\n")
    done = compare(study_of(folder, "sik,kma", "chair", "walk", "broken"), folder / "report")
    errors = {row.clip: row.error for row in done.rows}
    assert "chair.bvh" in errors["chair"] or "l_hip" in errors["chair"]
    assert "broken.bvh" in errors["broken"] and errors["walk"] == ""
    assert [clip.name for clip in undrawn[0].clips] == ["walk"]
    with pytest.raises(sp.SixpointError, match=r"no method gave a result.*broken"):
        compare(study_of(folder, "sik", "broken"), folder / "other")


def test_a_clip_of_one_frame_is_compared(folder):
    """One frame has errors and a report, but no jerk, which needs four frames."""
    study = replace(study_of_files([folder / "walk.bvh"], "3"), methods=choose_methods("sik,ccd"))
    done = compare(study, folder / "report")
    assert [row.frames for row in done.rows] == [1, 1]
    assert all(np.isfinite(row.position) and np.isnan(row.jerk_ratio) for row in done.rows)
    assert all(file.stat().st_size > 500 for file in done.files)


# --- the folder and its results file ---------------------------------------------------------------


def test_a_foreign_folder_is_refused_and_left_alone(folder, undrawn):
    """A folder with other files is not written into without force, and then keeps them."""
    out = folder / "report"
    out.mkdir()
    (out / "thesis.txt").write_text("mine")
    with pytest.raises(sp.FormatError, match=r"not empty.*--force"):
        compare(study_of(folder), out)
    assert sorted(p.name for p in out.iterdir()) == ["thesis.txt"]
    compare(study_of(folder, "sik", "walk"), out, force=True)
    assert (out / "thesis.txt").read_text() == "mine" and (out / "results.csv").exists()
    with pytest.raises(sp.FormatError, match="this is a file"):
        compare(study_of(folder), folder / "walk.bvh")


def test_results_of_another_version_are_refused(folder, undrawn):
    """Neither another format number nor other columns are taken for ours; force begins again."""
    out = folder / "report"
    compare(study_of(folder, "sik", "walk"), out)
    text = (out / "results.csv").read_text()
    for changed in (text.replace("\n2,", "\n0,"), text.replace(",jerk_ratio,", ",jerkiness,")):
        (out / "results.csv").write_text(changed)
        with pytest.raises(sp.FormatError, match=r"another version.*--force"):
            compare(study_of(folder, "sik", "walk"), out)
    assert compare(study_of(folder, "sik", "walk"), out, force=True).measured == 1


@pytest.mark.parametrize(("old", "new"), [(",30,", ",thirty,"), (",30,", ",30,,")])
def test_a_damaged_line_is_named(folder, undrawn, old, new):
    """The message gives the file, the line and what helps."""
    out = folder / "report"
    compare(study_of(folder, "sik", "walk"), out)
    known = out / "runs/known.csv"
    known.write_text(known.read_text().replace(old, new, 1))
    with pytest.raises(sp.FormatError, match=r"known.csv:2: .*--force"):
        compare(study_of(folder, "sik", "walk"), out)


def test_rows_survive_the_file(tmp_path):
    """Numbers come back to the last bit, NaN as NaN, texts with commas, quotes and line ends whole."""
    rows = [
        Row('a, "b"', "sik", 3, 120.0, "k", "weights=1,1,0", position=0.1 + 0.2, limit_worst=1e-17),
        Row("c", "own", 0, float("nan"), error="no, never"),
    ]
    path = tmp_path / "results.csv"
    path.write_text(rows_to_csv(rows))
    again = rows_from_csv(path)
    assert rows_to_csv(again) == rows_to_csv(rows)
    assert again[0].position == 0.1 + 0.2 and again[0].clip == 'a, "b"' and np.isnan(again[1].rate)
    with path.open(newline="") as stream:
        table = list(csv.DictReader(stream))
    assert tuple(table[0]) == COLUMNS and table[1]["position"] == ""


# --- studies -------------------------------------------------------------------------------------


def write_study(folder: Path, text: str) -> Path:
    path = folder / "study.toml"
    path.write_text(text)
    return path


def test_a_study_file_says_clips_methods_and_numbers(folder):
    """Everything a study file may say arrives; of several files the first that is there is taken."""
    study = read_study(
        write_study(
            folder,
            """
            title = "Mine"
            limits = false
            methods = ["sik", { name = "soft", solver = "dls", damping = 0.3 }]
            [[clips]]
            name = "first"
            files = [{ file = "absent.amc" }, { file = "walk.bvh", frames = "2:20", note = "short" }]
            weights = [1, 1, 0]
            sample = 4
            window = [1, 9]
            [[clips]]
            file = "boxing.bvh"
            [reference]
            name = "Someone 2001"
            position = { first = { sik = 0.02 } }
            """,
        )
    )
    first, second = study.clips
    assert (study.title, study.limits) == ("Mine", False)
    assert (first.name, first.file.name, first.frames, first.note) == ("first", "walk.bvh", "2:20", "short")
    assert (first.weights, first.sample, first.window) == ((1.0, 1.0, 0.0), 4, (1, 9))
    assert (second.name, second.weights) == ("boxing", None)
    assert [m.name for m in study.methods] == ["sik", "soft"]
    assert study.methods[1].make(FIGURE, False, None).damping == 0.3
    assert study.reference.position["first"]["sik"] == 0.02


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("title = 'x", "not a TOML file"),
        ("titel = 'x'", "unknown: titel; known: title"),
        ("[[clips]]\nname = 'a'", "clips 1: a clip has either file"),
        ("[[clips]]\nfile = 'walk.bvh'\nweights = [1, 2]", "weights must be 3 numbers"),
        ("[[clips]]\nfile = 'walk.bvh'\nweights = [0, 0, 0]", "not all zero"),
        ("claims = 'x'\n[[clips]]\nfile = 'walk.bvh'", "no claims named 'x'; there are: unzueta2008"),
        ("[[clips]]\nfile = 'walk.bvh'\nframes = 'a:b'", "frames are start:stop:step"),
        ("[[clips]]\nfile = 'walk.bvh'\nspeed = 2", "clips 1: unknown: speed"),
        ("[[clips]]\nfile = 'walk.bvh'\n[[clips]]\nfile = 'walk.bvh'", "same name: walk"),
        ("[[clips]]\nfile = '17_10.amc'", "17_10.amc.*--data.*sixpoint data cmu 17_10"),
        ("methods = ['sick']\n[[clips]]\nfile = 'walk.bvh'", "no method named 'sick'; methods: sik, "),
        ("methods = [{solver='dls', dumping=1}]\n[[clips]]\nfile='walk.bvh'", "no option dumping.*damping"),
        ("methods = []\n[[clips]]\nfile='walk.bvh'", "methods is empty"),
        ("title = 'x'", "needs at least one"),
        ("clips = 3", "clips must be a list of tables"),
        ("limits = 'on'\n[[clips]]\nfile='walk.bvh'", "limits must be bool"),
        ("[[clips]]\nfile='walk.bvh'\n[reference.position]\na = 1", "position.a must be a table of numbers"),
    ],
)
def test_a_wrong_study_is_explained(folder, text, message):
    """The message says where it is wrong and what would work."""
    with pytest.raises(sp.SixpointError, match=message):
        read_study(write_study(folder, text))


def test_shipped_studies_are_found_by_name(data):
    """Those that ship can be read with the data folder, and name our methods but the hybrid."""
    assert set(shipped_studies()) == {"paper", "damping"}
    paper = read_study(find_study("paper"), data)
    assert [clip.name for clip in paper.clips] == ["boxing", "jump kick", "playground"]
    assert {method.name for method in paper.methods} == set(METHODS) - {"hybrid"}
    assert paper.reference.position["average"]["sik"] == 0.0246
    with pytest.raises(sp.SixpointError, match=r"no study 'papers'.*damping, paper"):
        find_study("papers")


def test_folders_and_equal_names_are_told_apart(folder):
    """A folder gives all its motions; clips of the same name are named by their folder too."""
    (folder / "more").mkdir()
    (folder / "more/walk.bvh").write_bytes((folder / "walk.bvh").read_bytes())
    names = [clip.name for clip in study_of_files([folder]).clips]
    assert len(set(names)) == 3 and "boxing" in names and "more/walk.bvh" in names
    (folder / "empty").mkdir()
    for bad, message in ((folder / "empty", "no motions"), (folder / "no.bvh", "no such file")):
        with pytest.raises(sp.FormatError, match=message):
            study_of_files([bad])
    with pytest.raises(sp.FormatError, match="a clip is a motion"):
        study_of_files([folder / "own_methods.py"])


def test_methods_are_chosen_by_name(folder):
    """``all`` is all of ours; own ones follow; unknown ones list what there is."""
    assert [m.name for m in choose_methods("all")] == list(sp.SOLVERS)
    assert [m.solver for m in choose_methods("kma, own_methods:Own")] == ["kma", "own_methods:Own"]
    for text, message in (
        ("sick", "methods: sik, sik\\+, sik-prior, tgbsik"),
        ("own_methods:Nothing", "no class or function 'Nothing'"),
        ("no_such_module:X", "cannot be imported"),
        ("", "no methods"),
    ):
        with pytest.raises(sp.SixpointError, match=message):
            choose_methods(text)
    assert Method.named("pik").options == {"tolerance": 0.01}


# --- the command ---------------------------------------------------------------------------------


def test_the_command_prints_a_table_and_where_the_report_is(folder, capsys):
    """One line per method, failures on stderr, and a page that opens."""
    assert main(["compare", "walk.bvh", "--methods", "sik,kma,own_methods:Fails", "-o", "r"]) == 0
    said = capsys.readouterr()
    assert "walk: 30 frames" in said.out and "kma" in said.out and "r/report.html" in said.out
    assert "no licence" in said.err
    page = (folder / "r/report.html").read_text()
    assert "no licence" in page and "http://" not in page.replace("http://www.w3.org", "")
    assert main(["compare", "walk.bvh", "--methods", "sik,kma,own_methods:Fails", "-o", "r"]) == 0
    assert "all 3 results were known" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "no clips: give motion files or folders"),
        (["walk.bvh", "--methods", "sick"], "methods: sik"),
        (["walk.bvh", "--study", "paper"], "either --study or files"),
        (["--study", "paper", "--frames", "1:"], "for clips"),
        (["walk.bvh", "--data", "."], "give --study too"),
        (["--study", "paper"], "sixpoint data cmu 01_03 17_10 90_05"),
        (["walk.bvh", "--weights", "1,2"], "three numbers"),
        (["walk.bvh", "--weights", "0,0,0"], "not all zero"),
        (["walk.bvh", "--no-limits", "--limits", "x.toml"], "exclude each other"),
        (["nothing.bvh"], "no such file"),
    ],
)
def test_a_wrong_command_line_says_what_would_work(folder, capsys, words, message):
    """An error is one line and exit code 2, before anything is written."""
    assert main(["compare", *words, "-o", "r"]) == 2
    assert message in capsys.readouterr().err
    assert not (folder / "r").exists()


# --- the paper -----------------------------------------------------------------------------------


def test_every_method_is_as_accurate_as_in_the_paper(data, tmp_path, undrawn):
    """On the paper's clips no average position error exceeds the printed one by more than 15 %."""
    study = read_study(find_study("paper"), data)
    done = compare(study, tmp_path / "report")
    printed = study.reference.position["average"]
    assert len(printed) == 9
    for method, error in printed.items():
        ours = np.mean([row.position for row in done.rows if row.method == method])
        assert ours < 1.15 * error, (method, ours)
    jt = [row.position for row in done.rows if row.method == "jt"]
    assert np.mean(jt) > max(np.mean([row.position for row in done.rows if row.method == m]) for m in printed)
    claims = undrawn[0].claims
    assert len(claims) >= 12 and any(claim.holds for claim in claims)
    clavicle = next(c for c in claims if c.text.startswith("Clavicles move more"))
    assert clavicle.holds
