"""The live loop: datagrams in, poses solved as soon as a set is complete, datagrams out.

One thread, one selector. All that waits on a socket is read at once; a set that is complete is solved and
sent, but where many wait the newest wins, so that no backlog builds up. A timer only fills gaps. Sending
never waits: what a full or closed receiver does not take is counted and gone. No packet ends the loop.
"""

from __future__ import annotations

import contextlib
import selectors
import socket
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from sixpoint.errors import PacketError, SixpointError
from sixpoint.live import plain, vmc, vrchat
from sixpoint.live.calibrating import Calibrating
from sixpoint.live.readings import Packet
from sixpoint.live.record import Datagram, RecordingWriter
from sixpoint.live.session import Frame, Session
from sixpoint.live.statistics import Statistics

PROTOCOLS: dict[str, Callable[[bytes], Packet]] = {
    "vmc": vmc.read_packet,
    "vrchat": vrchat.read_packet,
    "plain": plain.read_packet,
}
"""Protocol -> what reads one of its datagrams."""

DRAIN = 256  # datagrams read from a socket before poses are solved
BEHIND = 3  # sets that wait and are posed one by one; of more the newest counts
BIGGEST = 65_536  # bytes
ONE_SENDER = 1.0  # s, a second sender is refused while the first one was heard within this
GAP = 1.5  # frame times without a complete set after which the timer poses

Writer = Callable[[Frame], Sequence[bytes]]


@dataclass(eq=False)
class Output:
    """Where poses are sent.

    Attributes:
        address: Host and port.
        write: A frame -> its datagrams.
    """

    address: tuple[str, int]
    write: Writer


@dataclass(eq=False)
class Channel:
    """A session with its sockets.

    Attributes:
        session: Who is posed.
        protocol: A name of ``PROTOCOLS``.
        port: To listen on; 0 takes a free one, which is then here.
        host: Address to listen on.
        outputs: Where poses are sent.
        statistics: How it goes.
        calibrating: A calibration that is going on; it gets all that arrives.
    """

    session: Session
    protocol: str
    port: int
    host: str = "127.0.0.1"
    outputs: list[Output] = field(default_factory=list)
    statistics: Statistics = field(default_factory=Statistics)
    socket: socket.socket | None = None
    sender: tuple[str, int] | None = None
    heard: float = float("-inf")
    posed: float = float("-inf")
    calibrating: Calibrating | None = None


class LiveLoop:
    """Runs channels until told to stop.

    Args:
        channels: Sessions with their ports; ports are opened here.
        rate: Poses a second that the timer keeps up where packets do not [Hz].
        recorder: Every datagram is written to it, as it came.
        watch: Called with each channel and frame after it was sent, for a viewer; must return at once.

    Raises:
        SixpointError: A port is in use or may not be opened; the message says which, and what would help.
    """

    def __init__(
        self,
        channels: Sequence[Channel],
        *,
        rate: float = 90.0,
        recorder: RecordingWriter | None = None,
        watch: Callable[[Channel, Frame], None] | None = None,
    ) -> None:
        if not 1.0 <= rate <= 1000.0:
            raise SixpointError(f"the rate is 1 to 1000 Hz, got {rate}")
        self.channels, self.rate = list(channels), rate
        self.recorder, self.watch = recorder, watch
        self.running = False
        self._selector = selectors.DefaultSelector()
        self._out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._out.setblocking(False)
        try:
            for channel in self.channels:
                channel.socket = _listen(channel)
                self._selector.register(channel.socket, selectors.EVENT_READ, channel)
        except SixpointError:
            self.close()
            raise

    def close(self) -> None:
        """Close all sockets."""
        self.running = False
        self._selector.close()
        self._out.close()
        for channel in self.channels:
            if channel.socket is not None:
                channel.socket.close()

    def stop(self) -> None:
        """End ``run`` after the present round; may be called from another thread."""
        self.running = False

    def run(self, duration: float | None = None, tick: Callable[[float], None] | None = None) -> None:
        """Serve until ``stop`` or for some time.

        Args:
            duration: Seconds; None: until stopped.
            tick: Called about ten times a second with the time since the start, for statistics and keys.
        """
        self.running = True
        start = now = time.perf_counter()
        told = start
        step = 1.0 / self.rate
        while self.running and (duration is None or now - start < duration):
            due = min((max(c.posed, c.heard) + GAP * step for c in self.channels), default=now + step)
            wait = min(max(due - now, 0.0), 0.1)
            for key, _ in self._selector.select(wait):
                self._read(key.data)
            now = time.perf_counter()
            for channel in self.channels:
                if channel.heard > float("-inf") and now - channel.posed >= GAP * step:
                    self._pose(channel, now, None)
            if tick is not None and now - told >= 0.1:
                told = now
                tick(now - start)

    def _read(self, channel: Channel) -> None:
        """All that waits on a socket; the pose as soon as a set is complete."""
        assert channel.socket is not None
        pending, posed, arrived = False, 0, 0.0
        for _ in range(DRAIN):
            try:
                data, source = channel.socket.recvfrom(BIGGEST)
            except (BlockingIOError, InterruptedError):
                break
            except OSError:  # Windows reports a receiver that is gone on the socket that sent
                channel.statistics.count("socket errors")
                continue
            arrived = time.perf_counter()
            pending |= self._take(channel, data, source[:2], arrived)
            if pending and posed < BEHIND:
                self._pose(channel, time.perf_counter(), arrived)
                pending, posed = False, posed + 1
        if pending:
            self._pose(channel, time.perf_counter(), arrived)

    def _take(self, channel: Channel, data: bytes, source: tuple[str, int], now: float) -> bool:
        statistics = channel.statistics
        if self.recorder is not None:
            with contextlib.suppress(OSError):
                self.recorder.write(Datagram(now, channel.protocol, f"{source[0]}:{source[1]}", data))
        if channel.sender not in (None, source) and now - channel.heard < ONE_SENDER:
            statistics.count("packets of a second sender")
            return False
        try:
            packet = PROTOCOLS[channel.protocol](data)
        except PacketError as error:
            statistics.drop(str(error))
            return False
        channel.sender, channel.heard = source, now
        complete = channel.session.receive(packet, now)
        if channel.calibrating is not None:
            channel.calibrating.take(now, channel.session.seen)
        return complete

    def _pose(self, channel: Channel, now: float, arrived: float | None) -> None:
        frame = channel.session.solve(now)
        solved = time.perf_counter()
        channel.posed = now
        for output in channel.outputs:
            for datagram in output.write(frame):
                try:
                    self._out.sendto(datagram, output.address)
                except (BlockingIOError, InterruptedError):
                    channel.statistics.count("datagrams a receiver was too slow for")
                except OSError:
                    channel.statistics.count("datagrams nobody received")
        sent = time.perf_counter()
        channel.statistics.posed(now, solved - now, None if arrived is None else sent - arrived)
        if self.watch is not None:
            self.watch(channel, frame)


def _listen(channel: Channel) -> socket.socket:
    if channel.protocol not in PROTOCOLS:
        raise SixpointError(f"no protocol named {channel.protocol!r}; there are: {', '.join(PROTOCOLS)}")
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        opened.bind((channel.host, channel.port))
    except (OSError, OverflowError) as error:
        opened.close()
        raise SixpointError(
            f"cannot listen on {channel.host}:{channel.port}: {error}; is another program using the port? "
            "choose another one"
        ) from error
    opened.setblocking(False)
    channel.port = opened.getsockname()[1]
    return opened


def replay(recording: Sequence[Datagram], session: Session) -> list[Frame]:
    """Pose a recorded session again, datagram by datagram, by the recorded times.

    The same recording gives the same poses; damaged datagrams are left out as they were then.
    """
    frames = []
    for datagram in recording:
        reader = PROTOCOLS.get(datagram.protocol)
        if reader is None:
            continue
        try:
            packet = reader(datagram.data)
        except PacketError:
            continue
        if session.receive(packet, datagram.time):
            frames.append(session.solve(datagram.time))
    return frames
