"""Lower a figure to the plain arrays that compiled methods of six points read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Ball, Hinges, SwingTwist
from sixpoint.body.figure import COINCIDENT, Figure, SpineChain
from sixpoint.kernels.swing_twist import build_ball_rows
from sixpoint.solvers.six_points.packing import STRETCH_POSES, Model

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def build_model(figure: Figure, chain: SpineChain | None = None, *, ends: bool = False) -> Model:
    """Lower a figure.

    Args:
        figure: What is posed.
        chain: Its trunk; ``figure.spine_chain`` by default.
        ends: Whether head, wrists and ankles have rows too.
    """
    roles, chain = figure.roles, chain or figure.spine_chain
    joints = (*chain.joints, *_limb_joints(figure), *(_end_joints(figure) if ends else ()))
    segments = chain.segments
    share = 1.0 - 2.0 * np.arange(len(segments)) / max(len(segments) - 1, 1)  # eq. 1, summed along the chain
    turns, chords = _stretch_poses(segments)
    chest, girdle, clavicles = _arms(figure, chain)
    before = rot.inv(figure.neutral[np.maximum(figure.skeleton.parents, 0)])
    before[0] = rot.IDENTITY
    return Model(
        segments=np.column_stack([segments, share]),
        turns=turns,
        hips=_rows([figure.offset_between(roles.pelvis, hip) for hip in roles.hip]),
        girdle=_rows(girdle),
        clavicles=_rows(clavicles),
        limbs=np.array([_limb(figure, chain) for chain in roles.limbs]),
        origin=_rows([_origin(figure)]),
        before=before,
        after=np.array(figure.neutral),
        constant=rot.mul(before, figure.neutral),
        balls=build_ball_rows([_limit(figure, joint) for joint in joints]),
        chords=chords,
        chest=chest,
        row=_posed_rows(len(figure.skeleton), joints),
    )


def _rows(vectors: object) -> Array:
    """Vectors (n, 3) as rows of four."""
    return np.pad(np.asarray(vectors, float).reshape(-1, 3), ((0, 0), (0, 1)))


def _posed_rows(count: int, joints: tuple[int, ...]) -> Index:
    row = np.full(count, -1, np.int64)
    for k, joint in enumerate(joints):
        if joint >= 0:
            row[joint] = k
    return row


def _origin(figure: Figure) -> Array:
    """Place of the pelvis' parent in a rig whose root is not the pelvis, else zero."""
    parent = int(figure.skeleton.parents[figure.roles.pelvis])
    if parent < 0:
        return np.zeros(3)
    return np.asarray(figure.skeleton.offsets[figure.skeleton.path(0, parent)].sum(axis=0))


def _limb(figure: Figure, chain: tuple[int, int, int]) -> list[float]:
    """Lengths and flexion range of one limb; the hinge of an elbow is negative about +X."""
    root, middle, end = chain
    dof = figure.dofs[middle]
    assert isinstance(dof, Hinges)
    low, high = float(dof.lower[0]), float(dof.upper[0])
    flexion = [low, high] if middle in figure.roles.knee else [-high, -low]
    upper = np.linalg.norm(figure.offset_between(root, middle))
    return [float(upper), float(np.linalg.norm(figure.offset_between(middle, end))), *flexion]


def _limb_joints(figure: Figure) -> tuple[int, ...]:
    """Rig joints of the limb rows; -1 for clavicles the rig lacks."""
    r = figure.roles
    return (*(r.clavicle or (-1, -1)), *r.shoulder, *r.elbow, *r.hip, *r.knee)


def _end_joints(figure: Figure) -> tuple[int, ...]:
    """Rig joints of the end rows; -1 for a head that is an end site, which its trunk joint turns."""
    r = figure.roles
    head = -1 if np.linalg.norm(figure.head_offset) > COINCIDENT else r.head
    return (head, *r.wrist, *r.ankle)


def _limit(figure: Figure, joint: int) -> SwingTwist | None:
    dof = figure.dofs[joint] if joint >= 0 else None
    return dof.limit if isinstance(dof, Ball) else None


def _arms(figure: Figure, chain: SpineChain) -> tuple[Index, Array, Array]:
    roles = figure.roles
    chest, girdle, clavicles = np.zeros(2, np.int64), np.zeros((2, 3)), np.zeros((2, 3))
    for k, shoulder in enumerate(roles.shoulder):
        first = roles.clavicle[k] if roles.clavicle else shoulder
        carrier = next(j for j in figure.skeleton.path(0, first)[-2::-1] if j in chain.node)
        chest[k] = min(chain.node[carrier], len(chain.joints) - 1)
        place = figure.rest_positions[chain.joints[chest[k]]]
        girdle[k] = figure.rest_positions[first] - place
        clavicles[k] = figure.offset_between(first, shoulder)
    return chest, girdle, clavicles


def _stretch_poses(segments: Array) -> tuple[Array, Array]:
    """Turn every segment towards the chord by a common fraction; chord length at 33 fractions.

    Reference: Unzueta et al. 2008, Algorithm 2, line 11 ("the corresponding pre-recorded pose").
    """
    chord = rot.unit(segments.sum(axis=0))
    directions = rot.unit(segments)
    crossed = np.cross(directions, chord)
    sine = np.linalg.norm(crossed, axis=1)
    angles = np.arctan2(sine, directions @ chord)
    fallback = rot.unit(np.cross(chord, [0.0, 0.0, 1.0]))
    axes = np.where(sine[:, None] > 1e-9, crossed / np.maximum(sine, 1e-9)[:, None], fallback)
    fractions = np.linspace(0.0, 1.0, STRETCH_POSES)
    turned = rot.mul_vec(rot.from_axis_angle(axes, fractions[:, None] * angles), segments)
    chords = np.maximum.accumulate(np.linalg.norm(turned.sum(axis=1), axis=1))
    return np.column_stack([axes, angles]), chords
