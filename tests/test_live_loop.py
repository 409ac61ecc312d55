"""The live loop over real sockets: every set is answered, and nothing that is sent can end it."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

import sixpoint as sp
from sixpoint.body.targets import EFFECTORS
from sixpoint.live import plain, vmc
from sixpoint.live.loop import Channel, LiveLoop, Output, replay
from sixpoint.live.readings import Packet, Reading
from sixpoint.live.record import Recording, RecordingWriter
from sixpoint.live.session import ALIVE, Session
from sixpoint.live.statistics import MOST_REASONS, Statistics
from sixpoint.live.vmc_write import PerformerWriter, write_devices

FIGURE = sp.Figure.from_stature(1.75)
WALK = sp.make_sample("walk", FIGURE)
TARGETS = FIGURE.targets(WALK)


def readings(frame: int, names: tuple[str, ...] = EFFECTORS) -> list[Reading]:
    """Trackers that are the joints themselves."""
    return [
        Reading("tracker", name, tuple(p), (0.0, 0.0, 0.0, 1.0))
        for name, p in zip(EFFECTORS, TARGETS.positions[frame].tolist(), strict=True)
        if name in names
    ]


def make_session(**options) -> Session:
    return Session(FIGURE, sp.SequentialIKPlus(FIGURE), **options)


@pytest.fixture
def served() -> Iterator[tuple[LiveLoop, socket.socket, socket.socket]]:
    """A running loop, a socket that sends to it and one that receives its VMC."""
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.bind(("127.0.0.1", 0))
    out.settimeout(2.0)
    writer = PerformerWriter(FIGURE)
    session = make_session()
    session.solver.warm_up()
    output = Output(out.getsockname(), lambda frame: writer.write_pose(frame.pose, frame.time))
    loop = LiveLoop([Channel(session, "vmc", 0, outputs=[output])])
    thread = threading.Thread(target=loop.run)
    thread.start()
    send = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    send.connect(("127.0.0.1", loop.channels[0].port))
    yield loop, send, out
    loop.stop()
    thread.join(5)
    assert not thread.is_alive()
    loop.close()
    send.close()
    out.close()


def receive_pose(out: socket.socket) -> dict[str, Reading]:
    """Bones of one frame."""
    bones: dict[str, Reading] = {}
    while "RightFoot" not in bones or "LeftHand" not in bones:
        for reading in vmc.read_packet(out.recv(2000)).readings:
            if reading.kind == "bone":
                bones[reading.name] = reading
    return bones


def test_a_set_that_was_sent_is_answered_with_its_pose(served):
    """The hips that come back are where the set had them, for set after set; the timer poses in between."""
    loop, send, out = served
    for frame in range(0, 60, 2):
        time.sleep(1 / 30)  # two frames: faster would be a jump
        send.send(write_devices(readings(frame))[0])
        for _ in range(30):
            hips = np.array(receive_pose(out)["Hips"].position)
            if np.allclose(hips, TARGETS.positions[frame, 0], atol=0.005):
                break
        else:
            pytest.fail(f"frame {frame} was not answered")
    assert loop.channels[0].statistics.poses >= 30
    assert loop.channels[0].statistics.dropped == 0


def test_nothing_that_is_sent_ends_the_loop(served):
    """Noise, truncated, huge, mistyped and NaN packets are counted; the next good set is answered."""
    loop, send, out = served
    rng = np.random.default_rng(0)
    good = write_devices(readings(0))[0]
    for k in range(2000):
        kind = k % 5
        if kind == 0:
            data = rng.bytes(int(rng.integers(0, 200)))
        elif kind == 1:
            data = good[: int(rng.integers(0, len(good)))]
        elif kind == 2:
            data = bytes(b ^ int(rng.random() < 0.02) * int(rng.integers(256)) for b in good)
        elif kind == 3:
            data = write_devices([Reading("tracker", "head", (np.nan,) * 3, (np.nan,) * 4)])[0]
        else:
            data = rng.bytes(9000)
        send.send(data)
        if k % 100 == 0:
            time.sleep(0.002)
    time.sleep(ALIVE + 0.1)
    out.setblocking(False)
    try:
        while True:
            out.recv(2000)
    except BlockingIOError:
        out.settimeout(2.0)
    send.send(good)
    bones = receive_pose(out)
    assert np.isfinite([*bones["Hips"].position, *bones["Hips"].rotation]).all()
    assert loop.channels[0].statistics.dropped > 100
    assert len(loop.channels[0].statistics.counts) <= MOST_REASONS + 6


def test_a_second_sender_is_refused_while_the_first_is_heard(served):
    """Two senders at once do not mix; the first has the channel until it falls silent."""
    loop, send, _ = served
    channel = loop.channels[0]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.connect(("127.0.0.1", channel.port))
        while channel.sender is None:
            send.send(write_devices(readings(0))[0])
            time.sleep(0.02)
        for frame in range(5):
            send.send(write_devices(readings(frame))[0])
            other.send(write_devices(readings(90))[0])
            time.sleep(0.02)
    assert channel.statistics.counts["packets of a second sender"] >= 3
    last = channel.session.last
    assert last is not None and np.linalg.norm(last.tracked.positions[0] - TARGETS.positions[4, 0]) < 0.1


def test_a_receiver_that_is_gone_does_no_harm():
    """Datagrams nobody takes are counted or lost; poses go on."""
    gone = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    gone.bind(("127.0.0.1", 0))
    address = gone.getsockname()
    gone.close()
    channel = Channel(make_session(), "plain", 0, outputs=[Output(address, lambda frame: [b"x"] * 3)])
    loop = LiveLoop([channel])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as send:
        send.connect(("127.0.0.1", channel.port))
        thread = threading.Thread(target=loop.run, kwargs={"duration": 0.5})
        thread.start()
        for frame in range(10):
            send.send(plain.write_packet(readings(frame)))
            time.sleep(0.02)
        thread.join(5)
    loop.close()
    assert channel.statistics.poses >= 10


def test_a_port_in_use_is_said():
    """The message names the port and what would help."""
    first = LiveLoop([Channel(make_session(), "vmc", 0)])
    with pytest.raises(sp.SixpointError, match=rf"{first.channels[0].port}.*another"):
        LiveLoop([Channel(make_session(), "vmc", first.channels[0].port)])
    first.close()
    with pytest.raises(sp.SixpointError, match="protocol"):
        LiveLoop([Channel(make_session(), "morse", 0)])
    with pytest.raises(sp.SixpointError, match="1 to 1000"):
        LiveLoop([], rate=0)


def test_a_recorded_session_replays_exactly(tmp_path):
    """From the file the same poses come, bit by bit, damaged datagrams and all."""
    path = tmp_path / "take.jsonl"
    channel = Channel(make_session(), "plain", 0)
    posed = []
    with RecordingWriter(path) as recorder:
        loop = LiveLoop([channel], recorder=recorder, watch=lambda _, frame: posed.append(frame))
        for frame in range(30):
            data = b"{" if frame == 7 else plain.write_packet(readings(frame))
            if loop._take(channel, data, ("127.0.0.1", 5), 0.01 * frame):
                posed.append(channel.session.solve(0.01 * frame))
        loop.close()
    again = replay(list(Recording(path)), make_session())
    assert len(again) == len(posed) == 29
    for a, b in zip(again, posed, strict=True):
        np.testing.assert_array_equal(a.pose.rotations, b.pose.rotations)


def test_a_set_is_complete_when_all_that_are_alive_have_sent():
    """One datagram per tracker: the last one completes; who falls silent is not waited for."""
    session = make_session()
    for k, reading in enumerate(readings(0)):
        complete = session.receive(Packet((reading,)), 0.001 * k)
    assert complete
    session.solve(0.006)
    for k, reading in enumerate(readings(1)[:-1]):
        assert not session.receive(Packet((reading,)), 0.02 + 0.001 * k)
    assert session.receive(Packet((readings(1)[5],)), 0.03)
    session.solve(0.03)
    for k, reading in enumerate(readings(2)[:-1]):
        late = session.receive(Packet((reading,)), 0.04 + ALIVE + 0.001 * k)
    assert late


def test_pausing_recentring_and_beginning_anew_leave_nothing_stale():
    """Paused the pose stands; after beginning anew the pose is that of a new session."""
    session, fresh = make_session(), make_session()
    for frame in range(20):
        session.receive(Packet(tuple(readings(frame))), frame / 60)
        session.solve(frame / 60)
    session.paused = True
    held = session.last
    session.receive(Packet(tuple(readings(40))), 0.5)
    assert session.solve(0.5) is held
    session.paused = False
    session.forget()
    for s, start in ((session, 100.0), (fresh, 100.0)):
        s.receive(Packet(tuple(readings(60))), start)
        pose = s.solve(start).pose
        np.testing.assert_array_equal(pose.rotations, s.last.pose.rotations)
    np.testing.assert_array_equal(session.last.pose.rotations, fresh.last.pose.rotations)
    session.recentre()
    moved = [
        Reading("tracker", r.name, (r.position[0] + 5.0, *r.position[1:]), r.rotation) for r in readings(60)
    ]
    for k in range(60):
        session.receive(Packet(tuple(moved)), 100.1 + k / 60)
        session.solve(100.1 + k / 60)
    assert session.last.tracked.positions[0, 0] == pytest.approx(TARGETS.positions[60, 0, 0] + 5.0, abs=0.01)


def test_roles_that_do_not_exist_are_refused():
    """A wrong role and one given twice are errors; an unknown serial is counted."""
    with pytest.raises(sp.SixpointError, match="nose"):
        make_session(roles={"LHR-1": "nose"})
    with pytest.raises(sp.SixpointError, match="two trackers"):
        make_session(roles={"LHR-1": "head", "LHR-2": "head"})
    session = make_session(roles={"LHR-1": "head"})
    session.receive(
        Packet((Reading("tracker", "LHR-9", (0, 0, 0)), Reading("tracker", "LHR-1", (0, 1.6, 0)))), 0
    )
    assert session.counts["readings without a role"] == 1 and "LHR-9" in session.seen


def test_memory_does_not_grow_with_names():
    """A flood of new names is counted, not kept."""
    session = make_session()
    for k in range(2000):
        session.receive(
            Packet((Reading("tracker", f"T{k}", (0, 0, 0)), Reading("blend", f"B{k}"))), 0.001 * k
        )
    assert len(session.seen) <= 256 and len(session._passed) <= 256
    assert session.counts["names beyond the first 256"] > 3000


def test_statistics_are_those_of_the_window():
    """Rate and percentiles of the last poses."""
    s = Statistics()
    assert np.isnan(s.percentile("latency", 99)) and s.rate == 0.0
    for k in range(3000):
        s.posed(k / 90, 0.001, 0.002 if k % 2 else None)
        s.drop(f"reason {k}")
    assert s.rate == pytest.approx(90) and s.percentile("latency", 99) == pytest.approx(0.002)
    assert len(s.counts) <= MOST_REASONS + 1 and s.dropped == 3000
    assert "90.0 poses/s" in s.line()
