"""The analytic limb of Tolani, Goswami and Badler: the swivel circle, and what of it keeps the limits."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import sixpoint as sp
from independent import limit_excess
from sixpoint.solvers.tgb.limb import LIMBS, AnalyticLimb, LimbPosture
from test_solvers import FIGURE

LIMB = {end: AnalyticLimb(FIGURE, end) for end in LIMBS}
CHAIN = dict(zip(LIMBS, FIGURE.roles.limbs, strict=True))
ENDS = pytest.mark.parametrize("end", LIMBS)
STEP = 2 * np.pi / 72  # the circle is sampled this finely: what is narrower may be missed
angles = st.floats(-np.pi, np.pi)
shares = st.floats(0.35, 0.995)
seeds = st.integers(0, 2**32 - 1)


def side_of(end: str) -> float:
    """The sign h of the hinge: -1 for elbows, +1 for knees."""
    return -1.0 if "wrist" in end else 1.0


def target_of(limb: AnalyticLimb, seed: int, share: float) -> np.ndarray:
    """In a random direction, at a share of the limb's length."""
    way = np.random.default_rng(seed).normal(size=3)
    return way * (share * sum(limb.lengths) / np.linalg.norm(way))


def place(limb: AnalyticLimb, posture: LimbPosture) -> tuple[np.ndarray, np.ndarray]:
    """Middle joint and end by forward kinematics of a limb that hangs along -Y."""
    root, hinge = Rotation.from_quat(posture.root), Rotation.from_quat(posture.hinge)
    middle = root.apply([0.0, -limb.lengths[0], 0.0])
    return middle, middle + (root * hinge).apply([0.0, -limb.lengths[1], 0.0])


def across(v: np.ndarray, n: np.ndarray) -> np.ndarray:
    """Unit direction of v across the unit vector n."""
    u = v - (v @ n) * n
    return u / np.linalg.norm(u)


def wrapped(angle: np.ndarray | float) -> np.ndarray:
    return (np.asarray(angle) + np.pi) % (2 * np.pi) - np.pi


def flexion_of(limb: AnalyticLimb, target: np.ndarray) -> float:
    """By the cosine rule, for a target that can be reached."""
    l1, l2 = limb.lengths
    return float(np.pi - np.arccos((l1**2 + l2**2 - target @ target) / (2 * l1 * l2)))


# --- the circle ---------------------------------------------------------------------------------------


@ENDS
@settings(max_examples=40, deadline=None)
@given(seeds, shares, angles)
def test_the_end_is_there_at_any_swivel_angle(end, seed, share, phi):
    """Forward kinematics give the target, and the triangle has the limb's lengths."""
    limb = LIMB[end]
    target = target_of(limb, seed, share)
    posture = limb.solve(target, phi)
    middle, tip = place(limb, posture)
    np.testing.assert_allclose(tip, target, atol=1e-9)
    np.testing.assert_allclose(posture.position, target, atol=1e-9)
    assert posture.residual < 1e-9
    assert np.linalg.norm(middle) == pytest.approx(limb.lengths[0], abs=1e-12)
    assert np.linalg.norm(target - middle) == pytest.approx(limb.lengths[1], abs=1e-9)
    np.testing.assert_array_equal(posture.end, [0, 0, 0, 1])


@ENDS
@settings(max_examples=30, deadline=None)
@given(seeds, shares)
def test_the_middle_joint_goes_round_a_circle(end, seed, share):
    """Its circle is normal to the line to the target and centred on it; a whole turn comes back."""
    limb = LIMB[end]
    target = target_of(limb, seed, share)
    n = target / np.linalg.norm(target)
    first = limb.solve(target, 0.3)
    middles = np.array([place(limb, limb.solve(target, 0.3 + k * np.pi / 6))[0] for k in range(12)])
    along = middles @ n
    np.testing.assert_allclose(along, along[0], atol=1e-9)
    radius = np.linalg.norm(middles - np.outer(along, n), axis=1)
    np.testing.assert_allclose(radius, radius[0], atol=1e-9)
    np.testing.assert_allclose(middles.mean(axis=0), along[0] * n, atol=1e-9)
    again = limb.solve(target, 0.3 + 2 * np.pi)
    for a, b in ((first.root, again.root), (first.hinge, again.hinge)):
        assert abs(a @ b) == pytest.approx(1.0, abs=1e-12)


@ENDS
@settings(max_examples=40, deadline=None)
@given(seeds, shares, angles, seeds)
def test_the_swivel_angle_is_read_back(end, seed, share, phi, way):
    """From the reference to the middle joint, right-handed about the line to the target, it is phi."""
    reference = np.random.default_rng(way).normal(size=3)
    limb = AnalyticLimb(FIGURE, end, reference)
    target = target_of(limb, seed, share)
    n = target / np.linalg.norm(target)
    assume(np.linalg.norm(np.cross(n, reference)) > 0.1)
    middle, _ = place(limb, limb.solve(target, phi))
    u, r = across(reference, n), across(middle, n)
    assert wrapped(np.arctan2(np.cross(u, r) @ n, u @ r) - phi) == pytest.approx(0.0, abs=1e-6)


@ENDS
def test_at_angle_zero_elbows_are_down_and_knees_forward(end):
    """By default a limb that reaches sideways has its middle joint on the side of down, or of forward."""
    limb = LIMB[end]
    middle, _ = place(limb, limb.solve([0.7 * sum(limb.lengths), 0.0, 0.0]))
    expected = [0, -1, 0] if side_of(end) < 0 else [0, 0, 1]
    np.testing.assert_allclose(across(middle, np.array([1.0, 0, 0])), expected, atol=1e-9)


@ENDS
@settings(max_examples=40, deadline=None)
@given(seeds, shares, angles)
def test_elbows_fold_forward_and_knees_backward(end, seed, share, phi):
    """In the upper segment's frame the lower one is turned about X alone: to +Z at elbows, -Z at knees."""
    limb = LIMB[end]
    target = target_of(limb, seed, share)
    posture = limb.solve(target, phi)
    middle, tip = place(limb, posture)
    lower = Rotation.from_quat(posture.root).inv().apply(tip - middle) / limb.lengths[1]
    flexion = flexion_of(limb, target)
    h = side_of(end)
    np.testing.assert_allclose(lower, [0, -np.cos(flexion), -h * np.sin(flexion)], atol=1e-6)
    turn = Rotation.from_quat(posture.hinge).as_rotvec()
    np.testing.assert_allclose(turn, [h * flexion, 0, 0], atol=1e-6)


@ENDS
@settings(max_examples=40, deadline=None)
@given(seeds, st.floats(1.0001, 30), angles)
def test_out_of_reach_it_is_straight_and_points_there(end, seed, share, phi):
    """Beyond its length the limb is stretched along the line to the target, which it misses by the rest."""
    limb = LIMB[end]
    target = target_of(limb, seed, share)
    n, total = target / np.linalg.norm(target), sum(limb.lengths)
    posture = limb.solve(target, phi)
    middle, tip = place(limb, posture)
    np.testing.assert_allclose(middle, limb.lengths[0] * n, atol=1e-9)
    np.testing.assert_allclose(tip, total * n, atol=1e-9)
    assert posture.residual == pytest.approx((share - 1) * total, abs=1e-9)


@ENDS
@settings(max_examples=40, deadline=None)
@given(seeds, st.one_of(st.just(0.0), st.floats(0.001, 0.99)), angles)
def test_too_near_it_is_folded_flat(end, seed, share, phi):
    """Nearer than the difference of the lengths the end comes as near as it can, on the line."""
    limb = LIMB[end]
    l1, l2 = limb.lengths
    least = abs(l1 - l2)
    assert least > 1e-3
    target = target_of(limb, seed, share * least / (l1 + l2))
    posture = limb.solve(target, phi)
    _, tip = place(limb, posture)
    assert posture.residual == pytest.approx(least - np.linalg.norm(target), abs=1e-9)
    assert np.linalg.norm(tip - target) == pytest.approx(posture.residual, abs=1e-9)


@ENDS
@settings(max_examples=40, deadline=None)
@given(seeds, st.floats(0.4, 0.95), angles, seeds)
def test_the_posture_is_continuous(end, seed, share, phi, way):
    """A target moved by a little moves the posture by a little, but where the reference is on the line."""
    limb = LIMB[end]
    target = target_of(limb, seed, share)
    n = target / np.linalg.norm(target)
    assume(np.linalg.norm(np.cross(n, limb.reference)) > 0.2)
    shift = np.random.default_rng(way).normal(size=3)
    shift *= 1e-6 / np.linalg.norm(shift)
    postures = [limb.solve(target + k * shift, phi) for k in (0, 1)]
    for name in ("root", "hinge"):
        a, b = (Rotation.from_quat(getattr(p, name)) for p in postures)
        assert (a.inv() * b).magnitude() < 2e-4


@ENDS
def test_the_posture_jumps_where_the_reference_is_on_the_line(end):
    """On both sides of the reference's own line the middle joint is on opposite sides."""
    limb = LIMB[end]
    sideways = np.array([1.0, 0.0, 0.0])
    middles = []
    for k in (-1, 1):
        way = limb.reference + k * 1e-4 * sideways
        middles.append(place(limb, limb.solve(0.8 * sum(limb.lengths) * way))[0])
    assert (middles[0] @ sideways) * (middles[1] @ sideways) < 0
    assert np.linalg.norm(middles[0] - middles[1]) > 0.1


# --- limits -------------------------------------------------------------------------------------------


def wide_open() -> sp.Figure:
    """The figure without any limits on its limbs but a whole turn."""
    table = tomllib.loads(sp.Limits.text())
    for joint in ("shoulder", "hip"):
        table[joint]["swing"] = [[-180, 180], [0, 180], [180, 180]]
        table[joint]["internal_rotation"] = table[joint]["external_rotation"] = 180
    for joint in ("elbow", "knee"):
        table[joint]["flexion"] = [0, 180]
    return FIGURE.with_limits(sp.Limits(table))


def excess(end: str, target: np.ndarray, phi: np.ndarray, turn: np.ndarray | None = None) -> np.ndarray:
    """How far postures at the swivel angles phi (n,) are outside the limits [rad], by SciPy alone."""
    limb, (root, middle, tip) = LIMB[end], CHAIN[end]
    postures = [limb.solve(target, float(p), turn) for p in phi]
    roots = Rotation.from_quat([p.root for p in postures])
    dofs = FIGURE.full_dofs()
    out = np.maximum(*limit_excess(dofs[root].limit, roots.as_matrix()))
    flexion = side_of(end) * Rotation.from_quat([p.hinge for p in postures]).as_rotvec()[:, 0]
    ends = np.sort(side_of(end) * np.array([dofs[middle].lower[0], dofs[middle].upper[0]]))
    out = np.maximum(out, np.maximum(ends[0] - flexion, flexion - ends[1]))
    if turn is not None:
        arm = roots * Rotation.from_quat([p.hinge for p in postures])
        hand = (arm.inv() * Rotation.from_quat(turn)).as_euler("YZX")
        low = np.array([dofs[middle].lower[1], *dofs[tip].lower])
        high = np.array([dofs[middle].upper[1], *dofs[tip].upper])
        out = np.maximum(out, np.maximum(low - hand, hand - high).max(axis=1))
    return np.maximum(out, 0.0)


def is_inside(intervals: list[tuple[float, float]], phi: np.ndarray, margin: float = 0.0) -> np.ndarray:
    """Which angles lie in one of the intervals on the circle, widened by a margin."""
    turns = np.asarray(phi)[:, None] + 2 * np.pi * np.arange(-1, 2)
    found = np.zeros(len(turns), bool)
    for low, high in intervals:
        found |= ((turns >= low - margin) & (turns <= high + margin)).any(axis=1)
    return found


def longest_run(flags: np.ndarray) -> int:
    """Length of the longest run of true values on a circle."""
    if flags.all():
        return len(flags)
    edges = np.flatnonzero(~np.concatenate([flags, flags]))
    return int(np.diff(edges, prepend=-1, append=2 * len(flags)).max()) - 1


def check_intervals(
    end: str, target: np.ndarray, turn: np.ndarray | None = None
) -> list[tuple[float, float]]:
    """The promises of ``feasible_swivels`` for one target; returns the intervals."""
    intervals = LIMB[end].feasible_swivels(target, turn)
    if intervals == [(-np.pi, np.pi)]:
        assert excess(end, target, np.linspace(-np.pi, np.pi, 72, endpoint=False), turn).max() < 1e-7
        return intervals
    bounds = np.array(intervals).reshape(-1, 2)
    assert (bounds[:, 0] >= -np.pi).all() and (bounds[:, 1] > bounds[:, 0]).all()
    assert (bounds[1:, 0] > bounds[:-1, 1]).all()  # sorted and disjoint
    if len(bounds):
        assert bounds[-1, 1] - 2 * np.pi < bounds[0, 0] and bounds[:-1, 1].max(initial=-np.pi) <= np.pi
        at = excess(end, target, bounds.ravel(), turn)
        past = excess(end, target, (bounds + [-1e-3, 1e-3]).ravel(), turn)
        assert at.max() < 1e-7 and past.min() > 0.0  # the boundary is within 1e-3 rad of the interval's end
    count = 480
    phi = np.linspace(-np.pi, np.pi, count, endpoint=False)
    holds = excess(end, target, phi, turn) < 1e-7
    # A stretch narrower than the sampling step may be missed, never a wider one.
    narrow = int(STEP * count / (2 * np.pi)) + 1
    assert longest_run(~holds & is_inside(intervals, phi, -1e-3)) <= narrow
    assert longest_run(holds & ~is_inside(intervals, phi, 1e-3)) <= narrow
    return intervals


@ENDS
@settings(max_examples=25, deadline=None)
@given(seeds, shares)
def test_feasible_swivels_are_those_within_limits(end, seed, share):
    """Inside the intervals the joints are within their limits, outside they are not, to 1e-3 rad."""
    check_intervals(end, target_of(LIMB[end], seed, share))


@pytest.mark.parametrize("end", LIMBS[:2])
@settings(max_examples=30, deadline=None)
@given(seeds, shares, st.floats(-np.pi, np.pi))
def test_a_hand_narrows_the_swivels_to_what_the_wrist_can(end, seed, share, phi):
    """With a hand rotation forearm and wrist are within their ranges as well, by SciPy's Euler angles."""
    limb, rng = LIMB[end], np.random.default_rng(seed)
    target = target_of(limb, seed, share)
    free = limb.feasible_swivels(target)
    assume(free)
    # A rotation that some posture has: near a feasible angle, the wrist turned within its ranges.
    low, high = free[int(rng.integers(len(free)))]
    posture = limb.solve(target, low + (phi + np.pi) / (2 * np.pi) * (high - low))
    dofs = FIGURE.full_dofs()
    (_, elbow, wrist) = CHAIN[end]
    ranges = [
        (dofs[elbow].lower[1], dofs[elbow].upper[1]),
        *zip(dofs[wrist].lower, dofs[wrist].upper, strict=True),
    ]
    hand = Rotation.from_euler("YZX", [rng.uniform(a, b) for a, b in ranges])
    arm = Rotation.from_quat(posture.root) * Rotation.from_quat(posture.hinge)
    turn = (arm * hand).as_quat()
    intervals = check_intervals(end, target, turn)
    for a, b in intervals:
        for p in (a, 0.5 * (a + b), b):
            assert is_inside(free, np.array([p]), 1e-3)[0]
            solved = limb.solve(target, p, turn)
            chain = [Rotation.from_quat(q) for q in (solved.root, solved.hinge)]
            expected = (chain[0] * chain[1]).inv() * Rotation.from_quat(turn)
            assert (Rotation.from_quat(solved.end).inv() * expected).magnitude() < 1e-9
            told = Rotation.from_quat(solved.end).as_euler("YZX")
            for value, (least, most) in zip(told, ranges, strict=True):
                assert least - 1e-6 <= value <= most + 1e-6


@ENDS
def test_intervals_come_in_every_form(end):
    """Among random targets some have no interval, some one, some two, and some go over the circle's start."""
    forms = set()
    for seed in range(120):
        rng = np.random.default_rng(seed)
        intervals = LIMB[end].feasible_swivels(target_of(LIMB[end], seed, rng.uniform(0.5, 0.99)))
        forms.add(len(intervals))
        if intervals and intervals[-1][1] > np.pi:
            forms.add("over")
    assert forms >= ({0, 1, 2, "over"} if side_of(end) < 0 else {0, 1})


@ENDS
@settings(max_examples=40, deadline=None)
@given(seeds, st.floats(0.0, 0.99))
def test_a_flexion_out_of_range_has_no_swivels(end, seed, share):
    """Where the hinge would have to fold beyond its limit nothing is feasible, where not something may be."""
    limb, middle = LIMB[end], CHAIN[end][1]
    most = max(np.abs([FIGURE.dofs[middle].lower[0], FIGURE.dofs[middle].upper[0]]))
    l1, l2 = limb.lengths
    nearest = np.sqrt(l1**2 + l2**2 + 2 * l1 * l2 * np.cos(most))
    assume(abs(share * (l1 + l2) - nearest) > 1e-6)
    figure = AnalyticLimb(wide_open_but_hinges(), end)
    found = figure.feasible_swivels(target_of(limb, seed, share))
    assert found == ([] if share * (l1 + l2) < nearest else [(-np.pi, np.pi)])


def wide_open_but_hinges() -> sp.Figure:
    """Limits on elbows and knees alone."""
    table = tomllib.loads(sp.Limits.text())
    for joint in ("shoulder", "hip"):
        table[joint]["swing"] = [[-180, 180], [0, 180], [180, 180]]
        table[joint]["internal_rotation"] = table[joint]["external_rotation"] = 180
    return FIGURE.with_limits(sp.Limits(table))


@ENDS
def test_without_limits_the_whole_circle_is_feasible(end):
    """Limits that are wide open leave every swivel angle, at any target."""
    limb = AnalyticLimb(wide_open(), end)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        assert limb.feasible_swivels(target_of(limb, seed, rng.uniform(0.02, 1.3))) == [(-np.pi, np.pi)]


def test_left_and_right_are_mirror_images():
    """The mirrored target has the mirrored intervals."""
    for left, right in (LIMBS[:2], LIMBS[2:]):
        for seed in range(30):
            target = target_of(LIMB[left], seed, np.random.default_rng(seed).uniform(0.5, 0.99))
            here, there = (
                LIMB[left].feasible_swivels(target),
                LIMB[right].feasible_swivels(target * [-1, 1, 1]),
            )
            phi = np.linspace(-np.pi, np.pi, 100)
            near = [is_inside(here, phi, m) for m in (1e-3, -1e-3)]
            mirrored = is_inside(there, -phi)
            assert (mirrored <= near[0]).all() and (mirrored >= near[1]).all()


# --- wrong input --------------------------------------------------------------------------------------


def test_wrong_limbs_and_targets_are_refused():
    """No such limb, no direction, no numbers, no rotation: errors that say what would work."""
    with pytest.raises(sp.SixpointError, match="l_wrist"):
        AnalyticLimb(FIGURE, "l_elbow")
    with pytest.raises(sp.SixpointError, match="direction"):
        AnalyticLimb(FIGURE, "l_wrist", [0.0, 0.0, 0.0])
    limb, target = LIMB["r_wrist"], [0.1, -0.3, 0.2]
    for wrong in (
        [0.1, 0.2],
        [0.1, np.nan, 0.2],
        [np.inf, 0.0, 0.0],
        0.3,
        None,
        "here",
        [1e300, 0, 0],
        np.zeros((1, 3)),
    ):
        for call in (limb.solve, limb.feasible_swivels):
            with pytest.raises(sp.TargetError, match="3 finite numbers"):
                call(wrong)
    for turn in ([0.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [np.nan, 0, 0, 1], [np.inf, 0, 0, 1]):
        with pytest.raises(sp.TargetError, match="quaternion"):
            limb.solve(target, 0.0, turn)
        with pytest.raises(sp.TargetError, match="quaternion"):
            limb.feasible_swivels(target, turn)
    with pytest.raises(sp.TargetError, match="swivel"):
        limb.solve(target, np.nan)
    for wrong in ([0.0, 1.0], "up", [np.inf, 0.0, 1.0]):
        with pytest.raises(sp.SixpointError, match="3 finite numbers"):
            AnalyticLimb(FIGURE, "l_wrist", wrong)
    with pytest.raises(sp.SixpointError, match="hands"):
        LIMB["l_ankle"].feasible_swivels([0.0, -0.7, 0.1], [0, 0, 0, 1])


def test_a_rotation_need_not_be_a_unit_quaternion():
    """Its length says nothing, nor does its sign."""
    limb, target, turn = LIMB["l_wrist"], [0.1, -0.4, 0.2], np.array([0.1, -0.3, 0.2, 0.9])
    plain = limb.solve(target, 0.4, turn)
    longer = limb.solve(target, 0.4, -3.0 * turn)
    assert abs(plain.end @ longer.end) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(
        limb.feasible_swivels(target, turn), limb.feasible_swivels(target, -3.0 * turn), atol=1e-9
    )
