"""FLEXT (Boulic and Raunhardt 2009): a limb flexes out of its singular poses, in strict order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import sixpoint as sp
from prioritized_bodies import Body, State, Z, crane, figure, leg, limb

FORMS = pytest.mark.parametrize("form", ["secant", "tangent", "exponential", "hinge"])


def after(body: Body, tasks: list, goals: dict, count: int, start: State | None = None, **options: object):
    """The solution after so many iterations, neither more nor fewer."""
    number = {"iterations": count, "least_iterations": count, "cold_iterations": count}
    solver = body.solver(tasks, gain=0.5, **number, **options)
    return solver.solve(goals, start=None if start is None else body.pose(start))


def bent(body: Body, angle: float) -> State:
    """The body with its hinge at an angle."""
    return body.set_angles(body.rest(), body.joint("elbow"), angle)


STRAIGHT = (limb(), 0.0, (0.0, -0.40, 0.0))
FOLDED = (limb(low=-np.pi), -np.pi, (0.0, -0.20, 0.0))
FOLDED_EVENLY = (limb(lower=0.3, low=-np.pi), -np.pi, (0.0, -0.17, 0.0))
SINGULAR = pytest.mark.parametrize("case", [STRAIGHT, FOLDED], ids=["straight", "folded"])
WIDE = {"max_angle": 1.0}  # a cap that does not shorten FLEXT's own steps


@pytest.mark.parametrize("case", [STRAIGHT, FOLDED, FOLDED_EVENLY], ids=["straight", "folded", "even"])
def test_a_position_task_is_blind_in_a_singular_pose(case):
    """0.17 m along the limb from exact full extension, or flexion: a plain position task never moves."""
    body, angle, goal = case
    for count in (5, 30):
        solution = after(body, [sp.PositionTask("hand")], {"hand": goal}, count, bent(body, angle))
        assert solution.residual[0] == pytest.approx(0.17, abs=1e-3)


@SINGULAR
@FORMS
def test_flext_leaves_a_singular_pose_at_once(case, form):
    """The same goal by FLEXT: within 1 cm after 6 iterations of half steps, 1 mm after 12."""
    body, angle, goal = case
    task, last = sp.FlextTask("hand", form=form), 0.17 + 1e-9
    for count, bound in ((1, last), (2, last), (3, last), (6, 0.01), (12, 1e-3)):
        residual = after(body, [task], {"hand": goal}, count, bent(body, angle), **WIDE).residual[0]
        assert residual < min(bound, last)
        last = residual


@SINGULAR
def test_flext_leaves_a_singular_pose_at_once_by_default(case):
    """So it does with the default cap of a joint's turn."""
    body, angle, goal = case
    for count, bound in ((6, 0.01), (12, 1e-3)):
        assert (
            after(body, [sp.FlextTask("hand")], {"hand": goal}, count, bent(body, angle)).residual[0] < bound
        )


@pytest.mark.parametrize("form", ["tangent", "exponential"])
def test_flext_unfolds_a_limb_whose_end_is_at_its_root(form):
    """With no line to the end yet, the limb opens all the same: 1 cm after 14 half steps, 1 mm after 20."""
    body, angle, goal = FOLDED_EVENLY
    for count, bound in ((14, 0.01), (20, 1e-3)):
        solution = after(body, [sp.FlextTask("hand", form=form)], {"hand": goal}, count, bent(body, angle))
        assert solution.residual[0] < bound


@pytest.mark.parametrize("form", ["tangent", "exponential", "secant"])
def test_a_goal_far_across_a_straight_limb_is_met(form):
    """Folding first takes the end away from such a goal; the solver goes on until it is there."""
    body = crane(low=-np.pi)
    solution = body.solver([sp.FlextTask("hand", form=form)]).solve({"hand": (0.09, 0.32, -0.27)})
    assert solution.residual[0] < 0.01


@SINGULAR
def test_the_rank_never_drops(case):
    """FLEXT and the rows across have rank 3 in every iteration; the position's rows have 2 at first."""
    body, angle, goal = case
    for count in range(13):
        start = bent(body, angle)
        pose = (
            after(body, [sp.FlextTask("hand", form="tangent")], {"hand": goal}, count, start).pose
            if count
            else body.pose(start)
        )
        flexed, plain = (
            body.solver([task]).compute_step({"hand": goal}, start=pose).jacobian
            for task in (sp.FlextTask("hand", form="tangent"), sp.PositionTask("hand"))
        )
        assert np.linalg.svd(flexed)[1].min() > 0.02
        assert (np.linalg.svd(plain)[1].min() < 1e-6) == (count == 0)


def test_near_the_singularity_flexing_is_faster():
    """From 0.01 rad of flexion, after five half steps: FLEXT within 1 cm, the position task far from it."""
    body, goals = limb(), {"hand": (0.0, -0.40, 0.0)}
    plain, flexed = (
        after(body, [task], goals, 5, bent(body, -0.01), **WIDE).residual[0]
        for task in (sp.PositionTask("hand"), sp.FlextTask("hand"))
    )
    assert flexed < 0.01 < 0.03 < plain


def test_flexing_blindness_recruits_the_trunk_and_flext_does_not():
    """An almost straight arm asked inward: a position task leans the trunk back, FLEXT bends the elbow."""
    body = crane()
    goals, start = {"hand": (0.0, 0.5, 0.40)}, bent(body, -1e-3)
    leaned = []
    for task in (sp.PositionTask("hand"), sp.FlextTask("hand")):
        solution = after(body, [task], goals, 12, start)
        shoulder = body.world(solution.pose)[0][1]
        leaned.append(np.linalg.norm(shoulder - [0.0, 0.5, 0.0]))
        assert solution.residual[0] < 0.01
    assert leaned[0] > 0.05
    assert leaned[1] < 0.005


@pytest.mark.parametrize("reach", [0.0, 0.1])
def test_a_lost_rank_lets_lower_tasks_move_the_limb_and_flext_does_not(reach):
    """Held at full extension, or drawn beyond it: a less important task may not bend the elbow."""
    body = limb()
    goals = {"hand": (0.0, -0.57 - reach, 0.0), "elbow": (0.0, -0.28, -0.1)}
    lower = sp.PositionTask("elbow", level=5)
    plain, flexed = (
        body.solver([task, lower]).compute_step(goals)
        for task in (sp.PositionTask("hand"), sp.FlextTask("hand"))
    )
    assert abs(plain.step[3]) > 0.1  # the hinge
    assert abs(flexed.step[3]) < 0.003
    assert flexed.jacobian[0] @ flexed.step == pytest.approx(flexed.wanted[0], abs=1e-12)
    assert np.linalg.norm(flexed.jacobian[0]) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("reach", [0.0, 0.1])
def test_at_full_extension_an_outer_goal_is_no_task(reach):
    """Exactly straight and drawn outward, or held: FLEXT asks for nothing, so nothing moves."""
    step = limb().solver([sp.FlextTask("hand")]).compute_step({"hand": (0.0, -0.57 - reach, 0.0)})
    assert step.wanted[0] == 0.0
    np.testing.assert_allclose(step.step, 0.0, atol=1e-9)


@settings(max_examples=50, deadline=None)
@given(st.floats(-2.3, -0.7), st.floats(-0.02, 0.02), st.tuples(*[st.floats(-1, 1)] * 3))
def test_alone_it_is_the_posture_variation_itself(angle, wish, turn):
    """With a goal on the limb's line the row times the task moves the end there; the step flexes as much."""
    body = limb()
    state = bent(body, angle)
    state.local[0] = Rotation.from_rotvec(turn).as_quat()
    hand = body.world(state)[0][2]
    goal = hand * (1 + wish / np.linalg.norm(hand))
    step = body.solver([sp.FlextTask("hand", form="tangent")], limits=False).compute_step(
        {"hand": goal}, start=body.pose(state)
    )
    assert step.jacobian[0] @ step.step == pytest.approx(step.wanted[0], abs=1e-9)
    there = body.world(body.moved(state, step.jacobian[0] * step.wanted[0]))[0][2]
    np.testing.assert_allclose(there, goal, atol=1e-7)


@FORMS
@pytest.mark.parametrize("offset", [(0, 0, 0), (0.06, -0.03, 0.04)])
@pytest.mark.parametrize("high", [0.0, 0.15])
def test_off_plane_and_overextended_limbs_converge(form, offset, high):
    """With a marker beside the limb, and from beyond the straight limb, the goal is met to 1 mm."""
    body = limb(high=high)
    start = bent(body, high)
    positions, world = body.world(start)
    hand = positions[2] + world[2] @ np.array(offset)
    solution = after(body, [sp.FlextTask("hand", offset=offset, form=form)], {"hand": hand * 0.7}, 25, start)
    assert solution.residual[0] < 1e-3
    assert body.solver([sp.FlextTask("hand")]).hinge_angles(solution)["elbow"][0] < -0.5


def test_a_hinge_at_its_limit_keeps_the_limb_there():
    """A goal nearer than the hinge allows leaves the limb at the limit, pointing at the goal."""
    body = limb(low=-1.0)
    solution = after(body, [sp.FlextTask("hand")], {"hand": (0.0, -0.1, 0.1)}, 30)
    length = np.sqrt(0.3**2 + 0.27**2 + 2 * 0.3 * 0.27 * np.cos(1.0))
    assert solution.residual[0] == pytest.approx(length - np.hypot(0.1, 0.1), abs=1e-3)
    assert solution.status is sp.Status.UNREACHABLE


@pytest.mark.parametrize(
    "task", [sp.FlextTask("foot", level=1), sp.FlextTask("foot", level=1, predict=False)]
)
@pytest.mark.parametrize("rise", [0.05, -0.05])
def test_a_raised_hip_opens_the_knee_by_the_cosine_rule(task, rise):
    """The hip moves 5 cm with the foot held: the knee has the angle of the triangle."""
    body = leg()
    state = body.set_angles(body.rest(), 1, 1.0)
    positions, _ = body.world(state)
    goals = {"hip": positions[0] + [0.0, rise, 0.0], "foot": positions[2]}
    solution = after(body, [sp.PositionTask("hip"), task], goals, 30, state)
    distance = np.linalg.norm(goals["hip"] - goals["foot"])
    cosine = (distance**2 - 0.42**2 - 0.4**2) / (2 * 0.42 * 0.4)
    knee = Rotation.from_matrix(body.locals(solution.pose)[1]).as_rotvec()[0]
    assert solution.residual.max() < 1e-4
    assert knee == pytest.approx(np.arccos(cosine), abs=1e-3)


def test_prediction_holds_the_foot_while_the_hip_moves():
    """In the same step that moves the hip, the held foot moves less than without prediction."""
    body = leg()
    state = body.set_angles(body.rest(), 1, 1.0)
    positions, _ = body.world(state)
    goals = {"hip": positions[0] + [0.0, 0.05, 0.0], "foot": positions[2]}
    slips = []
    for predict in (True, False):
        tasks = [sp.PositionTask("hip"), sp.FlextTask("foot", level=1, predict=predict)]
        step = body.solver(tasks).compute_step(goals, start=body.pose(state)).step
        slips.append(np.linalg.norm(body.world(body.moved(state, step))[0][2] - positions[2]))
    assert slips[0] < 0.005 < 0.03 < slips[1]


def test_drag_brings_the_body_along():
    """Beyond the arm, drag leans the trunk until the hand is there; without, the arm only points."""
    body = crane()
    goals, start = {"hand": (0.0, 0.45, 0.75)}, bent(body, -0.5)
    stays = after(body, [sp.FlextTask("hand", drag=False)], goals, 40, start)
    leans = after(body, [sp.FlextTask("hand", drag=True)], goals, 40, start)
    reach = np.linalg.norm(np.array(goals["hand"]) - body.world(stays.pose)[0][1])
    assert stays.residual[0] == pytest.approx(reach - 0.57, abs=2e-3) and stays.residual[0] > 0.1
    assert leans.residual[0] < 1e-3


@FORMS
def test_a_goal_at_the_limbs_root_folds_it(form):
    """A goal at the shoulder is as good as the hinge allows, and finite."""
    body = limb()
    solution = after(body, [sp.FlextTask("hand", form=form)], {"hand": (0.0, 0.0, 0.0)}, 40)
    least = np.sqrt(0.3**2 + 0.27**2 + 2 * 0.3 * 0.27 * np.cos(2.6))
    assert solution.residual[0] == pytest.approx(least, abs=2e-3)


@pytest.mark.parametrize(
    ("at", "root", "middle"), [("l_wrist", "l_shoulder", "l_elbow"), ("r_ankle", "r_hip", "r_knee")]
)
def test_limbs_of_a_figure_flex_from_the_neutral_pose(at, root, middle):
    """Arms and legs hang exactly straight: FLEXT draws an end 15 cm towards its root, the right way round."""
    body = figure()
    positions, _ = body.world(body.rest())
    up = positions[body.joint(root)] - positions[body.joint(at)]
    goals = {at: positions[body.joint(at)] + 0.15 * up / np.linalg.norm(up), "pelvis": positions[body.base]}
    tasks = [sp.PositionTask("pelvis"), sp.OrientationTask("pelvis"), sp.FlextTask(at, level=1)]
    goals["pelvis orientation"] = (0.0, 0.0, 0.0, 1.0)
    solution = after(body, tasks, goals, 15, body.rest())
    assert solution.residual.max() < 1e-3
    end = body.world(solution.pose)[0][body.joint(middle)]
    forward = 1.0 if "ankle" in at else -1.0  # the knee goes forward, the elbow back
    assert forward * (end - positions[body.joint(middle)]) @ Z > 0.05


numbers = st.floats(-1.0, 1.0)


@pytest.mark.parametrize("make", [limb, crane], ids=["limb", "crane"])
@settings(max_examples=60, deadline=None)
@given(
    st.tuples(numbers, numbers, numbers), st.sampled_from(["tangent", "exponential", "hinge"]), st.booleans()
)
def test_every_goal_gives_a_finite_pose(make, goal, form, drag):
    """Wherever the goal is, the pose is finite and within its limits."""
    body = make(low=-np.pi)
    solution = body.solver([sp.FlextTask("hand", form=form, drag=drag)]).solve({"hand": goal})
    assert np.isfinite(solution.pose.rotations).all() and np.isfinite(solution.residual).all()
    hinge = solution.state[0][len(body.skeleton) + 1 + body.joint("elbow"), 0]
    assert -np.pi <= hinge <= 0.0
