"""What a report on followed markers says and shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sixpoint.errors import listed
from sixpoint.formats.atomic import write_files
from sixpoint.jobs.track.job import Tracking
from sixpoint.jobs.track.models import FEWEST, near_pairs
from sixpoint.jobs.writing import prepare_folder
from sixpoint.signals.gaps import find_runs
from sixpoint.study.canvas import save_canvas
from sixpoint.study.comparison.curves import encode
from sixpoint.study.document import Bullets, Document, Heading, Paragraph, Picture, Table, to_markdown
from sixpoint.study.document_html import to_html
from sixpoint.study.tracking import MarkerRow, draw_residuals, draw_tracking, overall, summarise_markers

PAGE, TEXT, PICTURES = "report.html", "report.md", "pictures"


def write_picture(done: Tracking, path: Path) -> Path:
    """The body and the markers at some frames, as a PNG."""
    return save_canvas(_poses(done), path)


def write_report(done: Tracking, folder: Path, force: bool = False) -> list[Path]:
    """Write the report into a folder: a page, Markdown and pictures; returns the files.

    Raises:
        FormatError: The folder is not empty, or cannot be made or written.
    """
    prepare_folder(folder, force)
    (folder / PICTURES).mkdir(exist_ok=True)
    document = build_document(done)
    contents = {
        folder / PAGE: to_html(document).encode(),
        folder / TEXT: to_markdown(document, PICTURES).encode(),
        **{folder / PICTURES / picture.name: picture.data for picture in document.pictures},
    }
    write_files(contents, force=True)
    return list(contents)


def build_document(done: Tracking) -> Document:
    """Everything the report says and shows."""
    tracked, markers, names = done.tracked, done.markers, done.model.names
    rows = summarise_markers(names, tracked.residual, tracked.flags)
    curves = draw_residuals(rows, tracked.residual, tracked.flags, markers.rate, markers.name)
    return Document(
        f"Markers of {markers.name}",
        (
            Heading("Summary"),
            Bullets(tuple(Paragraph(text, lead) for lead, text in describe_tracking(done))),
            Picture(
                "poses.png", encode(_poses(done)), "The body that follows, and the markers, at some frames."
            ),
            Heading("Residuals"),
            Paragraph(
                "A residual is the distance of a measured marker from its place on the figure: moving skin, "
                "what a figure of rods cannot do, and errors of the calibration. In refused frames a marker "
                "was there, but not where it could be."
            ),
            Picture("residuals.png", encode(curves), "By marker, the worst first, and over time."),
            Table("Markers, the worst first", COLUMNS, tuple(tuple(row_cells(row)) for row in rows)),
        ),
    )


COLUMNS = ("marker", "RMS [cm]", "worst [cm]", "at frame", "seen", "refused", "swapped")


def row_cells(row: MarkerRow) -> list[str]:
    """The cells of a marker under ``COLUMNS``."""
    known = np.isfinite(row.rms)
    return [
        row.name,
        f"{100 * row.rms:.2f}" if known else "",
        f"{100 * row.worst:.1f}" if known else "",
        str(row.frame) if known else "",
        f"{row.seen:.1%}",
        str(row.refused),
        str(row.swapped),
    ]


def describe_tracking(done: Tracking) -> list[tuple[str, str]]:
    """Heads and texts: residual, gaps, what was refused, speed, what has no markers."""
    tracked, rate = done.tracked, done.markers.rate
    there = [k for k, name in enumerate(done.model.names) if name in done.markers.names]
    seen = tracked.flags[:, there] != 1
    rms, count = 100 * overall(tracked.residual, tracked.flags), len(there)
    times, spent = 1 / max(done.seconds, 1e-9), 1e3 * done.seconds / rate
    rows = [
        ("residual", f"RMS {rms:.2f} cm over {count} markers"),
        ("samples", f"{seen.mean():.1%} seen; {_counted(tracked.flags == 2, done)} refused as ghosts"),
        ("speed", f"{times:.0f} times real time ({spent:.2f} ms per frame)"),
    ]
    told = np.isin(tracked.flags, (0, 3)).sum(axis=1) >= FEWEST
    if not told.all():
        frames = [f"{a} to {b - 1}" if b - a > 1 else f"{a}" for a, b in find_runs(~told)]
        rows.append(("nobody", f"to be seen in frames {listed(frames, 8)}: what is written there is a guess"))
    if done.calibration:
        rows.insert(0, ("calibration", f"{done.calibration:.1f} s; --model reuses a saved one"))
    swapped = tracked.flags == 3
    if swapped.any():
        rows.append(("swapped", f"{_counted(swapped, done)} found under each other's labels"))
    near = near_pairs(done.model)
    if near:
        rows.append(("close", f"a swap would not be noticed: {listed([f'{a} and {b}' for a, b in near])}"))
    if done.widened:
        lifted = [name for name, by in done.widened.items() if not np.isfinite(by)]
        wider = [f"{name} by {np.degrees(by):.0f}" for name, by in done.widened.items() if np.isfinite(by)]
        if wider:
            rows.append(("limits", f"widened where the markers go beyond [degrees]: {listed(wider)}"))
        if lifted:
            rows.append(("no limits", f"of {listed(lifted)}: the markers are more than 15 degrees beyond"))
    if done.model.missing:
        rows.append(("without markers", f"{listed(done.model.missing)}: kept near the neutral posture"))
    if done.stances is not None:
        left, right = done.stances.mean(axis=0)
        rows.append(("feet", f"held in {left:.0%} (left) and {right:.0%} (right) of the frames"))
    return rows


def _counted(flags: np.ndarray, done: Tracking) -> str:
    """How many samples, and of which markers."""
    count = int(flags.sum())
    if not count:
        return "none"
    worst = np.argsort(-flags.sum(axis=0), kind="stable")
    names = [done.model.names[k] for k in worst if flags[:, k].any()]
    return f"{count} ({listed(names[:6])}{', ...' if len(names) > 6 else ''})"


def _poses(done: Tracking):  # type: ignore[no-untyped-def]
    """What is written: the body that follows, or the one that six points pose."""
    motion = done.tracked.motion if done.six is None else done.six[1].solution.motion
    return draw_tracking(done.model.figure, motion, done.positions, done.tracked.flags, done.markers.name)
