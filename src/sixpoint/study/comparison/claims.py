"""The statements of a paper about its methods, each put to the test on our own numbers.

Reference: Unzueta et al. 2008, section 9.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from sixpoint.study.comparison.model import Claim, ClipRuns, Comparison

JACOBIAN = ("pinv", "dls", "dls-svd", "sdls")
PEAK = 0.02  # share of frames with the largest errors that are called peaks
MINIMUM = 50  # frames below which there is nothing to call a peak
AROUND = 0.25  # a turn this long before or after a frame belongs to it [s]
TURNING = 2.0  # a pelvis that turns faster turns around [rad/s]


def check_claims(comparison: Comparison, claims: str) -> tuple[Claim, ...]:
    """All statements of a set that the comparison's methods and clips allow to test."""
    makers = CLAIMS.get(claims, ())
    return tuple(claim for make in makers for claim in make(comparison))


def mean_of(comparison: Comparison, method: str, column: str) -> float:
    """Mean of a column over the clips; NaN where the method failed on one."""
    rows = [row for row in comparison.rows if row.method == method]
    return float(np.mean([getattr(row, column) for row in rows])) if rows else float("nan")


def _known(comparison: Comparison, *methods: str) -> bool:
    return all(np.isfinite(mean_of(comparison, method, "position")) for method in methods)


def _clip(comparison: Comparison, name: str) -> ClipRuns | None:
    return next((clip for clip in comparison.clips if clip.name == name), None)


def _listed(values: Sequence[tuple[str, str]]) -> str:
    return ", ".join(f"{name} {value}" for name, value in values)


def _transpose_is_worst(c: Comparison) -> Iterator[Claim]:
    if not _known(c, "jt"):
        return
    means = {m: mean_of(c, m, "position") for m in c.methods if _known(c, m)}
    missed = {m: 1000 * mean_of(c, m, "residual_mean") for m in means}
    next_worst = max((m for m in means if m != "jt"), key=lambda m: means[m])
    yield Claim(
        "Jacobian transpose gives the poorest results, its effectors far from their targets (Figure 14).",
        f"Position error {means['jt']:.4f}, the next worst is {next_worst} with {means[next_worst]:.4f}; its "
        f"farthest effector is {missed['jt']:.0f} mm off on average, that of all methods "
        f"{min(missed.values()):.0f} to {max(missed.values()):.0f} mm.",
        means["jt"] > means[next_worst],
    )


def _best_four(c: Comparison) -> Iterator[Claim]:
    four, rest = ("sik", "tgbsik", "pik", "kma"), ("ccd", *JACOBIAN)
    if not _known(c, *four, *rest):
        return
    means = {m: mean_of(c, m, "position") for m in (*four, *rest)}
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
        means = {m: mean_of(c, m, column) for m in c.methods if _known(c, m)}
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
    times = {m: mean_of(c, m, "batch_us") for m in (*fast, *slow)}
    order = sorted(times, key=lambda m: times[m])
    yield Claim(
        "SIK, KMA, CCD and TGBSIK are considerably faster than the others.",
        f"Microseconds per frame: {_listed([(m, f'{times[m]:.1f}') for m in order])}.",
        max(times[m] for m in fast) < min(times[m] for m in slow),
    )


def _clavicles(c: Comparison) -> Iterator[Claim]:
    if _known(c, "sik", *JACOBIAN):
        angles = {m: np.degrees(mean_of(c, m, "clavicle")) for m in ("sik", *JACOBIAN)}
        truth = np.degrees(mean_of(c, "sik", "clavicle_truth"))
        yield Claim(
            "Clavicles move more with the Jacobian methods than with SIK.",
            f"Mean angle from rest in degrees: {_listed([(m, f'{a:.1f}') for m, a in angles.items()])}; "
            f"truth {truth:.1f}.",
            all(angles[m] > angles["sik"] for m in JACOBIAN),
        )
    if _known(c, "pik", *JACOBIAN):
        angles = {m: np.degrees(mean_of(c, m, "clavicle")) for m in ("pik", *JACOBIAN)}
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
    share = {m: mean_of(c, m, "bend_top") for m in ("ccd", "kma", "sik")}
    truth = mean_of(c, "sik", "bend_top_truth")
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
    for clip in c.clips:
        first, last = clip.window
        if not clip.runs or last - first < MINIMUM:
            continue
        half = round(AROUND * clip.rate)
        padded = np.pad(clip.turning, half, mode="edge")
        fastest = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1).max(axis=1)[first:last]
        error = np.mean([run.position[first:last] for run in clip.runs.values()], axis=0)
        peaks = np.argsort(error)[-max(1, round(PEAK * len(error))) :]
        at, usual = (float(np.mean(speed > TURNING)) for speed in (fastest[peaks], fastest))
        yield Claim(
            f"Errors peak at quick turn-arounds: {clip.name}, frames {first} to {last} (Figures 16 to 18).",
            f"Of the 2 % of frames with the largest mean error of all methods, frame "
            f"{first + peaks.min()} and {len(peaks) - 1} more, {100 * at:.0f} % are within a quarter of a "
            f"second of the true pelvis turning faster than 2 rad/s; of all frames {100 * usual:.0f} %.",
            at > 0.5 and at > 1.2 * usual,
        )


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
