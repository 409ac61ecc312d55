"""VRChat's OSC trackers, in and out: world positions [m] and Euler angles [deg] in Unity's space.

In: ``/tracking/trackers/{1..8,head}/{position,rotation}``, three floats each, in one datagram or in two: what
a packet does not say stays None. Also ``/tracking/vrsystem/{head,leftwrist,rightwrist}/pose``, six floats, by
which VRChat itself says where headset and controllers are. Out: the trackers of a posed figure, numbered as
other senders do.

Reference: VRChat, "OSC Trackers", https://docs.vrchat.com/docs/osc-trackers.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.human_bones import find_bones
from sixpoint.body.motion import Pose
from sixpoint.errors import PacketError, TargetError, listed
from sixpoint.live import osc
from sixpoint.live.osc import make_message
from sixpoint.live.osc_write import encode, join_bundles
from sixpoint.live.readings import NO_ROTATION, Kind, Packet, Quaternion, Reading, as_position
from sixpoint.live.unity import from_unity_euler, mirror_position, to_unity_euler
from sixpoint.live.vmc import numbers_of
from sixpoint.live.vmc_write import MAX_BUNDLE

PREFIX = "/tracking/trackers/"
TRACKERS = ("pelvis", "l_ankle", "r_ankle", "l_knee", "r_knee", "chest", "l_elbow", "r_elbow")
"""What trackers 1 to 8 are on when sixpoint sends them."""
_NAMES = (*map(str, range(1, 9)), "head")
_SYSTEM: dict[str, tuple[Kind, str]] = {
    "/tracking/vrsystem/head/pose": ("hmd", "head"),
    "/tracking/vrsystem/leftwrist/pose": ("controller", "l_wrist"),
    "/tracking/vrsystem/rightwrist/pose": ("controller", "r_wrist"),
}


def read_packet(data: bytes) -> Packet:
    """Read one datagram.

    Trackers are named "1" to "8" and "head", the head being of kind "hmd"; which is worn where is not said.

    Raises:
        OscError: The datagram is not OSC; nothing of it is used.
    """
    packet = osc.decode(data)
    found: dict[str, Reading] = {}
    refused: list[str] = []
    unused = 0
    for address, _, args in osc.messages_in(packet):
        try:
            if address in _SYSTEM:
                kind, name = _SYSTEM[address]
                x, y, z, *turn = numbers_of(args, 0, 6)
                position = mirror_position(as_position(x, y, z))
                found[f"system {name}"] = Reading(kind, name, position, _as_turn(turn))
            elif address.startswith(PREFIX):
                name, _, part = address[len(PREFIX) :].partition("/")
                if name not in _NAMES or part not in ("position", "rotation"):
                    raise PacketError(f"expected position or rotation of {listed(_NAMES)}")
                found[name] = _read_part(name, part, args).after(found.get(name))
            else:
                unused += 1
        except PacketError as error:
            refused.append(f"{ascii(address)[:80]}: {error}")
    time = packet.seconds if isinstance(packet, osc.Bundle) else None
    return Packet(tuple(found.values()), time, unused=unused, refused=tuple(refused))


def _read_part(name: str, part: str, args: Sequence[Any]) -> Reading:
    kind: Kind = "hmd" if name == "head" else "tracker"
    x, y, z = numbers_of(args, 0, 3)
    if part == "position":
        return Reading(kind, name, position=mirror_position(as_position(x, y, z)))
    return Reading(kind, name, rotation=_as_turn((x, y, z)))


def _as_turn(degrees: Sequence[float]) -> Quaternion:
    """Unity's Euler angles as a rotation; beyond a thousand turns they say nothing."""
    if not all(abs(angle) <= 360_000.0 for angle in degrees):
        return NO_ROTATION
    x, y, z, w = from_unity_euler(degrees).tolist()
    return (x, y, z, w)


class TrackerWriter:
    """Writes poses of one figure as VRChat's trackers, one datagram a frame.

    The head goes out as well: VRChat lays the sender's space over its own by it. Rotations are those of the
    anatomical frames, zero in the neutral pose facing Unity's Z.

    Args:
        figure: The figure.
        trackers: Which of ``TRACKERS`` to send; fewer let VRChat decide more.
        scale: Multiplies positions: the user's size over the figure's.

    Raises:
        TargetError: There is no such tracker.
    """

    def __init__(self, figure: Figure, trackers: Iterable[str] = TRACKERS, *, scale: float = 1.0) -> None:
        wanted = tuple(trackers)
        unknown = [name for name in wanted if name not in TRACKERS]
        if unknown:
            raise TargetError(f"no trackers {listed(unknown)}; trackers: {listed(TRACKERS)}")
        roles = figure.roles
        bones = find_bones(figure)
        chest = next(bones[name] for name in ("Chest", "Spine", "Hips") if name in bones)
        joints = roles.named() | {"chest": chest.joint}
        self._figure = figure
        self._joints = [*(joints[name] for name in wanted), roles.head]
        self._places = [*(PREFIX + str(TRACKERS.index(name) + 1) for name in wanted), PREFIX + "head"]
        self._scale = scale

    def write_pose(self, pose: Pose) -> list[bytes]:
        """Datagrams of one frame, each below 1400 bytes: place and turn of every tracker, the head last."""
        positions, world = pose.compute_transforms()
        points = positions[self._joints]
        points[-1] += rot.mul_vec(world[self._joints[-1]], self._figure.roles.head_offset)
        turned = rot.mul(world[self._joints], rot.inv(self._figure.neutral[self._joints]))
        points = points * [-self._scale, self._scale, self._scale]
        parts: list[bytes] = []
        for place, point, angles in zip(
            self._places, points.tolist(), to_unity_euler(turned).tolist(), strict=True
        ):
            parts.append(encode(make_message(f"{place}/position", *point)))
            parts.append(encode(make_message(f"{place}/rotation", *angles)))
        return join_bundles(parts, MAX_BUNDLE)


def write_trackers(readings: Iterable[Reading]) -> list[bytes]:
    """Trackers "1" to "8" and the head as any sender says them; what is lost or not said is left out."""
    parts: list[bytes] = []
    for reading in readings:
        if reading.name not in _NAMES:
            continue
        if reading.position is not None and not reading.lost:
            place = f"{PREFIX}{reading.name}/position"
            parts.append(encode(make_message(place, *map(float, mirror_position(reading.position)))))
        if reading.rotation is not None and np.isfinite(reading.rotation[0]):
            angles = to_unity_euler(reading.rotation).tolist()
            parts.append(encode(make_message(f"{PREFIX}{reading.name}/rotation", *angles)))
    return join_bundles(parts, MAX_BUNDLE)
