"""Feet that nobody tracks: they stand where they are until the body has left them, then step.

A foot stands still on the floor. It steps, one foot at a time, where the place under its hip is too far away
or turned too far; both go where the body is farther still, as in a jump. A step leads in the direction the
body moves, so that walking does not leave the feet behind.
"""

from __future__ import annotations

from math import exp, hypot, pi, sin
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

STRIDE = 0.07  # how far a foot may be from its place before it steps, of the stature
FAR = 4.0  # strides from which on both feet go at once
TURNED = 0.6  # rad, how far the body may turn over a standing foot
DURATION = 0.25  # of a step [s]
LIFT = 0.04  # of a step, of the stature
LEAD = 0.15  # a step goes where the place will be so much later [s]
MEMORY = 0.1  # of the body's velocity [s]
FASTEST = 4.0  # of that velocity, beyond it is a tracker that jumped [m/s]


def wrap(angle: float) -> float:
    """The same angle in [-pi, pi) [rad]."""
    return (angle + pi) % (2.0 * pi) - pi


def ease(t: ArrayLike) -> Any:
    """From 0 to 1 while t does, with slope 0 at both ends and 1.5 at most; numbers or arrays."""
    t = np.minimum(np.maximum(t, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


class _Foot:
    """One foot: where it stands, or how far its step is."""

    def __init__(self, place: tuple[float, float], yaw: float) -> None:
        self.at, self.start = place, place
        self.yaw, self.yaw_start = yaw, yaw
        self.progress = 1.0

    @property
    def swinging(self) -> bool:
        return self.progress < 1.0

    def begin(self) -> None:
        self.start, self.yaw_start, self.progress = self.at, self.yaw, 0.0

    def swing(self, dt: float, goal: tuple[float, float], yaw: float) -> None:
        self.progress = min(self.progress + dt / DURATION, 1.0)
        s = float(ease(self.progress))
        (x, z), (a, b) = self.start, goal
        self.at = (x + s * (a - x), z + s * (b - z))
        self.yaw = self.yaw_start + s * wrap(yaw - self.yaw_start)


class Stepping:
    """The two feet.

    Args:
        stature: Of the figure [m].
    """

    def __init__(self, stature: float) -> None:
        self.stature = stature
        self._feet: list[_Foot] = []
        self._places: Array | None = None
        self._velocity = np.zeros(2)

    def stand(self, foot: int, place: tuple[float, float], yaw: float) -> None:
        """Put a foot (0 left, 1 right) where it is seen: x and z [m]."""
        if self._feet:
            self._feet[foot] = _Foot(place, yaw)

    def update(self, dt: float, places: Array, yaw: float) -> tuple[Array, tuple[float, float]]:
        """Let the feet follow the body.

        Args:
            dt: Time since the last call [s].
            places: (2, 2) x and z of the places below the hips [m].
            yaw: Where the body faces [rad].

        Returns:
            (2, 3) x, height over standing, z of the ankles [m]; and the yaw of each foot.
        """
        if self._places is None:
            self._feet = [_Foot((float(x), float(z)), yaw) for x, z in places]
            self._places = places.copy()
        if dt > 0.0:
            moved = (places - self._places).mean(axis=0) / dt
            moved *= min(1.0, FASTEST / max(hypot(*moved.tolist()), 1e-9))
            self._velocity += (1.0 - exp(-dt / MEMORY)) * (moved - self._velocity)
            self._places = places.copy()
        goals = places + LEAD * self._velocity
        self._begin_steps(places, yaw)
        out = np.empty((2, 3))
        for k, foot in enumerate(self._feet):
            if foot.swinging:
                foot.swing(dt, (float(goals[k, 0]), float(goals[k, 1])), yaw)
            height = LIFT * self.stature * sin(pi * foot.progress) if foot.swinging else 0.0
            out[k] = foot.at[0], height, foot.at[1]
        return out, (self._feet[0].yaw, self._feet[1].yaw)

    def _begin_steps(self, places: Array, yaw: float) -> None:
        wishes = []
        for foot, place in zip(self._feet, places, strict=True):
            off = hypot(place[0] - foot.at[0], place[1] - foot.at[1]) / (STRIDE * self.stature)
            wishes.append(max(off, abs(wrap(yaw - foot.yaw)) / TURNED))
        first = 0 if wishes[0] >= wishes[1] else 1
        free = not any(foot.swinging for foot in self._feet)
        if free and wishes[first] > 1.0:
            self._feet[first].begin()
        for foot, wish in zip(self._feet, wishes, strict=True):
            if wish > FAR and not foot.swinging:
                foot.begin()
