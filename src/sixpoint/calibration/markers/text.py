"""A marker model as TOML text: what a person's calibration found, to be kept and edited."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from sixpoint.body.anthropometry import segments_of_skeleton, segments_of_stature
from sixpoint.body.figure import Figure
from sixpoint.body.markers.model import PARTS, MarkerModel
from sixpoint.calibration.toml import TableReader, toml_key, toml_number, toml_numbers, toml_text
from sixpoint.errors import FormatError

VERSION = 1


def format_marker_model(model: MarkerModel) -> str:
    """A marker model as TOML text; ``parse_marker_model`` gives it back.

    Raises:
        FigureError: Its figure is not a built-in one: only that is described by segment lengths.
    """
    segments = segments_of_skeleton(model.figure.skeleton)
    missing = ", ".join(toml_text(part) for part in model.missing)
    lines = [
        "# A person's marker model: segment lengths, and where markers sit on the built-in figure.",
        f"version = {VERSION}",
        f"missing = [{missing}]  # parts of the body without markers",
        "",
        "[segments]  # [m]",
        *(f"{name} = {toml_number(length)}" for name, length in segments.items()),
        "",
        "[markers]  # offset in the frame of the joint, and rms distance from there in the calibration [m]",
    ]
    names = model.figure.skeleton.names
    for k, label in enumerate(model.names):
        entry = f"joint = {toml_text(names[model.joints[k]])}, offset = {toml_numbers(model.offsets[k])}"
        if np.isfinite(model.spread[k]):
            entry += f", spread = {toml_number(model.spread[k])}"
        lines.append(f"{toml_key(label)} = {{ {entry} }}")
    return "\n".join(lines) + "\n"


def parse_marker_model(text: str, path: str | Path = "marker model") -> MarkerModel:
    """Read a marker model.

    Args:
        text: TOML.
        path: Its file, for messages.

    Raises:
        FormatError: It is not a marker model; the message says at which key, and what is expected.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FormatError(path, f"not a TOML file: {error}") from error
    read = TableReader(path)
    read.only(table, "", ("version", "missing", "segments", "markers"))
    version = table.get("version")
    if version != VERSION or isinstance(version, bool):
        raise FormatError(path, "version", expected=f"{VERSION}", got=repr(version))
    missing = table.get("missing", [])
    if not isinstance(missing, list) or any(part not in PARTS for part in missing):
        raise FormatError(path, "missing", expected=f"a list of {', '.join(PARTS)}", got=repr(missing))
    lengths = read.table(table, "segments")
    known = segments_of_stature(1.75)
    read.only(lengths, "segments.", known)
    segments = {n: read.number(lengths, n, 0.005, 2.0, "a length in metres", "segments.") for n in known}
    figure = Figure.from_segments(limits=None, **segments)
    markers = read.table(table, "markers")
    rows = [_marker(read, figure, label, entry) for label, entry in markers.items()]
    return MarkerModel(
        figure,
        tuple(markers),
        np.array([row[0] for row in rows], np.int64),
        np.array([row[1] for row in rows], float).reshape(-1, 3),
        np.array([row[2] for row in rows], float),
        tuple(missing),
    )


def _marker(read: TableReader, figure: Figure, label: str, entry: Any) -> tuple[int, list[float], float]:
    where = f"markers.{label}."
    if not isinstance(entry, dict):
        raise FormatError(read.path, where[:-1], expected="a table", got=repr(entry))
    read.only(entry, where, ("joint", "offset", "spread"))
    joint = entry.get("joint")
    if joint not in figure.skeleton.names:
        raise FormatError(
            read.path, f"{where}joint", expected="a joint of the built-in figure", got=repr(joint)
        )
    offset = read.numbers(entry, "offset", 3, 1.0, where)
    spread = (
        read.number(entry, "spread", 0.0, 1.0, "a distance in metres", where) if "spread" in entry else np.nan
    )
    return figure.skeleton.names.index(joint), offset.tolist(), spread
