"""What a comparison found, in sentences that its numbers choose, so that they stay true."""

from __future__ import annotations

from math import isfinite, isnan

import numpy as np

from sixpoint.study.comparison.averages import (
    QUANTITIES,
    average,
    averaged_clips,
    baseline,
    clip_names,
    correlate,
    divide,
    list_names,
    published_average,
)
from sixpoint.study.comparison.curves import TURN, find_turns
from sixpoint.study.comparison.fitting import describe_use, summarise_fitting
from sixpoint.study.comparison.model import ClipRuns, Comparison
from sixpoint.study.document import Paragraph

NOTABLE = 1.05
"""A ratio below is not worth a word."""
UNITS = {"position": "", "orientation": " rad"}


def summarise(comparison: Comparison) -> tuple[Paragraph, ...]:
    """The findings, the most important first."""
    found = [_describe_runs(comparison), summarise_fitting(comparison)]
    found += [_describe_best(comparison, quantity) for quantity in QUANTITIES]
    found += [_describe_times(comparison), *describe_reference(comparison), _describe_claims(comparison)]
    return tuple(paragraph for paragraph in found if paragraph.text)


def _describe_runs(comparison: Comparison) -> Paragraph:
    clips, rows = clip_names(comparison), comparison.rows
    lengths = {row.clip: row.frames for row in rows if row.frames}
    text = (
        f"{count_of(len(comparison.methods), 'method')} on {count_of(len(clips), 'clip')} "
        f"({count_of(sum(lengths.values()), 'frame')}): {count_of(len(rows), 'run')}, "
    )
    failed = [f"{row.method} on {row.clip}" for row in rows if row.error]
    partly = [f"{row.method} on {row.clip}" for row in rows if row.failed_frames and not row.error]
    missing = len(clips) * len(comparison.methods) - len(rows)
    text += f"{len(failed)} without a result ({_first(failed)})" if failed else "all with a result"
    text += f"; some frames failed in {count_of(len(partly), 'run')} ({_first(partly)})" if partly else ""
    text += f"; {count_of(missing, 'run')} of {len(rows) + missing} not made" if missing > 0 else ""
    return Paragraph(text + ".", "Runs.")


def _describe_best(comparison: Comparison, quantity: str) -> Paragraph:
    """The three smallest averages, and how much larger the last one is."""
    values = {method: average(comparison, method, quantity) for method in comparison.methods}
    order = sorted((value, method) for method, value in values.items() if isfinite(value))
    if not order:
        return Paragraph("")
    unit = UNITS[quantity]
    named = [f"{method} ({value:.4f}{unit})" for value, method in order]
    text = f"{named[0]} is the most accurate"
    if len(named) > 1:
        text += f", then {list_names(named[1:3])}"
    ratio = divide(order[-1][0], order[0][0])
    if len(named) > 3 and not ratio < NOTABLE:
        text += f"; the least accurate is {named[-1]}"
        text += f", {ratio:.1f} times as far off" if isfinite(ratio) else ""
    return Paragraph(
        f"{text}. Means over {list_names(averaged_clips(comparison))}.", f"{quantity.capitalize()} error."
    )


def _describe_times(comparison: Comparison) -> Paragraph:
    base = baseline(comparison)
    values = {method: average(comparison, method, "batch_us") for method in comparison.methods}
    order = sorted((value, method) for method, value in values.items() if isfinite(value))
    if not order:
        return Paragraph("")
    text = f"A frame takes {order[0][0]:.1f} µs with {order[0][1]}, the fastest"
    if len(order) > 1:
        text += f", and {order[-1][0]:.1f} µs with {order[-1][1]}, the slowest"
        ratio = divide(order[-1][0], values.get(base, float("nan")))
        text += f", which is {ratio:.1f} times {base}" if ratio >= NOTABLE and order[-1][1] != base else ""
    return Paragraph(f"{text}.", "Time.")


def describe_reference(comparison: Comparison) -> tuple[Paragraph, ...]:
    """How ours compare to the published numbers: ratios of the averages, and the order of the methods."""
    if comparison.reference is None:
        return ()
    found = []
    for quantity in QUANTITIES:
        ratios = {
            method: divide(
                average(comparison, method, quantity), published_average(comparison, quantity, method)
            )
            for method in comparison.methods
        }
        order = sorted((ratio, method) for method, ratio in ratios.items() if isfinite(ratio))
        if not order:
            continue
        least, most = (f"{ratio:.2f} ({method})" for ratio, method in (order[0], order[-1]))
        text = f"ours are {least} to {most} times as large"
        if len(order) == 1:
            text = f"that of {order[0][1]} is {order[0][0]:.2f} times as large"
        base = ratios.get(baseline(comparison), float("nan"))
        text += f", {baseline(comparison)} {base:.2f}" if isfinite(base) and len(order) > 1 else ""
        rank = correlate(comparison, quantity)
        if not isnan(rank.value):
            text += (
                f"; the order of the {len(rank.methods)} methods that both have agrees with a Spearman "
                f"correlation of {rank.value:.2f}"
            )
        found.append(
            Paragraph(f"{text}.", f"{quantity.capitalize()} error beside {comparison.reference.name}:")
        )
    return tuple(found)


def _describe_claims(comparison: Comparison) -> Paragraph:
    claims = comparison.claims
    if not claims:
        return Paragraph("")
    holds = sum(claim.holds for claim in claims)
    return Paragraph(f"{holds} of {count_of(len(claims), 'tested statement')} hold.", "Statements.")


def describe_clip(comparison: Comparison, clip: str, runs: ClipRuns | None) -> Paragraph:
    """Length, weights, and how much larger the baseline's error is while the pelvis turns around."""
    rows = [row for row in comparison.rows if row.clip == clip]
    text = []
    read = next((row for row in rows if row.frames), None)
    if read is not None:
        text.append(f"{count_of(read.frames, 'frame')} at {read.rate:g} Hz.")
    words = [word for row in rows for word in row.options.split()]
    weights = {word.removeprefix("weights=") for word in words if word.startswith("weights=")}
    if len(weights) == 1:
        text.append(f"Weights of the pelvis estimate, where a method has it: {weights.pop()}.")
    if runs is None:
        text.append("The clip could not be read.")
    elif baseline(comparison) in runs.runs:
        text += _describe_turns(runs, baseline(comparison))
    return Paragraph(" ".join(filter(None, [*text, describe_use(comparison, clip)])))


def _describe_turns(clip: ClipRuns, base: str) -> list[str]:
    """How much of the clip the pelvis turns around, and how far from that the largest error is."""
    curve, fast = clip.runs[base].position, find_turns(clip)
    if not fast.any() or not np.isfinite(curve).any():
        return []
    worst = int(np.nanargmax(curve))
    away = float(np.abs(np.flatnonzero(fast) - worst).min()) / clip.rate
    place = f"{away:.2f} s from the nearest of them" if away else "one of them"
    return [
        f"In {100 * fast.mean():.0f}\u00a0% of the frames the true pelvis turns faster than {TURN:g} rad/s; "
        f"the largest position error of {base}, {curve[worst]:.4f}, is at frame {worst}, {place}."
    ]


def count_of(number: int, noun: str) -> str:
    """A number and its noun, in the plural where it must be."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _first(names: list[str]) -> str:
    """The first few of many."""
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
