"""Avatars as they are read: skeleton, sides, facing, skin, colours, movement."""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, Slerp

from conftest import recordings
from gltf_avatars import BONES, NAMES, PLACES, STYLES, Style, body_mesh, make_avatar
from gltf_independent import Scene
from sixpoint.body import rotations as rot
from sixpoint.body.surface.appearance import Texture
from sixpoint.formats import load, load_avatar
from sixpoint.formats.gltf.animation import Channel, find_grid
from sixpoint.formats.gltf.avatar import Avatar

LEFT, RIGHT = 0, 1
POSE = Rotation.from_euler("xyz", np.random.default_rng(5).normal(0, 0.3, (len(BONES), 3))).as_quat()
"""Nodes turned away from the bind pose, as in a file that was saved in the middle of a movement."""


def put(folder: Path, style: Style | str, name: str = "avatar") -> Path:
    """Write an avatar; its file."""
    style = STYLES[style] if isinstance(style, str) else style
    path = folder / (name + (".glb" if style.vrm is None else ".vrm"))
    path.write_bytes(make_avatar(style))
    return path


def joints(avatar: Avatar) -> list[int]:
    """The joint of each bone of the table; its nodes follow the armature's."""
    return [avatar.rig.nodes.index(k + 1) for k in range(len(BONES))]


def at_rest(avatar: Avatar) -> tuple[np.ndarray, np.ndarray]:
    """Positions and world rotations in the reference pose."""
    skeleton = avatar.figure.skeleton
    return skeleton.compute_transforms(np.tile(rot.IDENTITY, (len(skeleton), 1)))


@pytest.mark.parametrize("name", STYLES)
def test_every_style_of_file_is_the_same_body(name, tmp_path):
    """Whatever turns, scales and names a file uses, joints are where the table has them: Y up, facing +Z."""
    avatar = load_avatar(put(tmp_path, name))
    np.testing.assert_allclose(at_rest(avatar)[0][joints(avatar)], PLACES, atol=1e-6)
    np.testing.assert_allclose(avatar.read_motion().positions[0][joints(avatar)], PLACES, atol=1e-6)


@pytest.mark.parametrize("name", STYLES)
def test_left_is_left_and_forward_is_forward(name, tmp_path):
    """Roles are on the bones of the table, whether told by map, names or structure; toes point to +Z."""
    avatar = load_avatar(put(tmp_path, name))
    row, roles = joints(avatar), avatar.figure.roles
    for role, bone in (
        ("shoulder", "UpperArm"),
        ("elbow", "LowerArm"),
        ("wrist", "Hand"),
        ("hip", "UpperLeg"),
    ):
        assert getattr(roles, role) == tuple(row[NAMES.index(side + bone)] for side in ("left", "right"))
    assert (roles.pelvis, roles.head) == (row[NAMES.index("hips")], row[NAMES.index("head")])
    rest = avatar.figure.rest_positions
    assert rest[roles.wrist[LEFT], 0] > 0.1 > -0.1 > rest[roles.wrist[RIGHT], 0]
    assert rest[roles.wrist[LEFT], 1] < rest[roles.elbow[LEFT], 1] < rest[roles.shoulder[LEFT], 1]
    toes = row[NAMES.index("leftToes")]
    assert rest[toes, 2] - rest[roles.ankle[LEFT], 2] > 0.1


@pytest.mark.parametrize("name", [n for n in STYLES if n != "bones"])
def test_the_shape_is_the_files_mesh(name, tmp_path):
    """In the pose of the nodes the skinned vertices are those that the file's matrices give."""
    path = put(tmp_path, name)
    avatar = load_avatar(path)
    motion = avatar.read_motion()
    shape = avatar.figure.shape
    ours = shape.place(motion.positions[0], motion.transforms[1][0])[shape.triangles]
    turn = np.array([-1.0, 1.0, -1.0]) if name == "vrm0" else np.ones(3)
    theirs = Scene(path.read_bytes()).vertices_at(0.0) * turn
    assert theirs.shape == ours.shape
    np.testing.assert_allclose(np.sort(theirs.reshape(-1, 3), 0), np.sort(ours.reshape(-1, 3), 0), atol=1e-5)
    # Outside is outside: the volume that the triangles enclose is positive.
    assert np.einsum("ti,ti", ours[:, 0], np.cross(ours[:, 1], ours[:, 2])) > 0


@pytest.mark.parametrize("scale", [1.0, 0.01])
@pytest.mark.parametrize("z_up", [False, True])
def test_the_pose_of_the_nodes_need_not_be_the_bind_pose(scale, z_up, tmp_path):
    """A file saved in another pose has its bind pose as reference, and its vertices are where it has them."""
    path = put(tmp_path, Style(turned=True, pose=POSE, z_up=z_up, scale=scale))
    avatar = load_avatar(path)
    np.testing.assert_allclose(at_rest(avatar)[0][joints(avatar)], PLACES, atol=1e-5)
    motion, shape = avatar.read_motion(), avatar.figure.shape
    ours = shape.place(motion.positions[0], motion.transforms[1][0])[shape.triangles]
    np.testing.assert_allclose(ours, Scene(path.read_bytes()).vertices_at(0.0), atol=1e-5)
    assert not np.allclose(ours, body_mesh(list(range(len(BONES))))[0][shape.triangles], atol=0.05)


def test_trimesh_sees_the_same_mesh(tmp_path):
    """An independent reader finds the same vertices and triangles in the bind pose."""
    path = put(tmp_path, "vrm1")
    shape = load_avatar(path).figure.shape
    scene = trimesh.load(path, file_type="glb", process=False)
    theirs = np.concatenate([mesh.triangles for mesh in scene.geometry.values()])
    ours = shape.vertices[shape.triangles]
    np.testing.assert_allclose(np.sort(theirs.reshape(-1, 3), 0), np.sort(ours.reshape(-1, 3), 0), atol=1e-6)


def test_colours_are_factor_times_texture_in_linear_light(tmp_path):
    """Red left half, blue right half, times (0.5, 0.5, 1)."""
    avatar = load_avatar(put(tmp_path, "vrm1"))
    left = avatar.figure.shape.vertices[:, 0] > 1e-6
    right = avatar.figure.shape.vertices[:, 0] < -1e-6
    np.testing.assert_allclose(
        avatar.appearance.colours[left], [[0.5, 0.0, 0.0, 1.0]] * left.sum(), atol=1e-6
    )
    np.testing.assert_allclose(
        avatar.appearance.colours[right], [[0.0, 0.0, 1.0, 1.0]] * right.sum(), atol=1e-6
    )


@pytest.mark.parametrize(("mode", "opacity"), [(None, 1.0), ("OPAQUE", 1.0), ("MASK", 0.2), ("BLEND", 0.2)])
def test_opacity_counts_only_where_a_material_says_so(tmp_path, mode, opacity):
    """The alpha of opaque materials is anything."""

    def spoil(builder: Any, nodes: dict[str, int]) -> None:
        material = builder.content["materials"][0]
        material["pbrMetallicRoughness"]["baseColorFactor"][3] = 0.2
        if mode is not None:
            material["alphaMode"] = mode

    colours = load_avatar(put(tmp_path, Style(more=spoil))).appearance.colours
    np.testing.assert_allclose(colours[:, 3], opacity, atol=1e-6)


def test_textures_agree_with_the_colours_of_vertices(tmp_path):
    """What lies between vertices goes through them: tint times texture at a vertex is its colour."""
    avatar = load_avatar(put(tmp_path, "vrm1"))
    look = avatar.appearance
    assert len(look.texturing.chosen) == len(avatar.figure.shape.triangles)
    assert set(look.texturing.chosen) == {0}
    shown = look.texturing.tints * look.texturing.textures[0].sample(look.texturing.places)
    np.testing.assert_allclose(shown, look.colours, atol=1e-12)
    assert look.texturing.textures[0].wrap == ("clamp", "repeat")


def srgb(light: np.ndarray) -> np.ndarray:
    """Codes 0 to 255 of light, by the standard's formula."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055) * 255


@pytest.mark.parametrize("size", [(64, 64), (101, 67)])
def test_smaller_copies_of_a_texture_are_as_light(tmp_path, size):
    """Black and white columns, one pixel each: half of the light at every level, whatever the size."""
    picture = np.zeros((*size[::-1], 3), np.uint8)
    picture[:, 1::2] = 255
    levels = read_levels(tmp_path, picture)
    assert len(levels) == 3
    for level, image in enumerate(levels):
        assert image.shape[:2] == tuple(-(-side // 2**level) for side in size[::-1])
        even = Texture((image,)).sample(np.random.default_rng(level).random((4000, 2)))
        np.testing.assert_allclose(even[:, :3].mean(axis=0), 0.5, atol=0.02)
        if level and size == (64, 64):
            np.testing.assert_allclose(image[..., :3], srgb(np.array(0.5)), atol=0.5)


@pytest.mark.parametrize(("mode", "light", "opacity"), [("OPAQUE", 0.5, 255), ("MASK", 1.0, 128)])
def test_what_cannot_be_seen_gives_smaller_copies_no_colour(tmp_path, mode, light, opacity):
    """White columns between black ones without opacity, which opaque materials ignore."""
    picture = np.zeros((64, 64, 4), np.uint8)
    picture[:, 1::2] = 255
    smaller = read_levels(tmp_path, picture, mode)[1]
    np.testing.assert_allclose(smaller[..., :3], srgb(np.array(light)), atol=0.5)
    np.testing.assert_array_equal(smaller[..., 3], opacity)


def read_levels(folder: Path, picture: np.ndarray, mode: str = "OPAQUE") -> tuple[np.ndarray, ...]:
    """The levels of an avatar's texture that has these pixels."""
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "PNG")

    def paint(builder: Any, nodes: dict[str, int]) -> None:
        builder.content["images"][0]["bufferView"] = builder.add_view(stream.getvalue())
        builder.content["materials"][0]["alphaMode"] = mode

    return load_avatar(put(folder, Style(more=paint))).appearance.texturing.textures[0].levels


def test_a_picture_that_cannot_be_decoded_is_said(tmp_path):
    """The mesh stays, white times its factor."""

    def spoil(builder: Any, nodes: dict[str, int]) -> None:
        builder.content["images"][0]["bufferView"] = builder.add_view(b"no picture at all...")

    avatar = load_avatar(put(tmp_path, Style(more=spoil)))
    with pytest.warns(UserWarning, match=r"images\[0\] cannot be decoded"):
        colours = avatar.appearance.colours
    np.testing.assert_allclose(colours, [[0.5, 0.5, 1.0, 1.0]] * len(colours))


def test_a_gltf_with_files_beside_it_is_the_same(tmp_path):
    """JSON with an external buffer, and JSON with a data URI, read as the GLB does."""
    data = make_avatar("vrm1")
    scene = Scene(data)
    (tmp_path / "some data.bin").write_bytes(scene.binary)
    uris = {"external": "some%20data.bin"}
    uris["inline"] = "data:application/octet-stream;base64," + base64.b64encode(scene.binary).decode()
    whole = load_avatar(put(tmp_path, "vrm1"))
    for name, uri in uris.items():
        content = scene.json | {"buffers": [{"byteLength": len(scene.binary), "uri": uri}]}
        path = tmp_path / f"{name}.gltf"
        path.write_text(json.dumps(content))
        avatar = load_avatar(path)
        np.testing.assert_array_equal(avatar.figure.shape.vertices, whole.figure.shape.vertices)
        np.testing.assert_array_equal(avatar.appearance.colours, whole.appearance.colours)
        assert avatar.figure.roles == whole.figure.roles


CHIBI = {  # a toy knight: large head, short legs, hips below the hip joints, controls beside the bones
    "Rig": ("", (0, 0, 0)),
    "root": ("Rig", (0, 0, 0)),
    "hips": ("root", (0, 0.41, 0)),
    "spine": ("hips", (0, 0.6, 0)),
    "chest": ("spine", (0, 0.97, 0)),
    "head": ("chest", (0, 1.24, 0)),
    "control-hips": ("root", (0, 0.41, 0)),
} | {
    f"{bone}.{side}": (
        parent if parent in ("chest", "hips", "root") else f"{parent}.{side}",
        (sign * x, y, z),
    )
    for sign, side in ((1, "l"), (-1, "r"))
    for bone, parent, (x, y, z) in (
        ("upperarm", "chest", (0.21, 1.11, 0)),
        ("lowerarm", "upperarm", (0.45, 1.11, 0)),
        ("wrist", "lowerarm", (0.71, 1.11, 0)),
        ("hand", "wrist", (0.79, 1.11, 0)),
        ("handslot", "hand", (0.88, 1.11, 0.04)),
        ("upperleg", "hips", (0.17, 0.52, 0)),
        ("lowerleg", "upperleg", (0.17, 0.29, 0.01)),
        ("foot", "lowerleg", (0.17, 0.15, -0.01)),
        ("toes", "foot", (0.17, 0.02, 0.14)),
        ("kneeIK", "root", (0.17, 0.3, 0.6)),
        ("handIK", "root", (0.71, 1.11, 0)),
    )
}


def test_unusual_proportions(tmp_path):
    """A toy knight has its roles by names; a hand beyond a wrist does not count as the wrist."""
    names = list(CHIBI)
    nodes = []
    for name, (parent, place) in CHIBI.items():
        origin = CHIBI[parent][1] if parent else (0, 0, 0)
        children = [k for k, other in enumerate(names) if CHIBI[other][0] == name]
        node = {"name": name, "translation": (np.array(place) - origin).tolist()}
        nodes.append(node | ({"children": children} if children else {}))
    path = tmp_path / "knight.gltf"
    path.write_text(json.dumps({"asset": {"version": "2.0"}, "nodes": nodes}))
    figure = load_avatar(path).figure
    found = {role: figure.skeleton.names[joint] for role, joint in figure.roles.named().items()}
    assert (found["pelvis"], found["head"]) == ("hips", "head")
    for side in "lr":
        bones = ("upperarm", "lowerarm", "wrist", "upperleg", "lowerleg", "foot")
        roles = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
        assert [found[f"{side}_{role}"] for role in roles] == [f"{bone}.{side}" for bone in bones]
    assert 1.0 < figure.height < 1.6


def test_faults_of_exporters_that_do_no_harm(tmp_path):
    """Nulls, strides of zero, empty primitives, a skin without weights, zeros after the JSON are read."""

    def spoil(builder: Any, nodes: dict[str, int]) -> None:
        content = builder.content
        content["nodes"][0]["extras"] = None
        content["bufferViews"][0]["byteStride"] = 0
        attributes = content["meshes"][0]["primitives"][0]["attributes"]
        bare = {"POSITION": attributes["POSITION"]}
        empty = builder.add("accessors", {"componentType": 5126, "count": 0, "type": "VEC3"})
        content["meshes"][0]["primitives"] += [{"attributes": bare}, {"attributes": {"POSITION": empty}}]
        content["meshes"][0]["primitives"].append({"attributes": bare, "mode": 0})

    data = bytearray(make_avatar(Style(more=spoil)))
    length = int.from_bytes(data[12:16], "little")
    end = data[: 20 + length].rstrip(b" ")
    data[len(end) : 20 + length] = b"\0" * (20 + length - len(end))
    path = tmp_path / "faulty.glb"
    path.write_bytes(data)
    avatar = load_avatar(path)
    clean = load_avatar(put(tmp_path, Style())).figure.shape
    assert len(avatar.pieces) == 2  # the second: the same vertices in order, on the root
    np.testing.assert_allclose(avatar.figure.shape.vertices[: len(clean.vertices)], clean.vertices, atol=1e-6)


def test_strips_and_fans_are_triangles(tmp_path):
    """A strip turns every second triangle; a fan shares its first vertex."""

    def add(builder: Any, nodes: dict[str, int]) -> None:
        primitive = builder.content["meshes"][0]["primitives"][0]
        primitives = []
        for mode, order in ((4, [0, 1, 2, 2, 1, 3, 2, 3, 4]), (5, [0, 1, 2, 3, 4]), (6, [0, 1, 2, 3, 4])):
            accessor = builder.add_accessor(order, "<u1", target=34963)
            primitives.append(primitive | {"mode": mode, "indices": accessor})
        builder.content["meshes"][0]["primitives"] = primitives

    plain, strip, fan = load_avatar(put(tmp_path, Style(more=add))).pieces
    np.testing.assert_array_equal(plain.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4]])
    np.testing.assert_array_equal(strip.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4]])
    np.testing.assert_array_equal(fan.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]])


# --- movement ------------------------------------------------------------------------------------


def animated(
    times: list[float], values: np.ndarray, path: str, interpolation: str, bone: str = "leftUpperArm"
) -> Any:
    """A change to a document: an animation of one property of one bone."""

    def add(builder: Any, nodes: dict[str, int]) -> None:
        sampler = {"input": builder.add_accessor(times, bounds=True), "output": builder.add_accessor(values)}
        target = {"node": nodes[bone], "path": path}
        animation = {"samplers": [sampler | {"interpolation": interpolation}]}
        builder.add("animations", animation | {"channels": [{"sampler": 0, "target": target}]})

    return add


TIMES = [0.1, 0.3, 0.65, 1.1]
TURNS = Rotation.random(4, random_state=8)


def test_linear_rotations_are_spherical(tmp_path):
    """As SciPy's Slerp, also where a key has the other sign."""
    keys = TURNS.as_quat() * [[1], [-1], [1], [-1]]
    motion = load(put(tmp_path, Style(more=animated(TIMES, keys, "rotation", "LINEAR"))))
    assert motion.rate == 60.0  # the keys are on no grid
    times = np.minimum(TIMES[0] + np.arange(len(motion)) / 60.0, TIMES[-1])
    expected = Slerp(np.float32(TIMES), TURNS)(np.maximum(times, np.float32(TIMES[0])))
    ours = Rotation.from_quat(motion.rotations[:, motion.skeleton.index("leftUpperArm")])
    assert (expected.inv() * ours).magnitude().max() < 1e-5


def test_step_keys_hold(tmp_path):
    """Each key holds until the next."""
    motion = load(put(tmp_path, Style(more=animated(TIMES, TURNS.as_quat(), "rotation", "STEP"))))
    times = TIMES[0] + np.arange(len(motion)) / 60.0
    key = np.searchsorted(TIMES, times + 1e-6, side="right") - 1
    ours = Rotation.from_quat(motion.rotations[:, motion.skeleton.index("leftUpperArm")])
    assert (TURNS[key].inv() * ours).magnitude().max() < 1e-5


def test_cubic_splines_are_hermite(tmp_path):
    """As SciPy's cubic Hermite spline."""
    rng = np.random.default_rng(2)
    values = rng.normal(0, 0.2, (4, 3, 3)) + [0, 1, 0]
    more = animated(TIMES, values.reshape(-1, 3), "translation", "CUBICSPLINE", "hips")
    motion = load(put(tmp_path, Style(more=more)))
    times = np.clip(TIMES[0] + np.arange(len(motion)) / 60.0, *np.float32([TIMES[0], TIMES[-1]]))
    # Between keys only: arriving and leaving tangents differ.
    for k in range(3):
        inside = (times >= TIMES[k]) & (times < TIMES[k + 1])
        ends = [k, k + 1]
        spline = CubicHermiteSpline(
            np.float32(TIMES)[ends], values[ends, 1], [values[k, 2], values[k + 1, 0]]
        )
        np.testing.assert_allclose(motion.root_positions[inside], spline(times[inside]), atol=1e-5)


@pytest.mark.parametrize("rate", [24.0, 29.97, 30.0, 120.0])
def test_even_keys_tell_the_rate(rate, tmp_path):
    """Keys on a grid are read as they are, at their own rate, wherever they begin."""
    times = (np.arange(200) + 7) / rate
    turns = Rotation.random(200, random_state=1)
    motion = load(put(tmp_path, Style(more=animated(times, turns.as_quat(), "rotation", "LINEAR"))))
    assert motion.rate == pytest.approx(rate, rel=1e-6)
    assert len(motion) == 200
    ours = Rotation.from_quat(motion.rotations[:, motion.skeleton.index("leftUpperArm")])
    assert (turns.inv() * ours).magnitude().max() < 1e-6
    assert len(load(tmp_path / "avatar.glb", rate=10.0)) == int(199 / rate * 10) + 1


def test_long_and_sparse_recordings_keep_their_rate(tmp_path):
    """An hour at 120 Hz, which single precision tells to a fortieth of a frame; keys on a few frames."""
    document = load_avatar(put(tmp_path, Style(mesh="none"))).document
    keys = (np.arange(432_000) / 120.0).astype(np.float32).astype(float)
    hour = Channel(1, "translation", keys, np.zeros((len(keys), 3)), "LINEAR")
    times, rate = find_grid(document, [hour], None, 1)
    assert rate == 120.0
    np.testing.assert_array_equal(times, keys)
    frames = np.array([0, 1, 2, 3, 7, 8, 9, 20])
    turns = Rotation.random(8, random_state=2).as_quat()
    motion = load(put(tmp_path, Style(more=animated(frames / 24.0, turns, "rotation", "LINEAR"))))
    assert (motion.rate, len(motion)) == (24.0, 21)


def test_a_node_above_the_skeleton_that_moves_is_part_of_it(tmp_path):
    """Root motion on the armature's node is not lost."""
    places = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 2.0]])

    def add(builder: Any, nodes: dict[str, int]) -> None:
        animated([0.0, 1.0], places, "translation", "LINEAR")(builder, nodes)
        builder.content["animations"][0]["channels"][0]["target"]["node"] = 0

    motion = load(put(tmp_path, Style(more=add)))
    assert motion.skeleton.names[0] == "Armature"
    np.testing.assert_allclose(motion.root_positions, places, atol=1e-6)


def test_scales_that_move_are_said(tmp_path):
    """A Motion cannot hold them."""
    path = put(
        tmp_path, Style(more=animated([0.0, 1.0], np.array([[1, 1, 1], [1, 2, 1]]), "scale", "LINEAR"))
    )
    with pytest.warns(UserWarning, match="animation scales 1 nodes"):
        load(path)


# --- characters of others ------------------------------------------------------------------------


@pytest.mark.parametrize("path", recordings("mesh/*.[gv]*"))
def test_characters_of_others(path, data):
    """Sides, facing and proportions are plausible; skin and colours are there where the file has a mesh.

    The rest pose of a VRM faces +Z; others face as their makers liked (CesiumMan: +X), and are turned.
    """
    avatar = load_avatar(path)
    figure = avatar.figure
    rest, r = figure.rest_positions, figure.roles
    for pair in (r.shoulder, r.elbow, r.wrist, r.hip, r.knee, r.ankle):
        assert rest[pair[LEFT], 0] > rest[pair[RIGHT], 0]
    assert rest[r.head, 1] > rest[r.pelvis, 1] > rest[r.knee[0], 1] > rest[r.ankle[0], 1]
    resting = at_rest(avatar)[0]
    across = resting[r.hip[LEFT]] - resting[r.hip[RIGHT]]
    assert abs(across[1]) < 0.1 * np.linalg.norm(across)
    assert across[0] > 0.9 * np.linalg.norm(across) or avatar.humanoid is None
    for upper, lower in ((figure.offset_between(a, b), figure.offset_between(b, c)) for a, b, c in r.limbs):
        assert 0.4 < np.linalg.norm(upper) / np.linalg.norm(lower) < 2.5
    assert 0.3 < figure.height < 3.0
    motion, shape = avatar.read_motion(), figure.shape
    if shape is not None:
        ours = shape.place(motion.positions[0], motion.transforms[1][0])
        assert np.ptp(ours[:, 1]) > 0.1 * figure.height  # one of them is a ball on a skeleton
        assert avatar.appearance.colours.shape == (len(ours), 4)
    assert motion.skeleton.names == figure.skeleton.names
