"""A motion as a film, as pictures in a folder, or as a contact sheet, without a display."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.body.surface.flesh import build_shape
from sixpoint.errors import FormatError, SixpointError, listed
from sixpoint.formats import load_avatar
from sixpoint.formats.atomic import write_files
from sixpoint.jobs.driving import drive, is_on, open_avatar
from sixpoint.jobs.progress import Progress, silent
from sixpoint.jobs.reading import Reading, is_targets, open_motion
from sixpoint.jobs.writing import check_output, keep_sources, prepare_folder
from sixpoint.render.colours import check_scheme, paint
from sixpoint.render.encoding import encode_film, encode_png, find_codec, lay_out
from sixpoint.render.stage import Actor, Stage, check_view
from sixpoint.render.surface import Surface
from sixpoint.render.tracing import check_libraries

FILM, SHEET = ".mp4", ".png"
SMALLEST, LARGEST = 16, 4096
SHEET_PIXELS = 200_000_000
"""A larger contact sheet is taken for a slip: it is held in memory, and few programs open it."""
NAMED = "frame_{:04d}.png"


@dataclass(frozen=True)
class Look:
    """How pictures look.

    Attributes:
        size: Width and height of each [pixels].
        view: A name in ``VIEWS``.
        follow: The camera travels with the body; None: if it goes far.
        colours: A scheme or a colour, see ``paint``; None: sides apart, of an avatar its own.
        fps: Pictures per second of a film or a folder [Hz]; at most as many as the motion has.
        pictures: Of a contact sheet.
        columns: Of a contact sheet; None: all in a row up to six.
    """

    size: tuple[int, int] = (640, 720)
    view: str = "three-quarter"
    follow: bool | None = None
    colours: str | None = None
    fps: float = 30.0
    pictures: int = 8
    columns: int | None = None

    def check(self) -> None:
        """Refuse what cannot be drawn.

        Raises:
            SixpointError: Naming the option and what it may be.
        """
        if not all(SMALLEST <= side <= LARGEST for side in self.size):
            got = "x".join(map(str, self.size))
            raise SixpointError(f"pictures are {SMALLEST} to {LARGEST} pixels wide and high, got {got}")
        if not 0.1 <= self.fps <= 240.0:
            raise SixpointError(f"a film has 0.1 to 240 pictures per second, got {self.fps:g}")
        if self.pictures < 1 or (self.columns is not None and self.columns < 1):
            raise SixpointError("a sheet has at least one picture and one column")
        check_view(self.view)
        if self.colours is not None:
            check_scheme(self.colours)


@dataclass(frozen=True, eq=False)
class Rendered:
    """What was drawn.

    Attributes:
        figure: Who.
        motion: Which frames were at hand.
        pictures: How many pictures.
        seconds: Time per picture [s].
        files: What was written; of frames their folder.
    """

    figure: Figure
    motion: Motion
    pictures: int
    seconds: float
    files: list[Path] = field(default_factory=list)


def parse_size(text: str) -> tuple[int, int]:
    """A size such as ``640x720``."""
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        raise SixpointError(f"a size is width x height in pixels, e.g. 640x720; got {text!r}") from None
    return width, height


def parse_look(
    out: Path,
    size: str,
    view: str,
    follow: bool | None = None,
    colours: str | None = None,
    fps: float | None = None,
    pictures: int | None = None,
    columns: int | None = None,
) -> Look:
    """How pictures look, from the options of the command line; None: the usual.

    Raises:
        SixpointError: The size cannot be read, or an option is for another kind of output than ``out``.
    """
    if out.suffix.lower() == SHEET:
        other = {"--fps": fps}
        where = "a film (.mp4) or a folder of frames; a .png is a contact sheet, which has --pictures"
    else:
        other = {"--pictures": pictures, "--columns": columns}
        where = "a contact sheet (-o NAME.png); a film or a folder of frames has --fps"
    given = [name for name, value in other.items() if value is not None]
    if given:
        raise SixpointError(f"{out}: {listed(given)}: only for {where}")
    look = Look(parse_size(size), view, follow, colours, columns=columns)
    return replace(
        look,
        fps=look.fps if fps is None else fps,
        pictures=look.pictures if pictures is None else pictures,
    )


def render(
    source: Path,
    out: Path,
    *,
    reading: Reading | None = None,
    look: Look | None = None,
    avatar: Path | None = None,
    over: Path | None = None,
    mapping: Path | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Rendered:
    """Draw a motion.

    Args:
        source: The motion; its rig gets the built-in surface, that of an avatar's file its own.
        out: An .mp4 is a film, a .png a contact sheet; what has no suffix is a folder of frames.
        reading: How to read the source.
        look: How pictures look.
        avatar: A .glb, .gltf or .vrm that is drawn instead. A motion on another skeleton is carried over to
            its proportions and posed anew from its six points.
        over: A second motion, drawn behind the first as a ghost: the truth of a result. It is read with the
            frames of the first.
        mapping: A TOML table role -> joint name, for an unusual rig.
        force: Overwrite existing files.
        progress: Told how far the work is.

    Raises:
        SixpointError: The message says why. Nothing was written, but for the frames of a folder so far.
    """
    reading, look = reading or Reading(), look or Look()
    check_libraries()
    look.check()
    _check_place(out, look, force)
    keep_sources([out], [source, reading.skeleton, avatar, over, mapping])
    actors = [_open_actor(source, reading, mapping, look.colours, avatar, progress)]
    if over is not None:
        ghost = _open_actor(over, Reading(frames=reading.frames), None, "ghost", avatar, progress)
        actors.append(replace(ghost, ghost=True))
    return draw(actors, out, look, force=force, progress=progress)


def draw(
    actors: list[Actor], out: Path, look: Look, *, force: bool = False, progress: Progress = silent
) -> Rendered:
    """Draw actors; see ``render`` for what is written."""
    stage = Stage(actors, look.size, look.view, look.follow)
    motion = actors[0].motion
    frames = _choose_frames(motion, look, out.suffix.lower() == SHEET)
    pixels = len(frames) * look.size[0] * look.size[1]
    if out.suffix.lower() == SHEET and pixels > SHEET_PIXELS:
        raise SixpointError(
            f"{len(frames)} pictures of {look.size[0]}x{look.size[1]} are too much for a sheet: "
            "fewer or smaller ones, or a folder of frames (-o without a suffix)"
        )
    start = time.perf_counter()

    def pictures() -> Iterator[NDArray[np.uint8]]:
        for done, frame in enumerate(frames, 1):
            yield stage.take(int(frame))
            progress("drawing", done, len(frames))

    if out.suffix.lower() == FILM:
        write_files({out: encode_film(pictures(), min(look.fps, motion.rate))}, force)
    elif out.suffix.lower() == SHEET:
        labels = [f"{frame / motion.rate:.2f} s" for frame in frames] if len(frames) > 1 else [""]
        sheet = lay_out(list(pictures()), labels, look.columns or _columns(len(frames)))
        write_files({out: encode_png(sheet)}, force)
    else:
        prepare_folder(out, force)
        for number, picture in enumerate(pictures()):
            write_files({out / NAMED.format(number): encode_png(picture)}, force)
    spent = (time.perf_counter() - start) / len(frames)
    return Rendered(actors[0].figure, motion, len(frames), spent, [out])


def _open_actor(
    source: Path,
    reading: Reading,
    mapping: Path | None,
    colours: str | None,
    avatar: Path | None,
    progress: Progress,
) -> Actor:
    if is_targets(source):
        raise FormatError(source, "six points hold no body; pose one with: sixpoint reconstruct")
    opened = open_motion(source, reading)
    motion = opened.motion
    looks = None
    if avatar is not None:
        looks = open_avatar(avatar)
        figure = looks.figure
        if not is_on(motion, figure):
            owner = opened.find_figure(mapping)
            motion = drive(figure, motion, owner, progress=progress)[1].solution.motion
    elif opened.avatar is not None:
        looks = load_avatar(opened.avatar, mapping)
        figure = looks.figure
    else:
        figure = opened.find_figure(mapping)
    shape = figure.shape or build_shape(figure)
    own = looks.appearance if looks is not None and figure.shape is not None else None
    if own is not None and colours is None:
        return Actor(figure, motion, Surface(shape, own.colours, own.texturing))
    return Actor(figure, motion, Surface(shape, paint(figure, shape, colours or "sides")))


def _choose_frames(motion: Motion, look: Look, sheet: bool) -> NDArray[np.int64]:
    """Evenly chosen ones for a sheet; for a film those at its times."""
    last = len(motion) - 1
    if sheet:
        return np.unique(np.round(np.linspace(0, last, min(look.pictures, last + 1))).astype(np.int64))
    rate = min(look.fps, motion.rate)
    times = np.arange(max(int(np.floor((last + 1e-6) / motion.rate * rate)), 0) + 1) / rate
    return np.minimum(np.round(times * motion.rate).astype(np.int64), last)


def _columns(count: int) -> int:
    """Up to six in a row, rows as even as can be."""
    return -(-count // -(-count // 6))


def _check_place(out: Path, look: Look, force: bool) -> None:
    if not out.suffix:
        if out.exists() and not out.is_dir():
            raise FormatError(out, "this is a file; give a folder")
        if not force and out.is_dir() and any(out.iterdir()):
            raise FormatError(
                out, "exists and is not empty; choose another folder, or use --force to write into it"
            )
        return
    check_output(out, (FILM, SHEET), force, "without a suffix it is a folder of frames")
    if out.suffix.lower() == FILM:
        find_codec()
        if any(side % 2 for side in look.size):
            raise SixpointError(
                f"the size of a film is even in both directions, got {look.size[0]}x{look.size[1]}"
            )
