"""Six effectors that are always there, from trackers that are not.

Readings that can be believed (``checks``) are passed on as they are. A point that is lost goes on at its
velocity against the body, which dies away, and within 0.3 s it rests where it last was in the body's frame;
if it stays away it moves, within another second, to where it is taken to be without a tracker (``stance``).
One that returns is eased in over 0.15 s. So an effector that never had a tracker and one that lost it are the
same thing, and a kit of three trackers is a set of six of which three were never seen.

Times are arguments; nothing depends on how often ``update`` is called.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.targets import EFFECTORS, GUIDES, POINTS
from sixpoint.errors import TargetError
from sixpoint.live.checks import ROOM, Checks
from sixpoint.live.stance import Posture, Stance, about_up, turned
from sixpoint.live.stepping import ease
from sixpoint.signals.one_euro import OneEuro, find_smoothing

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

HELD = 0.3  # a lost point goes on and comes to rest in this time [s]
COAST = 0.15  # time constant with which its velocity dies away; of 0.05 to 0.3 the best at 0.1 s [s]
AWAY = 1.0  # then it goes to its place without a tracker in this time [s]
RETURN = 0.15  # a point that returns is eased in [s]
SIX = len(EFFECTORS)
LARGEST, LATEST = 1e6, 1e12  # numbers of a rotation and times that are none are beyond these
INSTANT = 1e-6  # times that are nearer to each other are one [s]
IDENTITY = rot.IDENTITY
LIMBS, OTHERS = np.arange(2, SIX), np.arange(2, len(POINTS))
SEEN, GUESSED, ALONE = 0, 1, 2  # how a point is placed: as seen, from the body, or by itself


class State(IntEnum):
    """Of one tracker."""

    ABSENT = 0
    """Never seen."""
    VALID = 1
    """Seen now."""
    LOST = 2
    """Seen before."""


@dataclass(frozen=True, eq=False)
class Tracked:
    """One frame of effectors without gaps.

    Attributes:
        positions: (6, 3) in the order of ``EFFECTORS`` [m], always finite.
        rotations: (6, 4) of their segments, always unit quaternions.
        measured: (6,) whose rotation was ever seen, so that what is given now is at least held.
        state: (11,) ``State`` of each of ``POINTS``.
        age: (11,) time since each was last seen [s]; infinite where never.
        guides: (5, 3) positions of ``GUIDES`` [m]; NaN where there is none.
        guide_rotations: (5, 4); NaN where there is none.
        weights: (5,) how much each guide counts, 0 to 1: it fades in and out.
    """

    positions: Array
    rotations: Array
    measured: Flags
    state: NDArray[np.int64]
    age: Array
    guides: Array
    guide_rotations: Array
    weights: Array

    @property
    def known_rotations(self) -> Array:
        """(6, 4) rotations, NaN where made up: for solvers that use measured rotations."""
        return np.where(self.measured[:, None], self.rotations, np.nan)


class Tracking:
    """The state of up to eleven trackers of one person.

    Args:
        figure: The person.
        smoothing: "off", "light" or "strong".
        posture: Where absent legs are: "standing" or "sitting".
        floor: Height of the floor [m].

    Attributes:
        checks: What was rejected, and how often: ``checks.rejected``.
        stance: Where the body faces, and where absent effectors are.

    Raises:
        TargetError: There is no such smoothing or posture.
    """

    def __init__(
        self,
        figure: Figure,
        *,
        smoothing: str = "off",
        posture: Posture = "standing",
        floor: float = 0.0,
    ) -> None:
        self._made = (figure, posture, floor)
        self._filter = OneEuro(find_smoothing(smoothing))
        self.reset()

    def reset(self) -> None:
        """Forget everything, as after a recalibration; the next frame begins anew."""
        n = len(POINTS)
        self.checks = Checks(n)
        self.stance = Stance(*self._made)
        self._filter.reset()
        self._time: float | None = None
        self._mode = np.full(n, -1)
        self._seen = np.full(n, -np.inf)  # when the point was last seen
        self._from, self._speed = np.zeros((n, 3)), np.zeros((n, 3))  # where it was then, how fast it moved
        self._held, self._drift = np.zeros((n, 3)), np.zeros((n, 3))  # and both in the body's frame
        self._changed = np.full(n, -np.inf)  # when its mode changed
        self._gap = np.zeros((n, 3))  # and how far it was then from where the new mode has it
        self._out = np.full((n, 3), np.nan)
        nothing = np.tile(IDENTITY, (n, 1))
        self._turn_mode = np.zeros(n, bool)
        self._turn_seen, self._turn_changed = self._seen.copy(), self._changed.copy()
        self._turn_held, self._turn_from = nothing, nothing.copy()
        self._turn_out = np.full((n, 4), np.nan)
        self._turn_yaw = np.zeros(n)

    def recentre(self) -> None:
        """The room was moved: take new places as they come, eased in, without calling them jumps."""
        self.checks.forget(np.ones(len(POINTS), bool))

    def update(self, time: float, positions: ArrayLike, rotations: ArrayLike | None = None) -> Tracked:
        """Take one set of readings.

        Args:
            time: When it was taken [s]; a time before the last one counts as the last one.
            positions: (11, 3) joints in the order of ``POINTS``, or (6, 3) [m]; NaN where one is not seen.
            rotations: (11, 4) or (6, 4) of their segments xyzw, identity in the neutral pose; NaN where a
                tracker has none.

        Raises:
            TargetError: Another shape.
        """
        p, q = _rows(positions, 3, ROOM), _rows(rotations, 4, LARGEST)
        before = time if self._time is None else self._time
        time = max(time, before) if abs(time) < LATEST else before if abs(before) < LATEST else 0.0
        if self._time is not None and time - before < INSTANT:
            time = before
        dt, self._time = (0.0 if self._time is None else time - before), time
        judged = self.checks.judge(time, p, q)
        valid = judged.believed
        p = self._filter.filter_positions(np.where(valid[:, None], judged.positions, np.nan), time)
        q = self._filter.filter_rotations(_unit(np.where(valid[:, None], judged.rotations, np.nan)), time)
        body = self.stance
        body.face(dt, p[:SIX], q[:SIX])
        pelvis, head = self._place_trunk(time, p, valid, judged.moved)
        ankles = np.where(valid[4:SIX, None], p[4:SIX], np.nan)
        places, turns = body.find_limbs(dt, pelvis, head, ankles)
        used = LIMBS if not np.isfinite(self._seen[SIX:]).any() and not valid[SIX:].any() else OTHERS
        absent = np.concatenate([places, np.full((len(used) - 4, 3), np.nan)])
        self._place(time, used, p, valid, judged.moved, pelvis, absent)
        self._turn(time, q, turns)
        self._remember(time, valid)
        return self._report(time, valid)

    # --- steps of an update ----------------------------------------------------------------------

    def _place_trunk(self, time: float, p: Array, valid: Flags, moved: Flags) -> tuple[Array, Array]:
        """Pelvis and head: one is found as any lost point, the other from it."""
        body, seen = self.stance, np.isfinite(self._seen)
        if valid[0] or not (valid[1] or (seen[1] and not seen[0])):
            first, other = 0, 1
        else:
            first, other = 1, 0
        if not seen[first]:
            self._from[first] = body.nowhere()
        self._place(time, np.array([first]), p, valid, moved, None, None)
        known = self._out[first]
        other_place = body.find_head(known) if other == 1 else body.find_pelvis(known)
        self._place(time, np.array([other]), p, valid, moved, known, other_place[None])
        if valid[0] and valid[1]:
            body.remember(self._out[0], self._out[1])
        return self._out[0], self._out[1]

    def _place(
        self,
        time: float,
        rows: NDArray[np.int64],
        p: Array,
        valid: Flags,
        moved: Flags,
        base: Array | None,
        absent: Array | None,
    ) -> None:
        """Outputs of some rows: as seen, else going on, held, and on to where they are without a tracker.

        Args:
            time: Now [s].
            rows: (m,) which.
            p: (n, 3) what is seen [m].
            valid: (n,) whether it is.
            moved: (n,) whether the room was moved.
            base: (3,) the point that they are held to; None where they are by themselves.
            absent: (m, 3) where they are without a tracker [m]; NaN where they stay.
        """
        seen = valid[rows]
        place, mode = p[rows], np.where(seen, SEEN, ALONE if base is None else GUESSED)
        if not seen.all():
            age = time - self._seen[rows]
            alone = (mode == ALONE) & (self._mode[rows] == GUESSED)
            if alone.any():  # what was found from another point, which is now lost, stays where it is
                self._from[rows], self._speed[rows] = self._out[rows], 0.0
            coasted = (COAST * -np.expm1(-age / COAST))[:, None]
            if base is None:
                lost = self._from[rows] + coasted * self._speed[rows]
            else:
                coasted *= 1.0 - ease(age / HELD)[:, None]
                lost = base + turned(self.stance.yaw, self._held[rows] + coasted * self._drift[rows])
            if absent is not None:
                away = np.where(np.isnan(absent), 0.0, ease((age - HELD) / AWAY)[:, None])
                lost = lost + away * (np.nan_to_num(absent) - lost)
            place = np.where(seen[:, None], place, lost)
        new = (mode != self._mode[rows]) | moved[rows]
        if new.any():
            new &= np.isfinite(self._out[rows, 0])
            changed = rows[new]
            self._changed[changed], self._gap[changed] = time, self._out[changed] - place[new]
            self._mode[rows] = mode
        since = time - self._changed[rows]
        if since.min() < RETURN:
            place = place + (1.0 - ease(since / RETURN))[:, None] * self._gap[rows]
        self._out[rows] = place

    def _turn(self, time: float, q: Array, limbs: Array) -> None:
        """Rotations: as seen, else held against the body, and on to those of a body without trackers."""
        seen = np.isfinite(q[:, 3])
        turn, yaw = q, self.stance.yaw
        lost = np.flatnonzero(~seen)
        if len(lost):
            turn = q.copy()
            facing = about_up(yaw)
            turn[lost] = np.concatenate([[facing, facing], limbs, np.tile(facing, (len(GUIDES), 1))])[lost]
            known = lost[np.isfinite(self._turn_seen[lost])]
            if len(known):
                half = 0.5 * (yaw - self._turn_yaw[known])
                change = np.zeros((len(known), 4))
                change[:, 1], change[:, 3] = np.sin(half), np.cos(half)
                held = rot.mul(change, self._turn_held[known])
                away = ease((time - self._turn_seen[known] - HELD) / AWAY)
                turn[known] = _between(held, turn[known], away)
        new = seen != self._turn_mode
        if new.any():
            new &= np.isfinite(self._turn_out[:, 3])
            self._turn_changed[new], self._turn_from[new] = time, self._turn_out[new]
            self._turn_mode = seen
        since = time - self._turn_changed
        if since.min() < RETURN:
            turn = _between(self._turn_from, turn, ease(since / RETURN))
        self._turn_out = turn
        self._turn_held[seen], self._turn_yaw[seen], self._turn_seen[seen] = turn[seen], yaw, time

    def _remember(self, time: float, valid: Flags) -> None:
        """Where seen points are, for when they are lost."""
        self._seen[valid] = time
        velocity = self.checks.velocity
        self._from[valid], self._speed[valid] = self._out[valid], velocity[valid]
        base, moves = np.repeat(self._out[:1], len(POINTS), axis=0), np.zeros((len(POINTS), 3))
        base[0] = self._out[1]
        if valid[0] or valid[1]:
            moves[:] = velocity[0] if valid[0] else velocity[1]
            moves[0] = velocity[1] if valid[1] else 0.0
        self._held[valid] = turned(-self.stance.yaw, (self._out - base)[valid])
        self._drift[valid] = turned(-self.stance.yaw, (velocity - moves)[valid])

    def _report(self, time: float, valid: Flags) -> Tracked:
        age, ever = time - self._seen, np.isfinite(self._seen)
        state = np.where(valid, State.VALID, np.where(ever, State.LOST, State.ABSENT))
        turned_once = np.isfinite(self._turn_seen)
        since = ease((time - self._changed[SIX:]) / RETURN)
        weights = np.where(valid[SIX:], since, 1.0 - ease(age[SIX:] / HELD))
        unknown = (weights <= 0.0)[:, None]
        blank = unknown | ~turned_once[SIX:, None]
        return Tracked(
            positions=self._out[:SIX].copy(),
            rotations=self._turn_out[:SIX].copy(),
            measured=turned_once[:SIX],
            state=state,
            age=age,
            guides=np.where(unknown, np.nan, self._out[SIX:]),
            guide_rotations=np.where(blank, np.nan, self._turn_out[SIX:]),
            weights=weights,
        )


def _rows(values: ArrayLike | None, width: int, most: float) -> Array:
    """Readings as (11, width), NaN where nothing is given or a number is not below ``most``."""
    out = np.full((len(POINTS), width), np.nan)
    if values is None:
        return out
    try:
        given = np.asarray(values, float)
    except (TypeError, ValueError) as error:
        raise TargetError(f"readings must be numbers, NaN where a tracker is not seen: {error}") from error
    if given.shape not in ((SIX, width), (len(POINTS), width)):
        raise TargetError(
            f"readings must be ({SIX}, {width}) or ({len(POINTS)}, {width}), one row per point of "
            f"{', '.join(POINTS)}; got {given.shape}"
        )
    out[: len(given)] = np.where(np.abs(given) < most, given, np.nan)
    return out


def _unit(q: Array) -> Array:
    """Unit quaternions; NaN where there is no rotation."""
    length = np.linalg.norm(q, axis=1, keepdims=True)
    good = np.isfinite(length) & (length > 1e-6)
    return np.where(good, q / np.where(good, length, 1.0), np.nan)


def _between(a: Array, b: Array, weight: Array) -> Array:
    """Rotations (n, 4) on the short way from ``a`` (weight 0) to ``b`` (weight 1)."""
    side = np.where(np.sum(a * b, axis=1) < 0.0, -1.0, 1.0)
    return rot.normalised(a + weight[:, None] * (b * side[:, None] - a))
