"""Where reports wait: put in by any thread, taken out by one."""

from __future__ import annotations

import threading
from collections.abc import Hashable
from typing import Any

MOST = 256
"""Reports that wait; more are dropped."""
NUMBERED = ("drag", "obstacle", "setting", "show obstacle")
"""Reports whose value begins with what they are about."""
SINGLE = ("task", "play", "save pose", "save motion")
"""Reports that do not replace each other."""


class Inbox:
    """Reports in their order; of those that are about the same thing the newest."""

    def __init__(self) -> None:
        self._reports: dict[Hashable, tuple[str, Any]] = {}
        self._changed = threading.Condition()
        self._count, self._closed = 0, False

    def put(self, name: str, value: Any) -> None:
        """Take a report, from any thread; returns at once."""
        with self._changed:
            self._count += 1
            about = self._count if name in SINGLE else value[0] if name in NUMBERED else None
            if (name, about) in self._reports or len(self._reports) < MOST:
                self._reports[name, about] = (name, value)
            self._changed.notify()

    def take(self) -> list[tuple[str, Any]]:
        """All that waits."""
        with self._changed:
            reports, self._reports = list(self._reports.values()), {}
        return reports

    def wait(self, seconds: float) -> None:
        """Sleep until something comes, at most so long [s]."""
        with self._changed:
            if not self._reports and not self._closed:
                self._changed.wait(seconds)

    @property
    def closed(self) -> bool:
        """Whether nobody takes reports any more."""
        return self._closed

    def close(self) -> None:
        """End the waiting for good."""
        with self._changed:
            self._closed = True
            self._changed.notify()
