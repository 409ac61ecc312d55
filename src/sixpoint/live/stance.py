"""Where effectors are taken to be that nobody tracks, or that are lost for long.

Rules, in the order in which they are applied; lengths are those of the figure:

- The body faces where the pelvis does; without its rotation where the head looks, but the head may turn by
  20 degrees before the body follows; without that, across the lines of wrists and ankles.
- The pelvis hangs below the head by the trunk's length. A head that is lower than standing has leant forward:
  the pelvis goes back by a table of the head's height. Sitting, the trunk is upright.
- The head is above the pelvis as it was when both were last seen.
- Hands hang relaxed beside the pelvis, elbows a little bent.
- Feet stand below the hips and step (``stepping``), and leave the floor with a body that jumps; sitting, they
  are before the pelvis by the length of the thighs.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, exp, sin, sqrt
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.stature import stature_of
from sixpoint.calibration.model import ANKLE_HEIGHT
from sixpoint.errors import TargetError
from sixpoint.live.stepping import Stepping, wrap

Array = NDArray[np.float64]
Posture = Literal["standing", "sitting"]
POSTURES = ("standing", "sitting")

FREE = 0.35  # rad, the head turns so far before the body follows
FOLLOW = 0.3  # time constant with which it follows [s]
MOST = 1.2  # rad, largest angle between head and body
TURN = 8.0  # fastest turn of the body [rad/s]
LINE = 0.1  # shorter lines between wrists and ankles say nothing of the facing [m]
# How far the pelvis is behind its place when the head is lower than standing: the head's drop over its
# standing height, and the way back over the figure's height (``Figure.height``). Medians of upright frames
# with a foot on the floor of CMU 02, 03, 05, 09, 11, 16, 29 and 127 (5800 frames).
DROP = (0.0, 0.04, 0.12, 0.20, 0.28, 0.36)
BACK = (0.0, 0.02, 0.14, 0.20, 0.27, 0.31)
LEAST = 0.10  # height of the pelvis over the floor at least, of the stature
OVER = 0.45  # share of the trunk's lean by which the feet stand before the pelvis
JUMP = 1.02  # a pelvis above this share of its standing height lifts the feet
RELAXED = (0.02, 0.045, 0.06)  # relaxed wrists: out, up and forward of hanging straight, of the stature


def compute_yaw(q: Sequence[float] | Array) -> float:
    """Angle about the vertical of a rotation xyzw [rad]: its twist about Y, steady up to upside down."""
    return wrap(2.0 * atan2(q[1], q[3])) if abs(q[1]) + abs(q[3]) > 1e-9 else 0.0


def turned(yaw: float, v: Array) -> Array:
    """Vectors (..., 3) turned about the vertical by an angle [rad]."""
    c, s = cos(yaw), sin(yaw)
    out = np.array(v, float)
    out[..., 0] = c * v[..., 0] + s * v[..., 2]
    out[..., 2] = c * v[..., 2] - s * v[..., 0]
    return out


def about_up(yaw: float) -> Array:
    """(4,) rotation about the vertical by an angle [rad]."""
    return np.array([0.0, sin(0.5 * yaw), 0.0, cos(0.5 * yaw)])


class Stance:
    """A body of which only some points are known.

    Args:
        figure: Whose lengths count.
        posture: "standing" or "sitting".
        floor: Height of the floor [m].

    Attributes:
        yaw: Where the body faces [rad]; 0 is +Z.

    Raises:
        TargetError: There is no such posture.
    """

    def __init__(self, figure: Figure, posture: Posture = "standing", floor: float = 0.0) -> None:
        if posture not in POSTURES:
            raise TargetError(f"no posture {posture!r}; there are: {', '.join(POSTURES)}")
        roles, rest = figure.roles, figure.rest_positions
        pelvis = rest[roles.pelvis]
        self.posture, self.floor, self.height = posture, floor, figure.height
        self.stature = stature_of(figure)
        self.ankle = ANKLE_HEIGHT * self.stature
        self._head = rest[roles.head] + figure.head_offset - pelvis
        self._hips = rest[list(roles.hip)] - pelvis
        self._ankles = rest[list(roles.ankle)] - pelvis
        out, up, forward = np.array(RELAXED) * self.stature
        self._wrists = rest[list(roles.wrist)] - pelvis + [[out, up, forward], [-out, up, forward]]
        self._thigh, self._calf = (
            float(np.linalg.norm(figure.offset_between(a, b)))
            for a, b in ((roles.hip[0], roles.knee[0]), (roles.knee[0], roles.ankle[0]))
        )
        self._standing = self.ankle - float(self._ankles[:, 1].mean())  # pelvis over the floor
        self.yaw = 0.0
        self._began = False
        self._lines = 0  # how many lines told the facing; 3 where rotations did
        self._chord = self._head  # from pelvis to head in the body's frame, as last seen
        self._steps = Stepping(self.stature)

    def face(self, dt: float, points: Array, rotations: Array) -> float:
        """Find where the body faces, from known points (6, 3) and rotations (6, 4); NaN where unknown."""
        pelvis, head = rotations[0], rotations[1]
        if pelvis[3] == pelvis[3]:
            change, self._lines = wrap(compute_yaw(pelvis) - self.yaw), 3
        elif head[3] == head[3]:
            self._lines = 3
            off = wrap(compute_yaw(head) - self.yaw)
            beyond = off - min(max(off, -FREE), FREE)
            followed = beyond * (1.0 - exp(-dt / FOLLOW))
            change = followed + (off - followed - min(max(off - followed, -MOST), MOST))
            change = change if self._began else off
        else:
            lines = [d for d in (points[2] - points[3], points[4] - points[5]) if d[0] == d[0]]
            line = np.sum(lines, axis=0) if lines else np.zeros(3)
            if len(lines) < self._lines or line[0] ** 2 + line[2] ** 2 < LINE**2:
                return self.yaw  # fewer than before: what is lost does not turn the body
            self._lines = len(lines)
            off = wrap(atan2(-line[2], line[0]) - self.yaw)
            change = off * (1.0 - exp(-dt / FOLLOW)) if self._began else off
        if self._began:
            change = min(max(change, -TURN * dt), TURN * dt)
        self._began = True
        self.yaw = wrap(self.yaw + change)
        return self.yaw

    def remember(self, pelvis: Array, head: Array) -> None:
        """Both ends of the trunk are seen: remember how the head is above the pelvis."""
        self._chord = turned(-self.yaw, head - pelvis)

    def find_head(self, pelvis: Array) -> Array:
        """The head (3,) of a known pelvis."""
        return np.asarray(pelvis + turned(self.yaw, self._chord))

    def find_pelvis(self, head: Array) -> Array:
        """The pelvis (3,) of a known head."""
        up = float(np.linalg.norm(self._head))
        back = 0.0
        if self.posture == "standing":
            stands = self._standing + float(self._head[1])
            drop = 1.0 - (float(head[1]) - self.floor) / stands
            back = min(float(np.interp(drop, DROP, BACK)) * self.height, 0.95 * up)
        chord = np.array([0.0, sqrt(up * up - back * back), float(self._head[2]) + back])
        pelvis = head - turned(self.yaw, chord)
        pelvis[1] = max(pelvis[1], min(self.floor + LEAST * self.stature, head[1]))
        return np.asarray(pelvis)

    def nowhere(self) -> Array:
        """The pelvis (3,) where nothing was ever seen: standing at the origin."""
        return np.array([0.0, self.floor + self._standing, 0.0])

    def find_limbs(self, dt: float, pelvis: Array, head: Array, ankles: Array) -> tuple[Array, Array]:
        """Wrists and ankles of a known trunk.

        Args:
            dt: Time since the last call [s].
            pelvis: (3,) [m].
            head: (3,) [m].
            ankles: (2, 3) where they are seen, NaN where not; steps begin there.

        Returns:
            Positions (4, 3) [m] and rotations (4, 4): left and right wrist, left and right ankle.
        """
        points, turns = np.empty((4, 3)), np.empty((4, 4))
        points[:2] = pelvis + turned(self.yaw, self._wrists)
        turns[:2] = about_up(self.yaw)
        if self.posture == "sitting":
            self._sit(pelvis, points, turns)
            return points, turns
        # A trunk that leans has its weight before the pelvis, and so its feet.
        lean = OVER * (head - pelvis - turned(self.yaw, self._head))
        places = (pelvis + lean + turned(self.yaw, self._ankles))[:, [0, 2]]
        for k in (0, 1):
            if ankles[k, 0] == ankles[k, 0]:
                self._steps.stand(k, (float(ankles[k, 0]), float(ankles[k, 2])), self.yaw)
        points[2:], yaws = self._steps.update(dt, places, self.yaw)
        above = max(0.0, float(pelvis[1]) - self.floor - JUMP * self._standing)
        points[2:, 1] += self.floor + self.ankle + above
        for k in (0, 1):
            turns[2 + k] = about_up(yaws[k])
        return points, turns

    def _sit(self, pelvis: Array, points: Array, turns: Array) -> None:
        """Feet flat before a seat; shanks are upright where the seat's height allows."""
        hips = pelvis + turned(self.yaw, self._hips)
        down = np.minimum(self._calf, np.maximum(hips[:, 1] - self.floor - self.ankle, 0.1 * self._calf))
        points[2:] = hips + turned(self.yaw, np.array([0.0, 0.0, 0.95 * self._thigh]))
        points[2:, 1] = hips[:, 1] - down
        turns[2:] = about_up(self.yaw)
