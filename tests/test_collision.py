"""Elbows stay out of the trunk, thighs out of each other; meshes are measured by trimesh."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize, minimize_scalar
from scipy.spatial.transform import Rotation

import sixpoint as sp
from conftest import recordings
from sixpoint.body import rotations as rot
from sixpoint.body.surface.flesh import build_shape
from sixpoint.body.surface.prisms import DIRECTIONS, Prisms, _prism, build_prisms, directions
from sixpoint.errors import SixpointError
from sixpoint.solvers.avoidance.clearance import deepest, gap_to_prism
from sixpoint.solvers.avoidance.options import check_avoid, find_flesh
from sixpoint.solvers.avoidance.packing import pack_flesh, unpack_flesh
from sixpoint.solvers.avoidance.penetration import describe_penetration, find_penetration
from sixpoint.solvers.avoidance.thigh_clearance import gap_of_thighs

METHODS = ("sik", "sik+", "sik-prior")
MIRROR = np.array([-1.0, 1.0, 1.0])
OTHER = [0, 1, 3, 2, 5, 4]


@pytest.fixture(scope="module")
def figure():
    plain = sp.Figure.from_stature(1.75)
    return plain.with_shape(build_shape(plain))


def crossing(figure, frames=240, gap=0.03):
    """The right wrist goes slowly across the belly and back, the left is held out."""
    rest, roles = figure.rest_positions, figure.roles
    points = np.tile(rest[[roles.pelvis, roles.head, *roles.wrist, *roles.ankle]], (frames, 1, 1))
    points[:, 1] += figure.head_offset
    shoulders = rest[list(roles.shoulder)]
    angle = -1.4 + 2.2 * np.sin(np.linspace(0.0, np.pi, frames))
    points[:, 2] += [0.15, 0.08, 0.05]
    points[:, 3, 0] = (0.75 * shoulders[0, 0] + gap) * np.sin(angle)
    points[:, 3, 1] = shoulders[0, 1] - 0.22
    points[:, 3, 2] = shoulders[0, 2] + 0.02 + (0.13 + gap) * np.cos(angle)
    return sp.Targets(points, 60.0, name="crossing")


def swivels(figure, motion, side=1):
    """Change of the swivel angle from frame to frame [rad], the arm's line turned by the shortest arc."""
    positions, world = motion.transforms
    roles = figure.roles
    chest = figure.skeleton.parents[roles.shoulder[side]]
    local = rot.mul_vec(rot.inv(world[:, [chest]]), positions - positions[:, roles.shoulder[side], None])
    elbow, wrist = local[:, roles.elbow[side]], local[:, roles.wrist[side]]
    out = []
    for f in range(1, len(motion)):
        a, b = (w / np.linalg.norm(w) for w in (wrist[f - 1], wrist[f]))
        axis = np.cross(a, b)
        sine = np.linalg.norm(axis)
        turn = Rotation.from_rotvec(axis / sine * np.arcsin(min(sine, 1.0)) if sine > 1e-12 else np.zeros(3))
        r, q = (v - (v @ b) * b for v in (turn.apply(elbow[f - 1]), elbow[f]))
        out.append(np.arctan2(np.cross(r, q) @ b, r @ q))
    return np.array(out)


def elliptic(width, depth, radius):
    """Flesh that is one upright elliptic cylinder with an elbow of one ball."""
    angles, heights = np.meshgrid(np.linspace(0, 2 * np.pi, 400, endpoint=False), np.arange(-0.4, 0.4, 0.01))
    points = np.stack([width * np.cos(angles), heights, depth * np.sin(angles)], axis=-1).reshape(-1, 3)
    elbow = build_prisms(sp.Figure.from_stature(1.75)).elbow[:1]
    prisms = Prisms((_prism(0, points, 0.3, -0.3, radius),), (replace(elbow[0], radius=radius),), (), radius)
    return unpack_flesh(pack_flesh(prisms, [0.3, 0.3], False), None, None, None)


def signed_distance(width, depth, point):
    """Distance of a point in the plane from an ellipse; negative inside. By SciPy."""
    off = lambda t: np.hypot(width * np.cos(t) - point[0], depth * np.sin(t) - point[1])  # noqa: E731
    starts = np.linspace(0, 2 * np.pi, 60)
    t = starts[np.argmin(off(starts))]
    best = minimize_scalar(off, bounds=(t - 0.2, t + 0.2), method="bounded", options={"xatol": 1e-10}).fun
    return -best if (point[0] / width) ** 2 + (point[1] / depth) ** 2 < 1 else best


@pytest.mark.parametrize("seed", range(3))
def test_depth_is_that_of_a_ball_in_an_elliptic_cylinder(seed):
    """Depth = radius - distance from the ellipse inside, 0 outside; the way out has that length."""
    rng, (width, depth, radius) = np.random.default_rng(seed), (0.16, 0.11, 0.04)
    flesh = elliptic(width, depth, radius)
    world, segs = np.array([[0.0, 0.0, 0.0, 1.0]]), np.zeros((1, 4))
    for _ in range(60):
        p = rng.uniform([-0.22, -0.2, -0.17], [0.22, 0.2, 0.17])
        found, p_e, p_t = deepest(flesh, (0.0, 0.0, 0.0), world, segs, tuple(p), tuple(p), tuple(p))
        wanted = max(radius - signed_distance(width, depth, p[[0, 2]]), 0.0)
        assert found == pytest.approx(wanted, abs=2e-3)
        if wanted > 3e-3:
            assert np.linalg.norm(np.subtract(p_t, p_e)) == pytest.approx(found, abs=1e-9)
            assert p_t[1] == pytest.approx(p_e[1])


def test_outlines_are_their_own_mirror_image():
    """Directions are symmetric in x, and so are the prisms of a symmetric body."""
    rays = directions()
    back = [int(np.argmin(np.linalg.norm(rays - ray * [-1, 1], axis=1))) for ray in rays]
    assert np.allclose(rays[back] * [-1, 1], rays) and len(rays) == DIRECTIONS
    for prism in build_prisms(sp.Figure.from_stature(1.75)).prisms:
        assert np.allclose(prism.grown[:, back], prism.grown, atol=1e-9)


def test_prisms_enclose_the_trunk(figure):
    """Hardly a vertex of the trunk is outside the outlines of its joints; none far outside."""
    prisms = build_prisms(figure)
    trunk = np.unique(figure.shape.triangles[figure.shape.parts["trunk"]])
    positions, world = figure.neutral_pose.compute_transforms()
    vertices = figure.shape.place(positions, world)[trunk] - positions[0] + figure.rest_positions[0]
    shoulder = figure.rest_positions[figure.roles.shoulder[0], 1]
    vertices = vertices[vertices[:, 1] < shoulder - 0.08]
    rows = pack_flesh(prisms, [0.3, 0.3], False)[:-1]
    gaps = np.array(
        [
            min(
                gap_to_prism(row, tuple(v - figure.rest_positions[p.joint]))
                for row, p in zip(rows, prisms.prisms, strict=True)
            )
            for v in vertices
        ]
    )
    assert gaps.max() < -0.5 * prisms.radius  # grown by the elbow's radius
    assert np.quantile(gaps, 0.02) > -2.0 * prisms.radius  # and not by much more


def test_a_root_on_the_floor_moves_no_outline(figure):
    """A rig whose pelvis hangs on a root on the floor has the outlines of the same rig without."""
    bare = sp.Figure.from_stature(1.75).skeleton
    offsets = np.vstack([[[0.0, 0.0, 0.0], [0.1, 0.95, -0.2]], bare.offsets[1:]])
    below = sp.Skeleton(("floor", *bare.names), [-1, *(p + 1 for p in bare.parents)], offsets)
    other = sp.Figure.from_skeleton(below)
    other = other.with_shape(build_shape(other))
    for one, two in zip(build_prisms(figure).prisms, build_prisms(other).prisms, strict=True):
        assert two.joint == one.joint + 1
        assert np.allclose(two.heights, one.heights, atol=5e-3)
        assert np.median(np.abs(two.radii - one.radii)) < 5e-3


def test_hands_have_balls_where_the_mesh_has_thumb_and_fingers(figure):
    """Two across the palm, two across the fingers; the thumb's edge is the farther one."""
    wrist, *hand = build_prisms(figure).forearm[2:]
    assert wrist.share == 1.0 and wrist.beside == 0.0 and len(hand) == 4
    for low, high in (hand[:2], hand[2:]):
        assert low.share == high.share > 1.0 and low.radius == high.radius > 0.01
        assert high.beside + high.radius > abs(low.beside - low.radius) and high.beside > low.beside


@pytest.mark.parametrize("stature", [1.2, 1.5, 2.0])
def test_hands_of_a_body_that_just_stands_are_beside_its_thighs(stature):
    """Whatever its size."""
    plain = sp.Figure.from_stature(stature)
    body = plain.with_shape(build_shape(plain))
    pose = np.tile(rot.IDENTITY, (1, len(body.skeleton), 1))
    standing = body.compute_motion(pose, np.zeros((1, 3)), 60.0)
    assert find_penetration(body, standing, "arms")["arms"].max() == 0.0


def test_a_taller_body_has_thicker_hands():
    """Balls of hands and thighs grow with the stature, palms that touch a thigh among them."""
    small, tall = (sp.Figure.from_stature(1.5 * scale) for scale in (1.0, 1.3))
    (_, thighs), (_, grown) = (find_flesh(f, f.spine_chain, ("arms",)) for f in (small, tall))
    hands = thighs[2:, 1] > 1.0
    assert hands.sum() == 4
    np.testing.assert_allclose(grown[2:, 2:], 1.3 * thighs[2:, 2:], rtol=1e-9)
    np.testing.assert_allclose(grown[0, :2], 1.3 * thighs[0, :2], rtol=1e-9)


@pytest.mark.parametrize("path", recordings("bandai/*punch*.bvh"))
def test_elbows_of_a_recording_leave_its_trunk(path):
    """A recorded boxer on a rig with a root on the floor: elbows that were in the trunk's mesh are out."""
    pytest.importorskip("trimesh")
    pytest.importorskip("rtree")
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
    from collision_meter import Meter

    motion = sp.load(path)
    boxer = sp.Figure.from_motion(motion)
    boxer = boxer.with_shape(build_shape(boxer))
    targets = boxer.targets(motion).sliced(slice(0, 120, 4))
    plain, clear = (sp.SequentialIKPlus(boxer, avoid=a).solve_frames(targets) for a in ((), "elbows"))
    before, after = (Meter(boxer).measure(found.motion).max(axis=1) > 0.005 for found in (plain, clear))
    assert before.sum() >= 10 and after.sum() <= 0.05 * before.sum()
    met = plain.residual[:, 2:4] < 1e-3
    assert (clear.residual[:, 2:4][met] < 1e-3).mean() >= 0.99


@pytest.mark.parametrize("method", METHODS)
def test_what_is_off_changes_no_bit(figure, method):
    """Nothing avoided, and nothing in the way, are the same bits."""
    targets = figure.targets(sp.make_sample("boxing", figure)).sliced(slice(0, 60))
    plain = sp.make_solver(method, figure).solve_frames(targets)
    off = sp.make_solver(method, figure, avoid=()).solve_frames(targets)
    nothing = sp.make_solver(method, figure, avoid="elbows")
    thin = nothing._arrays[-2].copy()
    thin[:-1, 2:4] += 100.0
    nothing._arrays = (*nothing._arrays[:-2], thin, None)
    for other in (off, nothing.solve_frames(targets)):
        assert np.array_equal(plain.motion.rotations, other.motion.rotations)
        assert np.array_equal(plain.residual, other.residual)


@pytest.mark.parametrize("method", METHODS)
def test_no_elbow_is_in_the_trunk(figure, method):
    """Elbows that were in the trunk's mesh are out, wrists stay on their targets (trimesh)."""
    pytest.importorskip("trimesh")
    pytest.importorskip("rtree")
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
    import collision

    meter, targets = collision.Meter(figure), crossing(figure, 40)
    plain = sp.make_solver(method, figure).solve_frames(targets)
    clear = sp.make_solver(method, figure, avoid="elbows").solve_frames(targets)
    before, after = meter.measure(plain.motion).max(axis=1), meter.measure(clear.motion).max(axis=1)
    assert (after > collision.DEEP).sum() <= 0.05 * (before > collision.DEEP).sum()
    if method == "sik":
        assert (before > collision.DEEP).sum() >= 10
    met = plain.residual[:, 2:4] < 1e-3
    assert (clear.residual[:, 2:4][met] < 1e-3).all()


@pytest.mark.parametrize("avoid", ["elbows", ("elbows", "forearms")])
@pytest.mark.parametrize("method", METHODS)
def test_a_mirrored_reach_is_posed_as_the_mirror_image(method, avoid):
    """Left and right are treated alike.

    With forearms the first and last frames have no free angle, and the least depth is flat there; a turn of
    a clavicle is found to a third of a degree. Rounding moves both by millimetres.
    """
    inner = slice(10, 50) if "forearms" in avoid else slice(None)
    figure = sp.Figure.from_stature(1.75)
    targets = crossing(figure, 60)
    other = replace(targets, positions=(targets.positions * MIRROR)[:, OTHER])
    solver = sp.make_solver(method, figure, avoid=avoid)
    one, two = (solver.solve_motion(t).positions for t in (targets, other))
    roles = figure.roles
    for a, b in ((roles.elbow, roles.elbow[::-1]), (roles.wrist, roles.wrist[::-1])):
        assert np.allclose(one[inner, a] * MIRROR, two[inner, b], atol=5e-3 if "forearms" in avoid else 2e-4)


@pytest.mark.parametrize("method", METHODS)
def test_a_turned_world_turns_the_pose(figure, method):
    """Avoidance knows no direction of the world."""
    targets = crossing(figure, 60)
    turn = Rotation.from_euler("y", 1.1) if method != "sik" else Rotation.from_rotvec([0.4, 1.1, -0.7])
    start = sp.make_solver(method, figure, avoid="elbows")
    moved = replace(targets, positions=turn.apply(targets.positions.reshape(-1, 3).copy()).reshape(-1, 6, 3))
    one, two = start.solve_motion(targets), start.solve_motion(moved)
    if method == "sik":  # the first frame has a direction of its own
        assert np.linalg.norm(turn.apply(one.positions[-1].copy()) - two.positions[-1], axis=1).max() < 0.02
        return
    skip = 30
    for f in range(skip, 60):
        assert np.allclose(turn.apply(one.positions[f].copy()), two.positions[f], atol=2e-3)


@pytest.mark.parametrize("limits", [True, False])
@pytest.mark.parametrize("method", ["sik+", "sik-prior"])
def test_the_swivel_angle_does_not_jump(figure, method, limits):
    """A wrist that goes slowly across the body moves the elbow slowly."""
    solver = sp.make_solver(method, figure, limits=limits, avoid=("elbows", "forearms"))
    steps = np.abs(swivels(figure, solver.solve_motion(crossing(figure))))
    assert steps.max() < 20.0 / 60.0 + 0.01
    assert np.quantile(steps, 0.95) < 0.1


numbers = st.floats(-3.0, 3.0) | st.just(float("nan")) | st.just(0.0)


@settings(max_examples=60)
@given(st.lists(numbers, min_size=36, max_size=36), st.sampled_from(METHODS), st.booleans())
def test_no_input_breaks_it(values, method, limits):
    """Any points, any gaps: a finite pose of unit quaternions."""
    figure = sp.Figure.from_stature(1.75)
    points = np.array(values).reshape(2, 6, 3)
    solver = sp.make_solver(method, figure, limits=limits, avoid=("elbows", "forearms", "thighs", "arms"))
    motion = solver.solve_motion(sp.Targets(points, 60.0))
    assert np.allclose(np.linalg.norm(motion.rotations, axis=-1), 1.0, atol=1e-6)
    assert np.all(np.isfinite(motion.positions))


@pytest.mark.parametrize("method", METHODS)
def test_limits_hold(figure, method):
    """With avoidance the shoulder's rotation is within its swing and twist limits (SciPy)."""
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
    from reaches import is_within

    motion = sp.make_solver(method, figure, avoid="elbows").solve_motion(crossing(figure, 60))
    _, world = motion.transforms
    anatomical = rot.mul(world, rot.inv(figure.neutral))
    for side, joint in enumerate(figure.roles.shoulder):
        above = anatomical[:, figure.skeleton.parents[joint]]
        local = rot.mul(rot.inv(above), anatomical[:, joint])
        wide = replace(figure.dofs[joint].limit, twist=figure.dofs[joint].limit.twist + [-1e-4, 1e-4])
        assert all(is_within(wide, Rotation.from_quat(q)) for q in local), side


def test_a_bodys_own_mesh_has_prisms_without_named_parts(figure):
    """Of a mesh without parts the dominant joint of each vertex tells what is trunk."""
    bare = figure.with_shape(replace(figure.shape, parts={}))
    for named, unnamed in zip(build_prisms(figure).prisms, build_prisms(bare).prisms, strict=True):
        assert named.joint == unnamed.joint
        assert np.median(np.abs(named.grown - unnamed.grown)) < 0.01


def test_what_cannot_be_avoided_is_said():
    """Unknown parts are listed with those there are; other methods say who has the option."""
    assert check_avoid(None) == () and check_avoid(["forearms", "elbows"]) == ("elbows", "forearms")
    figure = sp.Figure.from_stature(1.75)
    with pytest.raises(SixpointError, match=r"knees.*elbows"):
        sp.SequentialIK(figure, avoid="knees")
    with pytest.raises(SixpointError, match="no option avoid; sik"):
        sp.make_solver("dls", figure, avoid="elbows")


def test_the_job_avoids_with_the_built_in_surface():
    """``reconstruct --avoid`` gives a figure without a surface the built-in one."""
    from sixpoint.jobs.solving import Solving, solve

    figure = sp.Figure.from_stature(1.75)
    solving, targets = Solving("sik", avoid=("elbows",)), crossing(figure, 20)
    solving.check()
    found = solve(figure, targets, solving).solution.motion
    fleshy = figure.with_shape(build_shape(figure))
    wanted = sp.SequentialIK(fleshy, avoid="elbows").solve_motion(targets)
    assert np.array_equal(found.rotations, wanted.rotations)


def still_pose(figure, seed, frames=90, kind="crossed"):
    """Seeded legs, see ``benchmarks/seats.py``."""
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
    import seats

    return seats.move_legs(figure, seed, frames, kind)


def least_gap(a, b, c, d, radii):
    """Least gap of two tapered capsules a-b and c-d beyond a quarter of their length. By SciPy."""

    def gap(x):
        s, t = x
        off = np.linalg.norm(a + s * (b - a) - c - t * (d - c))
        return off - sum(radii[0] + k * (radii[1] - radii[0]) for k in (s, t))

    starts = [(s, t) for s in (0.4, 0.9) for t in (0.4, 0.9)]
    return min(minimize(gap, x, bounds=[(0.25, 1.0)] * 2).fun for x in starts)


@pytest.mark.parametrize("seed", range(3))
def test_the_gap_of_thighs_is_that_of_tapered_capsules(seed):
    """The least distance of the axes less the radii there; never less, seldom more by a millimetre."""
    rng, radii = np.random.default_rng(seed), (0.1, 0.06)
    off = []
    for _ in range(15):
        hips = np.array([[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]])
        aims = rng.normal([0.0, -0.7, 0.7], 0.4, (2, 3))
        knees = hips + 0.42 * aims / np.linalg.norm(aims, axis=1)[:, None]
        placed = np.zeros((4, 4))
        placed[:, :3] = [hips[0], knees[0], hips[1], knees[1]]
        off.append(gap_of_thighs(placed, *radii) - least_gap(hips[0], knees[0], hips[1], knees[1], radii))
    assert min(off) > -1e-4 and np.quantile(off, 0.9) < 1e-3 and max(off) < 0.02


@pytest.mark.parametrize("method", METHODS)
def test_thighs_part_and_ankles_stay(figure, method):
    """Thighs leave each other's mesh (trimesh); ankles stay where they were, knees do not jump."""
    pytest.importorskip("trimesh")
    pytest.importorskip("rtree")
    targets = [still_pose(figure, 2, 90, "squatting"), still_pose(figure, 2)]
    from collision_meter import Meter

    meter = Meter(figure, "thighs")
    deep = [0, 0]
    for part in targets:
        plain, clear = (sp.make_solver(method, figure, avoid=a).solve_frames(part) for a in ((), "thighs"))
        met = (plain.residual[:, 4:] < 1e-3).all(axis=1)
        for k, found in enumerate((plain, clear)):
            deep[k] += int((meter.measure(found.motion).max(axis=1)[met] > 0.005).sum())
        ankles = list(figure.roles.ankle)
        assert np.allclose(plain.motion.positions[:, ankles], clear.motion.positions[:, ankles], atol=1e-6)
        knees = clear.motion.positions[:, list(figure.roles.knee)]
        if method != "sik":
            assert np.linalg.norm(np.diff(knees, axis=0), axis=-1).max() < 0.15
    assert deep[1] <= 0.05 * deep[0]
    if method == "sik+":
        assert deep[0] >= 5


@pytest.mark.parametrize("method", METHODS)
def test_hips_stay_within_limits(figure, method):
    """Parted legs have hips within their swing and twist limits (SciPy)."""
    motion = sp.make_solver(method, figure, avoid="thighs").solve_motion(still_pose(figure, 2))
    from reaches import is_within

    anatomical = rot.mul(motion.transforms[1], rot.inv(figure.neutral))
    for joint in figure.roles.hip:
        local = rot.mul(rot.inv(anatomical[:, figure.skeleton.parents[joint]]), anatomical[:, joint])
        wide = replace(figure.dofs[joint].limit, twist=figure.dofs[joint].limit.twist + [-1e-4, 1e-4])
        assert all(is_within(wide, Rotation.from_quat(q)) for q in local)


@pytest.mark.parametrize("method", METHODS)
def test_thighs_and_arms_cost_nothing_where_they_are_not_in_the_way(figure, method):
    """On boxing, where no thigh is near anything, all of it changes no bit beside elbows and forearms."""
    targets = figure.targets(sp.make_sample("boxing", figure)).sliced(slice(0, 60))
    one = sp.make_solver(method, figure, avoid=("elbows", "forearms")).solve_frames(targets)
    two = sp.make_solver(method, figure, avoid=("elbows", "forearms", "thighs", "arms")).solve_frames(targets)
    assert np.array_equal(one.motion.rotations, two.motion.rotations)


def test_a_mirrored_crossing_is_the_mirror_image(figure):
    """Left and right legs are treated alike."""
    targets = still_pose(figure, 3)
    other = replace(targets, positions=(targets.positions * MIRROR)[:, OTHER])
    solver = sp.SequentialIKPlus(figure, avoid=("thighs", "arms"))
    one, two = (solver.solve_motion(t).positions[:, list(figure.roles.knee)] for t in (targets, other))
    assert np.allclose(one * MIRROR, two[:, ::-1], atol=1e-3)


@pytest.mark.parametrize("method", ["sik+", "sik-prior"])
def test_frame_by_frame_is_as_at_once(figure, method):
    """What avoidance remembers is in the solution's state."""
    targets = crossing(figure, 40)
    solver = sp.make_solver(method, figure, avoid=("elbows", "thighs", "arms"))
    whole, last = solver.solve_motion(targets), None
    for f in range(40):
        last = solver.solve(targets.positions[f], last, 1 / 60)
        assert np.allclose(last.pose.rotations, whole.rotations[f], atol=1e-9)


@pytest.mark.parametrize("what", ["elbows", "thighs"])
def test_what_is_left_is_what_the_meshes_say(figure, what):
    """What the mesh says (trimesh) is said, by up to 4.5 cm more for an elbow; and nothing far from it."""
    pytest.importorskip("trimesh")
    pytest.importorskip("rtree")
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
    targets = still_pose(figure, 2, 90, "squatting") if what == "thighs" else crossing(figure, 40)
    from collision_meter import Meter

    motion = sp.make_solver("sik+" if what == "thighs" else "sik", figure).solve_motion(targets)
    found = find_penetration(figure, motion, what)[what].max(axis=1)
    wanted = Meter(figure, what).measure(motion).max(axis=1)
    assert (wanted > 0.005).sum() >= 10
    assert np.all(found > wanted - 0.005)
    assert np.quantile(found - wanted, 0.9) < 0.045
    assert (found[wanted == 0.0] == 0.0).mean() > 0.6
    assert describe_penetration({what: found[:, None]})[0].startswith(what)


def test_penetration_needs_the_figure_that_was_posed(figure):
    """Another rig's motion is refused; a body at rest has nothing inside."""
    rest = sp.Motion.from_poses([figure.neutral_pose] * 2, 60.0)
    assert all(depth.max() < 0.01 for depth in find_penetration(figure, rest).values())
    assert describe_penetration(find_penetration(figure, rest, "thighs")) == ["no thighs in each other"]
    with pytest.raises(SixpointError, match="other rig"):
        find_penetration(figure, sp.Motion.from_poses([puppet_pose()] * 2, 60.0))


def puppet_pose():
    """A pose of a rig of three joints."""
    skeleton = sp.Skeleton(("a", "b", "c"), [-1, 0, 1], np.zeros((3, 3)))
    return sp.Pose(skeleton, np.tile(rot.IDENTITY, (3, 1)), np.zeros((1, 3)))
