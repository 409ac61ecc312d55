"""Trackers that vanish, freeze, jump, swap and lie: the six effectors are always there and never jump."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.targets import EFFECTORS, POINTS
from sixpoint.errors import TargetError
from sixpoint.live.checks import FASTEST, JUMP, LASTING
from sixpoint.live.tracking import AWAY, HELD, RETURN, State, Tracking
from sixpoint.samples import make_sample

FIGURE = Figure.from_stature(1.75)
RATE = 90.0


@pytest.fixture(scope="module")
def walk():
    """Positions and rotations of ten seconds at 90 Hz."""
    targets = FIGURE.targets(make_sample("walk", FIGURE))
    times = np.arange(0.0, (len(targets) - 2) / targets.rate, 1 / RATE) * targets.rate
    k = times.astype(int)
    w = (times - k)[:, None, None]
    positions = (1 - w) * targets.positions[k] + w * targets.positions[k + 1]
    return positions, targets.rotations[k]


def run(positions, rotations=None, rate=RATE, tracking=None, **options):
    tracking = tracking or Tracking(FIGURE, **options)
    frames = [
        tracking.update(k / rate, p, None if rotations is None else rotations[k])
        for k, p in enumerate(positions)
    ]
    return tracking, frames


def places(frames):
    return np.array([f.positions for f in frames])


def steps(frames):
    """Largest step of any effector between frames [m]."""
    return np.linalg.norm(np.diff(places(frames), axis=0), axis=-1).max(axis=1)


def test_what_is_seen_passes_unchanged(walk):
    """Without smoothing, valid trackers come out to the last bit, six or eleven rows."""
    positions, rotations = walk
    tracking, frames = run(positions, rotations)
    np.testing.assert_array_equal(places(frames), positions)
    assert all(f.measured.all() and (f.state[:6] == State.VALID).all() for f in frames)
    assert (frames[-1].state[6:] == State.ABSENT).all() and not frames[-1].weights.any()
    assert not tracking.checks.rejected
    turned = np.array([f.rotations for f in frames])
    assert np.abs(np.sum(turned * rotations, axis=-1)).min() > 1 - 1e-12


@pytest.mark.parametrize("effector", range(6), ids=EFFECTORS)
@pytest.mark.parametrize("gap", [0.1, 0.5, 4.0])
def test_no_effector_jumps_when_a_tracker_vanishes_and_returns(walk, effector, gap):
    """Steps stay below twice the recording's plus 10 gaps per second, the blend's largest slope."""
    positions, rotations = walk
    holes, first = positions.copy(), 200
    last = min(first + round(gap * RATE), len(positions) - 40)
    holes[first:last, effector] = np.nan
    tracking, frames = run(holes, rotations)
    out = places(frames)
    assert np.isfinite(out).all()
    apart = np.linalg.norm(out[last - 1] - positions[last], axis=-1).max()
    moved = np.linalg.norm(np.diff(positions, axis=0), axis=-1).max()
    bound = 2.0 * moved + (1.5 / RETURN * apart + 1.5 / AWAY * 1.0) / RATE
    assert steps(frames).max() <= bound
    after = last + round(RETURN * RATE) + 1
    np.testing.assert_array_equal(out[after:, effector], positions[after:, effector])
    assert tracking.checks.rejected == {"unknown": 1}


def test_a_short_gap_is_bridged(walk):
    """In 50 ms a wrist goes on as it moved: nearer to the truth than holding it still."""
    positions, rotations = walk
    predicted, held = [], []
    for first in range(100, 500, 25):
        holes = positions[: first + 5].copy()
        holes[first:, 2] = np.nan
        _, frames = run(holes[first - 60 :], rotations[first - 60 : first + 5])
        truth = positions[first + 4, 2]
        predicted.append(np.linalg.norm(frames[-1].positions[2] - truth))
        held.append(np.linalg.norm(positions[first - 1, 2] - truth))
    assert np.mean(predicted) < 0.75 * np.mean(held)


def test_a_lost_wrist_goes_with_the_body_then_hangs(walk):
    """After 0.3 s it keeps its place to the pelvis; later it is where a relaxed arm has it."""
    still = np.repeat(walk[0][:1], 400, axis=0)
    still[:, 2] += [0.0, 0.4, 0.2]
    still[100:, 2] = np.nan
    still[110:] += [0.5, 0.0, 0.0]
    still = still + np.random.default_rng(0).normal(0, 1e-4, still.shape)
    at = Tracking(FIGURE)
    _, frames = run(still, tracking=at)
    soon = frames[100 + round(HELD * RATE)].positions[2]
    np.testing.assert_allclose(soon, still[99, 2] + [0.5, 0.0, 0.0], atol=0.02)
    late = frames[-1].positions[2] - frames[-1].positions[0]
    shoulder = FIGURE.offset_between(FIGURE.roles.pelvis, FIGURE.roles.shoulder[0])
    assert late[1] < 0.0 and np.linalg.norm(late - shoulder) < 0.33 * 1.75


def test_a_lost_ankle_stands_under_its_hip(walk):
    """After a while it is on the floor, below the hip."""
    still = np.repeat(walk[0][:1], 300, axis=0) + np.random.default_rng(0).normal(0, 1e-4, (300, 6, 3))
    still[:, 4, 1] += 0.3
    still[50:, 4] = np.nan
    _, frames = run(still)
    ankle = frames[-1].positions[4]
    assert abs(ankle[1] - 0.039 * 1.75) < 0.01
    assert np.linalg.norm((ankle - frames[-1].positions[0])[[0, 2]]) < 0.25


def test_head_and_pelvis_recover_from_each_other(walk):
    """Each lost for long is where the other and the last chord say; both lost, they stay."""
    positions, rotations = walk
    for lost, kept in ((0, 1), (1, 0)):
        holes = positions.copy()
        holes[150:, lost] = np.nan
        _, frames = run(holes, rotations)
        error = np.linalg.norm(places(frames)[300:, lost] - positions[300:, lost], axis=1)
        assert error.max() < 0.15, (EFFECTORS[lost], error.max())
        assert kept != lost
    holes = positions.copy()
    holes[150:, :2] = np.nan
    _, frames = run(holes, rotations)
    out = places(frames)
    assert np.linalg.norm(out[250:, :2] - out[250, :2], axis=-1).max() < 1e-3
    assert np.linalg.norm(out[-1, 0] - positions[150, 0]) < 0.3


def test_a_frozen_tracker_is_noticed(walk):
    """The same bits for half a second while others move: held against the body, and counted once."""
    positions, rotations = walk
    frozen, turns = positions.copy(), rotations.copy()
    frozen[100:, 3], turns[100:, 3] = frozen[100, 3], turns[100, 3]
    tracking, frames = run(frozen, turns)
    assert tracking.checks.rejected == {"frozen": 1}
    assert frames[130].state[3] == State.VALID and frames[160].state[3] == State.LOST
    everybody = np.repeat(positions[:1], 200, axis=0)
    assert not run(everybody)[0].checks.rejected  # a scene that stands still is not frozen


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (3.0, 1.0, 0.0), (1e6, 0.0, 0.0), (np.inf, 0.0, 0.0)])
def test_a_short_jump_is_ignored(walk, place):
    """To the origin, elsewhere, out of the room: the wrist goes on as if it were not seen."""
    positions, rotations = walk
    jumped = positions.copy()
    jumped[200:210, 2] = place
    tracking, frames = run(jumped, rotations)
    assert sum(tracking.checks.rejected.values()) == 1
    error = np.linalg.norm(places(frames) - positions, axis=-1)
    assert error.max() < 0.2 and steps(frames).max() < 0.08


def test_a_lasting_jump_is_believed_and_eased(walk):
    """A tracker that stays where it jumped to was put there: after 0.25 s it is followed, without a jump."""
    positions, rotations = walk
    moved = positions.copy()
    moved[200:, 2] += [0.0, 0.5, 0.4]
    tracking, frames = run(moved, rotations)
    out, end = places(frames), 200 + round((LASTING + RETURN) * RATE) + 3
    np.testing.assert_array_equal(out[end:], moved[end:])
    assert steps(frames).max() < 0.15 and tracking.checks.rejected == {"jump": 1}


def test_a_room_that_is_moved_is_followed_at_once(walk):
    """All trackers jump together: no rejection, eased in within 0.15 s."""
    positions, rotations = walk
    moved = positions.copy()
    moved[200:] += [2.0, 0.0, -1.0]
    tracking, frames = run(moved, rotations)
    after = 200 + round(RETURN * RATE) + 2
    np.testing.assert_array_equal(places(frames)[after:], moved[after:])
    assert not tracking.checks.rejected and steps(frames).max() < 0.3


def test_swapped_trackers_are_exchanged_back(walk):
    """Two serials that exchange places for good: the hands stay where they were, counted once."""
    positions, rotations = walk
    swapped, turns = positions.copy(), rotations.copy()
    swapped[200:, [2, 3]], turns[200:, [2, 3]] = positions[200:, [3, 2]], rotations[200:, [3, 2]]
    tracking, frames = run(swapped, turns)
    np.testing.assert_array_equal(places(frames), positions)
    assert tracking.checks.rejected == {"swapped": 1}


@pytest.mark.parametrize("rate", [30.0, 45.0])
def test_the_frame_rate_does_not_matter(walk, rate):
    """Every second or third frame of a stream with a gap gives the same course."""
    positions, rotations = walk
    holes = positions.copy()
    holes[200:290, 2] = np.nan
    every = round(RATE / rate)
    _, fast = run(holes, rotations)
    _, slow = run(holes[::every], rotations[::every], rate=rate)
    apart = np.linalg.norm(places(fast)[::every] - places(slow), axis=-1)
    assert apart.max() < 0.05 and apart.mean() < 1e-3


def test_reset_and_recentre_leave_nothing_stale(walk):
    """After a reset the same frames give the same result as the first time."""
    positions, rotations = walk
    tracking, first = run(positions[:100], rotations, smoothing="strong")
    tracking.reset()
    _, again = run(positions[:100], rotations, tracking=tracking)
    np.testing.assert_array_equal(places(first), places(again))
    tracking.recentre()
    after = tracking.update(100 / RATE, positions[100] + 5.0, rotations[100])
    np.testing.assert_allclose(after.positions, again[-1].positions, atol=1e-9)
    assert not tracking.checks.rejected


def test_lost_rotations_are_held_and_eased(walk):
    """A rotation that stops is kept against the body; nothing turns by more than 20 degrees a frame."""
    positions, rotations = walk
    turns = rotations.copy()
    turns[200:400, 5] = np.nan
    _, frames = run(positions, turns)
    out = np.array([f.rotations for f in frames])
    change = rot.angle(rot.mul(out[1:], rot.inv(out[:-1])))
    assert np.degrees(change.max()) < 20.0
    np.testing.assert_allclose(np.linalg.norm(out, axis=-1), 1.0, atol=1e-9)
    assert frames[300].measured[5]
    none = run(positions[:5])[1][-1]
    assert not none.measured.any() and np.isnan(none.known_rotations).all()


numbers = st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.just(0.0), st.floats(-2, 2))


@settings(max_examples=80)
@given(
    st.lists(
        st.tuples(st.floats(allow_nan=True), arrays(float, (11, 3), elements=numbers)), min_size=1, max_size=6
    ),
    arrays(float, (11, 4), elements=numbers),
    st.sampled_from(["off", "light", "strong"]),
    st.sampled_from(["standing", "sitting"]),
)
def test_no_input_breaks_it(frames, turns, smoothing, posture):
    """Any numbers at any times: always finite positions and unit rotations."""
    tracking = Tracking(FIGURE, smoothing=smoothing, posture=posture)
    for time, positions in frames:
        before = positions.copy()
        out = tracking.update(time, positions, turns)
        assert np.isfinite(out.positions).all()
        np.testing.assert_allclose(np.linalg.norm(out.rotations, axis=-1), 1.0, atol=1e-6)
        assert ((out.weights >= 0) & (out.weights <= 1)).all()
        np.testing.assert_array_equal(positions, before)


@settings(max_examples=40)
@given(st.lists(st.lists(st.booleans(), min_size=6, max_size=6), min_size=2, max_size=40), st.integers(0, 99))
def test_no_pattern_of_gaps_makes_it_jump(seen, seed):
    """A moving body seen through any gaps: steps stay below 10 per second of the largest gap error, 0.8 m."""
    rng = np.random.default_rng(seed)
    rest = FIGURE.rest_positions
    r = FIGURE.roles
    base = rest[[r.pelvis, r.head, *r.wrist, *r.ankle]] + [0.0, 1.0, 0.0]
    tracking, before = Tracking(FIGURE), None
    for k, mask in enumerate(np.repeat(np.array(seen), 5, axis=0)):
        points = base + 0.3 * np.sin(k / 20) + rng.normal(0, 1e-3, (6, 3))
        out = tracking.update(k / RATE, np.where(np.array(mask)[:, None], points, np.nan))
        if before is not None and k > 5:
            assert np.linalg.norm(out.positions - before, axis=1).max() < 10 * 0.8 / RATE + 0.02
        before = out.positions


def test_wrong_shapes_and_options_are_told():
    """The message says which shapes, smoothings and postures there are."""
    with pytest.raises(TargetError, match="one row per point of pelvis"):
        Tracking(FIGURE).update(0.0, np.zeros((5, 3)))
    with pytest.raises(TargetError, match="must be numbers"):
        Tracking(FIGURE).update(0.0, [["a"] * 3] * 6)
    with pytest.raises(TargetError, match="off, light, strong"):
        Tracking(FIGURE, smoothing="no")
    with pytest.raises(TargetError, match="standing, sitting"):
        Tracking(FIGURE, posture="lying")
    assert len(POINTS) == 11 and JUMP < 0.5 and FASTEST > 5
