"""The built-in figure as calibration poses it: few degrees of freedom, linear in its segment lengths.

A trunk of markers does not tell five vertebral joints apart, so lumbar spine, thorax and neck are one ball
each, whose rotation vector their joints share. Many frames are posed at once, in plain NumPy.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.anthropometry import build_skeleton, segments_of_stature
from sixpoint.body.limits import SUBTALAR
from sixpoint.body.skeleton import Skeleton

Array = NDArray[np.float64]

X, Y, Z = np.eye(3)
SEGMENTS = tuple(segments_of_stature(1.75))
"""Names of the segment lengths, in the order of every array of lengths."""


@dataclass(frozen=True, eq=False)
class Block:
    """Joints that turn together.

    Attributes:
        joints: Names, from the root outwards; each makes an equal share of a ball's rotation vector.
        std: Typical angles of each coordinate [deg]: a weak prior where markers say nothing.
        axes: Hinge axes in order; none for a ball.
        range: Least and largest first angle [deg], for a hinge.
    """

    joints: tuple[str, ...]
    std: tuple[float, ...]
    axes: tuple[Array, ...] = ()
    range: tuple[float, float] = (-np.inf, np.inf)


def _limb_blocks(side: str) -> list[Block]:
    return [
        Block((f"{side}_hip",), (40, 20, 30)),
        Block((f"{side}_knee",), (60,), (X,), (0, 160)),
        Block((f"{side}_ankle",), (25, 12), (X, SUBTALAR)),
        Block((f"{side}_sternoclavicular",), (8, 10, 10)),
        Block((f"{side}_shoulder",), (60, 50, 60)),
        Block((f"{side}_elbow",), (60, 45), (X, Y), (-155, 0)),
        Block((f"{side}_wrist",), (25, 15), (Z, X)),
    ]


BLOCKS = (
    Block(("humanoid_root",), (np.inf, np.inf, np.inf)),
    Block(("vl5", "vl1"), (25, 6, 15)),
    Block(("vt6", "vt1"), (12, 20, 12)),
    Block(("vc4", "skullbase"), (30, 35, 20)),
    *_limb_blocks("l"),
    *_limb_blocks("r"),
)
TRUNK, THORAX, NECK = 1, 2, 3


def exponential(vectors: Array) -> Array:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) [rad]."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    cross = skew(vectors)
    small = angle < 1e-6
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 1.0, np.sin(safe) / safe)
    b = np.where(small, 0.5, (1.0 - np.cos(safe)) / safe**2)
    return np.asarray(np.eye(3) + a * cross + b * cross @ cross)


def logarithm(matrices: Array) -> Array:
    """Rotation vectors (..., 3) [rad] of rotation matrices (..., 3, 3)."""
    from scipy.spatial.transform import Rotation

    flat = Rotation.from_matrix(matrices.reshape(-1, 3, 3)).as_rotvec()
    return np.asarray(flat.reshape(matrices.shape[:-1]), float)


def left_jacobian(vectors: Array) -> Array:
    """(..., 3, 3): exp(v + d) = exp(J d) exp(v) for small d."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    cross = skew(vectors)
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 0.5, (1.0 - np.cos(safe)) / safe**2)
    b = np.where(small, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
    return np.asarray(np.eye(3) + a * cross + b * cross @ cross)


def skew(vectors: Array) -> Array:
    """Cross-product matrices (..., 3, 3) of vectors (..., 3)."""
    out = np.zeros((*vectors.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -vectors[..., 2], vectors[..., 1], -vectors[..., 0]
    return out - np.swapaxes(out, -1, -2)


@dataclass(frozen=True, eq=False)
class Placement:
    """Where all joints are in F frames, and how that changes.

    Attributes:
        positions: (F, J, 3) [m].
        world: (F, J, 3, 3) rotations of the joints' frames.
        axes: (F, C, 3) world axis of each column of ``Kinematics.columns``.
        growth: (F, J, 3, K) change of the positions with each segment length.
    """

    positions: Array
    world: Array
    axes: Array
    growth: Array


class Kinematics:
    """Forward kinematics of F frames and its derivatives; the same for every person."""

    def __init__(self) -> None:
        self.skeleton: Skeleton = build_skeleton()
        base = dict.fromkeys(SEGMENTS, 1.0)
        offsets = build_skeleton(base).offsets
        grown = [build_skeleton(base | {name: 2.0}).offsets - offsets for name in SEGMENTS]
        self.per_length: Array = np.stack(grown, axis=-1)
        """(J, 3, K) offsets are this times the lengths."""
        self.per_length[0] = 0.0
        self.starts = 3 + np.cumsum([0, *(len(b.std) for b in BLOCKS)])
        self.size = int(self.starts[-1])
        self.std: Array = np.radians(np.concatenate([[np.inf] * 3, *(b.std for b in BLOCKS)]))

    def dofs(self, joint: str) -> slice:
        """Where the coordinates of a joint's block are."""
        block = next(k for k, b in enumerate(BLOCKS) if joint in b.joints)
        return slice(int(self.starts[block]), int(self.starts[block + 1]))

    @cached_property
    def columns(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(C,) coordinate and joint of each way in which a coordinate turns something."""
        pairs = [
            (int(self.starts[k]) + d, self.skeleton.index(joint))
            for k, block in enumerate(BLOCKS)
            for joint in block.joints
            for d in range(len(block.std))
        ]
        dof, joint = np.array(pairs).T
        return dof, joint

    @cached_property
    def carried(self) -> NDArray[np.bool_]:
        """(J, C) whether a column moves what a joint carries."""
        out = np.zeros((len(self.skeleton), len(self.columns[1])), bool)
        for c, joint in enumerate(self.columns[1]):
            out[self.skeleton.subtree(int(joint)), c] = True
        return out

    @cached_property
    def gather(self) -> Array:
        """(C, D) adds columns up to coordinates."""
        out = np.zeros((len(self.columns[0]), self.size))
        out[np.arange(len(out)), self.columns[0]] = 1.0
        return out

    def rest(self, lengths: Array) -> Array:
        """(J, 3) positions in the neutral pose, root at the origin [m]."""
        return np.asarray(self.rest_per_length @ lengths)

    @cached_property
    def rest_per_length(self) -> Array:
        """(J, 3, K) neutral positions are this times the lengths."""
        out = self.per_length.copy()
        for joint in range(1, len(out)):
            out[joint] += out[self.skeleton.parents[joint]]
        return out

    def place(self, lengths: Array, pose: Array) -> Placement:
        """Pose F frames.

        Args:
            lengths: (K,) [m].
            pose: (F, D) root position [m], then the coordinates of all blocks [rad].
        """
        frames, joints = len(pose), len(self.skeleton)
        positions, world = np.zeros((frames, joints, 3)), np.zeros((frames, joints, 3, 3))
        growth = np.zeros((frames, joints, 3, len(SEGMENTS)))
        axes = np.zeros((frames, len(self.columns[0]), 3))
        offsets = self.per_length @ lengths
        turning = {self.skeleton.index(j): k for k, b in enumerate(BLOCKS) for j in b.joints}
        column = {int(j): int(np.argmax(self.columns[1] == j)) for j in turning}
        for j in range(joints):
            parent = int(self.skeleton.parents[j])
            if parent < 0:
                positions[:, j], above = pose[:, :3], np.broadcast_to(np.eye(3), (frames, 3, 3))
            else:
                above = world[:, parent]
                positions[:, j] = positions[:, parent] + above @ offsets[j]
                growth[:, j] = growth[:, parent] + above @ self.per_length[j]
            if j not in turning:
                world[:, j] = above
                continue
            block = BLOCKS[turning[j]]
            values = pose[:, self.starts[turning[j]] : self.starts[turning[j] + 1]]
            first = column[j]
            if block.axes:
                turned = above
                for k, axis in enumerate(block.axes):
                    axes[:, first + k] = turned @ axis
                    turned = turned @ exponential(values[:, k, None] * axis)
                world[:, j] = turned
            else:
                share = 1.0 / len(block.joints)
                world[:, j] = above @ exponential(share * values)
                axes[:, first : first + 3] = np.swapaxes(share * above @ left_jacobian(share * values), 1, 2)
        return Placement(positions, world, axes, growth)

    def wrap(self, pose: Array) -> None:
        """Keep rotation vectors below half a turn, in place."""
        for k, block in enumerate(BLOCKS):
            if not block.axes:
                part = pose[:, self.starts[k] : self.starts[k] + 3]
                angle = np.linalg.norm(part, axis=1, keepdims=True)
                over = angle[:, 0] > np.pi
                part[over] *= 1.0 - 2.0 * np.pi / angle[over]
