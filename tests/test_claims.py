"""Statements of a paper hold where the numbers say so, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sixpoint.study.comparison.claims import check_claims, find_peaks_apart
from sixpoint.study.comparison.model import Comparison, Reference, Row, Run
from test_comparison_report import make_clip

RATE, FRAMES = 100.0, 1000
METHODS = ("jt", "sik", "ccd")


def find_claim(comparison, words):
    """The statements that begin so."""
    found = [c for c in check_claims(comparison, "unzueta2008") if c.text.startswith(words)]
    assert len(found) < 2
    return found[0] if found else None


def make_peaky_clip(peaks, turns, window=(0, FRAMES)):
    """A clip whose mean error has hills of the given heights at some frames, and that turns at others."""
    frames = np.arange(FRAMES)
    error = 0.02 + sum(height * np.exp(-(((frames - at) / 15.0) ** 2)) for at, height in peaks.items())
    turning = np.zeros(FRAMES)
    for at in turns:
        turning[at] = -2.5
    sample = make_clip("c", METHODS, FRAMES)
    # only the mean over methods is the curve itself
    runs = {
        m: Run(error + k * 0.001 * np.sin(frames), error, sample.runs[m].sample)
        for m, k in zip(METHODS, (-2, 1, 1), strict=True)
    }
    return replace(sample, rate=RATE, turning=turning, window=window, runs=runs)


def judge(clip):
    """What is said of the peaks of a clip."""
    return find_claim(Comparison("t", METHODS, (), (clip,)), "Errors peak")


PEAKS = {100: 0.10, 300: 0.30, 500: 0.20, 700: 0.15, 900: 0.12}


@pytest.mark.parametrize(
    ("turns", "count", "holds"),
    [
        ((300,), 1, False),
        ((300, 520), 2, False),
        ((280, 520, 725), 3, True),
        ((100, 300, 500, 700, 900), 5, True),
        ((274, 527, 727), 0, False),
    ],
)
def test_separate_peaks_are_counted(turns, count, holds):
    """Three of five hills within a quarter of a second of a turn are enough, two are not."""
    claim = judge(make_peaky_clip(PEAKS, turns))
    assert "highest peak at frame 300, others at 500, 700, 900, 100." in claim.measured
    assert f"are {count} of 5 separate peaks" in claim.measured
    assert claim.holds == holds
    usual = len({f for t in turns for f in range(t - 25, t + 26)}) / FRAMES
    assert f"and {100 * usual:.0f} % of all frames" in claim.measured


def test_one_burst_is_one_peak():
    """A jagged hill that contains most of the largest errors does not decide alone."""
    burst = {k: 0.5 + 0.002 * (k % 3) for k in range(300, 330, 4)}
    clip = make_peaky_clip(burst | {500: 0.20, 700: 0.15}, (310,))
    claim = judge(clip)
    assert "are 1 of 3 separate peaks" in claim.measured
    assert not claim.holds


def test_peaks_must_be_more_than_usual():
    """Where the pelvis always turns, peaks at turns say nothing."""
    assert not judge(make_peaky_clip(PEAKS, range(FRAMES))).holds
    assert judge(make_peaky_clip(PEAKS, range(0, 801))).holds is False
    assert judge(make_peaky_clip(PEAKS, [*range(80, 120), *range(280, 520)])).holds


def test_frames_of_a_window_are_those_of_the_clip():
    """A turn before the window counts for a peak in it, and frames are named as in the clip."""
    claim = judge(make_peaky_clip({210: 0.3, 900: 0.5}, (190,), window=(200, 400)))
    assert "highest peak at frame 210." in claim.measured
    assert "are 1 of 1 separate peaks" in claim.measured
    assert claim.holds


def test_without_peaks_nothing_is_said():
    """A curve that only rises has no local maximum; a short window has nothing to call a peak."""
    clip = make_peaky_clip({850: 0.5}, (850,), window=(780, 835))
    assert judge(clip) is None
    assert judge(make_peaky_clip(PEAKS, (300,), window=(280, 320))) is None


def test_peaks_are_apart_and_high():
    """Of maxima closer than half a second the highest counts; low ones and more than five do not."""
    error = np.full(1000, 0.1)
    heights = {60: 1.6, 99: 2.0, 149: 1.5, 300: 3.0, 400: 1.1, 500: 1.2, 600: 1.3, 700: 1.4, 800: 0.2}
    for at, height in heights.items():
        error[at] = height
    assert find_peaks_apart(error, 100.0).tolist() == [300, 99, 149, 700, 600]
    error[150:950] += np.linspace(0, 1, 800) * 100  # a tenth of the frames is higher than the rest
    assert find_peaks_apart(error, 100.0).min() > 850


def make_rows(**errors):
    """Rows of two clips; a number a method: its errors and 0.1 of it as the miss of its effectors."""
    return tuple(
        Row(clip, m, 30, 60.0, position=value * factor, residual_mean=miss * factor)
        for clip, factor in (("one", 1.0), ("two", 3.0))
        for m, (value, miss) in errors.items()
    )


@pytest.mark.parametrize(
    ("jt", "worst", "far"),
    [((0.5, 0.05), True, True), ((0.5, 0.01), True, False), ((0.1, 0.05), False, True)],
)
def test_poorest_and_farthest_are_two_statements(jt, worst, far):
    """The transpose's error and its effectors' distance are judged apart, each against all others."""
    rows = make_rows(jt=jt, sik=(0.02, 0.0), ccd=(0.2, 0.02))
    tested = Comparison("t", METHODS, rows, ())
    error, miss = (
        find_claim(tested, words)
        for words in ("Jacobian transpose gives", "Jacobian transpose leaves its effectors")
    )
    assert (error.holds, miss.holds) == (worst, far)
    assert f"jt {2 * jt[0]:.4f}, of the others at most 0.4000 (ccd)" in error.measured
    assert f"jt is {2000 * jt[1]:.1f} mm off on average, of the others at most 40.0 mm (ccd)" in miss.measured


def test_statements_are_of_the_paper_s_methods():
    """A method that the paper does not have is neither worst nor farthest, and its peaks are nobody's."""
    rows = make_rows(jt=(0.5, 0.05), sik=(0.02, 0.0), own=(0.9, 0.9))
    tested = Comparison("t", ("jt", "sik", "own"), rows, ())
    for words in ("Jacobian transpose gives", "Jacobian transpose leaves its effectors"):
        assert find_claim(tested, words).holds
    clip = make_peaky_clip(PEAKS, (280, 520, 725))
    own = replace(clip.runs["sik"], position=np.roll(clip.runs["sik"].position, 50) * 100.0)
    assert judge(replace(clip, runs={**clip.runs, "own": own})) == judge(clip)
    assert judge(replace(clip, runs={"own": own})) is None


def test_the_transpose_alone_is_not_judged():
    """Against nobody it is neither worst nor farthest."""
    assert check_claims(Comparison("t", ("jt",), make_rows(jt=(0.5, 0.05)), ()), "unzueta2008") == ()


def test_statements_are_of_the_averaged_clips():
    """Means are those of the tables: over the clips that the reference has."""
    rows = make_rows(jt=(0.5, 0.05), sik=(0.02, 0.0))
    known = Reference("r", {"one": {"sik": 0.02}}, {}, {})
    claim = find_claim(Comparison("t", ("jt", "sik"), rows, (), known), "Jacobian transpose gives")
    assert "jt 0.5000, of the others at most 0.0200 (sik)" in claim.measured
