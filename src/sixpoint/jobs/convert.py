"""Convert between motion formats, take the six points of a motion, convert between target formats."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from sixpoint.body.motion import Motion
from sixpoint.body.targets import Targets
from sixpoint.errors import FormatError
from sixpoint.formats import SAVED_SUFFIXES, TARGET_SUFFIXES, load_avatar, save, save_targets
from sixpoint.jobs.reading import Reading, is_targets, open_motion, open_targets
from sixpoint.jobs.writing import check_output, keep_sources

OUTPUTS = (*SAVED_SUFFIXES, *TARGET_SUFFIXES)


@dataclass(frozen=True, eq=False)
class Conversion:
    """What was converted.

    Attributes:
        content: What was written.
        files: Where to.
    """

    content: Motion | Targets
    files: list[Path]


def convert(
    source: Path,
    out: Path,
    *,
    reading: Reading | None = None,
    mapping: Path | None = None,
    rotations: bool = False,
    out_unit: str | None = None,
    out_up: str | None = None,
    force: bool = False,
) -> Conversion:
    """Convert one file into another; the suffixes say from what to what.

    Args:
        source: A motion or targets.
        out: A motion, or targets: of a motion its six points are taken.
        reading: How to read the source.
        mapping: A TOML table role -> joint name, to take the six points of an unusual rig.
        rotations: Keep the rotations of the six points.
        out_unit: Unit of a written motion; by default the source's.
        out_up: Up axis of a written motion; by default the source's.
        force: Overwrite existing files.

    Raises:
        SixpointError: Nothing was written; the message says why.
    """
    reading = reading or Reading()
    from_targets, to_targets = is_targets(source), out.suffix.lower() in TARGET_SUFFIXES
    files = check_output(out, OUTPUTS, force)
    keep_sources(files, [source, reading.skeleton, mapping])
    if to_targets and (out_unit or out_up):
        raise FormatError(out, "targets are always in metres and Y up: leave out --out-unit and --out-up")
    if from_targets and not to_targets:
        raise FormatError(source, "six points hold no body; pose one with: sixpoint reconstruct")
    content: Motion | Targets
    if to_targets:
        content = _read_points(source, from_targets, reading, mapping, rotations)
        save_targets(content, out, force=force)
    else:
        opened = open_motion(source, reading)
        keep_sources(files, [source, opened.skeleton])
        content = opened.motion
        keeps = opened.avatar is not None and out.suffix.lower() in (".glb", ".vrma")
        avatar = load_avatar(source, mapping) if keeps else None  # its meshes, or its humanoid map
        save(content, out, force=force, unit=out_unit, up=out_up, avatar=avatar)
    return Conversion(content, files)


def _read_points(
    source: Path, from_targets: bool, reading: Reading, mapping: Path | None, rotations: bool
) -> Targets:
    if from_targets:
        return open_targets(source, reading)
    opened = open_motion(source, reading)
    points = opened.find_figure(mapping).targets(opened.motion)
    return points if rotations else replace(points, rotations=None)
