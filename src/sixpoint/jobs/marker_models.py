"""Marker models as files."""

from __future__ import annotations

from pathlib import Path

from sixpoint.body.markers.model import MarkerModel
from sixpoint.calibration.markers.text import format_marker_model, parse_marker_model
from sixpoint.errors import FormatError
from sixpoint.formats.atomic import write_files


def save_marker_model(model: MarkerModel, path: str | Path, *, force: bool = False) -> None:
    """Write a marker model as a TOML file, whole or not at all.

    Raises:
        FormatError: The file exists and ``force`` is not given, or it cannot be written.
        FigureError: The model's figure is not a built-in one.
    """
    write_files({Path(path): format_marker_model(model).encode()}, force)


def load_marker_model(path: str | Path) -> MarkerModel:
    """Read a marker model from a TOML file.

    Raises:
        FormatError: It cannot be read, or is no marker model.
    """
    try:
        text = Path(path).read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(path, f"cannot be read: {error}") from error
    return parse_marker_model(text, path)
