"""The hybrid: feet that stand, tasks that hold, and else the reconstruction it began from."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import sixpoint as sp
from independent import world_matrices
from prioritized_bodies import Body, mass_centre, support
from sixpoint.signals.contacts import find_contacts
from sixpoint.solvers.hybrid.feet import EASING, FOLLOWING, HELD, ROWS, hold_feet
from sixpoint.study.quality import compute_contact_drift
from test_solvers import FIGURE, points_of

ROLES = FIGURE.roles
REACH = FIGURE.targets(sp.make_sample("reach", FIGURE))
WALK = FIGURE.targets(sp.make_sample("walk", FIGURE))
FLAT = [0, 2]


def follow(ankles: np.ndarray, rate: float, floor: float = np.inf) -> tuple[np.ndarray, np.ndarray]:
    """Where ankles (F, 2, 3) belong and why (F, 2), frame by frame."""
    memory, points = np.zeros((2 * ROWS, 4)), np.zeros((6, 3))
    places, whys = np.empty_like(ankles), np.empty(ankles.shape[:2])
    for f, both in enumerate(ankles):
        points[4:] = both
        left, why_left, right, why_right = hold_feet(points, 1.0 / rate, floor, memory)
        places[f], whys[f] = (left, right), (why_left, why_right)
    return places, whys


def step(rate: float, slide: float = 0.0) -> np.ndarray:
    """Ankles (F, 2, 3): the right one stands; the left one comes in 0.4 s, stands 0.6 s, and leaves."""
    t = np.arange(0.0, 1.4, 1.0 / rate)
    way = np.interp(t, [0.0, 0.4, 1.0, 1.4], [0.0, 0.6, 0.6 + slide, 1.2])
    height = 0.08 + 0.1 * np.sin(np.pi * np.clip(t / 0.4, 0, 1)) + np.interp(t, [1.0, 1.4], [0.0, 0.3])
    left = np.stack([np.full_like(t, 0.1), height, way], axis=1)
    return np.stack([left, np.broadcast_to([-0.1, 0.08, 0.3], left.shape)], axis=1)


# --- contacts --------------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [30.0, 60.0, 120.0, 240.0])
def test_a_step_is_held_from_begin_to_end(rate):
    """At any frame rate a foot is held within 0.1 s of landing, and let go within 0.1 s of leaving."""
    places, why = follow(step(rate, slide=0.02), rate)
    held, time = why[:, 0] == HELD, np.arange(len(why)) / rate
    assert held[(time > 0.47) & (time < 1.0)].all() and not held[(time < 0.4) | (time > 1.1)].any()
    assert np.ptp(places[held & (time > 0.47), 0][:, FLAT], axis=0).max() == 0.0
    np.testing.assert_array_equal(places[..., 1], step(rate)[..., 1])  # the height is followed


def test_what_a_foot_is_off_by_fades_out():
    """A foot that is let go comes back to where it is seen in 0.1 s, without a jump."""
    ankles = step(120.0, slide=0.04)
    places, why = follow(ankles, 120.0)
    gap = np.linalg.norm(places - ankles, axis=-1)[:, 0]
    last = np.flatnonzero(why[:, 0] == HELD)[-1]
    assert gap[last] > 0.03
    assert (why[last + 1 : last + 12, 0] == EASING).all() and (why[last + 13 :, 0] == FOLLOWING).all()
    assert (np.diff(gap[last : last + 14]) <= 1e-12).all() and gap[last + 13] == 0.0
    assert np.abs(np.diff(gap[last:])).max() < 2.0 * gap[last] / 12


def test_noise_does_not_chop_a_contact():
    """With 1 mm of white noise a foot that stands is held in one piece."""
    noise = 1e-3 * np.random.default_rng(5).standard_normal(step(120.0).shape)
    _, why = follow(step(120.0) + noise, 120.0)
    held = np.flatnonzero(why[:, 0] == HELD)
    sure = held[(held > 60) & (held < 118)]
    assert len(sure) == 57
    assert (why[30:, 1] == HELD).all()


def test_a_foot_in_the_air_does_not_stand():
    """A foot that hangs still above the other's floor, one that passes low, and a jump are not held."""
    ankles = np.tile([[0.1, 0.3, 0.0], [-0.1, 0.08, 0.0]], (60, 1, 1))
    assert (follow(ankles, 120.0)[1][:, 0] == FOLLOWING).all()
    passing = ankles.copy()
    passing[:, 0] = [0.1, 0.08, 0.0] + np.linspace([0, 0, 0], [0, 0, 1.0], 60)
    assert (follow(passing, 120.0)[1][:, 0] == FOLLOWING).all()
    jump = np.tile([[0.1, 0.08, 0.0], [-0.1, 0.08, 0.0]], (120, 1, 1))
    jump[60:, :, 1] += 2.5 * np.arange(60)[:, None] / 120 - 4.9 * (np.arange(60)[:, None] / 120) ** 2
    assert (follow(jump, 120.0)[1][66:] != HELD).all()


def test_a_given_floor_tells_feet_that_dangle():
    """Hanging feet are not held where the floor is known; else the lowest height is taken for it."""
    ankles = np.tile([[0.1, 0.35, 0.0], [-0.1, 0.35, 0.0]], (60, 1, 1))
    assert (follow(ankles, 120.0, floor=0.0)[1] == FOLLOWING).all()
    assert (follow(ankles, 120.0)[1][10:] == HELD).all()
    assert (follow(ankles - [0.0, 0.27, 0.0], 120.0, floor=0.0)[1][10:] == HELD).all()


def test_a_lost_ankle_is_let_go():
    """NaN is nowhere; when it is seen again it is where it is seen."""
    ankles = step(120.0, slide=0.04)
    ankles[100:105, 0] = np.nan
    places, why = follow(ankles, 120.0)
    assert why[99, 0] == HELD and (why[100:105, 0] == FOLLOWING).all() and np.isnan(places[100:105, 0]).all()
    np.testing.assert_array_equal(places[105, 0], ankles[105, 0])


def test_slow_slides_end_a_contact():
    """No foot is held farther than 10 cm away, however slowly it leaves."""
    ankles = np.tile([[0.1, 0.08, 0.0], [-0.1, 0.08, 0.0]], (1200, 1, 1))
    ankles[:, 0, 2] = np.linspace(0.0, 0.5, 1200)
    places, why = follow(ankles, 120.0)
    assert 0.09 < np.linalg.norm(places - ankles, axis=-1).max() <= 0.1
    assert (why[:, 0] == HELD).mean() > 0.9


numbers = st.one_of(st.floats(allow_nan=True, allow_infinity=True, width=64), st.floats(-1, 1))


@settings(max_examples=200, deadline=None)
@given(arrays(float, (8, 2, 3), elements=numbers), st.sampled_from([0.0, -1.0, 1e-9, 1 / 60, 1.0, 1e9]))
def test_no_ankles_break_it(ankles, dt):
    """Whatever is seen, a known ankle belongs somewhere finite, at most 10 cm and what fades from there."""
    memory, points = np.zeros((2 * ROWS, 4)), np.zeros((6, 3))
    for both in ankles:
        points[4:] = both
        left, _, right, _ = hold_feet(points, dt, np.inf, memory)
        for seen, place in zip(both, (left, right), strict=True):
            if (np.abs(seen) < 1e7).all():
                assert np.isfinite(place).all()
                assert np.linalg.norm(np.subtract(place, seen)) < 0.3


# --- the figure ------------------------------------------------------------------------------------


@pytest.mark.parametrize("sample", sorted(sp.SAMPLES))
def test_without_contacts_it_is_the_reconstruction(sample):
    """With nothing to hold no iteration is needed, and the pose is the start's, whatever that misses."""
    targets = FIGURE.targets(sp.make_sample(sample, FIGURE))
    begun = sp.SequentialIKPlus(FIGURE).solve_frames(targets)
    solved = sp.HybridIK(FIGURE, contacts=False).solve_frames(targets)
    gap = np.abs(world_matrices(solved.motion)[0] - world_matrices(begun.motion)[0])
    np.testing.assert_allclose(gap, 0.0, atol=1e-9)
    np.testing.assert_array_equal(solved.status, begun.status)


@pytest.mark.parametrize("sample", sorted(sp.SAMPLES))
def test_at_most_three_iterations_and_no_sliding(sample):
    """Frame by frame: feet that stand stay within 1 mm, or are drawn by a leg that is stretched."""
    targets = FIGURE.targets(sp.make_sample(sample, FIGURE))
    places, why = follow(targets.positions[:, 4:], targets.rate)
    solver, solution, motions = sp.HybridIK(FIGURE, limits=False), None, []
    for points in targets.positions:
        solution = solver.solve(points, previous=solution, dt=1 / targets.rate)
        assert solution.iterations <= 3
        motions.append(solution.pose)
    positions, _ = world_matrices(sp.Motion.from_poses(motions, targets.rate))
    hips, ankles = positions[:, ROLES.hip], positions[:, ROLES.ankle]
    gap = np.linalg.norm((ankles - places)[..., FLAT], axis=-1)
    root, middle, end = FIGURE.roles.limbs[2]
    leg = sum(np.linalg.norm(FIGURE.offset_between(a, b)) for a, b in ((root, middle), (middle, end)))
    stretched = np.linalg.norm(places - hips, axis=-1) > 0.999 * leg
    assert (why == HELD).any()
    assert gap[(why == HELD) & ~stretched].max() < 1.1e-3


def test_a_frame_needs_only_the_one_before():
    """What comes later changes nothing, and another solution of the same frame does not either."""
    solver = sp.HybridIK(FIGURE)
    whole = solver.solve_motion(WALK).rotations
    np.testing.assert_array_equal(solver.solve_motion(WALK.sliced(slice(0, 50))).rotations, whole[:50])


def test_the_start_may_be_any_solver_of_six_points():
    """Feet that stand are held from other reconstructions as well, PIK among them, and live as well."""
    sliding = np.tile(REACH.positions[0], (60, 1, 1))
    sliding[:, 4, 2] += np.linspace(0.0, 0.04, 60)
    targets = sp.Targets(sliding, 60.0)
    for name in ("sik", "pik-flext"):
        start = sp.make_solver(name, FIGURE)
        solver, solution = sp.HybridIK(FIGURE, start=start), None
        begun, solved = start.solve_motion(targets), solver.solve_motion(targets)
        ways = [np.ptp(world_matrices(m)[0][5:, ROLES.ankle[0], 2]) for m in (begun, solved)]
        assert ways[0] > 0.035 and ways[1] < 2e-3
        for frame in range(20):
            solution = solver.solve(sliding[frame], previous=solution)
            np.testing.assert_array_equal(solution.pose.rotations, solved.rotations[frame])


def test_an_unknown_frame_time_is_forgotten():
    """After a frame time that is not a number contacts begin and end as before."""
    ankles, solver = step(120.0), sp.HybridIK(FIGURE)
    points = np.tile(points_of(FIGURE), (len(ankles), 1, 1))
    points[:, 4:] = ankles
    solution, expected = None, None
    for frame, six in enumerate(points):
        solution = solver.solve(six, previous=solution, dt=np.nan if frame == 5 else 1 / 120)
        expected = solver.solve(six, previous=expected, dt=1 / 120)
        if frame > 40:
            np.testing.assert_array_equal(solution.state[-1][[3, 9], 3], expected.state[-1][[3, 9], 3])
    assert np.isfinite(solution.state[-1]).all()


# --- tasks -----------------------------------------------------------------------------------------


def test_a_hand_keeps_its_contact():
    """A hand on a rail stays there while its tracker moves, the feet stand, and the rest hardly moves."""
    rail = REACH.positions[20, 2] + [-0.05, 0.12, 0.1]
    still = REACH.positions[20] + 0.01 * np.sin(np.arange(80))[:, None, None] * np.ones((6, 3))
    still[:, 4:] = REACH.positions[20, 4:]
    targets = sp.Targets(still, 60.0)
    task = sp.PositionTask("l_wrist", level=2, goal=rail)
    solved = sp.HybridIK(FIGURE, [task]).solve_frames(targets)
    positions, _ = world_matrices(solved.motion)
    assert np.linalg.norm(positions[:, ROLES.wrist[0]] - rail, axis=1).max() < 2e-3
    assert np.ptp(positions[5:, ROLES.ankle][..., FLAT], axis=0).max() < 2e-3
    plain = world_matrices(sp.SequentialIKPlus(FIGURE).solve_motion(targets))[0]
    np.testing.assert_allclose(positions[:, ROLES.pelvis], plain[:, ROLES.pelvis], atol=2e-3)
    np.testing.assert_allclose(positions[:, ROLES.knee], plain[:, ROLES.knee], atol=0.03)
    assert solved.residual.shape == (80, 7) and solved.residual[:, 6].max() < 2e-3
    assert (solved.residual[:, 2] > 0.01).all() and (solved.status == sp.Status.UNREACHABLE).all()


def test_an_obstacle_holds():
    """Hands go round a ball in their way; without the task they go through it."""
    begun = world_matrices(sp.SequentialIKPlus(FIGURE).solve_motion(REACH))[0]
    centre, radius = begun[100, ROLES.wrist[0]] + [0.0, -0.02, 0.03], 0.08
    points = ("l_wrist", "r_wrist")
    task = sp.ObstacleTask(points[0], points=points[1:], level=2, shape=sp.Sphere(radius), goal=centre)
    solved = sp.HybridIK(FIGURE, [task]).solve_motion(REACH)
    there = world_matrices(solved)[0]
    distance = [np.linalg.norm(p[:, ROLES.wrist] - centre, axis=-1).min() for p in (begun, there)]
    assert distance[0] < 0.05 and distance[1] > radius - 2e-3
    feet = there[:, ROLES.ankle][..., FLAT]
    places, why = follow(REACH.positions[:, 4:], REACH.rate)
    assert np.linalg.norm(feet - places[..., FLAT], axis=-1)[why == HELD].max() < 2e-3


def test_balance_holds():
    """Points of a lean that would fall are met as far as the centre of mass stays over the feet."""
    lean = np.tile(points_of(FIGURE), (40, 1, 1))
    lean[:, :4, 2] += np.linspace(0.0, 0.25, 40)[:, None]
    lean[:, :4, 1] -= 0.06
    targets = sp.Targets(lean, 60.0)
    task = sp.BalanceTask(level=2)
    balanced = sp.HybridIK(FIGURE, [task], limits=False).solve_frames(targets)
    plain = sp.HybridIK(FIGURE, limits=False).solve_frames(targets)
    body = Body("figure", FIGURE, FIGURE.dofs)
    off = []
    for solved in (plain, balanced):
        worlds = world_matrices(solved.motion)
        centres = mass_centre(body, *worlds)[:, [0, 2]]
        hulls = [support(body, *world).equations for world in zip(*worlds, strict=True)]
        off.append(max((e[:, :2] @ c + e[:, 2]).max() for e, c in zip(hulls, centres, strict=True)))
    assert off[0] > 0.01 and off[1] < -0.01  # the margin asked for is 2 cm
    ankles = world_matrices(balanced.motion)[0][5:, ROLES.ankle]
    assert np.ptp(ankles[..., FLAT], axis=0).max() < 2e-3


def test_ankles_stay_above_the_floor():
    """With a floor no foot goes through it, whatever the trackers say."""
    sunk = WALK.positions.copy()
    sunk[..., 1] -= 0.06
    sole = FIGURE.rest_positions[ROLES.ankle[0], 1] - FIGURE.rest_positions[:, 1].min()
    for floor, lowest in ((None, -np.inf), (0.0, sole - 2e-3)):
        motion = sp.HybridIK(FIGURE, floor=floor).solve_motion(sp.Targets(sunk, WALK.rate))
        ankles = world_matrices(motion)[0][:, ROLES.ankle, 1]
        assert ankles.min() > lowest
        assert floor is not None or ankles.min() < sole - 0.02


def test_goals_may_be_given_frame_by_frame():
    """A task without a goal is off; a goal turns it on for its frame; residuals are in the order of names."""
    solver = sp.HybridIK(FIGURE, [sp.PositionTask("r_wrist", level=2), sp.LookAtTask("head", level=45)])
    assert solver.names == (*sp.EFFECTORS, "r_wrist", "head gaze")
    points = points_of(FIGURE)
    off = solver.solve(points)
    assert off.status is sp.Status.CONVERGED and off.residual[6:].tolist() == [0.0, 0.0]
    goal = points[3] + [-0.05, 0.1, 0.1]
    on = solver.solve(points, previous=off, goals={"r_wrist": goal})
    assert on.residual[6] < 2e-3 and on.residual[3] > 0.1 and on.status is sp.Status.UNREACHABLE
    with pytest.raises(sp.TargetError, match="r_wrist"):
        solver.solve(points, goals={"l_wrist": goal})


def test_wrong_constructions_say_what_would_work():
    """Postures, floors, starts and solutions that do not fit are errors."""
    with pytest.raises(sp.SixpointError, match="PostureTask"):
        sp.HybridIK(FIGURE, [sp.PostureTask()])
    with pytest.raises(sp.SixpointError, match="floor"):
        sp.HybridIK(FIGURE, floor=np.nan)
    with pytest.raises(sp.SixpointError, match="another figure"):
        sp.HybridIK(FIGURE, start=sp.SequentialIK(sp.Figure.from_stature(1.6)))
    stranger = sp.SequentialIKPlus(FIGURE).solve(points_of(FIGURE))
    with pytest.raises(sp.SixpointError, match="previous"):
        sp.HybridIK(FIGURE).solve(points_of(FIGURE), previous=stranger)


# --- recordings ------------------------------------------------------------------------------------


def test_drift_is_the_way_from_where_a_contact_began():
    """The measure against a loop; a motion that slides 1 cm in a contact drifts 1 cm."""
    truth = sp.make_sample("walk", FIGURE)
    result = sp.SequentialIK(FIGURE).solve_motion(FIGURE.targets(truth))
    contacts = find_contacts(truth.positions[:, ROLES.ankle], truth.rate)
    expected = []
    for k in range(2):
        first = 0
        for f in range(len(truth)):
            if contacts[f, k]:
                first = first if f > 0 and contacts[f - 1, k] else f
                way = result.positions[f, ROLES.ankle[k]] - result.positions[first, ROLES.ankle[k]]
                expected.append(np.hypot(way[0], way[2]))
    np.testing.assert_allclose(compute_contact_drift(FIGURE, truth, result), expected, atol=1e-12)


@pytest.mark.parametrize(("walk", "grows"), [("02_01", 0.03), ("16_01", 0.08), ("09_12", 0.03)])
def test_feet_of_recorded_walks_stand(walk, grows, data):
    """Drift at most 5 mm and a fifth of SIK+'s in the mean; the position error grows by at most 3 %.

    In 16_01 the true ankles slide by 12 mm on average while they stand, so holding them costs more.
    """
    truth = sp.load(data / "cmu" / f"{walk}.amc")
    figure = sp.Figure.from_motion(truth)
    targets = figure.targets(truth)
    plus = sp.SequentialIKPlus(figure).solve_motion(targets)
    solved = sp.HybridIK(figure).solve_motion(targets)
    before, after = (compute_contact_drift(figure, truth, m) for m in (plus, solved))
    assert after.mean() < 0.005 and after.mean() < before.mean() / 5
    assert np.percentile(after, 95) < 0.006 and np.percentile(after, 95) < np.percentile(before, 95) / 4
    errors = [sp.compute_errors(figure, truth, m).position for m in (plus, solved)]
    assert errors[1] < (1 + grows) * errors[0]
