"""Kits of 3 to 11 trackers: what is absent is filled by stated rules, what is extra leads the body."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure, SpineChain
from sixpoint.body.motion import Motion
from sixpoint.body.targets import EFFECTORS, GUIDES, POINTS
from sixpoint.calibration.profile import parse_profile
from sixpoint.calibration.roles import KITS
from sixpoint.errors import SkeletonError
from sixpoint.formats import load
from sixpoint.live.feet import Floor, level_feet
from sixpoint.live.guides import Guidance
from sixpoint.live.stance import Stance, compute_yaw, turned
from sixpoint.live.stepping import DURATION, FASTEST, LEAD, STRIDE, Stepping, wrap
from sixpoint.live.tracking import Tracked, Tracking
from sixpoint.samples import make_sample
from sixpoint.solvers.sequential_plus.solver import SequentialIKPlus
from sixpoint.solvers.sequential_plus.start import find_start
from start_poses import POSES, stand

FIGURE = Figure.from_stature(1.75)
UP = np.array([0.0, 1.0, 0.0])


def kit_of(points, turns, names):
    rows = [POINTS.index(n) for n in names]
    p, q = np.full((11, 3), np.nan), np.full((11, 4), np.nan)
    p[rows], q[rows] = points[rows], turns[rows]
    return p, q


@pytest.mark.parametrize("kit", KITS)
@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_every_kit_makes_a_standing_person_stand(kit, yaw):
    """From a standing pose, absent effectors come out within 12 cm of where they are."""
    points, turns = stand(FIGURE, "arms hanging", yaw)
    tracking = Tracking(FIGURE, floor=float(points[4, 1]) - 0.039 * 1.75)
    p, q = kit_of(points, turns, KITS[kit])
    out = tracking.update(0.0, p, q)
    error = np.linalg.norm(out.positions - points[:6], axis=1)
    assert error.max() < 0.12, dict(zip(EFFECTORS, error.round(3), strict=True))
    seen = [n in KITS[kit] for n in EFFECTORS]
    assert (error[seen] == 0.0).all()
    assert abs(wrap(tracking.stance.yaw - yaw)) < 1e-6


@pytest.mark.parametrize("kit", [3, 4, 5, 6, 11])
def test_a_kit_drives_the_solver(kit):
    """Head and hands of a walk, and more: residuals stay small, feet are on the floor, no NaN."""
    motion = make_sample("walk", FIGURE)
    targets, solver = FIGURE.targets(motion), SequentialIKPlus(FIGURE, rotations=EFFECTORS)
    rows = [EFFECTORS.index(n) for n in KITS[kit] if n in EFFECTORS]
    p, q = np.full((len(targets), 6, 3), np.nan), np.full((len(targets), 6, 4), np.nan)
    p[:, rows], q[:, rows] = targets.positions[:, rows], targets.rotations[:, rows]
    tracking, guidance, solution = Tracking(FIGURE), Guidance(FIGURE), None
    for k in range(0, len(targets), 4):
        frame = tracking.update(k / 60, p[k], q[k])
        solution = guidance.solve(solver, frame, solution, 1 / 15)
        pose = level_feet(FIGURE, solution.pose)
        assert np.isfinite(pose.rotations).all()
        assert solution.residual.max() < 0.15
    at = pose.compute_transforms()[0]
    assert abs(at[list(FIGURE.roles.ankle), 1].min() - 0.068) < 0.05


def test_a_head_that_sinks_crouches():
    """The pelvis follows a head down: lower and farther back, never below the floor, continuously."""
    stance = Stance(FIGURE)
    turns = np.full((6, 4), np.nan)
    turns[1] = rot.IDENTITY
    heights = np.linspace(1.7, 0.0, 341)
    points = np.full((6, 3), np.nan)
    pelvis = []
    for y in heights:
        points[1] = [0.0, y, 0.0]
        stance.face(1 / 60, points, turns)
        pelvis.append(stance.find_pelvis(points[1]))
    pelvis = np.array(pelvis)
    assert (np.diff(pelvis[:, 1]) <= 1e-12).all() and pelvis[:, 1].min() >= 0.0
    assert (pelvis[:, 1] <= heights + 1e-9).all()
    assert np.linalg.norm(np.diff(pelvis, axis=0), axis=1).max() < 0.03
    crouched = pelvis[np.argmin(np.abs(heights - 1.1))]
    assert crouched[2] < -0.2 and 0.5 < crouched[1] < 0.9


def test_sitting_puts_feet_before_the_seat():
    """A head at sitting height: thighs forward, shanks upright, feet as high as the calves allow."""
    points, turns = stand(FIGURE, "sitting", 0.5)
    tracking = Tracking(FIGURE, posture="sitting", floor=float(points[4, 1]) - 0.039 * 1.75)
    out = tracking.update(0.0, *kit_of(points, turns, KITS[3]))
    error = np.linalg.norm(out.positions - points[:6], axis=1)
    assert error.max() < 0.15, error
    forward = turned(-0.5, out.positions[4:6] - out.positions[0])
    assert (forward[:, 2] > 0.3).all() and (forward[:, 1] < -0.3).all()


def test_the_body_follows_the_head_only_when_it_turns_far():
    """Looking aside by 20 degrees turns nothing; looking back turns the body, at most 8 rad/s."""
    stance, points = Stance(FIGURE), np.full((6, 3), np.nan)
    turns = np.full((6, 4), np.nan)

    def look(angle, seconds):
        turns[1] = rot.from_axis_angle(UP, angle)
        course = [stance.face(0.01, points, turns) for _ in range(round(100 * seconds))]
        return np.array(course)

    look(0.0, 0.1)
    assert abs(look(np.radians(20), 1.0)[-1]) < 1e-9
    course = look(np.radians(120), 3.0)
    assert np.abs(np.diff(course)).max() <= 0.08 + 1e-9
    assert np.radians(95) < course[-1] < np.radians(105)


@settings(max_examples=50)
@given(st.floats(-3.1, 3.1), st.floats(-1.3, 1.3), st.floats(-0.5, 0.5))
def test_yaw_is_that_of_the_gaze_and_steady_when_it_tilts(yaw, pitch, roll):
    """The twist about the vertical: pitch alone leaves it, and a turn about the vertical adds to it."""
    tilt = rot.from_euler("XZ", [pitch, roll])
    assert abs(wrap(compute_yaw(rot.from_euler("YX", [yaw, pitch])) - yaw)) < 1e-9
    both = rot.mul(rot.from_axis_angle(UP, yaw), tilt)
    assert abs(wrap(compute_yaw(both) - yaw - compute_yaw(tilt))) < 1e-9


def test_feet_stand_or_step():
    """A body that walks 3 m: each foot stands or swings, never both at once, and they keep up."""
    steps, at = Stepping(1.75), []
    for k in range(360):
        x = min(max(k - 30, 0) / 90 * 1.2, 3.0)
        places = np.array([[0.1, x], [-0.1, x]])
        at.append(steps.update(1 / 90, places, 0.0)[0])
    at = np.array(at)
    moving = np.linalg.norm(np.diff(at, axis=0), axis=-1) > 1e-9
    assert not moving.all(axis=1).any()
    assert (at[:, :, 1] >= 0.0).all() and at[:, :, 1].max() > 0.03
    ground = at[:, :, [0, 2]]
    assert (~moving).mean() > 0.5
    assert np.abs(ground[-1, :, 1] - 3.0).max() < STRIDE * 1.75 + 1e-9
    lag = np.abs(ground[30:, :, 1] - np.minimum(np.maximum(np.arange(330), 0) / 90 * 1.2, 3.0)[:, None])
    assert lag.max() < 1.2 * (2 * DURATION) + STRIDE * 1.75
    assert FASTEST * LEAD < 1.0


def test_small_sway_moves_no_foot():
    """Swaying by less than a stride leaves both feet where they are."""
    steps = Stepping(1.75)
    at = [
        steps.update(1 / 90, np.array([[0.1, 0.0], [-0.1, 0.0]]) + 0.08 * np.sin(k / 30), 0.0)[0]
        for k in range(300)
    ]
    assert np.ptp(np.array(at), axis=0).max() == 0.0


def guided(figure, motion, names, rotations=EFFECTORS, every=4):
    """Mean errors of elbows, knees [m] and chest turn [rad] of a motion solved with some guides."""
    targets, r = figure.targets(motion), figure.roles
    places, world = motion.transforms
    anatomical = rot.mul(world, rot.inv(figure.neutral))
    chest = [j for j in r.spine if j in figure.skeleton.path(0, r.shoulder[0])][-1]
    joints = [chest, *r.elbow, *r.knee]
    weights = np.array([n in names for n in GUIDES], float)
    solver, guidance = SequentialIKPlus(figure, rotations=rotations), Guidance(figure)
    solution, errors = None, []
    for k in range(0, len(targets), every):
        frame = Tracked(
            targets.positions[k],
            targets.rotations[k],
            np.ones(6, bool),
            np.ones(11, np.int64),
            np.zeros(11),
            places[k, joints],
            anatomical[k, joints],
            weights,
        )
        solution = guidance.solve(solver, frame, solution, every / targets.rate)
        at, turn = solution.pose.compute_transforms()
        off = np.linalg.norm(at[joints] - places[k, joints], axis=1)
        q = rot.mul(rot.mul(turn[chest], rot.inv(figure.neutral[chest])), rot.inv(anatomical[k, chest]))
        errors.append([off[1:3].mean(), off[3:].mean(), rot.angle(q), solution.residual.max()])
    return np.array(errors).mean(axis=0)


@pytest.mark.parametrize("rotations", [(), EFFECTORS])
def test_guides_bring_elbows_and_knees_nearer_and_effectors_stay_met(rotations):
    """On the built-in boxing: elbows and knees at least a third nearer, the residual no worse."""
    motion = make_sample("boxing", FIGURE)
    plain = guided(FIGURE, motion, (), rotations)
    led = guided(FIGURE, motion, GUIDES, rotations)
    assert led[0] < 0.67 * plain[0] and led[1] < 0.67 * plain[1] and led[2] < plain[2], (plain, led)
    assert led[3] < plain[3] + 1e-3


def test_guides_help_on_a_recording(data):
    """A jumping dancer: elbows and knees at least half as far off, the chest turned better."""
    motion = load(data / "cmu" / "05_03.amc").sliced(slice(0, 1200))
    figure = Figure.from_motion(motion)
    plain, led = guided(figure, motion, (), every=8), guided(figure, motion, GUIDES, every=8)
    assert led[0] < 0.6 * plain[0] and led[1] < 0.6 * plain[1] and led[2] < 0.6 * plain[2], (plain, led)


def test_no_guide_no_change():
    """What leads nothing is what the solver itself reads of the pose."""
    solver = SequentialIKPlus(FIGURE)
    points, _ = stand(FIGURE, "crouched")
    first = solver.solve(points[:6])
    rows = Guidance(FIGURE).lead(first.pose, np.full((5, 3), np.nan), np.full((5, 4), np.nan), np.ones(5))
    chain = SpineChain.from_figure(FIGURE, own_pelvis=True)
    read = find_start(FIGURE, chain, Motion.from_poses([first.pose], 1.0), 1)[0]
    assert np.abs(np.sum(rows * read, axis=1)).min() > 1 - 1e-12
    by_rows, by_pose = solver.solve(points[:6], start=rows), solver.solve(points[:6], start=first.pose)
    np.testing.assert_allclose(by_rows.pose.rotations, by_pose.pose.rotations, atol=1e-9)
    with pytest.raises(SkeletonError, match="rotations of this figure"):
        solver.solve(points[:6], start=rows[1:])


def test_guides_at_degenerate_places_give_finite_starts():
    """On the limb's line, at the shoulder, at the pelvis, far away: rotations stay unit quaternions."""
    pose = SequentialIKPlus(FIGURE).solve(stand(FIGURE, "T-pose")[0][:6]).pose
    places = pose.compute_transforms()[0]
    for point in (*places[[FIGURE.roles.shoulder[0], FIGURE.roles.pelvis]], np.array([1e9, 0.0, -1e9])):
        guides, turns = np.tile(point, (5, 1)), np.tile([0.0, 1.0, 0.0, 0.0], (5, 1))
        rows = Guidance(FIGURE).lead(pose, guides, turns, np.ones(5))
        np.testing.assert_allclose(np.linalg.norm(rows, axis=1), 1.0, atol=1e-9)


def solved(name):
    points, turns = stand(FIGURE, name)
    points[:, 1] += 0.039 * 1.75 - points[4:6, 1].min()
    solver = SequentialIKPlus(FIGURE)
    return solver.solve(points[:6]).pose, turns


def soles(pose):
    """World Y axes of the feet, and the toes' heights."""
    places, world = pose.compute_transforms()
    ankles = list(FIGURE.roles.ankle)
    q = rot.mul(world[ankles], rot.inv(FIGURE.neutral[ankles]))
    sites = [FIGURE.skeleton.site_names.index(f"{s}_toe_tip") for s in "lr"]
    toes = [
        places[j] + rot.mul_vec(world[j], FIGURE.skeleton.site_offsets[k])
        for k in sites
        for j in [int(FIGURE.skeleton.site_parents[k])]
    ]
    return rot.mul_vec(q, UP), np.array(toes)[:, 1]


@pytest.mark.parametrize("name", list(POSES))
def test_low_feet_are_flat(name):
    """Standing, sitting or crouching: soles are level within a degree, toes not below the floor."""
    pose, _ = solved(name)
    level = level_feet(FIGURE, pose)
    up, toes = soles(level)
    assert (up[:, 1] > np.cos(np.radians(1.0))).all(), np.degrees(np.arccos(up[:, 1]))
    assert toes.min() > -0.03
    before, after = pose.compute_transforms()[0], level.compute_transforms()[0]
    ankles = list(FIGURE.roles.ankle)
    np.testing.assert_allclose(after[ankles], before[ankles], atol=1e-12)


def test_lifted_and_measured_feet_are_left_alone():
    """A foot high above the floor keeps its rest angle; one with a tracker keeps its rotation."""
    pose, _ = solved("crouched")
    lifted = level_feet(FIGURE, pose, Floor.under(FIGURE, -1.0))
    np.testing.assert_allclose(lifted.rotations, pose.rotations, atol=1e-9)
    kept = level_feet(FIGURE, pose, free=(False, True))
    left, right = FIGURE.roles.ankle
    np.testing.assert_array_equal(kept.rotations[left], pose.rotations[left])
    assert np.abs(kept.rotations[right] - pose.rotations[right]).max() > 0.01


def test_feet_are_levelled_continuously():
    """A pose that is lifted by 2 mm after the other never turns a foot by more than three degrees a step."""
    pose, _ = solved("crouched")
    turns = [
        level_feet(FIGURE, pose, Floor.under(FIGURE, -h)).rotations for h in np.arange(-0.05, 0.2, 0.002)
    ]
    change = rot.angle(rot.mul(np.array(turns[1:]), rot.inv(np.array(turns[:-1]))))
    assert np.degrees(change.max()) < 3.0


def test_the_page_about_trackers_runs(capsys):
    """The examples of docs/live_trackers.md run as they stand, and say what they promise."""
    text = (Path(__file__).resolve().parents[1] / "docs" / "live_trackers.md").read_text("utf-8")
    exec("".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL)), {})
    printed = capsys.readouterr().out
    assert "'head': 1" in printed and "pelvis and head are" in printed
    profile = re.search(r"```toml\n(.*?)```", text, re.DOTALL)
    assert profile and parse_profile(profile[1]).trackers["LHR-1"].point == "head"
