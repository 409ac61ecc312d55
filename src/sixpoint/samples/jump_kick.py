"""A spinning jump kick: three steps, a crouch, a full turn in the air with a kick, a deep landing.

The pelvis flies on a true parabola from take-off to landing. The body turns once about the vertical to the
right, the head turns late and then leads, and the right leg strikes at the end of the turn.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.samples.keyframes import ballistic, curve, degrees, frame_times, sway
from sixpoint.samples.pose import hold_hand, lift_foot, step_foot
from sixpoint.samples.puppet import Puppet
from sixpoint.samples.tracks import Foot, Hand, Trunk

Array = NDArray[np.float64]

UP, DOWN = 1.75, 2.40  # take-off and landing [s]
HIGH, LOW = 1.06, 0.92  # height of the pelvis then [m]
GRAVITY = 9.81
RISE = (LOW - HIGH) / (DOWN - UP) + GRAVITY * (DOWN - UP) / 2  # speed at take-off [m/s]
FALL = RISE - GRAVITY * (DOWN - UP)  # speed at landing [m/s]


def jump_kick(figure: Figure) -> Motion:
    """Five seconds: run-up, jump with a spinning kick, landing, standing up."""
    t = frame_times(5.0)
    puppet = Puppet(figure, _trunk(t))
    feet = (_left_foot(puppet, t), _right_foot(puppet, t))
    return puppet.perform(feet, _hands(puppet, t), "jump_kick")


def _trunk(t: Array) -> Trunk:
    still = curve({0: 1, 0.4: 0, 3.6: 0, 4.4: 1}, t)
    height = {
        0.0: (1.018, 0.0),
        0.45: (0.985, 0.0),
        0.70: (0.975, 0.0),
        0.95: (0.94, -0.1),
        1.48: (0.70, 0.0),
        UP: (HIGH, RISE),
        DOWN: (LOW, FALL),
        2.68: (0.60, 0.0),
        2.85: (0.61, 0.1),
        3.9: (1.014, 0.0),
        5.0: (1.016, 0.0),
    }
    across = curve({0.4: 0, 0.65: 0.04, 0.95: -0.04, 1.3: 0, 2.4: 0, 2.7: -0.01, 3.9: 0}, t)
    ahead = curve({0.35: 0, 0.7: 0.26, 1.05: 0.66, 1.45: 0.93, UP: 1.03, DOWN: 1.44, 2.7: 1.50, 3.9: 1.49}, t)
    pelvis = np.stack([across + 0.008 * still * sway(t, 0.4), ballistic(height, t), ahead], axis=-1)
    turn = {
        0.3: (0, 2, 0),
        0.7: (-7, 5, -2),
        1.05: (10, 6, 3),
        1.48: (32, 24, 0),
        UP: (-66, 4, 2),
        1.95: (-190, -4, 6),
        2.16: (-306, -20, -14),
        2.30: (-338, -8, -6),
        DOWN: (-354, 12, 0),
        2.70: (-366, 30, 0),
        3.0: (-366, 28, 0),
        3.9: (-360, 2, 0),
    }
    spine = {
        0.3: (-2, 0, 0),
        0.7: (6, 0, 10),
        1.05: (8, 0, -12),
        1.48: (36, 0, 14),
        UP: (-6, 0, -24),
        1.95: (10, -4, -20),
        2.16: (16, 8, 14),
        DOWN: (20, 0, 8),
        2.70: (38, 0, -6),
        3.0: (36, 0, -4),
        3.9: (0, 0, 0),
    }
    gaze = {
        1.2: (0, 6, 0),
        1.5: (8, 4, 0),
        UP: (-34, 4, 0),
        1.90: (-158, 6, 0),
        2.14: (-342, 8, -6),
        2.35: (-360, 16, 0),
        2.7: (-360, 10, 0),
        3.9: (-360, 2, 0),
    }
    return Trunk(pelvis, degrees(turn, t), degrees(spine, t), degrees(gaze, t))


def _left_foot(puppet: Puppet, t: Array) -> Foot:
    place = {
        0.35: (0.10, 0, -0.02),
        0.55: (0.10, 0.07, 0.25),
        0.78: (0.09, 0, 0.52),
        1.12: (0.09, 0, 0.52),
        1.27: (0.12, 0.06, 0.78),
        1.42: (0.15, 0, 1.02),
        1.85: (0.15, 0, 1.02),
        2.25: (0.14, 0, 1.62),
    }
    turn = {
        0.25: (8, 0, 0),
        0.45: (6, 24, 0),
        0.70: (2, -12, 0),
        0.84: (2, 0, 0),
        1.0: (2, 8, 0),
        1.14: (6, 42, 0),
        1.38: (14, 0, 0),
        1.55: (14, 4, 0),
        1.76: (4, 52, 0),
        1.9: (-20, 45, 0),
        2.2: (-345, 25, 0),
        2.36: (-345, 22, 0),
        2.5: (-345, 4, 0),
        2.7: (-345, 0, 0),
    }
    foot = step_foot(t, place, turn, {1.2: 2, 1.45: 8, 1.75: 0, 2.4: 4, 2.7: 14, 3.9: 2})
    ankle = {
        1.75: (0.03, -0.80, -0.12),
        1.95: (0.03, -0.56, -0.12),
        2.14: (0.02, -0.50, 0.02),
        2.28: (0.02, -0.68, 0.08),
        2.42: (0.04, -0.68, 0.08),
    }
    air = {1.74: 0, 1.88: 1, 2.24: 1, 2.40: 0}
    return lift_foot(puppet, 0, t, foot, air, ankle, {1.7: 45, 2.0: 28, 2.28: 14, 2.4: 4})


def _right_foot(puppet: Puppet, t: Array) -> Foot:
    place = {
        0.72: (-0.10, 0, -0.02),
        0.90: (-0.10, 0.10, 0.40),
        1.10: (-0.12, 0, 0.92),
        1.85: (-0.12, 0, 0.92),
        2.25: (-0.15, 0.035, 1.38),
        2.46: (-0.15, 0.035, 1.38),
        2.60: (-0.15, 0, 1.38),
    }
    turn = {
        0.40: (-8, 0, 0),
        0.58: (-8, 12, 0),
        0.74: (-6, 46, 0),
        0.90: (-4, 30, 0),
        1.04: (-8, -10, 0),
        1.18: (-8, 0, 0),
        1.55: (-8, 2, 0),
        1.76: (-30, 50, 0),
        1.9: (-60, 45, 0),
        2.2: (-376, 25, 0),
        2.38: (-384, 0, 0),
        2.52: (-384, 0, 0),
        2.7: (-384, 4, 0),
        3.6: (-382, 0, 0),
    }
    foot = step_foot(t, place, turn, {1.2: 2, 1.45: 8, 1.75: 0, 2.4: 4, 2.7: 14, 3.9: 2})
    ankle = {
        1.75: (0.03, -0.80, -0.10),
        1.91: (0.08, -0.45, 0.17),
        2.0: (0.19, -0.24, 0.38),
        2.18: (0.39, -0.03, 0.72),
        2.21: (0.39, -0.04, 0.72),
        2.46: (0.12, -0.46, 0.26),
    }
    air = {1.74: 0, 1.88: 1, 2.26: 1, 2.54: 0}
    return lift_foot(puppet, 1, t, foot, air, ankle, {1.7: 40, 2.0: 30, 2.15: 24, 2.32: -8, 2.5: -22})


def _hands(puppet: Puppet, t: Array) -> tuple[Hand, Hand]:
    left = {
        0.3: (0.10, -0.94, 0.14),
        0.75: (0.12, -0.88, -0.24),
        1.08: (0.06, -0.62, 0.52),
        1.48: (0.24, -0.84, -0.28),
        1.80: (-0.05, 0.16, 0.62),
        2.0: (-0.24, -0.10, 0.44),
        2.16: (0.24, -0.16, 0.42),
        2.40: (0.40, -0.36, 0.52),
        2.70: (0.24, -0.60, 0.58),
        3.0: (0.22, -0.62, 0.56),
        3.9: (0.10, -0.94, 0.14),
    }
    right = {
        0.3: (0.10, -0.94, 0.14),
        0.75: (0.06, -0.70, 0.50),
        1.08: (0.12, -0.86, -0.28),
        1.48: (0.22, -0.86, -0.24),
        1.80: (-0.10, 0.04, 0.56),
        2.0: (-0.20, -0.16, 0.44),
        2.16: (0.56, -0.62, -0.12),
        2.40: (0.58, -0.40, 0.34),
        2.70: (0.26, -0.62, 0.56),
        3.0: (0.22, -0.64, 0.56),
        3.9: (0.10, -0.94, 0.14),
    }
    turn = {0.3: (18, 8, 0), 1.48: (30, 20, 0), 1.8: (20, 30, 10), 2.7: (50, 10, 0), 3.9: (18, 8, 0)}
    shrug = {1.4: (0, 0), 1.8: (8, 6), 2.2: (4, 0), 2.7: (6, 4), 3.6: (0, 0)}
    swivel = {1.4: 0, 1.8: 10, 2.4: 16, 2.8: 6, 3.9: 0}
    return (
        hold_hand(puppet, 0, t, left, swivel=swivel, turn=turn, shrug=shrug),
        hold_hand(puppet, 1, t, right, swivel=swivel, turn=turn, shrug=shrug),
    )
