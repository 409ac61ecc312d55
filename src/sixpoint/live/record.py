"""Recordings of live sessions: every datagram as it came, with time and source, so that it replays exactly.

A text file: a line that says what it is, then a JSON object per datagram, its bytes in base64. It can be
appended to, and read while it is written. A session that was cut leaves half a line: it is noticed, and the
rest is read.
"""

from __future__ import annotations

import base64
import binascii
import json
import math
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import IO, NamedTuple

from sixpoint.errors import FormatError
from sixpoint.live.osc import MAX_SIZE

VERSION = 1
_HEADER = {"sixpoint": "live recording", "version": VERSION}
_LONGEST = 2 * MAX_SIZE  # of a line [bytes]: the largest datagram in base64, and what stands around it


class Datagram(NamedTuple):
    """One datagram as it came.

    Attributes:
        time: Arrival [s], on one clock for the whole recording.
        protocol: What it was read as: "vmc", "vrchat" or "plain".
        source: Who sent it, ``"127.0.0.1:50123"``.
        data: Its bytes.
    """

    time: float
    protocol: str
    source: str
    data: bytes


class RecordingWriter:
    """Writes datagrams to a file; each is flushed, so that a crash loses none that was written.

    Args:
        path: The file.
        append: Go on with a recording that exists; half a line at its end is cut off. Else it must not exist.

    Raises:
        FormatError: The file exists, is no recording, or cannot be written.
    """

    def __init__(self, path: str | Path, *, append: bool = False) -> None:
        self.path = Path(path)
        try:
            if append and self.path.exists() and self.path.stat().st_size:
                end = _end_of_lines(self.path)
                self._file: IO[bytes] = self.path.open("r+b")
                self._file.truncate(end)
                self._file.seek(end)
                return
            self._file = self.path.open("ab" if append else "xb")
            self._write(_HEADER)
        except FileExistsError:
            raise FormatError(self.path, "exists; append to it, or give another name") from None
        except (OSError, ValueError) as error:
            raise FormatError(self.path, f"cannot be written: {error}") from None

    def write(self, datagram: Datagram) -> None:
        """Add one datagram.

        Raises:
            FormatError: The disk is full, or the file is closed.
        """
        data = base64.b64encode(datagram.data).decode("ascii")
        line = {"t": float(datagram.time), "as": datagram.protocol, "from": datagram.source, "data": data}
        try:
            self._write(line)
        except (OSError, ValueError) as error:
            raise FormatError(self.path, f"cannot be written: {error}") from None

    def _write(self, line: dict[str, object]) -> None:
        self._file.write(json.dumps(line, separators=(",", ":"), allow_nan=False).encode() + b"\n")
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class Recording:
    """A recorded session; iterate over it for its datagrams, as often as you like.

    Attributes:
        path: The file.
        cut: After an iteration: whether the last line is half a line, which was left out.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.cut = False

    def __iter__(self) -> Iterator[Datagram]:
        """The datagrams in the order they came.

        Raises:
            FormatError: The file cannot be read, is no recording, or a line before the last is damaged.
        """
        self.cut = False
        try:
            with self.path.open("rb") as file:
                _read_header(self.path, file)
                number = 1
                while line := file.readline(_LONGEST):
                    number += 1
                    if not line.endswith(b"\n") and len(line) < _LONGEST:
                        self.cut = True
                        return
                    yield _parse(self.path, line, number)
        except OSError as error:
            raise FormatError(self.path, f"cannot be read: {error.strerror or error}") from None


def _read_header(path: Path, file: IO[bytes]) -> None:
    line = file.readline(200)
    try:
        header = json.loads(line) if line.endswith(b"\n") else None
    except (ValueError, RecursionError):
        header = None
    if not isinstance(header, dict) or header.get("sixpoint") != _HEADER["sixpoint"]:
        raise FormatError(path, "no recording of a live session", line=1, expected=json.dumps(_HEADER))
    if header.get("version") != VERSION:
        raise FormatError(
            path,
            "a version that is not known here",
            line=1,
            expected=str(VERSION),
            got=str(header.get("version")),
        )


def _parse(path: Path, line: bytes, number: int) -> Datagram:
    try:
        entry = json.loads(line)
        time = float(entry["t"])
        data = base64.b64decode(entry["data"], validate=True)
        texts = entry["as"], entry["from"]
        if not all(isinstance(text, str) for text in texts) or not math.isfinite(time):
            raise ValueError("values of the wrong type")
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError, binascii.Error) as error:
        raise FormatError(
            path,
            f"a damaged line: {error}",
            line=number,
            expected='{"t": seconds, "as": protocol, "from": source, "data": base64}',
            got=line[:60].decode("ascii", "replace"),
        ) from None
    return Datagram(time, *texts, data)


def _end_of_lines(path: Path) -> int:
    """Where the last whole line of a recording ends [bytes]."""
    with path.open("rb") as file:
        _read_header(path, file)
        size = file.seek(0, 2)
        start = max(0, size - _LONGEST)
        file.seek(start)
        return start + file.read().rfind(b"\n") + 1
