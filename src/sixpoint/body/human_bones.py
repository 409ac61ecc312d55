"""A figure as Unity's human bones: which joint turns which bone, and how the T-pose differs from neutral.

VMC says a bone's rotation in its parent bone, with the identity for the T-pose of a *normalised* avatar
(VRM 0): there all bones' frames are aligned with the model. Sixpoint's neutral pose is the same but for the
arms, which hang: the T-pose lifts them by a quarter turn about Z, palms down. With A the world rotation of an
anatomical frame and D = inv(that quarter turn) for the bones of the arm, else the identity,

    bone's world rotation = A D        local = inv(A_parent D_parent) A D

Avatars have fewer vertebrae than figures: the joints from the pelvis to where the arms hang are shared out
evenly among Spine and Chest (and UpperChest); each bone takes the world rotation of its last joint. So hips,
chest, head, arms and legs point exactly where the figure's do. What a bent spine of more joints shifts them
by can mostly be taken back (``BonePoser.follow_chords``).

Reference: VRM specification, "T-pose"; UnityEngine.HumanBodyBones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion, Pose

Array = NDArray[np.float64]

_FINGERS = ("Thumb", "Index", "Middle", "Ring", "Little")
HUMAN_BONES = (
    *("Hips", "LeftUpperLeg", "RightUpperLeg", "LeftLowerLeg", "RightLowerLeg", "LeftFoot", "RightFoot"),
    *("Spine", "Chest", "Neck", "Head", "LeftShoulder", "RightShoulder", "LeftUpperArm", "RightUpperArm"),
    *("LeftLowerArm", "RightLowerArm", "LeftHand", "RightHand", "LeftToes", "RightToes"),
    *("LeftEye", "RightEye", "Jaw"),
    *(
        f"{side}{finger}{part}"
        for side in ("Left", "Right")
        for finger in _FINGERS
        for part in ("Proximal", "Intermediate", "Distal")
    ),
    "UpperChest",
)
"""The 55 names of Unity's HumanBodyBones, in its order."""

_NEXT = {"Spine": "Chest", "Chest": "UpperChest", "Neck": "Head"}
"""What a bone may have to point to."""
TINY = 1e-6  # m, a chord without direction

_SIDES = ("Left", "Right")
_QUARTER = (  # D of the left and of the right arm
    rot.from_axis_angle([0.0, 0.0, 1.0], -math.pi / 2),
    rot.from_axis_angle([0.0, 0.0, 1.0], math.pi / 2),
)


@dataclass(frozen=True)
class Bone:
    """One bone of the avatar.

    Attributes:
        parent: Name of the parent bone; empty for the hips.
        origin: The joint where it starts.
        joint: The joint that it turns with.
        arm: 0 or 1 for bones of the left or right arm, from the upper arm on; None for the others.
    """

    parent: str
    origin: int
    joint: int
    arm: int | None = None

    @property
    def rest(self) -> Array:
        """(4,) D: the neutral pose seen from the T-pose."""
        return rot.IDENTITY if self.arm is None else _QUARTER[self.arm]


def find_bones(figure: Figure, upper_chest: bool = False, chords: bool = False) -> dict[str, Bone]:
    """Unity's name -> bone, for all bones that a figure has, parents first.

    Args:
        figure: The figure.
        upper_chest: Share the trunk out among three bones instead of two. An avatar that lacks UpperChest
            loses what it turns, so only for avatars that are known to have it.
        chords: The last trunk bone is the last trunk joint alone, for ``BonePoser.follow_chords``.
    """
    roles, skeleton = figure.roles, figure.skeleton
    bones = {"Hips": Bone("", roles.pelvis, roles.pelvis)}
    carriers = set(skeleton.path(roles.pelvis, roles.shoulder[0]))
    carriers &= set(skeleton.path(roles.pelvis, roles.shoulder[1]))
    trunk = [j for j in roles.spine if j in carriers]
    names = ("Spine", "Chest", "UpperChest")[: min(len(trunk), 3 if upper_chest else 2)]
    alone = int(chords and len(trunk) > len(names) > 1)
    shared, among = len(trunk) - alone, max(len(names) - alone, 1)
    cuts = [math.ceil(k * shared / among) for k in range(among + 1)] + [len(trunk)] * alone
    last = "Hips"
    for k, name in enumerate(names):
        bones[name] = Bone(last, trunk[cuts[k]], trunk[cuts[k + 1] - 1])
        last = name
    chest = last
    above = [j for j in roles.spine if j not in carriers]
    if len(above) > 1:  # the head is the last of them
        bones["Neck"] = Bone(chest, above[0], above[(len(above) - 1) // 2])
        last = "Neck"
    for head in above[-1:]:
        bones["Head"] = Bone(last, head, head)
    for k, side in enumerate(_SIDES):
        root = chest
        for clavicle in roles.clavicle[k : k + 1]:
            if skeleton.path(bones[chest].joint, clavicle):
                root = f"{side}Shoulder"
                bones[root] = Bone(chest, clavicle, clavicle)
        for part, joint in zip(("UpperArm", "LowerArm", "Hand"), roles.limbs[k], strict=True):
            bones[side + part] = Bone(root, joint, joint, k)
            root = side + part
        root = "Hips"
        for part, joint in zip(("UpperLeg", "LowerLeg", "Foot"), roles.limbs[2 + k], strict=True):
            bones[side + part] = Bone(root, joint, joint)
            root = side + part
        toes = [j for j, bone in skeleton.longest_chain(roles.ankle[k])[1:] if bone.any()]
        if toes:
            bones[f"{side}Toes"] = Bone(root, toes[-1], toes[-1])
    return bones


class BonePoser:
    """Turns poses of a figure, or whole motions, into local bone rotations, a few NumPy calls a frame.

    Attributes:
        bones: Unity's name -> bone.
        offsets: (B, 3) each bone's place in its parent bone in the T-pose [m], sixpoint's axes; hips: 0.
    """

    def __init__(self, figure: Figure, upper_chest: bool = False, chords: bool = False) -> None:
        self.figure = figure
        self.bones = find_bones(figure, upper_chest, chords)
        joints = len(figure.skeleton)
        paths, before, after = [], [], []
        offsets = np.zeros((len(self.bones), 3))
        for k, bone in enumerate(self.bones.values()):
            parent = self.bones[bone.parent] if bone.parent else None
            path = figure.skeleton.path(0 if parent is None else parent.joint, bone.joint)
            path = path if parent is None else path[1:]
            above = int(figure.skeleton.parents[path[0]])
            frame = rot.IDENTITY if above < 0 else figure.neutral[above]
            # Anatomical locals are inv(N of the parent) .. N: along a path all but the outermost cancel.
            before.append(frame if parent is None else rot.mul(rot.inv(parent.rest), frame))
            after.append(rot.mul(rot.inv(figure.neutral[bone.joint]), bone.rest))
            paths.append(path)
            if parent is not None:
                between = figure.offset_between(parent.origin, bone.origin)
                offsets[k] = rot.mul_vec(rot.inv(parent.rest), between)
        self.offsets = offsets
        self._before, self._after = np.array(before), np.array(after)
        longest = max(map(len, paths))
        self._paths = np.array([[*path, *[joints] * (longest - len(path))] for path in paths])

    def compute_rotations(self, pose: Pose | Motion) -> Array:
        """(B, 4) local rotations from the T-pose, in sixpoint's axes; the hips' is in the world.

        Of a motion (F, B, 4).
        """
        outside = np.broadcast_to(rot.IDENTITY, (*pose.rotations.shape[:-2], 1, 4))
        local = np.concatenate([pose.rotations, outside], axis=-2)
        turned = self._before
        for joints in self._paths.T:
            turned = rot.mul(turned, local[..., joints, :])
        return rot.mul(turned, self._after)

    def follow_chords(self, motion: Motion) -> Array:
        """(F, B, 4) rotations as above, but bones of several joints point to where the next bone begins.

        Then shoulders and head are where the figure's are but for what a bent spine is shorter than a
        straight one; such a bone turns as its chord, no longer as the last of its joints.
        """
        names, local = list(self.bones), self.compute_rotations(motion)
        turned: dict[str, Array] = {"": np.broadcast_to(rot.IDENTITY, (len(motion), 4))}
        bent = dict(turned)
        out = np.empty_like(local)
        for k, (name, bone) in enumerate(self.bones.items()):
            turned[name] = bent[name] = rot.mul(turned[bone.parent], local[:, k])
            following = _NEXT.get(name, "")
            if following in self.bones and bone.origin != bone.joint:
                straight = rot.mul_vec(turned[name], rot.unit(self.offsets[names.index(following)]))
                chord = motion.positions[:, self.bones[following].origin] - motion.positions[:, bone.origin]
                if straight.any() and np.linalg.norm(chord, axis=1).min() > TINY:
                    bent[name] = rot.mul(rot.between(straight, rot.unit(chord)), turned[name])
            out[:, k] = rot.mul(rot.inv(bent[bone.parent]), bent[name])
        return out

    def compute_hips(self, pose: Pose | Motion) -> Array:
        """(3,) world position of the pelvis joint [m]; of a motion (F, 3)."""
        moved = {joint: pose.translations[..., k, :] for k, joint in enumerate(pose.moving)}
        position, turned = moved[0], pose.rotations[..., 0, :]
        for joint in self.figure.skeleton.path(0, self.figure.roles.pelvis)[1:]:
            local = moved.get(joint, self.figure.skeleton.offsets[joint])
            position = position + rot.mul_vec(turned, local)
            turned = rot.mul(turned, pose.rotations[..., joint, :])
        return np.asarray(position, float)
