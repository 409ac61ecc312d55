"""Calibration of a live session: stand still, then move; roles, mounts and lengths come out.

Readings are taken as they arrive, serial by serial; times are arguments.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.targets import EFFECTORS, POINTS, Targets
from sixpoint.calibration.calibrate import calibrate
from sixpoint.calibration.profile import Profile
from sixpoint.calibration.roles import assign_roles, facing_of_rotation
from sixpoint.errors import TargetError
from sixpoint.live.readings import Reading

Array = NDArray[np.float64]

READY, STILL, MOVING = 1.0, 2.0, 12.0  # s, of each part: to begin, to stand, to move
RATE = 60.0  # Hz, samples that are kept
FEWEST = 0.5  # share of the still pose in which a tracker must have been seen


@dataclass(frozen=True)
class Outcome:
    """What a calibration gave.

    Attributes:
        profile: The person and the trackers.
        notes: What could not be found, or is not certain; one line each.
    """

    profile: Profile
    notes: tuple[str, ...]


class Calibrating:
    """Collects readings of a calibration.

    Args:
        start: When it began [s].
        stature: Of the person where it is known [m].
        floor: Height of the floor [m]; None where it is not known.
    """

    def __init__(self, start: float, *, stature: float | None = None, floor: float | None = 0.0) -> None:
        self._start, self._stature, self._floor = start, stature, floor
        self._next = start + READY
        self._times: list[float] = []
        self._frames: list[dict[str, Reading]] = []

    def say(self, now: float) -> str:
        """What the person should do."""
        left = READY + STILL - (now - self._start)
        if left > STILL:
            return "calibrating: stand upright and still, arms hanging, looking ahead"
        if left > 0:
            return f"calibrating: stand still ({left:.0f} s)"
        return (
            f"calibrating: circle hands and feet, turn and nod the head, bow and twist, squat "
            f"({max(left + MOVING, 0.0):.0f} s)"
        )

    def take(self, now: float, seen: Mapping[str, Reading]) -> bool:
        """Keep what is seen; whether all time is over."""
        while self._next <= now:
            self._next += 1.0 / RATE
            if not self._times or now > self._times[-1]:
                self._times.append(now)
                self._frames.append(dict(seen))
        return now - self._start >= READY + STILL + MOVING

    def finish(self, roles: Mapping[str, str] | None = None) -> Outcome:
        """Roles, mounts and lengths.

        Args:
            roles: Serial -> point, where it is known; found from where the trackers are otherwise.

        Raises:
            TargetError: Too few trackers, nobody stood still, or the roles are ambiguous; the message says
                what to do.
        """
        if len(self._times) < RATE * STILL:
            raise TargetError("hardly anything arrived during the calibration: are the trackers sending?")
        times = np.array(self._times)
        still = times < self._start + READY + STILL
        serials = sorted({name for frame in self._frames for name in frame})
        places, turns = self._arrays(serials)
        often = np.isfinite(places[still, :, 0]).mean(axis=0) >= FEWEST
        serials = [name for name, enough in zip(serials, often, strict=True) if enough]
        places, turns = places[:, often], turns[:, often]
        points = dict(roles or {}) or {name: name for name in serials if name in POINTS}
        notes: list[str] = []
        if not points:
            points = self._assign(serials, places[still], turns[still])
        where = {point: serials.index(name) for name, point in points.items() if name in serials}
        missing = [name for name in EFFECTORS if name not in where]
        if missing:
            notes.append(f"no tracker on {', '.join(missing)}: their mounts and lengths are not measured")
        positions = np.full((len(times), len(EFFECTORS), 3), np.nan)
        rotations = np.full((len(times), len(EFFECTORS), 4), np.nan)
        for k, name in enumerate(EFFECTORS):
            if name in where:
                positions[:, k], rotations[:, k] = places[:, where[name]], turns[:, where[name]]
        rate = (len(times) - 1) / (times[-1] - times[0])
        found = calibrate(Targets(positions, rate, rotations), stature=self._stature, floor=self._floor)
        notes += [f"{name}: {why}" for name, why in found.unobserved.items()]
        profile = Profile.from_calibration(found, {point: serials[k] for point, k in where.items()})
        return Outcome(profile, tuple(notes))

    def _arrays(self, serials: list[str]) -> tuple[Array, Array]:
        places = np.full((len(self._frames), len(serials), 3), np.nan)
        turns = np.full((len(self._frames), len(serials), 4), np.nan)
        for f, frame in enumerate(self._frames):
            for k, name in enumerate(serials):
                reading = frame.get(name)
                if reading is not None and reading.position is not None:
                    places[f, k] = reading.position
                if reading is not None and reading.rotation is not None:
                    turns[f, k] = reading.rotation
        return places, turns

    def _assign(self, serials: list[str], places: Array, turns: Array) -> dict[str, str]:
        """Roles of trackers that are known by their places alone."""
        last = self._frames[-1]
        heads = [k for k, name in enumerate(serials) if last[name].kind == "hmd"]
        head = heads[0] if len(heads) == 1 else None
        facing = None
        if head is not None and np.isfinite(turns[-1, head]).all():
            facing = facing_of_rotation(turns[-1, head])
        found = assign_roles(places, facing=facing, head=head, stature=self._stature)
        if not found.certain:
            raise TargetError(f"it is not certain which tracker is where: {found.advice}")
        return {serials[k]: role for role, k in found.roles.items()}
