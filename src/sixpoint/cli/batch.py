"""``sixpoint batch``."""

from __future__ import annotations

import importlib
import inspect
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

from sixpoint.cli.screen import Screen
from sixpoint.errors import SixpointError

if TYPE_CHECKING:
    from sixpoint.jobs.batch.job import Batch

OWN = ("out", "force")
"""Parameters of a job's command that a batch has itself; others that it cannot heed the job refuses."""
LISTED = 100
"""Failures at most that are listed; all are in the summary."""


def batch(
    *words: Annotated[
        str,
        Parameter(
            name="FILES",
            help="Patterns in quotes ('library/**/*.amc'), files or folders; and options of the job, as of "
            "`sixpoint reconstruct`, `track` or `compare`: --method sik --no-limits.",
            allow_leading_hyphen=True,
        ),
    ],
    job: Annotated[
        str, Parameter(help="What to do with each file: reconstruct, track or compare.")
    ] = "reconstruct",
    out: Annotated[
        Path, Parameter(name=("--out", "-o"), help="Folder of the results and of summary.csv.")
    ] = Path("out"),
    out_format: Annotated[
        str | None,
        Parameter(help="Suffix of the results: .bvh (default), .amc; of track also .mot, .csv."),
    ] = None,
    workers: Annotated[
        int | None, Parameter(help="Processes on this machine; by default one per core.")
    ] = None,
    scheduler: Annotated[
        str | None,
        Parameter(help="Address of a Dask scheduler, tcp://host:port, whose workers share the file system."),
    ] = None,
    force: Annotated[
        bool,
        Parameter(negative="", help="Do all again, also in the folder of another batch, or of anything."),
    ] = False,
) -> None:
    """Do a job on many files, by all cores of this machine or of a Dask cluster.

    Results lie in the folder of --out as the files lie in their library. What was done before with the same
    content, options and version is skipped, what changed or failed is done; so a batch that was interrupted
    goes on when it is started again. Files that fail are listed with the reason, the others are done.

    For example:

    ```
    sixpoint batch 'library/**/*.amc' -o out/
    sixpoint batch 'library/**/*.amc' -o out/ --method sik-prior --no-limits --out-format .amc
    sixpoint batch library/ --job compare --methods sik,sik+,pik -o report/
    sixpoint batch 'library/**/*.amc' -o out/ --scheduler tcp://head:8786
    ```
    """
    from sixpoint.jobs.batch.job import batch as run

    patterns, options = parse_job(job, words)
    screen = Screen()
    with screen.progress() as progress:
        done = run(
            patterns,
            out,
            job=job,
            options=options,
            out_format=out_format,
            workers=workers,
            scheduler=scheduler,
            force=force,
            progress=progress,
        )
    _show(screen, done, job, out)


def parse_job(job: str, words: Sequence[str]) -> tuple[list[str], dict[str, Any]]:
    """Patterns, and the options of a job that were given, read as the job's own command reads them.

    Raises:
        SixpointError, CycloptsError: There is no such job, or it has no such option.
    """
    from sixpoint.jobs.batch.registry import find_job

    find_job(job).load()
    command = getattr(importlib.import_module(f"sixpoint.cli.{job}"), job)
    app = App(name=job)
    app.default(_taking_files(command))
    _, bound, _ = app.parse_args(list(words), exit_on_error=False, print_error=False)
    return list(bound.args), dict(bound.kwargs)


def _taking_files(command: Callable[..., None]) -> Callable[..., None]:
    """A function with the options of a command, and files in place of its file."""
    signature = inspect.signature(command, eval_str=True)
    options = [p for p in signature.parameters.values() if p.kind is p.KEYWORD_ONLY and p.name not in OWN]
    files = inspect.Parameter("files", inspect.Parameter.VAR_POSITIONAL, annotation=str)

    def take(*files: str, **options: Any) -> None: ...

    take.__signature__ = signature.replace(parameters=[files, *options])  # type: ignore[attr-defined]
    take.__annotations__ = {p.name: p.annotation for p in (files, *options)}
    return take


def _show(screen: Screen, done: Batch, job: str, out: Path) -> None:
    from sixpoint.cli.describe import plural

    total, failed = len(done.outcomes), len(done.failures)
    screen.say(f"{job}: {plural(len(done.library.files), 'file')} of {done.library.root}", style="bold")
    rows = []
    if done.workers:
        how = f"in {done.seconds:.1f} s by {plural(done.workers, 'worker')}; {done.cpu:.1f} s of processor"
        rows.append(("done", f"{total - done.known - failed} {how}"))
    if done.known:
        rows.append(("known", f"{done.known}, unchanged since they were done"))
    if failed:
        rows.append(("failed", str(failed)))
    screen.rows([*rows, *_headline(done, job)])
    for outcome in done.failures[:LISTED]:
        reason = outcome.error.removeprefix(f"{done.library.root}{os.sep}")
        said = reason if reason.startswith(outcome.label) else f"{outcome.label}: {reason}"
        screen.note(said, "failed", "red")
    if failed > LISTED:
        screen.note(f"{failed - LISTED} more are in the summary", "failed", "red")
    screen.say(f"wrote {out}{os.sep}: {', '.join(path.name for path in done.files)}", style="green")
    if failed:
        raise SixpointError(
            f"{failed} of {total} failed; the same command tries them again, and nothing else"
        )


def _headline(done: Batch, job: str) -> list[tuple[str, str]]:
    """Mean and worst of the metrics that say most."""
    from sixpoint.jobs.batch.registry import find_job

    rows = []
    for metric, label in find_job(job).headline:
        found = [(o.metrics[metric], o.label) for o in done.outcomes if o.metrics.get(metric) is not None]
        if found:
            worst, where = max(found)
            mean = sum(value for value, _ in found) / len(found)
            rows.append((label, f"mean {mean:.4f}, worst {worst:.4f} ({where})"))
    return rows
