"""Climbing to a bar and hanging from it: a step up, two reaches, a swing by the hands, a drop.

While the hands hold the bar they do not move: the pelvis swings below them and the legs swing a little later.
The block that is stepped on and the bar are not part of the motion.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.samples.keyframes import ballistic, curve, degrees, frame_times, mix, sway
from sixpoint.samples.pose import chest_points, lift_foot, step_foot, world_hand
from sixpoint.samples.puppet import Puppet
from sixpoint.samples.tracks import Foot, Hand, Trunk

Array = NDArray[np.float64]

BLOCK = 0.36  # height of the block [m]
BAR = np.array([0.0, 2.40, 0.74])  # middle of the bar, where the wrists go [m]
HANG, RELEASE, LAND = 4.0, 7.00, 7.33  # feet leave the block, hands leave the bar, feet land [s]
DROP, FLOOR = 1.352, 0.92  # height of the pelvis at release and landing [m]
FALL = (FLOOR - DROP) / (LAND - RELEASE)  # mean speed of the drop [m/s]


def climb_and_hang(figure: Figure) -> Motion:
    """Nine seconds: step onto a block, grasp a bar, hang and swing, drop and stand up."""
    t = frame_times(9.0)
    # Legs and trunk swing about the bar; the amplitude grows, and the release is at the front.
    grown = curve({3.7: 0, 4.6: 0.75, 6.2: 1.0, RELEASE - 0.1: 1.0, LAND: 0}, t)
    swing = grown * np.sin(2 * np.pi * (t - 4.86) / 1.9)
    late = grown * np.sin(2 * np.pi * (t - 5.06) / 1.9)
    puppet = Puppet(figure, _trunk(t, swing, late))
    feet = (_foot(puppet, 0, t, late), _foot(puppet, 1, t, late))
    return puppet.perform(feet, (_hand(puppet, 0, t), _hand(puppet, 1, t)), "climb_and_hang")


def _trunk(t: Array, swing: Array, late: Array) -> Trunk:
    before = curve({0.5: 1.016, 0.95: 0.985, 1.35: 1.02, 1.95: 1.366, 2.5: 1.385, 3.6: 1.395, 4.3: DROP}, t)
    falling = {
        RELEASE: (DROP, 0.0),
        LAND: (FLOOR, 2 * FALL),
        7.62: (0.66, 0.0),
        7.8: (0.67, 0.1),
        8.5: (0.985, 0.05),
        9.0: (1.014, 0.0),
    }
    height = np.where(t < RELEASE, before + 0.03 * swing**2 * (t > HANG), ballistic(falling, t))
    across = curve({0.4: 0, 0.7: -0.05, 1.4: 0.05, 1.9: 0.03, 2.4: -0.03, 3.0: 0.03, 3.7: 0}, t)
    ahead = curve(
        {0.6: 0, 1.3: 0.22, 1.95: 0.44, 2.6: 0.52, 3.6: 0.60, 4.2: 0.70, 6.9: 0.72, LAND: 1.08, 7.7: 1.13}, t
    )
    pelvis = np.stack([across, height, ahead + 0.20 * swing], axis=-1)
    turn = {
        0.5: (0, 2, 0),
        0.9: (-8, 6, 5),
        1.4: (4, 16, -3),
        2.0: (0, 4, 0),
        2.5: (-6, 0, 3),
        3.1: (8, -2, -4),
        3.8: (0, -2, 0),
        4.4: (0, 0, 0),
        6.9: (0, -4, 0),
        LAND: (0, 12, 0),
        7.65: (2, 28, 0),
        8.5: (0, 3, 0),
    }
    spine = {
        0.5: (-2, 0, 0),
        1.0: (4, -4, 10),
        1.5: (16, 3, -6),
        2.0: (0, 0, 0),
        2.5: (-8, -8, -8),
        3.1: (-8, 8, 10),
        3.8: (-6, 0, 0),
        6.9: (-2, 0, 0),
        LAND: (16, 0, 0),
        7.65: (34, 0, 4),
        8.5: (0, 0, 0),
    }
    gaze = {
        0.0: (0, 0, 0),
        0.4: (2, -18, 0),
        0.8: (0, 24, 0),
        1.5: (0, 16, 0),
        2.0: (4, -28, 0),
        3.0: (-4, -32, 0),
        3.8: (0, -14, 0),
        5.0: (0, 4, 0),
        6.6: (0, 22, 0),
        LAND: (0, 30, 0),
        7.7: (0, 16, 0),
        8.5: (0, 2, 0),
    }
    turns = degrees(turn, t) + np.radians(np.stack([3 * sway(t, 0.3), -13 * swing, 3 * late], axis=-1))
    spines = degrees(spine, t) + np.radians(
        np.stack([12 * late - 4 * swing, 0 * t, 5 * sway(t, 0.35)], axis=-1)
    )
    return Trunk(pelvis, turns, spines, degrees(gaze, t))


def _foot(puppet: Puppet, side: int, t: Array, late: Array) -> Foot:
    """Left steps up first; both hang from HANG on and land together."""
    sign = 1.0 - 2.0 * side
    x, wait = 0.10 * sign, 0.75 * side
    up = {
        0.55 + wait: (x, 0, 0.0),
        0.80 + wait: (x, 0.30, 0.10),
        0.98 + wait: (x, BLOCK + 0.10, 0.32),
        1.18 + wait: (x, BLOCK, 0.50 - 0.02 * side),
        4.2: (x, BLOCK, 0.50 - 0.02 * side),
        6.9: (1.3 * x, 0.01, 1.14 - 0.05 * side),
        LAND - 0.05: (1.3 * x, 0.01, 1.14 - 0.05 * side),
        LAND + 0.05: (1.3 * x, 0, 1.14 - 0.05 * side),
    }
    turn = {
        0.35 + wait: (6 * sign, 0, 0),
        0.58 + wait: (6 * sign, 38, 0),
        0.9 + wait: (6 * sign, 12, 0),
        1.18 + wait: (8 * sign, 0, 0),
        2.2: (8 * sign, 0, 0),
        2.6: (8 * sign, 10 + 8 * side, 0),
        3.1: (8 * sign, 18 - 8 * side, 0),
        3.7: (8 * sign, 24, 0),
        6.9: (12 * sign, 24, 0),
        LAND: (12 * sign, 24, 0),
        7.5: (12 * sign, 6, 0),
        7.65: (12 * sign, 4, 0),
        8.3: (12 * sign, 0, 0),
    }
    foot = step_foot(t, up, turn, {0.5: 2, 7.2: 2, 7.65: 12, 8.4: 2})
    hang = {
        3.8: (0.01, -0.82, 0.0),
        4.6: (0.01, -0.80, -0.10 - 0.06 * side),
        6.6: (0.01, -0.78, -0.12 + 0.05 * side),
        6.95: (0.02, -0.72, 0.06),
        LAND: (0.03, -0.69, 0.12),
    }
    hung = lift_foot(
        puppet,
        side,
        t,
        foot,
        {HANG - 0.15: 0, HANG + 0.35: 1, LAND - 0.14: 1, LAND + 0.01: 0},
        hang,
        {4.0: 24, 4.6: 34},
    )
    kick = np.stack([0.02 * late * sign, 0.05 * late**2, (0.16 + 0.03 * side) * late], axis=-1)
    hung.place[:] += kick * hung.air[:, None]
    return hung


def _hand(puppet: Puppet, side: int, t: Array) -> Hand:
    """The left hand reaches first; the right one a little later."""
    sign, wait = 1.0 - 2.0 * side, 0.75 * side
    loose = {
        0.4: (0.10, -0.95, 0.12),
        1.0: (0.20, -0.80, 0.30 - 0.4 * side),
        1.6: (0.22, -0.82, -0.1 + 0.35 * side),
        2.0 + 0.5 * side: (0.14, -0.80, 0.36),
        3.2: (0.2, 0.5, 0.5),
        RELEASE: (0.10, 0.66, 0.66),
        RELEASE + 0.2: (0.16, 0.42, 0.72),
        LAND: (0.34, -0.05, 0.72),
        7.65: (0.26, -0.62, 0.56),
        8.5: (0.11, -0.95, 0.14),
    }
    free = chest_points(puppet, side, t, loose)
    bar = BAR + np.array([0.25 * sign, 0, 0])
    hold = curve({2.05 + wait: 0, 2.75 + wait: 1, RELEASE - 0.02: 1, RELEASE + 0.26: 0}, t)
    # Reach in front of the bar and then over it.
    over = curve({2.05 + wait: 0, 2.5 + wait: 1, 2.8 + wait: 0}, t)
    wrist = mix(free, bar, hold) + over[:, None] * np.array([0.04 * sign, 0.0, 0.05])
    turn = {
        0.4: (15, 8, 0),
        2.1 + wait: (15, 8, 0),
        2.7 + wait: (70, -14, 0),
        RELEASE: (70, -8, 0),
        7.6: (50, 10, 0),
        8.5: (15, 8, 0),
    }
    shrug = {2.2 + wait: (0, 0), 2.7 + wait: (4, 2), 4.0: (6, 0), RELEASE: (6, 0), LAND: (0, 0)}
    swivel = {2.2 + wait: 0, 2.7 + wait: 36, 4.2: 50, 6.8: 54, RELEASE + 0.1: 66, LAND + 0.15: 10, 8.4: 0}
    return world_hand(t, wrist, swivel=swivel, turn=turn, shrug=shrug)
