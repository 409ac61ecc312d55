"""Landmarks of pose estimators as JSON: the 33 world landmarks of BlazePose, frame by frame.

Metres from the middle of the hips, x to the right of the picture, y down, z away from the camera. A file is
a list of frames, an object with ``frames``, or one object per line; a frame is a list of landmarks, or an
object with ``landmarks`` (or ``worldLandmarks``) and ``time`` [s]; a landmark is ``[x, y, z, visibility]`` or
an object with these names. A frame with nobody in it is empty or null.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sixpoint.errors import FormatError, listed
from sixpoint.formats.markers.raw import RawMarkers
from sixpoint.formats.markers.tables import SEEN
from sixpoint.formats.markers.times import rate_of_times
from sixpoint.formats.source import LARGEST, read_bytes

LANDMARKS = (
    "nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye", "right_eye_outer",
    "left_ear", "right_ear", "mouth_left", "mouth_right", "left_shoulder", "right_shoulder", "left_elbow",
    "right_elbow", "left_wrist", "right_wrist", "left_pinky", "right_pinky", "left_index", "right_index",
    "left_thumb", "right_thumb", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle",
    "right_ankle", "left_heel", "right_heel", "left_foot_index", "right_foot_index",
)  # fmt: skip
"""The 33 landmarks in their order."""

_LISTS = ("landmarks", "worldLandmarks", "world_landmarks", "pose_world_landmarks", "poseWorldLandmarks")
_RATES = ("rate", "fps", "frame_rate", "frameRate")
_SIZE = 256 * 2**20  # bytes


def read_landmarks(path: Path) -> RawMarkers:
    """Read landmarks from a JSON file; those whose visibility is below one half are gaps.

    Raises:
        FormatError: With the frame, or the line of the JSON, where something is wrong.
    """
    document, notes = _parse(path), list[str]()
    frames, names, rate = document, list(LANDMARKS), None
    if isinstance(document, Mapping):
        frames = document.get("frames", [document] if any(key in document for key in _LISTS) else None)
        rate = next((document[key] for key in _RATES if key in document), None)
        names = [str(name) for name in document.get("names", names) or names]
        if not (rate is None or (isinstance(rate, (int, float)) and 1e-3 <= rate <= 1e6)):
            raise FormatError(path, "the rate must be frames per second", got=repr(rate))
    if not isinstance(frames, list) or not frames:
        raise FormatError(path, "no frames", expected='a list of frames, or {"frames": [...]}')
    positions = np.full((len(frames), len(names), 3), np.nan)
    times = np.full(len(frames), np.nan)
    for k, frame in enumerate(frames):
        times[k] = _read_time(path, k, frame)
        for m, point in enumerate(_read_points(path, k, frame, len(names))):
            *position, visibility = _read_point(path, k, m, point)
            if visibility >= SEEN:
                positions[k, m] = position
    if rate is None:
        rate = rate_of_times(times)
    return RawMarkers(names, positions, rate, unit="m", up="-y", usual_up="-y", notes=notes)


def _parse(path: Path) -> Any:
    data = read_bytes(path)
    if len(data) > _SIZE:
        raise FormatError(path, f"the file is too large ({len(data)} bytes; {_SIZE} at most)")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(path, f"not a UTF-8 text: {error.reason} at byte {error.start}") from None
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as whole:
        lines = [(k, line) for k, line in enumerate(text.split("\n"), start=1) if line.strip()]
        if len(lines) < 2:
            raise FormatError(path, f"not JSON: {whole}") from None
    entries = []
    for k, line in lines:  # one object per line
        try:
            entries.append(json.loads(line))
        except (ValueError, RecursionError) as error:
            raise FormatError(path, f"not JSON: {error}", line=k) from None
    return entries


def _read_time(path: Path, k: int, frame: object) -> float:
    if not isinstance(frame, Mapping):
        return math.nan
    for key, factor in (("time", 1.0), ("timestamp", 1.0), ("timestamp_ms", 1e-3), ("timestampMs", 1e-3)):
        if key in frame:
            return factor * _number(path, frame[key], f"frame {k}: {key}")
    return math.nan


def _read_points(path: Path, k: int, frame: object, count: int) -> Sequence[object]:
    points = frame
    if isinstance(frame, Mapping):
        key = next((key for key in _LISTS if key in frame), None)
        if key is None:
            raise FormatError(
                path, f"frame {k} has none of: {listed(_LISTS)}; it has: {listed(map(str, frame), 8)}"
            )
        points = frame[key]
    if points is None:
        return []
    if not isinstance(points, list):
        raise FormatError(path, f"frame {k}: the landmarks must be a list", got=type(points).__name__)
    if len(points) == 1 and isinstance(points[0], list) and points[0] and not _is_number(points[0][0]):
        points = points[0]  # a list of people, of whom there is one
    if points and len(points) != count:
        raise FormatError(
            path, f"frame {k} has {len(points)} landmarks", expected=f"{count}, or none where nobody is seen"
        )
    return points


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _read_point(path: Path, k: int, m: int, point: object) -> list[float]:
    """x, y, z and visibility; 0 visibility for what is not there."""
    where = f"frame {k}, landmark {m}"
    if point is None:
        return [math.nan, math.nan, math.nan, 0.0]
    if isinstance(point, Mapping):
        if not all(axis in point for axis in "xyz"):
            raise FormatError(path, f"{where} has no x, y and z; it has: {listed(map(str, point), 8)}")
        values = [point["x"], point["y"], point["z"], point.get("visibility", 1.0)]
    elif isinstance(point, list) and len(point) in (3, 4, 5):
        values = [*point[:4], 1.0] if len(point) == 3 else point[:4]
    else:
        raise FormatError(path, f"{where} must be [x, y, z, visibility], or an object with these names")
    if values[3] is None:
        values[3] = 1.0
    if any(value is None for value in values[:3]):
        return [math.nan, math.nan, math.nan, 0.0]
    return [_number(path, value, where) for value in values]


def _number(path: Path, value: object, where: str) -> float:
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        raise FormatError(path, f"{where}: not a number", got=repr(value))
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if math.isnan(number):
        return math.nan
    if abs(number) > LARGEST:
        raise FormatError(path, f"{where}: number is not finite or far too large", got=repr(value))
    return number
