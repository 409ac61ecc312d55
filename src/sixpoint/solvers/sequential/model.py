"""A figure lowered to the plain arrays that the compiled steps of Sequential IK read.

Posed joints are rows of one array of anatomical local rotations: the S trunk joints, then ten limb
joints at the rows S + CLAVICLE ... S + KNEE, left before right.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Ball, Hinges, SwingTwist
from sixpoint.body.figure import Figure
from sixpoint.kernels.swing_twist import build_ball_rows

Array = NDArray[np.float64]
Index = NDArray[np.int64]

CLAVICLE, SHOULDER, ELBOW, HIP, KNEE, LIMB_ROWS = 0, 2, 4, 6, 8, 10
STRETCH_POSES = 33
COARSE_STEP = 0.1  # rad, Algorithm 3
FINE_STEP = 0.01  # rad, Algorithm 3


class Model(NamedTuple):
    """Arrays of one figure; neutral-pose vectors are in the anatomical frame [m].

    Attributes:
        segments: (S, 3) trunk segments from the pelvis to the head.
        bend: (S, 3) share of the pelvis' bending angle that each segment turns by (eq. 1), and the cosine
            and sine of that share of one coarse step.
        turns: (S, 4) axis, and angle [rad] when the trunk is fully stretched, of each segment's turn
            towards the chord.
        chords: (33,) chord length of the precomputed stretch poses, not decreasing [m]; the first is the
            neutral pose's.
        hips: (2, 3) hips from the pelvis.
        chest: (2,) trunk joint that carries each arm.
        girdle: (2, 3) clavicle joint (or shoulder, without clavicles) from the place of that trunk joint.
        clavicles: (2, 3) shoulder from the clavicle joint; zero without clavicles.
        lengths: (4, 2) upper and lower length of left arm, right arm, left leg, right leg.
        balls: Limits of the posed rows, see ``kernels.swing_twist``; rows of hinges are unlimited there.
        hinges: (4, 2) least and largest flexion of the four limbs [rad], positive.
        row: (J,) posed row of each rig joint, -1 for joints that keep their neutral rotation.
        before: (J, 4) inverse of the neutral rotation of each rig joint's parent.
        after: (J, 4) neutral rotation of each rig joint.
        constant: (J, 4) local rotation of each rig joint in the neutral pose.
        pelvis_origin: (3,) place of the pelvis' parent, which stands still in rigs whose root is not the
            pelvis; zero elsewhere.
    """

    segments: Array
    bend: Array
    turns: Array
    chords: Array
    hips: Array
    chest: Index
    girdle: Array
    clavicles: Array
    lengths: Array
    balls: Array
    hinges: Array
    row: Index
    before: Array
    after: Array
    constant: Array
    pelvis_origin: Array

    @property
    def rows(self) -> int:
        """Number of posed joints."""
        return len(self.segments) + LIMB_ROWS


def build_model(figure: Figure) -> Model:
    """Lower a figure."""
    roles, chain = figure.roles, figure.spine_chain
    segments = chain.segments.copy()
    chest, girdle, clavicles = _arms(figure)
    turns, chords = _stretch_poses(segments)
    row = np.full(len(figure.skeleton), -1, np.int64)
    for k, joint in enumerate((*chain.joints, *_limb_joints(figure))):
        if joint >= 0:
            row[joint] = k
    parents = np.maximum(figure.skeleton.parents, 0)
    before = rot.inv(figure.neutral[parents])
    before[0] = rot.IDENTITY
    share = 1.0 - 2.0 * np.arange(len(segments)) / max(len(segments) - 1, 1)
    lengths = [
        [np.linalg.norm(figure.offset_between(a, b)), np.linalg.norm(figure.offset_between(b, c))]
        for a, b, c in roles.limbs
    ]
    parent = figure.skeleton.parents[roles.pelvis]
    origin = np.zeros(3)
    if parent >= 0:
        origin = figure.skeleton.offsets[figure.skeleton.path(0, int(parent))].sum(axis=0)
    return Model(
        segments=segments,
        bend=np.stack([share, np.cos(share * COARSE_STEP), np.sin(share * COARSE_STEP)], axis=1),
        turns=turns,
        chords=chords,
        hips=np.array([figure.offset_between(roles.pelvis, h) for h in roles.hip]),
        chest=chest,
        girdle=girdle,
        clavicles=clavicles,
        lengths=np.array(lengths),
        balls=build_ball_rows([_limit(figure, j) for j in (*chain.joints, *_limb_joints(figure))]),
        hinges=np.array([_flexion(figure, chain_[1]) for chain_ in roles.limbs]),
        row=row,
        before=before,
        after=np.array(figure.neutral),
        constant=rot.mul(before, figure.neutral),
        pelvis_origin=origin,
    )


def make_scratch(model: Model) -> tuple[NDArray[np.generic], ...]:
    """Working arrays of one solver call.

    World rotations, segment vectors, rotations to bend from, components in the bending plane, the six
    points with lost ones filled in, and which are known.
    """
    count = len(model.segments)
    shapes = ((count, 4), (count, 3), (count, 4), (count, 2), (6, 3))
    return (*(np.empty(shape) for shape in shapes), np.empty(6, np.bool_))


def _limb_joints(figure: Figure) -> tuple[int, ...]:
    """Rig joints of the limb rows; -1 for clavicles the rig lacks."""
    r = figure.roles
    return (*(r.clavicle or (-1, -1)), *r.shoulder, *r.elbow, *r.hip, *r.knee)


def _limit(figure: Figure, joint: int) -> SwingTwist | None:
    dof = figure.dofs[joint] if joint >= 0 else None
    return dof.limit if isinstance(dof, Ball) else None


def _flexion(figure: Figure, joint: int) -> tuple[float, float]:
    """Flexion range, positive; the hinge of an elbow is negative about +X."""
    dof = figure.dofs[joint]
    assert isinstance(dof, Hinges)
    low, high = sorted(abs(float(v)) for v in (dof.lower[0], dof.upper[0]))
    return low, high


def _arms(figure: Figure) -> tuple[Index, Array, Array]:
    chain, roles = figure.spine_chain, figure.roles
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
