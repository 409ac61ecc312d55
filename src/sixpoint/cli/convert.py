"""``sixpoint convert``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from sixpoint.cli.options import Force, Frames, Mapping, Rate, Skeleton, Unit, Up
from sixpoint.cli.screen import Screen


def convert(
    source: Annotated[
        Path, Parameter(help="A motion (.bvh, .amc, .asf, .glb, .vrm ..) or six points (.csv, .npz).")
    ],
    out: Annotated[
        Path, Parameter(help="A motion (.bvh, .amc with its .asf, .glb, .vrma) or six points (.csv, .npz).")
    ],
    /,
    *,
    skeleton: Skeleton = None,
    frames: Frames = None,
    mapping: Mapping = None,
    rotations: Annotated[
        bool, Parameter(negative="", help="With six points, also write their rotations.")
    ] = False,
    unit: Unit = None,
    up: Up = None,
    rate: Rate = None,
    out_unit: Annotated[
        str | None, Parameter(help="Unit of the written motion; by default that of the source.")
    ] = None,
    out_up: Annotated[
        Literal["y", "z"] | None, Parameter(help="Up axis of the written motion; by default the source's.")
    ] = None,
    force: Force = False,
) -> None:
    """Convert a file: motion to motion, motion to its six points, six points to six points.

    For example:

    ```
    sixpoint convert 17_10.amc boxing.bvh --out-unit cm
    sixpoint convert boxing.bvh boxing_points.csv
    sixpoint convert boxing.bvh boxing.vrma
    sixpoint convert boxing_points.csv boxing_points.npz --frames 0:600
    ```
    """
    from sixpoint.body.motion import Motion
    from sixpoint.cli import describe
    from sixpoint.jobs.convert import convert as run
    from sixpoint.jobs.reading import ALL, Reading, parse_frames

    chosen = ALL if frames is None else parse_frames(frames)
    done = run(
        source,
        out,
        reading=Reading(skeleton, unit, up, rate, chosen),
        mapping=mapping,
        rotations=rotations,
        out_unit=out_unit,
        out_up=out_up,
        force=force,
    )
    content = done.content
    what = f"{len(content.skeleton)} joints" if isinstance(content, Motion) else "six points"
    screen = Screen()
    screen.say(f"{source}: {what}, {describe.describe_length(len(content), content.rate)}")
    screen.say(describe.describe_files(done.files), style="green")
