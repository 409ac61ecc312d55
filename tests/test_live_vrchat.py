"""VRChat's trackers: Unity's Euler angles and space, against SciPy and python-osc."""

from __future__ import annotations

import contextlib
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pythonosc.osc_packet import OscPacket
from scipy.spatial.transform import Rotation

import sixpoint as sp
from live_peers import peer_bundle, peer_message, turned_pose
from sixpoint.errors import OscError, TargetError
from sixpoint.live import vrchat
from sixpoint.live.osc import make_message
from sixpoint.live.osc_write import encode
from sixpoint.live.readings import LOST, NO_ROTATION, Reading
from sixpoint.live.unity import from_unity_euler, to_unity_euler

X, Y, Z = np.eye(3)
MIRROR = np.diag([-1.0, 1.0, 1.0])
BUILT_IN = sp.Figure.from_stature(1.75)


def unity_matrix(degrees):
    """Unity's Quaternion.Euler as a matrix on Unity's coordinates: about z first, then x, then y."""
    x, y, z = np.radians(degrees)
    about_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    about_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    about_z = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    return about_y @ about_x @ about_z


def peer_trackers(datagrams):
    """Address without prefix -> three numbers, read by python-osc."""
    messages = [m.message for data in datagrams for m in OscPacket(data).messages]
    return {m.address.removeprefix("/tracking/trackers/"): np.array(m.params) for m in messages}


@given(st.tuples(*[st.floats(-180, 180)] * 3))
def test_euler_angles_are_unitys(degrees):
    """Angles -> rotation is Unity's order seen in the mirror, and the way back gives the same rotation."""
    ours = Rotation.from_quat(from_unity_euler(degrees)).as_matrix()
    np.testing.assert_allclose(ours, MIRROR @ unity_matrix(degrees) @ MIRROR, atol=1e-9)
    again = from_unity_euler(to_unity_euler(from_unity_euler(degrees)))
    np.testing.assert_allclose(Rotation.from_quat(again).as_matrix(), ours, atol=1e-6)


@pytest.mark.parametrize(
    ("degrees", "axis", "direction"),
    [
        ((0, 90, 0), Z, -X),  # Unity's +90 about Y faces right, which is our -X
        ((90, 0, 0), Z, -Y),  # pitch: +90 about X faces down
        ((0, 0, 90), Y, X),  # roll: +90 about Z tips up to the left, Unity's -X
        ((90, 90, 0), Z, -Y),  # x before y: down stays down
        ((0, 90, 90), Y, Z),  # z before y: up tips left, then turns right to the front
    ],
)
def test_known_angles(degrees, axis, direction):
    """Single angles and the order of two, in directions that anyone can check with the left hand."""
    np.testing.assert_allclose(
        Rotation.from_quat(from_unity_euler(degrees)).apply(axis), direction, atol=1e-9
    )


def test_trackers_are_read_from_the_peer():
    """Position and rotation of python-osc are joined; what is said of one alone leaves the other open."""
    data = peer_bundle(
        ("/tracking/trackers/1/position", [0.25, 1.0, 0.5]),
        ("/tracking/trackers/1/rotation", [0.0, 90.0, 0.0]),
        ("/tracking/trackers/head/position", [0.0, 1.5, 0.0]),
    )
    hip, head = vrchat.read_packet(data).readings
    assert (hip.kind, hip.name, hip.position) == ("tracker", "1", (-0.25, 1.0, 0.5))
    np.testing.assert_allclose(Rotation.from_quat(hip.rotation).apply(Z), -X, atol=1e-7)
    assert (head.kind, head.name, head.position, head.rotation) == ("hmd", "head", (0.0, 1.5, 0.0), None)
    (turn,) = vrchat.read_packet(
        peer_message("/tracking/trackers/8/rotation", [0.0, 0.0, 0.0]).dgram
    ).readings
    assert turn.position is None and not turn.lost


def test_what_vrchat_says_itself():
    """Headset and controllers of the game play head and wrists."""
    data = peer_bundle(("/tracking/vrsystem/leftwrist/pose", [-0.5, 1.0, 0.25, 0.0, -90.0, 0.0]))
    (wrist,) = vrchat.read_packet(data).readings
    assert (wrist.kind, wrist.name, wrist.position) == ("controller", "l_wrist", (0.5, 1.0, 0.25))
    np.testing.assert_allclose(Rotation.from_quat(wrist.rotation).apply(Z), X, atol=1e-7)


def test_a_pose_is_sent_as_trackers():
    """The figure's joints, mirrored; turned 90 degrees to its left, every tracker says -90 about Y."""
    pose = turned_pose(BUILT_IN, {"pelvis": (Y, 90)})
    (data,) = vrchat.TrackerWriter(BUILT_IN).write_pose(pose)
    assert len(data) < 1400
    found = peer_trackers([data])
    assert len(found) == 18
    positions, _ = pose.compute_transforms()
    roles = BUILT_IN.roles.named()
    for k, name in enumerate(vrchat.TRACKERS, start=1):
        np.testing.assert_allclose(found[f"{k}/rotation"], [0, -90, 0], atol=1e-4)
        if name != "chest":
            np.testing.assert_allclose(found[f"{k}/position"], positions[roles[name]] * [-1, 1, 1], atol=1e-6)
    assert found["2/position"][2] < found["1/position"][2] < found["3/position"][2]  # left foot is behind now
    np.testing.assert_allclose(found["head/rotation"], [0, -90, 0], atol=1e-4)
    np.testing.assert_allclose(found["head/position"], positions[roles["head"]] * [-1, 1, 1], atol=1e-6)


def test_a_bent_knee_and_a_nod():
    """A thigh raised by 90 degrees turns its tracker by -90 about Unity's X; a nod of 30 is +30."""
    pose = turned_pose(BUILT_IN, {"l_hip": (X, -90), "l_knee": (X, 60), "head": (X, 30)})
    found = peer_trackers(vrchat.TrackerWriter(BUILT_IN, scale=2.0).write_pose(pose))
    np.testing.assert_allclose(found["4/rotation"], [-30, 0, 0], atol=1e-4)
    np.testing.assert_allclose(found["head/rotation"], [30, 0, 0], atol=1e-4)
    knee = BUILT_IN.offset_between(BUILT_IN.roles.hip[0], BUILT_IN.roles.knee[0])
    hip = pose.compute_transforms()[0][BUILT_IN.roles.hip[0]]
    np.testing.assert_allclose(found["4/position"], 2 * (hip + [0, 0, -knee[1]]) * [-1, 1, 1], atol=1e-5)


def test_fewer_trackers_keep_their_numbers():
    """The numbers say what they are on; unknown names are listed."""
    pose = BUILT_IN.neutral_pose
    found = peer_trackers(vrchat.TrackerWriter(BUILT_IN, ("pelvis", "r_elbow")).write_pose(pose))
    assert {address.split("/")[0] for address in found} == {"1", "8", "head"}
    with pytest.raises(TargetError, match="no trackers tail; trackers: pelvis"):
        vrchat.TrackerWriter(BUILT_IN, ("tail",))


def test_what_is_written_is_read():
    """Readings survive the way out and in; what is lost is not sent."""
    sent = [
        Reading("tracker", "3", (0.5, 1.0, 2.0), (0.5, 0.5, 0.5, 0.5)),
        Reading("hmd", "head", (0.0, 1.5, 0.0), (0.0, 0.0, 0.0, 1.0)),
        Reading("tracker", "4", LOST, NO_ROTATION),
        Reading("tracker", "elsewhere", (0.0, 0.0, 0.0)),
    ]
    (data,) = vrchat.write_trackers(sent)
    found = vrchat.read_packet(data).readings
    assert [r.name for r in found] == ["3", "head"]
    for a, b in zip(sent, found, strict=False):
        np.testing.assert_allclose(b.position, a.position)
        assert (Rotation.from_quat(b.rotation) * Rotation.from_quat(a.rotation).inv()).magnitude() < 1e-6


@pytest.mark.parametrize(
    ("address", "args", "text"),
    [
        ("/tracking/trackers/9/position", (0.0, 0.0, 0.0), "position or rotation of 1, 2"),
        ("/tracking/trackers/1/scale", (0.0, 0.0, 0.0), "position or rotation"),
        ("/tracking/trackers/1/position", (0.0, 0.0), "expected 3"),
        ("/tracking/trackers/1/rotation", ("x", 0.0, 0.0), "expected 3 numbers"),
    ],
)
def test_a_damaged_message_is_refused(address, args, text):
    """One line says what was expected."""
    packet = vrchat.read_packet(encode(make_message(address, *args)))
    assert packet.readings == () and text in packet.refused[0]


def test_not_finite_is_lost():
    """NaN positions are lost, NaN or endless angles are no rotation; other addresses are counted."""
    (reading,) = vrchat.read_packet(
        encode(make_message("/tracking/trackers/1/position", math.nan, 0.0, 0.0))
    ).readings
    assert reading.lost
    for bad in (math.nan, math.inf, 1e30):
        (reading,) = vrchat.read_packet(
            encode(make_message("/tracking/trackers/1/rotation", bad, 0.0, 0.0))
        ).readings
        assert np.isnan(reading.rotation).all()
    assert vrchat.read_packet(encode(make_message("/avatar/change", "x"))).unused == 1


@given(st.binary(max_size=120))
def test_arbitrary_bytes_raise_only_what_they_may(data):
    """VRChat adds no errors of its own to those of OSC."""
    with contextlib.suppress(OscError):
        vrchat.read_packet(data)
