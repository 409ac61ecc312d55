"""``SHA256SUMS``: what the files of a folder were when they were first used.

It is the format of ``sha256sum``, so that everybody can check a folder with ``sha256sum -c SHA256SUMS``.
Comments and entries of other files stay as they are.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from sixpoint.errors import FormatError

SUMS = "SHA256SUMS"
"""The name of the record."""

_ENTRY = re.compile(r"([0-9a-fA-F]{64}) [ *](.+)")


def compute_sha256(path: Path) -> str:
    """The SHA-256 of a file: 64 hexadecimal digits.

    Raises:
        FormatError: It cannot be read.
    """
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise FormatError(path, f"cannot be read: {error.strerror}") from error


def read_sums(path: Path) -> dict[str, str]:
    """Names and hashes of a record; none where there is no file.

    Raises:
        FormatError: It cannot be read, or a line is neither an entry nor a comment.
    """
    found = {}
    for number, line in enumerate(_lines(path), start=1):
        if not line.strip() or line.startswith("#"):
            continue
        entry = _ENTRY.fullmatch(line)
        if entry is None:
            raise FormatError(
                path,
                "not an entry of sha256sum; correct the line, or delete it to record its file anew",
                line=number,
                expected="64 hexadecimal digits, two spaces and a name",
                got=line,
            )
        found[entry[2]] = entry[1].lower()
    return found


def with_sum(path: Path, name: str, digest: str) -> bytes:
    """The content of a record with one entry added or replaced."""
    kept = [line for line in _lines(path) if not ((entry := _ENTRY.fullmatch(line)) and entry[2] == name)]
    return "".join(f"{line}\n" for line in [*kept, f"{digest}  {name}"]).encode()


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text("utf-8").splitlines()
    except FileNotFoundError:
        return []
    except OSError as error:
        raise FormatError(path, f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError:
        raise FormatError(path, "this is not a text file; delete it to record all hashes anew") from None
