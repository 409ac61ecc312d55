"""How a live session goes: rates, times and what was dropped, over a window, in memory that does not grow."""

from __future__ import annotations

from collections import Counter

import numpy as np

WINDOW = 1024  # poses that times are kept of
MOST_REASONS = 20  # different reasons for dropping that are told apart


class Statistics:
    """Numbers of one channel.

    Attributes:
        counts: Drops by reason.
        poses: Number of poses.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.poses = 0
        self._times = np.full(WINDOW, np.nan)
        self._solving = np.full(WINDOW, np.nan)
        self._latency = np.full(WINDOW, np.nan)

    def count(self, what: str) -> None:
        """One more of something."""
        self.counts[what] += 1

    def drop(self, reason: str) -> None:
        """A packet that was dropped; rare reasons beyond the first twenty are counted together."""
        what = f"packets dropped: {reason}"
        known = what in self.counts or len(self.counts) < MOST_REASONS
        self.counts[what if known else "packets dropped: other reasons"] += 1

    @property
    def dropped(self) -> int:
        """Packets that said nothing to us."""
        return sum(n for what, n in self.counts.items() if what.startswith("packets"))

    def posed(self, now: float, solving: float, latency: float | None) -> None:
        """A pose was solved and sent.

        Args:
            now: When [s].
            solving: Time of the solver and what is around it [s].
            latency: From the last packet of the set to the last datagram sent [s]; None where the timer
                asked for the pose.
        """
        k = self.poses % WINDOW
        self._times[k], self._solving[k] = now, solving
        self._latency[k] = np.nan if latency is None else latency
        self.poses += 1

    @property
    def rate(self) -> float:
        """Poses a second over the window [Hz]."""
        known = self._times[np.isfinite(self._times)]
        span = float(np.ptp(known)) if len(known) > 1 else 0.0
        return (len(known) - 1) / span if span > 0 else 0.0

    def percentile(self, what: str, share: float) -> float:
        """A percentile of "solving" or "latency" over the window [s]; NaN where nothing is known."""
        values = {"solving": self._solving, "latency": self._latency}[what]
        values = values[np.isfinite(values)]
        return float(np.percentile(values, share)) if len(values) else float("nan")

    def line(self) -> str:
        """One line for the terminal."""
        if not self.poses:
            return f"nothing arrived, {self.dropped} packets dropped" if self.dropped else "nothing arrived"
        solving, latency = (1e3 * self.percentile(w, p) for w, p in (("solving", 50), ("latency", 99)))
        text = f"{self.rate:5.1f} poses/s, solving {solving:.2f} ms, latency p99 {latency:.2f} ms"
        return f"{text}, {self.dropped} packets dropped" if self.dropped else text
