"""What a comparison is made of: clips and methods, from the command line or from a study file (TOML)."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

from sixpoint.body.tables import read_table
from sixpoint.errors import FormatError, SixpointError, listed
from sixpoint.formats import MOTION_SUFFIXES
from sixpoint.jobs.compare.methods import METHODS, Method
from sixpoint.jobs.compare.splits import find_person
from sixpoint.jobs.reading import parse_frames
from sixpoint.solvers.registry import PERSON
from sixpoint.solvers.six_points.solver import check_weights
from sixpoint.study.comparison.claims import CLAIMS
from sixpoint.study.comparison.model import SPLITS, Reference

MOTIONS = tuple(suffix for suffix in MOTION_SUFFIXES if suffix != ".asf")
RECORDINGS = (
    ".bvh",
    ".amc",
)  # what a folder is searched for: a .glb there may be a character that stands still
CLIP_KEYS = (
    *("name", "file", "files", "skeleton", "frames", "weights", "sample", "window", "mapping", "note"),
    *("person", "split"),
)
TOO_MANY = 500  # files of a folder: more were hardly meant


@dataclass(frozen=True)
class Clip:
    """A recording to compare on.

    Attributes:
        name: Short and unique in the study.
        file: The motion.
        skeleton: The .asf of an .amc; None to look beside it.
        frames: Which frames, as Python slices them; empty for all.
        weights: Of the pelvis estimate; None for the methods' own.
        sample: Frame that is drawn large, counted within ``frames``; None to choose one.
        window: Part of the curves that is drawn large, as first frame and end.
        mapping: TOML table of roles for an unusual rig.
        note: What a reader should know of it.
        person: Whom it shows, as "cmu/14"; empty where that is not known.
        split: "train", "development" or "test"; empty: whether a method was fitted on the person decides.
    """

    name: str
    file: Path
    skeleton: Path | None = None
    frames: str = ""
    weights: tuple[float, float, float] | None = None
    sample: int | None = None
    window: tuple[int, int] | None = None
    mapping: Path | None = None
    note: str = ""
    person: str = ""
    split: str = ""


@dataclass(frozen=True)
class Study:
    """A whole comparison to be made.

    Attributes:
        title: What is compared.
        clips: On what.
        methods: What.
        limits: Whether joint limits hold.
        reference: Published numbers to stand beside.
        claims: Name of a set of statements to test; empty for none.
    """

    title: str
    clips: tuple[Clip, ...]
    methods: tuple[Method, ...]
    limits: bool = True
    reference: Reference | None = None
    claims: str = ""


@dataclass(frozen=True)
class _Entry:
    """A table of the study file that knows where it is, for messages."""

    path: Path
    where: str
    table: Mapping[str, Any] = field(default_factory=dict)

    def check(self, known: Sequence[str]) -> None:
        unknown = [key for key in self.table if key not in known]
        if unknown:
            raise self.error(f"unknown: {listed(unknown)}; known: {listed(known)}")

    def error(self, message: str) -> FormatError:
        return FormatError(self.path, f"{self.where}: {message}" if self.where else message)

    def get(self, key: str, kind: type | tuple[type, ...], default: Any = None) -> Any:
        value = self.table.get(key, default)
        if value is not None and (
            not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool)
        ):
            names = " or ".join(k.__name__ for k in (kind if isinstance(kind, tuple) else (kind,)))
            raise self.error(f"{key} must be {names}, got {value!r}")
        return value

    def tables(self, key: str) -> list[_Entry]:
        found = self.table.get(key, [])
        if not isinstance(found, list) or not all(isinstance(row, dict) for row in found):
            raise self.error(f"{key} must be a list of tables")
        return [_Entry(self.path, f"{self.where}{key} {k + 1}", row) for k, row in enumerate(found)]

    def numbers(self, key: str, count: int, kind: Callable[[Any], Any]) -> tuple[Any, ...] | None:
        value = self.get(key, list)
        if value is None:
            return None
        if len(value) != count or not all(isinstance(v, int | float) for v in value):
            raise self.error(f"{key} must be {count} numbers, got {value!r}")
        return tuple(kind(v) for v in value)


def shipped_studies() -> list[str]:
    """Names of the studies that ship with sixpoint."""
    folder = resources.files("sixpoint.studies")
    return sorted(item.name[:-5] for item in folder.iterdir() if item.name.endswith(".toml"))


def find_study(name: str) -> Path:
    """The file of a study: one that ships with sixpoint, by name, or a user's own.

    Raises:
        SixpointError: There is neither.
    """
    path = Path(name)
    if path.suffix == ".toml" and path.is_file():
        return path
    if path.stem in shipped_studies() and path.parent == Path():
        return Path(str(resources.files("sixpoint.studies").joinpath(f"{path.stem}.toml")))
    raise SixpointError(f"no study {name!r}: give a TOML file, or one of {listed(shipped_studies())}")


def read_study(path: Path, data: Path | None = None) -> Study:
    """Read a study file.

    Args:
        path: The TOML file.
        data: Folder that the clips' files are relative to; by default the study's own, of a shipped study the
            current folder.

    Raises:
        FormatError: The file cannot be read, or says something that makes no sense; the message says where.
        SixpointError: Files of clips are not there; the message lists them and how to get them.
    """
    entry = _Entry(path, "", read_table(path))
    entry.check(("title", "methods", "limits", "claims", "clips", "reference"))
    shipped = path.parent == Path(str(resources.files("sixpoint.studies")))
    folder = data if data is not None else Path() if shipped else path.parent
    clips, missing = [], []
    for row in entry.tables("clips"):
        found = _read_clip(row, folder)
        if isinstance(found, Clip):
            clips.append(found)
        else:
            missing += [f"{found} (clip {row.get('name', str)!r})"]
    if missing:
        raise SixpointError(_say_missing(missing, folder))
    if not clips:
        raise entry.error("a study needs at least one [[clips]]")
    _check_names(entry, [clip.name for clip in clips])
    methods = _read_methods(entry)
    limits = entry.get("limits", bool, True)
    claims = entry.get("claims", str, "")
    if claims and claims not in CLAIMS:
        raise entry.error(f"no claims named {claims!r}; there are: {listed(CLAIMS)}")
    return Study(
        entry.get("title", str) or path.stem,
        tuple(clips),
        methods,
        limits,
        _read_reference(entry),
        claims,
    )


def study_of_files(
    files: Sequence[Path], frames: str = "", weights: tuple[float, float, float] | None = None, **options: Any
) -> Study:
    """A study of motion files, and of all motions in folders, with the methods' presets.

    Args:
        files: Motions and folders.
        frames: Which frames of each.
        weights: Of the pelvis estimate, for all.
        **options: Further attributes of ``Clip``.

    Raises:
        FormatError, SixpointError: A file or folder is not there, or holds no motion.
    """
    paths: list[Path] = []
    for file in files:
        paths += _motions_in(file) if file.is_dir() else [file]
    paths = list(dict.fromkeys(path.resolve() for path in paths))
    for path in paths:
        if not path.is_file():
            raise FormatError(path, "there is no such file")
        if path.suffix.lower() not in MOTIONS:
            raise FormatError(path, f"a clip is a motion; formats: {listed(MOTIONS)}")
    if not paths:
        raise SixpointError("no clips: give motion files or folders, or a study with --study")
    stems = [path.stem for path in paths]
    names = [
        stem if stems.count(stem) == 1 else f"{path.parent.name}/{path.name}"
        for stem, path in zip(stems, paths, strict=True)
    ]
    for k, name in enumerate(names):
        if name in names[:k]:
            names[k] = f"{name} ({k + 1})"
    clips = [
        Clip(name, path, frames=frames, weights=weights, person=find_person(path), **options)
        for name, path in zip(names, paths, strict=True)
    ]
    title = f"Comparison on {len(clips)} clips" if len(clips) > 1 else f"Comparison on {names[0]}"
    return Study(title, tuple(clips), tuple(METHODS.values()))


def _motions_in(folder: Path) -> list[Path]:
    found = sorted(p for p in folder.rglob("*") if p.suffix.lower() in RECORDINGS and p.is_file())
    if not found:
        raise FormatError(folder, f"no motions in this folder; formats: {listed(RECORDINGS)}")
    if len(found) > TOO_MANY:
        raise FormatError(folder, f"{len(found)} motions are below this folder; give fewer, one by one")
    return found


def _read_clip(row: _Entry, folder: Path) -> Clip | str:
    """The clip, or the names of its files where none is there."""
    row.check(CLIP_KEYS)
    if ("file" in row.table) == ("files" in row.table):
        raise row.error("a clip has either file = '...' or files = [{ file = '...' }, ...]")
    sources = row.tables("files") if "files" in row.table else [_Entry(row.path, row.where, row.table)]
    wanted = []
    for source in sources:
        if source.table is not row.table:
            source.check(("file", "skeleton", "frames", "note"))
        name = source.get("file", str)
        if not name:
            raise source.error("file is missing")
        wanted.append(name)
        file = folder / name
        if not file.is_file():
            continue
        skeleton, mapping = source.get("skeleton", str), row.get("mapping", str)
        frames = source.get("frames", str) or row.get("frames", str) or ""
        if frames:
            parse_frames(frames)
        weights = row.numbers("weights", 3, float)
        return Clip(
            row.get("name", str) or file.stem,
            file,
            folder / skeleton if skeleton else None,
            frames,
            None if weights is None else check_weights(weights),
            row.get("sample", int),
            row.numbers("window", 2, int),
            folder / mapping if mapping else None,
            source.get("note", str) or row.get("note", str) or "",
            _read_person(row) or find_person(file),
            _read_split(row),
        )
    return " or ".join(wanted)


def _read_person(row: _Entry) -> str:
    person = row.get("person", str) or ""
    if person and not PERSON.fullmatch(person):
        raise row.error(f"person must be a name such as 'cmu/14', got {person!r}")
    return str(person)


def _read_split(row: _Entry) -> str:
    split = row.get("split", str) or ""
    if split and split not in SPLITS:
        raise row.error(f"split must be one of {listed(SPLITS)}, got {split!r}")
    return str(split)


def _say_missing(missing: Sequence[str], folder: Path) -> str:
    where = "this folder" if folder == Path() else str(folder)
    text = f"not found in {where}: {listed(missing)}; say with --data where they are"
    trials = sorted({t for name in missing for t in re.findall(r"\b\d{2,3}_\d{2}\b", name)})
    if trials:
        text += f", or fetch them: sixpoint data cmu {' '.join(trials)}, then --data data/cmu"
    return text


def _check_names(entry: _Entry, names: Sequence[str]) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise entry.error(f"two clips have the same name: {listed(twice)}")


def _read_methods(entry: _Entry) -> tuple[Method, ...]:
    rows = entry.get("methods", list)
    if rows is None:
        return tuple(METHODS.values())
    methods = []
    for k, row in enumerate(rows):
        if isinstance(row, str):
            methods.append(Method.named(row))
            continue
        if not isinstance(row, dict) or not isinstance(row.get("solver"), str):
            raise entry.error(
                f"method {k + 1} must be a name, or a table with solver = '...' and its options"
            )
        options = {key: value for key, value in row.items() if key not in ("name", "solver")}
        method = Method.named(row["solver"], str(row.get("name", row["solver"])), options)
        methods.append(method)
    _check_names(entry, [method.name for method in methods])
    if not methods:
        raise entry.error("methods is empty")
    return tuple(methods)


def _read_reference(entry: _Entry) -> Reference | None:
    table = entry.get("reference", dict)
    if table is None:
        return None
    row = _Entry(entry.path, "reference", table)
    row.check(("name", "position", "orientation", "milliseconds"))
    columns = []
    for key in ("position", "orientation", "milliseconds"):
        column = row.get(key, dict, {})
        for clip, numbers in column.items():
            if not isinstance(numbers, dict) or not all(isinstance(v, int | float) for v in numbers.values()):
                raise row.error(f"{key}.{clip} must be a table of numbers, one per method")
        columns.append(column)
    return Reference(row.get("name", str) or "reference", *columns)
