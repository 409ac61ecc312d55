"""What compiled methods of six points read, and how it crosses from Python in few arrays.

Posed joints are rows of one array of anatomical local rotations: the S trunk joints, then ten limb joints
(clavicles, shoulders, elbows, hips, knees; left before right). Methods that turn the extremities have five
rows more, the ends: head, wrists, ankles.
"""

from typing import NamedTuple

import numpy as np

from sixpoint.kernels.jit import helper

LIMB_ROWS = 10
END_ROWS = 5
STRETCH_POSES = 33


class Model(NamedTuple):
    """Arrays of one figure; neutral-pose vectors are in the anatomical frame [m].

    Every vector and quaternion is a row of four numbers, so that all can be slices of one array.

    Attributes:
        segments: (S, 4) trunk segment vectors from the pelvis to the head, and the share of the pelvis'
            bending angle that each turns by (eq. 1).
        turns: (S, 4) axis, and angle [rad] when the trunk is fully stretched, of each segment's turn
            towards the chord.
        hips: (2, 4) hips from the pelvis.
        girdle: (2, 4) clavicle joint (or shoulder, without clavicles) from the place of the trunk joint
            that carries the arm.
        clavicles: (2, 4) shoulder from the clavicle joint; zero without clavicles.
        limbs: (4, 4) upper and lower length [m], least and largest flexion [rad] of left arm, right arm,
            left leg, right leg.
        origin: (1, 4) place of the pelvis' parent, which stands still in rigs whose root is not the
            pelvis; zero elsewhere.
        before: (J, 4) inverse of the neutral rotation of each rig joint's parent.
        after: (J, 4) neutral rotation of each rig joint.
        constant: (J, 4) local rotation of each rig joint in the neutral pose.
        balls: (rows, W) limits of the posed rows, see ``kernels.swing_twist``; hinges are unlimited there.
        chords: (33,) chord length of the precomputed stretch poses, not decreasing [m]; the first is the
            neutral pose's.
        chest: (2,) trunk joint that carries each arm.
        row: (J,) posed row of each rig joint, -1 for joints that keep their neutral rotation. The head has no
            row of its own where it is an end site: its trunk joint turns it.
    """

    segments: np.ndarray
    turns: np.ndarray
    hips: np.ndarray
    girdle: np.ndarray
    clavicles: np.ndarray
    limbs: np.ndarray
    origin: np.ndarray
    before: np.ndarray
    after: np.ndarray
    constant: np.ndarray
    balls: np.ndarray
    chords: np.ndarray
    chest: np.ndarray
    row: np.ndarray


ROW_FIELDS = Model._fields[: Model._fields.index("balls")]


def pack_model(model):
    """Model -> table (N, 4) of all row fields, and integers: sizes and indices."""
    table = np.vstack([getattr(model, name) for name in ROW_FIELDS])
    integers = [len(model.segments), len(model.row), *model.chest, *model.row]
    return table, np.array(integers, np.int64)


@helper
def unpack_model(table, integers, balls, chords):
    """The model as slices."""
    s, j = integers[0], integers[1]
    a = 2 * s
    b = a + 11
    return Model(
        table[:s],
        table[s:a],
        table[a : a + 2],
        table[a + 2 : a + 4],
        table[a + 4 : a + 6],
        table[a + 6 : a + 10],
        table[a + 10 : b],
        table[b : b + j],
        table[b + j : b + 2 * j],
        table[b + 2 * j : b + 3 * j],
        balls,
        chords,
        integers[2:4],
        integers[4:],
    )


@helper
def limb_row(segments, limb):
    """Row of a limb's root joint: 0 and 1 are the arms, 2 and 3 the legs; its hinge is two rows on."""
    return segments + 2 + limb if limb < 2 else segments + 4 + limb


@helper
def end_row(segments, end):
    """Row of an extremity: 0 the head, 1 and 2 the wrists, 3 and 4 the ankles."""
    return segments + LIMB_ROWS + end
