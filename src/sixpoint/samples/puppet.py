"""A puppet: trunk curves and limb end points -> a natural motion of a figure.

The trunk is posed first, by angles spread over the spine in proportion to each joint's range of motion. Then
each arm and leg is hung on it by a two-bone formula. Nothing here is an IK solver of the project, so that
the motions can serve as ground truth for all of them. Lengths are authored for the figure of 1.75 m.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Ball
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.samples.keyframes import RATE, smooth_step
from sixpoint.samples.limb import X, Y, Z, compute_pole, limit_reach, solve_two_bones
from sixpoint.samples.tracks import Foot, Hand, Trunk, compute_ankle

Array = NDArray[np.float64]

LEG = 0.861  # thigh and calf of the figure the samples are authored for [m]
SIDES = (1.0, -1.0)


@dataclass(frozen=True, eq=False)
class Puppet:
    """A figure whose trunk moves; ask it where its chest is, then let it perform.

    Attributes:
        figure: The figure.
        trunk: Curves of the trunk, authored for 1.75 m.
        rotations: (F, J, 4) anatomical local rotations; trunk and neck are filled in.
    """

    figure: Figure
    trunk: Trunk
    rotations: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        frames = len(self.trunk.pelvis)
        rotations = np.tile(rot.IDENTITY, (frames, len(self.figure.skeleton), 1))
        roles = self.figure.roles
        rotations[:, roles.pelvis] = rot.from_euler("YXZ", self.trunk.turn)
        above = roles.spine[roles.spine.index(self._chest) + 1 :]
        below = roles.spine[: len(roles.spine) - len(above)]
        self._bend(rotations, below, self.trunk.spine)
        object.__setattr__(self, "rotations", rotations)
        chest = self._world(self._chest)[1]
        neck = rot.mul(rot.inv(chest), rot.from_euler("YXZ", self.trunk.gaze))
        self._bend(rotations, above, _flexion_bend_twist(neck))

    @cached_property
    def scale(self) -> float:
        """Size of this figure over the size the samples are authored for."""
        return self._length(self.figure.roles.hip[0], self.figure.roles.ankle[0]) / LEG

    @property
    def _chest(self) -> int:
        """The spine joint that carries both shoulders."""
        spine, shoulder = self.figure.roles.spine, self.figure.roles.shoulder
        return max(set(spine) & set(self.figure.skeleton.path(0, shoulder[0])), key=spine.index)

    def _length(self, joint: int, other: int) -> float:
        return float(np.linalg.norm(self.figure.offset_between(joint, other)))

    def _bend(self, rotations: Array, joints: tuple[int, ...], total: Array) -> None:
        """Spread flexion, side bend and twist (F, 3) over joints by their ranges, never beyond them."""
        ranges = np.array([_range(self.figure, j) for j in joints]).reshape(-1, 3)
        most = 0.95 * ranges.sum(axis=0)
        total = np.where(most > 0, most * np.tanh(total / np.maximum(most, 1e-9)), 0.0)
        for joint, share in zip(joints, ranges / np.maximum(ranges.sum(axis=0), 1e-9), strict=True):
            flexion, bend, twist = (total * share).T
            swing = np.stack([flexion, np.zeros_like(bend), -bend], axis=-1)
            size = np.linalg.norm(swing, axis=-1)
            rotations[:, joint] = rot.mul(
                rot.from_axis_angle(rot.unit(swing), size), rot.from_axis_angle(Y, twist)
            )

    def _world(self, joint: int) -> tuple[Array, Array]:
        """Position (F, 3) [m] and anatomical rotation (F, 4) of one joint in the world, as posed so far."""
        path = self.figure.skeleton.path(self.figure.roles.pelvis, joint)
        position, turned = self.trunk.pelvis * self.scale, self.rotations[:, path[0]]
        for j in path[1:]:
            position = position + rot.mul_vec(turned, self.figure.offsets[j])
            turned = rot.mul(turned, self.rotations[:, j])
        return position, turned

    def in_chest(self, side: int, points: ArrayLike) -> Array:
        """Points (F, 3) given from the shoulder in the chest's frame, in arm lengths, as world points.

        The first coordinate points away from the body on either side (0 = left, 1 = right).
        """
        chest, turned = self._world(self._chest)
        roles = self.figure.roles
        arm = self._length(roles.shoulder[side], roles.elbow[side])
        arm += self._length(roles.elbow[side], roles.wrist[side])
        local = np.asarray(points, float) * [SIDES[side], 1.0, 1.0] * arm
        local = local + self.figure.offset_between(self._chest, roles.shoulder[side])
        return (chest + rot.mul_vec(turned, local)) / self.scale

    def in_pelvis(self, side: int, points: ArrayLike) -> Array:
        """Points (F, 3) given from the hip in the pelvis' frame [m], x outwards, as world points."""
        pelvis, turned = self._world(self.figure.roles.pelvis)
        hip = self.figure.offset_between(self.figure.roles.pelvis, self.figure.roles.hip[side])
        local = np.asarray(points, float) * [SIDES[side], 1.0, 1.0] + hip / self.scale
        return pelvis / self.scale + rot.mul_vec(turned, local)

    def perform(self, feet: tuple[Foot, Foot], hands: tuple[Hand, Hand], name: str) -> Motion:
        """Hang the limbs on the trunk; left comes before right."""
        for side in (0, 1):
            self._leg(side, feet[side])
            self._arm(side, hands[side])
        pelvis = self.trunk.pelvis * self.scale
        return self.figure.compute_motion(self.rotations, pelvis, RATE, name=name)

    def _leg(self, side: int, foot: Foot) -> None:
        roles = self.figure.roles
        hip, knee, ankle = roles.hip[side], roles.knee[side], roles.ankle[side]
        turned = rot.from_euler("YXZ", foot.turn)
        end = compute_ankle(foot) * self.scale
        start, pelvis = self._world(int(self.figure.skeleton.parents[hip]))
        start = start + rot.mul_vec(pelvis, self.figure.offsets[hip])
        upper, lower = self._length(hip, knee), self._length(knee, ankle)
        vector = limit_reach(rot.mul_vec(rot.inv(pelvis), end - start), upper + lower)
        toes = np.unwrap(foot.turn[:, 0]) - np.unwrap(self.trunk.turn[:, 0])
        out = 0.7 * toes * SIDES[side] + foot.swivel
        pole = compute_pole(rot.unit(vector), -Y, Z, -SIDES[side] * out)
        self.rotations[:, hip], flexion = solve_two_bones(vector, pole, upper, lower, 1.0)
        self.rotations[:, knee] = rot.from_axis_angle(X, flexion)
        planted = rot.mul(rot.inv(self._world(knee)[1]), turned)
        hanging = rot.from_axis_angle(X, foot.point)
        self.rotations[:, ankle] = _blend(planted, hanging, foot.air)
        toe = f"{'lr'[side]}_metatarsal"
        if toe in self.figure.skeleton.names:  # toes stay flat while the heel is up, and relax in the air
            height = np.maximum(foot.place[:, 1], 0.0)
            bend = np.maximum(foot.turn[:, 1], 0.0) * np.exp(-((height / 0.06) ** 2)) * (1.0 - foot.air)
            self.rotations[:, self.figure.skeleton.index(toe)] = rot.from_axis_angle(X, -bend)

    def _arm(self, side: int, hand: Hand) -> None:
        roles, sign = self.figure.roles, SIDES[side]
        shoulder, elbow, wrist = roles.shoulder[side], roles.elbow[side], roles.wrist[side]
        upper, lower = self._length(shoulder, elbow), self._length(elbow, wrist)
        if roles.clavicle:
            self._shrug(side, hand)
        end = hand.wrist * self.scale
        parent = int(self.figure.skeleton.parents[shoulder])
        start, turned = self._world(parent)
        start = start + rot.mul_vec(turned, self.figure.offsets[shoulder])
        chest = self._world(self._chest)[1]
        vector = limit_reach(rot.mul_vec(rot.inv(chest), end - start), upper + lower)
        reference = rot.unit([0.3 * sign, -0.25, 0.9])
        down = rot.unit([0.35 * sign, -0.9, -0.1])
        down = rot.unit(down - (down @ reference) * reference)
        pole = compute_pole(rot.unit(vector), reference, down, sign * hand.swivel)
        rotation, flexion = solve_two_bones(vector, pole, upper, lower, -1.0)
        self.rotations[:, shoulder] = rot.mul(rot.mul(rot.inv(turned), chest), rotation)
        self.rotations[:, elbow] = rot.from_axis_angle(X, -flexion)
        mirrored = hand.turn * [-sign, -sign, -1.0]
        self.rotations[:, wrist] = rot.from_euler("YZX", mirrored)

    def _shrug(self, side: int, hand: Hand) -> None:
        """The shoulder girdle follows the arm: up when the hand rises, forward when it reaches."""
        aim = (hand.wrist - self.in_chest(side, np.zeros(3))) * self.scale
        aim = rot.mul_vec(rot.inv(self._world(self._chest)[1]), aim) / (0.6 * self.scale)
        up = 0.42 * smooth_step((aim[:, 1] + 0.5) / 1.5) + hand.shrug[:, 0]
        forward = 0.16 * np.tanh(1.5 * (aim[:, 2] - 0.2)) + hand.shrug[:, 1]
        angles = np.stack([-forward, up], axis=-1) * SIDES[side]
        self.rotations[:, self.figure.roles.clavicle[side]] = rot.from_euler("YZ", angles)


def _blend(a: Array, b: Array, weight: Array) -> Array:
    """From rotations ``a`` (weight 0) to ``b`` (weight 1), all (F, ...)."""
    between = rot.mul(rot.inv(a), b)
    between = between * np.where(between[:, 3:] < 0, -1.0, 1.0)
    size = 2.0 * np.arctan2(np.linalg.norm(between[:, :3], axis=1), between[:, 3])
    return rot.mul(a, rot.from_axis_angle(rot.unit(between[:, :3]), size * weight))


def _range(figure: Figure, joint: int) -> Array:
    """Flexion, side bend and twist (3,) that a spine joint allows [rad]."""
    dof = figure.dofs[joint]
    if not isinstance(dof, Ball) or dof.limit is None:
        return np.zeros(3)
    both = dof.limit.compute_limit([0.0, np.pi]).mean()
    return np.array([both, dof.limit.compute_limit(np.pi / 2), dof.limit.twist[1]], float)


def _flexion_bend_twist(q: Array) -> Array:
    """Rotations (F, 4) as flexion, side bend and twist (F, 3) [rad]: a twist about Y, then a swing."""
    twist = 2.0 * np.arctan2(q[:, 1], q[:, 3])
    twist = (twist + np.pi) % (2 * np.pi) - np.pi
    swing = rot.mul(q, rot.inv(rot.from_axis_angle(Y, twist)))
    size = 2.0 * np.arctan2(np.linalg.norm(swing[:, :3], axis=1), swing[:, 3])
    vector = rot.unit(swing[:, :3]) * size[:, None]
    return np.stack([vector[:, 0], -vector[:, 2], twist], axis=-1)
