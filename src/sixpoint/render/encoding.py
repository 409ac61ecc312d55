"""Pictures as files: PNG, contact sheets with times, and H.264 films."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from io import BytesIO
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from sixpoint.errors import SixpointError

if TYPE_CHECKING:
    from av.video.stream import VideoStream

Picture = NDArray[np.uint8]

CODECS: tuple[tuple[str, dict[str, str]], ...] = (
    ("libx264", {"crf": "18", "preset": "medium"}),
    ("libopenh264", {}),
    ("mpeg4", {"q": "3"}),
)
"""In the order in which they are tried: PyAV brings the first, some systems' own FFmpeg does not."""
INK, PAPER = (34, 48, 60), (255, 255, 255)
GAP = 4
"""Between the pictures of a sheet [pixels]."""


def encode_png(picture: Picture) -> bytes:
    """A picture (height, width, 3) as PNG."""
    from PIL import Image

    out = BytesIO()
    Image.fromarray(picture).save(out, "PNG", optimize=True)
    return out.getvalue()


def lay_out(pictures: Sequence[Picture], labels: Sequence[str], columns: int) -> Picture:
    """A contact sheet: pictures of one size in rows, each with a label in its upper left corner.

    Args:
        pictures: (height, width, 3) each.
        labels: One for each; may be empty.
        columns: Pictures in a row.
    """
    from PIL import Image, ImageDraw, ImageFont

    tall, wide = pictures[0].shape[:2]
    columns = min(columns, len(pictures))
    rows = -(-len(pictures) // columns)
    sheet = Image.new("RGB", (columns * (wide + GAP) - GAP, rows * (tall + GAP) - GAP), PAPER)
    font = ImageFont.load_default(max(11.0, 0.036 * tall))
    for number, (picture, label) in enumerate(zip(pictures, labels, strict=True)):
        image = Image.fromarray(picture)
        ImageDraw.Draw(image).text((0.03 * tall, 0.025 * tall), label, fill=INK, font=font)
        sheet.paste(image, (number % columns * (wide + GAP), number // columns * (tall + GAP)))
    return np.asarray(sheet)


def encode_film(pictures: Iterable[Picture], rate: float) -> bytes:
    """An MP4 of pictures (height, width, 3) of one size, even in both directions.

    Args:
        pictures: One after the other.
        rate: Pictures per second [Hz].

    Raises:
        SixpointError: No codec, or no picture.
    """
    import av

    name, options = find_codec()
    file = BytesIO()
    with av.open(file, "w", format="mp4") as film:
        stream: VideoStream | None = None
        for picture in pictures:
            if stream is None:
                added = film.add_stream(
                    name, rate=Fraction(rate).limit_denominator(10000), options=dict(options)
                )
                stream = cast("VideoStream", added)
                stream.height, stream.width = picture.shape[:2]
                stream.pix_fmt = "yuv420p"
            film.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        if stream is None:
            raise SixpointError("a film needs at least one picture")
        film.mux(stream.encode(None))
    return file.getvalue()


def find_codec() -> tuple[str, dict[str, str]]:
    """The first of ``CODECS`` that this FFmpeg can write, and its options.

    Raises:
        SixpointError: None of them.
    """
    import av

    for name, options in CODECS:
        try:
            av.Codec(name, "w")
        except ValueError:  # av.codec.codec.UnknownCodecError
            continue
        return name, options
    raise SixpointError(
        f"PyAV can write none of {', '.join(n for n, _ in CODECS)}; write frames instead: -o FOLDER"
    )
