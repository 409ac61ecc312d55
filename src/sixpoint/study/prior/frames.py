"""Recordings as examples: rotations and lengths of each frame, and what the points told of the pelvis."""

from __future__ import annotations

from math import exp
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure, SpineChain
from sixpoint.body.motion import Motion
from sixpoint.study.prior import turns

Array = NDArray[np.float64]

Habits = Any
"""The constants of SIK+, ``solvers.sequential_plus.Habits``: how the pelvis is told and the trunk closes."""

TRUNK = 6  # trunk joints at most; shorter trunks have empty rows
RATE = 30.0  # Hz
UP = torch.tensor([0.0, 1.0, 0.0])
CHEST = 0.75  # height of the chest's point between pelvis and head
RUN = 3.0  # m/s


class Frames(NamedTuple):
    """Frames of any clips; the pelvis is at the origin, rotations are anatomical.

    Attributes:
        trunk: (B, 6, 4) world rotation of the pelvis, local ones of the spine.
        head: (B, 4) local rotation of the head.
        clavicles: (B, 2, 4) local rotations.
        limbs: (B, 4, 4) world rotations of shoulders and hips.
        hinges: (B, 4, 4) of elbows and knees.
        ends: (B, 4, 4) of wrists and ankles.
        told: (B, 3) what told the pelvis' X, low-passed [m].
        velocity: (B, 3) of the pelvis, low-passed [m/s].
        segments: (B, 6, 3) trunk segments in the neutral pose [m].
        stations: (B, 6) see ``SpineChain.stations``.
        posed: (B, 6) 1 for a joint of the trunk, 0 for an empty row.
        weights: (B, 6) how easily each joint turns when the trunk closes.
        hips: (B, 2, 3) hips from the pelvis [m].
        girdle: (B, 2, 3) clavicle joints from the chest's joint [m].
        shoulders: (B, 2, 3) shoulders from the clavicle joints [m].
        lengths: (B, 4, 2) upper and lower length of arms and legs [m].
        chest: (B,) trunk joint that carries the arms.
        clip: (B,) number of the clip.
        person: (B,) number of the person.
    """

    trunk: Tensor
    head: Tensor
    clavicles: Tensor
    limbs: Tensor
    hinges: Tensor
    ends: Tensor
    told: Tensor
    velocity: Tensor
    segments: Tensor
    stations: Tensor
    posed: Tensor
    weights: Tensor
    hips: Tensor
    girdle: Tensor
    shoulders: Tensor
    lengths: Tensor
    chest: Tensor
    clip: Tensor
    person: Tensor

    def at(self, index: Tensor | slice) -> Frames:
        """Some of the frames."""
        return Frames(*(getattr(self, name)[index] for name in self._fields))

    @property
    def size(self) -> int:
        """Number of frames."""
        return len(self.head)


def joined(parts: list[Frames]) -> Frames:
    """Frames one after the other."""
    return Frames(*(torch.cat([getattr(p, name) for p in parts]) for name in Frames._fields))


def frames_of(figure: Figure, motion: Motion, habits: Habits, clip: int, person: int) -> Frames:
    """A recording on its figure, at about 30 Hz.

    Args:
        figure: Its anatomy; a rig with clavicles, whose head is a joint.
        motion: The recording.
        habits: Constants of SIK+.
        clip: Number of the clip.
        person: Number of its person.
    """
    motion = motion.sliced(slice(0, None, max(round(motion.rate / RATE), 1)))
    roles, chain = figure.roles, SpineChain.from_figure(figure, own_pelvis=True)
    world = rot.mul(motion.transforms[1], rot.inv(figure.neutral))
    joints, count = list(chain.joints), len(chain.joints)
    chest = min(chain.node[j] for j in figure.skeleton.path(0, roles.clavicle[0])[:-1][-1:])
    frames = len(motion)

    def local(child: int, parent: int) -> Array:
        return rot.mul(rot.inv(world[:, parent]), world[:, child])

    trunk = np.tile(rot.IDENTITY, (frames, TRUNK, 1))
    trunk[:, 0] = world[:, joints[0]]
    for k in range(1, count):
        trunk[:, k] = local(joints[k], joints[k - 1])
    carrier = joints[chest]
    weights = habits.low_joint + (1.0 - habits.low_joint) * (np.arange(count) - 1) / max(count - 2, 1)
    weights[0] = 0.0
    first = [roles.clavicle[k] for k in range(2)]
    chains = roles.limbs
    told, velocity = evidence(figure.targets(motion).positions, motion.rate, habits)

    def padded(rows: Array) -> Array:
        return np.pad(rows, [(0, TRUNK - count)] + [(0, 0)] * (rows.ndim - 1))

    fixed = (
        padded(chain.segments),
        np.pad(chain.stations(chest), (0, TRUNK - count), mode="edge"),
        padded(np.ones(count)),
        padded(weights),
        np.array([figure.offset_between(roles.pelvis, j) for j in roles.hip]),
        np.array([figure.offset_between(carrier, j) for j in first]),
        np.array([figure.offset_between(a, b) for a, b in zip(first, roles.shoulder, strict=True)]),
        np.array(
            [
                [np.linalg.norm(figure.offset_between(a, b)), np.linalg.norm(figure.offset_between(b, c))]
                for a, b, c in chains
            ]
        ),
        np.array(chest),
        np.array(clip),
        np.array(person),
    )
    moving = (
        trunk,
        local(roles.head, joints[-1]),
        np.stack([local(j, carrier) for j in first], axis=1),
        *(world[:, [limb[k] for limb in chains]] for k in range(3)),
        told,
        velocity,
    )
    arrays = [*moving, *(np.broadcast_to(a, (frames, *a.shape)) for a in fixed)]
    return Frames(*(torch.tensor(a if a.dtype.kind == "i" else a.astype(np.float32)) for a in arrays))


def axis_y(points: Tensor, habits: Habits) -> Tensor:
    """The pelvis' Y axis as SIK+ estimates it from points (..., 6, 3)."""
    legs = turns.unit(points[..., 0, :] - points[..., 4:, :].mean(-2))
    chord = turns.unit(points[..., 1, :] - points[..., 0, :])
    below = habits.leg_share * legs + (1.0 - habits.leg_share) * UP.to(legs.dtype)
    return turns.unit(habits.chord_share * chord + (1.0 - habits.chord_share) * below)


def evidence(points: Array, rate: float, habits: Habits) -> tuple[Array, Array]:
    """What told X in SIK+ (F, 3) [m], and the pelvis' velocity (F, 3) [m/s], both low-passed."""
    kept, slow = (exp(-1.0 / rate / t) if t > 0 else 0.0 for t in (habits.memory, habits.speed_memory))
    y = axis_y(torch.tensor(points), habits).numpy()
    told, velocity = np.zeros((len(points), 3)), np.zeros((len(points), 3))
    for f, p in enumerate(points):
        if f > 0:
            now = (p[0] - points[f - 1, 0]) * rate
            now = now * min(1.0, RUN / max(float(np.linalg.norm(now)), 1e-9))
            velocity[f] = slow * velocity[f - 1] + (1.0 - slow) * now
        chest = p[0] + CHEST * (p[1] - p[0])
        forward = habits.speed * velocity[f] + 0.5 * habits.reach * (p[2] + p[3] - 2.0 * chest)
        lines = habits.wrist_line * (p[2] - p[3]) + habits.ankle_line * (p[4] - p[5])
        new = lines + np.cross(y[f], forward)
        new = new - (new @ y[f]) * y[f]
        told[f] = new if f == 0 else kept * told[f - 1] + (1.0 - kept) * new
    return told, velocity
