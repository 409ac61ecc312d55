"""``sixpoint render``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from sixpoint.cli.options import Force, Frames, Mapping, Rate, Skeleton, Unit, Up
from sixpoint.cli.screen import Screen


def render(
    file: Annotated[Path, Parameter(help="A motion (.bvh, .amc, .glb, .vrma ..).")],
    /,
    *,
    out: Annotated[
        Path | None,
        Parameter(
            name=("--out", "-o"),
            help="An .mp4 is a film, a .png a contact sheet, and what has no suffix a folder of frames; by "
            "default `<name>.mp4` in this folder.",
        ),
    ] = None,
    avatar: Annotated[
        Path | None,
        Parameter(help="An avatar (.glb, .gltf, .vrm) to draw, whatever the motion's own body is."),
    ] = None,
    over: Annotated[
        Path | None,
        Parameter(help="A second motion, drawn behind the first as a ghost: a result over its truth."),
    ] = None,
    size: Annotated[str, Parameter(help="Width and height of a picture [pixels].")] = "640x720",
    view: Annotated[
        Literal["front", "three-quarter", "side", "back"],
        Parameter(help="From where, seen from where the body faces on average."),
    ] = "three-quarter",
    follow: Annotated[
        bool | None,
        Parameter(help="Move the camera with the body; by default only where the body goes far."),
    ] = None,
    colours: Annotated[
        str | None,
        Parameter(
            help="`sides` (left and right apart), `clay`, `ghost`, or a colour such as `#c8b090`; by "
            "default sides, of an avatar its own."
        ),
    ] = None,
    fps: Annotated[
        float | None, Parameter(help="Pictures per second of a film or a folder; by default 30.")
    ] = None,
    pictures: Annotated[int | None, Parameter(help="Of a contact sheet; by default 8.")] = None,
    columns: Annotated[int | None, Parameter(help="Of a contact sheet.")] = None,
    frames: Frames = None,
    skeleton: Skeleton = None,
    mapping: Mapping = None,
    unit: Unit = None,
    up: Up = None,
    rate: Rate = None,
    force: Force = False,
) -> None:
    """Draw a motion: a film, a contact sheet, or a folder of pictures.

    The body of its rig is made from its proportions; an avatar's is its own. Neither a display nor a graphics
    card is needed, but Embree, PyAV and Pillow are: `pip install "sixpoint[render]"`.

    For example:

    ```
    sixpoint render walk.bvh                                   # walk.mp4
    sixpoint render result.bvh --over walk.bvh -o result.mp4   # the truth as a ghost
    sixpoint render walk.bvh -o walk.png --pictures 12 --view side
    sixpoint render walk.bvh -o still.png --frames 120 --size 800x900
    sixpoint render walk.bvh -o frames --fps 10
    sixpoint render walk.bvh --avatar robot.glb -o robot.mp4
    ```
    """
    from sixpoint.cli import describe
    from sixpoint.jobs.reading import ALL, Reading, parse_frames
    from sixpoint.jobs.render import parse_look
    from sixpoint.jobs.render import render as run

    chosen = ALL if frames is None else parse_frames(frames)
    place = out or Path(f"{file.stem}.mp4")
    look = parse_look(place, size, view, follow, colours, fps, pictures, columns)
    screen = Screen()
    with screen.progress() as progress:
        done = run(
            file,
            place,
            reading=Reading(skeleton, unit, up, rate, chosen),
            look=look,
            avatar=avatar,
            over=over,
            mapping=mapping,
            force=force,
            progress=progress,
        )
    screen.say(f"{file}: {describe.describe_length(len(done.motion), done.motion.rate)}", style="bold")
    drawn = f"{describe.plural(done.pictures, 'picture')} of {size}, {done.seconds:.2f} s each"
    screen.rows([("drawn", drawn)])
    screen.say(describe.describe_files(done.files), style="green")
