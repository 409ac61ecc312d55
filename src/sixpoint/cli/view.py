"""``sixpoint view``, and the page of other commands."""

from __future__ import annotations

import importlib.util
import threading
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

from cyclopts import Parameter

from sixpoint.cli.options import Frames, LimitsFile, Mapping, NoLimits, Rate, Unit, Up
from sixpoint.cli.screen import Screen
from sixpoint.cli.track import replay_markers
from sixpoint.errors import SixpointError

MARKERS = (".c3d", ".trc")
"""What holds nothing but labelled markers."""


def view(
    *files: Annotated[
        Path,
        Parameter(help="Motions (.bvh, .amc) and six points (.csv, .npz), or one of markers (.c3d, .trc)."),
    ],
    method: Annotated[str, Parameter(help="How to solve at the beginning; as of `reconstruct`.")] = "sik+",
    no_limits: NoLimits = False,
    host: Annotated[
        str, Parameter(help="Address to listen on: 0.0.0.0 lets all who can reach this machine in.")
    ] = "127.0.0.1",
    port: Annotated[int | None, Parameter(help="Port; by default the first free one from 8080.")] = None,
    out: Annotated[
        Path | None,
        Parameter(name=("--out", "-o"), help="Folder into which the page may save; without it, it may not."),
    ] = None,
    skeleton: Annotated[
        Path | None,
        Parameter(help="For an .amc: its .asf. For six points and without a file: the rig to pose."),
    ] = None,
    stature: Annotated[
        float | None, Parameter(help="For six points and without a file: of the built-in figure [m].")
    ] = None,
    frames: Frames = None,
    mapping: Mapping = None,
    limits: LimitsFile = None,
    unit: Unit = None,
    up: Up = None,
    rate: Rate = None,
) -> None:
    """Open a page in the browser: a figure and six points to drag, recordings to play, methods to compare.

    A recording of labelled markers is calibrated, followed and played, as by `sixpoint track --view`.
    Without a file the built-in figure stands there. Of a motion the result is shown over the truth, with its
    errors. Only this machine can open the page unless --host says otherwise. Needs viser:
    `pip install "sixpoint[viewer]"`.

    For example:

    ```
    sixpoint view
    sixpoint view walk.bvh kick.bvh --method pik
    sixpoint view points.csv --stature 1.68 --out poses
    sixpoint view walk.c3d
    ```
    """
    from sixpoint.jobs.reading import ALL, Reading, parse_frames
    from sixpoint.jobs.reconstruct import Body
    from sixpoint.jobs.solving import Solving
    from sixpoint.jobs.track.options import Following

    solving = Solving(method, limits=not no_limits, limits_file=limits)
    solving.check()
    reading = Reading(unit=unit, up=up, rate=rate, frames=ALL if frames is None else parse_frames(frames))
    if any(path.suffix.lower() in MARKERS for path in files):
        if len(files) > 1:
            raise SixpointError("a recording of markers is shown alone: give one file")
        if any(given is not None for given in (out, skeleton, stature, mapping)):
            raise SixpointError(
                "--out, --skeleton, --stature and --mapping are not for markers: these tell who moves"
            )
        check_viser()
        following = Following(limits=not no_limits, limits_file=limits)
        replay_markers(Screen(), files[0], reading, following, True, host=host, port=port)
        return
    body = Body(skeleton, stature, mapping)
    show_page(
        lambda clips: clips.open_clips(files, reading=reading, body=body, limits=solving.load_limits()),
        method=method,
        limits=not no_limits,
        host=host,
        port=port,
        folder=out,
    )


def check_viser() -> None:
    """Refuse a page where viser is not installed."""
    if importlib.util.find_spec("viser") is None:
        raise SixpointError('the viewer needs viser, which is not installed: pip install "sixpoint[viewer]"')


def show_page(
    open_clips: Callable[[ModuleType], list[Any]],
    *,
    method: str = "sik+",
    limits: bool = True,
    host: str = "127.0.0.1",
    port: int | None = None,
    folder: Path | None = None,
    stop: threading.Event | None = None,
) -> None:
    """Open the page, say where it is, and keep it until Ctrl-C.

    Args:
        open_clips: Given the module ``jobs.view.clips``, reads what is looked at.
        method: To begin with.
        limits: Keep joints within their limits.
        host: Address to listen on.
        port: None: the first free one.
        folder: Where the page may save; None for nowhere.
        stop: Closes the page when it is set.

    Raises:
        SixpointError: viser is not installed, or the page cannot be opened.
    """
    check_viser()
    from sixpoint.jobs.view import clips
    from sixpoint.jobs.view.job import open_page
    from sixpoint.jobs.view.posing import Posing

    screen = Screen()
    opened = open_clips(clips)
    posing = Posing(method, {} if limits else {"limits": False})
    with open_page(opened, posing=posing, host=host, port=port, folder=folder) as page:
        screen.say(f"open {page.address} in a browser; Ctrl-C ends it", style="bold")
        if page.warning:
            screen.note(page.warning, "warning", "yellow")
        (stop or threading.Event()).wait()
