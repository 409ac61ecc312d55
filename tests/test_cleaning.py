"""Gaps, ghosts and the zero-phase filter: every sample that changes is said to have changed."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import butter, sosfreqz

from sixpoint.errors import TargetError
from sixpoint.signals.gaps import Gaps, Ghost, fill_gaps, find_gaps, find_ghosts, find_runs
from sixpoint.signals.low_pass import low_pass

RATE = 100.0
TIMES = np.arange(300) / RATE
RNG = np.random.default_rng(3)


def moving(points: int = 4) -> np.ndarray:
    """(300, points, 3) smooth motion below 2 Hz."""
    waves = [np.sin(2 * np.pi * f * TIMES + k) for k, f in enumerate(np.linspace(0.3, 2.0, points * 3))]
    return np.stack(waves, axis=1).reshape(300, points, 3) * 0.3


def test_gaps_are_counted():
    """Seen share, gaps between the first and the last sample, and the longest; the ends are no gaps."""
    points = moving()
    points[:10, 0] = points[290:, 0] = points[50:53, 0] = points[100:120, 0] = np.nan
    points[7, 1, 2] = np.nan
    points[:, 2] = np.nan
    assert find_gaps(points) == [
        Gaps(257 / 300, 2, 20, 10, 289),
        Gaps(299 / 300, 1, 1, 0, 299),
        Gaps(0.0, 0, 0, -1, -1),
        Gaps(1.0, 0, 0, 0, 299),
    ]


@given(st.lists(st.booleans(), max_size=40))
def test_runs_are_the_true_stretches(flags):
    """Runs are in order, do not touch, and hold exactly what is True."""
    runs = find_runs(np.array(flags, bool))
    again = np.zeros(len(flags), bool)
    for start, stop in runs:
        again[start:stop] = True
    assert again.tolist() == flags
    assert all(a[1] < b[0] for a, b in pairwise(runs))


def test_short_gaps_are_filled_close_to_the_truth():
    """Up to the length allowed, within a millimetre; longer gaps and both ends stay, no sample changes."""
    truth = moving()
    points = truth.copy()
    points[40:50, 0] = points[100:111, 1] = points[:5, 2] = points[295:, 2] = np.nan
    points[200, 3] = points[202, 3] = np.nan
    filled = fill_gaps(points, RATE, 0.1)
    assert np.flatnonzero(filled.made.any(axis=1)).tolist() == [*range(40, 50), 200, 202]
    np.testing.assert_allclose(filled.positions[filled.made], truth[filled.made], atol=1e-3)
    known = np.isfinite(points)
    np.testing.assert_array_equal(filled.positions[known], points[known])
    np.testing.assert_array_equal(np.isnan(filled.positions[..., 0]), np.isnan(points[..., 0]) & ~filled.made)


def test_a_ghost_is_found_and_fast_people_are_not():
    """A marker that jumps away for five frames is; a foot at 15 m/s and one moved for good are not."""
    points = moving()
    points[120:125, 1] += [0.6, 0, 0]
    points[200, 2] += [0, 0.4, 0]
    points[150:, 3] += 1.0
    ghosts = find_ghosts(points, RATE)
    assert [(g.point, g.start, g.stop) for g in ghosts] == [(1, 120, 125), (2, 200, 201)]
    assert all(g.speed > 20 for g in ghosts)
    swing = np.stack([np.cos(20 * TIMES), np.sin(20 * TIMES), 0 * TIMES], axis=1)[:, None] * 0.75
    assert find_ghosts(swing, RATE) == []
    single = moving(1)
    single[[10, 11, 13], 0] = np.nan
    single[12, 0] += 2.0
    assert find_ghosts(single, RATE) == [Ghost(0, 12, 13, find_ghosts(single, RATE)[0].speed)]


@pytest.mark.parametrize("cutoff", [3.0, 6.0, 20.0])
def test_the_filter_halves_the_power_at_its_cutoff_without_delay(cutoff):
    """A sine at the cutoff keeps 1/sqrt(2) of its amplitude and its phase; the passband is untouched."""
    t = np.arange(2000) / RATE
    for frequency, gain in ((cutoff, np.sqrt(0.5)), (cutoff / 6, 1.0)):
        wave = np.sin(2 * np.pi * frequency * t)
        out = low_pass(np.tile(wave[:, None, None], (1, 1, 3)), RATE, cutoff).positions[400:-400, 0, 0]
        basis = np.stack([np.sin(2 * np.pi * frequency * t), np.cos(2 * np.pi * frequency * t)], axis=1)[
            400:-400
        ]
        amplitude, delay = np.linalg.lstsq(basis, out, rcond=None)[0]
        assert abs(amplitude - gain) < 0.002 and abs(delay) < 0.002
    raised = np.arctan(np.tan(np.pi * cutoff / RATE) * 1.2464) * RATE / np.pi
    response = sosfreqz(butter(2, raised, fs=RATE, output="sos"), [cutoff], fs=RATE)[1]
    assert abs(abs(response[0]) ** 2 - np.sqrt(0.5)) < 1e-3


def test_the_filter_respects_gaps():
    """A stretch is filtered as if it were alone; gaps stay gaps; short stretches are kept and said."""
    points = moving() + RNG.normal(0, 0.003, (300, 4, 3))
    points[100:110, 0] = points[113:120, 0] = np.nan
    out = low_pass(points, RATE, 6.0)
    np.testing.assert_array_equal(np.isnan(out.positions), np.isnan(points))
    assert np.argwhere(out.kept).tolist() == [[110, 0], [111, 0], [112, 0]]
    np.testing.assert_array_equal(out.positions[out.kept], points[out.kept])
    np.testing.assert_allclose(out.positions[120:, 0], low_pass(points[120:], RATE, 6.0).positions[:, 0])
    np.testing.assert_allclose(out.positions[:, 1:], low_pass(points[:, 1:], RATE, 6.0).positions)
    noise = points[:, 1:] - moving()[:, 1:], out.positions[:, 1:] - moving()[:, 1:]
    assert np.std(noise[1]) < 0.5 * np.std(noise[0])


def test_mistakes_say_what_would_be_right():
    """Shapes, rates and cutoffs."""
    with pytest.raises(TargetError, match=r"between 0 and 0.4 of the rate, 40 Hz here; got 60 Hz"):
        low_pass(moving(), RATE, 60)
    for call in (
        find_gaps,
        lambda p: low_pass(p, RATE),
        lambda p: fill_gaps(p, RATE),
        lambda p: find_ghosts(p, RATE),
    ):
        with pytest.raises(TargetError, match=r"positions are \(frames, points, 3\)"):
            call(np.zeros((5, 3)))
    with pytest.raises(TargetError, match="must be positive"):
        fill_gaps(moving(), 0.0)
    with pytest.raises(TargetError, match="must be positive"):
        find_ghosts(moving(), RATE, speed=0)


@given(st.integers(1, 30), st.floats(0, 0.5), st.integers(0, 10_000))
def test_any_gaps_are_survived(frames, share, seed):
    """Any length and pattern of gaps: shapes stay, known samples of filling stay, no warning is raised."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(frames, 2, 3))
    points[rng.random((frames, 2)) < share] = np.nan
    known = np.isfinite(points)
    filled = fill_gaps(points, RATE)
    np.testing.assert_array_equal(filled.positions[known], points[known])
    assert np.isfinite(filled.positions[filled.made]).all()
    assert len(find_gaps(points)) == 2
    np.testing.assert_array_equal(np.isfinite(low_pass(points, RATE).positions), known)
    find_ghosts(points, RATE)
