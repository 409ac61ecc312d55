"""Markers as a file has them, before units and axes are settled, and what is said about them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.markers.recording import Event
from sixpoint.errors import FormatError, listed
from sixpoint.formats.source import LARGEST

Array = NDArray[np.float64]


@dataclass(eq=False)
class RawMarkers:
    """What a reader found, in the file's unit and axes.

    Attributes:
        names: M labels as they stand in the file; they may repeat or be empty.
        positions: (F, M, 3) in file units; NaN in gaps.
        rate: Frames per second [Hz]; None where the file does not say.
        residuals: (F, M) in file units; None where there are none.
        events: In order of time [s], from the first frame.
        unit: The unit that the file states, as it spells it; empty where it states none.
        up: The up axis that the file states ("y", "-z", ...); empty where it states none.
        usual_up: The up axis of most files of this format.
        notes: What was assumed or left out, for the user.
    """

    names: list[str]
    positions: Array
    rate: float | None
    residuals: Array | None = None
    events: tuple[Event, ...] = ()
    unit: str = ""
    up: str = ""
    usual_up: str = "y"
    notes: list[str] = field(default_factory=list)


def mend_names(raw: RawMarkers) -> None:
    """Make labels distinct and none empty; what was changed is noted."""
    empty = [k for k, name in enumerate(raw.names) if not name.strip()]
    names = [name.strip() or f"unlabelled_{k + 1}" for k, name in enumerate(raw.names)]
    if empty:
        raw.notes.append(
            f"{_points(len(empty))} without a label: named {listed([names[k] for k in empty], 5)}"
        )
    taken = set(names)
    seen: set[str] = set()
    renamed = []
    for k, name in enumerate(names):
        number = 2
        while names[k] in seen:
            if (fresh := f"{name}_{number}") not in taken:
                renamed.append(f"{name} (now {fresh})")
                names[k] = fresh
                taken.add(fresh)
            number += 1
        seen.add(names[k])
    if renamed:
        raw.notes.append(f"labels that repeat: {listed(renamed, 8)}")
    raw.names = names


def open_gaps(path: Path, raw: RawMarkers) -> None:
    """Samples that cannot be true become gaps: incomplete, exactly at the origin, or beyond all sizes."""
    positions = raw.positions
    with np.errstate(invalid="ignore"):
        whole = np.all(np.isfinite(positions), axis=2)
        origin = np.all(positions == 0.0, axis=2)
        huge = np.any(np.abs(positions) > LARGEST, axis=2) & whole
    if origin.any():
        raw.notes.append(f"{int(origin.sum())} samples exactly at 0 0 0 are taken for gaps")
    if huge.any():
        raw.notes.append(f"{int(huge.sum())} samples are far too large and taken for gaps")
    positions[~whole | origin | huge] = np.nan
    if not np.isfinite(positions).any():
        raise FormatError(path, f"no marker is seen in any frame ({_points(len(raw.names))}, all gaps)")
    if raw.residuals is not None:
        raw.residuals[np.isnan(positions[..., 0])] = np.nan
        if not np.nan_to_num(raw.residuals).any():
            raw.residuals = None
    never = [name for k, name in enumerate(raw.names) if np.isnan(positions[:, k]).all()]
    if never:
        raw.notes.append(f"never seen: {listed(never, 20)}")


def _points(count: int) -> str:
    return "1 point" if count == 1 else f"{count} points"
