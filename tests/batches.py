"""Small libraries, and methods that kill their process or take their time, for tests of batches."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

import sixpoint as sp

METHODS = '''
import os, signal, time
from pathlib import Path

import sixpoint as sp


class Deadly(sp.SequentialIK):
    """Kills its process at "poison" always, at "victim" once."""

    def solve_frames(self, targets, progress=None):
        mark = Path("victim.mark")
        if targets.name == "poison" or (targets.name == "victim" and len(targets) > 2 and not mark.exists()):
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().solve_frames(targets, progress)


class Slow(sp.SequentialIK):
    """Takes its time for a file."""

    def solve_frames(self, targets, progress=None):
        time.sleep(0.3)
        return super().solve_frames(targets, progress)
'''


def make_library(folder: Path, names: Iterable[str], frames: int = 12) -> Path:
    """Motions of different content and length in a folder, by their paths below it."""
    for number, name in enumerate(names):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        sample = list(sp.SAMPLES)[number % len(sp.SAMPLES)]
        motion = sp.make_sample(sample).sliced(slice(number, number + frames + number))
        sp.save(motion, path)
    return folder


def results(out: Path) -> dict[str, bytes]:
    """What a batch has written but for its summary and records, which have times."""
    files = (path for path in out.rglob("*") if path.is_file() and ".batch" not in path.parts)
    return {str(p.relative_to(out)): p.read_bytes() for p in files if p.name != "summary.csv"}


def records(out: Path) -> dict[str, str]:
    """File -> status, of the records."""
    found = [json.loads(path.read_bytes()) for path in (out / ".batch" / "records").rglob("*.json")]
    return {row["name"]: row["status"] for row in found}


def leftovers(out: Path) -> list[Path]:
    """Temporary files."""
    return list(out.rglob(".*.tmp"))
