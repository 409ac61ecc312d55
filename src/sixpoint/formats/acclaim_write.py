"""Motions to ASF and AMC text.

A bone of an ASF ends where *all* its children start, which few rigs obey. Where the children of a joint
start at different places the joint's bone gets no length and each child hangs on a bone without degrees
of freedom, ``<child>__link``; sites hang on ``<site>__site``. The reader folds them away again.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.motion import Motion
from sixpoint.body.skeleton import Skeleton
from sixpoint.errors import FormatError, listed
from sixpoint.formats.acclaim_bones import LINK, SITE
from sixpoint.formats.bvh_write import ANGLE_DECIMALS, compute_angles, length_decimals
from sixpoint.formats.space import INCH

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PlannedBone:
    """A bone to be written, in file units."""

    name: str
    parent: str
    vector: Array
    dofs: tuple[str, ...] = ()


def plan_bones(motion: Motion, path: Path) -> list[PlannedBone]:
    """The bones of the ASF: one per joint below the root, and what is needed to place them.

    Args:
        motion: In file units, Y up.
        path: For messages.

    Raises:
        FormatError: Names that an ASF cannot hold.
    """
    skeleton = motion.skeleton
    names = ["root", *("_".join(name.split()) for name in skeleton.names[1:])]
    still = np.all(np.abs(motion.rotations[..., :3]) < 1e-12, axis=(0, 2))
    vectors = {j: _own_vector(skeleton, j, names[j]) for j in range(len(skeleton))}
    bones: list[PlannedBone] = []
    for joint in range(1, len(skeleton)):
        parent = int(skeleton.parents[joint])
        above, gap = names[parent], skeleton.offsets[joint] - vectors[parent]
        if np.any(gap != 0):
            bones.append(PlannedBone(names[joint] + LINK, above, gap))
            above = names[joint] + LINK
        turns = not still[joint] or names[joint].endswith((LINK, SITE))  # those would be folded away
        dofs = ("rx", "ry", "rz") * turns + ("tx", "ty", "tz") * (joint in motion.moving)
        bones.append(PlannedBone(names[joint], above, vectors[joint], dofs))
    for site, (name, parent) in enumerate(zip(skeleton.site_names, skeleton.site_parents, strict=True)):
        joint = int(parent)
        if not _ends_in_site(skeleton, joint, names[joint]):
            place = skeleton.site_offsets[site] - vectors[joint]
            bones.append(PlannedBone("_".join(name.split()) + SITE + str(site), names[joint], place))
    _check_names(path, bones)
    return bones


def _ends_in_site(skeleton: Skeleton, joint: int, name: str) -> bool:
    """Whether a joint's bone can simply end at its only site."""
    sites = skeleton.sites_of(joint)
    if joint == 0 or skeleton.children[joint] or len(sites) != 1:
        return False
    named = "_".join(skeleton.site_names[sites[0]].split()) == f"{name}_end"
    return named and bool(np.any(skeleton.site_offsets[sites[0]] != 0))


def _own_vector(skeleton: Skeleton, joint: int, name: str) -> Array:
    """Where a joint's bone ends: at all its children or at its only site, else nowhere."""
    children = list(skeleton.children[joint])
    if joint == 0:
        return np.zeros(3)
    if children:
        offsets = skeleton.offsets[children]
        return offsets[0] if np.all(offsets == offsets[0]) else np.zeros(3)
    if _ends_in_site(skeleton, joint, name):
        return np.asarray(skeleton.site_offsets[skeleton.sites_of(joint)[0]], float)
    return np.zeros(3)


def _check_names(path: Path, bones: list[PlannedBone]) -> None:
    seen: set[str] = {"root", "begin", "end"}
    wrong = []
    for bone in bones:
        if bone.name.lower() in ("begin", "end") or bone.name in seen or bone.name[:1] in ("#", ":", "("):
            wrong.append(bone.name)
        seen.add(bone.name)
    if wrong:
        raise FormatError(path, f"ASF cannot hold these joint names, or holds them twice: {listed(wrong)}")


def format_asf(motion: Motion, bones: list[PlannedBone]) -> str:
    """The text of the ASF file: axes along the world, angles in degrees."""
    lines = ["# ASF written by sixpoint", f"# root {'_'.join(motion.skeleton.names[0].split())}"]
    lines += [":version 1.10", f":name {'_'.join(motion.name.split()) or 'motion'}", ":units"]
    lines += ["  mass 1.0", f"  length {INCH / motion.space.unit!r}", "  angle deg"]
    lines += [":root", "  order TX TY TZ RX RY RZ", "  axis XYZ"]
    lines += [f"  position {_numbers(motion.skeleton.offsets[0])}", "  orientation 0 0 0", ":bonedata"]
    for number, bone in enumerate(bones, start=1):
        length = float(np.linalg.norm(bone.vector))
        direction = bone.vector / length if length > 0 else np.array([0.0, 1.0, 0.0])
        lines += ["  begin", f"    id {number}", f"    name {bone.name}"]
        lines += [f"    direction {_numbers(direction)}", f"    length {length:.15g}", "    axis 0 0 0 XYZ"]
        lines += [f"    dof {' '.join(bone.dofs)}"] * bool(bone.dofs) + ["  end"]
    lines += [":hierarchy", "  begin"]
    below: dict[str, list[str]] = {}
    for bone in bones:
        below.setdefault(bone.parent, []).append(bone.name)
    lines += [f"    {parent} {' '.join(children)}" for parent, children in below.items()]
    return "\n".join([*lines, "  end"]) + "\n"


def _numbers(values: Array) -> str:
    return " ".join(f"{value:.15g}" for value in values)


def format_amc(motion: Motion, bones: list[PlannedBone]) -> str:
    """The text of the AMC file; the rate goes into a comment."""
    skeleton = motion.skeleton
    joints = {"_".join(name.split()): k for k, name in enumerate(skeleton.names[1:], start=1)}
    length = f" %.{length_decimals(motion.space.unit)}f"
    angle = f" %.{ANGLE_DECIMALS}f"
    columns = [np.arange(1, len(motion) + 1)[:, None], motion.root_positions, _angles(motion, 0)]
    template = "%d\nroot" + length * 3 + angle * 3
    for bone in bones:
        if not bone.dofs:
            continue
        joint = joints[bone.name]
        template += "\n" + bone.name.replace("%", "%%")
        if "rx" in bone.dofs:
            columns.append(_angles(motion, joint))
            template += angle * 3
        if "tx" in bone.dofs:
            columns.append(motion.translations[:, motion.moving.index(joint)] - skeleton.offsets[joint])
            template += length * 3
    head = f"# AMC written by sixpoint\n# rate {motion.rate!r}\n:FULLY-SPECIFIED\n:DEGREES\n"
    return head + "\n".join(template % tuple(row) for row in np.hstack(columns).tolist()) + "\n"


def _angles(motion: Motion, joint: int) -> Array:
    """The angles rx, ry, rz [deg] (F, 3), applied in this order about fixed axes."""
    return compute_angles("ZYX", motion.rotations[:, joint])[:, ::-1]
