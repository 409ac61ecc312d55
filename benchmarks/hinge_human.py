"""The six-target problem that peers.py poses: the built-in figure as a tree of hinges with box limits.

Any module with the same tables can stand in for it (``load_outside``): NAMES, PARENT, OFFSET, HINGES, T_IDX,
``motion(frames, fps, seed)``, ``fk(position, rotation, q)`` and ``mjcf()``.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import sixpoint as sp

Array = NDArray[np.float64]

X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class Truth:
    """A motion: hinge angles (F, H) [rad], root (F, 3) [m] and (F, 3, 3), joints (F, J, 3) [m]."""

    angles: Array
    root: Array
    turn: Array
    joints: Array


@dataclass(frozen=True)
class Problem:
    """A tree of hinges with a free root, and motions of it.

    Attributes:
        names, parents, offsets: J joints.
        hinge_joint, hinge_name, axes: H hinges in the order in which they turn their joint.
        low, high: (H,) limits [rad].
        targets: Joints of pelvis, head, wrists, ankles.
        motion: (frames, rate, seed) -> Truth.
        place: (root, turn, angles) -> joints (J, 3).
        mjcf: The same body for MuJoCo.
    """

    title: str
    names: list[str]
    parents: NDArray[np.int64]
    offsets: Array
    hinge_joint: NDArray[np.int64]
    hinge_name: list[str]
    axes: Array
    low: Array
    high: Array
    targets: NDArray[np.int64]
    motion: Callable[[int, float, int], Truth]
    place: Callable[[Array, Array, Array], Array]
    mjcf: str

    @property
    def dofs(self) -> sp.Dofs:
        """Degrees of freedom for sixpoint."""
        joints: dict[int, object] = {0: sp.Ball()}
        for joint in sorted(set(self.hinge_joint.tolist())):
            own = self.hinge_joint == joint
            joints[joint] = sp.Hinges(self.axes[own], self.low[own], self.high[own])
        return sp.Dofs(joints)

    @property
    def skeleton(self) -> sp.Skeleton:
        """The tree for sixpoint."""
        return sp.Skeleton(tuple(self.names), self.parents, self.offsets)


def load_outside(path: Path) -> Problem:
    """A problem from a Python module that is not ours."""
    if not path.is_file():
        sys.exit(f"{path}: no such file; give a module that describes a hinge human")
    spec = importlib.util.spec_from_file_location("outside_problem", path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    hinges = module.HINGES

    def motion(frames: int, rate: float, seed: int) -> Truth:
        truth = module.motion(frames, rate, seed)
        return Truth(truth["q"], truth["pos"], truth["R"], truth["P"])

    return Problem(
        path.name,
        list(module.NAMES),
        np.array(module.PARENT),
        np.array(module.OFFSET),
        np.array([h[0] for h in hinges]),
        [h[1] for h in hinges],
        np.array([h[2] for h in hinges], float),
        np.array([h[3] for h in hinges], float),
        np.array([h[4] for h in hinges], float),
        np.array(module.T_IDX),
        motion,
        lambda root, turn, angles: module.fk(root, turn, angles)[0],
        module.mjcf(),
    )


# Axes, limits and the range of the motion [degrees] of the joints of one side; mirrored on the other.
SPINE = [(X, -25, 40, -8, 15), (Z, -15, 15, -8, 8), (Y, -15, 15, -8, 8)]
LIMB = {
    "clavicle": [(Z, -8, 35, -3, 12), (Y, -20, 20, -8, 8)],
    "shoulder": [(Z, -30, 150, 5, 80), (X, -150, 50, -90, 20), (Y, -85, 85, -40, 40)],
    "elbow": [(X, -145, 0, -110, -2), (Y, -80, 80, -40, 40)],
    "wrist": [(Z, -70, 70, -20, 20), (X, -20, 35, -10, 10)],
    "hip": [(X, -120, 25, -70, 12), (Z, -25, 45, -10, 20), (Y, -40, 40, -15, 15)],
    "knee": [(X, 0, 150, 1, 90)],
    "ankle": [(X, -25, 50, -15, 25), (Z, -20, 20, -8, 8)],
}


def build_own(stature: float = 1.75) -> Problem:
    """The built-in figure's 22 joints as hinges."""
    figure = sp.Figure.from_stature(stature)
    roles = figure.roles.named()
    kept = sorted(set(roles.values()))
    parents, offsets = [], []
    for joint in kept:
        parent = figure.skeleton.parents[joint]
        while parent >= 0 and parent not in kept:
            parent = figure.skeleton.parents[parent]
        parents.append(kept.index(parent) if parent >= 0 else -1)
        offsets.append(figure.offset_between(parent, joint) if parent >= 0 else np.zeros(3))
    names = [figure.skeleton.names[joint] for joint in kept]
    rows = []
    for role, joint in roles.items():
        side, _, part = role.partition("_")
        table = LIMB.get(part, [] if role == "pelvis" else SPINE)
        for k, (axis, low, high, least, most) in enumerate(table):
            flipped = (
                side == "r" and part in LIMB and axis is not X
            )  # mirrored: turns about Y and Z change sign
            span = np.radians([low, high, least, most]) * (-1 if flipped else 1)
            if flipped:
                span = span[[1, 0, 3, 2]]
            rows.append((kept.index(joint), k, f"{role}_{k}", axis, *span))
    rows.sort(key=lambda row: row[:2])
    joint_of = np.array([row[0] for row in rows])
    axes, span = np.array([row[3] for row in rows]), np.array([row[4:] for row in rows], float)
    tree = (np.array(parents), np.array(offsets), joint_of, axes)

    def motion(frames: int, rate: float, seed: int) -> Truth:
        return swing(tree, span, frames, rate, seed)

    return Problem(
        "the built-in figure as hinges",
        names,
        tree[0],
        tree[1],
        joint_of,
        [row[2] for row in rows],
        axes,
        span[:, 0],
        span[:, 1],
        np.array([kept.index(roles[name]) for name in sp.EFFECTORS]),
        motion,
        lambda root, turn, angles: place_joints(tree, root[None], turn[None], angles[None])[0],
        write_mjcf(names, *tree, [row[2] for row in rows], span),
    )


def swing(tree: tuple[Array, ...], span: Array, frames: int, rate: float, seed: int) -> Truth:
    """Every hinge swings sinusoidally in its range, at 0.1 to 0.6 Hz; the root wanders."""
    random = np.random.default_rng(seed)
    t = np.arange(frames)[:, None] / rate
    pace, phase = random.uniform(0.1, 0.6, len(span)), random.uniform(0, 2 * np.pi, len(span))
    share = 0.5 + 0.5 * np.sin(2 * np.pi * pace * t + phase)
    angles = span[:, 2] + (span[:, 3] - span[:, 2]) * share
    root = np.hstack([0.4 * np.sin(0.6 * t), 1.0 + 0.08 * np.sin(1.4 * t), 0.4 * np.sin(0.4 * t + 1)])
    yaw, pitch = 0.9 * np.sin(0.5 * t), 0.15 * np.sin(0.8 * t + 1)
    turn = Rotation.from_euler("YX", np.hstack([yaw, pitch])).as_matrix()
    return Truth(angles, root, turn, place_joints(tree, root, turn, angles))


def place_joints(tree: tuple[Array, ...], root: Array, turn: Array, angles: Array) -> Array:
    """Joint positions (F, J, 3) [m] by rotation matrices (SciPy)."""
    parents, offsets, joint_of, axes = tree
    places = np.empty((len(root), len(parents), 3))
    turns = np.empty((len(root), len(parents), 3, 3))
    for joint, parent in enumerate(parents):
        places[:, joint], here = root, turn
        if parent >= 0:
            places[:, joint] = places[:, parent] + turns[:, parent] @ offsets[joint]
            here = turns[:, parent]
        for k in np.flatnonzero(joint_of == joint):
            here = here @ Rotation.from_rotvec(angles[:, k, None] * axes[k]).as_matrix()
        turns[:, joint] = here
    return places


def write_mjcf(
    names: list[str],
    parents: Array,
    offsets: Array,
    joint_of: Array,
    axes: Array,
    hinges: list[str],
    span: Array,
) -> str:
    """The body for MuJoCo."""

    def body(joint: int) -> str:
        text = "".join(
            f'<joint name="{hinges[k]}" type="hinge" axis="{_numbers(axes[k])}" limited="true" '
            f'range="{_numbers(span[k, :2])}"/>'
            for k in np.flatnonzero(joint_of == joint)
        )
        below = "".join(body(int(child)) for child in np.flatnonzero(parents == joint))
        free = '<freejoint name="root"/>' if joint == 0 else ""
        ball = '<geom type="sphere" size="0.03" mass="3" contype="0" conaffinity="0"/>'
        return (
            f'<body name="{names[joint]}" pos="{_numbers(offsets[joint])}">{free}{text}{ball}{below}</body>'
        )

    head = '<mujoco><compiler angle="radian"/><option gravity="0 0 0"/><worldbody>'
    return f"{head}{body(0)}</worldbody></mujoco>"


def _numbers(values: Array) -> str:
    return " ".join(f"{value:.17g}" for value in values)
