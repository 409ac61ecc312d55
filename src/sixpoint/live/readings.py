"""What arrives, whatever the protocol: one ``Packet`` of ``Reading``s per datagram, in sixpoint's space.

Metres, right-handed, Y up, Z forward, X to the figure's left; quaternions xyzw. What is None was not said in
this packet; what is NaN is lost: numbers that are not finite or farther than 10 km away, quaternions without
length. So a tracker that sends NaN is a lost tracker, not an error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from sixpoint.errors import PacketError
from sixpoint.live.osc import Message

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Kind = Literal["tracker", "hmd", "controller", "root", "bone", "blend"]

LOST: Vector = (math.nan, math.nan, math.nan)
"""Position of a tracker that is lost."""
NO_ROTATION: Quaternion = (math.nan, math.nan, math.nan, math.nan)
"""Rotation where the sender has none."""
FARTHEST = 1e4
"""Coordinates beyond this [m] are nonsense: the tracker is lost."""
LONGEST_NAME = 64
"""Names are at most so long [characters], and printable."""


@dataclass(frozen=True, slots=True)
class Reading:
    """What one datagram says of one thing.

    Attributes:
        kind: "tracker", "hmd" and "controller" are devices; "root" and "bone" belong to an avatar (local
            rotations from the T-pose, local positions); "blend" is a blend shape.
        name: Serial of the device, Unity's name of the bone, name of the blend shape.
        position: (3,) [m]; ``LOST`` where lost, None where not said.
        rotation: (4,) world<-device, or parent<-bone; ``NO_ROTATION`` where lost, None where not said.
        value: Of a blend shape, usually 0 to 1.
        raw: A device in its own scale, not in the avatar's (``/Local`` of VMC).
    """

    kind: Kind
    name: str
    position: Vector | None = None
    rotation: Quaternion | None = None
    value: float = 0.0
    raw: bool = False

    @property
    def lost(self) -> bool:
        """Whether the sender says that it does not know where the thing is."""
        return self.position is not None and math.isnan(self.position[0])

    def after(self, earlier: Reading | None) -> Reading:
        """This reading, with what it does not say from an earlier one of the same thing."""
        if earlier is None or (self.position is not None and self.rotation is not None):
            return self
        position = earlier.position if self.position is None else self.position
        rotation = earlier.rotation if self.rotation is None else self.rotation
        return replace(self, position=position, rotation=rotation)


@dataclass(frozen=True, slots=True)
class Packet:
    """One datagram.

    Attributes:
        readings: What it says, in its order.
        time: The sender's clock [s], from whatever origin; None where it does not say.
        available: Whether a VMC sender says that its avatar is there (``/VMC/Ext/OK``).
        thru: Messages to be passed on as they are (``/VMC/Thru/...``).
        unused: Number of messages that are nothing to us.
        refused: One line for each message that was damaged, and dropped alone.
    """

    readings: tuple[Reading, ...]
    time: float | None = None
    available: bool | None = None
    thru: tuple[Message, ...] = ()
    unused: int = 0
    refused: tuple[str, ...] = ()


def as_position(x: float, y: float, z: float) -> Vector:
    """A position, or ``LOST`` where it is none [m]."""
    near = abs(x) <= FARTHEST and abs(y) <= FARTHEST and abs(z) <= FARTHEST  # False for NaN
    return (x, y, z) if near else LOST


def as_rotation(x: float, y: float, z: float, w: float) -> Quaternion:
    """A unit quaternion, or ``NO_ROTATION`` where it is none; what is unit in float32 stays as it is."""
    square = x * x + y * y + z * z + w * w
    if abs(square - 1.0) <= 1e-6:
        return (x, y, z, w)
    if not 1e-6 <= square <= 1e6:
        return NO_ROTATION
    scale = 1.0 / math.sqrt(square)
    return (scale * x, scale * y, scale * z, scale * w)


def as_name(name: str) -> str:
    """A name as it may be printed and kept.

    Raises:
        PacketError: It is empty, too long, or would write to the terminal something else than itself.
    """
    if not 0 < len(name) <= LONGEST_NAME or not name.isprintable():
        raise PacketError(f"the name {name[:20]!r} is not 1 to {LONGEST_NAME} printable characters")
    return name
