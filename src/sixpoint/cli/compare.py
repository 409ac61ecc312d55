"""``sixpoint compare``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from sixpoint.cli.options import Force, Frames, LimitsFile, Mapping, NoLimits, Skeleton
from sixpoint.cli.screen import Screen
from sixpoint.errors import SixpointError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sixpoint.jobs.compare.study import Study
    from sixpoint.study.comparison.model import Row

COLUMNS = ("method", "position", "rad", "missed", "farthest cm", "us/frame", "single us", "jerk", "jumps")
LEGEND = (
    ("position, rad", "RMS error of joint positions over the figure's height, and of joint angles"),
    ("missed", "frames with one of the six points more than 1 cm off its target"),
    ("farthest cm", "distance of the farthest point to its target, mean over frames"),
    ("us/frame, single us", "time per frame of a whole motion, and median of single calls from Python"),
    ("jerk, jumps", "jerk over the truth's; swivel angles that change by more than 30 degrees in a frame"),
)


def compare(
    *clips: Annotated[Path, Parameter(help="Motions (.bvh, .amc), folders of them, or a study (.toml).")],
    study: Annotated[
        str | None, Parameter(help="A study that ships with sixpoint (paper, damping), or a .toml file.")
    ] = None,
    data: Annotated[
        Path | None, Parameter(help="Folder of a study's recordings; by default the study file's own.")
    ] = None,
    methods: Annotated[
        str | None,
        Parameter(
            help="`all`, or names with commas: sik, sik+, tgbsik, kma, ccd, jt, pinv, dls, dls-svd, sdls, "
            "pik, pik-flext, hybrid; `module:Class` for your own."
        ),
    ] = None,
    out: Annotated[Path, Parameter(name=("--out", "-o"), help="Folder of the report.")] = Path("report"),
    frames: Frames = None,
    weights: Annotated[
        str | None,
        Parameter(help="Influence of wrists, ankles and the last frame on the pelvis, e.g. 1,1,0."),
    ] = None,
    skeleton: Skeleton = None,
    mapping: Mapping = None,
    limits: LimitsFile = None,
    no_limits: NoLimits = False,
    force: Force = False,
) -> None:
    """Compare IK methods on recordings, on the same figure, limits and stop rules.

    Writes report.html (one page that needs nothing else), report.md and results.csv (a row per method and
    clip). A run that was interrupted goes on where it stopped; what is known is not measured again.

    For example:

    ```
    sixpoint compare walk.bvh kick.bvh
    sixpoint compare recordings/ --methods sik,kma,pik -o report/
    sixpoint compare --study paper --data recordings/
    sixpoint compare walk.bvh --methods all,my_module:MySolver
    ```
    """
    from sixpoint.jobs.compare.job import compare as run

    if limits is not None and no_limits:
        raise SixpointError("--limits FILE and --no-limits exclude each other")
    chosen = _study(list(clips), study, data, methods, frames, weights, skeleton, mapping, no_limits)
    screen = Screen()
    with screen.progress() as progress:
        done = run(chosen, out, limits_file=limits, force=force, progress=progress)
    for clip in chosen.clips:
        rows = [row for row in done.rows if row.clip == clip.name]
        screen.say(f"{clip.name}: {max(row.frames for row in rows)} frames{_use(rows)}", style="bold")
        if any(not row.error for row in rows):
            screen.table(COLUMNS, [_cells(row) for row in rows if not row.error])
        for error, names in _failures(rows).items():
            screen.note(f"{clip.name}, {', '.join(names)}: {error}", "failed", "red")
        screen.say()
    screen.rows(LEGEND)
    screen.say()
    total = len(done.rows)
    what = (
        f"{done.measured} of {total} measured, the others were known" if done.measured < total else "measured"
    )
    if not done.drawn:
        what = f"all {total} results were known, the report is up to date"
    screen.say(f"{what}; written to {out}{os.sep}: {', '.join(path.name for path in done.files)}")
    screen.say("next:", style="bold")
    screen.rows([(f"open {done.files[1]}", "tables, errors over time, and all methods side by side")])


def _study(
    clips: Sequence[Path],
    study: str | None,
    data: Path | None,
    methods: str | None,
    frames: str | None,
    weights: str | None,
    skeleton: Path | None,
    mapping: Path | None,
    no_limits: bool,
) -> Study:
    """The study that the command line asks for."""
    from dataclasses import replace

    from sixpoint.jobs.compare.methods import choose_methods
    from sixpoint.jobs.compare.study import find_study, read_study, study_of_files
    from sixpoint.jobs.reading import parse_frames
    from sixpoint.jobs.solving import parse_weights
    from sixpoint.solvers.six_points.solver import check_weights

    if study is None and len(clips) == 1 and clips[0].suffix == ".toml":
        study, clips = str(clips[0]), []
    if study is not None:
        if clips:
            raise SixpointError("a study names its own clips: give either --study or files")
        if frames or weights or skeleton or mapping:
            raise SixpointError(
                "--frames, --weights, --skeleton and --mapping are for clips; a study says them itself"
            )
        made = read_study(find_study(study), data)
    else:
        if data is not None:
            raise SixpointError("--data is the folder of a study's recordings: give --study too")
        if frames:
            parse_frames(frames)
        parsed = None if weights is None else check_weights(parse_weights(weights))
        made = study_of_files(clips, frames or "", parsed, mapping=mapping, skeleton=skeleton)
    if methods is not None:
        made = replace(made, methods=choose_methods(methods))
    return replace(made, limits=False) if no_limits else made


def _use(rows: Sequence[Row]) -> str:
    """What a clip was used for, if it is no test."""
    from sixpoint.study.comparison.fitting import USES

    use = USES.get(rows[0].split)
    person = f" (person {rows[0].person})" if rows[0].person else ""
    return f", {use}{person}: in no average" if use else ""


def _failures(rows: Sequence[Row]) -> dict[str, list[str]]:
    """Why there is no result -> methods."""
    found: dict[str, list[str]] = {}
    for row in rows:
        if row.error:
            found.setdefault(row.error, []).append(row.method)
    return found


def _cells(row: Row) -> list[str]:
    failed = f" ({row.failed_frames} failed)" if row.failed_frames else ""
    return [
        row.method + failed,
        _number(row.position, 4),
        _number(row.orientation, 3),
        f"{100 * row.missed:.0f} %",
        _number(100 * row.residual_mean, 2),
        _number(row.batch_us, 1),
        _number(row.median_us, 1),
        _number(row.jerk_ratio, 2),
        _number(row.swivel_jumps, 0),
    ]


def _number(value: float, digits: int) -> str:
    return "-" if value != value else f"{value:.{digits}f}"
