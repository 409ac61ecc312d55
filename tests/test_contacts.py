"""Feet are found standing when they stand, whatever the frame rate and the noise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sixpoint as sp
from sixpoint.samples.walk import CYCLE, STANCE
from sixpoint.signals.contacts import find_contacts
from sixpoint.signals.differences import compute_velocity


def step_path(rate: float) -> np.ndarray:
    """(F, 1, 3): stands for 0.5 s, steps 0.6 m ahead and 0.1 m high in 0.5 s, and so on for 4 s."""
    t = np.arange(round(4 * rate)) / rate
    whole, part = np.floor(t), np.clip(2 * (t % 1.0) - 1.0, 0.0, 1.0)
    ahead = 0.6 * (whole + part * part * (3 - 2 * part))
    return np.stack([0 * t, 0.08 + 0.1 * np.sin(np.pi * part) ** 2, ahead], axis=-1)[:, None]


def sliding(speeds: list[float], rate: float = 120.0) -> np.ndarray:
    """(F, 1, 3): slides on the floor with each speed [m/s] for half a second."""
    steps = np.repeat(speeds, round(rate / 2)) / rate
    x = np.concatenate([[0.0], np.cumsum(steps)])
    return np.stack([x, np.full_like(x, 0.08), 0 * x], axis=-1)[:, None]


def random_path(seed: int, rate: float) -> np.ndarray:
    """(F, 2, 3): 8 s of random sliding up to about 0.4 m/s and heights up to 8 cm, new every 0.4 s."""
    rng = np.random.default_rng(seed)
    t, knots = np.arange(round(8 * rate)) / rate, 0.4 * np.arange(21)
    speeds, heights = rng.uniform(0, 0.4, (2, 21)), rng.uniform(0, 1, (2, 21)) ** 2 * 0.08
    x = [np.cumsum(np.interp(t, knots, v)) / rate for v in speeds]
    y = [np.interp(t, knots, h) for h in heights]
    return np.stack([x, y, np.zeros_like(x)], axis=-1).swapaxes(0, 1)


def spans(flags: np.ndarray) -> list[tuple[int, int]]:
    """First frame and end of every run of set flags (F,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def state_machine(points: np.ndarray, rate: float, floor: float) -> list[bool]:
    """The definition for one point (F, 3), frame by frame."""
    count, reach = len(points), max(1, round(0.025 * rate))
    low, stay = [], []
    for t in range(count):
        a, b = max(t - reach, 0), min(t + reach, count - 1)
        speed = float(np.linalg.norm(points[b] - points[a])) * rate / max(b - a, 1)
        low.append(points[t, 1] - floor < 0.03 and speed < 0.15)
        stay.append(points[t, 1] - floor < 0.06 and speed < 0.25)
    hold = max(3, int(np.ceil(0.025 * rate)))
    out, standing = [False] * count, False
    for t in range(count):
        begins = t + 1 >= hold and all(low[t + 1 - hold : t + 1])
        standing = stay[t] and (standing or begins)
        out[t] = standing
        if standing and begins:
            out[t + 1 - hold : t] = [True] * (hold - 1)
    return out


@given(st.integers(0, 10_000), st.sampled_from([24.0, 30.0, 60.0, 120.0, 200.0, 240.0]))
def test_contacts_are_those_of_the_state_machine(seed, rate):
    """On random paths of two feet the whole-array form is the definition written out frame by frame."""
    points = random_path(seed, rate)
    found = find_contacts(points, rate, floor=[0.0, -0.01])
    for k, floor in enumerate((0.0, -0.01)):
        assert found[:, k].tolist() == state_machine(points[:, k], rate, floor)


def test_random_paths_stand_and_move():
    """The comparison above is of paths with contacts and without, also beginning and ending in between."""
    found = [find_contacts(random_path(seed, 60.0), 60.0, floor=0.0) for seed in range(20)]
    assert 0.2 < np.mean(found) < 0.8
    assert np.mean([len(spans(flags[:, 0])) for flags in found]) > 1.5


@pytest.mark.parametrize("rate", [30.0, 60.0, 120.0, 240.0])
def test_contacts_do_not_depend_on_the_rate(rate):
    """Of four steps at any frame rate there are four contacts, within 50 ms of when the foot stands."""
    found = np.array(spans(find_contacts(step_path(rate), rate)[:, 0])) / rate
    assert found.shape == (4, 2)
    np.testing.assert_allclose(found, np.arange(4)[:, None] + [0.0, 0.5], atol=0.05 + 0.5 / rate)


@pytest.mark.parametrize(("rate", "frames"), [(30.0, 3), (120.0, 3), (240.0, 6)])
def test_a_contact_lasts_so_many_frames(rate, frames):
    """A foot that is low and slow for fewer frames than 25 ms, or three, is not in contact."""
    for low in (frames - 1, frames):
        points = np.zeros((60, 1, 3))
        points[:, 0, 1] = 0.0305  # too high to begin, low enough to stay
        points[30 : 30 + low, 0, 1] = 0.0295
        found = spans(find_contacts(points, rate, floor=0.0)[:, 0])
        assert found == ([(30, 60)] if low == frames else [])


def test_speeds_between_the_thresholds_keep_what_is():
    """At 0.2 m/s a standing foot stays in contact, and a sliding one does not come into it."""
    found = find_contacts(sliding([0.0, 0.2, 0.3, 0.2, 0.1]), 120.0)[:, 0]
    np.testing.assert_allclose(spans(found), [(0, 120), (240, 301)], atol=3)


def test_heights_between_the_thresholds_keep_what_is():
    """A standing ankle may rise slowly to 6 cm; one that comes down begins its contact below 3 cm."""
    t = np.arange(241) / 120
    rise = 0.1 * np.minimum(t, 2.0 - t)  # 10 cm/s up and down
    points = np.stack([0 * t, rise, 0 * t], axis=-1)[:, None]
    assert spans(find_contacts(points, 120.0, floor=0.0)[:, 0]) == [(0, 72), (205, 241)]


def test_marker_noise_does_not_break_a_contact():
    """With 0.5 mm of white noise at 120 Hz a standing foot is in contact all the time."""
    noise = np.random.default_rng(1).normal(scale=5e-4, size=(1200, 4, 3))
    assert find_contacts(noise + [0.3, 0.08, 0.1], 120.0).all()


def test_the_floor_is_each_points_own():
    """A point is in contact at its own low height, also if others are lower; a given floor is used."""
    low, high = step_path(60.0), step_path(60.0) + [0.0, 0.5, 0.0]
    found = find_contacts(np.concatenate([low, high], axis=1), 60.0)
    assert found[:, 0].any()
    np.testing.assert_array_equal(found[:, 0], found[:, 1])
    given = find_contacts(np.concatenate([low, high], axis=1), 60.0, floor=0.08)
    np.testing.assert_array_equal(given[:, 0], found[:, 0])
    assert not given[:, 1].any()


def test_a_foot_that_rarely_stands_still_finds_its_floor():
    """Standing for a tenth of the time is enough; single wrong heights below the floor do not lower it."""
    points = np.tile([0.0, 0.5, 0.0], (600, 1, 1))
    points[200:260, 0, 1] = 0.08
    points[[10, 90, 300, 310, 480, 520], 0, 1] = -0.4
    found = spans(find_contacts(points, 60.0)[:, 0])
    np.testing.assert_allclose(found, [(200, 260)], atol=2)


def test_unknown_and_short_clips_have_no_contact():
    """Lost points and clips of fewer than three frames are never in contact, without a warning."""
    points = np.zeros((60, 2, 3))
    points[:, 0] = np.nan
    points[20:30, 1] = np.nan
    found = find_contacts(points, 60.0)
    assert not found[:, 0].any()
    assert spans(found[:, 1]) == [(0, 18), (32, 60)]  # speeds need two frames on either side
    for frames in range(3):
        assert not find_contacts(np.zeros((frames, 2, 3)), 60.0).any()
    assert find_contacts(np.zeros((3, 2, 3)), 60.0).all()
    with pytest.raises(sp.TargetError, match="frames, points, 3"):
        find_contacts(np.zeros((60, 3)), 60.0)


def test_the_feet_of_a_walk_stand_in_turns():
    """In the sample walk contacts of left and right alternate and lie within the stance of each foot."""
    figure = sp.Figure.from_stature(1.75)
    motion = sp.make_sample("walk", figure)
    found = find_contacts(motion.positions[:, figure.roles.ankle], motion.rate)
    starts = [(start, side) for side in range(2) for start, _ in spans(found[:, side])]
    sides = [side for _, side in sorted(starts)]
    assert len(sides) >= 9
    assert all(a != b for a, b in zip(sides[:-1], sides[1:], strict=True))
    phase = np.arange(len(motion)) / motion.rate / CYCLE + 0.15
    for side in range(2):
        within = (phase - 0.5 * side) % 1.0
        assert within[found[:, side]].max() < STANCE
        assert found[(within > 0.15) & (within < 0.3), side].all()


@pytest.mark.parametrize("rate", [30.0, 120.0])
def test_velocity_of_a_line_is_its_slope(rate):
    """A line has its slope in every frame, the ends included; one sample does not move."""
    t = np.arange(40) / rate
    values = np.stack([3.0 * t, -0.5 * t], axis=-1)
    np.testing.assert_allclose(compute_velocity(values, rate, 0.05), np.tile([3.0, -0.5], (40, 1)))
    assert compute_velocity(values[:1], rate, 0.05).tolist() == [[0.0, 0.0]]
