"""VMC protocol, out: a posed figure as a performer says it to a marionette, and devices as an assistant does.

Reference: VMC Protocol specification 2.9, https://protocol.vmc.info/english.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sixpoint.body.figure import Figure
from sixpoint.body.human_bones import BonePoser
from sixpoint.body.motion import Pose
from sixpoint.live import vmc
from sixpoint.live.osc import Message, make_message
from sixpoint.live.osc_write import encode, join_bundles, pad_string
from sixpoint.live.readings import LOST, NO_ROTATION, Reading
from sixpoint.live.unity import mirror_position, mirror_rotation

MAX_BUNDLE = 1396
"""Bundles stay below 1400 bytes, so that no network splits them."""

_ROOT_POSE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class PerformerWriter:
    """Writes poses of one figure as VMC bundles.

    The root stands still at the origin; all movement is in the hips. Positions of the other bones are the
    figure's own; most receivers ignore them and keep their avatar's.

    Args:
        figure: The figure.
        scale: Size of the avatar over the figure's: multiplies all positions.
        upper_chest: Send UpperChest too; see ``find_bones``.

    Attributes:
        bones: Names of the bones that are sent, parents first.
    """

    def __init__(self, figure: Figure, *, scale: float = 1.0, upper_chest: bool = False) -> None:
        self._poser = BonePoser(figure, upper_chest)
        self._scale = scale
        self.bones = tuple(self._poser.bones)
        head = pad_string(vmc.BONE) + pad_string(",sfffffff")
        self._heads = [head + pad_string(name) for name in self.bones]
        self._root = encode(make_message(vmc.ROOT, "root", *_ROOT_POSE))
        self._values = np.empty((len(self.bones), 7), ">f4")
        self._values[:, :3] = self._poser.offsets * [-scale, scale, scale]

    def write_pose(
        self,
        pose: Pose,
        time: float,
        *,
        tracking: bool = True,
        passed: Iterable[Reading] = (),
        thru: Iterable[Message] = (),
    ) -> list[bytes]:
        """Datagrams of one frame, each below 1400 bytes.

        Args:
            pose: A pose on the figure's rig.
            time: The sender's clock [s].
            tracking: Whether the trackers are there.
            passed: Bones and blend shapes from elsewhere to be sent along; bones of the figure itself, and
                whatever is neither bone nor blend shape, are left out.
            thru: Messages to be passed on as they are.
        """
        values = self._values.copy()
        values[0, :3] = self._poser.compute_hips(pose) * [-self._scale, self._scale, self._scale]
        values[:, 3:] = self._poser.compute_rotations(pose) * [1.0, -1.0, -1.0, 1.0]
        data = values.tobytes()
        parts = [
            encode(make_message(vmc.AVAILABLE, 1, 3, 0, int(tracking))),  # loaded, calibrated, normal mode
            encode(make_message(vmc.TIME, float(time))),
            self._root,
            *(head + data[28 * k : 28 * k + 28] for k, head in enumerate(self._heads)),
        ]
        parts += self._write_passed(passed)
        parts += [encode(message) for message in thru]
        return join_bundles(parts, MAX_BUNDLE)

    def _write_passed(self, passed: Iterable[Reading]) -> list[bytes]:
        bones, blends = [], []
        for reading in passed:
            if reading.kind == "bone" and reading.name not in self._poser.bones and not reading.lost:
                bones.append(encode(_pose_message(vmc.BONE, reading)))
            elif reading.kind == "blend":
                blends.append(encode(make_message(vmc.BLEND, reading.name, float(reading.value))))
        return [*bones, *blends, encode(make_message(vmc.APPLY))] if blends else bones


def write_devices(readings: Iterable[Reading], time: float | None = None) -> list[bytes]:
    """Trackers, headsets and controllers as an assistant sends them, in bundles below 1400 bytes.

    Args:
        readings: Devices; whatever is none is left out. What is lost or not said is sent as NaN.
        time: The sender's clock [s], if it is to be sent.
    """
    address = {kind: address for address, kind in vmc.DEVICES.items()}
    parts = [] if time is None else [encode(make_message(vmc.TIME, float(time)))]
    for reading in readings:
        if reading.kind in address:
            where = address[reading.kind] + ("/Local" if reading.raw else "")
            parts.append(encode(_pose_message(where, reading)))
    return join_bundles(parts, MAX_BUNDLE)


def _pose_message(address: str, reading: Reading) -> Message:
    position = mirror_position(reading.position or LOST)
    rotation = mirror_rotation(reading.rotation or NO_ROTATION)
    return make_message(address, reading.name, *map(float, position), *map(float, rotation))
