"""A body as the engine sees it: a tree with degrees of freedom, and the way to and from the user's rig.

A plain skeleton is used as it is. Of a figure the anatomical tree is posed (``body.figure``).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Ball, Dofs, Hinges
from sixpoint.body.figure import Figure
from sixpoint.body.masses import rod_masses, segment_masses
from sixpoint.body.motion import Pose
from sixpoint.body.skeleton import Skeleton
from sixpoint.errors import SixpointError, listed

Array = NDArray[np.float64]
Place = tuple[int, Array]


@dataclass(frozen=True, eq=False)
class Articulation:
    """What is posed.

    Attributes:
        rig: The skeleton of the poses that go in and out.
        tree: The skeleton that is posed: offsets of the anatomical figure, or the rig itself.
        dofs: What may move.
        neutral: (J, 4) world rotation of each rig frame in the neutral pose; identity without anatomy.
        base: Joint whose position is free, or fixed in the world.
        figure: The figure, if it is one.
    """

    rig: Skeleton
    tree: Skeleton
    dofs: Dofs
    neutral: Array
    base: int
    figure: Figure | None

    @classmethod
    def of(cls, body: Figure | Skeleton, dofs: Dofs | None) -> Articulation:
        """A figure, with its own degrees of freedom or others, or a skeleton with the given ones.

        Raises:
            SixpointError: A skeleton came without degrees of freedom, or they name joints it does not have.
        """
        if isinstance(body, Figure):
            tree = replace(body.skeleton, offsets=body.offsets)
            out = cls(body.skeleton, tree, dofs or body.dofs, body.neutral, body.roles.pelvis, body)
        elif dofs is None:
            raise SixpointError(
                "a skeleton needs dofs=Dofs({joint: Hinges(...) or Ball(...)}); a figure has its own"
            )
        else:
            identity = np.tile(rot.IDENTITY, (len(body), 1))
            out = cls(body, body, dofs, identity, 0, None)
        wrong = [j for j in out.dofs.joints if not 0 <= j < len(out.tree)]
        if wrong:
            raise SixpointError(f"dofs of joints {wrong}, but there are {len(out.tree)} joints")
        above = [out.tree.names[j] for j in out.tree.path(0, out.base)[:-1] if out.dofs[j].size]
        if above:
            raise SixpointError(f"joints above the pelvis must be fixed: {listed(above)}")
        return out

    @cached_property
    def before(self) -> Array:
        """(J, 4) inverse of the neutral rotation of each rig joint's parent."""
        before = rot.inv(self.neutral[np.maximum(self.tree.parents, 0)])
        before[0] = rot.IDENTITY
        return before

    @cached_property
    def rest_positions(self) -> Array:
        """(J, 3) joint positions in the neutral pose [m]."""
        return self.tree.compute_transforms(np.tile(rot.IDENTITY, (len(self.tree), 1)))[0]

    @cached_property
    def masses(self) -> Array:
        """(J, 4) share of the body's mass and centre of mass in the joint's frame [m]."""
        return rod_masses(self.tree) if self.figure is None else segment_masses(self.figure)

    def place(self, name: str) -> Place:
        """Joint and offset of a role, a joint or a site; the error lists what there is."""
        if self.figure is not None:
            roles = self.figure.roles.named()
            if name == "head":
                return roles["head"], self.figure.head_offset
            if name in roles:
                return roles[name], np.zeros(3)
        if name in self.tree.names:
            return self.tree.index(name), np.zeros(3)
        if name in self.tree.site_names:
            site = self.tree.site_names.index(name)
            joint = int(self.tree.site_parents[site])
            return joint, rot.mul_vec(self.neutral[joint], self.tree.site_offsets[site])
        sites = f"; sites: {listed(self.tree.site_names)}" if self.tree.site_names else ""
        raise SixpointError(f"no joint named {name!r}; joints: {listed(self.tree.names)}{sites}")

    def point(self, name: str, offset: object = (0.0, 0.0, 0.0)) -> Place:
        """A place shifted by an offset (3,) in its joint's frame [m].

        Raises:
            SixpointError: There is no such place, or the offset is not three finite numbers.
        """
        joint, base = self.place(name)
        shift = np.asarray(offset, float)
        if shift.shape != (3,) or not np.all(np.isfinite(shift)):
            raise SixpointError(f"an offset is three finite numbers [m], got {offset} at {name!r}")
        return joint, base + shift

    def points(self, places: Iterable[str | tuple[str, object]]) -> list[Place]:
        """Places, or (place, offset) pairs."""
        return [self.point(p) if isinstance(p, str) else self.point(*p) for p in places]

    # --- states ----------------------------------------------------------------------------------

    def rest_state(self) -> Array:
        """State (2 J + 1, 4) of the neutral pose, its base where it rests."""
        joints = len(self.tree)
        state = np.zeros((2 * joints + 1, 4))
        state[:joints] = rot.IDENTITY
        state[joints, :3] = self.rest_positions[self.base]
        for joint, dof in self.dofs.joints.items():
            if isinstance(dof, Hinges):
                state[joints + 1 + joint, : dof.size] = np.clip(0.0, dof.lower, dof.upper)
        return state

    def moving_rows(self) -> NDArray[np.bool_]:
        """(2 J + 1, 4) which numbers of a state belong to something that moves."""
        joints = len(self.tree)
        moving = np.zeros((2 * joints + 1, 4), bool)
        moving[joints] = True
        for joint, dof in self.dofs.joints.items():
            moving[joint] = dof.size > 0
            if isinstance(dof, Hinges):
                moving[joints + 1 + joint, : dof.size] = True
        return moving

    def states_of(self, rotations: Array, positions: Array) -> Array:
        """States (F, 2 J + 1, 4) of rig rotations (F, J, 4) and base positions (F, 3) [m]."""
        frames, joints = len(rotations), len(self.tree)
        local = rot.mul(rot.mul(self._unwinding[0], rotations), self._unwinding[1])
        states = np.zeros((frames, 2 * joints + 1, 4))
        states[:, :joints] = rot.IDENTITY
        states[:, joints, :3] = positions
        for joint, dof in self.dofs.joints.items():
            if isinstance(dof, Ball):
                states[:, joint] = local[:, joint]
            elif isinstance(dof, Hinges):
                states[:, joints + 1 + joint, : dof.size] = dof.compute_angles(local[:, joint])
        return states

    def rotations_of(self, states: Array) -> Array:
        """Rig rotations (F, J, 4) of states (F, 2 J + 1, 4); the inverse of ``states_of``."""
        joints = len(self.tree)
        local = states[:, :joints].copy()
        for joint, dof in self.dofs.joints.items():
            if isinstance(dof, Hinges):
                local[:, joint] = rot.IDENTITY
                for axis, angle in zip(dof.axes, states[:, joints + 1 + joint, : dof.size].T, strict=True):
                    local[:, joint] = rot.mul(local[:, joint], rot.from_axis_angle(axis, angle))
        return np.asarray(rot.mul(rot.mul(self.before, local), self.neutral))

    @cached_property
    def _unwinding(self) -> tuple[Array, Array]:
        """What takes a rig's local rotation back to the tree's: inverses of ``before`` and ``neutral``."""
        return rot.inv(self.before), rot.inv(self.neutral)

    def state_of(self, pose: Pose) -> Array:
        """State of a pose of the rig."""
        if pose.skeleton is not self.rig and pose.skeleton.names != self.rig.names:
            raise SixpointError("the pose is of another skeleton")
        position = pose.translations[0] if self.base == 0 else pose.compute_transforms()[0][self.base]
        return np.asarray(self.states_of(pose.rotations[None], position[None])[0])

    def place_base(self, rotations: Array, positions: Array) -> tuple[tuple[int, ...], Array]:
        """Which joints translate and where to (F, K, 3) [m], for rig rotations and base positions (F, 3)."""
        if self.figure is None:
            return (0,), positions[:, None]
        return self.figure.place_pelvis(rotations, positions)
