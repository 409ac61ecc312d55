"""People that a method was fitted on are in no test row, and every table and picture says who they are."""

from __future__ import annotations

import ast
import csv
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sixpoint as sp
from sixpoint.cli import main
from sixpoint.jobs.compare.job import compare
from sixpoint.jobs.compare.methods import METHODS, choose_methods
from sixpoint.jobs.compare.report import build_document
from sixpoint.jobs.compare.splits import assign_splits, find_person
from sixpoint.jobs.compare.study import read_study, study_of_files
from sixpoint.study.comparison.averages import average, averaged_clips, clips_of
from sixpoint.study.comparison.model import Comparison, Row, is_fitted
from sixpoint.study.document import Heading, Picture, Table

FIGURE = sp.Figure.from_stature(1.75)
OWN = """
import sixpoint as sp

class Learned(sp.SequentialIK):
    fitted_on = ("cmu/02",)

class Wrong(sp.SequentialIK):
    fitted_on = WRONG
"""
CLIPS = {
    "02_01": ("walk", slice(0, 20)),
    "14_01": ("boxing", slice(0, 20)),
    "127_03": ("reach", slice(0, 20)),
}


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """Short recordings with the names of CMU files, and a method fitted on one of the people."""
    for name, (sample, frames) in CLIPS.items():
        sp.save(sp.make_sample(sample, FIGURE).sliced(frames), tmp_path / f"{name}.bvh")
    (tmp_path / "learned_methods.py").write_text(OWN.replace("WRONG", "()"))
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    sys.modules.pop("learned_methods", None)


def study_of(methods: str, *names: str):
    return replace(
        study_of_files([Path(f"{n}.bvh") for n in names or CLIPS]), methods=choose_methods(methods)
    )


def write_study(folder: Path, text: str) -> Path:
    (folder / "study.toml").write_text(text)
    return folder / "study.toml"


@pytest.mark.parametrize(
    ("name", "person"),
    [
        ("14_07.amc", "cmu/14"),
        ("02_05.bvh", "cmu/02"),
        ("127_07.AMC", "cmu/127"),
        ("90_05_repaired.bvh", "cmu/90"),
        ("walk.bvh", ""),
        ("take_14_07.bvh", ""),
        ("14_7.amc", ""),
        ("dataset-1_walk_01.bvh", ""),
    ],
)
def test_cmu_files_name_their_person(name, person):
    """The number before the take is the person, also of converted files; other names tell nothing."""
    assert find_person(Path("somewhere") / name) == person


def test_a_person_belongs_to_a_data_set():
    """Who names a data set means all its people; equal beginnings are not enough."""
    assert is_fitted("cmu/02", ["cmu/02"]) and is_fitted("cmu/02", ["mass", "cmu"])
    assert not is_fitted("cmu/127", ["cmu/12"]) and not is_fitted("cmu2/01", ["cmu"])
    assert not is_fitted("", ["cmu"]) and not is_fitted("cmu/02", [])


def test_no_test_row_is_of_a_person_a_method_was_fitted_on(folder):
    """A clip of such a person is a training clip for all methods; means are over the same other clips."""
    compare(study_of("sik,learned_methods:Learned"), folder / "r")
    with (folder / "r/results.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    split = {(row["clip"], row["method"]): (row["person"], row["split"]) for row in rows}
    for method in ("sik", "Learned"):
        assert split["02_01", method] == ("cmu/02", "train")
        assert split["14_01", method] == ("cmu/14", "test")
        assert split["127_03", method] == ("cmu/127", "test")
    text = (folder / "r/report.md").read_text()
    accuracy, apart = (text.split(f"## {title}\n")[1].split("\n## ")[0] for title in ("Accuracy", APART))
    assert "14_01" in accuracy and "02_01" not in accuracy
    assert "02_01" in apart and "14_01" not in apart
    cells = next(line for line in apart.splitlines() if line.startswith("| 02_01")).split("|")
    assert cells[2].strip() == "cmu/02"
    assert not cells[3].strip().endswith("*") and cells[4].strip().endswith("*")


APART = "Recordings used for fitting"


def comparison_of(fitted_on: dict[str, tuple[str, ...]], splits: dict[str, str]) -> Comparison:
    """Two methods on clips named by their person, with errors that tell clips and methods apart."""
    rows = tuple(
        Row(p, m, 9, 60.0, person=p, split=s, position=1.0 + k + 10 * (m == "b"), orientation=1.0)
        for k, (p, s) in enumerate(splits.items())
        for m in ("a", "b")
    )
    return Comparison("t", ("a", "b"), rows, (), fitted_on=fitted_on)


def test_only_test_clips_are_averaged():
    """The mean is that of the test rows; where there is none there is no mean."""
    made = comparison_of({}, {"x/1": "test", "x/2": "train", "x/3": "development", "x/4": "test"})
    assert averaged_clips(made) == ("x/1", "x/4") == clips_of(made, "test")
    assert (average(made, "a", "position"), average(made, "b", "position")) == (2.5, 12.5)
    assert np.isnan(average(comparison_of({}, {"x/1": "train"}), "a", "position"))


def test_every_table_and_picture_says_what_was_fitted(folder):
    """The people are named under each table and picture of a report, by data set."""
    study = study_of("kma,sik+,learned_methods:Learned", "14_01", "02_01")
    compare(study, folder / "r")
    said = "sik+ was fitted on cmu/02, 03, 05, 09, 11, 16, 29, 127. Learned was fitted on cmu/02."
    page = (folder / "r/report.md").read_text()
    before = page.split("\n## Methods\n")[0]
    pictures = len(re.findall(r"^!\[", before, re.MULTILINE))
    tables = len(re.findall(r"^\| ---", before, re.MULTILINE))
    assert pictures >= 4 and tables >= 6
    assert before.count(said) >= pictures + tables + 1  # and the summary
    assert "1 of 2 recordings, used for fitting, are in no average." in page
    assert "used for fitting: sik+, Learned was fitted on cmu/02; it is in no average" in page


def test_blocks_of_methods_that_were_not_fitted_say_nothing():
    """Where no method was fitted there is no word of it."""
    document = build_document(comparison_of({}, {"x/1": "test", "x/2": "test"}))
    assert not any("fitted" in repr(block) for block in document.blocks)
    document = build_document(comparison_of({"b": ("x/9",)}, {"x/1": "test", "": "test"}))
    notes = [block.note for block in document.blocks if isinstance(block, Table) and len(block.columns) > 2]
    assert notes and all("b was fitted on x/9." in note for note in notes)
    assert not any(isinstance(block, Picture) for block in document.blocks)
    assert "The person of 1 of 2 recordings is not known." in repr(document)


def test_without_the_fitted_method_its_people_test_again(folder):
    """Splits follow the methods that are compared; nothing is measured again for that."""
    compare(study_of("sik,learned_methods:Learned"), folder / "r")
    done = compare(study_of("sik"), folder / "r")
    assert done.measured == 0 and {row.split for row in done.rows} == {"test"}


def test_a_comparison_without_a_test_says_so(folder, capsys):
    """All recordings may be of people used for fitting: there is no mean then, but a report, and a word."""
    assert main(["compare", "02_01.bvh", "--methods", "sik,sik+", "-o", "r"]) == 0
    assert "02_01: 20 frames, used for fitting (person cmu/02): in no average" in capsys.readouterr().out
    text = (folder / "r/report.md").read_text()
    assert "No recording is left to test on." in text and f"## {APART}\n" in text
    assert "most accurate" not in text


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ("'cmu/02'", r"learned_methods:Wrong.*fitted_on must be a tuple.*'cmu/02'"),
        ("None", "fitted_on must be a tuple"),
        ("('02',)", r"names people as 'cmu/02', or a whole data set as 'mass', got '02'"),
        ("('cmu/02', 3)", "got 3"),
        ("('CMU 02',)", "got 'CMU 02'"),
        ("('cmu/',)", "got 'cmu/'"),
    ],
)
def test_a_wrong_declaration_is_explained(folder, capsys, wrong, message):
    """Before anything is measured: who declares, what is wrong, what would work."""
    (folder / "learned_methods.py").write_text(OWN.replace("WRONG", wrong))
    with pytest.raises(sp.SixpointError, match=message):
        choose_methods("learned_methods:Wrong")
    assert main(["compare", "14_01.bvh", "--methods", "learned_methods:Wrong", "-o", "r"]) == 2
    assert "fitted_on" in capsys.readouterr().err and not (folder / "r").exists()


def test_a_study_names_people_and_splits(folder):
    """What a study says of a clip is taken; what it does not say follows from file and methods."""
    text = """
    methods = ["sik", "learned_methods:Learned"]
    [[clips]]
    file = "14_01.bvh"
    person = "cmu/02"
    [[clips]]
    file = "127_03.bvh"
    split = "development"
    [[clips]]
    file = "02_01.bvh"
    person = "other/1"
    """
    study = read_study(write_study(folder, text))
    assert [clip.person for clip in study.clips] == ["cmu/02", "cmu/127", "other/1"]
    splits = assign_splits(study.clips, study.methods)
    assert splits == {"14_01": "train", "127_03": "development", "02_01": "test"}
    compare(study, folder / "r")
    page = (folder / "r/report.md").read_text()
    assert "## Recordings used for development\n" in page and f"## {APART}\n" in page


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("person = '14'", r"clips 1: person must be a name such as 'cmu/14', got '14'"),
        ("person = 14", "person must be str"),
        ("split = 'exam'", "split must be one of train, development, test, got 'exam'"),
    ],
)
def test_wrong_people_and_splits_are_explained(folder, text, message):
    """The message says which clip, and what would work."""
    with pytest.raises(sp.SixpointError, match=message):
        read_study(write_study(folder, f"[[clips]]\nfile = '14_01.bvh'\n{text}"))


@pytest.mark.parametrize("split", ["test", "development"])
def test_a_test_of_a_person_used_for_fitting_is_refused(folder, split):
    """A study that promises a test cannot be run with a method that has seen the person."""
    study = read_study(write_study(folder, f"[[clips]]\nfile = '02_01.bvh'\nsplit = '{split}'"))
    study = replace(study, methods=choose_methods("sik,learned_methods:Learned"))
    with pytest.raises(sp.SixpointError, match=r"02_01: split = .*Learned was fitted on cmu/02.*'train'"):
        compare(study, folder / "r")
    assert not (folder / "r").exists()
    assert compare(replace(study, methods=choose_methods("sik")), folder / "r").rows[0].split == split


def test_sik_plus_declares_whom_its_constants_were_chosen_on():
    """The same people as in the benchmark that chose them; the prior has seen them and the dancers."""
    text = (Path(__file__).parents[1] / "benchmarks" / "tune_sik_plus.py").read_text("utf-8")
    subjects = ast.literal_eval(re.search(r"^SUBJECTS = (\(.*?\))", text, re.MULTILINE)[1])
    assert METHODS["sik+"].fitted_on == tuple(f"cmu/{subject}" for subject in subjects)
    assert METHODS["sik-prior"].fitted_on == (*METHODS["sik+"].fitted_on, "mass")
    assert {name for name, method in METHODS.items() if method.fitted_on} == {
        "hybrid",
        "sik+",
        "sik-prior",
    }


def test_the_paper_s_clips_are_tests(data):
    """Nobody in them was used for fitting any of our methods, and the study insists."""
    from sixpoint.jobs.compare.study import find_study

    study = read_study(find_study("paper"), data)
    assert [clip.person for clip in study.clips] == ["cmu/17", "cmu/90", "cmu/01"]
    assert set(assign_splits(study.clips, study.methods).values()) == {"test"}
    assert all(clip.split == "test" for clip in study.clips)


def test_headings_of_split_tables_are_second_level():
    """The table of contents leads to them."""
    document = build_document(comparison_of({"b": ("x/2",)}, {"x/1": "test", "x/2": "train"}))
    assert Heading(APART) in document.blocks
