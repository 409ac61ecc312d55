"""Bring any rig's rest pose to the anatomical neutral pose: standing, arms hanging, palms to the thighs.

The result is one world rotation per joint: the rotation of the rig's own frame when the figure stands
neutrally in a world with Y up, Z forward and X to the figure's left. It is all that separates a rig from
the anatomical figure: in the neutral pose every anatomical frame is aligned with the world.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Hinges
from sixpoint.body.motion import Motion
from sixpoint.body.roles import Roles
from sixpoint.body.skeleton import Skeleton
from sixpoint.body.structure import foot_direction
from sixpoint.errors import FigureError

Array = NDArray[np.float64]

X, Y, Z = np.eye(3)
SNAP = np.radians(15.0)  # a rest axis this near to a world axis is meant to be that axis
MAX_FRAMES = 400  # frames looked at when a motion has to tell what the rest pose does not
MIN_BEND = np.radians(8.0)  # smallest bend that tells a flexion axis


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
    rest = np.tile(rot.IDENTITY, (len(skeleton), 1))
    frames = _sample(motion)
    world_axes = _standing_axes(skeleton, roles, rest)
    if world_axes is not None:
        neutral = rot.mul(rot.inv(world_axes), skeleton.compute_transforms(rest)[1])
    elif frames is not None:
        neutral = _trunk_from_motion(skeleton, roles, frames)
    else:
        raise FigureError(
            "the rest pose is not a standing one and there is no motion to learn it from: "
            "load the rig with a recording, or give it a T-pose, A-pose or arms-down rest pose"
        )
    neutral = np.array(neutral)
    neutral[skeleton.path(0, roles.pelvis)[:-1]] = rot.IDENTITY  # what is above the pelvis stands still
    for limb, chain in enumerate(roles.limbs):
        _set_limb(skeleton, roles, neutral, limb, chain, motion, frames)
    return rot.normalised(neutral)


def _sample(motion: Motion | None) -> Array | None:
    """Local rotations (F, J, 4) of at most MAX_FRAMES frames."""
    if motion is None:
        return None
    picks = np.unique(np.linspace(0, len(motion) - 1, MAX_FRAMES).astype(int))
    return motion.rotations[picks]


# --- trunk ---------------------------------------------------------------------------------------


def _standing_axes(skeleton: Skeleton, roles: Roles, rest: Array) -> Array | None:
    """Rotation world<-anatomical of a standing rest pose, or None if the rest pose does not stand."""
    positions, world = skeleton.compute_transforms(rest)
    head = positions[roles.head] + rot.mul_vec(world[roles.head], roles.head_offset)
    pelvis, hips = positions[roles.pelvis], positions[list(roles.hip)]
    legs = rot.unit(positions[list(roles.ankle)] - hips)
    trunk = rot.unit(head - pelvis)
    if legs[0] @ legs[1] < 0.3 or -trunk @ rot.unit(legs.sum(axis=0)) < 0.8:
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


def _snapped(direction: Array) -> Array:
    """The nearest of the six world axes if it is within SNAP, else the direction itself."""
    k = int(np.argmax(np.abs(direction)))
    axis = np.eye(3)[k] * np.sign(direction[k])
    return axis if direction @ axis > np.cos(SNAP) else direction


def _trunk_from_motion(skeleton: Skeleton, roles: Roles, frames: Array) -> Array:
    """Neutral rotations where the rest pose says nothing: mean twist of the recording, trunk straight.

    Each trunk joint keeps the mean orientation it has to the pelvis, then turns so that its bone points
    up; limbs are set afterwards, and what is beyond them keeps its rest rotation.
    """
    trunk = [roles.pelvis, *roles.spine]
    local = np.tile(rot.IDENTITY, (len(skeleton), 1))
    chained = {j for c in (*trunk, *roles.clavicle) for j in skeleton.path(0, c)}
    chained -= set(skeleton.path(0, roles.pelvis))
    for joint in chained:
        local[joint] = rot.mean(frames[:, joint])
    positions, world = skeleton.compute_transforms(local)
    hips = positions[list(roles.hip)]
    left = rot.unit(hips[0] - hips[1])
    bone = _trunk_bone(skeleton, roles, positions, world, 0)
    up = rot.unit(bone - (bone @ left) * left)
    if not (left.any() and up.any()):
        raise FigureError("hips or spine have no extent: the pelvis' axes cannot be found")
    neutral = rot.mul(rot.inv(rot.from_axes(left, up, np.cross(left, up))), world)
    for k, joint in enumerate(trunk):
        bone = rot.mul_vec(neutral[joint], rot.mul_vec(rot.inv(world[joint]), _trunk_bone(skeleton, roles, positions, world, k)))
        if bone.any() and k:
            fix = rot.between(rot.unit(bone), Y)
            below = [j for j in range(len(skeleton)) if skeleton.path(joint, j)]
            neutral[below] = rot.mul(fix, neutral[below])
    return neutral


def _trunk_bone(skeleton: Skeleton, roles: Roles, positions: Array, world: Array, k: int) -> Array:
    """World vector from trunk joint k to the next trunk point that is not at the same place."""
    trunk = [roles.pelvis, *roles.spine]
    points = [positions[j] for j in trunk] + [
        positions[roles.head] + rot.mul_vec(world[roles.head], roles.head_offset)
    ]
    for point in points[k + 1 :]:
        if np.linalg.norm(point - points[k]) > 1e-3:
            return np.asarray(point - points[k])
    return np.zeros(3)


# --- limbs ---------------------------------------------------------------------------------------


def _set_limb(
    skeleton: Skeleton,
    roles: Roles,
    neutral: Array,
    limb: int,
    chain: tuple[int, int, int],
    motion: Motion | None,
    frames: Array | None,
) -> None:
    """Hang one limb straight down with its flexion axis along X; joints beyond it follow."""
    root, middle, end = chain
    flexes_back = limb >= 2  # knees fold backward, elbows forward
    upper, lower = _bone(skeleton, root, middle), _bone(skeleton, middle, end)
    for bone, a, b in ((upper, root, middle), (lower, middle, end)):
        if np.linalg.norm(bone) < 1e-6:
            names = skeleton.names
            raise FigureError(f"no distance between {names[a]!r} and {names[b]!r}: the limb has no length")
    # Anatomical guess: hang the rest limb down along the shortest way, and take X there.
    hang = rot.between(rot.unit(rot.mul_vec(neutral[root], upper)), -Y)
    guess = rot.mul_vec(rot.inv(neutral[root]), rot.mul_vec(rot.inv(hang), X))
    axis_upper, axis_lower = _flexion_axes(skeleton, chain, guess, flexes_back, motion, frames)
    below = [j for j in range(len(skeleton)) if skeleton.path(root, j)]
    _turn(neutral, below, root, axis_upper, upper)
    below = [j for j in below if skeleton.path(middle, j)]
    _turn(neutral, below, middle, axis_lower, lower)
    if flexes_back:
        _level_foot(skeleton, neutral, end)


def _bone(skeleton: Skeleton, joint: int, below: int) -> Array:
    """Vector from ``joint`` to ``below`` in the frame of ``joint``, joints between at rest [m]."""
    return np.asarray(skeleton.offsets[skeleton.path(joint, below)[1:]].sum(axis=0))


def _turn(neutral: Array, below: list[int], joint: int, axis: Array, bone: Array) -> None:
    """Set ``joint`` so that ``bone`` points down and ``axis`` left; what is below turns along."""
    y = -rot.unit(bone)
    x = rot.unit(axis - (axis @ y) * y)
    target = rot.inv(rot.from_axes(x, y, np.cross(x, y)))
    change = rot.mul(target, rot.inv(neutral[joint]))
    neutral[below] = rot.mul(change, neutral[below])


def _level_foot(skeleton: Skeleton, neutral: Array, ankle: int) -> None:
    """Point a foot forward where the rest pose does not: rigs whose rest has the foot along the shank."""
    bone = foot_direction(skeleton, ankle)
    if bone is None:
        return
    foot = rot.mul_vec(neutral[ankle], bone)
    if foot @ Z > 0.5:
        return
    level = rot.unit(Z - 0.4 * Y)  # about the slope from ankle to toes
    below = [j for j in range(len(skeleton)) if skeleton.path(ankle, j)]
    neutral[below] = rot.mul(rot.between(foot, level), neutral[below])


def _flexion_axes(
    skeleton: Skeleton,
    chain: tuple[int, int, int],
    guess: Array,
    flexes_back: bool,
    motion: Motion | None,
    frames: Array | None,
) -> tuple[Array, Array]:
    """Anatomical X axis (3,) in the frames of the limb's upper and lower joint.

    From the file's degrees of freedom, else from the motion, else from the bend of the rest pose, else
    from anatomy (``guess``).
    """
    root, middle, end = chain
    upper, lower = rot.unit(_bone(skeleton, root, middle)), rot.unit(_bone(skeleton, middle, end))
    between = skeleton.path(root, middle)[1:]
    forearms = None if frames is None else rot.mul_vec(_chained(frames, between), lower)
    axis = None if forearms is None else _axis_of_bends(upper, forearms, flexes_back)
    dof = motion.dofs[middle] if motion is not None else None
    if isinstance(dof, Hinges) and dof.size == 1 and abs(float(dof.axes[0] @ lower)) < 0.5:
        hinge = dof.axes[0]
        reference = guess if axis is None else axis
        hinge = hinge if hinge @ reference >= 0 else -hinge
        return hinge, hinge
    if axis is not None and frames is not None:
        in_lower = rot.mul_vec(rot.inv(_chained(frames, between)), axis).mean(axis=0)
        in_lower = in_lower - (in_lower @ lower) * lower
        if np.linalg.norm(in_lower) > 0.3:
            return axis, rot.unit(in_lower)
    axis = _axis_of_bends(upper, lower[None], flexes_back)
    if axis is None or axis @ guess < 0.5:
        axis = guess
    return axis, axis


def _chained(frames: Array, joints: list[int]) -> Array:
    """Product of the local rotations of consecutive joints, (F, 4)."""
    out = frames[:, joints[0]]
    for joint in joints[1:]:
        out = rot.mul(out, frames[:, joint])
    return out


def _axis_of_bends(upper: Array, lower: Array, flexes_back: bool) -> Array | None:
    """Anatomical X axis in the upper joint's frame from lower-limb directions (F, 3) seen there.

    A limb bends one way: the parts of ``lower`` across ``upper`` lie along one direction, which is
    forward for elbows and backward for knees.
    """
    across = lower - (lower @ upper)[:, None] * upper
    if np.sqrt(np.mean(np.sum(across**2, axis=1))) < np.sin(MIN_BEND):
        return None
    values, vectors = np.linalg.eigh(across.T @ across)
    if values[-1] < 4.0 * values[-2]:  # bends in all directions: not a hinge
        return None
    toward = vectors[:, -1] * np.sign(across.sum(axis=0) @ vectors[:, -1])
    forward = -toward if flexes_back else toward
    return rot.unit(np.cross(-upper, forward))
