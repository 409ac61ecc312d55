"""The folder of a batch: what it is of, a record of every task, and a table of them all.

Results lie by the file's path within the library; ``.batch`` holds ``batch.json`` and the records. A record
is written by whoever did the task, after its results, so that what is done is known whoever dies next.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from sixpoint.errors import FormatError
from sixpoint.formats.atomic import remove_leftovers, write_files
from sixpoint.jobs.batch.task import DONE, Outcome, Task
from sixpoint.jobs.digests import digest_file
from sixpoint.jobs.writing import prepare_folder

OURS = ".batch"
MARKER, RECORDS, SUMMARY = f"{OURS}/batch.json", f"{OURS}/records", "summary.csv"
COLUMNS = ("file", "part", "status", "error", "seconds")
LAST = ("files", "notes", "worker")
VERSION = 1
STALE = 3600.0
"""Temporary files of this age have no writer any more [s]."""


def read_marker(out: Path) -> dict[str, Any] | None:
    """What a folder is a batch of; None where it is none."""
    try:
        marker = json.loads((out / MARKER).read_bytes())
    except (OSError, ValueError):
        return None
    return marker if isinstance(marker, dict) and {"job", "library"} <= marker.keys() else None


def begin(out: Path, job: str, library: Path, force: bool) -> None:
    """Make or open the folder of a batch.

    Args:
        out: The folder.
        job: The job's name.
        library: The folder that files are named from.
        force: Begin again in the folder of another batch, or write into one that is not ours.

    Raises:
        FormatError: It is not ours, is of another batch, or cannot be written.
    """
    marker = read_marker(out)
    if marker is not None and not force:
        for what, name in ((marker["job"], job), (marker["library"], str(library))):
            if what != name:
                raise FormatError(
                    out, f"holds a batch of {what}, not of {name}: choose another folder, or --force"
                )
        if marker.get("version") != VERSION:
            raise FormatError(out, "holds a batch of another version of sixpoint: choose another folder")
    prepare_folder(out, force, ours=marker is not None)
    prepare_folder(out / RECORDS, True)
    remove_leftovers(out, STALE)
    if force:
        for path in (out / RECORDS).rglob("*.json"):
            path.unlink()
    text = json.dumps({"version": VERSION, "job": job, "library": str(library)})
    write_files({out / MARKER: text.encode()}, force=True)


def record_path(task: Task | Outcome, out: Path) -> Path:
    """Where the record of a task is; tasks of one file lie in a folder of its name."""
    place = out / RECORDS / task.name
    name = f"{quote(task.part, safe='+')}.json" if task.part else f"{place.name}.json"
    return place / name if task.part else place.with_name(name)


def write_record(out: Path, outcome: Outcome) -> None:
    """Keep what came of a task, whole or not at all.

    Raises:
        FormatError: It cannot be written.
    """
    path = record_path(outcome, out)
    make_folder(path.parent)
    write_files({path: outcome.to_json()}, force=True)


def find_done(task: Task) -> Outcome | None:
    """The record of a task that was done with the same files, options and code, if its results are whole."""
    try:
        outcome = Outcome.from_json(record_path(task, task.out).read_bytes())
        whole = all(digest_file(task.out / name) == found for name, found in outcome.files.items())
    except (OSError, ValueError, TypeError, AttributeError):
        return None
    return outcome if whole and outcome.status == DONE and outcome.key == task.key else None


def sweep(task: Task) -> None:
    """Delete what a dead worker had half written of a task."""
    remove_leftovers(record_path(task, task.out))
    if task.target:
        remove_leftovers(task.out / task.target)


def read_records(out: Path) -> list[Outcome]:
    """All records of a folder; damaged ones are left out."""
    found = []
    for path in (out / RECORDS).rglob("*.json"):
        try:
            found.append(Outcome.from_json(path.read_bytes()))
        except (OSError, ValueError, TypeError):
            continue
    return found


def write_summary(out: Path, outcomes: Iterable[Outcome]) -> Path:
    """Write the table of a batch, ``summary.csv``: a line per task, numbers in full, what is unknown empty.

    Raises:
        FormatError: It cannot be written.
    """
    outcomes = list(outcomes)
    measured = list(dict.fromkeys(name for outcome in outcomes for name in outcome.metrics))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*COLUMNS, *measured, *LAST])
    for row in outcomes:
        metrics = [_cell(row.metrics, name) for name in measured]
        head = (row.name, row.part, row.status, row.error, f"{row.seconds:.3f}")
        writer.writerow([*head, *metrics, " ".join(row.files), "; ".join(row.notes), row.worker])
    path = out / SUMMARY
    write_files({path: text.getvalue().encode("utf-8", "backslashreplace")}, force=True)
    return path


def _cell(metrics: Mapping[str, Any], name: str) -> Any:
    value = metrics.get(name, "")
    return "" if value is None or value != value else value


def make_folder(path: Path) -> None:
    """Make a folder and those above it.

    Raises:
        FormatError: It cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FormatError(path, f"the folder cannot be made: {error.strerror}") from error
