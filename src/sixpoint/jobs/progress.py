"""How a job says how far it is: a callback with what it does, how much is done, and of how much."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""Called with (what is done, done so far, in total)."""


def silent(what: str, done: int, total: int) -> None:
    """Report nothing."""
