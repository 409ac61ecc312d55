"""The errors sixpoint raises: each says what is wrong, where, and what would have worked.

Wrong *constructions* (a file, a rig, a mapping, an option) raise. A wrong *world* (an
unreachable target, a lost tracker) never does: solvers report it as a status.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path


class SixpointError(Exception):
    """Base of every error that sixpoint raises on purpose."""


class SkeletonError(SixpointError):
    """A skeleton, pose or motion is inconsistent (parents, shapes, names, non-finite numbers)."""


class FigureError(SixpointError):
    """A rig's anatomy could not be found, or a figure was asked for with impossible lengths."""


class TargetError(SixpointError):
    """Six-point targets have the wrong shape, names or numbers."""


class FormatError(SixpointError):
    """A file cannot be read or written.

    Args:
        path: The file.
        message: What is wrong, and what would work.
        line: 1-based line number, 0 where a line makes no sense.
        expected: What the reader expected there.
        got: What it found there (shortened).
    """

    def __init__(
        self, path: str | Path, message: str, *, line: int = 0, expected: str = "", got: str = ""
    ) -> None:
        self.path = Path(path)
        self.line = line
        self.expected = expected
        self.got = got if len(got) <= 60 else got[:57] + "..."
        where = f"{self.path}:{line}" if line else f"{self.path}"
        text = f"{where}: {message}"
        if expected:
            text += f" (expected {expected}" + (f", got {self.got!r})" if got else ")")
        super().__init__(text)


class PacketError(SixpointError):
    """A datagram is not what its protocol says: damaged, cut, oversized or mistyped. It is to be dropped."""


class OscError(PacketError):
    """Bytes are not Open Sound Control, or a message cannot be written as such.

    Args:
        message: What is wrong.
        offset: Where in the datagram [bytes]; None where a message was to be written.
        expected: What would have been right there.
    """

    def __init__(self, message: str, *, offset: int | None = None, expected: str = "") -> None:
        self.offset = offset
        self.expected = expected
        where = "" if offset is None else f"byte {offset}: "
        super().__init__(f"{where}{message}" + (f" (expected {expected})" if expected else ""))


class Remark(UserWarning):
    """What a reader assumed, renamed or left out: the result stands. Commands show it as a note."""


def listed(names: Iterable[str], limit: int = 60) -> str:
    """Join names for a message; after ``limit`` names, say how many more there are."""
    names = list(names)
    shown = ", ".join(names[:limit])
    return shown + (f", ... ({len(names) - limit} more)" if len(names) > limit else "")
