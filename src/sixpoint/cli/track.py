"""``sixpoint track``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from sixpoint.cli.options import Force, Frames, Layout, LimitsFile, NoLimits, Rate, Unit
from sixpoint.cli.screen import Screen

if TYPE_CHECKING:
    from sixpoint.jobs.track.job import Tracking

WORST = 12  # markers listed on the screen


def track(
    file: Annotated[
        Path, Parameter(help="Labelled markers: .c3d, .trc, .csv, .npz, or .json of a pose estimator.")
    ],
    /,
    *,
    out: Annotated[
        Path | None,
        Parameter(
            name=("--out", "-o"),
            help="A motion (.bvh, .amc, .glb, .usd ...), or joint angles as .mot or .csv; by default "
            "`<name>_tracked.bvh` in this folder.",
        ),
    ] = None,
    model: Annotated[
        Path | None, Parameter(help="A saved marker model; by default one is calibrated on the recording.")
    ] = None,
    save_model: Annotated[
        Path | None, Parameter(help="Also save the calibrated person, for --model, to this .toml.")
    ] = None,
    static: Annotated[
        Path | None, Parameter(help="The same person and markers standing still, to calibrate on.")
    ] = None,
    layout: Layout = None,
    markers: Annotated[
        str | None, Parameter(help="Follow these labels only: LASI,RASI,LKNE; by default all with a role.")
    ] = None,
    frames: Frames = None,
    limits: LimitsFile = None,
    no_limits: NoLimits = False,
    cutoff: Annotated[
        float | None, Parameter(help="Filter the markers at this frequency [Hz], without delay: 6 for gait.")
    ] = None,
    lock_feet: Annotated[bool, Parameter(negative="", help="Hold feet still while they stand.")] = False,
    six: Annotated[
        bool, Parameter(negative="", help="Reduce the markers to the six points, and pose by these alone.")
    ] = False,
    method: Annotated[
        str | None, Parameter(help="With --six: how to solve, as of `reconstruct`; by default sik+.")
    ] = None,
    avatar: Annotated[
        Path | None, Parameter(help="Pose this avatar (.glb, .gltf, .vrm) as the person is, and write it.")
    ] = None,
    picture: Annotated[
        Path | None, Parameter(help="Also draw body and markers at some frames, to this .png.")
    ] = None,
    report: Annotated[
        Path | None,
        Parameter(help="Also write a report into this folder: residuals by marker, with pictures."),
    ] = None,
    live: Annotated[
        bool, Parameter(negative="", help="Replay it at its own rate, solved frame by frame; writes nothing.")
    ] = False,
    view: Annotated[
        bool, Parameter(negative="", help="Show the replay in the browser, over and over; implies --live.")
    ] = False,
    unit: Unit = None,
    up: Annotated[
        str | None, Parameter(help="Up axis of the file: x, y, z, or one with a minus; by default guessed.")
    ] = None,
    rate: Rate = None,
    force: Force = False,
) -> None:
    """Follow the markers of a laboratory recording with a whole body, and write it.

    The person's lengths and the places of the markers are calibrated on the recording itself, on a static
    trial (--static), or known already (--model). Feet, pelvis, hands and head count before the rest; gaps
    are bridged, ghosts and swapped markers refused and reported.

    For example:

    ```
    sixpoint track walk.c3d -o walk.bvh --report walk_report
    sixpoint track walk.trc --static static.trc -o walk.mot --cutoff 6
    sixpoint track range.c3d --save-model anna.toml
    sixpoint track dance.c3d --model anna.toml
    sixpoint track dance.c3d --six --method sik-prior
    sixpoint track walk.c3d --avatar hero.vrm -o hero.glb
    sixpoint track walk.c3d --view
    ```
    """
    from sixpoint.jobs.reading import ALL, Reading, parse_frames
    from sixpoint.jobs.track.options import Following, check_replay, parse_labels, parse_six

    labels = () if markers is None else parse_labels(markers)
    following = Following(model, static, layout, labels, not no_limits, limits, cutoff, lock_feet)
    reading = Reading(unit=unit, up=up, rate=rate, frames=ALL if frames is None else parse_frames(frames))
    posing = parse_six(six, method, no_limits)
    screen = Screen()
    if live or view:
        check_replay(
            out=out,
            report=report,
            picture=picture,
            save_model=save_model,
            avatar=avatar,
            six=six,
            cutoff=cutoff,
            lock_feet=lock_feet,
        )
        replay_markers(screen, file, reading, following, view)
        return
    from sixpoint.jobs.track.job import track as run

    with screen.progress() as progress:
        done = run(
            file,
            out,
            reading=reading,
            following=following,
            six=posing,
            avatar=avatar,
            picture=picture,
            report=report,
            save_model=save_model,
            force=force,
            progress=progress,
        )
    _show(screen, file, done)


def replay_markers(
    screen: Screen, file: Path, reading: object, following: object, view: bool, **place: object
) -> None:
    """Replay a recording of markers at its own rate, in the browser over and over."""
    from sixpoint.jobs.track.replay import replay

    if view:
        from sixpoint.cli.view import check_viser

        check_viser()
    with screen.progress() as progress:
        session = replay(file, reading, following, view=view, progress=progress, **place)  # type: ignore[arg-type]
    with session:
        if session.address:
            screen.say(f"open {session.address} in a browser; Ctrl-C ends it", style="bold")
        session.run(lambda line: screen.note(line, "live") if view else None)
    solving = [1e3 * session.statistics.percentile("solving", share) for share in (50, 99)]
    late = session.statistics.counts["frames left out"]
    screen.rows(
        [
            ("live", session.statistics.line()),
            (
                "solving",
                f"median {solving[0]:.2f}, p99 {solving[1]:.2f} ms; a frame is {1e3 / session.rate:.2f} ms",
            ),
            ("left out", f"{late} frames" if late else "no frame"),
        ]
    )


def _show(screen: Screen, file: Path, done: Tracking) -> None:
    from sixpoint.cli import describe
    from sixpoint.jobs.track.report import COLUMNS, describe_tracking, row_cells
    from sixpoint.study.tracking import summarise_markers

    screen.say(f"{file}: {describe.describe_length(len(done.markers), done.markers.rate)}", style="bold")
    screen.rows([*_person(done), *describe_tracking(done), *_absent(done)])
    rows = summarise_markers(done.model.names, done.tracked.residual, done.tracked.flags)
    shown = [row for k, row in enumerate(rows) if k < WORST or row.refused or row.swapped]
    left = len(rows) - len(shown)
    what = f"markers, the worst first ({left} better ones of {len(rows)} left out; --report has all)"
    screen.say(what if left else "markers, the worst first", style="bold")
    screen.table(COLUMNS, [row_cells(row) for row in shown])
    if done.six is not None:
        targets, solved, borrowed = done.six
        note = f"; {', '.join(borrowed)} mostly placed by the followed body" if borrowed else ""
        screen.say(f"six points{note}", style="bold")
        screen.rows(describe.describe_solved(solved, targets))
    if done.avatar is not None:
        targets, solved = done.avatar
        screen.say("avatar", style="bold")
        screen.rows(describe.describe_solved(solved, targets))
    screen.say(describe.describe_files(done.files), style="green")


def _person(done: Tracking) -> list[tuple[str, str]]:
    """How tall whoever was followed is, as the lengths of the model say."""
    from sixpoint.cli import describe

    how = "calibrated on these markers" if done.calibration else "of the saved model"
    return [("person", f"{describe.find_stature(done.model.figure):.2f} m tall, {how}")]


def _absent(done: Tracking) -> list[tuple[str, str]]:
    """Markers of the model that the recording does not have; the shares above count them as not seen."""
    from sixpoint.errors import listed

    there = set(done.markers.names)
    absent = [name for name in done.model.names if name not in there]
    if not absent:
        return []
    count = len(done.model.names)
    text = f"{len(absent)} of the model's {count} markers: {listed(absent)}"
    return [("absent", text)]
