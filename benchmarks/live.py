"""Is the live loop fast and does it last? Over loopback sockets, each part a process of its own.

    python benchmarks/live.py [--seconds 60] [--avatars 10]

1. ``sixpoint live`` gets six trackers at 90 Hz from one process; another receives its VMC. Latency: from the
   last tracker packet of a set to the complete pose; every set must be answered.
2. Ten avatars in one process at 90 Hz each: poses solved against sets sent.
3. 324,000 frames (an hour at 90 Hz) and 100,000 malformed packets through a session, as fast as possible:
   memory before and after, and whether the last pose is right.
"""

from __future__ import annotations

import argparse
import multiprocessing as mp
import resource
import socket
import sys
import threading
import time
from multiprocessing.connection import Connection

import numpy as np

import sixpoint as sp
from sixpoint.errors import PacketError
from sixpoint.jobs.live import Live
from sixpoint.live import vmc
from sixpoint.live.loop import Channel, LiveLoop, Output
from sixpoint.live.readings import Reading
from sixpoint.live.session import Session
from sixpoint.live.vmc_write import PerformerWriter, write_devices

RATE = 90.0
LAST = b"/VMC/Ext/Bone/Pos\x00\x00\x00,sfffffff"


def make_sets() -> list[bytes]:
    """A walk as datagrams of six trackers."""
    figure = sp.Figure.from_stature(1.75)
    targets = figure.targets(sp.make_sample("walk", figure))
    return [
        write_devices(
            [
                Reading("tracker", name, tuple(p), (0.0, 0.0, 0.0, 1.0))
                for name, p in zip(sp.EFFECTORS, frame.tolist(), strict=True)
            ]
        )[0]
        for frame in targets.positions
    ]


def send(ports: list[int], seconds: float, sent: Connection) -> None:
    """Send a set to each port at 90 Hz; report when each was sent."""
    sets, out = make_sets(), socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    times, start = [], time.perf_counter() + 0.2
    for k in range(int(seconds * RATE)):
        wait = start + k / RATE - time.perf_counter()
        if wait > 0:
            time.sleep(wait)
        for port in ports:
            out.sendto(sets[k % len(sets)], ("127.0.0.1", port))
        times.append(time.perf_counter())
    sent.send(times)


def receive(port: Connection, seconds: float, got: Connection, bones: int) -> None:
    """Note when each pose was complete: when all its bones have arrived."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
    sock.bind(("127.0.0.1", 0))
    sock.settimeout(0.5)
    port.send(sock.getsockname()[1])
    times, here, end = [], 0, time.perf_counter() + seconds
    while time.perf_counter() < end:
        try:
            data = sock.recv(4096)
        except TimeoutError:
            continue
        here += data.count(LAST)
        if here >= bones:
            times.append(time.perf_counter())
            here = 0
    got.send(times)


def measure_latency(seconds: float) -> None:
    """Part 1."""
    figure = sp.Figure.from_stature(1.75)
    bones = len(PerformerWriter(figure).bones)
    port, port_end = mp.Pipe()
    got, got_end = mp.Pipe()
    sent, sent_end = mp.Pipe()
    receiver = mp.Process(target=receive, args=(port_end, seconds + 4.0, got_end, bones))
    receiver.start()
    loop = Live(port=0, vmc_out=(("127.0.0.1", port.recv()),)).make_loop()
    thread = threading.Thread(target=loop.run)
    thread.start()
    sender = mp.Process(target=send, args=([loop.channels[0].port], seconds, sent_end))
    sender.start()
    sends, arrivals = np.array(sent.recv()), np.array(got.recv())
    loop.stop()
    thread.join()
    loop.close()
    after = np.searchsorted(arrivals, sends)
    answered = after < len(arrivals)
    latency = 1e3 * (arrivals[after[answered]] - sends[answered])
    once = len(np.unique(after[answered]))
    print(
        f"{len(sends)} sets in {seconds:g} s: {once} answered by a pose of their own; latency median "
        f"{np.median(latency):.2f} ms, p99 {np.percentile(latency, 99):.2f} ms, worst {latency.max():.1f} ms"
    )
    print(loop.channels[0].statistics.line(), dict(loop.channels[0].statistics.counts))


def measure_avatars(count: int, seconds: float) -> None:
    """Part 2."""
    figure = sp.Figure.from_stature(1.75)
    writer = PerformerWriter(figure)
    drain = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    drain.bind(("127.0.0.1", 0))
    channels = []
    for _ in range(count):
        solver = sp.SequentialIKPlus(figure)
        solver.warm_up()
        output = Output(drain.getsockname(), lambda frame: writer.write_pose(frame.pose, 0.0))
        channels.append(Channel(Session(figure, solver), "vmc", 0, outputs=[output]))
    loop = LiveLoop(channels)
    thread = threading.Thread(target=loop.run)
    thread.start()
    sent, sent_end = mp.Pipe()
    start = time.process_time()
    sender = mp.Process(target=send, args=([c.port for c in channels], seconds, sent_end))
    sender.start()
    sets = len(sent.recv())
    time.sleep(0.1)
    loop.stop()
    thread.join()
    busy = (time.process_time() - start) / seconds
    loop.close()
    poses = [c.statistics.poses for c in channels]
    late = max(1e3 * c.statistics.percentile("latency", 99) for c in channels)
    print(
        f"{count} avatars: {min(poses)} to {max(poses)} poses for {sets} sets each; latency p99 {late:.2f} "
        f"ms at most; {100 * busy:.0f} % of a core"
    )


def measure_endurance(frames: int, damaged: int) -> None:
    """Part 3."""
    figure = sp.Figure.from_stature(1.75)
    session = Session(figure, sp.SequentialIKPlus(figure))
    sets, rng = make_sets(), np.random.default_rng(0)
    writer = PerformerWriter(figure)

    def serve(k: int, data: bytes) -> None:
        if session.receive(vmc.read_packet(data), k / RATE):
            writer.write_pose(session.solve(k / RATE).pose, 0.0)

    for k in range(2000):
        serve(k, sets[k % len(sets)])
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.perf_counter()
    for k in range(2000, frames):
        serve(k, sets[k % len(sets)])
    speed = (frames - 2000) / (time.perf_counter() - start)
    dropped = 0
    for k in range(damaged):
        data = bytearray(sets[k % len(sets)])
        for _ in range(1 + k % 4):
            data[int(rng.integers(len(data)))] = int(rng.integers(256))
        try:
            if session.receive(
                vmc.read_packet(bytes(data[: int(rng.integers(1, len(data)))])), frames / RATE
            ):
                session.solve(frames / RATE + k * 1e-4)
        except PacketError:
            dropped += 1
    for k in range(200):
        serve(frames + 2000 + k, sets[7])
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    assert session.last is not None
    goal = figure.targets(sp.make_sample("walk", figure)).positions[7]
    off = 1e3 * np.abs(session.last.tracked.positions - goal).max()
    print(
        f"{frames} frames at {speed:.0f} a second, {damaged} malformed packets ({dropped} dropped whole): "
        f"memory grew by {grown:.1f} MB, the last points are {off:.2f} mm off"
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--avatars", type=int, default=10)
    parser.add_argument("--frames", type=int, default=324_000)
    parser.add_argument("--damaged", type=int, default=100_000)
    options = parser.parse_args()
    measure_latency(options.seconds)
    measure_avatars(options.avatars, min(options.seconds, 20.0))
    measure_endurance(options.frames, options.damaged)


if __name__ == "__main__":
    sys.exit(main())
