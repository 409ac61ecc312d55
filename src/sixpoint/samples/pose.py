"""Small pieces of authored posture that several samples share: arm directions, hands, feet on marks.

Arms are in arm lengths from the shoulder, x away from the body; feet in metres on the floor.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sixpoint.samples.keyframes import Keys, curve, degrees, mix
from sixpoint.samples.puppet import Puppet
from sixpoint.samples.tracks import Foot, Hand, compute_ankle

Array = NDArray[np.float64]

UPPER = 0.529  # part of the arm's length above the elbow


def swing_arm(flexion: Array, abduction: Array, elbow: Array) -> Array:
    """Where the wrist is, for angles of shoulder and elbow (F,) [rad]; (F, 3) in arm lengths."""
    upper = np.stack([np.sin(abduction), -np.cos(abduction) * np.cos(flexion), np.sin(flexion)], axis=-1)
    bent = flexion + elbow
    lower = np.stack([0.5 * np.sin(abduction), -np.cos(bent), np.sin(bent)], axis=-1)
    lower /= np.linalg.norm(lower, axis=-1, keepdims=True)
    upper /= np.linalg.norm(upper, axis=-1, keepdims=True)
    return np.asarray(UPPER * upper + (1.0 - UPPER) * lower, float)


def hold_hand(puppet: Puppet, side: int, t: Array, keys: Keys, **more: Keys) -> Hand:
    """A hand whose wrist goes through points given from the shoulder, in arm lengths."""
    return world_hand(t, chest_points(puppet, side, t, keys), **more)


def world_hand(
    t: Array, wrist: Array, *, swivel: Keys | None = None, turn: Keys | None = None, shrug: Keys | None = None
) -> Hand:
    """A hand with a wrist given in the world; its other keys are in degrees and zero by default."""
    return Hand(
        wrist,
        degrees(swivel or {0: 0}, t),
        degrees(turn or {0: (0, 0, 0)}, t),
        degrees(shrug or {0: (0, 0)}, t),
    )


def step_foot(t: Array, place: Keys, turn: Keys, swivel: Keys | None = None) -> Foot:
    """A foot that goes through places [m] and turns (yaw, pitch, roll) [deg]."""
    zero = np.zeros_like(t)
    return Foot(curve(place, t), degrees(turn, t), degrees(swivel or {0: 0}, t), zero, zero)


def lift_foot(puppet: Puppet, side: int, t: Array, foot: Foot, air: Keys, ankle: Keys, point: Keys) -> Foot:
    """Let a foot leave the ground; its ankle then goes through points given from the hip.

    Args:
        puppet: Whose foot.
        side: 0 = left, 1 = right.
        t: (F,) times [s].
        foot: What the foot does on the ground.
        air: 0 on the ground, 1 in the air.
        ankle: Ankle from the hip in the pelvis' frame [m], x away from the body.
        point: How far the toes are pointed [deg].
    """
    weight = curve(air, t)
    yaw = foot.turn[:, 0] + weight * (puppet.trunk.turn[:, 0] - foot.turn[:, 0])
    turn = np.stack([yaw, foot.turn[:, 1] * (1 - weight), foot.turn[:, 2] * (1 - weight)], axis=-1)
    grounded = Foot(foot.place, turn, foot.swivel, weight, degrees(point, t))
    hanging = puppet.in_pelvis(side, curve(ankle, t)) - compute_ankle(grounded) + foot.place
    return replace(grounded, place=mix(foot.place, hanging, weight))


def chest_points(puppet: Puppet, side: int, t: Array, keys: Keys) -> Array:
    """World points (F, 3) for keys given from the shoulder, in arm lengths."""
    return puppet.in_chest(side, curve(keys, t))
