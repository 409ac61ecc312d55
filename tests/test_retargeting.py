"""Six points of one body for another: the pose is kept, or what hands and feet touch is."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

import sixpoint as sp
from body_rigs import exercise, family_skeleton, load, real_rigs
from conftest import recordings
from sixpoint.body import rotations as rot
from sixpoint.body.reach import find_lift
from sixpoint.body.retargeting import carry_points, carry_trunk
from sixpoint.body.soles import ankle_height
from sixpoint.body.stature import stature_of
from sixpoint.calibration.person import estimate_figure
from sixpoint.errors import FigureError, TargetError
from sixpoint.jobs.retarget import retarget, retarget_pose
from sixpoint.signals.contacts import find_contacts

TALL, SMALL = sp.Figure.from_stature(1.90), sp.Figure.from_stature(1.20)
STOCKY = sp.Figure.from_segments(
    thigh=0.30, calf=0.33, upper_arm=0.2, forearm=0.21, torso_length=0.40, pelvis_width=0.2, torso_width=0.36
)
OTHER = sp.Figure.from_skeleton(family_skeleton("bandai"))


def sample(name, figure, step=2):
    return sp.make_sample(name, figure).sliced(slice(None, None, step))


def bend(figure, motion):
    """(F, 4) angle at elbows and knees between the bones of each limb [rad]."""
    a, b, c = (motion.positions[:, [limb[k] for limb in figure.roles.limbs]] for k in range(3))
    cosine = np.sum(rot.unit(b - a) * rot.unit(c - b), axis=2)
    return np.arccos(np.clip(cosine, -1, 1))


def roots(figure, motion):
    return motion.positions[:, [*figure.roles.shoulder, *figure.roles.hip]]


@pytest.mark.parametrize("name", sp.SAMPLES)
def test_the_same_body_gets_the_same_points(name):
    """Retargeting to the body itself changes nothing but, in absolute mode, legs that are quite straight."""
    motion = sample(name, TALL)
    points = TALL.targets(motion).positions
    np.testing.assert_allclose(retarget(motion, TALL, source=TALL).positions, points, atol=1e-9)
    kept = retarget(motion, TALL, "absolute", source=TALL).positions
    np.testing.assert_allclose(kept[:, 2:], points[:, 2:], atol=1e-9)
    assert np.abs(kept[:, :2] - points[:, :2]).max() < 0.03


@given(st.sampled_from(sorted(sp.SAMPLES)), st.floats(0.5, 2.5), st.floats(-2.0, 2.0))
@settings(max_examples=12)
def test_a_scaled_body_gets_scaled_points(name, stature, floor):
    """A body of the same proportions gets the same points about the floor, scaled."""
    motion = sample(name, TALL, 20)
    raised = replace(motion, translations=motion.translations + [0.0, floor, 0.0])
    other = sp.Figure.from_stature(stature)
    out = retarget(raised, other, source=TALL, floor=floor).positions
    expected = TALL.targets(motion).positions * stature / 1.9 + [0.0, floor, 0.0]
    np.testing.assert_allclose(out, expected, atol=1e-9)


@pytest.mark.parametrize("name", sp.SAMPLES)
def test_a_small_avatar_of_a_tall_person_keeps_joint_angles(name):
    """Solved for 1.20 m, a recording of 1.90 m has the same joint angles within 3 degrees (mean and 95 %)."""
    motion = sample(name, TALL, 1)
    own = sp.SequentialIKPlus(TALL).solve_motion(TALL.targets(motion))
    other = sp.SequentialIKPlus(SMALL).solve_motion(retarget(motion, SMALL))
    turned = rot.angle(rot.mul(rot.inv(own.rotations), other.rotations))
    joints = sorted(TALL.dofs.joints)
    assert np.degrees(turned[:, joints]).mean() < 0.3
    assert np.percentile(np.degrees(turned[:, joints]), 95) < 3.0


@pytest.mark.parametrize("source", [STOCKY, OTHER], ids=["stocky", "another rig"])
def test_limbs_keep_direction_and_stretch_on_other_proportions(source):
    """Points from limb roots keep direction and share of the limb, so elbows and knees bend as they did."""
    motion = exercise(source)
    out = retarget(motion, SMALL, source=source)
    # a body posed to these points by hand: its trunk as the source's, each limb bent by the law of cosines
    ends = out.positions[:, 2:]
    gap = ends - (out.positions[:, :1] + _roots_from_pelvis(SMALL, source, motion))
    was = source.targets(motion).positions[:, 2:] - roots(source, motion)
    np.testing.assert_allclose(rot.unit(gap), rot.unit(was), atol=1e-6)
    share = np.linalg.norm(gap, axis=2) / SMALL.limb_lengths
    upper, lower = _bones(SMALL)
    whole = upper + lower
    cosine = ((share * whole) ** 2 - upper**2 - lower**2) / (2 * upper * lower)
    implied = np.arccos(np.clip(cosine, -1, 1))
    assert np.degrees(np.abs(implied - bend(source, motion))).max() < 3.0


def _roots_from_pelvis(figure, source, motion):
    """(F, 4, 3) limb roots over the pelvis when the trunk takes the source's posture (SciPy's rotations)."""
    trunk = carry_trunk(motion, source, figure)
    pelvis = Rotation.from_quat(trunk.transforms[1][:, figure.roles.pelvis])
    was = Rotation.from_quat(motion.transforms[1][:, source.roles.pelvis])
    neutral = Rotation.from_quat(figure.neutral[figure.roles.pelvis])
    assert (
        (pelvis * neutral.inv()).inv() * (was * Rotation.from_quat(source.neutral[source.roles.pelvis]).inv())
    ).magnitude().max() < 1e-6
    return roots(figure, trunk)


def _bones(figure):
    offset = figure.offset_between
    return np.array(
        [[np.linalg.norm(offset(a, b)), np.linalg.norm(offset(b, c))] for a, b, c in figure.roles.limbs]
    ).T


def trunk_rig(spine, clavicles=True, head_is_site=False, root=False):
    """A figure in T-pose with a spine of these lengths [m] up to the head, which may be an end site."""
    names, parents, offsets, sites = [], [], [], []

    def add(name, parent, *offset):
        parents.append(names.index(parent) if parent else -1)
        names.append(name)
        offsets.append(offset)

    if root:
        add("Armature", None, 0, 0, 0)
    add("Hips", "Armature" if root else None, 0, 1, 0)
    below, chest = "Hips", "Hips"
    for k, length in enumerate(spine[: len(spine) - head_is_site]):
        name = "Head" if k == len(spine) - 1 else f"Spine{k}"
        add(name, below, 0, length, 0)
        below = name
        chest = name if k <= max(0, len(spine) - 3) else chest
    sites.append((below, 0, spine[-1] if head_is_site else 0.15, 0.01))
    for side, sign in (("Left", 1), ("Right", -1)):
        add(f"{side}UpLeg", "Hips", sign * 0.1, -0.08, 0)
        add(f"{side}Leg", f"{side}UpLeg", 0, -0.42, 0)
        add(f"{side}Foot", f"{side}Leg", 0, -0.43, 0)
        if clavicles:
            add(f"{side}Shoulder", chest, sign * 0.04, 0.2, 0)
        add(f"{side}Arm", names[-1] if clavicles else chest, sign * 0.15, 0 if clavicles else 0.2, 0)
        add(f"{side}ForeArm", f"{side}Arm", sign * 0.3, 0, 0)
        add(f"{side}Hand", f"{side}ForeArm", sign * 0.27, 0, 0)
        sites += [(f"{side}Foot", 0, -0.07, 0.2), (f"{side}Hand", sign * 0.18, 0, 0)]
    return sp.Figure.from_skeleton(
        sp.Skeleton(
            tuple(names),
            np.array(parents),
            np.array(offsets, float),
            tuple(f"site{k}" for k in range(len(sites))),
            np.array([names.index(site[0]) for site in sites]),
            np.array([site[1:] for site in sites], float),
        )
    )


TRUNKS = {
    "three joints": trunk_rig((0.2, 0.25, 0.1)),
    "no clavicles": trunk_rig((0.2, 0.25, 0.1), clavicles=False),
    "the head a site": trunk_rig((0.2, 0.25, 0.1), head_is_site=True),
    "one joint": trunk_rig((0.2, 0.3), clavicles=False, head_is_site=True),
    "eight joints": trunk_rig((0.0, 0.08, 0.08, 0.08, 0.08, 0.1, 0.08, 0.05)),
    "a root above": trunk_rig((0.2, 0.25, 0.1), root=True),
}


@pytest.mark.parametrize("source", TRUNKS.values(), ids=TRUNKS)
def test_trunks_of_any_number_of_joints_bend_alike(source):
    """A bent trunk keeps direction and stretch on straight rigs with other joints; on itself, exactly."""
    motion = exercise(source, frames=40)
    points = source.targets(motion).positions
    np.testing.assert_allclose(retarget(motion, source, source=source).positions, points, atol=1e-9)
    chord = points[:, 1] - points[:, 0]
    for target in TRUNKS.values():
        out = retarget(motion, target, source=source).positions
        moved = out[:, 1] - out[:, 0]
        turned = np.degrees(np.arccos(np.clip(np.sum(rot.unit(moved) * rot.unit(chord), axis=1), -1, 1)))
        assert turned.mean() < 3.0
        length = np.linalg.norm(target.spine_chain.segments, axis=1).sum()
        assert np.all(np.linalg.norm(moved, axis=1) < length * (1 + 1e-9))
        assert np.all(np.linalg.norm(moved, axis=1) > 0.95 * length)


@pytest.mark.parametrize("target", [SMALL, STOCKY, OTHER], ids=["small", "stocky", "another rig"])
def test_standing_feet_stand_on_the_floor(target):
    """Feet that stand still still do, with the soles on the floor, whatever the proportions."""
    motion = sp.make_sample("walk", TALL)
    before = TALL.targets(motion).positions[:, 4:]
    stands = find_contacts(before, motion.rate)
    after = retarget(motion, target).positions[:, 4:]
    legs = target.limb_lengths[2] / TALL.limb_lengths[2]
    over = before[..., 1] - ankle_height(TALL)
    assert np.abs((after[..., 1] - ankle_height(target) - legs * over)[stands]).max() < 0.01
    speed = np.linalg.norm(np.diff(after, axis=0), axis=2) * motion.rate
    still = stands[1:] & stands[:-1]
    was = np.linalg.norm(np.diff(before, axis=0), axis=2) * motion.rate
    assert np.all(speed[still] < legs * was[still] + 0.12)


@pytest.mark.parametrize("name", ["boxing", "jump_kick", "walk"])
def test_contacts_stay_in_absolute_mode(name):
    """Standing soles, and wrists, keep their places in the world; legs meet them within 1 mm."""
    motion = sample(name, TALL, 1)
    before = TALL.targets(motion)
    out = retarget(motion, SMALL, "absolute")
    np.testing.assert_array_equal(out.positions[:, 2:4], before.positions[:, 2:4])
    down = [0.0, ankle_height(TALL) - ankle_height(SMALL), 0.0]
    np.testing.assert_allclose(out.positions[:, 4:] + down, before.positions[:, 4:], atol=1e-12)
    stands = find_contacts(before.positions[:, 4:], motion.rate)
    assert stands.any()
    residual = sp.SequentialIKPlus(SMALL, limits=False).solve_frames(out).residual[:, 4:]
    assert residual[stands].max() < 1e-3
    limited = sp.SequentialIKPlus(SMALL).solve_frames(out).residual[:, 4:]
    assert np.mean(limited[stands] < 1e-3) > 0.99


def test_hanging_hands_go_first_when_told():
    """A small avatar that cannot hold the bar and keep its feet's places holds the bar."""
    motion = sample("climb_and_hang", TALL)
    reach = SMALL.limb_lengths[:2]

    def missing(first):
        out = retarget(motion, SMALL, "absolute", first=first)
        shoulders = _roots_from_pelvis(SMALL, TALL, motion)[:, :2] + out.positions[:, :1]
        return np.maximum(np.linalg.norm(shoulders - out.positions[:, 2:4], axis=2) - reach, 0).sum()

    assert missing("hands") < 0.5 * missing("feet")


def test_the_height_is_the_best_one():
    """The lift of legs is what SciPy's minimizer finds for the missing reach, one frame at a time."""
    rng = np.random.default_rng(3)
    hips = rng.normal(size=(20, 4, 3)) * [0.2, 0.1, 0.2] + [0, 0.9, 0]
    ends = rng.normal(size=(20, 4, 3)) * [0.4, 0.3, 0.4]
    ends[:, :2] = np.nan  # no arms
    lengths = np.full((20, 4), 0.7)
    lift = find_lift(hips, ends, lengths)[:, 1]
    for k in range(20):

        def cost(y, k=k):
            far = np.linalg.norm(hips[k, 2:] + [0, y, 0] - ends[k, 2:], axis=1)
            return np.sum(np.maximum(far - 0.7, 0) ** 2) + 1e-4 * y**2

        best = minimize_scalar(cost, bounds=(-4, 4), method="bounded", options={"xatol": 1e-9})
        assert cost(lift[k]) <= best.fun + 1e-9


@pytest.mark.parametrize("mode", ["relative", "absolute"])
def test_gaps_stay_gaps_and_rotations_stay(mode):
    """Lost points are lost in the same frames, others do not change by it, and rotations are kept."""
    motion = sample("boxing", TALL, 4)
    whole = TALL.targets(motion)
    positions = whole.positions.copy()
    positions[10:20, 2] = np.nan
    positions[30:35, 0] = np.nan
    positions[40:42] = np.nan
    holes = replace(whole, positions=positions)
    out = carry_points(holes, motion, TALL, SMALL, mode)
    full = carry_points(whole, motion, TALL, SMALL, mode)
    np.testing.assert_array_equal(out.tracked, holes.tracked)
    if mode == "relative":
        np.testing.assert_allclose(out.positions[out.tracked], full.positions[out.tracked], atol=1e-12)
    assert out.rotations is holes.rotations
    assert out.rate == holes.rate
    solved = retarget(holes, SMALL, mode, source=TALL)
    np.testing.assert_array_equal(solved.tracked, holes.tracked)


def turned(figure, motion, joint):
    """Rotations of a joint in the world, identity in the neutral pose (SciPy)."""
    return (
        Rotation.from_quat(motion.transforms[1][:, joint]) * Rotation.from_quat(figure.neutral[joint]).inv()
    )


def joint_angles_between(source, motion, figure, result):
    """(F, 8) angles by which shoulders and elbows, hips and knees of two bodies differ [degrees]."""
    off = []
    for limb in range(4):
        joints = []
        for f in (source, figure):
            first = f.roles.clavicle[0] if f.roles.clavicle else f.roles.shoulder[0]
            joints.append([f.skeleton.parents[first] if limb < 2 else f.roles.pelvis, *f.roles.limbs[limb]])
        for k in range(2):
            a, b = (
                turned(f, m, row[k]).inv() * turned(f, m, row[k + 1])
                for f, m, row in ((source, motion, joints[0]), (figure, result, joints[1]))
            )
            off.append(np.degrees((a.inv() * b).magnitude()))
    return np.stack(off, axis=1)


@pytest.mark.parametrize("source", [TALL, STOCKY, OTHER], ids=["same", "stocky", "another rig"])
def test_a_carried_pose_has_the_same_joint_angles(source):
    """Every limb of another body is turned as the source's: chest, shoulders, elbows, hips, knees."""
    motion = exercise(source)
    pose = retarget_pose(motion, SMALL, source=source)
    assert pose.skeleton is SMALL.skeleton and len(pose) == len(motion) and pose.rate == motion.rate
    for joint in ("pelvis", "shoulder", "elbow", "wrist", "hip", "knee", "ankle"):
        ours, theirs = (np.atleast_1d(getattr(f.roles, joint)) for f in (source, SMALL))
        for a, b in zip(ours, theirs, strict=True):
            apart = turned(source, motion, a).inv() * turned(SMALL, pose, b)
            assert np.degrees(apart.magnitude()).max() < 1e-5, joint


@pytest.mark.parametrize("source", [STOCKY, OTHER], ids=["stocky", "another rig"])
def test_a_pose_to_start_from_is_kept(source):
    """Points that lead a body from the carried pose: they are met, and the pose stays within some degrees."""
    motion = sample("walk", source)
    points, pose = retarget(motion, SMALL, source=source), retarget_pose(motion, SMALL, source=source)
    solver = sp.SequentialIKPlus(SMALL, limits=False, rotations=sp.EFFECTORS)
    started, alone = solver.solve_frames(points, start=pose), solver.solve_frames(points)
    assert started.residual.max() < 1e-3
    off, was = (joint_angles_between(source, motion, SMALL, s.motion).mean() for s in (started, alone))
    assert off < 3.0 and off < 0.5 * was


@pytest.mark.parametrize("path", recordings("cmu/02_0[1-3].amc") + recordings("cmu/1[46]_01.amc"))
def test_real_recordings_keep_their_pose_on_a_small_avatar(path):
    """A person of 1.90 m on 1.20 m: joint angles within 3 degrees in the mean, elbows and knees all but."""
    motion = load(path).sliced(slice(0, 400))
    source = sp.Figure.from_motion(motion)
    size = 1.9 / stature_of(source)
    s = motion.skeleton
    tall = replace(s, offsets=s.offsets * size, site_offsets=s.site_offsets * size)
    motion = replace(motion, skeleton=tall, translations=motion.translations * size)
    source = sp.Figure.from_motion(motion)
    points, pose = retarget(motion, SMALL, source=source), retarget_pose(motion, SMALL, source=source)
    solved = sp.SequentialIKPlus(SMALL, limits=False).solve_frames(points, start=pose)
    off = joint_angles_between(source, motion, SMALL, solved.motion)
    assert solved.residual.max() < 1e-3
    assert off.mean() < 3.0
    assert np.mean(off[:, 1::2] < 3.0) > 0.95


def test_bare_points_are_solved_once():
    """Points without a motion give nearly what the motion gives: limb roots are found by solving."""
    motion = sample("jump_kick", TALL, 1)
    points = TALL.targets(motion)
    exact = retarget(motion, STOCKY).positions
    for recording, limit in ((points, 0.04), (replace(points, rotations=None), 0.06)):
        off = np.linalg.norm(retarget(recording, STOCKY, source=TALL).positions - exact, axis=2)
        assert off.mean() < limit


@pytest.mark.parametrize("name", ["walk", "reach", "jump_kick"])
def test_the_person_is_estimated_from_the_points(name):
    """Trunk and legs of somebody who once stretches them are found within 2 %."""
    for figure in (TALL, SMALL):
        found = estimate_figure(figure.targets(sample(name, figure)))
        assert found.limb_lengths[2] == pytest.approx(figure.limb_lengths[2], rel=0.02)
        assert found.height == pytest.approx(figure.height, rel=0.02)


def test_bad_input_says_what_helps():
    """Unknown modes, lost heads, giants and a stature for a motion are refused with the way out."""
    motion = sample("walk", TALL, 10)
    points = TALL.targets(motion)
    with pytest.raises(TargetError, match="relative, absolute"):
        retarget(motion, SMALL, "exact")
    with pytest.raises(TargetError, match="rig of its own"):
        retarget(motion, SMALL, source=1.9)
    with pytest.raises(TargetError, match="Motion or Targets"):
        retarget(points.positions, SMALL)
    with pytest.raises(TargetError, match="floor"):
        retarget(motion, SMALL, floor=np.nan)
    with pytest.raises(TargetError, match="feet or hands"):
        retarget(motion, SMALL, "absolute", first="nose")
    with pytest.raises(TargetError, match="stature"):
        lost = points.positions.copy()
        lost[:, 1] = np.nan
        retarget(replace(points, positions=lost), SMALL)
    with pytest.raises(TargetError, match="no human"):
        retarget(replace(points, positions=points.positions * 100), SMALL)
    with pytest.raises(FigureError, match="another"):
        retarget(motion, SMALL, source=OTHER)
    with pytest.raises(TargetError, match="frames"):
        carry_points(points, motion.sliced(slice(0, 3)), TALL, SMALL)


@pytest.mark.parametrize("path", real_rigs() or [None], ids=lambda p: p.stem if p else "no-data")
def test_real_recordings_stay_finite_and_in_proportion(path):
    """Points of every recorded rig fit the small avatar: no limb is stretched more than it was."""
    if path is None:
        pytest.skip("no recordings: set SIXPOINT_DATA or put them into ../shared/data")
    motion = load(path)
    source = sp.Figure.from_motion(motion)
    points = source.targets(motion)
    out = retarget(motion, SMALL, source=source)
    assert np.isfinite(out.positions).all()
    trunk = np.linalg.norm(out.positions[:, 1] - out.positions[:, 0], axis=1)
    assert trunk.max() < 1.01 * np.linalg.norm(SMALL.spine_chain.segments, axis=1).sum()
    share = np.linalg.norm(points.positions[:, 2:] - roots(source, motion), axis=2) / source.limb_lengths
    now = np.linalg.norm(
        out.positions[:, 2:] - out.positions[:, :1] - _roots_from_pelvis(SMALL, source, motion), axis=2
    )
    np.testing.assert_allclose(now / SMALL.limb_lengths, share, atol=1e-6)
