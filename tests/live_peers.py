"""What the tests of live protocols share: packets by python-osc, and poses known beforehand."""

from __future__ import annotations

import numpy as np
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder
from scipy.spatial.transform import Rotation

from sixpoint import Figure, Pose


def peer_message(address, args):
    """A message as python-osc builds it."""
    builder = OscMessageBuilder(address)
    for arg in args:
        builder.add_arg(arg)
    return builder.build()


def peer_bundle(*messages):
    """A datagram of (address, arguments) as python-osc builds it."""
    bundle = OscBundleBuilder(IMMEDIATELY)
    for address, args in messages:
        bundle.add_content(peer_message(address, args))
    return bundle.build().dgram


def turned_pose(figure: Figure, turns: dict) -> Pose:
    """The neutral pose with some roles turned in anatomical frames: role -> (axis, degrees) or rotation."""
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (1, len(figure.skeleton), 1))
    for role, turn in turns.items():
        if not isinstance(turn, Rotation):
            turn = Rotation.from_rotvec(np.radians(turn[1]) * np.asarray(turn[0], float))
        rotations[0, figure.roles.named()[role]] = turn.as_quat()
    return figure.compute_motion(rotations, np.array([[0.0, 1.0, 0.0]]), 60.0).pose(0)
