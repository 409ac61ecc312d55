"""USD: what is written is read again, and usd-core itself, as a peer, sees the same joints and surfaces."""

import importlib
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import sixpoint as sp
from sixpoint import formats
from sixpoint.body import rotations as rot
from sixpoint.errors import FormatError
from sixpoint.formats.usd.matrices import compose, decompose
from sixpoint.formats.usd.mesh import triangulate
from sixpoint.jobs.convert import convert
from test_formats_bvh import make_motion
from test_shape import random_shape

pxr = pytest.importorskip("pxr", reason="usd-core is not installed: pip install 'sixpoint[usd]'")
Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt = (
    importlib.import_module(f"pxr.{name}") for name in ("Gf", "Sdf", "Usd", "UsdGeom", "UsdSkel", "Vt")
)

TURN = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # columns: file Z-up -> Y-up, (x, y, z) -> (x, z, -y)


def peer_joints(path, frames):
    """World positions (F, J, 3) [m, Y up] of the skeleton's joints as UsdSkel computes them."""
    stage = Usd.Stage.Open(str(path))
    root = next(p for p in stage.Traverse() if p.IsA(UsdSkel.Root))
    skeleton = UsdSkel.Skeleton(next(p for p in stage.Traverse() if p.IsA(UsdSkel.Skeleton)))
    cache = UsdSkel.Cache()
    cache.Populate(UsdSkel.Root(root), Usd.PrimDefaultPredicate)
    query = cache.GetSkelQuery(skeleton)
    out = [np.array(query.ComputeJointWorldTransforms(UsdGeom.XformCache(t)))[:, 3, :3] for t in frames]
    return to_metres(stage, np.array(out))


def peer_surface(path, frames):
    """Vertices (F, V, 3) [m, Y up] of all meshes, as UsdSkel bakes them."""
    copy = Sdf.Layer.CreateAnonymous(".usda")  # baking writes into the layer
    copy.TransferContent(Sdf.Layer.FindOrOpen(str(path)))
    stage = Usd.Stage.Open(copy)
    roots = [UsdSkel.Root(p) for p in stage.Traverse() if p.IsA(UsdSkel.Root)]
    for root in roots:
        assert UsdSkel.BakeSkinning(root, Gf.Interval.GetFullInterval())
    meshes = [UsdGeom.Mesh(p) for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)]
    out = []
    for time in frames:
        placed = []
        for mesh in meshes:
            world = np.array(UsdGeom.XformCache(time).GetLocalToWorldTransform(mesh.GetPrim()))
            placed.append(np.array(mesh.GetPointsAttr().Get(time), float) @ world[:3, :3] + world[3, :3])
        out.append(np.concatenate(placed))
    return to_metres(stage, np.array(out))


def to_metres(stage, points):
    points = points * UsdGeom.GetStageMetersPerUnit(stage)
    return points @ TURN if UsdGeom.GetStageUpAxis(stage) == "Z" else points


def angles(a, b):
    return rot.angle(rot.mul(rot.inv(a), b))


@pytest.mark.parametrize("suffix", formats.usd.USD_SUFFIXES)
def test_what_is_written_is_read_again(tmp_path, suffix):
    """Motion to 1e-5, shape to 1e-6, names, sites, rate and which joints move exactly; text and binary."""
    motion = make_motion(seed=1, joints=15, frames=9, moving=4)
    shape = random_shape(15, np.random.default_rng(0))
    path = tmp_path / f"take{suffix}"
    formats.save(motion, path, shape=shape)
    back, surface = formats.load(path), formats.load_shape(path)
    assert back.skeleton.names == motion.skeleton.names
    assert back.skeleton.site_names == motion.skeleton.site_names
    assert set(back.moving) == set(motion.moving)
    assert back.rate == pytest.approx(motion.rate, rel=1e-12)
    np.testing.assert_array_equal(back.skeleton.parents, motion.skeleton.parents)
    np.testing.assert_allclose(back.skeleton.offsets[1:], motion.skeleton.offsets[1:], atol=1e-12)
    np.testing.assert_allclose(back.skeleton.site_offsets, motion.skeleton.site_offsets, atol=1e-12)
    np.testing.assert_allclose(back.positions, motion.positions, atol=1e-5)
    assert angles(back.rotations, motion.rotations).max() < 1e-5
    assert (back.space.unit, back.space.up, back.space.unit_source) == (1.0, "y", "file")
    for name in ("vertices", "weights", "bind_positions"):
        np.testing.assert_allclose(getattr(surface, name), getattr(shape, name), atol=1e-6)
    for name in ("triangles", "joints"):
        np.testing.assert_array_equal(getattr(surface, name), getattr(shape, name))
    assert angles(surface.bind_rotations, shape.bind_rotations).max() < 1e-6
    assert surface.name == shape.name


@given(st.integers(0, 10_000), st.integers(4, 12), st.integers(1, 5))
@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_motion_survives(tmp_path, seed, joints, frames):
    """Random trees, one frame or many."""
    motion = make_motion(seed=seed, joints=joints, frames=frames, moving=min(joints, 3))
    path = tmp_path / "take.usdc"
    formats.save(motion, path, force=True)
    np.testing.assert_allclose(formats.load(path).positions, motion.positions, atol=1e-5)
    assert formats.load_shape(path) is None


def test_one_joint_is_enough(tmp_path):
    """A skeleton of one joint is written and read."""
    skeleton = sp.Skeleton(("ball",), np.array([-1]), np.zeros((1, 3)))
    motion = sp.Motion(
        skeleton, rot.from_euler("XYZ", np.ones((3, 1, 3))), np.arange(9.0).reshape(3, 1, 3), 30.0
    )
    formats.save(motion, tmp_path / "ball.usda")
    np.testing.assert_allclose(formats.load(tmp_path / "ball.usda").positions, motion.positions, atol=1e-6)


@pytest.mark.parametrize("name", ["boxing", "walk"])
def test_usdskel_sees_our_joints_and_our_surface(tmp_path, name):
    """UsdSkel's joints agree with ours to 1e-5 m, its baked skinning with ``Shape.place`` to 1e-4 m."""
    motion = sp.make_sample(name).sliced(slice(0, 60, 6))
    rng = np.random.default_rng(3)
    world = motion.transforms[1]
    shape = replace(
        random_shape(len(motion.skeleton), rng, 200),
        bind_positions=motion.positions[3],
        bind_rotations=world[3],
        vertices=motion.positions[3][rng.integers(0, len(motion.skeleton), 200)]
        + rng.normal(size=(200, 3)) * 0.1,
    )
    path = tmp_path / "take.usda"
    formats.save(motion, path, shape=shape)
    frames = range(len(motion))
    np.testing.assert_allclose(peer_joints(path, frames), motion.positions, atol=1e-5)
    placed = shape.place(motion.positions, world)
    np.testing.assert_allclose(peer_surface(path, frames), placed, atol=1e-4)
    stage = Usd.Stage.Open(str(path))
    low, high = np.array(UsdSkel.Root(stage.GetDefaultPrim()).GetExtentAttr().Get())
    assert np.all(placed > low - 1e-5) and np.all(placed < high + 1e-5)


@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
def test_the_validators_of_usd_find_nothing(tmp_path, suffix):
    """All validators that come with usd-core pass what we write, and do find what is wrong."""
    validation = pytest.importorskip("pxr.UsdValidation", reason="this usd-core has no UsdValidation")
    motion = make_motion(joints=12)
    path = tmp_path / f"take{suffix}"
    formats.save(motion, path, shape=random_shape(12, np.random.default_rng(0)))
    validators = validation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 10
    stage = Usd.Stage.Open(str(path))
    found = validation.ValidationContext(validators).Validate(stage)
    assert [e.GetErrorAsString() for e in found] == []
    stage.GetPrimAtPath("/take/Mesh").RemoveAPI(UsdSkel.BindingAPI)
    assert validation.ValidationContext(validators).Validate(stage)


def test_odd_names_become_valid_and_come_back(tmp_path):
    """Names that USD does not allow are written as valid ones and read as they were."""
    motion = make_motion(joints=6, moving=1)
    names = ("mixamorig:Hips", "mixamorig_Hips", "Left Leg", "DEF-spine.001", "Hüfte", "1st")
    motion = replace(motion, skeleton=replace(motion.skeleton, names=names))
    path = tmp_path / "1 take (new).usda"
    formats.save(motion, path)
    assert formats.load(path).skeleton.names == names
    stage = Usd.Stage.Open(str(path))
    skeleton = UsdSkel.Skeleton(next(p for p in stage.Traverse() if p.IsA(UsdSkel.Skeleton)))
    valid, why = UsdSkel.Topology(skeleton.GetJointsAttr().Get()).Validate()
    assert valid, why
    np.testing.assert_array_equal(
        UsdSkel.Topology(skeleton.GetJointsAttr().Get()).GetParentIndices(), motion.skeleton.parents
    )


def test_a_figure_is_found_in_a_usd_file(tmp_path):
    """A rig that went through USD has the same anatomy and the same six points."""
    figure = sp.Figure.from_stature(1.7)
    motion = sp.make_sample("reach", figure).sliced(slice(0, 30))
    formats.save(motion, tmp_path / "take.usdc")
    back = sp.load(tmp_path / "take.usdc")
    found = sp.Figure.from_motion(back)
    assert found.roles.named() == figure.roles.named()
    np.testing.assert_allclose(found.targets(back).positions, figure.targets(motion).positions, atol=1e-5)


def test_converting_between_usd_files_keeps_the_surface(tmp_path):
    """Text to binary keeps motion and mesh; to BVH the motion."""
    motion, shape = make_motion(joints=9), random_shape(9, np.random.default_rng(2))
    formats.save(motion, tmp_path / "take.usda", shape=shape)
    convert(tmp_path / "take.usda", tmp_path / "take.usdc")
    np.testing.assert_allclose(formats.load_shape(tmp_path / "take.usdc").vertices, shape.vertices, atol=1e-6)
    convert(tmp_path / "take.usdc", tmp_path / "take.bvh")
    back = formats.load(tmp_path / "take.bvh", unit=1.0, up="y")
    order = [back.skeleton.index(name) for name in motion.skeleton.names]  # a BVH is written depth first
    np.testing.assert_allclose(back.positions[:, order], motion.positions, atol=1e-4)


# --- what others write ---------------------------------------------------------------------------


def foreign_stage(path, *, scale=0.01, roots=False, up="Z", unit=1.0, seed=0, frames=5, parent_moves=False):
    """A stage as an exporter writes it.

    Frames are turned at rest, an armature is turned and scaled, an animation names some joints in another
    order, a mesh of polygons names its joints in a third one, and another is carried by one joint.
    """
    rng = np.random.default_rng(seed)
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    UsdGeom.SetStageUpAxis(stage, up)
    stage.SetTimeCodesPerSecond(24)
    stage.SetFramesPerSecond(24)
    armature = UsdGeom.Xform.Define(stage, "/World")
    stage.SetDefaultPrim(armature.GetPrim())
    armature.AddTranslateOp().Set(Gf.Vec3d(0.3, 0.2, 0.1))
    armature.AddRotateXYZOp().Set(Gf.Vec3f(-90, 10, 0))
    if parent_moves:
        armature.AddTranslateOp(opSuffix="walk").Set(Gf.Vec3d(0, 0, 0), 1)
        armature.GetOrderedXformOps()[-1].Set(Gf.Vec3d(1, 0, 0), frames)
    armature.AddScaleOp().Set(Gf.Vec3f(scale, scale, scale))
    root = UsdSkel.Root.Define(stage, "/World/Body")
    skeleton = UsdSkel.Skeleton.Define(stage, "/World/Body/Rig")
    joints = ["A", "A/B", "A/B/C", "A/B/C/D", "A/E"] + (["F", "F/G"] if roots else [])
    count = len(joints)
    topology = UsdSkel.Topology(joints)
    local = compose(Rotation.random(count, rng=rng).as_quat(), rng.normal(size=(count, 3)) * 30)
    bind = local.copy()
    for k, p in enumerate(topology.GetParentIndices()):
        bind[k] = local[k] @ bind[p] if p >= 0 else local[k]
    skeleton.CreateJointsAttr(joints)
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray.FromNumpy(local))
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray.FromNumpy(bind))
    animation = UsdSkel.Animation.Define(stage, "/World/Body/Rig/Walk")
    order = [2, 0, 1]
    animation.CreateJointsAttr([joints[k] for k in order])
    animation.CreateScalesAttr(Vt.Vec3hArray(3, Gf.Vec3h(1)))
    translations, rotations = animation.CreateTranslationsAttr(), animation.CreateRotationsAttr()
    rest = local[order][:, 3, :3]
    for t in range(1, frames + 1):
        moved = rest.copy()
        moved[1] += rng.normal(size=3) * 20  # the root travels
        translations.Set(Vt.Vec3fArray.FromNumpy(moved.astype(np.float32)), t)
        quats = Rotation.random(3, rng=rng).as_quat().astype(np.float32)
        rotations.Set(Vt.QuatfArray.FromNumpy(quats), t)
    UsdSkel.BindingAPI.Apply(root.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    mesh = UsdGeom.Mesh.Define(stage, "/World/Body/Skin")
    points = rng.normal(size=(8, 3)) * 25
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr([4, 3, 5])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3, 3, 4, 5, 0, 5, 6, 7, 1])
    mesh.CreateOrientationAttr("leftHanded")
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateJointsAttr(["A/B/C", "A", "A/E"])
    binding.CreateGeomBindTransformAttr(
        Gf.Matrix4d(*compose(np.array([0.5, 0.5, 0.5, 0.5]), np.ones(3)).ravel())
    )
    weights = rng.random((8, 2)).astype(np.float32)
    weights /= weights.sum(axis=1, keepdims=True)
    binding.CreateJointIndicesPrimvar(False, 2).Set(
        Vt.IntArray.FromNumpy(rng.integers(0, 3, 16).astype(np.int32))
    )
    binding.CreateJointWeightsPrimvar(False, 2).Set(Vt.FloatArray.FromNumpy(weights.ravel()))
    hat = UsdGeom.Mesh.Define(stage, "/World/Body/Hat")  # carried by one joint as a whole
    hat.CreatePointsAttr([(0, 0, 1), (0, 1, 0), (1, 0, 0)])
    hat.CreateFaceVertexCountsAttr([3])
    hat.CreateFaceVertexIndicesAttr([0, 1, 2])
    carried = UsdSkel.BindingAPI.Apply(hat.GetPrim())
    carried.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    carried.CreateJointIndicesPrimvar(True, 1).Set([3])
    carried.CreateJointWeightsPrimvar(True, 1).Set([1.0])
    stage.GetRootLayer().Save()
    return stage


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"up": "Y", "unit": 0.01, "scale": 1.0},
        {"roots": True, "seed": 1},
        {"parent_moves": True, "seed": 2},
        {"scale": 2.0, "unit": 0.005, "seed": 3},
    ],
    ids=["armature", "centimetres", "two roots", "moving parent", "scaled up"],
)
def test_stages_of_others_are_seen_as_usdskel_sees_them(tmp_path, options):
    """Joints and skinned points are where usd-core puts them, in metres and Y up."""
    path = tmp_path / "other.usda"
    foreign_stage(path, **options)
    motion, shape = formats.load(path), formats.load_shape(path)
    assert len(motion) == 5
    assert motion.rate == 24
    times = range(1, 6)
    added = 1 if options.get("roots") else 0
    joints = peer_joints(path, times)
    size = np.abs(joints).max()
    np.testing.assert_allclose(motion.positions[:, added:], joints, atol=2e-6 * size)
    placed = shape.place(*motion.transforms)
    skin, hat = placed[:, :8], placed[:, 8:]
    peer = peer_surface(path, times)
    np.testing.assert_allclose(skin, peer[:, :8], atol=1e-5 * size)
    assert shape.triangles.shape == (1 + 2 + 3 + 1, 3)
    # a rigid mesh is baked into its transform
    assert hat.shape == (5, 3, 3)
    np.testing.assert_allclose(hat, peer[:, 8:], atol=1e-5 * size)
    rest = motion.skeleton.compute_transforms(np.tile(rot.IDENTITY, (len(motion.skeleton), 1)))
    assert np.isfinite(rest[0]).all()


def test_uneven_samples_are_read_at_the_frame_rate(tmp_path):
    """Samples at uneven times become frames at the stage's rate; a stage without samples is one frame."""
    path = tmp_path / "other.usda"
    stage = foreign_stage(path)
    animation = UsdSkel.Animation(stage.GetPrimAtPath("/World/Body/Rig/Walk"))
    for attribute in (animation.GetTranslationsAttr(), animation.GetRotationsAttr()):
        attribute.ClearAtTime(2)
    stage.GetRootLayer().Save()
    motion = formats.load(path)
    assert (len(motion), motion.rate) == (5, 24)
    np.testing.assert_allclose(motion.positions, peer_joints(path, range(1, 6)), atol=1e-5)
    for attribute in (animation.GetTranslationsAttr(), animation.GetRotationsAttr()):
        value = attribute.Get(3)
        attribute.Clear()
        attribute.Set(value)
    stage.GetRootLayer().Save()
    assert len(formats.load(path)) == 1


@pytest.mark.parametrize("what", ["nobody says whose animation it is", "no SkelRoot", "two skeletons"])
def test_an_animation_is_found_all_the_same(tmp_path, what):
    """One that is not bound, or outside a SkelRoot, or of the second skeleton, is found."""
    path = tmp_path / "other.usda"
    stage = foreign_stage(path)
    expected = peer_joints(path, range(1, 6))
    body, rig = stage.GetPrimAtPath("/World/Body"), stage.GetPrimAtPath("/World/Body/Rig")
    source = "skel:animationSource"
    if what == "two skeletons":
        still = UsdSkel.Skeleton.Define(stage, "/World/ARig")
        still.CreateJointsAttr(["X"])
        still.CreateRestTransformsAttr([Gf.Matrix4d(1)])
        still.CreateBindTransformsAttr([Gf.Matrix4d(1)])
        stage.GetPrimAtPath("/World").SetChildrenReorder(["ARig", "Body"])
    elif what == "no SkelRoot":
        UsdSkel.BindingAPI(rig).CreateAnimationSourceRel().SetTargets(
            body.GetRelationship(source).GetTargets()
        )
        body.SetTypeName("Xform")
    body.GetRelationship(source).SetTargets([] if what != "two skeletons" else ["/World/Body/Rig/Walk"])
    stage.GetRootLayer().Save()
    np.testing.assert_allclose(formats.load(path).positions, expected, atol=1e-5)


def test_a_skeleton_without_animation_is_its_rest_pose(tmp_path):
    """One frame, identity rotations but for the root."""
    path = tmp_path / "other.usda"
    stage = foreign_stage(path)
    stage.RemovePrim("/World/Body/Rig/Walk")
    stage.GetRootLayer().Save()
    motion = formats.load(path)
    assert len(motion) == 1
    assert angles(motion.rotations[0, 1:], np.tile(rot.IDENTITY, (4, 1))).max() < 1e-6
    np.testing.assert_allclose(motion.positions, peer_joints(path, [0]), atol=1e-5)


# --- bad input -----------------------------------------------------------------------------------


def test_without_usd_core_the_extra_is_named(tmp_path, monkeypatch):
    """Reading and writing say what to install, and nothing is written."""
    path = tmp_path / "take.usda"
    formats.save(make_motion(), path)
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(FormatError, match=r"sixpoint\[usd\]"):
        formats.load(path)
    with pytest.raises(FormatError, match=r"sixpoint\[usd\]"):
        formats.save(make_motion(), tmp_path / "new.usda")
    assert not (tmp_path / "new.usda").exists()


def damage(stage, what):
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath("/World/Body/Rig"))
    animation = UsdSkel.Animation(stage.GetPrimAtPath("/World/Body/Rig/Walk"))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/World/Body/Skin"))
    if what == "no skeleton":
        stage.RemovePrim("/World/Body/Rig")
    elif what == "no joints":
        skeleton.GetJointsAttr().Clear()
    elif what == "order":
        skeleton.GetJointsAttr().Set(["A/B", "A", "A/B/C", "A/B/C/D", "A/E"])
    elif what == "rest":
        skeleton.GetRestTransformsAttr().Set([Gf.Matrix4d(1)] * 3)
    elif what == "no poses":
        skeleton.GetRestTransformsAttr().Clear()
        skeleton.GetBindTransformsAttr().Clear()
    elif what == "mirror":
        skeleton.GetRestTransformsAttr().Set([Gf.Matrix4d().SetScale(Gf.Vec3d(1, -1, 1))] * 5)
    elif what == "squash":
        animation.GetScalesAttr().Set(Vt.Vec3hArray([Gf.Vec3h(1), Gf.Vec3h(1, 2, 1), Gf.Vec3h(1)]))
    elif what == "breathing":
        animation.GetScalesAttr().Set(Vt.Vec3hArray(3, Gf.Vec3h(1)), 1)
        animation.GetScalesAttr().Set(Vt.Vec3hArray(3, Gf.Vec3h(1.5)), 2)
    elif what == "short":
        animation.GetRotationsAttr().Set(Vt.QuatfArray(2, Gf.Quatf(1)), 2)
    elif what == "strangers":
        animation.GetJointsAttr().Set(["X", "Y", "Z"])
    elif what == "nan":
        animation.GetTranslationsAttr().Set(Vt.Vec3fArray(3, Gf.Vec3f(float("nan"))), 2)
    elif what == "face":
        mesh.GetFaceVertexIndicesAttr().Set([0, 1, 2, 3, 3, 4, 5, 0, 5, 6, 77, 1])
    elif what == "corners":
        mesh.GetFaceVertexCountsAttr().Set([4, 3])
    elif what == "joint":
        mesh.GetPrim().GetAttribute("primvars:skel:jointIndices").Set([9] * 16)
    elif what == "joint name":
        UsdSkel.BindingAPI(mesh.GetPrim()).GetJointsAttr().Set(["A/B/C", "A", "Nose"])
    elif what == "influences":
        mesh.GetPrim().GetAttribute("primvars:skel:jointWeights").Set([1.0] * 7)
    elif what == "squashed parent":
        UsdGeom.Xform(stage.GetPrimAtPath("/World")).GetOrderedXformOps()[-1].Set(Gf.Vec3f(1, 2, 1))


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("no skeleton", "no UsdSkel Skeleton in this stage; it holds: .*Mesh"),
        ("no joints", "/World/Body/Rig has no joints"),
        ("order", "parents before children"),
        ("rest", "5 joints, but 3 matrices in restTransforms"),
        ("no poses", "neither restTransforms nor bindTransforms"),
        ("mirror", "mirror"),
        ("squash", "joint 'A' is scaled"),
        ("breathing", "scaled over time"),
        ("short", "per joint at time 2"),
        ("strangers", "animates no joint"),
        ("nan", "not finite"),
        ("face", "point that does not exist"),
        ("corners", "faceVertexCounts"),
        ("joint", "bound to joint 9; there are 3"),
        ("joint name", "'Nose'"),
        ("influences", "do not fit"),
        ("squashed parent", "scaled unevenly"),
    ],
)
def test_a_damaged_stage_is_refused_with_the_prim(tmp_path, what, message):
    """Each missing or wrong piece is named, with where it is."""
    path = tmp_path / "other.usda"
    stage = foreign_stage(path, scale=1.0)
    damage(stage, what)
    stage.GetRootLayer().Save()
    del stage
    with pytest.raises(FormatError, match=message):
        formats.load(path)
        formats.load_shape(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "empty"),
        (b"HIERARCHY\nROOT Hips\n", "not a USD file"),
        (b"#usda 1.0\ndef Mesh {{{", "not a USD file"),
        (b"PXR-USDC" + bytes(100), "not a USD file"),
        (b"#usda 1.0\n", "no UsdSkel Skeleton in this stage; it holds: nothing"),
    ],
)
@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd"])
def test_what_is_no_stage_is_refused(tmp_path, suffix, content, message):
    """Empty, foreign and cut files, and stages without a skeleton, give one clear error."""
    path = tmp_path / f"take{suffix}"
    path.write_bytes(content)
    if suffix == ".usdc" and content.startswith(b"#usda 1.0\n") and message.startswith("no Usd"):
        message = "not a USD file|no UsdSkel"
    with pytest.raises(FormatError, match=message):
        formats.load(path)


@given(st.integers(0, 10_000), st.booleans())
@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_damage_of_a_text_file_goes_unsaid(tmp_path, seed, cut):
    """A text stage with bytes changed or cut off is read or refused, never anything else."""
    path = tmp_path / "take.usda"
    formats.save(
        make_motion(joints=8, frames=2), path, shape=random_shape(8, np.random.default_rng(0)), force=True
    )
    data, rng = bytearray(path.read_bytes()), np.random.default_rng(seed)
    if cut:
        data = data[: rng.integers(1, len(data))]
    else:
        for place in rng.integers(0, len(data), 4):
            data[place] = rng.integers(0, 256)
    damaged = tmp_path / f"damaged{seed}{cut}.usda"
    damaged.write_bytes(data)
    try:
        formats.load(damaged)
        formats.load_shape(damaged)
    except FormatError as error:
        assert len(str(error)) < 600


def test_wishes_that_usd_cannot_meet_are_refused(tmp_path):
    """Units and axes are written as they are here; a surface of other joints, or in a BVH, is refused."""
    motion = make_motion(joints=6)
    path = tmp_path / "take.usda"
    with pytest.raises(FormatError, match="metres, Y up"):
        formats.save(motion, path, unit="cm")
    with pytest.raises(FormatError, match="bound to 7 joints, the motion has 6"):
        formats.save(motion, path, shape=random_shape(7, np.random.default_rng(0)))
    with pytest.raises(FormatError, match="holds no surface"):
        formats.save(motion, tmp_path / "take.bvh", shape=random_shape(6, np.random.default_rng(0)))
    with pytest.raises(FormatError, match="no such file"):
        formats.load(path)
    assert not list(tmp_path.iterdir())
    formats.save(motion, path)
    with pytest.raises(FormatError, match="exists"):
        formats.save(motion, path)


def test_matrices_and_fans():
    """Similarities survive their matrices; a fan of a polygon with n corners has n - 2 triangles."""
    rng = np.random.default_rng(0)
    quats, places = Rotation.random(9, rng=rng).as_quat(), rng.normal(size=(9, 3))
    found = decompose(compose(quats, places))
    np.testing.assert_allclose(found.translations, places)
    assert angles(found.rotations, quats).max() < 1e-9
    assert decompose(np.diag([1.0, 1.0, -1.0, 1.0])[None]) is None
    assert decompose(np.zeros((1, 4, 4))) is None
    fans = triangulate(np.array([3, 2, 0, 4]), np.array([5, 6, 7, 0, 1, 10, 11, 12, 13]))
    np.testing.assert_array_equal(fans, [[5, 6, 7], [10, 11, 12], [10, 12, 13]])
