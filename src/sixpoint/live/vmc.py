"""VMC protocol, in: devices, bones, blend shapes and time from performers and assistants.

As the specification wants it, unknown addresses and surplus arguments are ignored, and a message with missing
or mistyped arguments is dropped alone. Integers pass for floats, since scripts send 0 for 0.0.

Reference: VMC Protocol specification 2.9, https://protocol.vmc.info/english.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from sixpoint.body.human_bones import HUMAN_BONES
from sixpoint.errors import PacketError
from sixpoint.live import osc
from sixpoint.live.readings import Kind, Packet, Reading, as_name, as_position, as_rotation
from sixpoint.live.unity import mirror_position, mirror_rotation

ROOT = "/VMC/Ext/Root/Pos"
BONE = "/VMC/Ext/Bone/Pos"
BLEND = "/VMC/Ext/Blend/Val"
APPLY = "/VMC/Ext/Blend/Apply"
AVAILABLE = "/VMC/Ext/OK"
TIME = "/VMC/Ext/T"
THRU = "/VMC/Thru/"
DEVICES: dict[str, Kind] = {
    "/VMC/Ext/Hmd/Pos": "hmd",
    "/VMC/Ext/Con/Pos": "controller",
    "/VMC/Ext/Tra/Pos": "tracker",
}
"""Address -> kind of device; with ``/Local`` behind it the pose is in the device's own scale."""

_POSES: dict[str, tuple[Kind, bool]] = {
    **{address: (kind, False) for address, kind in DEVICES.items()},
    **{address + "/Local": (kind, True) for address, kind in DEVICES.items()},
    ROOT: ("root", False),
    BONE: ("bone", False),
}
_BONES = frozenset(HUMAN_BONES)


def read_packet(data: bytes) -> Packet:
    """Read one datagram.

    A device that comes both in the avatar's scale and in its own (``/Local``) is read in its own.

    Raises:
        OscError: The datagram is not OSC; nothing of it is used.
    """
    packet = osc.decode(data)
    time: float | None = None  # "/VMC/Ext/T" alone: bundles' time tags are another clock
    readings: list[Reading] = []
    thru: list[osc.Message] = []
    refused: list[str] = []
    available: bool | None = None
    unused = 0
    for message in osc.messages_in(packet):
        address, _, args = message
        try:
            if address in _POSES:
                readings.append(_read_pose(*_POSES[address], args))
            elif address == BLEND:
                value = numbers_of(args, 1, 1)[0]
                if not math.isfinite(value):
                    raise PacketError(f"the value {value} is not finite")
                readings.append(Reading("blend", as_name(args[0]), value=value))
            elif address == TIME:
                seconds = numbers_of(args, 0, 1)[0]
                time = seconds if math.isfinite(seconds) else time
            elif address == AVAILABLE:
                available = bool(numbers_of(args, 0, 1)[0])
            elif address.startswith(THRU):
                thru.append(message)
            elif address != APPLY:
                unused += 1
        except PacketError as error:
            refused.append(f"{address}: {error}")
    readings, double = _in_own_scale(readings)
    return Packet(tuple(readings), time, available, tuple(thru), unused + double, tuple(refused))


def numbers_of(args: Sequence[Any], names: int, count: int) -> Sequence[float]:
    """The numbers after the leading names of a message; what follows them is ignored.

    Args:
        args: All arguments.
        names: How many strings come first.
        count: How many numbers must follow.

    Raises:
        PacketError: Arguments are missing, or of other types.
    """
    values = args[names : names + count]
    if len(values) < count:
        raise PacketError(f"{len(args)} arguments, expected {names + count}")
    if not all(type(value) is float or type(value) is int for value in values):
        types = ", ".join(type(value).__name__ for value in args[:12])
        raise PacketError(f"types {types}, expected {count} numbers after {names} names")
    if not all(type(name) is str for name in args[:names]):
        raise PacketError(f"type {type(args[0]).__name__}, expected a name first")
    return values


def _read_pose(kind: Kind, raw: bool, args: Sequence[Any]) -> Reading:
    x, y, z, *turn = numbers_of(args, 1, 7)
    name = as_name(args[0])
    if kind == "bone" and name not in _BONES:
        raise PacketError(f"{name!r} is none of Unity's {len(HUMAN_BONES)} human bones")
    position, rotation = as_position(x, y, z), as_rotation(*turn)
    return Reading(kind, name, mirror_position(position), mirror_rotation(rotation), raw=raw)


def _in_own_scale(readings: list[Reading]) -> tuple[list[Reading], int]:
    """Without the devices that come in their own scale as well, and how many these were."""
    raw = {(reading.kind, reading.name) for reading in readings if reading.raw}
    if not raw:
        return readings, 0
    kept = [r for r in readings if r.raw or (r.kind, r.name) not in raw]
    return kept, len(readings) - len(kept)
