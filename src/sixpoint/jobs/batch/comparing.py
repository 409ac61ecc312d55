"""The job ``compare`` of a batch: a task for each file and method, one report of them all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from math import nan
from pathlib import Path
from typing import Any

from sixpoint.body.figure import Figure
from sixpoint.body.limits import Limits
from sixpoint.errors import SixpointError
from sixpoint.jobs.batch.task import DONE, Outcome
from sixpoint.jobs.compare.job import report_rows
from sixpoint.jobs.compare.keys import row_keys
from sixpoint.jobs.compare.methods import METHODS, Method, choose_methods
from sixpoint.jobs.compare.run import open_clip, run_method
from sixpoint.jobs.compare.splits import find_person
from sixpoint.jobs.compare.store import curves_path, write_curves
from sixpoint.jobs.compare.study import Clip, Study
from sixpoint.jobs.progress import Progress
from sixpoint.jobs.reading import parse_frames
from sixpoint.jobs.solving import parse_weights
from sixpoint.samples import make_sample
from sixpoint.solvers.six_points.solver import check_weights
from sixpoint.study.comparison.model import Row

DRAWN = 12
"""Clips that are drawn in the report, the first by name; all have their tables."""
NOTE = "Measured by a batch, several rows at a time: times are of busy cores, maybe of several machines."
HEAD = ("clip", "method", "person", "split", "error")


def run_one(source: Path, out: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Measure one method on one file.

    Args:
        source: A motion.
        out: The folder of the comparison.
        options: Of ``sixpoint compare``, with one method.

    Returns:
        The numbers of the row, and the file of its curves.

    Raises:
        SixpointError: It cannot be read, or the method gave no result.
    """
    (method,) = _methods(options)
    clip = _clip(source.name, source, options)
    study = _study([clip], [method], options)
    key = row_keys(study, options.get("limits"))[clip.name, method.name]
    row, run = run_method(open_clip(clip, _limits(options)), method, study.limits, key, lambda done: None)
    if row.error or run is None:
        raise SixpointError(row.error or "no result")
    curves_path(out, key).parent.mkdir(parents=True, exist_ok=True)
    numbers = {name: value for name, value in asdict(row).items() if name not in HEAD}
    return {**numbers, "files": [write_curves(out, key, run)]}


def check(options: Mapping[str, Any]) -> None:
    """Refuse options that do not go together.

    Raises:
        SixpointError: The message says which.
    """
    if options.get("limits") is not None and options.get("no_limits"):
        raise SixpointError("--limits FILE and --no-limits exclude each other")
    for name in ("study", "data"):
        if options.get(name) is not None:
            raise SixpointError(f"--{name} names its own clips: use sixpoint compare")
    _methods(options)
    _limits(options)
    _clip("", Path(), options)


def parts(options: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """A task for each method: its name -> its options."""
    return {method.name: {**options, "methods": method.solver} for method in _methods(options)}


def warm_up(options: Mapping[str, Any]) -> None:
    """Compile the kernels of all methods."""
    figure = Figure.from_stature()
    targets = figure.targets(make_sample("walk", figure)).sliced(slice(0, 2))
    for method in _methods(options):
        solver = method.make(figure, not options.get("no_limits"), None)
        getattr(solver, "warm_up", lambda: None)()
        if hasattr(solver, "solve_frames"):
            solver.solve_frames(replace(targets, rotations=None))


def gather(
    outcomes: Sequence[Outcome],
    sources: Mapping[str, Path],
    out: Path,
    options: Mapping[str, Any],
    progress: Progress,
) -> list[Path]:
    """Write the report of all rows: ``report.html``, ``report.md`` and ``results.csv``.

    Raises:
        SixpointError: No method gave a result on any file.
    """
    clips = [replace(_clip(name, path, options), note=NOTE) for name, path in sources.items()]
    study = _study(clips, _methods(options), options)
    keys = row_keys(study, options.get("limits"))
    known = {item.name for item in fields(Row)} - set(HEAD)
    rows = []
    for outcome in outcomes:
        head: dict[str, Any] = {
            "clip": outcome.name,
            "method": outcome.part,
            "key": keys[outcome.name, outcome.part],
        }
        if outcome.status == DONE:
            measured = {name: value for name, value in outcome.metrics.items() if name in known}
            rows.append(Row(**{**measured, **head}))
        else:
            rows.append(Row(**head, frames=0, rate=nan, error=outcome.error))
    return list(
        report_rows(study, rows, out, limits_file=options.get("limits"), drawn=DRAWN, progress=progress).files
    )


def _methods(options: Mapping[str, Any]) -> tuple[Method, ...]:
    named = options.get("methods")
    return tuple(METHODS.values()) if named is None else choose_methods(named)


def _clip(name: str, source: Path, options: Mapping[str, Any]) -> Clip:
    frames, weights = options.get("frames") or "", options.get("weights")
    if frames:
        parse_frames(frames)
    return Clip(
        name,
        source,
        options.get("skeleton"),
        frames,
        None if weights is None else check_weights(parse_weights(weights)),
        mapping=options.get("mapping"),
        person=find_person(source),
    )


def _study(clips: Sequence[Clip], methods: Sequence[Method], options: Mapping[str, Any]) -> Study:
    title = f"Comparison on {len(clips)} clips"
    return Study(title, tuple(clips), tuple(methods), limits=not options.get("no_limits"))


def _limits(options: Mapping[str, Any]) -> Limits | None:
    path = options.get("limits")
    return None if path is None else Limits.load(path)
