"""The built-in surface: closed, of human size, symmetric, on any rig, and moving with its joints."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

import sixpoint as sp
from body_rigs import FAMILIES, family_skeleton, load, random_quaternions, reframed
from conftest import recordings
from sixpoint.body.surface.flesh import build_shape
from sixpoint.body.surface.shape import Shape
from sixpoint.errors import FigureError

trimesh = pytest.importorskip("trimesh")

PARTS = {"trunk", "head", *(f"{s}_{p}" for s in "lr" for p in ("arm", "hand", "leg", "foot"))}
REACH = 0.16
"""No skin is farther from the nearest bone [of the stature]."""


@pytest.fixture(scope="module")
def figure():
    return sp.Figure.from_stature(1.75)


@pytest.fixture(scope="module")
def shape(figure):
    return build_shape(figure)


def mesh_of(shape, part, vertices=None):
    used = shape.triangles[shape.parts[part]]
    mesh = trimesh.Trimesh(shape.vertices if vertices is None else vertices, used, process=False)
    mesh.remove_unreferenced_vertices()
    return mesh


@pytest.mark.parametrize("stature", [1.2, 1.75, 2.1])
def test_every_piece_is_closed_and_faces_outward(stature):
    """Each connected piece of each part is watertight, wound consistently and encloses a positive volume."""
    shape = build_shape(sp.Figure.from_stature(stature))
    assert set(shape.parts) == PARTS
    for part in shape.parts:
        mesh = mesh_of(shape, part)
        assert mesh.is_watertight, part
        assert mesh.is_winding_consistent, part
        for piece in mesh.split(only_watertight=False):
            assert piece.is_watertight, part
            assert piece.volume > 0, part


def test_trunk_head_arms_and_legs_are_one_piece_each(shape):
    """So the inside of each is told by ray parity; a hand is a palm and five fingers."""
    pieces = {part: mesh_of(shape, part).body_count for part in shape.parts}
    assert {part for part, count in pieces.items() if count > 1} == {"l_hand", "r_hand"}
    assert pieces["l_hand"] == 6


def test_parts_cover_all_triangles_once(shape):
    """The ranges of the parts follow each other from the first triangle to the last."""
    ranges = sorted((p.start, p.stop) for p in shape.parts.values())
    assert ranges[0][0] == 0
    assert ranges[-1][1] == len(shape.triangles)
    assert all(a[1] == b[0] for a, b in pairwise(ranges))


def test_size_is_that_of_an_artists_mannequin_and_of_a_human(shape):
    """2000 to 6000 vertices; volume and main measures of a person of 1.75 m."""
    assert 2000 <= len(shape.vertices) <= 6000
    volume = sum(mesh_of(shape, part).volume for part in shape.parts)
    assert 0.065 < volume < 0.085  # [m^3], overlaps counted twice
    assert np.ptp(shape.vertices[:, 1]) == pytest.approx(1.75, abs=0.03)
    trunk = mesh_of(shape, "trunk")

    def girth(part, height, of=shape):
        return mesh_of(of, part).section([0, 1, 0], [0, height, 0]).length

    joints = dict(zip(sp.Figure.from_stature(1.75).skeleton.names, shape.bind_positions, strict=True))
    hip, shoulder = joints["l_hip"][1], joints["l_shoulder"][1]
    chest = hip + 0.76 * (shoulder - hip)
    assert 0.85 < girth("trunk", chest) < 1.10
    assert 0.65 < girth("trunk", hip + 0.45 * (shoulder - hip)) < 0.95
    assert 0.32 < girth("l_leg", 0.64 * joints["l_knee"][1] + 0.36 * joints["l_ankle"][1]) < 0.43
    assert 0.24 < np.ptp(trunk.vertices[:, 2]) < 0.32


def test_left_and_right_are_mirror_images(shape):
    """Every vertex has its mirror image in x = 0, and so have the weights."""
    flipped = shape.vertices * [-1, 1, 1]
    distance, _ = cKDTree(shape.vertices).query(flipped)
    assert distance.max() < 1e-9
    left, right = (mesh_of(shape, part).volume for part in ("l_arm", "r_arm"))
    assert left == pytest.approx(right, rel=1e-9)


def test_size_follows_the_stature():
    """Twice the stature is twice the surface, vertex by vertex."""
    small, tall = (build_shape(sp.Figure.from_stature(h)) for h in (1.0, 2.0))
    np.testing.assert_allclose(2 * small.vertices, tall.vertices, atol=1e-9)
    np.testing.assert_allclose(small.weights, tall.weights, atol=1e-9)


def test_weights_are_smooth_and_few(figure, shape):
    """At most four joints carry a vertex, and along an edge of 1 cm weights change by less than a half."""
    assert shape.joints.shape[1] == 4
    full = np.zeros((len(shape.vertices), len(figure.skeleton)))
    np.add.at(full, (np.arange(len(full))[:, None], shape.joints), shape.weights)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        one, other = shape.triangles[:, a], shape.triangles[:, b]
        length = np.linalg.norm(shape.vertices[one] - shape.vertices[other], axis=1)
        change = np.abs(full[one] - full[other]).max(axis=1)
        assert np.all(change < 0.15 + 50.0 * length * 0.5)


def test_the_neutral_pose_gives_the_vertices_back(figure, shape):
    """The bind pose is the figure's neutral pose."""
    positions, world = figure.neutral_pose.compute_transforms()
    np.testing.assert_allclose(shape.place(positions, world), shape.vertices, atol=1e-12)


def test_bent_limbs_keep_most_of_their_volume(figure, shape):
    """Over a boxing motion no arm or leg loses more than a quarter of its volume."""
    motion = sp.make_sample("boxing", figure)
    positions, world = motion.transforms
    for frame in range(0, len(motion), 40):
        placed = shape.place(positions[frame], world[frame])
        for part in ("l_arm", "r_arm", "l_leg", "r_leg", "trunk"):
            share = mesh_of(shape, part, placed).volume / mesh_of(shape, part).volume
            assert 0.75 < share < 1.25, (frame, part)


def check_rig(figure):
    shape = build_shape(figure)
    assert np.all(np.isfinite(shape.vertices))
    assert figure.with_shape(shape).shape is shape
    positions, _ = figure.neutral_pose.compute_transforms()
    roles = figure.roles
    stature = 1.105 * figure.height
    bones = [(roles.pelvis, h) for h in (*roles.hip, *roles.spine)] + [
        pair for limb in roles.limbs for pair in pairwise(limb)
    ]
    points = np.concatenate([np.linspace(positions[a], positions[b], 12) for a, b in bones])
    distance, _ = cKDTree(points).query(shape.vertices)
    own = distance / stature
    head = np.unique(shape.triangles[shape.parts["head"]])
    ends = np.unique(
        np.concatenate([shape.triangles[shape.parts[f"{s}_{p}"]] for s in "lr" for p in ("hand", "foot")])
    )
    assert np.delete(own, np.concatenate([head, ends])).max() < REACH
    assert own[head].max() < 0.25
    assert own[ends].max() < 0.25
    for part in shape.parts:
        assert mesh_of(shape, part).is_watertight, part
    # Each joint of a limb lies inside the limb or the trunk.
    for k, side in enumerate("lr"):
        arm, leg = mesh_of(shape, f"{side}_arm"), mesh_of(shape, f"{side}_leg")
        assert arm.contains(positions[[roles.shoulder[k], roles.elbow[k], roles.wrist[k]]]).all()
        assert leg.contains(positions[[roles.hip[k], roles.knee[k], roles.ankle[k]]]).all()


@pytest.mark.parametrize("family", FAMILIES)
def test_any_family_of_rigs_has_a_surface(family):
    """Skin lies around the bones of rigs with any names."""
    check_rig(sp.Figure.from_skeleton(family_skeleton(family)))


def test_frames_of_a_rig_do_not_matter():
    """A rig whose joint frames are turned at random has the same surface; only how feet tilt is its own."""
    figure = sp.Figure.from_skeleton(family_skeleton("cmu-bvh"))
    motion = figure.compute_motion(
        np.tile([0.0, 0, 0, 1], (2, len(figure.skeleton), 1)), np.zeros((2, 3)), 30.0
    )
    turned = reframed(motion, random_quaternions(np.random.default_rng(0), len(figure.skeleton)))
    one, other = build_shape(figure), build_shape(sp.Figure.from_motion(turned))
    for part in sorted(PARTS - {"l_foot", "r_foot"}):
        used = np.unique(one.triangles[one.parts[part]])
        np.testing.assert_allclose(other.vertices[used], one.vertices[used], atol=2e-3, err_msg=part)


RIGS = sorted(
    {path.values[0].parent: path for path in reversed(recordings("*/*.bvh")) if path.values[0]}.values(),
    key=lambda path: path.id,
) or recordings("*/*.bvh")


@pytest.mark.parametrize("path", RIGS)
def test_rigs_of_recordings_have_a_surface(path):
    """One recording of every folder: skin lies around its bones."""
    check_rig(sp.Figure.from_motion(load(path)))


def test_a_part_is_a_range_of_triangles(shape):
    """A part beyond the triangles is refused."""
    values = {name: getattr(shape, name) for name in shape.__dataclass_fields__}
    with pytest.raises(FigureError, match="range"):
        Shape(**(values | {"parts": {"tail": slice(0, len(shape.triangles) + 1)}}))
