"""One file over HTTP: whole, or an error and a beginning to go on from.

What has arrived lies in a ``.part`` file; the next call asks for the rest of it (``Range``). Its date is the
server's date of the file (as wget keeps it), and goes back as ``If-Range``: a server whose file is another by
now answers with all of it, so that two versions are never joined.

Why not pooch: it downloads to a temporary file and deletes that after any failure, so nothing could be
resumed. What is left to do then needs no library beyond Python's own.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Callable, Iterator
from email.utils import formatdate, parsedate_to_datetime
from http import HTTPStatus
from http.client import HTTPException, HTTPResponse
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

from sixpoint.errors import FormatError, SixpointError

TIMEOUT = 30.0
"""How long to wait for the server to say anything [s]."""
CHUNK = 1 << 14
"""How much is asked of the connection at once [bytes]."""
AGAIN = "run again to go on from there"

_EXTENT = re.compile(r"bytes ([0-9]+)-[0-9]+/([0-9]+)")

Report = Callable[[int, int], None]
"""Called with (bytes that are here, bytes in total; 0 where the server does not say)."""


class NotOnServerError(SixpointError):
    """The server answers, but has no such file (404)."""


def download(url: str, part: Path, report: Report) -> None:
    """Bring a file into ``part``, from where an earlier call was cut.

    Args:
        url: The file; http or https.
        part: Where to; afterwards the whole file. Its folder exists.
        report: Told how far the transfer is.

    Raises:
        NotOnServerError: The server has no such file.
        SixpointError: The server cannot be reached, refuses, or the transfer was cut; what arrived stays in
            ``part``.
        FormatError: ``part`` cannot be written.
    """
    try:
        with _ask(url, part) as answer:
            total = _receive(answer, url, part, report)
        size = _size(part)
    except OSError as error:  # those of the network are SixpointErrors by now
        raise FormatError(part, f"cannot be written: {error.strerror or error}") from error
    if total and size != total:
        raise SixpointError(f"{url}: the transfer ended after {size} of {total} bytes; {AGAIN}")


def _ask(url: str, part: Path) -> HTTPResponse:
    """The answer to a request for what ``part`` lacks, or for the whole file if it lacks all."""
    request = Request(url, headers={"User-Agent": "sixpoint"})
    here = _size(part)
    if here:
        request.add_header("Range", f"bytes={here}-")
        request.add_header("If-Range", formatdate(part.stat().st_mtime, usegmt=True))
    try:
        answer: HTTPResponse = urlopen(request, timeout=TIMEOUT)
    except HTTPError as error:
        error.close()
        if here and error.code == HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE:  # nothing comes after it
            part.unlink()
            return _ask(url, part)
        if error.code == HTTPStatus.NOT_FOUND:
            raise NotOnServerError(f"{url}: not on the server (404)") from None
        raise SixpointError(f"{url}: the server answers {error.code} {error.reason}") from None
    except (OSError, HTTPException) as error:
        hint = "check the network and the address"
        raise SixpointError(f"{url}: cannot be reached: {_reason(error)}; {hint}") from None
    return answer


def _receive(answer: HTTPResponse, url: str, part: Path, report: Report) -> int:
    """Write what arrives; returns the size of the whole file [bytes], 0 if the server does not say."""
    done = 0
    length = answer.headers.get("Content-Length", "")
    total = int(length) if length.isdecimal() else 0
    if answer.status == HTTPStatus.PARTIAL_CONTENT:
        extent = _EXTENT.fullmatch(answer.headers.get("Content-Range", ""))
        if extent is None or int(extent[1]) not in (0, _size(part)):
            part.unlink(missing_ok=True)
            raise SixpointError(f"{url}: the server sends another part than asked for; run again to get all")
        done, total = int(extent[1]), int(extent[2])
    report(done, total)
    try:
        with part.open("ab" if done else "wb") as stream:
            for chunk in _chunks(answer, url):
                stream.write(chunk)
                done += len(chunk)
                report(done, total)
    finally:
        _keep_date(answer, part)
    return total


def _chunks(answer: HTTPResponse, url: str) -> Iterator[bytes]:
    while True:
        try:
            chunk = answer.read(CHUNK)
        except (OSError, HTTPException) as error:
            raise SixpointError(f"{url}: the transfer broke off: {_reason(error)}; {AGAIN}") from None
        if not chunk:
            return
        yield chunk


def _keep_date(answer: HTTPResponse, part: Path) -> None:
    """Give ``part`` the server's date of the file; its own matches none, so that all would be sent again."""
    with contextlib.suppress(TypeError, ValueError, OSError):
        date = parsedate_to_datetime(answer.headers.get("Last-Modified", "")).timestamp()
        os.utime(part, (date, date))


def _size(path: Path) -> int:
    """Of a file [bytes]; 0 if there is none."""
    return path.stat().st_size if path.exists() else 0


def _reason(error: Exception) -> str:
    """What was wrong with the network, in words."""
    inner = getattr(error, "reason", error)
    if isinstance(inner, TimeoutError):
        return f"no answer within {TIMEOUT:g} s"
    return getattr(inner, "strerror", None) or str(inner) or type(inner).__name__
