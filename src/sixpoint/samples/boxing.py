"""Shadow boxing: an orthodox guard, jabs, crosses, a slip, a duck and a left hook.

Punches start in the feet: the pelvis turns first, then the chest, then the fist leaves the guard for a point
in the world. Between the punches the boxer bounces on the balls of the feet.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.samples.keyframes import Keys, curve, frame_times, mix, sway
from sixpoint.samples.pose import hold_hand, step_foot
from sixpoint.samples.puppet import Puppet
from sixpoint.samples.tracks import Foot, Hand, Trunk

Array = NDArray[np.float64]

JABS = (0.8, 1.55, 5.35, 6.6)  # when the left fist arrives [s]
CROSSES = (1.95, 5.8, 7.05)  # when the right fist arrives
HOOK = 4.55
OUT, BACK = 0.25, 0.32  # a punch's way out and back [s]


def boxing(figure: Figure) -> Motion:
    """Eight seconds of shadow boxing towards +Z."""
    t = frame_times(8.0)
    jab, cross, hook = _pulses(t, JABS), _pulses(t, CROSSES), _pulses(t, (HOOK,), 0.22, 0.45)
    early_jab, early_cross = _pulses(t + 0.05, JABS), _pulses(t + 0.06, CROSSES)
    early_hook = _pulses(t + 0.06, (HOOK,), 0.26, 0.5)
    duck = curve({3.5: 0, 3.85: 1, 4.0: 1, 4.45: 0}, t)
    slip = curve({2.75: 0, 3.0: 1, 3.15: 1, 3.5: 0}, t)
    wind = curve({3.9: 0, 4.25: 1, 4.5: 0}, t)
    bounce = np.cos(2 * np.pi * 1.9 * t) * curve({2.4: 1, 2.9: 0.2, 4.6: 0.2, 5.0: 1}, t)

    pelvis = np.array([0.0, 0.953, -0.01]) + np.stack(
        [
            0.02 * sway(t, 0.4) - 0.07 * slip + 0.05 * duck,
            0.012 * bounce - 0.27 * duck - 0.04 * slip - 0.02 * cross,
            0.02 * sway(t, 0.55, 0.3) + 0.04 * early_jab + 0.07 * early_cross + 0.02 * hook - 0.03 * duck,
        ],
        axis=-1,
    )
    yaw = -33 + 4 * sway(t, 0.3) - 8 * early_jab + 38 * early_cross - 16 * early_hook + 16 * wind - 10 * slip
    turn = [yaw, 6 + 16 * duck + 3 * cross, 3 * sway(t, 0.45) - 5 * slip + 3 * wind]
    spine = [
        10 + 16 * duck + 6 * early_cross + 8 * slip,
        2 * sway(t, 0.5, 0.2) - 14 * slip + 8 * wind,
        8 - 16 * early_jab + 20 * early_cross - 20 * early_hook + 18 * wind,
    ]
    gaze = [2 * sway(t, 0.4) - 12 * hook, 8 - 8 * duck, 3 * sway(t, 0.3, 0.1) - 10 * slip]
    trunk = Trunk(pelvis, *(np.radians(np.stack(a, axis=-1)) for a in (turn, spine, gaze)))
    puppet = Puppet(figure, trunk)
    feet = _feet(t, bounce, early_cross, early_hook)
    return puppet.perform(feet, (_left(puppet, t, jab, hook, wind), _right(puppet, t, cross)), "boxing")


def _pulses(t: Array, times: tuple[float, ...], out: float = OUT, back: float = BACK) -> Array:
    """0 in guard, 1 at the given times."""
    keys: dict[float, float] = {}
    for time in times:
        keys |= {time - out: 0.0, time: 1.0, time + 0.04: 1.0, time + 0.04 + back: 0.0}
    return curve(keys, t)


def _feet(t: Array, bounce: Array, cross: Array, hook: Array) -> tuple[Foot, Foot]:
    """Both feet stay where they are and roll and turn on their balls."""
    left = step_foot(t, {0: (0.11, 0, 0.19)}, {0: (-22, 0, 0)}, {0: 6})
    right = step_foot(t, {0: (-0.15, 0, -0.21)}, {0: (-52, 0, 0)}, {0: 4})
    left.turn[:, 1] += np.radians(7 + 4 * bounce + 12 * hook)
    left.turn[:, 0] -= np.radians(24 * hook)
    right.turn[:, 1] += np.radians(20 + 5 * bounce + 18 * cross)
    right.turn[:, 0] += np.radians(30 * cross)
    return left, _pivot_on_ball(right, 30 * cross)


def _pivot_on_ball(foot: Foot, turned: Array) -> Foot:
    """Move the place of a foot so that its ball stays while it yaws by ``turned`` (F,) [deg]."""
    before = foot.turn[:, 0] - np.radians(turned)
    ball = 0.12
    after = foot.turn[:, 0]
    shift = [np.sin(before) - np.sin(after), 0 * after, np.cos(before) - np.cos(after)]
    return replace(foot, place=foot.place + ball * np.stack(shift, axis=-1))


def _left(puppet: Puppet, t: Array, jab: Array, hook: Array, wind: Array) -> Hand:
    guard: Keys = {3.4: (-0.16, 0.12, 0.52), 3.9: (-0.2, 0.14, 0.46), 4.5: (-0.16, 0.12, 0.52)}
    hand = hold_hand(puppet, 0, t, guard, swivel={0: -8})
    wrist = hand.wrist + 0.012 * np.stack([sway(t, 0.7), sway(t, 1.1, 0.4), sway(t, 0.8, 0.2)], axis=-1)
    wrist = mix(wrist, puppet.in_chest(0, np.array([0.35, -0.12, 0.52])), wind)
    wrist = mix(wrist, [0.0, 1.47, 0.86], jab)
    # The fist of a hook flies on an arc around the shoulder, not through it.
    wrist = mix(wrist, puppet.in_chest(0, np.array([-0.06, 0.08, 0.58])), hook)
    turn = np.radians([10.0, 5.0, 8.0]) + np.radians(70) * np.outer(jab + 0.6 * hook, [1, 0, 0])
    shrug = np.radians(np.stack([6 * jab + 4 * hook, 14 * jab + 6 * hook], axis=-1))
    return Hand(wrist, np.radians(-8 + 22 * jab + 72 * hook + 10 * wind), turn, shrug)


def _right(puppet: Puppet, t: Array, cross: Array) -> Hand:
    guard: Keys = {3.4: (-0.22, 0.14, 0.42), 3.9: (-0.24, 0.16, 0.42), 4.5: (-0.22, 0.14, 0.42)}
    hand = hold_hand(puppet, 1, t, guard)
    wrist = hand.wrist + 0.010 * np.stack([sway(t, 0.8, 0.5), sway(t, 1.0, 0.1), sway(t, 0.6)], axis=-1)
    wrist = mix(wrist, [0.02, 1.49, 0.86], cross)
    turn = np.radians([10.0, 5.0, 8.0]) + np.radians(70) * np.outer(cross, [1, 0, 0])
    shrug = np.radians(np.stack([6 * cross, 14 * cross], axis=-1))
    return Hand(wrist, np.radians(-10 + 24 * cross), turn, shrug)
