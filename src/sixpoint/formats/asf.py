"""ASF files (Acclaim skeletons) to a rig.

Joint j is a bone, placed where the bone *starts*, which is its parent's end; its frame is aligned with the
world in the rest pose. The ends of leaf bones become sites.

Reference: Acclaim skeleton format, as described by J. Lander, Working with motion capture file formats, 1998.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sixpoint.body.dofs import Dofs, JointDof
from sixpoint.body.skeleton import Skeleton
from sixpoint.errors import FormatError, SixpointError
from sixpoint.formats.acclaim_bones import WIDE_OPEN, Bone, BoneTree
from sixpoint.formats.asf_blocks import Block, Blocks, read_blocks
from sixpoint.formats.source import parse_number, parse_numbers
from sixpoint.formats.space import INCH

Array = NDArray[np.float64]

_ROOT_CHANNELS = ("TX", "TY", "TZ", "RX", "RY", "RZ")
_DOFS = ("rx", "ry", "rz", "tx", "ty", "tz", "l")


@dataclass(frozen=True)
class RootSpec:
    """How the root's values in the AMC are to be read.

    Attributes:
        order: Channels in the order of their values, of TX TY TZ RX RY RZ.
        turns: Axes of its rotations in the order in which they are applied.
        frame: (4,) rotation of its axis frame.
    """

    order: tuple[str, ...]
    turns: tuple[str, ...]
    frame: Array


@dataclass(frozen=True, eq=False)
class AcclaimRig:
    """An ASF file.

    Attributes:
        skeleton: Joints and sites in file units.
        bones: Bones that are joints, by their name in the file.
        joints: Bone name -> joint.
        root: The root's channels.
        unit: Metres per file unit.
        degrees: Whether the file's angles are in degrees.
        name: Short name.
    """

    skeleton: Skeleton
    bones: Mapping[str, Bone]
    joints: Mapping[str, int]
    root: RootSpec
    unit: float
    degrees: bool
    name: str

    @cached_property
    def dofs(self) -> Dofs:
        """Hinges of every bone that rotates, with its limits."""
        joints: dict[int, JointDof] = {}
        for name, bone in self.bones.items():
            hinges = bone.compute_hinges()
            if hinges is not None:
                joints[self.joints[name]] = hinges
        return Dofs(joints)


def read_asf(path: Path) -> AcclaimRig:
    """Read an ASF file in its own unit.

    Raises:
        FormatError: With the line of the first thing that is wrong.
    """
    blocks = read_blocks(path)
    unit, degrees = _read_units(path, blocks)
    bones = [_read_bone(path, block, degrees) for block in blocks.bones]
    root, position = _read_root(path, blocks.root, degrees)
    try:
        return _assemble(path, blocks, bones, root, position, unit, degrees)
    except SixpointError as error:
        raise error if isinstance(error, FormatError) else FormatError(path, str(error)) from error


def _read_units(path: Path, blocks: Blocks) -> tuple[float, bool]:
    """Metres per file unit, and whether angles are in degrees."""
    line, words = blocks.units.get("length", (0, ["1.0"]))
    (length,) = parse_numbers(path, line, words, 1, "the unit of length")
    if not 1e-9 <= length <= 1e9:
        raise FormatError(path, "the unit of length must be positive", line=line, got=words[0])
    line, words = blocks.units.get("angle", (0, ["deg"]))
    angle = words[0].lower() if words else ""
    if not angle.startswith(("deg", "rad")):
        got = " ".join(words)
        raise FormatError(path, "unknown unit of angle", line=line, expected="deg or rad", got=got)
    return INCH / float(length), angle.startswith("deg")


def _angles(values: Array, degrees: bool) -> Array:
    return np.deg2rad(values) if degrees else values


def _read_frame(path: Path, block: Block, key: str, order: str, degrees: bool) -> Array:
    """Rotation of an axis frame: three angles applied in ``order`` about fixed axes."""
    line, words = block.get(key, (block.line, ["0", "0", "0"]))
    angles = _angles(parse_numbers(path, line, words[:3], 3, f"{key} of {block.name}"), degrees)
    return np.asarray(Rotation.from_euler(order.lower(), angles).as_quat(), float)


def _axis_order(path: Path, line: int, word: str) -> str:
    if sorted(word.upper()) != ["X", "Y", "Z"]:
        raise FormatError(path, "bad axis order", line=line, expected="an order such as XYZ", got=word)
    return word.upper()


def _read_root(path: Path, block: Block, degrees: bool) -> tuple[RootSpec, Array]:
    line, words = block.get("order", (block.line, list(_ROOT_CHANNELS)))
    order = tuple(word.upper() for word in words)
    if not order or len(set(order)) != len(order) or not set(order) <= set(_ROOT_CHANNELS):
        raise FormatError(
            path, "bad order of the root", line=line, expected=" ".join(_ROOT_CHANNELS), got=" ".join(words)
        )
    named = "".join(channel[1] for channel in order if channel[0] == "R")
    line, words = block.get("axis", (block.line, [named if len(named) == 3 else "XYZ"]))
    axis = _axis_order(path, line, words[-1] if words else "")
    line, words = block.get("position", (block.line, ["0", "0", "0"]))
    position = parse_numbers(path, line, words, 3, "position of the root")
    frame = _read_frame(path, block, "orientation", axis, degrees)
    turns = tuple(letter.lower() for letter in axis if letter in named)
    return RootSpec(order, turns, frame), position


def _read_bone(path: Path, block: Block, degrees: bool) -> Bone:
    for key in ("direction", "length"):
        if key not in block.entries:
            raise FormatError(path, f"bone {block.name} has no {key}", line=block.line, expected=key)
    line, words = block.entries["direction"]
    direction = parse_numbers(path, line, words, 3, f"direction of {block.name}")
    line, words = block.entries["length"]
    (length,) = parse_numbers(path, line, words, 1, f"length of {block.name}")
    line, words = block.get("axis", (block.line, ["0", "0", "0", "XYZ"]))
    order = _axis_order(path, line, words[3] if len(words) == 4 else "".join(words[3:]) or "XYZ")
    frame = _read_frame(path, block, "axis", order, degrees)
    dofs = _read_dofs(path, block)
    vector = direction * length
    if not np.all(np.abs(vector) < 1e12):
        raise FormatError(path, f"bone {block.name} is far too long", line=line)
    return Bone(block.name, vector, frame, dofs, _read_limits(path, block, dofs, degrees))


def _read_dofs(path: Path, block: Block) -> tuple[str, ...]:
    line, words = block.get("dof", (block.line, []))
    dofs = tuple(word.lower() for word in words)
    unknown = [dof for dof in dofs if dof not in _DOFS]
    if unknown or len(set(dofs)) != len(dofs):
        raise FormatError(
            path, f"bad dof of {block.name}", line=line, expected=" ".join(_DOFS), got=" ".join(words)
        )
    return dofs


def _read_limits(path: Path, block: Block, dofs: tuple[str, ...], degrees: bool) -> Array:
    """One (least, largest) pair per dof; ``inf`` and absent limits are wide open."""
    limits = np.tile([-WIDE_OPEN, WIDE_OPEN], (len(dofs), 1))
    if "limits" not in block.entries:
        return limits
    line, words = block.entries["limits"]
    pairs = re.findall(r"\(([^()]*)\)", " ".join(words))
    if len(pairs) != len(dofs):
        raise FormatError(
            path,
            f"limits of {block.name} do not match its dof",
            line=line,
            expected=f"{len(dofs)} pairs (least largest)",
            got=" ".join(words),
        )
    for k, pair in enumerate(pairs):
        ends = pair.replace(",", " ").split()
        if len(ends) != 2:
            raise FormatError(path, "bad limits", line=line, expected="(least largest)", got=f"({pair})")
        for side, word in enumerate(ends):
            if word.lower().lstrip("+-") not in ("inf", "infinity"):
                value = np.array(parse_number(path, line, word, f"limit of {block.name}"))
                limits[k, side] = _angles(value, degrees and dofs[k][0] == "r")
        if limits[k, 0] > limits[k, 1]:
            raise FormatError(
                path, f"least limit of {block.name} above the largest", line=line, got=f"({pair})"
            )
    return limits


def _assemble(
    path: Path,
    blocks: Blocks,
    bones: list[Bone],
    root: RootSpec,
    position: Array,
    unit: float,
    degrees: bool,
) -> AcclaimRig:
    tree = BoneTree({bone.name: bone for bone in bones}, blocks.parents)
    names = ["root", *tree.sorted_joints()]
    index = {name: k for k, name in enumerate(names)}
    offsets = np.array([position, *(tree.compute_start(name) for name in names[1:])])
    sites = [
        (site, index[carrier], offset)
        for site, carrier, offset in sorted(tree.find_sites(), key=lambda site: index[site[1]])
    ]
    skeleton = Skeleton(
        (blocks.root_name or "root", *names[1:]),
        np.array([-1, *(index[tree.joint_above(name)] for name in names[1:])]),
        offsets,
        tuple(site[0] for site in sites),
        np.array([site[1] for site in sites], dtype=np.int64),
        np.array([site[2] for site in sites]).reshape(-1, 3),
    )
    joints = {name: tree.bones[name] for name in names[1:]}
    return AcclaimRig(skeleton, joints, index, root, unit, degrees, path.stem)
