"""Bring any rig's rest pose to the anatomical neutral pose: standing, arms hanging, palms to the thighs.

The result is one world rotation per joint: the rotation of the rig's own frame when the figure stands
neutrally in a world with Y up, Z forward and X to the figure's left. It is all that separates a rig from
the anatomical figure: in the neutral pose every anatomical frame is aligned with the world.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.flexion import bone_between, find_flexion_axes
from sixpoint.body.motion import Motion
from sixpoint.body.roles import Roles
from sixpoint.body.skeleton import Index, Skeleton
from sixpoint.body.structure import foot_direction
from sixpoint.errors import FigureError

Array = NDArray[np.float64]

X, Y, Z = np.eye(3)
SNAP = np.radians(15.0)  # a rest axis this near to a world axis is meant to be that axis
GUIDE = np.radians(40.0)  # the first trunk bone tells the pelvis' up only if it is this near to the posture's
MAX_FRAMES = 400  # frames looked at when a motion has to tell what the rest pose does not
STRAIGHT = 0.85  # end to end over the length along the bones: what is more bent does not stand
SIDEWAYS = 0.5  # a clavicle that reaches less far to its side [of its length] is no posture: real have 0.8
AHEAD = 0.35  # a foot that reaches less far forward [of its length] is along the shank; steep ones have 0.44


def compute_neutral(skeleton: Skeleton, roles: Roles, motion: Motion | None = None) -> Array:
    """World rotations (J, 4) of the rig's frames in the anatomical neutral pose.

    Args:
        skeleton: The rig.
        roles: Its anatomy.
        motion: A recording on the rig; tells flexion axes (its degrees of freedom, then its movement)
            and the trunk's axes where the rest pose is not a standing one.

    Raises:
        FigureError: A limb has no length, or neither rest pose nor motion tell which way is up.
    """
    local = np.tile(rot.IDENTITY, (len(skeleton), 1))
    frames = _sample(motion)
    world_axes = _standing_axes(skeleton, roles, local)
    below_pelvis = skeleton.subtree(roles.pelvis)
    if world_axes is not None:
        neutral = rot.mul(rot.inv(world_axes), skeleton.compute_transforms(local)[1])
    elif frames is not None:
        # The rest pose is no posture: hands, feet and the trunk take their mean of the recording instead.
        local[below_pelvis[1:]] = rot.mean(frames[:, below_pelvis[1:]])
        neutral = _trunk_from_motion(skeleton, roles, local)
    else:
        raise FigureError(
            "the rest pose is not a standing one and there is no motion to learn it from: "
            "load the rig with a recording, or give it a T-pose, A-pose or arms-down rest pose"
        )
    neutral = np.array(neutral)
    neutral[np.setdiff1d(np.arange(len(skeleton)), below_pelvis)] = rot.IDENTITY  # what is above stands still
    for clavicle, shoulder, side in zip(roles.clavicle, roles.shoulder, (X, -X), strict=False):
        _spread_clavicle(skeleton, neutral, clavicle, shoulder, side)
    standing = neutral.copy()
    for limb, chain in enumerate(roles.limbs):
        _set_limb(skeleton, neutral, chain, limb >= 2, motion, frames)
    for ankle in roles.ankle:
        if world_axes is not None:
            _keep_pitch(skeleton, neutral, ankle, standing[ankle])
        _level_foot(skeleton, neutral, ankle, local)
    return rot.normalised(neutral)


def _sample(motion: Motion | None) -> Array | None:
    """Local rotations (F, J, 4) of at most MAX_FRAMES frames."""
    if motion is None:
        return None
    picks = np.unique(np.linspace(0, len(motion) - 1, MAX_FRAMES).astype(int))
    return np.asarray(motion.rotations[picks])


# --- trunk ---------------------------------------------------------------------------------------


def _standing_axes(skeleton: Skeleton, roles: Roles, rest: Array) -> Array | None:
    """Rotation (4,) world<-anatomical of a standing rest pose, or None if the rest pose does not stand."""
    positions, world = skeleton.compute_transforms(rest)
    head = positions[roles.head] + rot.mul_vec(world[roles.head], roles.head_offset)
    pelvis, hips = positions[roles.pelvis], positions[list(roles.hip)]
    legs = rot.unit(positions[list(roles.ankle)] - hips)
    trunk = rot.unit(head - pelvis)
    if legs[0] @ legs[1] < 0.3 or -trunk @ rot.unit(legs.sum(axis=0)) < 0.8:
        return None
    chains = [*roles.limbs[2:], (roles.pelvis, *roles.spine)]
    if any(_straightness(positions[list(chain)]) < STRAIGHT for chain in chains):
        return None
    up = _snapped(rot.unit(trunk - rot.unit(legs.sum(axis=0))))
    across = hips[0] - hips[1]
    if np.linalg.norm(across) < 1e-6:
        across = np.subtract(*positions[list(roles.shoulder)])
    across = across - (across @ up) * up
    if np.linalg.norm(across) < 1e-6:
        return None
    left = _snapped(rot.unit(across))
    left = rot.unit(left - (left @ up) * up)
    return rot.from_axes(left, up, np.cross(left, up))


def _straightness(points: Array) -> float:
    """Distance between the ends of a chain of points (n, 3) over its length."""
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    return float(np.linalg.norm(points[-1] - points[0]) / length) if length > 0 else 1.0


def _snapped(direction: Array) -> Array:
    """The nearest of the six world axes if it is within SNAP, else the direction itself."""
    k = int(np.argmax(np.abs(direction)))
    axis = np.eye(3)[k] * np.sign(direction[k])
    return np.asarray(axis if direction @ axis > np.cos(SNAP) else direction)


def _trunk_from_motion(skeleton: Skeleton, roles: Roles, local: Array) -> Array:
    """Neutral rotations (J, 4) where the rest pose says nothing: trunk straightened from a mean posture.

    Each trunk joint keeps its mean twist to the one below, then turns so that its bone points up; limbs are
    set afterwards.
    """
    trunk = [roles.pelvis, *roles.spine]
    positions, world = skeleton.compute_transforms(local)
    hips = positions[list(roles.hip)]
    left = rot.unit(hips[0] - hips[1])
    head = positions[roles.head] + rot.mul_vec(world[roles.head], roles.head_offset)
    legs = rot.unit(positions[list(roles.ankle)] - hips).sum(axis=0)
    posture = rot.unit(rot.unit(head - positions[roles.pelvis]) - rot.unit(legs))
    bone = rot.unit(_trunk_bone(roles, positions, world, 0))
    if bone @ posture < np.cos(GUIDE):  # a helper bone that does not point up the trunk
        bone = posture
    up = rot.unit(bone - (bone @ left) * left)
    if not (left.any() and up.any()):
        raise FigureError("hips or spine have no extent: the pelvis' axes cannot be found")
    neutral = rot.mul(rot.inv(rot.from_axes(left, up, np.cross(left, up))), world)
    for k, joint in enumerate(trunk):
        bone = rot.mul_vec(rot.inv(world[joint]), _trunk_bone(roles, positions, world, k))
        if bone.any() and k:
            below = skeleton.subtree(joint)
            fix = rot.between(rot.unit(rot.mul_vec(neutral[joint], bone)), Y)
            neutral[below] = rot.mul(fix, neutral[below])
    return neutral


def _trunk_bone(roles: Roles, positions: Array, world: Array, k: int) -> Array:
    """World vector from trunk joint k to the next trunk point that is not at the same place."""
    trunk = [roles.pelvis, *roles.spine]
    points = [positions[j] for j in trunk] + [
        positions[roles.head] + rot.mul_vec(world[roles.head], roles.head_offset)
    ]
    for point in points[k + 1 :]:
        if np.linalg.norm(point - points[k]) > 1e-3:
            return np.asarray(point - points[k])
    return np.zeros(3)


def _spread_clavicle(skeleton: Skeleton, neutral: Array, clavicle: int, shoulder: int, side: Array) -> None:
    """Point a clavicle to its side where the rest pose does not: rigs whose bones all rest in one line."""
    bone = rot.unit(rot.mul_vec(neutral[clavicle], bone_between(skeleton, clavicle, shoulder)))
    if bone.any() and bone @ side < SIDEWAYS:
        below = skeleton.subtree(clavicle)
        neutral[below] = rot.mul(rot.between(bone, side), neutral[below])


# --- limbs ---------------------------------------------------------------------------------------


def _set_limb(
    skeleton: Skeleton,
    neutral: Array,
    chain: tuple[int, int, int],
    flexes_back: bool,
    motion: Motion | None,
    frames: Array | None,
) -> None:
    """Hang one limb straight down with its flexion axis along X; joints beyond it follow.

    Knees fold backward (``flexes_back``), elbows forward.
    """
    root, middle, end = chain
    upper, lower = bone_between(skeleton, root, middle), bone_between(skeleton, middle, end)
    for bone, a, b in ((upper, root, middle), (lower, middle, end)):
        if np.linalg.norm(bone) < 1e-6:
            names = skeleton.names
            raise FigureError(f"no distance between {names[a]!r} and {names[b]!r}: the limb has no length")
    # Anatomical guess: hang the rest limb down along the shortest way, and take X there.
    along = rot.unit(rot.mul_vec(neutral[root], upper))
    hang = rot.from_axis_angle(X, np.pi) if along @ Y > 0.99 else rot.between(along, -Y)
    guess = rot.mul_vec(rot.inv(neutral[root]), rot.mul_vec(rot.inv(hang), X))
    axis_upper, axis_lower = find_flexion_axes(skeleton, chain, guess, flexes_back, motion, frames)
    for joint, axis, bone in ((root, axis_upper, upper), (middle, axis_lower, lower)):
        if not np.linalg.norm(np.cross(axis, rot.unit(bone))) > 1e-6:
            name = skeleton.names[joint]
            raise FigureError(
                f"the rest pose does not tell about which axis {name!r} bends: it lies along the bone"
            )
        _turn(neutral, skeleton.subtree(joint), joint, axis, bone)


def _turn(neutral: Array, below: Index, joint: int, axis: Array, bone: Array) -> None:
    """Set ``joint`` so that ``bone`` points down and ``axis`` left; what is below turns along."""
    y = -rot.unit(bone)
    x = rot.unit(axis - (axis @ y) * y)
    target = rot.inv(rot.from_axes(x, y, np.cross(x, y)))
    change = rot.mul(target, rot.inv(neutral[joint]))
    neutral[below] = rot.mul(change, neutral[below])


def _keep_pitch(skeleton: Skeleton, neutral: Array, ankle: int, standing: Array) -> None:
    """Keep the slope of a foot where knees are bent in the rest pose: it stands there on a flat sole."""
    change = rot.mul(neutral[ankle], rot.inv(standing))
    pitch = change * [1.0, 0.0, 0.0, 1.0]
    if np.linalg.norm(pitch) > 1e-6:
        below = skeleton.subtree(ankle)
        level = rot.mul(change, rot.inv(rot.normalised(pitch)))
        neutral[below] = rot.mul(rot.mul(level, rot.inv(change)), neutral[below])


def _level_foot(skeleton: Skeleton, neutral: Array, ankle: int, local: Array) -> None:
    """Point a foot forward where the rest pose does not: rigs whose rest has the foot along the shank."""
    bone = foot_direction(skeleton, ankle, local)
    if bone is None:
        return
    foot = rot.mul_vec(neutral[ankle], bone)
    if foot @ Z > AHEAD:
        return
    level = rot.unit(Z - 0.4 * Y)  # about the slope from ankle to toes
    below = skeleton.subtree(ankle)
    neutral[below] = rot.mul(rot.between(foot, level), neutral[below])
