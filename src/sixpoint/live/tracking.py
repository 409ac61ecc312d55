"""Six effectors that are always there, from trackers that are not.

Readings that can be believed (``checks``) are passed on as they are. A point that is lost goes on at its
velocity, which dies away, and within 0.3 s comes to rest where it last was in the body's frame; if it stays
away it moves, within another second, to where it is taken to be without a tracker (``stance``). One that
returns is eased in over 0.15 s. So an effector that never had a tracker and one that lost it are the same
thing, and a kit of three trackers is a set of six of which three were never seen.

Times are arguments; nothing depends on how often ``update`` is called.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.targets import EFFECTORS, GUIDES
from sixpoint.errors import TargetError
from sixpoint.live.checks import Checks
from sixpoint.live.stance import Posture, Stance, about_up, turned
from sixpoint.live.stepping import ease
from sixpoint.signals.one_euro import OneEuro, find_smoothing

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

POINTS = (*EFFECTORS, *GUIDES)
"""The rows of what trackers report."""
HELD = 0.3  # a lost point goes on and comes to rest in this time [s]
COAST = 0.1  # time constant with which its velocity dies away [s]
AWAY = 1.0  # then it goes to its place without a tracker in this time [s]
RETURN = 0.15  # a point that returns is eased in [s]
SIX = len(EFFECTORS)
IDENTITY = rot.IDENTITY
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
        self._held = np.zeros((n, 3))  # and its place in the body's frame
        self._changed = np.full(n, -np.inf)  # when its mode changed
        self._gap = np.zeros((n, 3))  # and how far it was then from where the new mode has it
        self._out = np.full((n, 3), np.nan)
        nothing = np.tile(IDENTITY, (n, 1))
        self._turn_mode = np.zeros(n, bool)
        self._turn_seen, self._turn_changed = self._seen.copy(), self._changed.copy()
        self._turn_held, self._turn_from, self._turn_out = nothing, nothing.copy(), nothing.copy()

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
        p, q = _rows(positions, 3), _rows(rotations, 4)
        before = time if self._time is None else self._time
        time = max(time, before) if np.isfinite(time) else before if np.isfinite(before) else 0.0
        dt, self._time = (0.0 if self._time is None else time - before), time
        judged = self.checks.judge(time, p, q)
        valid = judged.believed
        p = self._filter.filter_positions(np.where(valid[:, None], judged.positions, np.nan), time)
        q = self._filter.filter_rotations(_unit(np.where(valid[:, None], judged.rotations, np.nan)), time)
        self._turn_seen[np.isfinite(q[:, 3])] = time
        body = self.stance
        body.face(dt, p[:SIX], q[:SIX])
        pelvis, head = self._place_trunk(time, p, valid, judged.moved)
        ankles = np.where(valid[4:SIX, None], p[4:SIX], np.nan)
        places, turns = body.find_limbs(dt, pelvis, head, ankles)
        rest = np.arange(2, len(POINTS))
        held = pelvis + turned(body.yaw, self._held[2:])
        self._place(time, rest, p, valid, judged.moved, held, np.concatenate([places, held[4:]]))
        facing = about_up(body.yaw)
        self._turn(time, q, facing, np.vstack([facing, facing, turns, np.tile(facing, (len(GUIDES), 1))]))
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
        rows = np.array([first])
        stay = self._from[rows] if seen[first] else body.nowhere()[None]
        self._place(time, rows, p, valid, moved, stay + COAST * self._speed[rows], None)
        known = self._out[first]
        other_place = body.find_head(known) if other == 1 else body.find_pelvis(known)
        held = known + turned(body.yaw, self._held[other])
        self._place(time, np.array([other]), p, valid, moved, held[None], other_place[None])
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
        held: Array,
        absent: Array | None,
    ) -> None:
        """Outputs of some rows: as seen, else going on, held, and on to where they are without a tracker.

        Args:
            time: Now [s].
            rows: (m,) which.
            p: (n, 3) what is seen [m].
            valid: (n,) whether it is.
            moved: (n,) whether the room was moved.
            held: (m, 3) where they were last in the body's frame [m].
            absent: (m, 3) where they are without a tracker [m]; None where they stay as ``held``.
        """
        seen, mode = valid[rows], np.where(valid[rows], SEEN, GUESSED if absent is not None else ALONE)
        alone = (mode == ALONE) & (self._mode[rows] == GUESSED)
        if alone.any():  # what was found from another point, which is now lost, stays where it is
            self._from[rows], self._speed[rows] = self._out[rows], 0.0
            held = self._out[rows]
        age = time - self._seen[rows]
        coasted = (COAST * -np.expm1(-age / COAST))[:, None] * self._speed[rows]
        at_rest = ease(age / HELD)[:, None]
        place = (1.0 - at_rest) * (self._from[rows] + coasted) + at_rest * held
        if absent is not None:
            away = ease((age - HELD) / AWAY)[:, None]
            place = (1.0 - away) * place + away * absent
        place = np.where(seen[:, None], p[rows], place)
        new = ((mode != self._mode[rows]) | moved[rows]) & np.isfinite(self._out[rows, 0])
        changed = rows[new]
        self._changed[changed], self._gap[changed] = time, self._out[changed] - place[new]
        self._mode[rows] = mode
        left = 1.0 - ease((time - self._changed[rows]) / RETURN)[:, None]
        self._out[rows] = place + left * self._gap[rows]

    def _turn(self, time: float, q: Array, facing: Array, absent: Array) -> None:
        """Rotations: as seen, else held against the body, and on to those of a body without trackers."""
        seen = np.isfinite(q[:, 3])
        age = time - self._turn_seen
        turn = _between(rot.mul(facing, self._turn_held), absent, ease((age - HELD) / AWAY))
        turn = np.where(seen[:, None], q, turn)
        new = seen != self._turn_mode
        self._turn_changed[new], self._turn_from[new] = time, self._turn_out[new]
        self._turn_mode = seen
        self._turn_out = _between(self._turn_from, turn, ease((time - self._turn_changed) / RETURN))
        self._turn_held[seen] = rot.mul(rot.inv(facing), self._turn_out[seen])

    def _remember(self, time: float, valid: Flags) -> None:
        """Where seen points are, for when they are lost."""
        self._seen[valid] = time
        self._from[valid], self._speed[valid] = self._out[valid], self.checks.velocity[valid]
        base = np.repeat(self._out[:1], len(POINTS), axis=0)
        base[0] = self._out[1]
        self._held[valid] = turned(-self.stance.yaw, (self._out - base)[valid])

    def _report(self, time: float, valid: Flags) -> Tracked:
        age, ever = time - self._seen, np.isfinite(self._seen)
        state = np.where(valid, State.VALID, np.where(ever, State.LOST, State.ABSENT))
        since = np.where(np.isfinite(self._changed[SIX:]), (time - self._changed[SIX:]) / RETURN, 1.0)
        fresh = np.where(valid[SIX:], ease(since), 1.0 - ease(age[SIX:] / HELD))
        weights = np.where(ever[SIX:], fresh, 0.0)
        unknown = (weights <= 0.0)[:, None]
        turned_once = np.isfinite(self._turn_seen)
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


def _rows(values: ArrayLike | None, width: int) -> Array:
    """Readings as (11, width), NaN where nothing is given."""
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
    out[: len(given)] = given
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
