"""The CMU Graphics Lab Motion Capture Database: its trials, where their files are, and to whom credit is due.

A trial such as 17_10 is the tenth of subject 17: its motion is ``17_10.amc``, its skeleton ``17.asf``.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections.abc import Iterable
from pathlib import Path
from urllib.parse import urlsplit

from sixpoint.datasets.download import NotOnServerError, Report, download
from sixpoint.errors import SixpointError, listed

SITE = "http://mocap.cs.cmu.edu"
CREDIT = (
    "The data used in this project was obtained from mocap.cs.cmu.edu. "
    "The database was created with funding from NSF EIA-0196217."
)
"""What the lab asks users to say in publications."""

_TRIAL = re.compile(r"(([0-9]{2,})_[0-9]{2,})(\.amc)?", re.IGNORECASE)


def list_files(trials: Iterable[str]) -> list[str]:
    """Names of the files of trials: the subject's ASF, then the AMC; each once.

    Raises:
        SixpointError: A name is not that of a trial, or there is none.
    """
    trials = list(trials)
    matches = [_TRIAL.fullmatch(trial) for trial in trials]
    bad = [repr(trial) for trial, match in zip(trials, matches, strict=True) if match is None]
    if bad or not trials:
        got = f"not a trial: {listed(bad)}" if bad else "no trial given"
        raise SixpointError(f"{got}; trials are named subject_trial, two digits or more each: 17_10")
    files = [name for match in matches if match for name in (f"{match[2]}.asf", f"{match[1]}.amc")]
    return list(dict.fromkeys(files))


def check_site(site: str) -> str:
    """A base URL without slashes at its end.

    Raises:
        SixpointError: It is not an http or https URL of plain ASCII.
    """
    try:
        parts = urlsplit(site)
        good = parts.scheme in ("http", "https") and parts.hostname and parts.port != 0
    except ValueError:  # a bad port or bracket
        good = False
    if not good or parts.query or parts.fragment or not re.fullmatch("[!-~]+", site):
        raise SixpointError(f"not a base URL: {site!r}; it looks like {SITE} (http or https, then a host)")
    return site.rstrip("/")


def locate(name: str, site: str) -> str:
    """The URL of a file of ``list_files`` below a base URL."""
    subject = re.split("[_.]", name)[0]
    return f"{site}/subjects/{subject}/{name}"


def fetch(name: str, part: Path, site: str, report: Report) -> None:
    """Bring one file into ``part``; an earlier transfer that was cut goes on.

    Args:
        name: One of ``list_files``.
        part: Where to.
        site: Base URL.
        report: Told how far the transfer is.

    Raises:
        SixpointError: It is not there, did not arrive whole (what did stays in ``part``), or is no recording
            (``part`` is removed).
    """
    url = locate(name, site)
    try:
        download(url, part, report)
    except NotOnServerError as error:
        raise SixpointError(f"{error}; is there such a trial? They are listed at {SITE}") from None
    flaw = find_flaw(part)
    if flaw:
        part.unlink()
        raise SixpointError(f"{url}: {flaw}; open the address in a browser to see why")


def find_flaw(path: Path) -> str:
    """What a file is if it is neither ASF nor AMC, whose first line that is no comment starts with a colon.

    Returns:
        Nothing if it is one; else the words for a message.
    """
    with path.open("rb") as stream:
        lines = (line.removeprefix(BOM_UTF8).strip() for line in stream)
        first = next((line for line in lines if line and not line.startswith(b"#")), b"")
    if first.startswith(b":"):
        return ""
    if not first:
        return "not a recording but an empty file"
    what = "a web page" if first.startswith(b"<") else repr(first[:40].decode("latin-1"))
    return f"not a recording but {what} (ASF and AMC begin with a line such as ':version 1.10')"
