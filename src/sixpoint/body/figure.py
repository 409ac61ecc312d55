"""A figure: a rig whose joints have anatomical roles, axes and limits. This is what human solvers pose.

Every rig has its own rest pose, axes and names; no solver ever sees them. A figure holds, per joint, the
rotation of the rig's frame in the anatomical neutral pose. From it follow the anatomical figure (all
frames aligned with the world in the neutral pose) and the way in and out:

    local rig rotation = inv(neutral of parent) * anatomical local rotation * neutral

Joints without a role (fingers, toes, twist and helper joints) keep their neutral rotation, which is the
rig's rest rotation; ``Figure.compute_motion(..., extras=recording)`` copies them from a recording.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.anthropometry import build_skeleton, segments_of_stature
from sixpoint.body.dofs import Ball, Dofs, JointDof
from sixpoint.body.limits import Limits
from sixpoint.body.mapping import read_mapping
from sixpoint.body.motion import Motion, Pose
from sixpoint.body.neutral import compute_neutral
from sixpoint.body.roles import Roles, find_roles
from sixpoint.body.skeleton import Skeleton, frozen
from sixpoint.body.spine_chain import COINCIDENT, SpineChain
from sixpoint.body.surface.shape import Shape
from sixpoint.body.targets import Targets
from sixpoint.errors import FigureError

Array = NDArray[np.float64]

__all__ = ["COINCIDENT", "Figure", "SpineChain"]


@dataclass(frozen=True, eq=False, repr=False)
class Figure:
    """A skeleton with anatomy.

    Attributes:
        skeleton: The rig.
        roles: Which joint is what.
        neutral: (J, 4) world rotation of each rig frame in the neutral pose.
        dofs: Limits of the posed joints, in anatomical frames.
        name: For messages.
        shape: Its surface, if it has one.
    """

    skeleton: Skeleton
    roles: Roles
    neutral: Array
    dofs: Dofs
    name: str = "figure"
    shape: Shape | None = None

    def __repr__(self) -> str:
        return f"Figure({self.name!r}, {len(self.skeleton)} joints, height {self.height:.3f} m)"

    def __post_init__(self) -> None:
        object.__setattr__(self, "neutral", frozen(self.neutral))
        if self.shape is not None and len(self.shape.bind_positions) != len(self.skeleton):
            raise FigureError(
                f"the shape is bound to {len(self.shape.bind_positions)} joints, "
                f"the skeleton has {len(self.skeleton)}"
            )

    # --- construction ----------------------------------------------------------------------------

    @classmethod
    def from_motion(
        cls,
        motion: Motion,
        mapping: Mapping[str, str] | str | Path | None = None,
        limits: Limits | None = None,
    ) -> Figure:
        """Find the anatomy of a recording's rig.

        Args:
            motion: The recording; its degrees of freedom and its movement tell the flexion axes.
            mapping: Role -> joint name, or a TOML file that holds such a table, for what cannot be found.
            limits: Joint limits; the shipped table by default.

        Raises:
            FigureError: A role was not found, or a limb has no length.
        """
        roles = find_roles(motion.skeleton, read_mapping(mapping), motion)
        neutral = compute_neutral(motion.skeleton, roles, motion)
        return cls._with_limits(motion.skeleton, roles, neutral, limits, motion.name)

    @classmethod
    def from_skeleton(
        cls,
        skeleton: Skeleton,
        mapping: Mapping[str, str] | str | Path | None = None,
        limits: Limits | None = None,
    ) -> Figure:
        """Find the anatomy of a rig from its rest pose alone; see ``from_motion``."""
        roles = find_roles(skeleton, read_mapping(mapping))
        return cls._with_limits(skeleton, roles, compute_neutral(skeleton, roles), limits, "figure")

    @classmethod
    def from_stature(cls, stature: float = 1.75, limits: Limits | None = None) -> Figure:
        """The built-in 34-joint H-Anim figure, scaled to a stature [m]."""
        return cls.from_segments(**segments_of_stature(stature), limits=limits)

    @classmethod
    def from_segments(cls, *, limits: Limits | None = None, **segments: float) -> Figure:
        """The built-in figure with segment lengths [m]; what is not given follows from a stature of 1.75 m.

        Args:
            limits: Joint limits; the shipped table by default.
            **segments: ``foot, calf, thigh, pelvis_length, pelvis_width, torso_length, torso_width, neck,
                upper_arm, forearm, hand`` (Unzueta et al. 2008, section 9).
        """
        return cls.from_skeleton(build_skeleton(segments), limits=limits)

    @classmethod
    def _with_limits(
        cls, skeleton: Skeleton, roles: Roles, neutral: Array, limits: Limits | None, name: str
    ) -> Figure:
        figure = cls(skeleton, roles, neutral, Dofs(), name)
        return replace(figure, dofs=figure._compute_dofs(limits or Limits.default()))

    def with_limits(self, limits: Limits) -> Figure:
        """The same figure with other joint limits."""
        return replace(self, dofs=self._compute_dofs(limits))

    def with_shape(self, shape: Shape | None) -> Figure:
        """The same figure with another surface, or with none."""
        return replace(self, shape=shape)

    def full_dofs(self, limits: Limits | None = None) -> Dofs:
        """The figure's degrees of freedom with those of forearms, wrists and ankles.

        Six positions say nothing about these; tasks on hands and feet need them.

        Args:
            limits: Ranges of the added joints; the shipped table by default.
        """
        limits = limits or Limits.default()
        joints = dict(self.dofs.joints)
        for k, side in enumerate((1.0, -1.0)):
            joints[self.roles.elbow[k]] = limits.forearm(side)
            joints[self.roles.wrist[k]] = limits.wrist(side)
            joints[self.roles.ankle[k]] = limits.ankle(side)
        return Dofs(joints)

    def _compute_dofs(self, limits: Limits) -> Dofs:
        joints: dict[int, JointDof] = {self.roles.pelvis: Ball()}
        for joint, ball in zip(self.roles.spine, limits.spine(self._spine_heights()), strict=True):
            joints[joint] = ball
        for k, side in enumerate((1.0, -1.0)):
            for joint, shoulder in zip(self.roles.clavicle[k : k + 1], self.roles.shoulder[k:], strict=False):
                axis = rot.unit(self.offset_between(joint, shoulder))
                if axis.any():
                    joints[joint] = limits.clavicle(axis, side)
            joints[self.roles.shoulder[k]] = limits.shoulder(side)
            joints[self.roles.hip[k]] = limits.hip(side)
            joints[self.roles.elbow[k]] = limits.elbow()
            joints[self.roles.knee[k]] = limits.knee()
        return Dofs(joints)

    def _spine_heights(self) -> Array:
        """Place of each spine joint along the trunk, 0 at the pelvis, 1 at the head effector."""
        trunk = self.rest_positions[[self.roles.pelvis, *self.roles.spine]]
        points = np.vstack([trunk, trunk[-1] + self.head_offset])
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        return np.asarray(length[1:-1] / max(length[-1], COINCIDENT))

    # --- geometry of the neutral pose ------------------------------------------------------------

    @cached_property
    def offsets(self) -> Array:
        """(J, 3) anatomical offsets [m]: each joint's place seen from its parent in the neutral pose."""
        parents = np.maximum(self.skeleton.parents, 0)
        offsets = rot.mul_vec(self.neutral[parents], self.skeleton.offsets)
        offsets[0] = 0.0
        return frozen(offsets)  # type: ignore[return-value]

    @cached_property
    def rest_positions(self) -> Array:
        """(J, 3) joint positions in the neutral pose, root at the origin [m]."""
        identity = np.tile(rot.IDENTITY, (len(self.skeleton), 1))
        return replace(self.skeleton, offsets=self.offsets).compute_transforms(identity)[0]

    def offset_between(self, joint: int, other: int) -> Array:
        """Vector (3,) from one joint to another in the neutral pose [m]."""
        return np.asarray(self.rest_positions[other] - self.rest_positions[joint])

    @cached_property
    def limb_lengths(self) -> Array:
        """(4,) lengths of left arm, right arm, left leg and right leg, stretched [m]."""
        bones = [[self.offset_between(a, b), self.offset_between(b, c)] for a, b, c in self.roles.limbs]
        return np.asarray(np.linalg.norm(bones, axis=2).sum(axis=1))

    @cached_property
    def spine_chain(self) -> SpineChain:
        """The trunk as the solvers see it, coincident joints merged."""
        return SpineChain.from_figure(self)

    @property
    def head_offset(self) -> Array:
        """(3,) head effector from the head joint, in the neutral pose [m]."""
        return rot.mul_vec(self.neutral[self.roles.head], self.roles.head_offset)

    @property
    def height(self) -> float:
        """Sum of calf, thigh, pelvis, torso and neck lengths [m]: the unit of the position error.

        Reference: Unzueta et al. 2008, section 9 ("we define the height of the humanoid as ...").
        """
        r = self.roles
        calf = np.linalg.norm(self.offset_between(r.knee[0], r.ankle[0]))
        thigh = np.linalg.norm(self.offset_between(r.hip[0], r.knee[0]))
        pelvis = abs(self.offset_between(r.pelvis, r.hip[0])[1])
        trunk = np.linalg.norm(self.spine_chain.segments, axis=1).sum()
        return float(calf + thigh + pelvis + trunk)

    # --- motions ---------------------------------------------------------------------------------

    def targets(self, motion: Motion) -> Targets:
        """The six points of a recording on this rig, frame by frame, with the joints' world rotations."""
        if motion.skeleton is not self.skeleton and motion.skeleton.names != self.skeleton.names:
            raise FigureError("the motion is on another skeleton than this figure")
        r = self.roles
        joints = [r.pelvis, r.head, *r.wrist, *r.ankle]
        positions, world = motion.transforms
        points = positions[:, joints].copy()
        points[:, 1] += rot.mul_vec(world[:, r.head], r.head_offset)
        turned = rot.mul(world[:, joints], rot.inv(self.neutral[joints]))
        return Targets(points, motion.rate, turned, motion.name)

    @property
    def neutral_pose(self) -> Pose:
        """Standing, arms hanging, the pelvis at the origin; a pose of the rig."""
        local = rot.mul(rot.inv(self.neutral[np.maximum(self.skeleton.parents, 0)]), self.neutral)
        local[0] = self.neutral[0]
        moving, translations = self.place_pelvis(local[None], np.zeros((1, 3)))
        return Pose(self.skeleton, local, translations[0], moving)

    def compute_motion(
        self,
        rotations: Array,
        pelvis: Array,
        rate: float,
        *,
        extras: Motion | None = None,
        name: str | None = None,
    ) -> Motion:
        """Anatomical local rotations -> a motion of the rig, in plain NumPy.

        Args:
            rotations: (F, J, 4) anatomical local rotations (identity = neutral).
            pelvis: (F, 3) positions of the pelvis joint [m].
            rate: Frames per second [Hz].
            extras: A recording of the same rig and length whose joints beyond wrists, ankles and head
                (fingers, toes, face) are copied.
            name: Name of the result.
        """
        parents = np.maximum(self.skeleton.parents, 0)
        local = rot.mul(rot.inv(self.neutral[parents]), rot.mul(rotations, self.neutral))
        local[:, 0] = rot.mul(rotations[:, 0], self.neutral[0])
        return self._assemble(local, pelvis, rate, extras, name)

    def _assemble(
        self, local: Array, pelvis: Array, rate: float, extras: Motion | None, name: str | None
    ) -> Motion:
        if extras is not None:
            if extras.rotations.shape != local.shape:
                raise FigureError("extras must be a motion of the same rig and length")
            local = local.copy()
            local[:, self.extremities] = extras.rotations[:, self.extremities]
        moving, translations = self.place_pelvis(local, pelvis)
        return Motion(self.skeleton, local, translations, rate, moving=moving, name=name or self.name)

    def place_pelvis(self, local: Array, pelvis: Array) -> tuple[tuple[int, ...], Array]:
        """Which joints translate, and where to, so that the pelvis joint is at ``pelvis`` (F, 3) [m].

        Where the pelvis hangs below a root of its own, the root stands still and the pelvis translates.
        """
        joint = self.roles.pelvis
        if joint == 0:
            return (0,), np.ascontiguousarray(pelvis)[:, None]
        above = self.skeleton.path(0, joint)[:-1]
        root = np.broadcast_to(self.skeleton.offsets[0], pelvis.shape)
        position, turned = root, local[:, 0]
        for j in above[1:]:
            position = position + rot.mul_vec(turned, self.skeleton.offsets[j])
            turned = rot.mul(turned, local[:, j])
        shift = rot.mul_vec(rot.inv(turned), pelvis - position)
        return (0, joint), np.stack([root, shift], axis=1)

    @cached_property
    def extremities(self) -> list[int]:
        """Joints strictly below wrists, ankles and head: fingers, toes, face."""
        ends = (*self.roles.wrist, *self.roles.ankle, self.roles.head)
        return sorted({int(j) for end in ends for j in self.skeleton.subtree(end)[1:]})
