"""``sixpoint convert``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from sixpoint.cli.options import Force, Frames, Mapping, Rate, Skeleton, Unit, Up
from sixpoint.cli.screen import Screen


def convert(
    source: Annotated[
        Path,
        Parameter(
            help="A motion (.bvh, .amc, .asf), six points (.csv, .npz) or markers (.c3d, .trc, .csv, .npz, "
            ".json)."
        ),
    ],
    out: Annotated[
        Path,
        Parameter(
            help="A motion (.bvh, .amc with its .asf), its six points (.csv, .npz), its joint angles (.mot), "
            "or markers (.c3d, .trc, .csv, .npz)."
        ),
    ],
    /,
    *,
    skeleton: Skeleton = None,
    frames: Frames = None,
    mapping: Mapping = None,
    rotations: Annotated[
        bool, Parameter(negative="", help="With six points, also write their rotations.")
    ] = False,
    angles: Annotated[
        bool, Parameter(negative="", help="Write a motion's joint angles to a .csv, as to a .mot.")
    ] = False,
    fill: Annotated[
        float | None, Parameter(help="Fill gaps of markers up to this length [s]; by default none.")
    ] = None,
    low_pass: Annotated[
        float | None, Parameter(help="Filter markers at this frequency [Hz], without delay; by default not.")
    ] = None,
    unit: Unit = None,
    up: Up = None,
    rate: Rate = None,
    out_unit: Annotated[
        str | None, Parameter(help="Unit of the written motion or markers; by default that of the source.")
    ] = None,
    out_up: Annotated[
        Literal["y", "z"] | None,
        Parameter(help="Up axis of the written motion or markers; by default the source's."),
    ] = None,
    force: Force = False,
) -> None:
    """Convert a file: a motion to another, its six points or joint angles; points or markers likewise.

    For example:

    ```
    sixpoint convert 17_10.amc boxing.bvh --out-unit cm
    sixpoint convert boxing.bvh boxing_points.csv
    sixpoint convert boxing_points.csv boxing_points.npz --frames 0:600
    sixpoint convert boxing.bvh angles.mot
    sixpoint convert gait.c3d gait.trc --fill 0.1 --low-pass 6
    ```
    """
    from sixpoint.cli import describe
    from sixpoint.jobs.convert import Cleaning
    from sixpoint.jobs.convert import convert as run
    from sixpoint.jobs.reading import ALL, Reading, parse_frames

    chosen = ALL if frames is None else parse_frames(frames)
    done = run(
        source,
        out,
        reading=Reading(skeleton, unit, up, rate, chosen),
        mapping=mapping,
        rotations=rotations,
        angles=angles,
        cleaning=Cleaning(fill, low_pass),
        out_unit=out_unit,
        out_up=out_up,
        force=force,
    )
    content = done.content
    screen = Screen()
    length = describe.describe_length(len(content), content.rate)
    screen.say(f"{source}: {describe.describe_content(content)}, {length}")
    for note in done.notes:
        screen.say(note)
    screen.say(describe.describe_files(done.files), style="green")
