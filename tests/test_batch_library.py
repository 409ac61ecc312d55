"""Which files a batch takes, what it calls them, and where their results go."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import sixpoint as sp
from sixpoint.jobs.batch.folder import MARKER, begin
from sixpoint.jobs.batch.library import find_files

KINDS = (".bvh", ".amc", ".csv")


@pytest.fixture
def library(tmp_path: Path) -> Path:
    """Files whose content does not matter."""
    root = tmp_path / "library"
    for name in ("17/a.amc", "17/17.asf", "18/a.amc", "18/deep/b.bvh", "notes.txt", "c[1].bvh"):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(name)
    return root


def names(root: Path, *patterns: str, out: Path | None = None) -> list[str]:
    """Names of the files that patterns take."""
    found = find_files([str(root / p) for p in patterns], KINDS, out or root.parent / "out")
    return [found.name(file) for file in found.files]


def test_patterns_are_those_of_a_shell(library):
    """Files are named from the folder where the wildcards begin, and sorted."""
    assert names(library, "**/*.amc") == ["17/a.amc", "18/a.amc"]
    assert names(library, "17/*.amc") == ["a.amc"]
    assert names(library, "*/a.*") == ["17/a.amc", "18/a.amc"]
    assert names(library, "") == ["17/a.amc", "18/a.amc", "18/deep/b.bvh", "c[1].bvh"]
    assert names(library, "c[1].bvh") == ["c[1].bvh"]
    assert names(library, "17/a.amc", "18/deep/*.bvh") == ["17/a.amc", "18/deep/b.bvh"]


def test_a_pattern_may_be_relative_or_of_the_home(library, monkeypatch):
    """Both become absolute, since workers may run elsewhere."""
    monkeypatch.chdir(library.parent)
    monkeypatch.setenv("HOME", str(library.parent))
    for pattern in ("library/*/a.amc", "~/library/*/a.amc"):
        assert all(path.is_absolute() for path in find_files([pattern], KINDS, Path("out")).files)


def test_names_with_brackets_are_names_before_they_are_patterns(tmp_path, monkeypatch):
    """A folder that is called ``take [1]`` may be the current one, or stand in a pattern."""
    folder = tmp_path / "take [1]"
    (folder / "a").mkdir(parents=True)
    (folder / "a" / "x.bvh").touch()
    monkeypatch.chdir(folder)
    for pattern in ("a/*.bvh", "../take [1]/**/*.bvh", str(folder / "*" / "x.*")):
        assert [file.name for file in find_files([pattern], KINDS, tmp_path / "out").files] == ["x.bvh"]
    with pytest.raises(sp.SixpointError, match="empty"):
        find_files([""], KINDS, tmp_path / "out")


def test_a_file_is_taken_once(library):
    """Two patterns, and links to files and folders, lead to one task; which is said."""
    (library / "18" / "again.amc").symlink_to(library / "17" / "a.amc")
    (library / "loop").symlink_to(library)
    found = find_files([str(library / "**/*.amc"), str(library / "17/*")], KINDS, library.parent / "out")
    assert len(found.files) == len({file.resolve() for file in found.files}) == 2
    assert any("links" in note for note in found.notes)
    assert any("1 .asf" in note for note in found.notes)


@pytest.mark.parametrize(
    ("pattern", "words"),
    [
        ("**/*.c3d", ["library", "2 .amc", "2 .bvh", "1 .txt"]),
        ("absent/**/*.amc", ["absent", "does not exist"]),
        ("17/*.AMC", ["17", "1 .amc"]),
        ("absent.amc", ["no such file"]),
        ("notes.txt", [".txt", ".bvh, .amc, .csv"]),
        ("*.txt", ["1 .txt", ".bvh, .amc, .csv"]),
    ],
)
def test_nothing_found_says_what_is_there(library, pattern, words):
    """The folder that was searched is named, with the suffixes in it."""
    with pytest.raises(sp.SixpointError) as error:
        names(library, pattern)
    assert all(word in str(error.value) for word in words), error.value


def test_no_pattern_is_an_error(tmp_path):
    """An example helps."""
    with pytest.raises(sp.SixpointError, match=r"library/\*\*"):
        find_files([], KINDS, tmp_path)


def test_results_are_never_taken(library):
    """Neither those of this batch nor those of another one are input, wherever they lie."""
    out, other = library / "out", library / "18" / "other"
    begin(other, "reconstruct", library, False)
    for folder in (out, other):
        (folder / "17").mkdir(parents=True)
        (folder / "17" / "a.bvh").write_text("a result")
    found = find_files([str(library)], KINDS, out)
    assert [found.name(f) for f in found.files] == ["17/a.amc", "18/a.amc", "18/deep/b.bvh", "c[1].bvh"]
    assert any("2 files that batches have written" in note for note in found.notes)


@pytest.mark.parametrize("out", ["library", "."])
def test_a_library_is_no_place_for_results(library, out):
    """Results in, or around, the library could be taken for its files."""
    with pytest.raises(sp.FormatError, match="choose a folder of its own"):
        names(library, "17/*.amc" if out == "." else "**/*.amc", out=library.parent / out)


def test_a_part_of_a_library_keeps_its_names(library):
    """A narrower pattern for the same folder goes on with it; a wider one would rename files."""
    out = library.parent / "out"
    begin(out, "reconstruct", library, False)
    assert names(library, "17/*.amc", out=out) == ["17/a.amc"]
    (library.parent / "x.bvh").touch()
    assert names(library.parent, "x.bvh", "library/17/*.amc", out=out) == ["library/17/a.amc", "x.bvh"]


STEM = st.sampled_from(["a", "A", "b", "a.b", "c d"])
FILES = st.sets(st.tuples(st.sampled_from(["", "x/", "x/y/"]), STEM, st.sampled_from(KINDS)), min_size=1)


@given(FILES)
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_results_never_meet(tmp_path_factory, files):
    """Equal names in two folders, and equal stems in one, have results of their own."""
    root = tmp_path_factory.mktemp("library")
    for folder, stem, suffix in files:
        (root / folder).mkdir(parents=True, exist_ok=True)
        (root / folder / f"{stem}{suffix}").touch()
    found = find_files([str(root)], KINDS, root.parent / "out")
    targets = [found.target(file, ".bvh", KINDS) for file in found.files]
    assert len(set(targets)) == len(targets) == len(files)
    for file, target in zip(found.files, targets, strict=True):
        assert Path(target).parent == Path(found.name(file)).parent
        assert file.stem in target


def test_the_folder_says_what_it_is_of(library):
    """Another job or library in the same folder is refused, a folder of something else too."""
    out = library.parent / "out"
    begin(out, "reconstruct", library, False)
    begin(out, "reconstruct", library, False)
    assert json.loads((out / MARKER).read_text())["library"] == str(library)
    with pytest.raises(sp.FormatError, match="batch of reconstruct, not of compare"):
        begin(out, "compare", library, False)
    with pytest.raises(sp.FormatError, match="another folder, or --force"):
        begin(out, "reconstruct", library / "17", False)
    with pytest.raises(sp.FormatError, match="not empty"):
        begin(library, "reconstruct", library, False)
    with pytest.raises(sp.FormatError, match="this is a file"):
        begin(library / "notes.txt", "reconstruct", library, False)
    begin(out, "compare", library, True)


def test_a_folder_that_cannot_be_written_is_said(library, monkeypatch):
    """A read-only place is found before anything is done."""

    def refuse(self: Path, *_: object, **__: object) -> None:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(Path, "mkdir", refuse)
    with pytest.raises(sp.FormatError, match="Read-only file system"):
        begin(library.parent / "out", "reconstruct", library, False)
