"""Which readings of trackers can be believed: gaps, jumps, swaps, and pictures that do not move.

What a tracker reports is not believed where it is not a number or beyond the room, at the origin out of
nowhere, farther from where it was than a body part gets in the time, or the same to the last bit for half a
second while most others move. Two trackers that jump to each other's place have been exchanged: they are
exchanged back. A jump that lasts, or that most trackers make together, is believed: somebody recentred.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

ROOM = 100.0  # nothing is farther from the origin [m]
ORIGIN = 1e-3  # nothing is as near to it [m]
JUMP = 0.15  # a tracker may be so far from where it was [m],
FASTEST = 12.0  # plus so far per time [m/s]
LASTING = 0.25  # a jump that lasts so long is believed [s]
FROZEN = 0.5  # the same bits for so long are no news [s]
SWAPPED = 0.3  # after an exchange both are nearer to their places than this share of the jump
STALE = 0.5  # a place is no evidence of an exchange after so long [s]
MEMORY = 0.04  # of velocities [s]


@dataclass(frozen=True, eq=False)
class Judged:
    """One set of readings, judged.

    Attributes:
        positions: (n, 3) in their right rows [m].
        rotations: (n, 4) likewise.
        believed: (n,) which may be used.
        moved: (n,) which of these were believed at another place a moment ago: the room was moved.
    """

    positions: Array
    rotations: Array
    believed: Flags
    moved: Flags


class Checks:
    """What is remembered of n trackers to judge their next readings.

    Args:
        n: Number of rows.

    Attributes:
        rejected: How often readings were rejected or exchanged, by reason: "unknown", "origin", "jump",
            "frozen", "swapped". Each event counts once, however long it lasts.
        place: (n, 3) last believed positions [m]; NaN where there is none yet.
        velocity: (n, 3) low-passed [m/s].
        time: (n,) when that was [s].
    """

    def __init__(self, n: int) -> None:
        self.rejected: Counter[str] = Counter()
        self.place = np.full((n, 3), np.nan)
        self.velocity = np.zeros((n, 3))
        self.time = np.full(n, -np.inf)
        self._order = np.arange(n)
        self._raw = np.full((n, 7), np.nan)
        self._since = np.full(n, -np.inf)  # bits are the same since
        self._strange = np.full((n, 3), np.nan)  # where a rejected jump went
        self._strange_since = np.full(n, np.inf)
        self._strange_last = np.full(n, -np.inf)
        self._why = [""] * n

    def judge(self, time: float, positions: Array, rotations: Array) -> Judged:
        """Judge one set of readings.

        Args:
            time: When it was taken [s].
            positions: (n, 3) [m]; NaN where a tracker did not report, or reported no place in the room.
            rotations: (n, 4); NaN where it has none.
        """
        raw = np.concatenate([positions, rotations], axis=1)
        frozen = self._find_frozen(time, raw)
        p, q = positions[self._order], rotations[self._order]
        size = np.abs(p).max(axis=1)  # NaN stays NaN
        known = np.isfinite(size)
        seen = np.isfinite(self.time)
        ago = np.maximum(time - self.time, 0.0)
        origin = known & (size < ORIGIN) & ~(np.abs(self.place).max(axis=1) < JUMP)
        known &= ~origin
        off = np.linalg.norm(p - self.place - self.velocity * np.minimum(ago, MEMORY)[:, None], axis=1)
        jumped = known & seen & (off > JUMP + FASTEST * ago)
        if jumped.any():
            p, q, jumped = self._exchange(p, q, jumped, ago)
            if jumped.sum() > 1 and 2 * jumped.sum() > (known & seen).sum():
                self.forget(jumped)  # all together: the room was moved
                jumped[:] = False
            jumped &= ~self._lasts(time, p, jumped)
        frozen = frozen[self._order]
        believed = known & ~jumped & ~frozen
        self._count(
            time, {"unknown": ~known & ~origin & seen, "origin": origin, "jump": jumped, "frozen": frozen}
        )
        moved = believed & np.isfinite(self.place[:, 0]) & ~np.isfinite(self.time)
        self._learn(time, p, believed)
        return Judged(p, q, believed, moved)

    def forget(self, rows: Flags) -> None:
        """Forget where some trackers were: their next reading is believed wherever it is."""
        self.time[rows] = -np.inf
        self.velocity[rows] = 0.0

    def _find_frozen(self, time: float, raw: Array) -> Flags:
        """Rows whose bits have not changed for long, while those of most others have."""
        changed = (raw != self._raw) & ~(np.isnan(raw) & np.isnan(self._raw))
        moved = changed.any(axis=1)
        self._since[moved] = time
        self._raw = raw
        reported = np.isfinite(raw[:, 0])
        still = reported & (time - self._since > FROZEN)
        return np.asarray(still & (2 * (reported & ~still).sum() > reported.sum()), bool)

    def _exchange(self, p: Array, q: Array, jumped: Flags, ago: Array) -> tuple[Array, Array, Flags]:
        """Exchange pairs of trackers that jumped to each other's places."""
        rows = [int(k) for k in np.flatnonzero(jumped & (ago < STALE))]
        for i in rows:
            for j in rows:
                if j <= i or not (jumped[i] and jumped[j]):
                    continue
                apart = np.linalg.norm(self.place[i] - self.place[j])
                crossed = max(np.linalg.norm(p[i] - self.place[j]), np.linalg.norm(p[j] - self.place[i]))
                if crossed < SWAPPED * apart:
                    pair, back = [i, j], [j, i]
                    p, q = p.copy(), q.copy()
                    p[pair], q[pair] = p[back], q[back]
                    self._order[pair] = self._order[back]
                    jumped[pair] = False
                    self.rejected["swapped"] += 1
        return p, q, jumped

    def _lasts(self, time: float, p: Array, jumped: Flags) -> Flags:
        """Jumps whose place has been kept, or moved on from as a body does, for long enough."""
        ago = np.minimum(time - self._strange_last, STALE)
        same = jumped & (np.linalg.norm(p - self._strange, axis=1) < JUMP + FASTEST * ago)
        self._strange_since = np.where(same, self._strange_since, np.where(jumped, time, np.inf))
        self._strange[jumped] = p[jumped]
        self._strange_last[jumped] = time
        lasting = jumped & (time - self._strange_since >= LASTING)
        self.forget(lasting)
        return lasting

    def _count(self, time: float, reasons: dict[str, Flags]) -> None:
        now = [""] * len(self._why)
        for reason, rows in reasons.items():
            for k in np.flatnonzero(rows):
                now[k] = now[k] or reason
        for reason, before in zip(now, self._why, strict=True):
            if reason and reason != before:
                self.rejected[reason] += 1
        self._why = now

    def _learn(self, time: float, p: Array, believed: Flags) -> None:
        ago = time - self.time
        again = believed & np.isfinite(ago) & (ago > 0.0)
        step = np.where(again, ago, 1.0)[:, None]
        now = np.where(again[:, None], (p - self.place) / step, 0.0)
        speed = np.linalg.norm(now, axis=1, keepdims=True)
        now *= np.minimum(1.0, FASTEST / np.maximum(speed, 1e-9))
        gain = np.where(again, -np.expm1(-step[:, 0] / MEMORY), 0.0)[:, None]
        self.velocity += gain * (now - self.velocity)
        self.place = np.where(believed[:, None], p, self.place)
        self.time = np.where(believed & ~(ago < 0.0), time, self.time)
