"""Convert between formats of motions, targets and markers; take six points or joint angles of a motion."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

from sixpoint.body.joint_angles import JointAngles, compute_joint_angles
from sixpoint.body.markers.recording import Markers
from sixpoint.body.motion import Motion
from sixpoint.body.targets import Targets
from sixpoint.errors import FormatError
from sixpoint.formats import (
    ANGLE_SUFFIXES,
    MARKER_OUTPUTS,
    OUTPUT_SUFFIXES,
    SHAPE_OUTPUTS,
    SHAPE_SUFFIXES,
    TARGET_SUFFIXES,
    holds_markers,
    load_avatar,
    load_shape,
    save,
    save_angles,
    save_markers,
    save_targets,
)
from sixpoint.jobs.reading import Reading, is_targets, open_markers, open_motion, open_targets
from sixpoint.jobs.writing import check_output, keep_sources
from sixpoint.signals.gaps import fill_gaps
from sixpoint.signals.low_pass import low_pass

OUTPUTS = (*OUTPUT_SUFFIXES, ".mot", *TARGET_SUFFIXES)


@dataclass(frozen=True, eq=False)
class Conversion:
    """What was converted.

    Attributes:
        content: What was written.
        files: Where to.
        notes: What was changed on the way.
    """

    content: Motion | Targets | Markers | JointAngles
    files: list[Path]
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Cleaning:
    """What is done to markers; by default nothing.

    Attributes:
        fill: Longest gap that is filled [s].
        low_pass: Cutoff of a zero-phase filter [Hz].
    """

    fill: float | None = None
    low_pass: float | None = None


def convert(
    source: Path,
    out: Path,
    *,
    reading: Reading | None = None,
    mapping: Path | None = None,
    rotations: bool = False,
    angles: bool = False,
    cleaning: Cleaning | None = None,
    out_unit: str | None = None,
    out_up: str | None = None,
    force: bool = False,
) -> Conversion:
    """Convert one file into another; the suffixes say from what to what.

    Args:
        source: A motion, targets or markers.
        out: A motion, or targets: of a motion its six points are taken. Its joint angles for .mot.
        reading: How to read the source.
        mapping: A TOML table role -> joint name, to take the six points of an unusual rig.
        rotations: Keep the rotations of the six points.
        angles: A .csv is to hold joint angles, not six points.
        cleaning: What is done to markers.
        out_unit: Unit of written motions or markers; by default the source's.
        out_up: Up axis of written motions or markers; by default the source's.
        force: Overwrite existing files.

    Raises:
        SixpointError: Nothing was written; the message says why.
    """
    reading = reading or Reading()
    suffix = out.suffix.lower()
    if not source.is_dir() and holds_markers(source):
        if angles or suffix not in MARKER_OUTPUTS:
            raise FormatError(source, "markers hold no body; pose one with: sixpoint track")
        return _convert_markers(source, out, reading, cleaning or Cleaning(), out_unit, out_up, force)
    if cleaning is not None and cleaning != Cleaning():
        raise FormatError(source, "only markers are filled and filtered: leave out --fill and --low-pass")
    from_targets, to_targets = is_targets(source), suffix in TARGET_SUFFIXES
    files = check_output(out, OUTPUTS, force)
    if angles or suffix == ".mot":
        return _convert_to_angles(source, out, reading, mapping, from_targets, force)
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
        keeps = opened.avatar is not None and suffix in (".glb", ".vrma")
        avatar = load_avatar(source, mapping) if keeps else None  # its meshes, or its humanoid map
        surfaces = avatar is None and source.suffix.lower() in SHAPE_SUFFIXES and suffix in SHAPE_OUTPUTS
        shape = load_shape(source) if surfaces else None
        save(content, out, force=force, unit=out_unit, up=out_up, avatar=avatar, shape=shape)
    return Conversion(content, files)


def _convert_to_angles(
    source: Path, out: Path, reading: Reading, mapping: Path | None, from_targets: bool, force: bool
) -> Conversion:
    if out.suffix.lower() not in ANGLE_SUFFIXES:
        raise FormatError(out, "joint angles are written as .mot or .csv")
    if from_targets:
        raise FormatError(source, "six points hold no body; pose one with: sixpoint reconstruct")
    keep_sources([out], [source, reading.skeleton, mapping])
    opened = open_motion(source, reading)
    content = compute_joint_angles(opened.motion, opened.find_figure(mapping))
    save_angles(content, out, force=force)
    return Conversion(content, [out])


def _convert_markers(
    source: Path,
    out: Path,
    reading: Reading,
    cleaning: Cleaning,
    out_unit: str | None,
    out_up: str | None,
    force: bool,
) -> Conversion:
    files = check_output(out, MARKER_OUTPUTS, force)
    keep_sources(files, [source])
    markers, notes = clean_markers(open_markers(source, reading), cleaning)
    save_markers(markers, out, force=force, unit=out_unit, up=out_up)
    return Conversion(markers, files, notes)


def clean_markers(markers: Markers, cleaning: Cleaning) -> tuple[Markers, list[str]]:
    """Fill short gaps, then filter, as far as that is asked for; say what was changed.

    Raises:
        TargetError: A length or a cutoff is not possible.
    """
    positions, notes = markers.positions, []
    if cleaning.fill is not None:
        filled = fill_gaps(positions, markers.rate, cleaning.fill)
        counts = filled.made.sum(axis=0)
        worst = sorted(zip(counts.tolist(), markers.names, strict=True), reverse=True)[:5]
        where = ", ".join(f"{name} {count}" for count, name in worst if count)
        notes.append(f"filled {int(counts.sum())} samples" + (f" (most: {where})" if where else ""))
        positions = filled.positions
    if cleaning.low_pass is not None:
        filtered = low_pass(positions, markers.rate, cleaning.low_pass)
        kept = int(filtered.kept.sum())
        notes.append(
            f"filtered at {cleaning.low_pass:g} Hz"
            + (f"; {kept} samples in stretches too short for it were left as they were" if kept else "")
        )
        positions = filtered.positions
    return replace(markers, positions=positions), notes


def _read_points(
    source: Path, from_targets: bool, reading: Reading, mapping: Path | None, rotations: bool
) -> Targets:
    if from_targets:
        return open_targets(source, reading)
    opened = open_motion(source, reading)
    points = opened.find_figure(mapping).targets(opened.motion)
    return points if rotations else replace(points, rotations=None)
