"""Files to motions and targets, and back; ``load`` and ``save`` choose by suffix.

Degrees, inches, centimetres and Z-up worlds exist only in this room: what comes out is in metres, radians
and Y up, and what goes into a file is in the unit and axes of the file it once came from. Reading raises
``FormatError`` with the line; writing is whole or not at all.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sixpoint.body.appearance import Appearance
from sixpoint.body.motion import Motion
from sixpoint.body.shape import Shape
from sixpoint.body.targets import Targets
from sixpoint.errors import FormatError, SixpointError, listed
from sixpoint.formats.acclaim_write import format_amc, format_asf, plan_bones
from sixpoint.formats.amc import find_skeleton, read_acclaim
from sixpoint.formats.atomic import check_writable, write_files
from sixpoint.formats.bvh import read_bvh
from sixpoint.formats.bvh_write import format_bvh
from sixpoint.formats.gltf.avatar import GLTF_SUFFIXES, Avatar, load_avatar, read_gltf_motion
from sixpoint.formats.gltf.vrma import format_vrma
from sixpoint.formats.gltf.write_avatar import format_avatar
from sixpoint.formats.gltf.write_figure import format_figure
from sixpoint.formats.npz import format_npz, read_npz
from sixpoint.formats.space import detect_space, enter_world, leave_world, parse_unit, parse_up
from sixpoint.formats.tables import format_csv, read_csv

__all__ = [
    "GLTF_SUFFIXES",
    "Avatar",
    "find_skeleton",
    "load",
    "load_avatar",
    "load_targets",
    "save",
    "save_targets",
]

MOTION_SUFFIXES = (".bvh", ".amc", ".asf", *GLTF_SUFFIXES)
SAVED_SUFFIXES = (".bvh", ".amc", ".glb", ".vrma")
TARGET_SUFFIXES = (".csv", ".npz")

_NOT_YET = (".c3d", ".trc", ".usd", ".usda", ".usdc")
_FBX = (
    "FBX files are not read; convert it, e.g. in Blender: File > Import > FBX, then "
    "File > Export > Motion Capture (.bvh)"
)


def load(
    path: str | Path,
    *,
    skeleton: str | Path | None = None,
    unit: str | float | None = None,
    up: str | None = None,
    rate: float | None = None,
) -> Motion:
    """Read a motion: .bvh, .amc, .asf (alone it is one frame of its rest pose), .glb, .gltf, .vrm or .vrma.

    Args:
        path: The file.
        skeleton: The .asf of an .amc file; by default it is looked for beside it.
        unit: Metres per file unit, or one of m, cm, mm, inch, cmu. By default the ASF's; guessed from
            the size of the body for BVH, which states none. glTF is always in metres.
        up: Up axis of the file, "y" or "z"; by default guessed from the posture for BVH, Y for AMC; glTF is
            always Y up.
        rate: Frames per second [Hz] in place of the file's. AMC states none: 120 by default. A glTF
            animation is sampled at this rate, by default that of its keys, 60 if these are not evenly spaced.

    Returns:
        The motion in metres and Y up; ``motion.space`` says what the file had.

    Raises:
        FormatError: The file cannot be read; the message has the line and what was expected there.
    """
    path = Path(path)
    suffix = _check_suffix(path, MOTION_SUFFIXES, "motions")
    _check_rate(path, rate)
    if skeleton is not None and suffix != ".amc":
        raise FormatError(path, f"a skeleton file belongs to an .amc, not to a {suffix}: leave it out")
    if suffix in GLTF_SUFFIXES:
        _check_metres(path, unit, up)
        return read_gltf_motion(path, rate)
    try:
        if suffix == ".bvh":
            raw = read_bvh(path)
            motion = enter_world(raw, detect_space(path, raw, unit, up))
            return motion if rate is None else replace(motion, rate=rate)
        raw = read_acclaim(path, skeleton, rate)
        space = raw.space
        if unit is not None:
            space = replace(space, unit=parse_unit(path, unit), unit_source="given")
        if up is not None:
            space = replace(space, up=parse_up(path, up), up_source="given")
        return enter_world(raw, space)
    except SixpointError as error:
        raise _with_path(path, error) from error


def save(
    motion: Motion,
    path: str | Path,
    *,
    force: bool = False,
    unit: str | float | None = None,
    up: str | None = None,
    order: str | None = None,
    avatar: Avatar | None = None,
    shape: Shape | None = None,
    appearance: Appearance | None = None,
) -> None:
    """Write a motion as .bvh, as .amc with its .asf beside it, as .glb or as a VRM animation (.vrma).

    Args:
        motion: In metres, Y up.
        path: The file.
        force: Overwrite existing files.
        unit: Metres per file unit, or one of m, cm, mm, inch, cmu; by default ``motion.space.unit``.
        up: Up axis of the file; by default ``motion.space.up``. AMC is always written Y up.
        order: Euler order of a BVH, e.g. "ZYX"; by default ``motion.space.order``, the source's.
        avatar: Written into the .glb, with its meshes, materials and textures; the motion is on its skeleton.
            For a .vrma its anatomy.
        shape: A mesh for the .glb, on the motion's skeleton; without shape and avatar it has bones only.
        appearance: Colours of the shape.

    Raises:
        FormatError: Nothing was written; the message says why.
    """
    path = Path(path)
    suffix = _check_suffix(path, SAVED_SUFFIXES, "motions, writing")
    if suffix in GLTF_SUFFIXES:
        _check_metres(path, unit, up)
        check_writable([path], force)
        write_files({path: _format_gltf(motion, path, suffix, avatar, shape, appearance)}, force)
        return
    if avatar is not None or shape is not None or appearance is not None:
        raise FormatError(path, "an avatar or a shape can only be written into a .glb")
    space = motion.space
    if unit is not None:
        space = replace(space, unit=parse_unit(path, unit))
    if up is not None:
        space = replace(space, up=parse_up(path, up))
    if suffix == ".amc":
        if up is not None and space.up != "y":
            raise FormatError(path, "AMC files are written Y up; for Z up write a .bvh")
        space = replace(space, up="y")
    targets = [path] if suffix == ".bvh" else [path, path.with_suffix(".asf")]
    check_writable(targets, force)
    try:
        raw = leave_world(motion, space)
        if suffix == ".bvh":
            texts = [format_bvh(raw, path, order or motion.space.order)]
        else:
            bones = plan_bones(raw, path)
            texts = [format_amc(raw, bones), format_asf(raw, bones)]
    except SixpointError as error:
        raise _with_path(path, error) from error
    write_files(dict(zip(targets, (text.encode("utf-8", "replace") for text in texts), strict=True)), force)


def load_targets(path: str | Path, *, rate: float | None = None) -> Targets:
    """Read six-point targets from a .csv or .npz file.

    Args:
        path: The file; metres, Y up.
        rate: Frames per second [Hz] in place of the file's.

    Raises:
        FormatError: The file cannot be read; the message has the line and what was expected there.
    """
    path = Path(path)
    suffix = _check_suffix(path, TARGET_SUFFIXES, "targets")
    _check_rate(path, rate)
    return read_csv(path, rate) if suffix == ".csv" else read_npz(path, rate)


def save_targets(targets: Targets, path: str | Path, force: bool = False) -> None:
    """Write six-point targets as .csv or .npz.

    Args:
        targets: In metres, Y up.
        path: The file.
        force: Overwrite an existing file.

    Raises:
        FormatError: Nothing was written; the message says why.
    """
    path = Path(path)
    suffix = _check_suffix(path, TARGET_SUFFIXES, "targets")
    check_writable([path], force)
    data = format_csv(targets).encode() if suffix == ".csv" else format_npz(targets)
    write_files({path: data}, force)


def _format_gltf(
    motion: Motion,
    path: Path,
    suffix: str,
    avatar: Avatar | None,
    shape: Shape | None,
    appearance: Appearance | None,
) -> bytes:
    try:
        if suffix == ".vrma":
            return format_vrma(motion, None if avatar is None else avatar.figure)
        if avatar is None:
            return format_figure(motion, shape, appearance)
        if shape is not None or appearance is not None:
            raise FormatError(path, "give an avatar, which has a shape of its own, or a shape, not both")
        return format_avatar(motion, avatar)
    except SixpointError as error:
        raise _with_path(path, error) from error


def _check_metres(path: Path, unit: str | float | None, up: str | None) -> None:
    """A glTF file is always in metres and Y up."""
    if (unit is not None and parse_unit(path, unit) != 1.0) or (up is not None and parse_up(path, up) != "y"):
        raise FormatError(
            path, "glTF files are always in metres and Y up: leave out the unit and the up axis"
        )


def _check_suffix(path: Path, known: tuple[str, ...], what: str) -> str:
    suffix = path.suffix.lower()
    if suffix in known:
        return suffix
    formats = f"formats of {what}: {listed(known)}"
    if suffix == ".fbx":
        raise FormatError(path, _FBX)
    if suffix in _NOT_YET:
        raise FormatError(path, f"{suffix} files are planned but not supported yet; {formats}")
    if suffix == ".asf":
        raise FormatError(path, "save as .amc: the .asf is written beside it")
    if suffix in (".gltf", ".vrm"):
        raise FormatError(path, f"glTF is written as one file: save as .glb (got {suffix})")
    if suffix in (*MOTION_SUFFIXES, *TARGET_SUFFIXES):
        raise FormatError(path, f"a {suffix} file does not hold {what.split(',')[0]}; {formats}")
    raise FormatError(path, f"unknown suffix {suffix!r}; {formats}")


def _check_rate(path: Path, rate: float | None) -> None:
    if rate is not None and not 1e-3 <= rate <= 1e6:
        raise FormatError(path, f"the rate is frames per second, 0.001 to 1000000, got {rate}")


def _with_path(path: Path, error: SixpointError) -> FormatError:
    return error if isinstance(error, FormatError) else FormatError(path, str(error))
