"""Which files a batch is of: patterns to files, each with its place in the library and one for its result."""

from __future__ import annotations

import glob
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from sixpoint.errors import FormatError, SixpointError, listed
from sixpoint.formats import MARKER_SUFFIXES
from sixpoint.jobs.batch.folder import read_marker

WILD = re.compile(r"[*?\[]")
COUNTED = 100_000  # files that are looked at for the message that nothing was found


@dataclass(frozen=True)
class Library:
    """The files of a batch.

    Attributes:
        root: The folder that they are named from; absolute.
        files: Absolute, sorted, each once.
        notes: What was found and left out.
        stems: Of the readable files in folders that were looked at.
    """

    root: Path
    files: tuple[Path, ...]
    notes: tuple[str, ...] = ()
    stems: dict[Path, Counter[str]] = field(default_factory=dict, repr=False)

    def name(self, file: Path) -> str:
        """A file's path within the library, with slashes."""
        return file.relative_to(self.root).as_posix()

    def target(self, file: Path, suffix: str, readable: Sequence[str]) -> str:
        """Where the result of a file goes, within the folder of the batch: its path with another suffix.

        Where another readable file differs only in its suffix (``walk.bvh`` beside ``walk.csv``), the suffix
        stays before the new one. So no two results meet, whichever files a pattern takes.
        """
        folder = self.stems.get(file.parent)
        if folder is None:
            names = (Path(name) for name in os.listdir(file.parent))  # noqa: PTH208  fast
            stems = (name.stem.casefold() for name in names if name.suffix.lower() in readable)
            folder = self.stems[file.parent] = Counter(stems)
        stem = file.name if folder[file.stem.casefold()] > 1 else file.stem
        return Path(self.name(file)).with_name(stem + suffix).as_posix()


def find_files(patterns: Sequence[str], suffixes: Sequence[str], out: Path) -> Library:
    """Find the files that patterns name: ``library/**/*.amc``, files, or folders with all below them.

    What a batch has written is never taken, nor what the job cannot read; a file is taken once, whatever
    patterns and links lead to it.

    Args:
        patterns: As of a shell; ``**`` is any number of folders. A file or folder that is there by that very
            name, brackets and all, is meant itself.
        suffixes: Of files that the job reads.
        out: The folder to write into.

    Raises:
        FormatError, SixpointError: There is no such file; the message says what is there.
    """
    if not patterns:
        raise SixpointError("no files: give a pattern such as 'library/**/*.amc', files, or folders")
    bases, found = [], list[Path]()
    for pattern in patterns:
        base, files = _expand(pattern, suffixes)
        bases.append(base)
        found += files
    library = Path(os.path.commonpath(bases))
    marker = read_marker(out)
    if marker is not None and all(file.is_relative_to(marker["library"]) for file in found):
        library = Path(marker["library"])  # a part of what the folder is a batch of
    out = out.resolve()
    if library.resolve().is_relative_to(out):
        raise FormatError(out, f"is, or holds, the library {library}: choose a folder of its own")
    seen: dict[Path, Path] = {}
    kinds: Counter[str] = Counter()
    made = twice = 0
    is_made = _made_by_batches(out, library)
    for file in sorted(dict.fromkeys(found)):
        if is_made(file.parent):
            made += 1
        elif file.suffix.lower() not in suffixes:
            kinds[file.suffix.lower() or "(none)"] += 1
        elif file.resolve() in seen:
            twice += 1
        else:
            seen[file.resolve()] = file
    notes = []
    if kinds:
        notes.append(f"left out {_count(kinds)}: this job reads {listed(suffixes)}")
    if made:
        notes.append(f"left out {made} files that batches have written")
    if twice:
        notes.append(f"{twice} links to files that are there already")
    if not seen:
        hint = _hint(set(kinds), suffixes)
        raise SixpointError(f"nothing to do for {listed(patterns)} in {library}: {'; '.join(notes)}{hint}")
    return Library(library, tuple(sorted(seen.values())), tuple(notes))


def _expand(pattern: str, suffixes: Sequence[str]) -> tuple[Path, list[Path]]:
    """The folder that a pattern searches, and the files it names; absolute."""
    if not pattern:
        raise SixpointError("a pattern is empty: give files, or . for all below this folder")
    path = Path(os.path.abspath(Path(pattern).expanduser()))  # noqa: PTH100  links stay: they are the names
    if path.is_file():
        if path.suffix.lower() not in suffixes:
            hint = _hint({path.suffix.lower()}, suffixes)
            raise FormatError(
                path, f"this job does not read {path.suffix or 'it'}; it reads {listed(suffixes)}{hint}"
            )
        return path.parent, [path]
    if path.is_dir():
        files = [file for file in _walk(path) if file.suffix.lower() in suffixes]
        if not files:
            hint = _hint({file.suffix.lower() for file in _walk(path)}, suffixes)
            raise FormatError(
                path, f"no file that this job reads ({listed(suffixes)}): {_contents(path)}{hint}"
            )
        return path, files
    parts = path.parts
    wild = [k for k, part in enumerate(parts) if WILD.search(part) and not Path(*parts[: k + 1]).exists()]
    if not wild:
        raise FormatError(path, "there is no such file or folder")
    base, rest = Path(*parts[: wild[0]]), Path(*parts[wild[0] :])
    names = glob.iglob(f"{glob.escape(str(base))}/{rest}", recursive=True)  # noqa: PTH207  hidden ones are left out
    files = [Path(name) for name in names]
    files = [file for file in files if file.is_file()]
    if not files:
        raise SixpointError(f"no file matches {pattern!r}: searched {base}, {_contents(base)}")
    return base, files


def _walk(folder: Path) -> Iterable[Path]:
    """Files below a folder; hidden ones are left out."""
    names = glob.iglob(f"{glob.escape(str(folder))}/**", recursive=True)  # noqa: PTH207
    return (Path(name) for name in names if Path(name).is_file())


def _contents(folder: Path) -> str:
    """What is below a folder, in words."""
    if not folder.is_dir():
        return "which does not exist" if not folder.exists() else "which is a file"
    kinds: Counter[str] = Counter()
    for number, file in enumerate(_walk(folder)):
        kinds[file.suffix or "(no suffix)"] += 1
        if number >= COUNTED:
            break
    return f"which holds {_count(kinds)}" if kinds else "which holds no files"


def _hint(found: set[str], suffixes: Sequence[str]) -> str:
    """The job that follows markers, where there are files of them that this one does not read."""
    return "; markers are followed with --job track" if found & (set(MARKER_SUFFIXES) - set(suffixes)) else ""


def _count(kinds: Counter[str]) -> str:
    return listed([f"{count} {kind}" for kind, count in kinds.most_common()], 12)


def _made_by_batches(out: Path, root: Path) -> Callable[[Path], bool]:
    """Tells whether a folder is, or is in, that of this batch or of another; asks once for each."""

    @cache
    def is_made(folder: Path) -> bool:
        if folder.resolve() == out or read_marker(folder) is not None:
            return True
        return folder.resolve().is_relative_to(out) or (
            folder != root and folder.is_relative_to(root) and is_made(folder.parent)
        )

    return is_made
