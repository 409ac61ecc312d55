"""The folder of a comparison: the results of this study, and all rows and curves that are known, by key."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from sixpoint.body.motion import Motion
from sixpoint.errors import FormatError
from sixpoint.formats.atomic import write_files
from sixpoint.jobs.compare.run import OpenClip
from sixpoint.jobs.writing import prepare_folder
from sixpoint.study.comparison.model import Row, Run
from sixpoint.study.comparison.results import check_version, is_results, rows_from_csv, rows_to_csv

RESULTS, KNOWN, RUNS, DRAWN = "results.csv", "runs/known.csv", "runs", "runs/report.key"
DAMAGED = (OSError, ValueError, KeyError, BadZipFile, EOFError)


def curves_path(out: Path, key: str) -> Path:
    """Where the curves of a row are."""
    return out / RUNS / f"{key}.npz"


def write_curves(out: Path, key: str, run: Run) -> Path:
    """Write what is drawn of a row, whole or not at all; several processes may do it at once."""
    data = io.BytesIO()
    np.savez_compressed(
        data,
        position=run.position,
        orientation=run.orientation,
        rotations=run.sample.rotations,
        translations=run.sample.translations,
        moving=np.array(run.sample.moving),
    )
    path = curves_path(out, key)
    write_files({path: data.getvalue()}, force=True)
    return path


class Store:
    """Rows and curves of a folder; a row that is not whole counts as unknown.

    Args:
        out: The folder; it is made.
        force: Begin again in a folder with results, or write into one that is not ours.
        ours: The folder is known to be ours, though it has no results yet.

    Raises:
        FormatError: The folder is not ours, or holds results of another version.
    """

    def __init__(self, out: Path, force: bool, *, ours: bool = False) -> None:
        self.out = out
        results, known = out / RESULTS, out / KNOWN
        ours = ours or is_results(results) or is_results(known)
        prepare_folder(out, force, ours=ours)
        self.rows: dict[str, Row] = {}
        if not force:
            for path in (results, known):
                if is_results(path):
                    check_version(path)
            if is_results(known):
                self.rows = {row.key: row for row in rows_from_csv(known)}
        try:
            (out / RUNS).mkdir(exist_ok=True)
        except OSError as error:
            raise FormatError(out / RUNS, f"the folder cannot be made: {error.strerror}") from error
        self._write(KNOWN, list(self.rows.values()))

    def find(self, key: str) -> Row | None:
        """A known row that has a result; what failed is tried again."""
        row = self.rows.get(key)
        if row is None or row.error:
            return None
        try:
            with np.load(self._curves(key)) as data:
                whole = len(data["position"]) == row.frames
        except DAMAGED:
            return None
        return row if whole else None

    def keep(self, row: Row, run: Run | None) -> None:
        """Keep a row and what is drawn of it, whole or not at all."""
        if run is not None:
            write_curves(self.out, row.key, run)
        self.keep_rows([row])

    def keep_rows(self, rows: Sequence[Row]) -> None:
        """Keep rows whose curves were written before."""
        self.rows |= {row.key: row for row in rows}
        self._write(KNOWN, list(self.rows.values()))

    def load(self, row: Row, opened: OpenClip) -> Run:
        """What is drawn of a row."""
        with np.load(self._curves(row.key)) as data:
            moving = tuple(int(j) for j in data["moving"])
            sample = Motion(
                opened.truth.skeleton,
                data["rotations"],
                data["translations"],
                opened.truth.rate,
                moving,
                name=row.method,
            )
            return Run(data["position"], data["orientation"], sample)

    def write_results(self, rows: Sequence[Row]) -> None:
        """The rows of this study, as far as there are any."""
        self._write(RESULTS, rows)

    def is_drawn(self, stamp: str, files: Sequence[Path]) -> bool:
        """Whether the report was made of the same."""
        try:
            return all(file.is_file() for file in files) and (self.out / DRAWN).read_text("utf-8") == stamp
        except (OSError, UnicodeDecodeError):
            return False

    def set_drawn(self, stamp: str) -> None:
        """Remember what the report was made of."""
        write_files({self.out / DRAWN: stamp.encode()}, force=True)

    def _curves(self, key: str) -> Path:
        return curves_path(self.out, key)

    def _write(self, name: str, rows: Sequence[Row]) -> None:
        write_files({self.out / name: rows_to_csv(rows).encode()}, force=True)
