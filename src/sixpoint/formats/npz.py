"""Six-point targets as NPZ archives: ``positions`` (F, 6, 3), ``rate`` and optional ``rotations`` (F, 6, 4).

For programs: nothing is rounded. Archives with pickled objects are refused.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.targets import EFFECTORS, Targets
from sixpoint.errors import FormatError, listed
from sixpoint.formats.source import LARGEST, read_bytes
from sixpoint.formats.tables import find_bad_rotation, make_targets

Array = NDArray[np.float64]


def read_npz(path: Path, rate: float | None = None) -> Targets:
    """Read six-point targets from an NPZ file with ``positions``, ``rate`` and optional ``rotations``.

    Raises:
        FormatError: Not an NPZ file, missing or wrong arrays.
    """
    arrays = _load_arrays(path)
    for name in ("positions",) if rate else ("positions", "rate"):
        if name not in arrays:
            raise FormatError(path, f"array {name!r} is missing; arrays: {listed(arrays) or 'none'}")
    positions = arrays["positions"].copy()
    if np.any(np.abs(positions) > LARGEST):
        raise FormatError(path, "positions are far too large", expected="metres, NaN where lost")
    stated = arrays.get("rate", np.array(rate))
    if stated.size != 1:
        raise FormatError(path, "rate must be one number", got=f"shape {stated.shape}")
    if positions.shape[1:] == (6, 3):
        positions[np.isnan(positions).any(axis=2)] = np.nan
    rotations = arrays.get("rotations")
    if rotations is not None and rotations.shape[1:] == (6, 4):
        frame, effector = find_bad_rotation(rotations)
        if frame is not None:
            raise FormatError(
                path, f"rotations[{frame}, {effector}] ({EFFECTORS[effector]}) is not a unit quaternion"
            )
        rotations = rotations / np.linalg.norm(rotations, axis=2, keepdims=True)
    return make_targets(path, positions, rate or float(stated.reshape(-1)[0]), rotations)


def _load_arrays(path: Path) -> dict[str, Array]:
    data = read_bytes(path)
    arrays: dict[str, Array] = {}
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            for name in archive.files:
                if name in ("positions", "rate", "rotations"):
                    array = archive[name]
                    if array.dtype.kind not in "fiu":
                        raise FormatError(path, f"array {name!r} is not numeric", got=str(array.dtype))
                    arrays[name] = array.astype(np.float64)
    except FormatError:
        raise
    except Exception as error:  # NumPy and zipfile raise many kinds on damaged archives
        raise FormatError(
            path,
            "not an NPZ file, or a damaged one",
            expected="arrays of numbers and texts as np.savez writes",
        ) from error
    return arrays


def format_npz(targets: Targets) -> bytes:
    """The bytes of an NPZ file."""
    arrays: dict[str, Array] = {"positions": targets.positions, "rate": np.array(targets.rate)}
    if targets.rotations is not None:
        arrays["rotations"] = targets.rotations
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]
    return stream.getvalue()
