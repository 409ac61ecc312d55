"""A pose from elsewhere as the start of the sequence: another take, a database, somebody's model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure, SpineChain
from sixpoint.body.motion import Motion
from sixpoint.errors import SkeletonError

Array = NDArray[np.float64]


def find_start(figure: Figure, chain: SpineChain, start: Motion, frames: int) -> Array:
    """Trunk and limb roots of a motion as the rows that compiled code starts from.

    Args:
        figure: What is posed.
        chain: Its trunk.
        start: A motion of the same rig.
        frames: Number of frames it must have.

    Returns:
        (frames, S + 4, 4): rotation of the pelvis in the world and of spine joints against the joint below;
        then those of shoulders and hips in the world.

    Raises:
        SkeletonError: It is of another rig or length.
    """
    if start.skeleton.names != figure.skeleton.names:
        raise SkeletonError("the start must be a motion of the figure's rig")
    if len(start) != frames:
        raise SkeletonError(f"the start has {len(start)} frames, the targets {frames}")
    world = rot.mul(start.transforms[1], rot.inv(figure.neutral))
    joints = list(chain.joints)
    trunk = world[:, joints]
    trunk[:, 1:] = rot.mul(rot.inv(world[:, joints[:-1]]), world[:, joints[1:]])
    roots = [figure.roles.limbs[k][0] for k in range(4)]
    return np.ascontiguousarray(np.concatenate([trunk, world[:, roots]], axis=1))
