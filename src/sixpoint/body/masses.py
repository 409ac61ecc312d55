"""Segment masses and their centres: of a human figure from cadaver tables, of anything else as even rods.

Reference: Winter, "Biomechanics and Motor Control of Human Movement", after Dempster 1955.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.skeleton import Skeleton
from sixpoint.body.tables import read_shipped

Array = NDArray[np.float64]


def segment_masses(figure: Figure) -> Array:
    """(J, 4) share of the body's mass and centre of mass in the joint's anatomical frame [m].

    Limb segments have theirs at Winter's fraction of their length. Head and neck hang on the head joint, the
    hand beyond the wrist as far as its share of the forearm says, the foot at the ankle's front; the trunk is
    spread over pelvis and spine joints by the lengths between them.
    """
    table = read_shipped("masses.toml")
    roles = figure.roles
    masses = np.zeros((len(figure.skeleton), 4))

    def add(joint: int, name: str, vector: Array) -> None:
        share, fraction = table[name]
        centre = masses[joint, 0] * masses[joint, 1:] + share * fraction * vector
        masses[joint, 0] += share
        masses[joint, 1:] = centre / masses[joint, 0]

    for k in range(2):
        shoulder, elbow, wrist = roles.shoulder[k], roles.elbow[k], roles.wrist[k]
        hip, knee, ankle = roles.hip[k], roles.knee[k], roles.ankle[k]
        forearm = figure.offset_between(elbow, wrist)
        add(shoulder, "upper_arm", figure.offset_between(shoulder, elbow))
        add(elbow, "forearm", forearm)
        add(wrist, "hand", table["hand_over_forearm"] * forearm)
        add(hip, "thigh", figure.offset_between(hip, knee))
        shank = figure.offset_between(knee, ankle)
        add(knee, "shank", shank)
        add(ankle, "foot", np.array([0.0, 0.0, table["foot_over_shank"] * np.linalg.norm(shank)]))
    add(roles.head, "head_and_neck", figure.head_offset)
    _spread_trunk(figure, masses, table["trunk"][0])
    return masses


def _spread_trunk(figure: Figure, masses: Array, share: float) -> None:
    """The trunk's mass on pelvis and spine joints below the head, by the length of the segment above each."""
    chain = (figure.roles.pelvis, *figure.roles.spine)
    steps = [figure.offset_between(a, b) for a, b in pairwise(chain)]
    lengths = np.linalg.norm(steps, axis=1)
    for joint, step, length in zip(chain, steps, lengths, strict=False):
        part = share * length / max(lengths.sum(), 1e-9)
        if part > 0.0:
            masses[joint, 1:] = (masses[joint, 0] * masses[joint, 1:] + part * 0.5 * step) / (
                masses[joint, 0] + part
            )
            masses[joint, 0] += part


def rod_masses(skeleton: Skeleton) -> Array:
    """(J, 4) masses of even rods between the joints, in proportion to their length."""
    masses = np.zeros((len(skeleton), 4))
    ends = [(int(p), o) for p, o in zip(skeleton.parents[1:], skeleton.offsets[1:], strict=True)]
    ends += [(int(p), o) for p, o in zip(skeleton.site_parents, skeleton.site_offsets, strict=True)]
    for joint, offset in ends:
        length = float(np.linalg.norm(offset))
        masses[joint, 0] += length
        masses[joint, 1:] += 0.5 * length * offset
    heavy = masses[:, 0] > 0.0
    masses[heavy, 1:] /= masses[heavy, :1]
    masses[:, 0] /= max(float(masses[:, 0].sum()), 1e-9)
    if not heavy.any():
        masses[:, 0] = 1.0 / len(skeleton)
    return masses


def centre_of_mass(masses: Array, positions: Array, world: Array) -> Array:
    """Centre of mass (..., 3) [m] of posed joints: positions (..., J, 3), rotations (..., J, 4)."""
    centres = positions + rot.mul_vec(world, np.broadcast_to(masses[:, 1:], positions.shape))
    return np.asarray(np.einsum("j,...jk->...k", masses[:, 0] / masses[:, 0].sum(), centres))
