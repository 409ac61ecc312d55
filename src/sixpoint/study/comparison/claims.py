"""The statements of a paper about its methods, each put to the test on our own numbers.

Reference: Unzueta et al. 2008, section 9.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import ceil

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from sixpoint.study.comparison.averages import average, clips_of
from sixpoint.study.comparison.curves import TURN, find_turns
from sixpoint.study.comparison.model import TEST, Claim, ClipRuns, Comparison

Array = NDArray[np.float64]

JACOBIAN = ("pinv", "dls", "dls-svd", "sdls")
COMPARED = ("sik", "tgbsik", "kma", "ccd", "jt", *JACOBIAN, "pik")  # the methods that the paper compares
PEAKS = 5  # so many of the highest are looked at
APART = 0.5  # maxima that are closer belong to one peak [s]
HIGH = 90.0  # percentile of the error that a peak exceeds
MINIMUM = 50  # frames below which there is nothing to call a peak
AROUND = 0.25  # a turn this long before or after a frame belongs to it [s]
MOST, MORE = 0.6, 1.2  # share of the peaks that must be near a turn, and over the share of all frames


def check_claims(comparison: Comparison, claims: str) -> tuple[Claim, ...]:
    """All statements of a set that the comparison's methods and clips allow to test."""
    makers = CLAIMS.get(claims, ())
    return tuple(claim for make in makers for claim in make(comparison))


def _known(comparison: Comparison, *methods: str) -> bool:
    return all(np.isfinite(average(comparison, method, "position")) for method in methods)


def _clip(comparison: Comparison, name: str) -> ClipRuns | None:
    return next((clip for clip in comparison.clips if clip.name == name), None)


def _listed(values: Sequence[tuple[str, str]]) -> str:
    return ", ".join(f"{name} {value}" for name, value in values)


def _transpose_is_worst(c: Comparison) -> Iterator[Claim]:
    others = [m for m in c.methods if m in COMPARED and m != "jt" and _known(c, m)]
    if not others or not _known(c, "jt"):
        return
    errors = {m: average(c, m, "position") for m in (*others, "jt")}
    worst = max(others, key=lambda m: errors[m])
    yield Claim(
        "Jacobian transpose gives the poorest results (Figure 14).",
        f"Position error of jt {errors['jt']:.4f}, of the others at most {errors[worst]:.4f} ({worst}).",
        errors["jt"] > errors[worst],
    )
    misses = {m: 1000 * average(c, m, "residual_mean") for m in errors}
    worst = max(others, key=lambda m: misses[m])
    yield Claim(
        "Jacobian transpose leaves its effectors far from their targets, farther than any other method.",
        f"The farthest effector of jt is {misses['jt']:.1f} mm off on average, of the others at most "
        f"{misses[worst]:.1f} mm ({worst}).",
        misses["jt"] > misses[worst],
    )


def _best_four(c: Comparison) -> Iterator[Claim]:
    four, rest = ("sik", "tgbsik", "pik", "kma"), ("ccd", *JACOBIAN)
    if not _known(c, *four, *rest):
        return
    means = {m: average(c, m, "position") for m in (*four, *rest)}
    order = sorted(means, key=lambda m: means[m])
    yield Claim(
        "SIK, TGBSIK, PIK and KMA reconstruct best.",
        f"By average position error: {_listed([(m, f'{means[m]:.4f}') for m in order])}.",
        set(order[:4]) == set(four),
    )


def _sik_is_best(c: Comparison) -> Iterator[Claim]:
    if not _known(c, "sik"):
        return
    for column, what in (("position", "position"), ("orientation", "orientation")):
        means = {m: average(c, m, column) for m in c.methods if m in COMPARED and _known(c, m)}
        best = min(means, key=lambda m: means[m])
        yield Claim(
            f"SIK has the least average {what} error of all methods.",
            f"sik {means['sik']:.4f}; the best is {best} with {means[best]:.4f}.",
            best == "sik",
        )


def _fast_ones(c: Comparison) -> Iterator[Claim]:
    fast, slow = ("sik", "kma", "ccd", "tgbsik"), (*JACOBIAN, "pik")
    if not _known(c, *fast, *slow):
        return
    times = {m: average(c, m, "batch_us") for m in (*fast, *slow)}
    order = sorted(times, key=lambda m: times[m])
    yield Claim(
        "SIK, KMA, CCD and TGBSIK are considerably faster than the others.",
        f"Microseconds per frame: {_listed([(m, f'{times[m]:.1f}') for m in order])}.",
        max(times[m] for m in fast) < min(times[m] for m in slow),
    )


def _clavicles(c: Comparison) -> Iterator[Claim]:
    if _known(c, "sik", *JACOBIAN):
        angles = {m: np.degrees(average(c, m, "clavicle")) for m in ("sik", *JACOBIAN)}
        truth = np.degrees(average(c, "sik", "clavicle_truth"))
        yield Claim(
            "Clavicles move more with the Jacobian methods than with SIK.",
            f"Mean angle from rest in degrees: {_listed([(m, f'{a:.1f}') for m, a in angles.items()])}; "
            f"truth {truth:.1f}.",
            all(angles[m] > angles["sik"] for m in JACOBIAN),
        )
    if _known(c, "pik", *JACOBIAN):
        angles = {m: np.degrees(average(c, m, "clavicle")) for m in ("pik", *JACOBIAN)}
        yield Claim(
            "PIK, drawn to a relaxed posture, holds its clavicles more naturally than the Jacobian methods.",
            f"Mean angle from rest in degrees: {_listed([(m, f'{a:.1f}') for m, a in angles.items()])}.",
            all(angles[m] > angles["pik"] for m in JACOBIAN),
        )


def _ccd_grows(c: Comparison) -> Iterator[Claim]:
    clip = _clip(c, "boxing")
    if clip is None or not {"ccd", "sik"} <= set(clip.runs):
        return
    growth = {}
    for method in ("ccd", "sik"):
        curve = clip.runs[method].position
        third = len(curve) // 3
        growth[method] = float(curve[-third:].mean() / curve[:third].mean())
    yield Claim(
        "CCD's error grows with time in the boxing clip (Figure 15).",
        f"Mean position error of the last third over that of the first: ccd {growth['ccd']:.2f}, sik, which "
        f"remembers no limb, {growth['sik']:.2f}.",
        growth["ccd"] > 1.1 * growth["sik"],
    )


def _ccd_bends_from_head(c: Comparison) -> Iterator[Claim]:
    if not _known(c, "ccd", "sik", "kma"):
        return
    share = {m: average(c, m, "bend_top") for m in ("ccd", "kma", "sik")}
    truth = average(c, "sik", "bend_top_truth")
    yield Claim(
        "With CCD the spine bends from the head, like a snake.",
        "Share of the trunk's bending done by its upper half: "
        f"ccd {share['ccd']:.2f}, sik {share['sik']:.2f}, truth {truth:.2f}.",
        share["ccd"] > max(share["sik"], truth) + 0.05,
    )
    yield Claim(
        "With KMA, which starts each frame from rest, that is less noticeable.",
        f"The same share: kma {share['kma']:.2f}, ccd {share['ccd']:.2f}.",
        share["kma"] < share["ccd"],
    )


def _swivel_jumps(c: Comparison) -> Iterator[Claim]:
    rows = {m: c.row("playground", m) for m in ("kma", "tgbsik", "sik")}
    jumps = {m: row.swivel_jumps for m, row in rows.items() if row is not None and not row.error}
    if len(jumps) < len(rows):
        return
    row = rows["sik"]
    assert row is not None
    yield Claim(
        "KMA and TGBSIK have abrupt changes of swivel angles in the playground that SIK lacks.",
        f"Changes above 30 degrees in a frame: {_listed([(m, f'{n:.0f}') for m, n in jumps.items()])}; "
        f"truth {row.swivel_jumps_truth:.0f}.",
        min(jumps["kma"], jumps["tgbsik"]) > max(2.0 * jumps["sik"], jumps["sik"] + 1),
    )


def _peaks_at_turns(c: Comparison) -> Iterator[Claim]:
    tests = clips_of(c, TEST)
    for clip in c.clips:
        first, last = clip.window
        runs = [run for method, run in clip.runs.items() if method in COMPARED]
        if clip.name not in tests or not runs or last - first < MINIMUM:
            continue
        error = np.mean([run.position[first:last] for run in runs], axis=0)
        peaks = find_peaks_apart(error, clip.rate)
        if not len(peaks):
            continue
        near = _near_turns(clip)[first:last]
        count, usual = int(near[peaks].sum()), float(near.mean())
        others = ", ".join(str(first + peak) for peak in peaks[1:])
        also = f", others at {others}" if others else ""
        yield Claim(
            f"Errors peak at quick turn-arounds: {clip.name}, frames {first} to {last} (Figures 16 to 18).",
            f"The mean error of the paper's methods has its highest peak at frame {first + peaks[0]}{also}. "
            f"Within a quarter of a second of the true pelvis turning faster than {TURN:g} rad/s are {count} "
            f"of {len(peaks)} separate peaks, and {100 * usual:.0f} % of all frames.",
            count >= MOST * len(peaks) and count >= MORE * usual * len(peaks),
        )


def find_peaks_apart(error: Array, rate: float) -> NDArray[np.intp]:
    """The highest local maxima of a curve's upper tenth, some time apart, the highest first.

    Args:
        error: (F,) the curve.
        rate: Frames per second [Hz].
    """
    apart = max(1, ceil(APART * rate))
    peaks, _ = signal.find_peaks(error, height=np.percentile(error, HIGH), distance=apart)
    return np.asarray(peaks[np.argsort(-error[peaks], kind="stable")][:PEAKS])


def _near_turns(clip: ClipRuns) -> NDArray[np.bool_]:
    """(F,) whether the true pelvis turns around a little before or after."""
    half = round(AROUND * clip.rate)
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(find_turns(clip), half), 2 * half + 1)
    return np.asarray(windows.any(axis=1))


CLAIMS: dict[str, tuple[Callable[[Comparison], Iterator[Claim]], ...]] = {
    "unzueta2008": (
        _sik_is_best,
        _best_four,
        _transpose_is_worst,
        _clavicles,
        _ccd_grows,
        _ccd_bends_from_head,
        _swivel_jumps,
        _peaks_at_turns,
        _fast_ones,
    )
}
"""Name of a set of statements -> their tests."""
