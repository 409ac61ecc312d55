"""The tables of errors: Table 1 of the paper beside ours, statements, failures. All are plain text cells.

Every number is one of a row's, of the reference's, or a mean over clips that ``averages`` defines.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite

from sixpoint.study.comparison.averages import (
    average,
    averaged_clips,
    clip_names,
    clips_of,
    correlate,
    divide,
    find_result,
    list_names,
    mean_of_published,
    published,
    published_average,
)
from sixpoint.study.comparison.measures import NONE, OURS, THEIRS, describe_missing, number
from sixpoint.study.comparison.model import TEST, Comparison, Row
from sixpoint.study.document import BAD, BEST, GOOD, NEXT, Table

ROUNDING = 1.1e-4  # of a mean of three numbers of four digits, and of the printed mean
PARTLY = "these frames raised, or gave numbers that are not finite"


@dataclass(frozen=True)
class _Column:
    """A column of numbers: its head, what it belongs to, its cells, and whether the best are marked."""

    group: str
    head: str
    cells: list[str]
    ranked: bool = True


def error_table(comparison: Comparison, quantity: str) -> Table:
    """Table 1 of the paper for a quantity: methods down, clips across, ours beside the published."""
    unit = "" if quantity == "position" else " [rad]"
    columns = []
    for clip in clips_of(comparison, TEST):
        ours = [_own(comparison, clip, method, quantity) for method in comparison.methods]
        theirs = [published(comparison, quantity, clip, method) for method in comparison.methods]
        columns += _pair(clip, unit, ours, theirs)
    if len(averaged_clips(comparison)) > 1:
        values = [average(comparison, method, quantity) for method in comparison.methods]
        theirs = [published_average(comparison, quantity, method) for method in comparison.methods]
        ours = [
            describe_missing(comparison, None, method) or number(value, 4)
            for method, value in zip(comparison.methods, values, strict=True)
        ]
        columns += _pair("average", unit, ours, theirs)
        if any(map(isfinite, theirs)):
            ratios = [number(divide(*pair), 2) for pair in zip(values, theirs, strict=True)]
            columns.append(_Column("average", f"{OURS} / {THEIRS}", ratios, ranked=False))
    ranks = [_best(column.cells) if column.ranked else {} for column in columns]
    kind = "mean joint distance over H" if quantity == "position" else "mean joint angle"
    return Table(
        title=f"{quantity.capitalize()} error: RMS over frames of the {kind}",
        columns=("method", *(column.head for column in columns)),
        rows=tuple(zip(comparison.methods, *(column.cells for column in columns), strict=True)),
        groups=("", *(column.group for column in columns)),
        marks={(i, k): mark for k, marks in enumerate(ranks, 1) for i, mark in marks.items()},
        note=_error_note(comparison, quantity),
    )


def _pair(group: str, unit: str, ours: list[str], theirs: list[float]) -> list[_Column]:
    """A column of ours and, if there is any published number, one of them."""
    columns = [_Column(group, OURS + unit, ours)]
    if any(map(isfinite, theirs)):
        columns.append(_Column(group, THEIRS + unit, [number(value, 4) for value in theirs]))
    return columns


def _own(comparison: Comparison, clip: str, method: str, name: str) -> str:
    row = find_result(comparison, clip, method)
    return describe_missing(comparison, clip, method) or number(float(getattr(row, name)), 4)


def _error_note(comparison: Comparison, quantity: str) -> str:
    clips = averaged_clips(comparison)
    note = "The best of each column is bold, the next two are in italics."
    if len(clips) > 1:
        note += f" The average is the mean over {list_names(clips)}."
    if not comparison.reference:
        return note
    odd = [
        f"{method} ({printed:.4f}, but its clips have a mean of {mean:.4f})"
        for method in comparison.methods
        for printed in [published_average(comparison, quantity, method)]
        for mean in [mean_of_published(comparison, quantity, method)]
        if abs(printed - mean) > ROUNDING
    ]
    rank = correlate(comparison, quantity)
    note += f" Reference: {comparison.reference.name}."
    if isfinite(rank.value):
        note += (
            f" Rank correlation of the averages: {rank.value:.2f} (Spearman, {len(rank.methods)} methods)."
        )
    if odd:
        note += f" Its printed average is not that of the printed clips for {list_names(odd)}."
    return note


def _best(cells: Sequence[str]) -> dict[int, str]:
    """Row -> mark of the three smallest numbers; equal ones share theirs, other cells have none."""
    values = {i: float(cell) for i, cell in enumerate(cells) if cell.replace(".", "").isdigit()}
    ranks = {i: sum(other < value for other in values.values()) for i, value in values.items()}
    return {i: NEXT if rank else BEST for i, rank in ranks.items() if rank < 3}


def failure_table(comparison: Comparison) -> Table | None:
    """Every run that failed, wholly or on some frames, with its reason; None if there is none.

    Where all methods failed on a clip for one reason, they share a line.
    """
    lines: list[tuple[str, ...]] = []
    for clip in clip_names(comparison):
        rows = [row for row in comparison.rows if row.clip == clip]
        reasons = {row.method: _explain(row) for row in rows if row.error or row.failed_frames}
        if len(reasons) == len(comparison.methods) > 1 and rows[0].error and len({*reasons.values()}) == 1:
            reasons = {"all methods": _explain(rows[0])}
        lines += [(clip, method, *reason) for method, reason in reasons.items()]
    columns = ("clip", "method", "frames failed", "of", "reason")
    return Table("", columns, tuple(lines), prose=True) if lines else None


def _explain(row: Row) -> tuple[str, str, str]:
    """How many frames failed, of how many, and why; a clip that could not be read has none."""
    counts = (f"{row.failed_frames}", f"{row.frames}") if row.frames else (NONE, NONE)
    return (*counts, row.error or PARTLY)


def claim_table(comparison: Comparison) -> Table:
    """Statements, what was measured, and whether they hold."""
    rows = tuple((claim.text, claim.measured, "yes" if claim.holds else "no") for claim in comparison.claims)
    marks = {(i, 2): GOOD if claim.holds else BAD for i, claim in enumerate(comparison.claims)}
    return Table("", ("statement", "measured", "holds"), rows, marks=marks, prose=True)


def pair_table(columns: tuple[str, str], pairs: Iterable[tuple[str, str]]) -> Table:
    """Names and what they mean."""
    return Table("", columns, tuple(pairs), prose=True)
