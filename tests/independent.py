"""Readers and formulas that share no code with sixpoint, to check it against."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from sixpoint import Figure, Motion, SwingTwist


def read_bvh_positions(path: Path) -> dict[str, np.ndarray]:
    """Joint positions (F, 3) in file units by a reader of its own: tokens, recursion, rotation matrices."""
    head, body = path.read_text().split("MOTION")
    words = head.split()
    data = np.array([line.split() for line in body.strip().split("\n")[2:]], float)
    found: dict[str, np.ndarray] = {}
    at = column = 0

    def read(position: np.ndarray, matrix: np.ndarray) -> None:
        nonlocal at, column
        at += 1
        while words[at] != "}":
            word = words[at]
            if word == "OFFSET":
                local = np.array(words[at + 1 : at + 4], float) * np.ones((len(data), 1))
                at += 4
            elif word == "CHANNELS":
                count = int(words[at + 1])
                names, at = words[at + 2 : at + 2 + count], at + 2 + count
                turn = np.tile(np.eye(3), (len(data), 1, 1))
                for name in names:
                    value, column = data[:, column], column + 1
                    if name[1:] == "position":
                        local[:, "XYZ".index(name[0])] = value
                    else:
                        turn = turn @ Rotation.from_euler(name[0], value[:, None], degrees=True).as_matrix()
                place = position + np.einsum("fij,fj->fi", matrix, local)
                found[joint[-1]] = place
                frame = matrix @ turn
            elif word == "JOINT":
                joint.append(words[at + 1])
                at += 2
                read(place, frame)
                joint.pop()
            else:
                at = words.index("}", at) + 1
        at += 1

    joint = [words[2]]
    at = 3
    read(np.zeros((len(data), 3)), np.tile(np.eye(3), (len(data), 1, 1)))
    return found


def world_matrices(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """World positions (F, J, 3) and rotation matrices (F, J, 3, 3) by SciPy matrices."""
    frames, joints = motion.rotations.shape[:2]
    local = Rotation.from_quat(motion.rotations.reshape(-1, 4)).as_matrix().reshape(frames, joints, 3, 3)
    offsets = np.tile(motion.skeleton.offsets, (frames, 1, 1))
    offsets[:, list(motion.moving)] = motion.translations
    positions, world = offsets.copy(), local.copy()
    for j, parent in enumerate(motion.skeleton.parents):
        if parent >= 0:
            positions[:, j] = positions[:, parent] + np.einsum("fij,fj->fi", world[:, parent], offsets[:, j])
            world[:, j] = world[:, parent] @ local[:, j]
    return positions, world


def anatomical(figure: Figure, motion: Motion, joint: int, parent: int) -> np.ndarray:
    """Rotation matrices (F, 3, 3) of a joint against another, in anatomical frames."""
    _, world = world_matrices(motion)
    neutral = Rotation.from_quat(figure.neutral).as_matrix()
    above = world[:, parent] @ neutral[parent].T
    return np.swapaxes(above, 1, 2) @ world[:, joint] @ neutral[joint].T


def limit_excess(limit: SwingTwist, matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far rotations (F, 3, 3) are outside swing and twist limits [rad], by matrices."""
    segment = matrices @ limit.axis
    psi = np.arctan2(np.linalg.norm(np.cross(limit.axis, segment), axis=1), segment @ limit.axis)
    theta = np.arctan2(segment @ limit.side, segment @ limit.forward)
    # Undo the swing: the shortest rotation that takes the segment back; what is left turns about the axis.
    turn = np.cross(segment, limit.axis)
    length = np.linalg.norm(turn, axis=1, keepdims=True)
    back = Rotation.from_rotvec(np.where(length > 1e-12, turn / np.maximum(length, 1e-12), 0) * psi[:, None])
    left = back.as_matrix() @ matrices
    tau = np.arctan2(
        np.einsum("fi,fi->f", left @ limit.forward, np.tile(limit.side, (len(left), 1))),
        np.einsum("fi,fi->f", left @ limit.forward, np.tile(limit.forward, (len(left), 1))),
    )
    if np.cross(limit.axis, limit.forward) @ limit.side < 0:
        tau = -tau
    swing = psi - limit.compute_limit(theta)
    twist = np.maximum(limit.twist[0] - tau, tau - limit.twist[1])
    antipode = psi > np.pi - 1e-6  # neither theta nor twist is defined there
    swing[antipode], twist[antipode] = np.pi - limit.psi.max(), 0.0
    return np.maximum(swing, 0.0), np.maximum(twist, 0.0)
