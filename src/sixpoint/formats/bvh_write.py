"""Motions to BVH text.

One Euler order for all joints; the root and joints that really translate get six channels, all others
three. Angles are written without jumps of a full turn, so that other programs can interpolate them.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.motion import Motion
from sixpoint.body.skeleton import Skeleton
from sixpoint.errors import FormatError, listed

Array = NDArray[np.float64]

ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
ANGLE_DECIMALS = 7  # 1e-7 degrees = 2e-9 rad


def format_bvh(motion: Motion, path: Path, order: str = "ZYX") -> str:
    """The text of a BVH file.

    Args:
        motion: In file units and file axes; ``space.unit`` only sets the number of decimals.
        path: For messages.
        order: Euler order of all joints.

    Raises:
        FormatError: Unknown order, or joint names that BVH cannot hold.
    """
    order = str(order).upper()
    if order not in ORDERS:
        raise FormatError(path, f"unknown Euler order {order!r}; orders: {listed(ORDERS)}")
    _check_names(motion.skeleton, path)
    joints = depth_first(motion.skeleton)
    decimals = length_decimals(motion.space.unit)
    lines = ["HIERARCHY", *_format_hierarchy(motion, order, decimals)]
    lines += ["MOTION", f"Frames: {len(motion)}", f"Frame Time: {1.0 / motion.rate:.12g}"]
    return "\n".join([*lines, *_format_frames(motion, joints, order, decimals)]) + "\n"


def length_decimals(unit: float) -> int:
    """Decimals that resolve 1e-8 m in a file unit of ``unit`` metres."""
    return min(max(8 + round(math.log10(unit)), 4), 12)


def depth_first(skeleton: Skeleton) -> list[int]:
    """Joints in the order in which a nested file names them."""
    order, stack = [], [0]
    while stack:
        joint = stack.pop()
        order.append(joint)
        stack.extend(reversed(skeleton.children[joint]))
    return order


def compute_angles(order: str, rotations: Array) -> Array:
    """Intrinsic Euler angles [deg] (F, 3) of rotations (F, 4), without jumps of a full turn."""
    return np.asarray(np.rad2deg(np.unwrap(rot.to_euler(order, rotations), axis=0)), float)


def _check_names(skeleton: Skeleton, path: Path) -> None:
    wrong = [n for n in skeleton.names if re.search(r"[{}\x00-\x1f]", n) or not n or n != " ".join(n.split())]
    if wrong:
        raise FormatError(path, f"BVH cannot hold these joint names: {listed([repr(n) for n in wrong])}")


def _format_hierarchy(motion: Motion, order: str, decimals: int) -> list[str]:
    skeleton = motion.skeleton
    rotation = " ".join(f"{axis}rotation" for axis in order)
    lines: list[str] = []

    def offset(indent: str, values: Array) -> str:
        return f"{indent}OFFSET " + " ".join(f"{value:.{decimals + 2}f}" for value in values)

    stack: list[tuple[int, int]] = [(0, 0)]  # (joint, depth); a joint of -1 closes a brace
    while stack:
        joint, depth = stack.pop()
        indent = "\t" * depth
        if joint < 0:
            lines.append(indent + "}")
            continue
        inner = indent + "\t"
        positions = "6 Xposition Yposition Zposition" if joint in motion.moving else "3"
        lines += [f"{indent}{'JOINT' if joint else 'ROOT'} {skeleton.names[joint]}", indent + "{"]
        lines += [offset(inner, skeleton.offsets[joint]), f"{inner}CHANNELS {positions} {rotation}"]
        sites = [skeleton.site_offsets[k] for k in skeleton.sites_of(joint)]
        if not sites and not skeleton.children[joint]:
            sites = [np.zeros(3)]  # readers want every leaf closed
        for site in sites:
            lines += [f"{inner}End Site", inner + "{", offset(inner + "\t", site), inner + "}"]
        stack.append((-1, depth))
        stack.extend((child, depth + 1) for child in reversed(skeleton.children[joint]))
    return lines


def _format_frames(motion: Motion, joints: list[int], order: str, decimals: int) -> list[str]:
    columns: list[Array] = []
    formats: list[str] = []
    for joint in joints:
        if joint in motion.moving:
            columns.append(motion.translations[:, motion.moving.index(joint)])
            formats += [f"%.{decimals}f"] * 3
        columns.append(compute_angles(order, motion.rotations[:, joint]))
        formats += [f"%.{ANGLE_DECIMALS}f"] * 3
    row = " ".join(formats)
    return [row % tuple(values) for values in np.hstack(columns).tolist()]
