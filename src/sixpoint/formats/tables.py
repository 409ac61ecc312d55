"""Six-point targets as CSV tables.

The header is ``time,pelvis_x,pelvis_y,pelvis_z,head_x,...`` in metres, Y up, with optional world
rotations ``<effector>_qx,_qy,_qz,_qw``. Columns may come in any order; an empty cell or NaN is a lost
point. The rate follows from ``time`` [s], or from a comment ``# rate 60`` above the header.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.targets import EFFECTORS, Targets
from sixpoint.errors import FormatError, TargetError, listed
from sixpoint.formats.markers.tables import find_marker_columns
from sixpoint.formats.source import parse_cells, parse_number, read_lines

Array = NDArray[np.float64]

POSITION_COLUMNS = tuple(f"{effector}_{axis}" for effector in EFFECTORS for axis in "xyz")
ROTATION_COLUMNS = tuple(f"{effector}_q{axis}" for effector in EFFECTORS for axis in "xyzw")
HEADER = ",".join(("time", *POSITION_COLUMNS))

_KNOWN = ("time", "frame", *POSITION_COLUMNS, *ROTATION_COLUMNS)
_RATE = re.compile(r"#\s*rate\s*[:=]?\s*(\S+)\s*\Z", re.IGNORECASE)
MARKERS = "these are markers, not six points; follow them with: sixpoint track"
SHOWN = 12  # names in a message
_SINGLE_RATE = 60.0
_DRIFT = 0.1  # steps by which a time may be off a uniform grid


@dataclass(frozen=True)
class _Table:
    """Cells of a CSV file: column name -> (F,) values, NaN where empty; line numbers of the rows."""

    columns: dict[str, Array]
    lines: list[int]
    rate: float | None


def read_csv(path: Path, rate: float | None = None) -> Targets:
    """Read six-point targets from a CSV file.

    Args:
        path: The file.
        rate: Frames per second [Hz]; by default the file's.

    Raises:
        FormatError: With the line of the first thing that is wrong.
    """
    table = _read_table(path)
    columns = table.columns
    positions = np.stack([columns[name] for name in POSITION_COLUMNS], axis=1).reshape(-1, 6, 3)
    positions[np.isnan(positions).any(axis=2)] = np.nan
    rotations = _read_rotations(path, table)
    return make_targets(path, positions, rate or _find_rate(path, table), rotations)


def _read_table(path: Path) -> _Table:
    rate, header, lines, rows = None, None, [], []
    for number, text in enumerate(read_lines(path), start=1):
        if text.lstrip().startswith("#"):
            match = _RATE.match(text.strip())
            if match:
                rate = _checked_rate(path, number, match[1])
            continue
        if not text.strip():
            continue
        cells = [cell.strip().strip('"').strip() for cell in text.split(",")]
        if header is None:
            header = _check_header(path, number, [cell.lower() for cell in cells])
        elif len(cells) != len(header):
            raise FormatError(
                path, "wrong number of cells", line=number, expected=f"{len(header)}", got=f"{len(cells)}"
            )
        else:
            lines.append(number)
            rows.append(cells)
    if header is None or not rows:
        raise FormatError(path, "the table holds no rows", expected=f"a header and rows: {HEADER}")
    values = parse_cells(path, rows, lines, lambda column: f"a number for {header[column]}")
    return _Table(dict(zip(header, values.T, strict=True)), lines, rate)


def _checked_rate(path: Path, line: int, word: str) -> float:
    rate = parse_number(path, line, word, "rate [Hz]")
    if not 1e-6 <= rate <= 1e6:
        raise FormatError(path, "the rate must be positive", line=line, got=word)
    return rate


def _check_header(path: Path, line: int, names: list[str]) -> list[str]:
    if all(_is_number(name) for name in names):
        raise FormatError(path, f"the table has no header; add this first line: {HEADER}", line=line)
    if len(names) == 1:
        message = f"not a comma-separated table; the header is {HEADER}"
        raise FormatError(path, message, line=line, got=names[0])
    unknown = [name or "(empty)" for name in names if name not in _KNOWN]
    if unknown and not any(name in names for name in POSITION_COLUMNS) and find_marker_columns(path):
        raise FormatError(path, MARKERS, line=line)
    if unknown:
        columns = listed(unknown, SHOWN)
        raise FormatError(path, f"unknown columns: {columns}; columns: {listed(_KNOWN)}", line=line)
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise FormatError(path, f"columns appear twice: {listed(repeated)}", line=line)
    missing = [name for name in POSITION_COLUMNS if name not in names]
    for effector in EFFECTORS:
        parts = [f"{effector}_q{axis}" for axis in "xyzw"]
        present = [name for name in parts if name in names]
        missing += [name for name in parts if present and name not in names]
    if missing:
        raise FormatError(path, f"columns are missing: {listed(missing)}; the header is {HEADER}", line=line)
    return names


def _is_number(word: str) -> bool:
    try:
        float(word or "nan")
    except ValueError:
        return False
    return True


def _read_rotations(path: Path, table: _Table) -> Array | None:
    """World rotations (F, 6, 4), NaN where there are none; None where no effector has any."""
    if not any(name in table.columns for name in ROTATION_COLUMNS):
        return None
    nothing = np.full(len(table.lines), np.nan)
    columns = [table.columns.get(name, nothing) for name in ROTATION_COLUMNS]
    rotations = np.stack(columns, axis=1).reshape(-1, 6, 4)
    frame, effector = find_bad_rotation(rotations)
    if frame is not None:
        raise FormatError(
            path,
            f"the rotation of {EFFECTORS[effector]} is not a unit quaternion (x, y, z, w)",
            line=table.lines[frame],
            got=" ".join(f"{value:g}" for value in rotations[frame, effector]),
        )
    return np.asarray(rotations / np.linalg.norm(rotations, axis=2, keepdims=True))


def find_bad_rotation(rotations: Array) -> tuple[int | None, int]:
    """First (frame, effector) whose quaternion is neither absent nor of about unit length."""
    bad = np.abs(np.linalg.norm(rotations, axis=2) - 1.0) > 0.01
    bad |= np.isnan(rotations).any(axis=2) & ~np.isnan(rotations).all(axis=2)
    if not bad.any():
        return None, 0
    frame, effector = np.argwhere(bad)[0]
    return int(frame), int(effector)


def _find_rate(path: Path, table: _Table) -> float:
    if "frame" in table.columns:
        _check_increasing(path, table, "frame")
    if "time" not in table.columns:
        if table.rate is None:
            raise FormatError(
                path, "the rate is unknown: add a column time [s], or a first line such as '# rate 60'"
            )
        return table.rate
    _check_increasing(path, table, "time")
    if table.rate is not None:
        return table.rate
    return _rate_of_times(path, table.columns["time"])


def _check_increasing(path: Path, table: _Table, name: str) -> None:
    values = table.columns[name]
    steps = np.diff(values, prepend=-np.inf)
    wrong = ~(steps > 0) | ~np.isfinite(values)
    if name == "frame":
        wrong[1:] |= steps[1:] != 1
    if wrong.any():
        k = int(np.argmax(wrong))
        expected = "a number one larger than before" if name == "frame" else "a larger time than before"
        raise FormatError(
            path, f"{name} must increase", line=table.lines[k], expected=expected, got=f"{values[k]:g}"
        )


def _rate_of_times(path: Path, times: Array) -> float:
    if len(times) == 1:
        warnings.warn(f"{path}: a single frame tells no rate; {_SINGLE_RATE:g} Hz is taken", stacklevel=5)
        return _SINGLE_RATE
    step = float(times[-1] - times[0]) / (len(times) - 1)
    drift = np.abs(times - (times[0] + step * np.arange(len(times))))
    if drift.max() > _DRIFT * step:
        step = float(np.median(np.diff(times)))
        warnings.warn(
            f"{path}: the times are not uniform; their median step of {step:g} s is taken for all frames",
            stacklevel=5,
        )
    if not 1e-9 <= step <= 1e9:
        raise FormatError(path, "the times give no sane rate", expected="seconds", got=f"steps of {step:g}")
    rate = 1.0 / step
    return float(round(rate)) if round(rate) and abs(rate - round(rate)) < 1e-5 * rate else rate


def make_targets(path: Path, positions: Array, rate: float, rotations: Array | None) -> Targets:
    """Targets, with what is wrong with them put down to the file."""
    try:
        return Targets(positions, rate, rotations, path.stem)
    except TargetError as error:
        raise FormatError(path, str(error)) from error


def format_csv(targets: Targets) -> str:
    """The text of a CSV file; lost points are empty cells."""
    blocks = [np.arange(len(targets))[:, None] / targets.rate, targets.positions.reshape(-1, 18)]
    names = ["time", *POSITION_COLUMNS]
    if targets.rotations is not None:
        blocks.append(targets.rotations.reshape(-1, 24))
        names += ROTATION_COLUMNS
    row = ",".join(["%.9f"] * len(names))
    lines = [f"# rate {targets.rate!r}"] if len(targets) == 1 else []
    lines.append(",".join(names))
    lines += [(row % tuple(values)).replace("nan", "") for values in np.hstack(blocks).tolist()]
    return "\n".join(lines) + "\n"
