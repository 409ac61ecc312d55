"""Trackers on chest, elbows and knees lead trunk and swivel angles; the six effectors are met as ever.

A solver that takes a pose to start from (``start=`` of SIK+) is asked twice: its first answer is turned so
that the chest is where its tracker says, elbows and knees point to theirs, and the second starts there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Pose
from sixpoint.live.tracking import Tracked

Array = NDArray[np.float64]

X = np.array([1.0, 0.0, 0.0])
MOST = 1.2  # rad, a chest is not turned farther from where six points put it
CLEAR = 0.03  # an elbow nearer to its limb's line says nothing of the swivel angle [m]


class Starting(Protocol):
    """A solver that takes rotations and a pose to start from, as ``SequentialIKPlus``."""

    figure: Figure
    rotations: tuple[str, ...]

    def solve(self, points: Array, previous: Any, dt: float, **options: Any) -> Any:
        """Pose the figure for one frame."""


def solve_guided(solver: Starting, tracked: Tracked, previous: Any = None, dt: float = 1 / 60) -> Any:
    """Solve one frame of trackers, led by those of chest, elbows and knees if there are any.

    Args:
        solver: ``SequentialIKPlus`` or one like it.
        tracked: The frame; its known rotations are used as far as the solver was made for them.
        previous: The solution of the frame before, if any.
        dt: Time since that frame [s].

    Returns:
        The solver's solution; the state in it is that of this frame.
    """
    options: dict[str, Any] = {"rotations": tracked.known_rotations} if solver.rotations else {}
    solution = solver.solve(tracked.positions, previous, dt, **options)
    if not (tracked.weights > 0.0).any():
        return solution
    start = lead_pose(solver.figure, solution.pose, tracked.guides, tracked.guide_rotations, tracked.weights)
    return solver.solve(tracked.positions, previous, dt, start=start, **options)


def lead_pose(figure: Figure, pose: Pose, guides: Array, rotations: Array, weights: Array) -> Pose:
    """Turn a pose's trunk and limbs towards guides.

    Args:
        figure: What is posed.
        pose: A pose that meets the six effectors.
        guides: (5, 3) joints in the order of ``GUIDES`` [m]; NaN where there is none.
        rotations: (5, 4) of their segments; only that of the chest is looked at; NaN where there is none.
        weights: (5,) from 0, as if there were no guide, to 1.

    Returns:
        The pose to start from. Its effectors are off their places.
    """
    joints = _Joints(figure, pose)
    if weights[0] > 0.0 and np.isfinite(guides[0]).all():
        _lead_chest(joints, guides[0], rotations[0], float(weights[0]))
    ends = joints.places.copy()  # hands and feet stay where they are met
    limbs = figure.roles.limbs
    for k in range(4):
        if weights[k + 1] > 0.0 and np.isfinite(guides[k + 1]).all():
            _lead_limb(joints, limbs[k], k < 2, ends[limbs[k][0]], guides[k + 1], float(weights[k + 1]))
    return joints.pose()


class _Joints:
    """World places and anatomical rotations of a pose, of which some are turned."""

    def __init__(self, figure: Figure, pose: Pose) -> None:
        self.figure, self._pose = figure, pose
        self.places, self._world = pose.compute_transforms()
        self.turns = rot.mul(self._world, rot.inv(figure.neutral))
        self.rotations = pose.rotations.copy()

    def turn(self, joint: int, turn: Array) -> None:
        """Give a joint another rotation in the world; what hangs on it must be turned afterwards."""
        self.turns[joint] = turn
        self._world[joint] = rot.mul(turn, self.figure.neutral[joint])
        parent = int(self.figure.skeleton.parents[joint])
        above = self._world[parent] if parent >= 0 else rot.IDENTITY
        self.rotations[joint] = rot.mul(rot.inv(above), self._world[joint])

    def carry(self, joints: Sequence[int], *, placed: bool = False) -> None:
        """Let joints, parents first, follow what they hang on; ``placed`` ones keep their world turns."""
        skeleton = self.figure.skeleton
        for joint in joints:
            parent = int(skeleton.parents[joint])
            self.places[joint] = self.places[parent] + rot.mul_vec(
                self._world[parent], skeleton.offsets[joint]
            )
            if not placed:
                self._world[joint] = rot.mul(self._world[parent], self.rotations[joint])
                self.turns[joint] = rot.mul(self._world[joint], rot.inv(self.figure.neutral[joint]))

    def pose(self) -> Pose:
        return Pose(self._pose.skeleton, self.rotations, self._pose.translations, self._pose.moving)


def _lead_chest(joints: _Joints, place: Array, turn: Array, weight: float) -> None:
    """Bring the chest to its tracker by the spine below it, and the head back to its place by the neck."""
    figure, roles = joints.figure, joints.figure.roles
    spine = list(roles.spine)
    carried = [j for j in spine if j in figure.skeleton.path(0, roles.shoulder[0])] or spine[:1]
    neck, chest, root = spine[len(carried) :], carried[-1], joints.places[roles.pelvis]
    trunk = figure.skeleton.path(roles.pelvis, roles.head)[1:]
    skull = joints.places[roles.head] + rot.mul_vec(joints.turns[roles.head], figure.head_offset)
    if np.isfinite(turn).all():
        change = _scaled(rot.mul(turn, rot.inv(joints.turns[chest])), weight)
        _bend(joints, trunk, carried, change, spread=True)
        below = carried[:-1]
    else:
        below = carried
    if below:
        aim = rot.between(rot.unit(joints.places[chest] - root), rot.unit(place - root))
        _bend(joints, trunk, below, _scaled(aim, weight), spread=False)
    if neck:
        head = joints.places[roles.head] + rot.mul_vec(joints.turns[roles.head], figure.head_offset)
        start = joints.places[neck[0]]
        aim = rot.between(rot.unit(head - start), rot.unit(skull - start))
        _bend(joints, trunk, neck, aim, spread=False)
    joints.carry([j for j in _above_limbs(figure) if j not in spine])
    for limb in roles.limbs[:2]:
        joints.carry(figure.skeleton.path(roles.pelvis, limb[0])[-1:])


def _bend(joints: _Joints, trunk: list[int], bent: list[int], change: Array, *, spread: bool) -> None:
    """Turn joints in the world: all by the same, or growing from the first to the last (``spread``).

    Other joints of the trunk keep their rotations in the world.
    """
    vector, size = rot.unit(change[:3]), float(rot.angle(change)) * (1.0 if change[3] >= 0 else -1.0)
    before = joints.turns.copy()
    for joint in trunk:
        turn = before[joint]
        if joint in bent:
            part = (bent.index(joint) + 1) / len(bent) if spread else 1.0
            turn = rot.mul(rot.from_axis_angle(vector, part * size), turn)
        joints.turn(joint, turn)
    joints.carry(trunk, placed=True)


def _scaled(q: Array, weight: float) -> Array:
    """A part of a rotation, at most MOST."""
    q = -q if q[3] < 0 else q
    return rot.from_axis_angle(rot.unit(q[:3]), min(weight * float(rot.angle(q)), MOST))


def _above_limbs(figure: Figure) -> list[int]:
    """Joints between the spine and the shoulders, which move with it."""
    found: list[int] = []
    for shoulder in figure.roles.shoulder:
        path = figure.skeleton.path(figure.roles.pelvis, shoulder)
        found += [j for j in path[1:] if j not in found]
    return found


def _lead_limb(
    joints: _Joints, limb: tuple[int, int, int], arm: bool, root: Array, guide: Array, weight: float
) -> None:
    """Turn a limb's root so that its hinge's axis is across the plane of root, guide and end."""
    upper, middle, end = limb
    line = rot.unit(joints.places[end] - root)
    side, before = _across(guide - root, line), _across(joints.places[middle] - root, line)
    radius = float(np.linalg.norm(side))
    if radius < 1e-6:
        return
    weight *= min(1.0, radius / CLEAR)
    now = rot.unit((1.0 - weight) * rot.unit(before) + weight * side / radius)
    x = np.cross(line, now) if arm else np.cross(now, line)
    if np.linalg.norm(x) < 0.5:
        return
    # Only the axis counts: the shortest turn that gives it to the root.
    turn = rot.between(rot.mul_vec(joints.turns[upper], X), x)
    joints.turn(upper, rot.mul(turn, joints.turns[upper]))


def _across(v: Array, line: Array) -> Array:
    return np.asarray(v - (v @ line) * line)
