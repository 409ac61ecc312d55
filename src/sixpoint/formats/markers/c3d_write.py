"""Writing C3D files by ezc3d."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.markers.recording import Markers
from sixpoint.formats.markers.c3d_sections import BLOCK, read_header

Array = NDArray[np.float64]

# X and Y of the screen when the up axis is upright.
_SCREENS = {
    "y": ("+X", "+Y"),
    "-y": ("+X", "-Y"),
    "z": ("+X", "+Z"),
    "-z": ("+X", "-Z"),
    "x": ("+Y", "+X"),
    "-x": ("+Y", "-X"),
}


def format_c3d(markers: Markers, positions: Array, unit: str, metres: float, up: str) -> bytes:
    """The bytes of a C3D file with floats.

    Args:
        markers: What is written, with residuals and events.
        positions: (F, M, 3) in the file's unit and axes; a gap has the residual -1.
        unit: Name of the unit.
        metres: Of one unit.
        up: Up axis of the file.
    """
    import ezc3d  # only where it is needed: it takes long

    file = ezc3d.c3d()
    seen = np.isfinite(positions[..., 0])
    residuals = np.zeros(seen.shape) if markers.residuals is None else markers.residuals / metres
    residuals = np.where(seen, np.nan_to_num(residuals), -1.0)
    points = np.ones((4, len(markers.names), len(markers)))
    points[:3] = np.where(seen[..., None], positions, 0.0).transpose(2, 1, 0)
    file["parameters"]["POINT"]["RATE"]["value"] = [markers.rate]
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(markers.names)
    file.add_parameter("POINT", "X_SCREEN", [_SCREENS[up][0]])
    file.add_parameter("POINT", "Y_SCREEN", [_SCREENS[up][1]])
    if markers.events:
        times = np.array([divmod(event.time, 60.0) for event in markers.events]).T
        file.add_parameter("EVENT", "USED", [len(markers.events)])
        file.add_parameter("EVENT", "CONTEXTS", [event.context for event in markers.events])
        file.add_parameter("EVENT", "LABELS", [event.label for event in markers.events])
        file.add_parameter("EVENT", "TIMES", times)
    file["data"]["points"] = points
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "markers.c3d"
        file.write(str(path))
        return _with_residuals(path, path.read_bytes(), residuals)


def _with_residuals(path: Path, data: bytes, residuals: Array) -> bytes:
    """The file with the residuals (F, M) in the lower byte of the fourth word, where the format has them.

    ezc3d has them in the upper one, which is the cameras' (its issue 386).
    """
    header = read_header(path, data)
    begin, (frames, count) = (header.start - 1) * BLOCK, residuals.shape
    values = (
        np.frombuffer(data, "<f4", frames * (4 * count + header.analogs), begin).reshape(frames, -1).copy()
    )
    words = np.where(residuals < 0, -1.0, np.clip(np.round(residuals / abs(header.scale)), 0, 255))
    values[:, 3 : 4 * count : 4] = words
    return data[:begin] + values.tobytes() + data[begin + values.nbytes :]
