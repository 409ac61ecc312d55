"""Markers as NPZ archives: ``names`` (M), ``positions`` (F, M, 3) [m], ``rate`` and what else there is.

For programs: nothing is rounded, in metres and Y up. ``residuals`` (F, M) and the three arrays of the events
(``event_labels``, ``event_times``, ``event_contexts``) are optional. Pickled objects are refused.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from sixpoint.body.markers.recording import Event, Markers
from sixpoint.errors import FormatError, listed
from sixpoint.formats.markers.raw import RawMarkers
from sixpoint.formats.source import read_bytes

_NAMES = ("names", "positions", "rate", "residuals", "event_labels", "event_times", "event_contexts")
_TEXTS = ("names", "event_labels", "event_contexts")


def read_marker_npz(path: Path) -> RawMarkers:
    """Read markers from an NPZ archive.

    Raises:
        FormatError: Not an archive, missing or wrong arrays.
    """
    arrays: dict[str, np.ndarray] = {}
    try:
        with np.load(io.BytesIO(read_bytes(path)), allow_pickle=False) as archive:
            there = list(archive.files)
            for name in _NAMES:
                if name in there:
                    arrays[name] = archive[name]
    except FormatError:
        raise
    except Exception as error:  # NumPy and zipfile raise many kinds on damaged archives
        raise FormatError(
            path,
            "not an NPZ file, or a damaged one",
            expected="arrays of numbers and texts as np.savez writes",
        ) from error
    for name in ("names", "positions", "rate"):
        if name not in arrays:
            raise FormatError(path, f"array {name!r} is missing; arrays: {listed(there) or 'none'}")
    for name, array in arrays.items():
        if array.dtype.kind not in ("U" if name in _TEXTS else "fiu"):
            expected = "texts" if name in _TEXTS else "numbers"
            raise FormatError(
                path, f"array {name!r} has the wrong type", expected=expected, got=str(array.dtype)
            )
    positions, names = arrays["positions"].astype(np.float64), [str(name) for name in arrays["names"].ravel()]
    if positions.ndim != 3 or positions.shape[1:] != (len(names), 3) or not positions.size:
        raise FormatError(path, f"positions must be (frames, {len(names)}, 3), got {positions.shape}")
    residuals = arrays.get("residuals")
    if residuals is not None and residuals.shape != positions.shape[:2]:
        raise FormatError(path, f"residuals must be {positions.shape[:2]}, got {residuals.shape}")
    rate = arrays["rate"].ravel()
    if rate.size != 1:
        raise FormatError(path, "rate must be one number", got=f"shape {arrays['rate'].shape}")
    return RawMarkers(
        names,
        positions,
        float(rate[0]) if 1e-3 <= rate[0] <= 1e6 else None,
        None if residuals is None else residuals.astype(np.float64),
        _read_events(path, arrays),
        "m",
        "y",
    )


def _read_events(path: Path, arrays: dict[str, np.ndarray]) -> tuple[Event, ...]:
    labels, times = (arrays.get(name, np.zeros(0)).ravel() for name in ("event_labels", "event_times"))
    contexts = arrays.get("event_contexts", np.array([""] * len(labels))).ravel()
    if not len(labels) == len(times) == len(contexts):
        raise FormatError(path, f"events: {len(labels)} labels, {len(times)} times, {len(contexts)} contexts")
    return tuple(Event(str(e), float(t), str(c)) for e, t, c in zip(labels, times, contexts, strict=True))


def format_marker_npz(markers: Markers) -> bytes:
    """The bytes of an NPZ archive."""
    arrays = {
        "names": np.array(markers.names),
        "positions": markers.positions,
        "rate": np.array(markers.rate),
    }
    if markers.residuals is not None:
        arrays["residuals"] = markers.residuals
    if markers.events:
        arrays["event_labels"] = np.array([event.label for event in markers.events])
        arrays["event_times"] = np.array([event.time for event in markers.events])
        arrays["event_contexts"] = np.array([event.context for event in markers.events])
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]
    return stream.getvalue()
