"""The report of a comparison of methods: one HTML page that needs nothing else, and the same in Markdown.

A pure function of a ``Comparison``: what is drawn and said comes from it alone. Everything is drawn before
anything is written.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING

from sixpoint.errors import FormatError
from sixpoint.formats.atomic import write_files
from sixpoint.jobs.progress import Progress, silent

if TYPE_CHECKING:
    from sixpoint.study.comparison.model import ClipRuns, Comparison
    from sixpoint.study.document import Block, Document, Picture

PAGE, TEXT, PICTURES = "report.html", "report.md", "pictures"
WRITTEN = "runs/pictures.txt"
"""The names of the pictures of the last report, which the next one may delete."""

DEFINITIONS = (
    (
        "Position error",
        "In each frame the mean distance of the measured joints to their true places, over H; of that the "
        "root mean square over frames. H is the summed length of the figure's calf, thigh, pelvis, torso and "
        "neck, which is less than its stature.",
    ),
    (
        "Orientation error",
        "In each frame the mean angle of the measured joints' rotations to the true ones, the root in the "
        "world and the others against their parent; of that the root mean square over frames.",
    ),
    (
        "Independent",
        "All errors and qualities are measured by forward kinematics on the written motions; no solver's own "
        "word is taken. A method without a result on a clip has no average over clips.",
    ),
)


def write_report(comparison: Comparison, folder: Path, progress: Progress = silent) -> list[Path]:
    """Draw a comparison and write ``report.html``, ``report.md`` and ``pictures/``; older ones are replaced.

    Pictures that the report before wrote, and this one has no more, are deleted.

    Args:
        comparison: What is reported.
        folder: Where to write; it is made.
        progress: Told how many pictures are drawn.

    Returns:
        The files: the page, the Markdown, the pictures.

    Raises:
        FormatError: The folder cannot be made, or a file not be written. Nothing was replaced.
    """
    from sixpoint.study.document import to_markdown
    from sixpoint.study.document_html import to_html

    document = build_document(comparison, progress)
    contents = {
        folder / PAGE: to_html(document).encode(),
        folder / TEXT: to_markdown(document, PICTURES).encode(),
        **{folder / PICTURES / picture.name: picture.data for picture in document.pictures},
    }
    written = folder / WRITTEN
    for place in dict.fromkeys(path.parent for path in (*contents, written)):
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FormatError(place, f"the folder cannot be made: {error.strerror}") from error
    write_files(contents, force=True)
    names = [picture.name for picture in document.pictures]
    names += _delete_pictures(folder / PICTURES, _read_names(written) - {*names})
    write_files({written: "".join(f"{name}\n" for name in names).encode()}, force=True)
    return list(contents)


def _read_names(written: Path) -> set[str]:
    """Plain names of PNG files in a list; whatever else it says is left alone."""
    try:
        names = written.read_text("utf-8").split("\n")
    except (OSError, UnicodeDecodeError):
        return set()
    return {name for name in names if re.fullmatch(r"[a-z0-9][a-z0-9-]*\.png", name)}


def _delete_pictures(folder: Path, names: set[str]) -> list[str]:
    """Delete files; returns those that could not be."""
    kept = []
    for name in sorted(names):
        try:
            (folder / name).unlink(missing_ok=True)
        except OSError:
            kept.append(name)
    return kept


def build_document(comparison: Comparison, progress: Progress = silent) -> Document:
    """Everything the report says and shows; told of every picture."""
    from sixpoint.study.comparison.curves import has_window
    from sixpoint.study.comparison.fitting import say_fitted
    from sixpoint.study.comparison.summary import summarise
    from sixpoint.study.document import Bullets, Document, Heading, Picture

    total = 1 + sum(2 + has_window(clip) for clip in comparison.clips)
    drawn = 0
    progress("drawing", drawn, total)
    blocks: list[Block] = [Heading("Summary"), Bullets(summarise(comparison))]
    measured = (say_fitted(block, comparison) for block in chain(_results(comparison), _clips(comparison)))
    for block in chain(measured, _background(comparison)):
        blocks.append(block)
        if isinstance(block, Picture) and drawn < total - 1:
            drawn += 1
            progress("drawing", drawn, total)
    progress("drawing", total, total)
    return Document(comparison.title, tuple(blocks))


def _results(comparison: Comparison) -> Iterator[Block]:
    """Statements, errors, times and qualities over all clips, failures."""
    from sixpoint.study.comparison import measures, tables
    from sixpoint.study.comparison.averages import QUANTITIES, averaged_clips, clips_of
    from sixpoint.study.comparison.curves import encode
    from sixpoint.study.comparison.fitting import USES, split_table
    from sixpoint.study.comparison.model import TEST
    from sixpoint.study.comparison.trade import draw_trade
    from sixpoint.study.document import Heading, Paragraph, Picture

    if comparison.claims:
        yield Heading("Statements tested")
        yield tables.claim_table(comparison)
    yield Heading("Accuracy")
    if not clips_of(comparison, TEST):
        text = "A method was fitted on, or chosen by, each of these recordings: add others, or leave it out."
        yield Paragraph(text, "No recording is left to test on.")
    else:
        yield from (tables.error_table(comparison, quantity) for quantity in QUANTITIES)
    canvas = draw_trade(comparison)
    if canvas is not None:
        caption = "Position error against the time of a frame, both logarithmic; lower left is better."
        yield Picture("error-against-time.png", encode(canvas), caption)
    if len(averaged_clips(comparison)) > 1:
        yield measures.reading_table(comparison)
        yield Heading("Time")
        yield measures.time_table(comparison)
        yield Heading("Quality")
        yield measures.quality_table(comparison)
    for split, use in USES.items():
        table = split_table(comparison, split)
        if table:
            yield Heading(f"Recordings {use}")
            yield table
    failures = tables.failure_table(comparison)
    if failures:
        yield Heading("Failures")
        yield failures


def _clips(comparison: Comparison) -> Iterator[Block]:
    """Pictures and tables of every clip."""
    from sixpoint.study.comparison import measures
    from sixpoint.study.comparison.averages import clip_names
    from sixpoint.study.comparison.summary import describe_clip
    from sixpoint.study.document import Heading

    drawn = {clip.name: clip for clip in comparison.clips}
    used: set[str] = set()
    for name in clip_names(comparison):
        yield Heading(f"Clip: {name}")
        yield describe_clip(comparison, name, drawn.get(name))
        if name in drawn:
            yield from _pictures(comparison, drawn[name], _file_name(name, used))
        if any(row.clip == name and not row.error for row in comparison.rows):
            yield measures.quality_table(comparison, name)
            yield measures.time_table(comparison, name)
            yield measures.reading_table(comparison, name)


def _pictures(comparison: Comparison, clip: ClipRuns, name: str) -> Iterator[Picture]:
    from sixpoint.study.comparison.averages import baseline, explain_missing
    from sixpoint.study.comparison.curves import draw_errors, encode, has_window
    from sixpoint.study.comparison.poses import draw_poses
    from sixpoint.study.document import Picture

    methods, base = comparison.methods, baseline(comparison)
    missing = {m: explain_missing(comparison, clip.name, m) for m in methods if m not in clip.runs}
    what = "position and orientation error of each method, all panels on one scale"
    canvas = draw_errors(clip, methods, missing, base)
    yield Picture(f"{name}-errors.png", encode(canvas), f"{clip.name}: {what}.")
    if has_window(clip):
        begin, end = clip.window
        canvas = draw_errors(clip, methods, missing, base, clip.window)
        yield Picture(f"{name}-window.png", encode(canvas), f"{clip.name}, frames {begin} to {end}: {what}.")
    caption = (
        f"{clip.name}, frame {clip.frame}: each method over the truth, seen from the figure's front left."
    )
    yield Picture(f"{name}-poses.png", encode(draw_poses(clip, methods, missing)), caption)


def _file_name(clip: str, used: set[str]) -> str:
    """A name for files of a clip, which no other clip has."""
    plain = re.sub(r"[^a-z0-9]+", "-", clip.lower()).strip("-")[:60] or "clip"
    name = next(n for n in chain([plain], (f"{plain}-{k}" for k in count(2))) if n not in used)
    used.add(name)
    return name


def _background(comparison: Comparison) -> Iterator[Block]:
    """What the methods are, what errors mean, on what it was measured, and what to keep in mind."""
    from sixpoint.study.comparison.tables import pair_table
    from sixpoint.study.document import Bullets, Heading, Paragraph

    if comparison.presets:
        yield Heading("Methods")
        yield pair_table(("method", "preset"), comparison.presets.items())
    yield Heading("How it was measured")
    yield Bullets(tuple(Paragraph(text, f"{lead}.") for lead, text in DEFINITIONS))
    for title, sentences in (("Notes", comparison.notes), ("Known limitations", comparison.limitations)):
        if sentences:
            yield Heading(title)
            yield Bullets(tuple(Paragraph(sentence) for sentence in sentences))
    if comparison.facts:
        yield Heading("Machine and versions")
        yield pair_table(("what", "value"), comparison.facts)
