"""Ten poses in which people stand when they are told to stand still, for any figure; with tracker offsets."""

from __future__ import annotations

import numpy as np

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure

X, Y, Z = np.eye(3)


def arms(flex: float = 0, out: float = 5, elbow: float = 8, turn: float = 0):
    """Angles of an arm in degrees: raised forward, raised aside, elbow bent, turned inwards about itself."""
    return flex, out, elbow, turn


def legs(flex: float = 0, out: float = 2, knee: float = 2):
    return flex, out, knee


HANG, STAND = arms(), legs()
POSES = {
    "arms hanging": {},
    "T-pose": {"l": arms(out=88, elbow=2), "r": arms(out=88, elbow=2)},
    "A-pose": {"l": arms(out=42, elbow=4), "r": arms(out=42, elbow=4)},
    "hands on hips": {"l": arms(-22, 40, 95, 70), "r": arms(-22, 40, 95, 70)},
    "one hand raised": {"r": arms(out=165, elbow=10)},
    "hands in front": {"l": arms(30, 5, 75, 20), "r": arms(30, 5, 75, 20)},
    "sitting": {
        "ll": legs(85, 6, 85),
        "rl": legs(85, 6, 85),
        "l": arms(20, 8, 55, 15),
        "r": arms(20, 8, 55, 15),
    },
    "feet apart": {"ll": legs(0, 18), "rl": legs(0, 18)},
    "feet together": {"ll": legs(0, -4), "rl": legs(0, -4)},
    "crouched": {
        "ll": legs(75, 12, 100),
        "rl": legs(75, 12, 100),
        "trunk": 30,
        "l": arms(25, 14, 25, 10),
        "r": arms(25, 14, 25, 10),
    },
    "turned": {"gaze": 35},
}


def stand(figure: Figure, name: str, yaw: float = 0.0):
    """Joints (11, 3) in the order of ``POINTS`` [m] and rotations (11, 4), facing ``yaw`` [rad]."""
    pose, roles = POSES[name], figure.roles
    turned = np.tile(rot.IDENTITY, (1, len(figure.skeleton), 1))
    lean = np.radians(pose.get("trunk", 0.0))
    turned[0, roles.pelvis] = rot.mul(rot.from_axis_angle(Y, yaw), rot.from_axis_angle(X, 0.5 * lean))
    turned[0, roles.spine[0]] = rot.from_axis_angle(X, 0.5 * lean)
    head = rot.from_axis_angle(Y, np.radians(pose.get("gaze", 0.0)))
    turned[0, roles.head] = head
    for k, (side, sign) in enumerate((("l", 1.0), ("r", -1.0))):
        flex, out, bend, turn = np.radians(pose.get(side, HANG))
        raised = rot.mul(rot.from_axis_angle(Z, sign * out), rot.from_axis_angle(X, -flex))
        turned[0, roles.shoulder[k]] = rot.mul(raised, rot.from_axis_angle(Y, -sign * turn))
        turned[0, roles.elbow[k]] = rot.from_axis_angle(X, -bend)
        flex, out, bend = np.radians(pose.get(f"{side}l", STAND))
        hip = rot.mul(rot.from_axis_angle(Z, sign * out), rot.from_axis_angle(X, -flex - 0.5 * lean))
        turned[0, roles.hip[k]] = hip
        turned[0, roles.knee[k]] = rot.from_axis_angle(X, bend)
    motion = figure.compute_motion(turned, np.array([[0.3, 1.0, -0.4]]), 60.0)
    places, world = motion.transforms
    carried = [j for j in roles.spine if j in figure.skeleton.path(0, roles.shoulder[0])]
    joints = [roles.pelvis, roles.head, *roles.wrist, *roles.ankle, carried[-1], *roles.elbow, *roles.knee]
    points = places[0, joints]
    points[1] += rot.mul_vec(world[0, roles.head], roles.head_offset)
    points[:, 1] -= points[4:6, 1].min() - 0.08
    return points, rot.mul(world[0, joints], rot.inv(figure.neutral[joints]))


def with_offsets(points, rotations, rng, size: float = 0.04):
    """Trackers off their joints: feet and headset forward, hands beyond the wrist, all of them anyhow."""
    usual = np.zeros((11, 3))
    usual[1] = [0.0, 0.06, 0.09]
    usual[2:4] = [0.0, -0.05, 0.02]
    usual[4:6] = [0.0, 0.02, 0.07]
    usual[0] = [0.0, 0.0, 0.06]
    usual[6] = [0.0, 0.0, 0.08]
    usual = usual + rng.uniform(-size, size, (11, 3)) * 0.5
    return points + rot.mul_vec(rotations, usual)
