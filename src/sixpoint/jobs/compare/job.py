"""Compare methods on clips: a results file that an interrupted run continues, and a report made of it."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import sixpoint
from sixpoint.body.limits import Limits
from sixpoint.errors import SixpointError
from sixpoint.jobs.compare.keys import row_keys
from sixpoint.jobs.compare.methods import Method
from sixpoint.jobs.compare.report import write_report
from sixpoint.jobs.compare.run import OpenClip, failed_row, open_clip, run_method
from sixpoint.jobs.compare.splits import assign_splits
from sixpoint.jobs.compare.store import RESULTS, Store
from sixpoint.jobs.compare.study import Clip, Study
from sixpoint.jobs.digests import digest
from sixpoint.jobs.progress import Progress, silent
from sixpoint.study.comparison.claims import check_claims
from sixpoint.study.comparison.model import ClipRuns, Comparison, Row, Run
from sixpoint.study.comparison.results import rows_to_csv

REPORT = ("report.html", "report.md")
LIMITATIONS = (
    "Six positions do not tell the rotations of hands, feet and head, nor the pelvis' own yaw: all methods "
    "but sik+, sik-prior, hybrid, pik and pik-flext share one estimate of the pelvis, and its error.",
    "Methods are our own implementations with the presets above; where the papers are silent we chose, see "
    "docs/methods.md.",
    "Joint limits are those of the shipped table unless said otherwise; the truth itself leaves them, mostly "
    "in trunk and neck.",
    "Times are of one core of the machine named below; rows measured in another run may be of another hour. "
    "Ratios say more than microseconds. A single call contains 6 us of Python, of pik 20.",
    "Foot skate is that of the ankles, which are targets: it shows what a method misses, not whether soles "
    "slide.",
)


@dataclass(frozen=True, eq=False)
class Compared:
    """What a comparison left behind.

    Attributes:
        rows: Of this study, one per method and clip.
        measured: Rows that were measured now; the others were known.
        files: The results file and the report.
        drawn: Whether the report was made now.
    """

    rows: tuple[Row, ...]
    measured: int
    files: tuple[Path, ...]
    drawn: bool


def compare(
    study: Study,
    out: Path,
    *,
    limits_file: Path | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Compared:
    """Run every method on every clip, and report.

    A row that is known from an earlier run with the same files, options and code is not measured again. A
    clip that cannot be read and a method that fails are rows with an error.

    Args:
        study: What to compare on what.
        out: The folder to write into; it is made.
        limits_file: A table of joint limits in place of the shipped one.
        force: Begin again in a folder with results, or write into one that is not ours.
        progress: Told how far the work is.

    Raises:
        SixpointError: The folder is not ours or holds results of another version, nothing could be measured,
            or a method was fitted on what the study calls a test.
    """
    splits = assign_splits(study.clips, study.methods)
    limits = None if limits_file is None else Limits.load(limits_file)
    store = Store(out, force)
    keys = row_keys(study, limits_file)
    clips = _Clips(limits)
    total, measured = len(study.clips) * len(study.methods), 0
    progress("comparing", 0, total)
    rows: list[Row] = []
    for clip in study.clips:
        for method in study.methods:
            key = keys[clip.name, method.name]
            row = store.find(key)
            if row is None:
                row, run = _measure(clips, clip, method, study.limits, key, progress)
                store.keep(row, run)
                measured += 1
            where = replace(row, clip=clip.name, person=clip.person, split=splits[clip.name])
            rows.append(replace(where, method=method.name))
            store.write_results(rows)
            progress("comparing", len(rows), total)
        clips.forget(clip)
    return _report(study, rows, clips, store, measured, force, progress)


def report_rows(
    study: Study,
    rows: Sequence[Row],
    out: Path,
    *,
    limits_file: Path | None = None,
    drawn: int | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Compared:
    """Report rows that were measured elsewhere, with their curves in the folder (``store.write_curves``).

    Args:
        study: What was compared on what.
        rows: One per clip and method of the study.
        out: The folder of the curves, and of the report; the caller has seen that it is ours.
        limits_file: A table of joint limits in place of the shipped one.
        drawn: Clips at most that are drawn, the first of the study; all have their tables.
        force: Draw also what is drawn already.
        progress: Told how far the work is.

    Raises:
        SixpointError: The folder holds results of another version, or no row has a result.
    """
    splits = assign_splits(study.clips, study.methods)
    people = {clip.name: clip.person for clip in study.clips}
    rows = [replace(row, person=people[row.clip], split=splits[row.clip]) for row in rows]
    store = Store(out, force, ours=True)
    store.keep_rows(rows)
    store.write_results(rows)
    clips = _Clips(None if limits_file is None else Limits.load(limits_file))
    return _report(study, rows, clips, store, len(rows), force, progress, drawn)


def _report(
    study: Study,
    rows: Sequence[Row],
    clips: _Clips,
    store: Store,
    measured: int,
    force: bool,
    progress: Progress,
    drawn: int | None = None,
) -> Compared:
    """Draw the report, unless it was drawn of the same."""
    if all(row.error for row in rows):
        raise SixpointError(f"no method gave a result; {rows[0].clip}, {rows[0].method}: {rows[0].error}")
    files = (store.out / RESULTS, *(store.out / name for name in REPORT))
    stamp = digest(f"{study} {drawn} {rows_to_csv(rows)}".encode())
    if not force and store.is_drawn(stamp, files):
        return Compared(tuple(rows), measured, files, False)
    comparison = _gather(study, rows, clips, store, progress, drawn)
    write_report(comparison, store.out, progress)
    store.set_drawn(stamp)
    return Compared(tuple(rows), measured, files, True)


class _Clips:
    """Clips that are read when they are needed, one at a time."""

    def __init__(self, limits: Limits | None) -> None:
        self.limits = limits
        self.open: dict[str, OpenClip | SixpointError] = {}

    def get(self, clip: Clip) -> OpenClip | SixpointError:
        if clip.name not in self.open:
            try:
                self.open[clip.name] = open_clip(clip, self.limits)
            except SixpointError as error:
                self.open[clip.name] = error
        return self.open[clip.name]

    def forget(self, clip: Clip) -> None:
        self.open.pop(clip.name, None)


def _measure(
    clips: _Clips, clip: Clip, method: Method, limits: bool, key: str, progress: Progress
) -> tuple[Row, Run | None]:
    opened = clips.get(clip)
    if isinstance(opened, SixpointError):
        return failed_row(clip, method, key, opened), None
    what, frames = f"{clip.name}: {method.name}", len(opened.truth)
    progress(what, 0, frames)
    row, run = run_method(opened, method, limits, key, _reporting(progress, what, frames))
    progress(what, frames, frames)
    return row, run


def _reporting(progress: Progress, what: str, frames: int) -> Callable[[int], None]:
    return lambda done: progress(what, done, frames)


def _gather(
    study: Study, rows: Sequence[Row], clips: _Clips, store: Store, progress: Progress, most: int | None
) -> Comparison:
    """The comparison as the report wants it, with pictures of the first ``most`` clips that can be read."""
    drawn: list[ClipRuns] = []
    notes: list[str] = []
    for number, clip in enumerate(study.clips):
        progress("gathering", number, len(study.clips))
        if clip.note:
            notes.append(clip.note)
        if most is not None and len(drawn) >= most:
            continue
        opened = clips.get(clip)
        clips.forget(clip)
        if isinstance(opened, SixpointError):
            continue
        runs = {
            row.method: store.load(row, opened) for row in rows if row.clip == clip.name and not row.error
        }
        frames = len(opened.truth)
        first, last = clip.window or (0, frames)
        window = (min(max(first, 0), frames - 1), min(max(last, first + 1), frames))
        truth = opened.truth.sliced(slice(opened.sample, opened.sample + 1))
        drawn.append(
            ClipRuns(
                clip.name,
                opened.figure,
                opened.truth.rate,
                opened.turning,
                opened.sample,
                window,
                truth,
                runs,
            )
        )
    progress("gathering", len(study.clips), len(study.clips))
    comparison = Comparison(
        study.title,
        tuple(method.name for method in study.methods),
        tuple(rows),
        tuple(drawn),
        study.reference,
        presets={method.name: method.preset for method in study.methods},
        fitted_on={method.name: method.fitted_on for method in study.methods if method.fitted_on},
        facts=_facts(study),
        limitations=LIMITATIONS,
        notes=tuple(dict.fromkeys(notes)),
    )
    return replace(comparison, claims=check_claims(comparison, study.claims))


def _facts(study: Study) -> tuple[tuple[str, str], ...]:
    versions = [
        f"{name} {importlib.metadata.version(name)}" for name in ("numpy", "numba", "scipy", "matplotlib")
    ]
    return (
        ("machine", f"{_processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}"),
        (
            "versions",
            f"sixpoint {sixpoint.__version__}, Python {platform.python_version()}, {', '.join(versions)}",
        ),
        ("date", time.strftime("%Y-%m-%d")),
        ("joint limits", "on" if study.limits else "off"),
        ("clips", "; ".join(f"{clip.name}: {clip.file.name}" for clip in study.clips)),
        ("people", "; ".join(f"{clip.name}: {clip.person or 'not known'}" for clip in study.clips)),
    )


def _processor() -> str:
    """Name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        name = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        name = platform.processor()
    return name or "unknown processor"
