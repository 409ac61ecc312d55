"""A walk that ends in a curve: planted feet, a rolling pelvis, and everything swinging against it.

Everything follows from the phase of the gait cycle (0 = left heel strikes) and from the path on the floor.
Feet are planted from strike to toe-off; the curves over the cycle have the shape known from gait analysis.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.samples.keyframes import curve, degrees, frame_times, smooth_step, sway
from sixpoint.samples.pose import swing_arm
from sixpoint.samples.puppet import Puppet
from sixpoint.samples.tracks import Foot, Hand, Trunk

Array = NDArray[np.float64]

CYCLE = 1.1  # [s]
SPEED = 1.3  # [m/s]
AHEAD = 0.37  # the striking ankle, in front of the pelvis [m]
STANCE = 0.58  # part of the cycle that a foot is on the floor

# Over the cycle of one leg: degrees the heel is up (+) or the toes are up (-), and height of the sole.
FOOT_PITCH = {0.0: -18, 0.09: 0, 0.36: 0, 0.50: 24, 0.58: 54, 0.69: 46, 0.86: -6, 0.95: -18}
SOLE_HEIGHT = {0.0: 0.0, 0.58: 0.0, 0.71: 0.05, 0.82: 0.035, 0.93: 0.03}


def walk(figure: Figure) -> Motion:
    """Six seconds of walking at 1.3 m/s; the path bends to the left over the last three metres."""
    t = frame_times(6.0)
    phase = t / CYCLE + 0.15
    position, heading = _path(SPEED * t)
    beat = 2 * np.pi * phase
    up = np.full_like(t, 0.993) - 0.018 * np.cos(2 * beat)
    aside = 0.022 * np.sin(beat - 0.3)
    left = np.stack([np.cos(heading), np.zeros_like(t), -np.sin(heading)], axis=-1)
    pelvis = position + aside[:, None] * left + up[:, None] * [0, 1, 0]
    turn = [heading - 0.11 * np.cos(beat), -0.01 + 0.02 * np.cos(2 * beat), 0.055 * np.sin(beat + 0.2)]
    spine = [0.01 - 0.02 * np.cos(2 * beat), 0.055 * np.sin(beat + 0.2), 0.26 * np.cos(beat - 0.1)]
    ahead = _path(SPEED * t + 0.7)[1]
    gaze = [ahead + 0.03 * sway(t, 0.2), 0.10 + 0.02 * sway(t, 0.31), 0.02 * np.sin(beat)]
    puppet = Puppet(figure, Trunk(pelvis, np.stack(turn, -1), np.stack(spine, -1), np.stack(gaze, -1)))
    hands = (_hand(puppet, 0, phase), _hand(puppet, 1, phase))
    return puppet.perform((_foot(0, phase), _foot(1, phase)), hands, "walk")


def _path(distance: Array) -> tuple[Array, Array]:
    """Point on the floor (F, 3) [m] and heading (F,) [rad] after walking a distance (F,) [m]."""
    fine = np.linspace(-2.0, 11.0, 2601)
    heading = np.radians(100) * smooth_step((fine - 3.6) / 4.0)
    step = fine[1] - fine[0]
    track = np.stack([np.sin(heading), np.zeros_like(fine), np.cos(heading)], axis=-1) * step
    points = np.cumsum(track, axis=0)
    points -= [np.interp(0.0, fine, points[:, k]) for k in range(3)]
    at = np.stack([np.interp(distance, fine, points[:, k]) for k in range(3)], axis=-1)
    return at, np.asarray(np.interp(distance, fine, heading), float)


def _foot(side: int, phase: Array) -> Foot:
    """Footprints on the path, and the step from one to the next."""
    own = phase - 0.5 * side
    cycle, within = np.floor(own), own % 1.0
    place, yaw = _footprint(side, cycle)
    next_place, next_yaw = _footprint(side, cycle + 1)
    step = smooth_step((within - STANCE) / (1.0 - STANCE))
    place = place + step[:, None] * (next_place - place)
    place[:, 1] = curve(SOLE_HEIGHT, within, 1.0)
    pitch = degrees(FOOT_PITCH, within, 1.0)
    turn = np.stack([yaw + step * (next_yaw - yaw), pitch, np.zeros_like(yaw)], axis=-1)
    return Foot(place, turn, *np.zeros((3, len(yaw))))


def _footprint(side: int, cycle: Array) -> tuple[Array, Array]:
    """Place (F, 3) and yaw (F,) of the footprints of the given cycles."""
    struck = (cycle + 0.5 * side - 0.15) * CYCLE * SPEED
    place, heading = _path(struck + AHEAD)
    sign = 1.0 - 2.0 * side
    left = np.stack([np.cos(heading), np.zeros_like(heading), -np.sin(heading)], axis=-1)
    return place + 0.075 * sign * left, heading + sign * np.radians(7)


def _hand(puppet: Puppet, side: int, phase: Array) -> Hand:
    """The arm swings with the other leg; the elbow gives more on the way forward."""
    forward = -np.cos(2 * np.pi * (phase - 0.5 * side) - 0.25)
    zero = np.zeros_like(forward)
    wrist = swing_arm(np.radians(4 + 20 * forward), np.radians(7 + zero), np.radians(20 + 10 * forward))
    turn = np.stack([np.radians(25 + 5 * forward), np.radians(8 + zero), np.radians(4 * forward)], axis=-1)
    return Hand(puppet.in_chest(side, wrist), zero, turn, np.zeros((len(zero), 2)))
