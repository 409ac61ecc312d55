"""Rigs for the tests of body/: real files, the built-in figure under other names, frames and rest poses."""
# ruff: noqa: E501

from __future__ import annotations

import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

import sixpoint as sp
from conftest import data_folder
from sixpoint.body import rotations as rot

ROLES = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")

# pelvis, spine, neck, head, then clavicle and the six of ROLES; {l}/{L}/{Left} is the side
FAMILIES = {
    "cmu-asf": "root lowerback lowerneck head {l}clavicle {l}femur {l}tibia {l}foot {l}humerus {l}radius {l}hand",
    "cmu-bvh": "Hips Spine Neck Head {Left}Shoulder {Left}UpLeg {Left}Leg {Left}Foot {Left}Arm {Left}ForeArm {Left}Hand",
    "max": "Hips Chest Neck Head {Left}Collar {Left}Hip {Left}Knee {Left}Ankle {Left}Shoulder {Left}Elbow {Left}Wrist",
    "bandai": "Hips Spine Neck Head Shoulder_{L} UpperLeg_{L} LowerLeg_{L} Foot_{L} UpperArm_{L} LowerArm_{L} Hand_{L}",
    "xsens": "root chest lowerneck upperneck_head {l}clavicle {l}hip {l}knee {l}ankle {l}shoulder {l}elbow {l}wrist",
    "unity": "hips spine neck head {left}Shoulder {left}UpperLeg {left}LowerLeg {left}Foot {left}UpperArm "
    "{left}LowerArm {left}Hand",
    "vroid": "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Neck J_Bip_C_Head J_Bip_{L}_Shoulder J_Bip_{L}_UpperLeg "
    "J_Bip_{L}_LowerLeg J_Bip_{L}_Foot J_Bip_{L}_UpperArm J_Bip_{L}_LowerArm J_Bip_{L}_Hand",
    "smpl": "Pelvis Spine1 Neck Head {L}_Collar {L}_Hip {L}_Knee {L}_Ankle {L}_Shoulder {L}_Elbow {L}_Wrist",
    "h-anim": "humanoid_root vl5 vc4 skullbase {l}_sternoclavicular {l}_hip {l}_knee {l}_talocrural {l}_shoulder "
    "{l}_elbow {l}_radiocarpal",
    "unreal": "pelvis spine_01 neck_01 head clavicle_{l} thigh_{l} calf_{l} foot_{l} upperarm_{l} lowerarm_{l} hand_{l}",
    "biped": "Bip01 Bip01_Spine Bip01_Neck Bip01_Head Bip01_{L}_Clavicle Bip01_{L}_Thigh Bip01_{L}_Calf Bip01_{L}_Foot "
    "Bip01_{L}_UpperArm Bip01_{L}_Forearm Bip01_{L}_Hand",
    "rigify": "DEF-spine DEF-spine.001 DEF-spine.004 DEF-spine.006 DEF-shoulder.{L} DEF-thigh.{L} DEF-shin.{L} "
    "DEF-foot.{L} DEF-upper_arm.{L} DEF-forearm.{L} DEF-hand.{L}",
    "daz": "hip abdomen neck head {l}Collar {l}ThighBend {l}Shin {l}Foot {l}ShldrBend {l}ForearmBend {l}Hand",
    "motive": "Hip Ab Neck Head {L}Shoulder {L}Thigh {L}Shin {L}Foot {L}UArm {L}FArm {L}Hand",
    "makehuman": "root spine05 neck01 head clavicle.{L} upperleg01.{L} lowerleg01.{L} foot.{L} upperarm01.{L} "
    "lowerarm01.{L} wrist.{L}",
    "kinect": "HipCenter Spine Neck Head Collar{Left} Hip{Left} Knee{Left} Ankle{Left} Shoulder{Left} Elbow{Left} "
    "Wrist{Left}",
}


def family_skeleton(family: str, prefix: str = "", suffix: str = "") -> sp.Skeleton:
    """An 18-joint rig of human size named as a family names it, T-pose, with toes and head tip as sites."""
    words = FAMILIES[family].split()
    names, parents = [prefix + w + suffix for w in words[:4]], [-1, 0, 1, 2]
    offsets = [[0, 1, 0], [0, 0.2, 0], [0, 0.25, 0], [0, 0.1, 0]]
    sites, carriers, places = ["top"], [3], [[0, 0.15, 0]]
    for short, word, sign in (("l", "left", 1.0), ("r", "right", -1.0)):
        sides = {"l": short, "L": short.upper(), "left": word, "Left": word.title()}
        clavicle, *rest = (prefix + w.format(**sides) + suffix for w in words[4:])
        first = len(names)
        names += [*rest[:3], clavicle, *rest[3:]]
        parents += [0, first, first + 1, 1, first + 3, first + 4, first + 5]
        offsets += [[sign * 0.1, -0.1, 0], [0, -0.42, 0], [0, -0.43, 0], [sign * 0.04, 0.2, 0]]
        offsets += [[sign * 0.15, 0, 0], [sign * 0.3, 0, 0], [sign * 0.27, 0, 0]]
        sites += ["toe", "finger"]
        carriers += [first + 2, first + 6]
        places += [[0, -0.06, 0.2], [sign * 0.18, 0, 0]]
    return sp.Skeleton(
        tuple(names),
        np.array(parents),
        np.array(offsets, float),
        tuple(sites),
        np.array(carriers),
        np.array(places),
    )


def renamed(skeleton: sp.Skeleton, names: list[str]) -> sp.Skeleton:
    """The same rig under other joint names."""
    return replace(skeleton, names=tuple(names))


def random_quaternions(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Uniform random rotations."""
    return rot.normalised(rng.normal(size=(*shape, 4)))


def exercise(figure: sp.Figure, frames: int = 120, seed: int = 0) -> sp.Motion:
    """Limbs swing and bend purely about their hinges; the trunk bends a little about its neutral."""
    rng, t = np.random.default_rng(seed), np.linspace(0, 4 * np.pi, frames)
    local = np.tile(rot.IDENTITY, (frames, len(figure.skeleton), 1))
    r = figure.roles

    def sway(joint: int, size: float) -> None:
        waves = np.sin(np.outer(t, [1, 2, 3]) + rng.uniform(0, 6, 3)) * size
        local[:, joint] = rot.from_euler("XYZ", waves)

    sway(r.pelvis, 0.3)
    for joint in r.spine:
        sway(joint, 0.05)
    for joint in (*r.shoulder, *r.hip):
        sway(joint, 0.4)
    for k in range(2):
        bend = 0.7 + 0.6 * np.sin(t + k)
        local[:, r.elbow[k]] = rot.from_axis_angle(np.array([1.0, 0, 0]), -bend)
        local[:, r.knee[k]] = rot.from_axis_angle(np.array([1.0, 0, 0]), bend)
    pelvis = np.array([0.0, 1.0, 0.0]) + 0.2 * np.sin(np.outer(t, [1, 1.5, 2]))
    return figure.compute_motion(local, pelvis, 60.0)


def reframed(
    motion: sp.Motion, frames: np.ndarray, scale: float = 1.0, names: list[str] | None = None
) -> sp.Motion:
    """The same movement on a rig whose joint frames are turned by constants (J, 4): other rest pose, same body."""
    s = motion.skeleton
    above = np.maximum(s.parents, 0)
    offsets = rot.mul_vec(rot.inv(frames[above]), s.offsets) * scale
    offsets[0] = s.offsets[0] * scale
    local = rot.mul(rot.inv(frames[above]), rot.mul(motion.rotations, frames))
    local[:, 0] = rot.mul(motion.rotations[:, 0], frames[0])
    skeleton = sp.Skeleton(
        tuple(names or s.names),
        s.parents,
        offsets,
        s.site_names,
        s.site_parents,
        rot.mul_vec(rot.inv(frames[s.site_parents]), s.site_offsets) * scale,
    )
    return sp.Motion(skeleton, local, motion.translations * scale, motion.rate)


def anatomical(figure: sp.Figure, motion: sp.Motion) -> np.ndarray:
    """(F, J, 4) world rotations of the anatomical frames."""
    return rot.mul(motion.transforms[1], rot.inv(figure.neutral))


@cache
def load(path: Path) -> sp.Motion:
    """A recording, at most every eighth frame of long ones."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        motion = sp.load(path)
    if path.name.startswith("90_05"):
        motion = motion.sliced(slice(1, None))
    return motion.sliced(slice(None, None, 8)) if len(motion) > 800 else motion


def real_rigs() -> list[Path]:
    """One recording of every rig in the data folder; empty without it."""
    folder = data_folder()
    if folder is None:
        return []
    first = {p.stem.split("_")[0]: p for p in sorted(folder.glob("*/*.amc"), reverse=True)}
    return sorted([*folder.glob("*/*.bvh"), *first.values()])
