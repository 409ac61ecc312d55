"""Reaching: high to the left, across the body to the right, down to the floor, and a look around.

The feet stay where they are, so the rest of the body has to do it all: the pelvis shifts and lists, the trunk
bends and twists, the shoulder girdle goes with the hand, and one heel leaves the floor.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.samples.keyframes import curve, degrees, frame_times, mix, sway
from sixpoint.samples.pose import chest_points, step_foot, world_hand
from sixpoint.samples.puppet import Puppet
from sixpoint.samples.tracks import Foot, Hand, Trunk

Array = NDArray[np.float64]

HIGH = np.array([0.62, 1.93, 0.20])  # left hand, at about 1.6 s [m]
ACROSS = np.array([-0.50, 1.22, 0.42])  # left hand, at about 3.5 s
FLOOR = np.array([0.17, 0.18, 0.42])  # left wrist at about 5.6 s, fingers on the floor; the right mirrors it


def reach(figure: Figure) -> Motion:
    """Nine seconds of reaching with both feet planted."""
    t = frame_times(9.0)
    puppet = Puppet(figure, _trunk(t))
    return puppet.perform(_feet(t), (_left(puppet, t), _right(puppet, t)), "reach")


def _trunk(t: Array) -> Trunk:
    pelvis = {
        0.4: (0.0, 1.018, -0.01),
        1.45: (0.10, 1.022, 0.01),
        1.8: (0.10, 1.022, 0.01),
        2.5: (0.0, 1.014, -0.01),
        3.4: (-0.06, 0.975, -0.02),
        3.8: (-0.06, 0.975, -0.02),
        4.6: (0.0, 0.98, -0.03),
        5.4: (0.0, 0.52, -0.16),
        5.9: (0.0, 0.52, -0.16),
        6.9: (0.0, 1.014, -0.01),
        9.0: (0.0, 1.018, -0.01),
    }
    turn = {
        0.4: (0, 2, 0),
        1.45: (8, 0, 7),
        1.8: (8, 0, 7),
        2.5: (0, 2, 0),
        3.4: (-24, 8, -3),
        3.8: (-24, 8, -3),
        4.6: (0, 8, 0),
        5.4: (3, 20, 0),
        5.9: (3, 20, 0),
        6.9: (0, 3, 0),
        7.4: (9, 2, 1),
        7.7: (9, 2, 1),
        8.3: (-9, 2, -1),
        8.6: (-9, 2, -1),
        9.0: (-3, 2, 0),
    }
    spine = {
        0.4: (-3, 0, 0),
        1.45: (-10, 2, 14),
        1.8: (-10, 2, 14),
        2.5: (-2, 0, 0),
        3.4: (14, -5, -26),
        3.8: (14, -5, -26),
        4.6: (8, 0, 0),
        5.4: (66, 0, 0),
        5.9: (66, 0, 0),
        6.9: (-2, 0, 0),
        7.4: (-3, 2, 16),
        7.7: (-3, 2, 16),
        8.3: (-3, -2, -16),
        8.6: (-3, -2, -16),
        9.0: (-3, 0, -6),
    }
    gaze = {
        0.0: (0, 0, 0),
        0.5: (28, -12, 0),
        1.4: (44, -26, 4),
        1.8: (44, -24, 4),
        2.5: (-20, 8, 0),
        3.3: (-64, 14, -3),
        3.8: (-64, 14, -3),
        4.6: (0, 26, 0),
        5.4: (4, 58, 0),
        5.9: (-4, 54, 0),
        6.8: (0, 2, 0),
        7.4: (66, -4, 3),
        7.7: (66, -6, 3),
        8.3: (-66, -4, -3),
        8.6: (-66, -2, -3),
        9.0: (-30, 0, 0),
    }
    still = np.stack([0.010 * sway(t, 0.25), 0.003 * sway(t, 0.3, 0.2), 0.008 * sway(t, 0.21, 0.6)], axis=-1)
    turned = degrees(turn, t) + np.radians(np.stack([2 * sway(t, 0.2), 0 * t, 1.2 * sway(t, 0.25)], axis=-1))
    return Trunk(curve(pelvis, t) + still, turned, degrees(spine, t), degrees(gaze, t))


def _feet(t: Array) -> tuple[Foot, Foot]:
    """Planted a little apart; the right heel rises for the high reach, the left for the reach across."""
    squat = {4.6: 2, 5.4: 12, 5.9: 12, 6.8: 2}
    left = {2.6: (10, 0, 0), 3.4: (10, 14, 0), 3.8: (10, 14, 0), 4.5: (10, 0, 0)}
    left |= {4.7: (10, 0, 0), 5.4: (10, 14, 0), 5.9: (10, 14, 0), 6.6: (10, 0, 0)}
    right = {0.6: (-12, 0, 0), 1.45: (-12, 26, 0), 1.8: (-12, 26, 0), 2.5: (-12, 0, 0)}
    right |= {4.7: (-12, 0, 0), 5.4: (-12, 16, 0), 5.9: (-12, 16, 0), 6.6: (-12, 0, 0)}
    return (
        step_foot(t, {0: (0.14, 0, 0.02)}, left, squat),
        step_foot(t, {0: (-0.14, 0, -0.01)}, right, squat),
    )


def _left(puppet: Puppet, t: Array) -> Hand:
    loose = {
        0.4: (0.11, -0.95, 0.10),
        0.9: (0.34, -0.60, 0.50),
        2.2: (0.40, -0.40, 0.55),
        2.8: (0.16, -0.55, 0.55),
        4.2: (0.06, -0.62, 0.56),
        4.8: (0.10, -0.86, 0.28),
        6.1: (0.08, -0.8, 0.4),
        6.9: (0.11, -0.95, 0.10),
    }
    wrist = chest_points(puppet, 0, t, loose)
    wrist = mix(wrist, HIGH, curve({0.6: 0, 1.45: 1, 1.8: 1, 2.5: 0}, t))
    wrist = mix(wrist, ACROSS, curve({2.6: 0, 3.4: 1, 3.8: 1, 4.5: 0}, t))
    wrist = mix(wrist, FLOOR, curve({4.8: 0, 5.45: 1, 5.85: 1, 6.5: 0}, t))
    turn = {
        0.4: (15, 8, 0),
        1.45: (30, -18, -6),
        1.8: (30, 6, -6),
        2.5: (20, 8, 0),
        3.4: (60, -10, 6),
        3.8: (40, 22, 6),
        4.6: (20, 8, 0),
        5.4: (60, -8, 0),
        5.9: (60, -8, 0),
        6.9: (15, 8, 0),
    }
    shrug = {0.6: (0, 0), 1.45: (6, 0), 1.8: (6, 0), 2.5: (0, 0), 3.4: (0, 10), 3.8: (0, 10), 4.6: (0, 0)}
    swivel = {0.5: 0, 1.45: -8, 1.8: -8, 2.5: 0, 3.4: 20, 3.8: 20, 4.6: 0, 5.4: 12, 5.9: 12, 6.8: 0}
    return world_hand(t, wrist, swivel=swivel, turn=turn, shrug=shrug)


def _right(puppet: Puppet, t: Array) -> Hand:
    loose = {
        0.4: (0.11, -0.95, 0.10),
        1.45: (0.24, -0.92, -0.02),
        1.8: (0.24, -0.92, -0.02),
        2.5: (0.11, -0.95, 0.10),
        3.4: (0.16, -0.88, -0.22),
        3.8: (0.16, -0.88, -0.22),
        4.8: (0.10, -0.86, 0.28),
        6.1: (0.08, -0.8, 0.4),
        6.9: (0.11, -0.95, 0.10),
        7.4: (0.13, -0.93, 0.16),
        8.3: (0.12, -0.94, -0.04),
        9.0: (0.11, -0.95, 0.08),
    }
    wrist = chest_points(puppet, 1, t, loose)
    wrist = mix(wrist, FLOOR * [-1, 1, 1] + [0, 0, 0.02], curve({4.85: 0, 5.5: 1, 5.85: 1, 6.5: 0}, t))
    turn = {
        0.4: (15, 8, 0),
        1.6: (24, 4, 0),
        2.5: (15, 8, 0),
        3.6: (8, 12, 0),
        4.6: (20, 8, 0),
        5.4: (60, -8, 0),
        5.9: (60, -8, 0),
        6.9: (15, 8, 0),
    }
    swivel = {4.6: 0, 5.4: 12, 5.9: 12, 6.8: 0}
    return world_hand(t, wrist, swivel=swivel, turn=turn)
