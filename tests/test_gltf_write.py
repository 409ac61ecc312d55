"""Avatars and motions as they are written: the movement comes back, and everything else is kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sixpoint as sp
from conftest import recordings
from gltf_avatars import BONES, EXTENSIONS, STYLES, Style, make_avatar, png
from gltf_independent import Scene
from sixpoint.body import rotations as rot
from sixpoint.body.motion import Motion
from sixpoint.errors import FormatError
from sixpoint.formats import load, load_avatar, save
from sixpoint.formats.gltf.avatar import Avatar
from test_gltf_viewers import drive, errors

CLOSE = 1e-5


@pytest.fixture(scope="module")
def boxing() -> sp.Targets:
    """Two seconds of the built-in boxing motion."""
    figure = sp.Figure.from_stature()
    return figure.targets(sp.make_sample("boxing", figure).sliced(slice(60, 180)))


def put(folder: Path, name: str, style: Style | None = None) -> Avatar:
    """An avatar in a file of its own."""
    path = folder / (name + EXTENSIONS.get(name, ".glb"))
    path.write_bytes(make_avatar(style or name))
    return load_avatar(path)


def same(a: Motion, b: Motion) -> None:
    """Two motions are one, up to the signs of quaternions."""
    assert a.skeleton.names == b.skeleton.names
    assert a.rate == pytest.approx(b.rate, rel=1e-6)
    assert len(a) == len(b)
    assert rot.angle(rot.mul(rot.inv(a.rotations), b.rotations)).max() < CLOSE
    np.testing.assert_allclose(a.positions, b.positions, atol=CLOSE)


def wild(avatar: Avatar) -> Motion:
    """A motion in which every joint turns, and root and one other joint move."""
    rng = np.random.default_rng(4)
    joints = len(avatar.figure.skeleton)
    turned = rot.normalised(rng.normal(size=(30, joints, 4)))
    moving = (0, joints - 1)
    return Motion(avatar.figure.skeleton, turned, rng.normal(size=(30, 2, 3)), 50.0, moving=moving)


@pytest.mark.parametrize("name", STYLES)
def test_our_own_file_gives_the_motion_back(name, tmp_path):
    """Any motion of any joint, on files that turn and scale their nodes."""
    avatar = put(tmp_path, name)
    motion = wild(avatar)
    save(motion, tmp_path / "out.glb", avatar=avatar)
    same(load(tmp_path / "out.glb"), motion)


@pytest.mark.parametrize("name", STYLES)
def test_the_file_shows_the_same_seen_with_plain_matrices(name, tmp_path, boxing):
    """Joints and skinned vertices, evaluated by an independent reader, are ours; VRM 0.x still faces -Z."""
    avatar = put(tmp_path, name)
    motion = drive(avatar, boxing)
    save(motion, tmp_path / "out.glb", avatar=avatar)
    scene = Scene((tmp_path / "out.glb").read_bytes())
    turn = np.array([-1.0, 1.0, -1.0]) if name == "vrm0" else np.ones(3)
    for k in (0, 60, 119):
        world = scene.world_at(k / motion.rate)
        np.testing.assert_allclose(
            world[list(avatar.rig.nodes), :3, 3] * turn, motion.positions[k], atol=CLOSE
        )
        if avatar.figure.shape is not None:
            ours = avatar.figure.shape.place(motion.positions[k], motion.transforms[1][k])
            ours = ours[avatar.figure.shape.triangles].reshape(-1, 3)
            theirs = scene.vertices_at(k / motion.rate).reshape(-1, 3) * turn
            np.testing.assert_allclose(np.sort(theirs, 0), np.sort(ours, 0), atol=CLOSE)


def test_a_raised_hand_is_raised_in_the_mesh(tmp_path):
    """The right wrist target goes up, and so do the vertices of the right hand, those of the left stay."""
    avatar = put(tmp_path, "vrm0")
    figure, shape = avatar.figure, avatar.figure.shape
    points = figure.targets(sp.Motion.from_poses([figure.neutral_pose], 60.0)).positions[0].copy()
    shoulder = figure.rest_positions[figure.roles.shoulder[1]] - figure.rest_positions[figure.roles.pelvis]
    raised = points.copy()
    raised[3] = shoulder + [-0.1, 0.45, 0.1]
    solver = sp.SequentialIKPlus(figure)
    hands = []
    for targets in (points, raised):
        pose = solver.solve(targets).pose
        placed = shape.place(*pose.compute_transforms())
        hands.append([placed[shape.joints[:, 0] == wrist].mean(axis=0) for wrist in figure.roles.wrist])
    (left, right), (left_after, right_after) = hands
    assert right_after[1] - right[1] > 0.8
    assert abs(left_after[1] - left[1]) < 0.1
    assert left[0] > 0 > right[0]


def test_materials_pictures_and_extensions_stay(tmp_path, boxing):
    """The picture's bytes, the material and the VRM extension are those of the file; old animations go."""
    avatar = put(tmp_path, "vrm0")
    motion = drive(avatar, boxing)
    save(motion, tmp_path / "once.glb", avatar=avatar)
    again = load_avatar(tmp_path / "once.glb")
    assert again.kind == "VRM 0.x"
    save(wild(again), tmp_path / "twice.glb", avatar=again)
    before, after = (Scene(p.read_bytes()) for p in (tmp_path / "vrm0.vrm", tmp_path / "twice.glb"))
    assert after.json["materials"] == before.json["materials"]
    assert after.json["extensions"] == before.json["extensions"]
    assert len(after.json["animations"]) == 1
    view = after.json["bufferViews"][after.json["images"][0]["bufferView"]]
    assert after.binary[view["byteOffset"] :][: view["byteLength"]] == png()
    # Nothing of the first animation is left behind: the size depends on the second alone.
    fresh = tmp_path / "fresh.glb"
    save(wild(avatar), fresh, avatar=avatar)
    assert (tmp_path / "twice.glb").stat().st_size == fresh.stat().st_size


def test_what_does_not_move_costs_one_key(tmp_path, boxing):
    """Key times are stored once, still joints have one key or none."""
    avatar = put(tmp_path, "vrm1")
    motion = drive(avatar, boxing)
    save(motion, tmp_path / "out.glb", avatar=avatar)
    scene = Scene((tmp_path / "out.glb").read_bytes())
    animation = scene.json["animations"][0]
    inputs = {s["input"] for s in animation["samplers"]}
    assert len(inputs) <= 2
    counts = [scene.json["accessors"][s["output"]]["count"] for s in animation["samplers"]]
    moving = np.ptp(motion.rotations, axis=0).max(axis=1) > 1e-6
    assert sum(c == len(motion) for c in counts) <= moving.sum() + 1
    assert len(animation["channels"]) <= len(BONES) + 1


def test_pictures_beside_the_file_come_into_it(tmp_path, boxing):
    """An external picture is embedded; a missing one is said before anything is written."""

    def outside(builder: Any, nodes: dict[str, int]) -> None:
        builder.content["images"] = [{"uri": "skin%20colour.png"}]

    (tmp_path / "skin colour.png").write_bytes(png())
    avatar = put(tmp_path, "outside", Style(more=outside))
    (tmp_path / "elsewhere").mkdir()
    save(drive(avatar, boxing), tmp_path / "elsewhere" / "out.glb", avatar=avatar)
    moved = load_avatar(tmp_path / "elsewhere" / "out.glb")
    np.testing.assert_array_equal(moved.appearance.colours, avatar.appearance.colours)
    (tmp_path / "skin colour.png").unlink()
    with pytest.raises(FormatError, match=r"images\[0\].*skin colour.png.*no such file"):
        save(drive(avatar, boxing), tmp_path / "lost.glb", avatar=avatar)
    assert not (tmp_path / "lost.glb").exists()


def test_what_is_not_known_is_kept_whole(tmp_path):
    """With an extension that may refer to any data, nothing is taken out and no index changes."""

    def unknown(builder: Any, nodes: dict[str, int]) -> None:
        builder.content["extensionsUsed"] = ["ACME_data"]
        builder.content["extensions"] = {"ACME_data": {"bufferView": builder.add_view(b"important data!!")}}

    avatar = put(tmp_path, "unknown", Style(more=unknown))
    motion = wild(avatar)
    save(motion, tmp_path / "out.glb", avatar=avatar)
    same(load(tmp_path / "out.glb"), motion)
    scene = Scene((tmp_path / "out.glb").read_bytes())
    view = scene.json["bufferViews"][scene.json["extensions"]["ACME_data"]["bufferView"]]
    assert scene.binary[view["byteOffset"] :][: view["byteLength"]] == b"important data!!"


def test_several_roots_get_one_that_can_move(tmp_path):
    """A body whose file has two trees (legs and trunk) keeps its movement."""

    def split(builder: Any, nodes: dict[str, int]) -> None:
        armature = builder.content["nodes"][0]
        armature["children"] = [1]
        builder.add("nodes", {"name": "other", "translation": [0.0, 0.5, 0.0]})
        builder.content["scenes"][0]["nodes"].append(len(builder.content["nodes"]) - 1)

    avatar = put(tmp_path, "split", Style(mesh="none", more=split))
    assert avatar.rig.nodes[0] == -1
    motion = wild(avatar)
    save(motion, tmp_path / "out.glb", avatar=avatar)
    same(load(tmp_path / "out.glb"), motion)


def test_a_motion_with_end_sites_survives(tmp_path):
    """Skeleton, sites and movement of the built-in figure come back, and so to BVH and back."""
    motion = sp.make_sample("walk")
    save(motion, tmp_path / "walk.glb")
    back = load(tmp_path / "walk.glb")
    same(back, motion)
    assert back.skeleton.site_names == motion.skeleton.site_names
    np.testing.assert_allclose(back.skeleton.site_offsets, motion.skeleton.site_offsets, atol=1e-6)
    save(back, tmp_path / "walk.bvh")
    save(load(tmp_path / "walk.bvh"), tmp_path / "again.glb")
    same(load(tmp_path / "again.glb"), motion)


def test_a_shape_comes_back_with_its_colours(tmp_path):
    """A motion with a shape is an avatar with this shape."""
    avatar = put(tmp_path, "knight")
    shape = avatar.figure.shape
    save(wild(avatar), tmp_path / "out.glb", shape=shape, appearance=avatar.appearance)
    again = load_avatar(tmp_path / "out.glb")
    np.testing.assert_allclose(again.figure.shape.vertices, shape.vertices, atol=1e-6)
    np.testing.assert_array_equal(again.figure.shape.triangles, shape.triangles)
    np.testing.assert_allclose(again.appearance.colours, avatar.appearance.colours, atol=1e-6)
    motion = wild(avatar)
    ours = shape.place(motion.positions[7], motion.transforms[1][7])
    theirs = again.figure.shape.place(motion.positions[7], motion.transforms[1][7])
    np.testing.assert_allclose(ours, theirs, atol=CLOSE)


def test_one_frame_is_a_file_too(tmp_path):
    """A single pose comes back."""
    motion = sp.make_sample("walk").sliced(slice(10, 11))
    save(motion, tmp_path / "pose.glb")
    back = load(tmp_path / "pose.glb", rate=motion.rate)
    same(back, motion)


# --- VRM animations ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["vrm0", "vrm1", "bones"])
def test_a_vrm_animation_of_a_vrm_is_exact(name, tmp_path):
    """All bones of its map are where they were, facing +Z; in T-pose their frames are the world's."""
    avatar = put(tmp_path, name)
    motion = wild(avatar)
    motion = Motion(motion.skeleton, motion.rotations, motion.translations[:, :1], motion.rate)
    save(motion, tmp_path / "out.vrma", avatar=avatar)
    back = load_avatar(tmp_path / "out.vrma")
    acted = back.read_motion()
    bones = avatar.humanoid.bones
    assert set(back.humanoid.bones) == set(bones)
    for bone, node in back.humanoid.bones.items():
        ours, theirs = avatar.rig.nodes.index(bones[bone]), back.rig.nodes.index(node)
        np.testing.assert_allclose(acted.positions[:, theirs], motion.positions[:, ours], atol=CLOSE)
    content = Scene((tmp_path / "out.vrma").read_bytes()).json
    assert content["extensions"]["VRMC_vrm_animation"]["specVersion"] == "1.0"
    assert all("rotation" not in node and "scale" not in node for node in content["nodes"])


def test_a_vrm_animation_of_any_figure_keeps_limbs(tmp_path):
    """Hips, legs and the directions of arms are those of the figure; the trunk has fewer joints."""
    figure = sp.Figure.from_stature()
    motion = sp.make_sample("boxing", figure).sliced(slice(0, 200))
    save(motion, tmp_path / "boxing.vrma")
    avatar = load_avatar(tmp_path / "boxing.vrma")
    acted = avatar.read_motion()
    ours, theirs = figure.roles, avatar.figure.roles
    for role in ("hip", "knee", "ankle"):
        mine, other = (list(getattr(r, role)) for r in (ours, theirs))
        np.testing.assert_allclose(acted.positions[:, other], motion.positions[:, mine], atol=CLOSE)
    for mine, other in zip(ours.limbs[:2], theirs.limbs[:2], strict=True):
        for a, b in ((0, 1), (1, 2)):
            bone = motion.positions[:, mine[b]] - motion.positions[:, mine[a]]
            acting = acted.positions[:, other[b]] - acted.positions[:, other[a]]
            np.testing.assert_allclose(acting, bone, atol=CLOSE)
    t_pose = avatar.figure.skeleton.compute_transforms(
        np.tile(rot.IDENTITY, (len(avatar.figure.skeleton), 1))
    )[0]
    (left, _, hand), (right, _, other_hand) = theirs.limbs[:2]
    assert rot.unit(t_pose[hand] - t_pose[left]) == pytest.approx([1.0, 0.0, 0.0], abs=1e-6)
    assert rot.unit(t_pose[other_hand] - t_pose[right]) == pytest.approx([-1.0, 0.0, 0.0], abs=1e-6)
    assert t_pose[:, 1].min() == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize(("name", "worst"), [("boxing", 0.006), ("walk", 0.001), ("climb_and_hang", 0.008)])
def test_a_vrm_animation_of_a_long_spine_keeps_shoulders_and_head(name, worst, tmp_path):
    """Six trunk and neck joints on four bones: places within millimetres, chest and head turned exactly."""
    figure = sp.Figure.from_stature()
    motion = sp.make_sample(name, figure).sliced(slice(0, 300, 3))
    check_trunk(figure, motion, tmp_path / "a.vrma", worst)


@pytest.mark.parametrize("path", recordings("cmu/02_05.amc") + recordings("xsens/*.bvh"))
def test_a_vrm_animation_of_a_recording_keeps_shoulders_and_head(path, tmp_path):
    """The neck of CMU rigs has one joint more than the bone: within 5 mm."""
    motion = load(path).sliced(slice(0, 600, 6))
    check_trunk(sp.Figure.from_motion(motion), motion, tmp_path / "a.vrma", 0.005)


def check_trunk(figure, motion, out, worst):
    """A motion comes back from a .vrma: where shoulders and head are [m], how chest and head are turned."""
    save(motion, out)
    avatar = load_avatar(out)
    acted = avatar.read_motion()
    ours, theirs = figure.roles, avatar.figure.roles
    for mine, other in ((ours.head, theirs.head), *zip(ours.shoulder, theirs.shoulder, strict=True)):
        off = np.linalg.norm(acted.positions[:, other] - motion.positions[:, mine], axis=1)
        assert off.max() < worst
    chest = avatar.figure.skeleton.names.index("upperChest")
    carrier = figure.skeleton.parents[ours.clavicle[0]]
    for mine, other in ((ours.head, theirs.head), (carrier, chest)):
        turned = rot.mul(motion.transforms[1][:, mine], rot.inv(figure.neutral[mine]))
        assert rot.angle(rot.mul(rot.inv(turned), acted.transforms[1][:, other])).max() < 1e-5


# --- what is refused -----------------------------------------------------------------------------


def test_wrong_requests_say_what_to_do(tmp_path, boxing):
    """Another skeleton, two meshes at once, units, names that glTF is not written under."""
    avatar = put(tmp_path, "vrm1")
    other = sp.make_sample("walk")
    motion = wild(avatar)
    out = tmp_path / "out.glb"
    with pytest.raises(FormatError, match=r"another skeleton \(34 joints\).*'vrm1' \(21\)"):
        save(other, out, avatar=avatar)
    stretched = replace(motion.skeleton, offsets=motion.skeleton.offsets * 1.1)
    with pytest.raises(FormatError, match=r"shares its names: 'left.*Leg' is elsewhere"):
        save(replace(motion, skeleton=stretched), out, avatar=avatar)
    with pytest.raises(FormatError, match="34 joints"):
        save(other, tmp_path / "out.vrma", avatar=avatar)
    with pytest.raises(FormatError, match="bound to 21 joints, the motion has 34"):
        save(other, out, shape=avatar.figure.shape)
    with pytest.raises(FormatError, match="not both"):
        save(motion, out, avatar=avatar, shape=avatar.figure.shape)
    with pytest.raises(FormatError, match="colours are not those"):
        save(motion, out, appearance=avatar.appearance)
    with pytest.raises(FormatError, match="always in metres and Y up"):
        save(motion, out, unit="cm")
    with pytest.raises(FormatError, match="always in metres and Y up"):
        load(tmp_path / "vrm1.vrm", up="z")
    with pytest.raises(FormatError, match=r"save as \.glb"):
        save(motion, tmp_path / "out.vrm")
    with pytest.raises(FormatError, match=r"can only be written into a \.glb"):
        save(motion, tmp_path / "out.bvh", avatar=avatar)
    assert not out.exists()
    save(motion, out, avatar=avatar)
    with pytest.raises(FormatError, match="exists"):
        save(motion, out, avatar=avatar)


def test_what_exporters_get_wrong_is_put_right(tmp_path, boxing):
    """Weights that name a joint twice or do not sum to one, long normals, wrong bounds, a stray skeleton."""

    def spoil(builder: Any, nodes: dict[str, int]) -> None:
        content = builder.content
        attributes = content["meshes"][0]["primitives"][0]["attributes"]
        count = content["accessors"][attributes["POSITION"]]["count"]
        content["accessors"][attributes["POSITION"]]["max"] = [9.0, 9.0, 9.0]
        attributes["NORMAL"] = builder.add_accessor(np.full((count, 3), 2.0), target=34962)
        attributes["JOINTS_0"] = builder.add_accessor(np.tile([3, 3, 4, 9], (count, 1)), "<u1", target=34962)
        attributes["WEIGHTS_0"] = builder.add_accessor(np.tile([0.5, 0.2, 0.2, 0], (count, 1)), target=34962)
        content["skins"][0]["skeleton"] = nodes["leftFoot"]
        content["cameras"] = []
        content["nodes"][nodes["leftFoot"]]["rotation"] = [0.0, 0.0, 0.0, 1.01]

    avatar = put(tmp_path, "spoilt", Style(more=spoil))
    motion = drive(avatar, boxing)
    save(motion, tmp_path / "out.glb", avatar=avatar)
    assert "spoilt.glb" in errors([tmp_path / "spoilt.glb"])
    assert errors([tmp_path / "out.glb"]) == {}
    shape, again = avatar.figure.shape, load_avatar(tmp_path / "out.glb").figure.shape
    places = motion.positions[9], motion.transforms[1][9]
    np.testing.assert_allclose(shape.place(*places), again.place(*places), atol=CLOSE)


@pytest.mark.parametrize("path", recordings("mesh/*.[gv]*"))
def test_characters_of_others_are_driven(path, data, tmp_path):
    """The paper's boxing clip moves them; their file gives the motion back."""
    clip = load(data / "paper" / "17_10.amc").sliced(slice(0, 600, 2))
    avatar = load_avatar(path)
    motion = drive(avatar, sp.Figure.from_motion(clip).targets(clip))
    save(motion, tmp_path / "driven.glb", avatar=avatar)
    same(load(tmp_path / "driven.glb"), motion)
    again = load_avatar(tmp_path / "driven.glb")
    assert again.kind == avatar.kind
    assert again.document.items("materials") == avatar.document.items("materials")
