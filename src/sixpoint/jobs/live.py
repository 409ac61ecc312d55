"""A live session from its settings: figure, solver, ports and receivers, checked before a port is opened."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sixpoint.body.figure import Figure
from sixpoint.body.targets import EFFECTORS
from sixpoint.calibration.misfits import find_misfits
from sixpoint.calibration.mounts import Mount
from sixpoint.calibration.profile import Profile, format_profile, parse_profile
from sixpoint.errors import FormatError, SixpointError
from sixpoint.formats.atomic import write_files
from sixpoint.live.loop import Channel, LiveLoop, Output
from sixpoint.live.readings import Reading
from sixpoint.live.record import RecordingWriter
from sixpoint.live.session import Frame, Session
from sixpoint.live.stance import Posture
from sixpoint.live.vmc_write import PerformerWriter
from sixpoint.live.vrchat import TrackerWriter
from sixpoint.solvers.registry import DEFAULT, find_options, find_solver, make_solver

VMC_IN, VMC_OUT, VRCHAT_OUT = 39540, 39539, 9000


@dataclass(frozen=True)
class Live:
    """What a live session is made of.

    Attributes:
        protocol: "vmc", "vrchat" or "plain": what is listened to.
        port: Where.
        host: Address to listen on.
        vmc_out: Receivers of VMC, host and port.
        vrchat_out: Receivers of VRChat's trackers.
        method: A name of ``SOLVERS``.
        stature: Of the person [m]; the avatar is scaled by its receiver.
        rotations: Whose rotations are used.
        limits: Keep joints within their limits.
        smoothing: "off", "light" or "strong".
        posture: Where legs without trackers are.
        floor: Height of the floor [m].
        rate: Poses a second that the timer keeps up [Hz].
        record: File to record all datagrams to.
        profile: A person's profile, as a calibration writes it; it need not be there yet.
    """

    protocol: str = "vmc"
    port: int = VMC_IN
    host: str = "127.0.0.1"
    vmc_out: tuple[tuple[str, int], ...] = ()
    vrchat_out: tuple[tuple[str, int], ...] = ()
    method: str = DEFAULT
    stature: float = 1.75
    rotations: tuple[str, ...] = ()
    limits: bool = True
    smoothing: str = "off"
    posture: Posture = "standing"
    floor: float = 0.0
    rate: float = 90.0
    record: Path | None = None
    profile: Path | None = None

    def make_session(self, known: Profile | None = None) -> Session:
        """The session, its kernels compiled.

        Args:
            known: The person; that of the profile's file by default.

        Raises:
            SixpointError: A setting is impossible; the message says what would work.
        """
        known = known or self.read_profile()
        figure = Figure.from_stature(self.stature) if known is None else known.figure()
        options: dict[str, object] = {} if self.limits else {"limits": False}
        rotations = self.rotations
        if known is not None and "rotations" in find_options(find_solver(self.method)):
            turned = {w.point for w in known.trackers.values() if np.isfinite(w.mount.rotation).all()}
            rotations = rotations or tuple(name for name in EFFECTORS if name in turned)
        if rotations:
            if "rotations" not in find_options(find_solver(self.method)):
                raise SixpointError(f"{self.method} uses no rotations; sik+ and sik-prior do")
            options["rotations"] = rotations
        solver = make_solver(self.method, figure, **options)
        session = Session(
            figure,
            solver,
            roles=None if known is None else roles_of(known),
            mounts=None if known is None else mounts_of(known),
            smoothing=self.smoothing,
            posture=self.posture,
            floor=self.floor,
        )
        solver.warm_up()
        return session

    def read_profile(self) -> Profile | None:
        """The profile, if there is a file.

        Raises:
            FormatError: It is no profile.
        """
        if self.profile is None or not self.profile.exists():
            return None
        try:
            text = self.profile.read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise FormatError(self.profile, f"cannot be read: {error}") from error
        return parse_profile(text, self.profile)

    def keep_profile(self, profile: Profile, *, force: bool = False) -> None:
        """Write a calibration's profile.

        Raises:
            FormatError: The file exists and ``force`` is not given, or it cannot be written.
        """
        if self.profile is not None:
            write_files({self.profile: format_profile(profile).encode()}, force)

    def make_outputs(self, session: Session) -> list[Output]:
        """What sends the poses of a session to the receivers."""
        outputs: list[Output] = []
        if self.vmc_out:
            performer, start = PerformerWriter(session.figure), time.perf_counter()

            def write_vmc(frame: Frame) -> list[bytes]:
                since = frame.time - start  # the protocol has single precision
                return performer.write_pose(frame.pose, since, passed=frame.passed, thru=frame.thru)

            outputs += [Output(address, write_vmc) for address in self.vmc_out]
        if self.vrchat_out:
            trackers = TrackerWriter(session.figure)
            outputs += [
                Output(address, lambda frame: trackers.write_pose(frame.pose)) for address in self.vrchat_out
            ]
        return outputs

    def make_loop(self, watch: Callable[[Channel, Frame], None] | None = None) -> LiveLoop:
        """The loop, its port open.

        Raises:
            SixpointError: A setting is impossible, a port in use, or the recording exists.
        """
        session = self.make_session()
        channel = Channel(session, self.protocol, self.port, self.host, self.make_outputs(session))
        recorder = None if self.record is None else RecordingWriter(self.record)
        return LiveLoop([channel], rate=self.rate, recorder=recorder, watch=watch)


class FitCheck:
    """Watches the first seconds of a session for signs that a profile is not of who is seen.

    Args:
        profile: What was loaded.
    """

    SAMPLES = 30  # readings that are looked at, at the ten a second of the loop's tick

    def __init__(self, profile: Profile) -> None:
        self._profile = profile
        self._seen: list[dict[str, Reading]] = []

    def take(self, seen: dict[str, Reading]) -> tuple[str, ...] | None:
        """Note what is seen; the misfits when enough was, before that None."""
        if seen:
            self._seen.append(seen)
        if len(self._seen) < self.SAMPLES:
            return None
        nowhere = (np.nan,) * 3
        places = {
            serial: np.array(
                [frame[serial].position or nowhere if serial in frame else nowhere for frame in self._seen]
            )
            for serial in sorted({name for frame in self._seen for name in frame})
        }
        return find_misfits(self._profile, places)


def roles_of(profile: Profile) -> dict[str, str]:
    """Serial -> point."""
    return {serial: worn.point for serial, worn in profile.trackers.items()}


def mounts_of(profile: Profile) -> dict[str, Mount]:
    """Point -> mount."""
    return {worn.point: worn.mount for worn in profile.trackers.values()}


def parse_address(text: str, port: int) -> tuple[str, int]:
    """``host:port``, ``host`` or ``port`` as an address.

    Raises:
        SixpointError: The port is none.
    """
    host, _, number = (
        text.rpartition(":") if ":" in text else (("", "", text) if text.isdigit() else (text, "", ""))
    )
    try:
        value = int(number) if number else port
    except ValueError:
        value = -1
    if not 0 < value < 65536:
        raise SixpointError(f"{text!r} is no address: give host:port with a port of 1 to 65535")
    return host or "127.0.0.1", value
