"""What a sample authors, frame by frame: curves of the trunk, of a foot and of a hand.

Lengths are in metres for the figure of 1.75 m. A foot is authored by where its sole stands and how it rolls;
``compute_ankle`` turns that into the end point of the leg.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.samples.keyframes import smooth_step
from sixpoint.samples.limb import Y

Array = NDArray[np.float64]

BALL = np.array([0.0, -0.0580, 0.1197])  # ball of the foot from the ankle, foot flat [m]
HEEL = np.array([0.0, -0.0683, -0.0745])  # heel from the ankle [m]


@dataclass(frozen=True)
class Trunk:
    """Curves of pelvis, spine and head.

    Attributes:
        pelvis: (F, 3) position of the pelvis in the world [m].
        turn: (F, 3) yaw (left +), forward tilt, list (left side up +) of the pelvis in the world [rad].
        spine: (F, 3) flexion (forward +), side bend (left +), twist (left +) of pelvis to chest [rad].
        gaze: (F, 3) yaw, downward pitch, roll of the head in the world [rad]; the neck follows as far
            as it can.
    """

    pelvis: Array
    turn: Array
    spine: Array
    gaze: Array


@dataclass(frozen=True)
class Foot:
    """Curves of one foot.

    Attributes:
        place: (F, 3) point of the sole below the ankle, if the foot were flat [m]; y = 0 is the floor.
        turn: (F, 3) yaw in the world (left +), pitch (heel up +, about the ball; toes up -, about the
            heel), roll [rad].
        swivel: (F,) knee outwards [rad], beyond following the toes.
        air: (F,) 1 where the foot hangs from its shank instead of keeping its turn in the world.
        point: (F,) how far the hanging foot points its toes [rad].
    """

    place: Array
    turn: Array
    swivel: Array
    air: Array
    point: Array


@dataclass(frozen=True)
class Hand:
    """Curves of one hand.

    Attributes:
        wrist: (F, 3) position in the world [m].
        swivel: (F,) elbow raised outwards [rad].
        turn: (F, 3) pronation, flexion (towards the palm), deviation (towards the thumb) [rad].
        shrug: (F, 2) elevation and protraction of the shoulder [rad], beyond what the arm asks for.
    """

    wrist: Array
    swivel: Array
    turn: Array
    shrug: Array


def compute_ankle(foot: Foot) -> Array:
    """Where a foot's ankle is (F, 3) [m]: the foot rolls over heel and ball, which stay where they are."""
    over_ball = smooth_step(foot.turn[:, 1] / 0.2 + 0.5)[:, None]
    pivot = over_ball * BALL + (1.0 - over_ball) * HEEL
    level = rot.from_axis_angle(Y, foot.turn[:, 0])
    ground = foot.place - [0.0, HEEL[1], 0.0] + rot.mul_vec(level, pivot)
    return np.asarray(ground - rot.mul_vec(rot.from_euler("YXZ", foot.turn), pivot), float)
