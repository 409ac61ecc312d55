"""Motions, and the surfaces on their rigs, to and from files; the suffix says which format."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sixpoint.body.motion import Motion
from sixpoint.body.surface.appearance import Appearance
from sixpoint.body.surface.shape import Shape
from sixpoint.errors import FormatError, SixpointError, listed
from sixpoint.formats.acclaim_write import format_amc, format_asf, plan_bones
from sixpoint.formats.amc import read_acclaim
from sixpoint.formats.atomic import check_writable, write_files
from sixpoint.formats.bvh import read_bvh
from sixpoint.formats.bvh_write import format_bvh
from sixpoint.formats.gltf.avatar import GLTF_SUFFIXES, Avatar, load_avatar, read_gltf_motion
from sixpoint.formats.gltf.vrma import format_vrma
from sixpoint.formats.gltf.write_avatar import format_avatar
from sixpoint.formats.gltf.write_figure import format_figure
from sixpoint.formats.space import detect_space, enter_world, leave_world, parse_unit, parse_up
from sixpoint.formats.suffixes import (
    MOTION_SUFFIXES,
    OUTPUT_SUFFIXES,
    SHAPE_OUTPUTS,
    SHAPE_SUFFIXES,
    check_rate,
    check_suffix,
    with_path,
)
from sixpoint.formats.usd import USD_SUFFIXES
from sixpoint.formats.usd.read import read_usd
from sixpoint.formats.usd.write import format_usd


def load(
    path: str | Path,
    *,
    skeleton: str | Path | None = None,
    unit: str | float | None = None,
    up: str | None = None,
    rate: float | None = None,
) -> Motion:
    """Read a motion: .bvh, .amc, .asf, .glb, .gltf, .vrm, .vrma, .usd, .usda or .usdc.

    An ASF alone is one frame of its rest pose. Of a glTF file the first animation is read (without one, the
    pose of its nodes), of a USD stage the first animated skeleton.

    Args:
        path: The file.
        skeleton: The .asf of an .amc file; by default it is looked for beside it.
        unit: Metres per file unit, or one of m, cm, mm, inch, cmu. By default the file's; guessed from
            the size of the body for BVH, which states none. glTF is always in metres.
        up: Up axis of the file, "y" or "z"; by default guessed from the posture for BVH, Y for AMC, and the
            file's for USD. glTF is always Y up.
        rate: Frames per second [Hz] in place of the file's. AMC states none: 120 by default. A glTF
            animation is sampled at this rate, by default that of its keys, 60 if these are not evenly spaced.

    Returns:
        The motion in metres and Y up; ``motion.space`` says what the file had.

    Raises:
        FormatError: The file cannot be read; the message has the line and what was expected there.
    """
    path = Path(path)
    suffix = check_suffix(path, MOTION_SUFFIXES, "motions")
    check_rate(path, rate)
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
        if suffix in USD_SUFFIXES:
            raw, _ = read_usd(path)
            raw = raw if rate is None else replace(raw, rate=rate)
        else:
            raw = read_acclaim(path, skeleton, rate)
        space = raw.space
        if unit is not None:
            space = replace(space, unit=parse_unit(path, unit), unit_source="given")
        if up is not None:
            space = replace(space, up=parse_up(path, up), up_source="given")
        return enter_world(raw, space)
    except SixpointError as error:
        raise with_path(path, error) from error


def load_shape(path: str | Path) -> Shape | None:
    """Read the surface that is skinned to the rig of a glTF, VRM or USD file.

    Args:
        path: The file.

    Returns:
        All its skinned meshes as one shape [m], on the joints that ``load`` gives; None where there is none.

    Raises:
        FormatError: The file cannot be read.
    """
    path = Path(path)
    if check_suffix(path, SHAPE_SUFFIXES, "surfaces") in GLTF_SUFFIXES:
        return load_avatar(path).figure.shape
    motion, shape = read_usd(path)
    unit = motion.space.unit
    if shape is None or unit == 1.0:
        return shape
    return replace(shape, vertices=shape.vertices * unit, bind_positions=shape.bind_positions * unit)


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
    """Write a motion: .bvh, .amc with its .asf beside it, .glb, .vrma (VRM animation), .usd, .usda or .usdc.

    Args:
        motion: In metres, Y up.
        path: The file.
        force: Overwrite existing files.
        unit: Metres per file unit, or one of m, cm, mm, inch, cmu; by default ``motion.space.unit``. glTF and
            USD are always written in metres.
        up: Up axis of the file; by default ``motion.space.up``. All but BVH are always written Y up.
        order: Euler order of a BVH, e.g. "ZYX"; by default ``motion.space.order``, the source's.
        avatar: Written into the .glb, with its meshes, materials and textures; the motion is on its skeleton.
            For a .vrma its anatomy.
        shape: A surface bound to the motion's joints, for .glb and USD; without it, and without an avatar,
            the file has bones only.
        appearance: Colours of the shape, for a .glb.

    Raises:
        FormatError: Nothing was written; the message says why.
    """
    path = Path(path)
    suffix = check_suffix(path, OUTPUT_SUFFIXES, "motions, writing")
    _check_surfaces(path, suffix, avatar, shape, appearance)
    if suffix in GLTF_SUFFIXES:
        _check_metres(path, unit, up)
        check_writable([path], force)
        write_files({path: _format_gltf(motion, path, suffix, avatar, shape, appearance)}, force)
    elif suffix in USD_SUFFIXES:
        if unit is not None or up is not None or order is not None:
            raise FormatError(path, "USD is written in metres, Y up, with quaternions: no unit, up or order")
        check_writable([path], force)
        write_files({path: format_usd(motion, path, shape)}, force)
    else:
        _save_text(motion, path, suffix, force, unit, up, order)


def _save_text(
    motion: Motion,
    path: Path,
    suffix: str,
    force: bool,
    unit: str | float | None,
    up: str | None,
    order: str | None,
) -> None:
    """Write a .bvh, or an .amc with its .asf, in the space of the file that the motion came from."""
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
        raise with_path(path, error) from error
    write_files(dict(zip(targets, (text.encode("utf-8", "replace") for text in texts), strict=True)), force)


def _check_surfaces(
    path: Path, suffix: str, avatar: Avatar | None, shape: Shape | None, appearance: Appearance | None
) -> None:
    if avatar is not None and suffix not in (".glb", ".vrma"):
        raise FormatError(path, "an avatar can only be written into a .glb or a .vrma")
    if shape is not None and suffix not in SHAPE_OUTPUTS:
        raise FormatError(path, f"a {suffix} file holds no surface; formats that do: {listed(SHAPE_OUTPUTS)}")
    if appearance is not None and suffix != ".glb":
        raise FormatError(path, "the colours of a shape can only be written into a .glb")
    if avatar is not None and (shape is not None or appearance is not None):
        raise FormatError(path, "give an avatar, which has a shape of its own, or a shape, not both")


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
            return format_vrma(motion, avatar)
        return format_figure(motion, shape, appearance) if avatar is None else format_avatar(motion, avatar)
    except SixpointError as error:
        raise with_path(path, error) from error


def _check_metres(path: Path, unit: str | float | None, up: str | None) -> None:
    """A glTF file is always in metres and Y up."""
    if (unit is not None and parse_unit(path, unit) != 1.0) or (up is not None and parse_up(path, up) != "y"):
        raise FormatError(
            path, "glTF files are always in metres and Y up: leave out the unit and the up axis"
        )
