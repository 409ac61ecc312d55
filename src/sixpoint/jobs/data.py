"""Fetch public recordings into a folder, with a record of their hashes, so that a study can be repeated.

Nothing is overwritten without ``force``:

| the file is | recorded | not recorded |
|---|---|---|
| here | kept if its hash is the recorded one, else an error | kept, and its hash is recorded as found |
| not here | fetched; an error if its hash is not the recorded one | fetched and recorded |
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from sixpoint.datasets import cmu
from sixpoint.datasets.checksums import SUMS, compute_sha256, read_sums, with_sum
from sixpoint.errors import FormatError, SixpointError
from sixpoint.formats.atomic import write_files
from sixpoint.jobs.progress import Progress, silent

CREDIT_FILE = "CREDIT.txt"
ANEW = "delete it or use --force / force=True to fetch it anew"


class Outcome(StrEnum):
    """What was done about a file."""

    FETCHED = "fetched"
    KEPT = "already here, its hash is the recorded one"
    ADOPTED = "already here, its hash is recorded as found"


@dataclass(frozen=True)
class Fetched:
    """Files that are in the folder now.

    Attributes:
        files: What was done about each.
        credit: What publications should say.
    """

    files: dict[Path, Outcome]
    credit: str


def fetch_cmu(
    trials: Sequence[str],
    out: Path,
    *,
    site: str | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Fetched:
    """Fetch trials of the CMU database: AMC files and the ASF of each subject.

    Args:
        trials: As 17_10 or 17_10.amc.
        out: The folder; it is made. SHA256SUMS and CREDIT.txt are written beside the recordings.
        site: Base URL of a mirror; by default the database's own.
        force: Fetch files anew that are here, and record what arrives.
        progress: Told how far the work is: files, and kilobytes of the present one.

    Raises:
        SixpointError: A trial's name or the folder is wrong, and nothing was fetched; or some files could not
            be had: all others are here and recorded, and the message names each that is not.
    """
    names = cmu.list_files(trials)
    site = cmu.check_site(site or cmu.SITE)
    _prepare_folder(out)
    sums = read_sums(out / SUMS)
    _write_credit(out / CREDIT_FILE)
    done: dict[Path, Outcome] = {}
    failures: list[str] = []
    for number, name in enumerate(names):
        progress("files", number, len(names))
        try:
            done[out / name] = _obtain(out / name, sums.get(name), site, force, progress)
        except (SixpointError, OSError) as error:
            failures.append(f"{name}: {error}")
    progress("files", len(names), len(names))
    if failures:
        others = f" | the others are in {out}" if done else ""
        raise SixpointError(f"{len(failures)} of {len(names)} files failed: {' | '.join(failures)}{others}")
    return Fetched(done, cmu.CREDIT)


def _obtain(path: Path, recorded: str | None, site: str, force: bool, progress: Progress) -> Outcome:
    """Make sure that one file is here and recorded."""
    if path.exists() and not force:
        return _keep(path, recorded)

    def report(done: int, total: int) -> None:
        progress("kB of this file", done // 1000, (total or done) // 1000)

    part = path.with_name(f"{path.name}.part")
    cmu.fetch(path.name, part, site, report)
    digest = compute_sha256(part)
    if recorded not in (None, digest) and not force:
        part.unlink()
        raise SixpointError(
            f"{cmu.locate(path.name, site)}: not the file that was recorded: sha256 {digest}, in {SUMS} "
            f"{recorded}; --force / force=True takes this one and records it"
        )
    _record(path, digest)  # first: a file without a record would be taken for the user's own
    part.replace(path)
    return Outcome.FETCHED


def _keep(path: Path, recorded: str | None) -> Outcome:
    digest = compute_sha256(path)
    if recorded is None:
        flaw = cmu.find_flaw(path)
        if flaw:
            raise FormatError(path, f"{flaw}; {ANEW}")
        _record(path, digest)
        return Outcome.ADOPTED
    if digest != recorded:
        message = f"changed since it was recorded: sha256 {digest}, in {SUMS} {recorded}; {ANEW}"
        raise FormatError(path, message)
    return Outcome.KEPT


def _record(path: Path, digest: str) -> None:
    sums = path.with_name(SUMS)
    write_files({sums: with_sum(sums, path.name, digest)}, force=True)


def _prepare_folder(out: Path) -> None:
    if out.exists() and not out.is_dir():
        raise FormatError(out, "this is a file; recordings need a folder")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FormatError(out, f"the folder cannot be made: {error.strerror}") from error


def _write_credit(path: Path) -> None:
    """Leave the credit with the recordings, after whatever the user keeps in that file.

    It comes before all fetching, so that a folder that cannot be written is found out first.
    """
    kept = path.read_bytes() if path.exists() else b""
    credit = cmu.CREDIT.encode()
    if credit not in kept:
        gap = b"\n" if kept and not kept.endswith(b"\n") else b""
        write_files({path: kept + gap + credit + b"\n"}, force=True)
