"""One avatar: packets in, poses out. No socket, no clock, no thread: times are arguments.

The newest reading of each tracker counts. A set is complete when every tracker that is alive has sent since
the last pose; then ``solve`` is due. Whatever arrives, a pose comes out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Pose
from sixpoint.body.targets import POINTS
from sixpoint.calibration.mounts import Mount
from sixpoint.errors import SixpointError, listed
from sixpoint.live.feet import Floor, level_feet
from sixpoint.live.guides import Guidance
from sixpoint.live.osc import Message
from sixpoint.live.readings import Packet, Reading
from sixpoint.live.stance import Posture
from sixpoint.live.tracking import Tracked, Tracking

Array = NDArray[np.float64]

ALIVE = 0.25  # a tracker that was silent for so long is not waited for [s]
STALE = 0.1  # readings older than this are not seen [s]
MOST_NAMES = 256  # names that are remembered; what comes beyond is counted, not kept
DEVICES = ("tracker", "hmd", "controller")


@dataclass(frozen=True, eq=False)
class Frame:
    """A posed frame.

    Attributes:
        time: When it was asked for [s].
        pose: On the figure's rig.
        tracked: The effectors it was posed from.
        residual: (6,) distance of each effector to its target [m].
        passed: Bones and blend shapes that came in, to be sent along.
        thru: Messages to be passed on as they are.
    """

    time: float
    pose: Pose
    tracked: Tracked
    residual: Array
    passed: tuple[Reading, ...]
    thru: tuple[Message, ...]


class Session:
    """The state of one tracked person.

    Args:
        figure: Who is posed.
        solver: Poses it; a solver of the six points.
        roles: Serial of a tracker -> a name of ``POINTS``. A tracker whose serial is such a name plays that
            role without being listed, and a headset is the head.
        mounts: Name of a point -> how its tracker is mounted; others are taken to be the joints themselves.
        smoothing: "off", "light" or "strong".
        posture: Where legs without trackers are: "standing" or "sitting".
        floor: Height of the floor [m].
        feet: Level feet that have no measured rotation where they are low.

    Attributes:
        counts: What was received, used, dropped and why.
        paused: While true ``solve`` gives the last frame again.

    Raises:
        SixpointError: A role does not exist, or is given twice.
    """

    def __init__(
        self,
        figure: Figure,
        solver: Any,
        *,
        roles: Mapping[str, str] | None = None,
        mounts: Mapping[str, Mount] | None = None,
        smoothing: str = "off",
        posture: Posture = "standing",
        floor: float = 0.0,
        feet: bool = True,
    ) -> None:
        self.figure, self.solver = figure, solver
        self.roles, self.mounts = _checked(roles or {}, mounts or {})
        self.counts: Counter[str] = Counter()
        self.paused = False
        self.level_feet = feet
        measured = getattr(solver, "rotations", ())
        self._measures_feet = np.array(["l_ankle" in measured, "r_ankle" in measured])
        self._floor = Floor.under(figure, floor)
        # Chest, elbows and knees lead a solver that can start from a pose; others meet the six points alone.
        self._guidance = Guidance(figure) if getattr(solver, "takes_start", False) else None
        self._tracking = Tracking(figure, smoothing=smoothing, posture=posture, floor=floor)
        self.forget()

    def forget(self) -> None:
        """Begin anew, as after a calibration: nothing of what was seen or posed is kept."""
        n = len(POINTS)
        self._tracking.reset()
        self._raw_positions, self._raw_rotations = np.full((n, 3), np.nan), np.full((n, 4), np.nan)
        self._arrived = np.full(n, -np.inf)
        self._fresh = np.zeros(n, bool)
        self._latest: dict[str, Reading] = {}
        self._passed: dict[tuple[str, str], Reading] = {}
        self._thru: list[Message] = []
        self._solution: Any = None
        self._solved_at: float | None = None
        self.last: Frame | None = None

    def recentre(self) -> None:
        """The tracking space was moved: take new places as they come, without calling them jumps."""
        self._tracking.recentre()
        self._solution = None

    @property
    def seen(self) -> dict[str, Reading]:
        """The latest reading of every device, by its serial, also of those without a role."""
        return dict(self._latest)

    def receive(self, packet: Packet, now: float) -> bool:
        """Take a packet; whether a set is complete."""
        self.counts["packets"] += 1
        self.counts["refused messages"] += len(packet.refused)
        for reading in packet.readings:
            if reading.kind in DEVICES:
                self._take(reading, now)
            elif reading.kind != "root" and self._has_room(self._passed, (reading.kind, reading.name)):
                self._passed[reading.kind, reading.name] = reading
        if packet.thru:
            self._thru = [*self._thru, *packet.thru][-MOST_NAMES:]
        alive = now - self._arrived < ALIVE
        return bool(self._fresh.any() and not (alive & ~self._fresh).any())

    def _has_room(self, table: Mapping[Any, Any], key: Any) -> bool:
        if key in table or len(table) < MOST_NAMES:
            return True
        self.counts["names beyond the first 256"] += 1
        return False

    def _take(self, reading: Reading, now: float) -> None:
        if not self._has_room(self._latest, reading.name):
            return
        reading = reading.after(self._latest.get(reading.name))
        self._latest[reading.name] = reading
        role = self.roles.get(reading.name, reading.name)
        if role not in POINTS and reading.kind == "hmd":
            role = "head"
        if role not in POINTS:
            self.counts["readings without a role"] += 1
            return
        row = POINTS.index(role)
        self._raw_positions[row] = np.nan if reading.position is None else reading.position
        self._raw_rotations[row] = np.nan if reading.rotation is None else reading.rotation
        self._arrived[row], self._fresh[row] = now, True

    def solve(self, now: float) -> Frame:
        """Pose the frame of a time [s]."""
        if self.paused and self.last is not None:
            return self.last
        self._fresh[:] = False
        positions, rotations = self._joints(now)
        tracked = self._tracking.update(now, positions, rotations)
        dt = 0.0 if self._solved_at is None else now - self._solved_at
        self._solution = self._pose(tracked, dt)
        self._solved_at = now
        self.counts["poses"] += 1
        thru, self._thru = tuple(self._thru), []
        pose = self._solution.pose
        if self.level_feet:
            known = np.isfinite(tracked.known_rotations[4:, 3]) & self._measures_feet
            pose = level_feet(self.figure, pose, self._floor, free=(not known[0], not known[1]))
        self.last = Frame(now, pose, tracked, self._solution.residual, tuple(self._passed.values()), thru)
        return self.last

    def _pose(self, tracked: Tracked, dt: float) -> Any:
        if self._guidance is not None:
            return self._guidance.solve(self.solver, tracked, self._solution, dt)
        rotations = getattr(self.solver, "rotations", ())
        options = {"rotations": tracked.known_rotations} if rotations else {}
        return self.solver.solve(tracked.positions, previous=self._solution, dt=dt, **options)

    def _joints(self, now: float) -> tuple[Array, Array]:
        """Joints and segments from what trackers sent last; NaN where they are silent."""
        stale = now - self._arrived > STALE
        positions, rotations = self._raw_positions.copy(), self._raw_rotations.copy()
        positions[stale], rotations[stale] = np.nan, np.nan
        for name, mount in self.mounts.items():
            row = POINTS.index(name)
            if not np.isfinite(rotations[row]).all():
                continue  # a tracker without rotation is taken to be the joint
            if np.isfinite(mount.offset).all():
                positions[row] -= rot.mul_vec(rotations[row], mount.offset)
            if np.isfinite(mount.rotation).all():
                rotations[row] = rot.mul(rotations[row], rot.inv(mount.rotation))
        return positions, rotations


def _checked(
    roles: Mapping[str, str], mounts: Mapping[str, Mount]
) -> tuple[dict[str, str], dict[str, Mount]]:
    unknown = sorted({name for name in (*roles.values(), *mounts) if name not in POINTS})
    if unknown:
        raise SixpointError(f"no role named {listed(unknown)}; roles: {listed(POINTS)}")
    twice = [name for name, n in Counter(roles.values()).items() if n > 1]
    if twice:
        raise SixpointError(f"two trackers have the role {listed(twice)}")
    return dict(roles), dict(mounts)
