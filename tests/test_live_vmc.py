"""VMC: what we read and write, against python-osc and against poses worked out in Unity's space."""

from __future__ import annotations

import contextlib
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pythonosc.osc_packet import OscPacket
from scipy.spatial.transform import Rotation

import sixpoint as sp
from body_rigs import load, real_rigs
from live_peers import peer_bundle, turned_pose
from sixpoint.body import rotations as rot
from sixpoint.errors import OscError
from sixpoint.live import osc, vmc
from sixpoint.live.osc import Bundle, make_message
from sixpoint.live.osc_write import encode
from sixpoint.live.readings import LOST, NO_ROTATION, Reading
from sixpoint.live.unity import mirror_position, mirror_rotation
from sixpoint.body.human_bones import HUMAN_BONES, find_bones
from sixpoint.live.vmc_write import PerformerWriter, write_devices

RIGS = [pytest.param(p, id=p.name) for p in real_rigs()] or [
    pytest.param(None, marks=pytest.mark.skip(reason="no recordings in $SIXPOINT_DATA or ../shared/data"))
]
X, Y, Z = np.eye(3)
BUILT_IN = sp.Figure.from_stature(1.75)
POSE = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def figure():
    return BUILT_IN


def bones_by_peer(datagrams):
    """Name -> (7,) numbers of the bones, read by python-osc."""
    messages = [m.message for data in datagrams for m in OscPacket(data).messages]
    return {m.params[0]: np.array(m.params[1:]) for m in messages if m.address == "/VMC/Ext/Bone/Pos"}


def unity_turns(datagrams):
    """Name -> Unity's local rotation of the bones, read by python-osc."""
    return {name: Rotation.from_quat(values[3:]) for name, values in bones_by_peer(datagrams).items()}


def quarter(axis, degrees=90.0):
    """A rotation about an axis; in Unity's space the same numbers as in ours, seen with the left hand."""
    return Rotation.from_rotvec(np.radians(degrees) * np.asarray(axis, float))


def assert_turn(found, expected):
    assert (found * expected.inv()).magnitude() < 1e-5, (found.as_quat(), expected.as_quat())


# --- known poses ---------------------------------------------------------------------------------------


def test_names_are_unitys():
    """There are 55, each once, and what we send is among them."""
    assert len(HUMAN_BONES) == len(set(HUMAN_BONES)) == 55
    assert set(find_bones(sp.Figure.from_stature(1.75), upper_chest=True)) <= set(HUMAN_BONES)


def test_t_pose_is_the_identity(figure):
    """Arms lifted sideways to the horizontal, palms down: every bone has the identity, as in a VRM avatar."""
    pose = turned_pose(figure, {"l_shoulder": (Z, 90), "r_shoulder": (Z, -90)})
    for turn in unity_turns(PerformerWriter(figure).write_pose(pose, 0.0)).values():
        assert turn.magnitude() < 1e-6


def test_hanging_arms(figure):
    """The neutral pose turns upper arms by 90 degrees about Unity's Z, the right one by -90; no more."""
    turns = unity_turns(PerformerWriter(figure).write_pose(figure.neutral_pose, 0.0))
    assert_turn(turns.pop("LeftUpperArm"), quarter(Z))
    assert_turn(turns.pop("RightUpperArm"), quarter(-Z))
    assert max(turn.magnitude() for turn in turns.values()) < 1e-6


def test_turned_to_the_left(figure):
    """A quarter turn to the figure's left is -90 degrees about Unity's Y, of the hips alone."""
    pose = turned_pose(figure, {"pelvis": (Y, 90), "l_shoulder": (Z, 90), "r_shoulder": (Z, -90)})
    turns = unity_turns(PerformerWriter(figure).write_pose(pose, 0.0))
    assert_turn(turns.pop("Hips"), quarter(Y, -90))
    assert max(turn.magnitude() for turn in turns.values()) < 1e-6


def test_left_arm_raised_forward(figure):
    """From the T-pose the left arm comes forward by +90 degrees about Unity's Y: from -X to +Z."""
    # Ours: swung up to the T-pose, then forward, which is -90 degrees about Y from +X to +Z.
    turn = Rotation.from_rotvec([0, -math.pi / 2, 0]) * Rotation.from_rotvec([0, 0, math.pi / 2])
    pose = turned_pose(figure, {"l_shoulder": turn})
    found = unity_turns(PerformerWriter(figure).write_pose(pose, 0.0))["LeftUpperArm"]
    assert_turn(found, quarter(Y))
    np.testing.assert_allclose(found.apply([-1, 0, 0]), [0, 0, 1], atol=1e-6)


def test_elbow_knee_and_head(figure):
    """A bent elbow turns the forearm about Unity's Y, a bent knee and a nod turn about X."""
    pose = turned_pose(figure, {"r_elbow": (X, -90), "l_knee": (X, 60), "head": (X, 30)})
    turns = unity_turns(PerformerWriter(figure).write_pose(pose, 0.0))
    assert_turn(turns["RightLowerArm"], quarter(Y, -90))  # from +X to +Z
    np.testing.assert_allclose(turns["RightLowerArm"].apply([1, 0, 0]), [0, 0, 1], atol=1e-6)
    assert_turn(turns["LeftLowerLeg"], quarter(X, 60))
    np.testing.assert_allclose(quarter(X, 60).apply([0, -1, 0])[2], -math.sin(math.radians(60)), atol=1e-9)
    assert_turn(turns["Head"], quarter(X, 30))


def test_hips_carry_the_place(figure):
    """One metre to the figure's left is -1 in Unity; ``scale`` makes the figure's metres the avatar's."""
    moved = figure.compute_motion(
        np.tile(rot.IDENTITY, (1, len(figure.skeleton), 1)), np.array([[1.0, 0.9, 0.5]]), 60.0
    ).pose(0)
    bones = bones_by_peer(PerformerWriter(figure, scale=2.0).write_pose(moved, 0.0))
    np.testing.assert_allclose(bones["Hips"][:3], [-2.0, 1.8, 1.0], atol=1e-6)
    upper = np.linalg.norm(figure.offset_between(figure.roles.shoulder[0], figure.roles.elbow[0]))
    np.testing.assert_allclose(bones["LeftLowerArm"][:3], [-2 * upper, 0, 0], atol=1e-6)
    packet = vmc.read_packet(PerformerWriter(figure).write_pose(moved, 0.0)[0])
    assert packet.readings[1].name == "Hips"
    np.testing.assert_allclose(packet.readings[1].position, [1.0, 0.9, 0.5], atol=1e-6)


def unity_world(datagrams, bones):
    """World positions and rotation matrices that Unity makes of our bundle, by its own forward kinematics."""
    local = bones_by_peer(datagrams)
    world = {"": (np.zeros(3), np.eye(3))}
    for name, bone in bones.items():
        place, turn = world[bone.parent]
        world[name] = (place + turn @ local[name][:3], turn @ Rotation.from_quat(local[name][3:]).as_matrix())
    return world


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_unity_stands_as_we_do(seed):
    """In any pose each bone's world rotation in Unity is the mirror image of the figure's."""
    figure = BUILT_IN
    random = np.random.default_rng(seed)
    turns = np.tile(rot.IDENTITY, (1, len(figure.skeleton), 1))
    posed = list(figure.roles.named().values())
    turns[:, posed] = rot.normalised(random.normal(size=(1, len(posed), 4)))
    pose = figure.compute_motion(turns, random.normal(size=(1, 3)), 60.0).pose(0)
    check_world(figure, pose)


def check_world(figure, pose):
    mirror = np.diag([-1.0, 1.0, 1.0])
    writer = PerformerWriter(figure)
    bones = find_bones(figure)
    positions, turned = pose.compute_transforms()
    world = unity_world(writer.write_pose(pose, 0.0), bones)
    t_pose = {0: Rotation.from_rotvec([0, 0, math.pi / 2]), 1: Rotation.from_rotvec([0, 0, -math.pi / 2])}
    for name, bone in bones.items():
        anatomical = (
            Rotation.from_quat(turned[bone.joint]) * Rotation.from_quat(figure.neutral[bone.joint]).inv()
        )
        if bone.arm is not None:
            anatomical = anatomical * t_pose[bone.arm].inv()
        np.testing.assert_allclose(world[name][1], mirror @ anatomical.as_matrix() @ mirror, atol=1e-5)
    hips = positions[figure.roles.pelvis]
    np.testing.assert_allclose(world["Hips"][0], mirror @ hips, atol=1e-5)
    for side, k in (("Left", 0), ("Right", 1)):  # legs have all their joints: places agree as well
        np.testing.assert_allclose(
            world[f"{side}LowerLeg"][0], mirror @ positions[figure.roles.knee[k]], atol=1e-5
        )


def test_straight_trunk_stands_at_the_same_place(figure):
    """With a straight trunk every bone is where the figure's joint is, mirrored."""
    pose = turned_pose(
        figure, {"pelvis": (Y, 40), "l_shoulder": (X, -70), "l_elbow": (X, -50), "r_hip": (Z, -30)}
    )
    positions, _ = pose.compute_transforms()
    bones = find_bones(figure)
    world = unity_world(PerformerWriter(figure).write_pose(pose, 0.0), bones)
    for name, bone in bones.items():
        np.testing.assert_allclose(
            world[name][0], positions[bone.origin] * [-1, 1, 1], atol=1e-5, err_msg=name
        )


@pytest.mark.parametrize("path", RIGS)
def test_other_rigs(path):
    """Every real rig, whatever its axes and vertebrae, comes out as the mirror image of its own posture."""
    motion = load(path)
    figure = sp.Figure.from_motion(motion)
    for frame in (0, len(motion) // 2):
        check_world(figure, motion.pose(frame))


# --- what is read --------------------------------------------------------------------------------------


def test_devices_are_read_from_the_peer():
    """Devices of python-osc come as ours: Unity's right is our negative X, and +90 about Y faces it."""
    half = math.sqrt(0.5)
    data = peer_bundle(
        ("/VMC/Ext/Hmd/Pos", ["HMD", 0.25, 1.75, 0.5, 0.0, half, 0.0, half]),
        ("/VMC/Ext/Con/Pos", ["left", *POSE]),
        ("/VMC/Ext/Tra/Pos/Local", ["LHR-1", *POSE]),
        ("/VMC/Ext/T", [12.5]),
        ("/VMC/Ext/OK", [1, 3, 0]),
    )
    packet = vmc.read_packet(data)
    assert [(r.kind, r.name, r.raw) for r in packet.readings] == [
        ("hmd", "HMD", False),
        ("controller", "left", False),
        ("tracker", "LHR-1", True),
    ]
    assert packet.readings[0].position == (-0.25, 1.75, 0.5)
    facing = Rotation.from_quat(packet.readings[0].rotation).apply(Z)
    np.testing.assert_allclose(facing, -X, atol=1e-6)
    assert (packet.time, packet.available, packet.unused, packet.refused) == (12.5, True, 0, ())


def test_the_peer_reads_what_we_send(figure):
    """Every address we send, with its types and in the order of arguments of the specification."""
    devices = [Reading(kind, kind, (0.5, 1.0, 2.0), (0.5, 0.5, 0.5, 0.5)) for kind in vmc.DEVICES.values()]
    devices.append(Reading("tracker", "own", (0.5, 1.0, 2.0), (0.0, 0.0, 0.0, 1.0), raw=True))
    passed = [
        Reading("bone", "Jaw", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)),
        Reading("blend", "Joy", value=0.5),
    ]
    thru = [make_message("/VMC/Thru/a/b", "x", 1)]
    frame = PerformerWriter(figure).write_pose(figure.neutral_pose, 1.5, passed=passed, thru=thru)
    found = {}
    for data in [*write_devices(devices, 2.5), *frame]:
        assert len(data) < 1400
        for timed in OscPacket(data).messages:
            found.setdefault(timed.message.address, []).append(timed.message.params)
    turned = [-0.5, 1.0, 2.0, 0.5, -0.5, -0.5, 0.5]
    assert found.pop("/VMC/Ext/Hmd/Pos") == [["hmd", *turned]]
    assert found.pop("/VMC/Ext/Con/Pos") == [["controller", *turned]]
    assert found.pop("/VMC/Ext/Tra/Pos") == [["tracker", *turned]]
    assert found.pop("/VMC/Ext/Tra/Pos/Local") == [["own", -0.5, 1.0, 2.0, 0.0, 0.0, 0.0, 1.0]]
    assert found.pop("/VMC/Ext/T") == [[2.5], [1.5]]
    assert found.pop("/VMC/Ext/OK") == [[1, 3, 0, 1]]
    assert found.pop("/VMC/Ext/Root/Pos") == [["root", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]
    assert [params[0] for params in found["/VMC/Ext/Bone/Pos"]] == [*find_bones(figure), "Jaw"]
    assert all([type(p) for p in params] == [str] + [float] * 7 for params in found.pop("/VMC/Ext/Bone/Pos"))
    assert found.pop("/VMC/Ext/Blend/Val") == [["Joy", 0.5]]
    assert found.pop("/VMC/Ext/Blend/Apply") == [[]]
    assert found.pop("/VMC/Thru/a/b") == [["x", 1]]
    assert not found


FLOATS = st.floats(-100, 100, width=32)


@given(
    st.tuples(FLOATS, FLOATS, FLOATS), st.tuples(FLOATS, FLOATS, FLOATS, FLOATS), st.sampled_from(HUMAN_BONES)
)
def test_fingers_and_faces_pass_through(position, turn, name):
    """What comes in goes out again bit by bit, except for the bones that the figure has itself."""
    if math.hypot(*turn) < 1e-3:
        turn = (0.0, 0.0, 0.0, 1.0)
    turn = tuple(float(np.float32(v)) for v in rot.normalised(turn))
    sent = Bundle(
        1,
        (
            make_message("/VMC/Ext/Bone/Pos", name, *position, *turn),
            make_message("/VMC/Ext/Blend/Val", "Fcl_ALL_Joy", position[0]),
            make_message("/VMC/Ext/Blend/Apply"),
        ),
    )
    packet = vmc.read_packet(encode(sent))
    figure = BUILT_IN
    writer = PerformerWriter(figure)
    own = messages_of(writer.write_pose(figure.neutral_pose, 0.0))
    found = messages_of(writer.write_pose(figure.neutral_pose, 0.0, passed=packet.readings))
    bone, *face = sent.elements
    assert found == [*own, *([] if name in writer.bones else [bone]), *face]


def messages_of(datagrams):
    return [m for data in datagrams for m in osc.messages_in(osc.decode(data))]


def test_a_device_in_both_scales_is_read_in_its_own():
    """Senders that say both would else move a tracker back and forth."""
    both = [make_message("/VMC/Ext/Tra/Pos" + end, "a", *POSE) for end in ("", "/Local")]
    other = make_message("/VMC/Ext/Tra/Pos", "b", *POSE)
    packet = vmc.read_packet(encode(Bundle(1, (*both, other))))
    assert [(r.name, r.raw) for r in packet.readings] == [("a", True), ("b", False)]
    assert packet.unused == 1


def test_what_is_not_finite_is_lost():
    """NaN, infinity and the far side of the earth are a lost tracker; a rotation without length is none."""
    nan, inf = math.nan, math.inf
    for bad in (nan, inf, -inf, 1e30):
        for k in range(3):
            values = list(POSE)
            values[k] = bad
            (reading,) = vmc.read_packet(encode(make_message("/VMC/Ext/Tra/Pos", "a", *values))).readings
            assert reading.lost and np.isnan(reading.position).all()
            assert reading.rotation == (0.0, 0.0, 0.0, 1.0)
    for turn in ((0.0, 0.0, 0.0, 0.0), (nan, 0.0, 0.0, 1.0), (inf, 0.0, 0.0, 1.0), (1e30, 0.0, 0.0, 0.0)):
        (reading,) = vmc.read_packet(encode(make_message("/VMC/Ext/Tra/Pos", "a", *POSE[:3], *turn))).readings
        assert np.isnan(reading.rotation).all() and not reading.lost
    (reading,) = vmc.read_packet(
        encode(make_message("/VMC/Ext/Tra/Pos", "a", *POSE[:3], 0.0, 0.0, 3.0, 4.0))
    ).readings
    np.testing.assert_allclose(reading.rotation, mirror_rotation((0.0, 0.0, 0.6, 0.8)))
    (again,) = vmc.read_packet(write_devices([Reading("tracker", "a", LOST, NO_ROTATION)])[0]).readings
    assert again.lost


REFUSED = {
    "too few": ("/VMC/Ext/Tra/Pos", ("a", 1.0, 2.0), "3 arguments, expected 8"),
    "a word": ("/VMC/Ext/Tra/Pos", ("a", *POSE[:6], "x"), "expected 7 numbers"),
    "true": ("/VMC/Ext/Tra/Pos", ("a", *POSE[:6], True), "expected 7 numbers"),
    "no name": ("/VMC/Ext/Tra/Pos", (1, *POSE), "expected a name"),
    "empty name": ("/VMC/Ext/Tra/Pos", ("", *POSE), "printable"),
    "long name": ("/VMC/Ext/Tra/Pos", ("a" * 65, *POSE), "1 to 64"),
    "terminal codes": ("/VMC/Ext/Tra/Pos", ("\x1b[2J", *POSE), "printable"),
    "unknown bone": ("/VMC/Ext/Bone/Pos", ("Tail", *POSE), "55 human bones"),
    "blend without value": ("/VMC/Ext/Blend/Val", ("Joy",), "expected 2"),
    "blend of NaN": ("/VMC/Ext/Blend/Val", ("Joy", math.nan), "not finite"),
    "time of a word": ("/VMC/Ext/T", ("now",), "expected 1 numbers"),
    "nothing": ("/VMC/Ext/OK", (), "expected 1"),
}


@pytest.mark.parametrize(("address", "args", "text"), REFUSED.values(), ids=REFUSED)
def test_a_damaged_message_is_dropped_alone(address, args, text):
    """The others of its bundle are read, and one line says what was wrong."""
    good = make_message("/VMC/Ext/Tra/Pos", "good", *POSE)
    packet = vmc.read_packet(encode(Bundle(1, (make_message(address, *args), good))))
    assert [r.name for r in packet.readings] == ["good"]
    assert len(packet.refused) == 1 and text in packet.refused[0] and packet.refused[0].startswith(address)


def test_surplus_and_unknown_are_ignored():
    """As the specification asks; integers pass for floats."""
    packet = vmc.read_packet(
        encode(
            Bundle(
                1,
                (
                    make_message("/VMC/Ext/Root/Pos", "root", *POSE, *[1.0] * 6),
                    make_message("/VMC/Ext/Cam", "Camera", *POSE, 90.0),
                    make_message("/VMC/Ext/Tra/Pos", "a", 0, 1, 0, 0, 0, 0, 1),
                    make_message("/VMC/Thru/x/y", "z"),
                ),
            )
        )
    )
    assert [r.kind for r in packet.readings] == ["root", "tracker"]
    assert packet.readings[1].position == (0, 1, 0)
    assert packet.unused == 1 and packet.thru == (make_message("/VMC/Thru/x/y", "z"),)


@given(st.binary(max_size=120))
def test_arbitrary_bytes_raise_only_what_they_may(data):
    """VMC adds no errors of its own to those of OSC."""
    with contextlib.suppress(OscError):
        vmc.read_packet(data)


def test_a_reading_keeps_what_a_later_one_does_not_say():
    """Position and rotation may come in two datagrams."""
    place = Reading("tracker", "1", position=(1.0, 2.0, 3.0))
    turn = Reading("tracker", "1", rotation=(0.0, 0.0, 0.0, 1.0))
    assert turn.after(place) == Reading("tracker", "1", (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))
    assert place.after(None) == place


@given(st.tuples(FLOATS, FLOATS, FLOATS), st.tuples(FLOATS, FLOATS, FLOATS))
def test_mirroring_is_a_mirror(v, w):
    """Mirrored rotation of a mirrored vector = mirrored rotated vector; twice is nothing."""
    q = Rotation.from_rotvec(w)
    turned = Rotation.from_quat(mirror_rotation(tuple(q.as_quat()))).apply(mirror_position(v))
    np.testing.assert_allclose(turned, mirror_position(q.apply(v)), atol=1e-9)
    assert mirror_position(mirror_position(v)) == v
    assert mirror_rotation(mirror_rotation((1.0, 2.0, 3.0, 4.0))) == (1.0, 2.0, 3.0, 4.0)
