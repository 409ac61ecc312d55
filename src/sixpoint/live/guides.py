"""Trackers on chest, elbows and knees lead trunk and swivel angles; the six effectors are met as ever.

A solver that takes a pose to start from (``start=`` of SIK+) is asked twice: its first answer is turned so
that the chest is where its tracker says, elbows and knees point to theirs, and the second starts there.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure, SpineChain
from sixpoint.body.motion import Pose
from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.live.chains import Quaternion, Vector, trace
from sixpoint.live.tracking import Tracked

Array = NDArray[np.float64]

MOST = 1.2  # rad, a chest is not turned farther from where six points put it
CLEAR = 0.03  # an elbow nearer to its limb's line says less of the swivel angle [m]
Z = (0.0, 0.0, 1.0)


class Starting(Protocol):
    """A solver that takes rotations and a pose to start from, as ``SequentialIKPlus``."""

    figure: Figure
    rotations: tuple[str, ...]

    def solve(self, points: Array, previous: Any, dt: float, **options: Any) -> Any:
        """Pose the figure for one frame."""


class Guidance:
    """What is known of a figure to lead its poses.

    Args:
        figure: What is posed.
    """

    def __init__(self, figure: Figure) -> None:
        self.figure = figure
        roles, path = figure.roles, figure.skeleton.path
        spine = list(roles.spine)
        self._carried = [j for j in spine if j in path(0, roles.shoulder[0])] or spine[:1]
        self._neck = spine[len(self._carried) :]
        self._trunk = path(roles.pelvis, roles.head)[1:]
        sides: list[int] = []
        for shoulder in roles.shoulder:
            sides += [j for j in path(roles.pelvis, shoulder)[1:] if j not in self._trunk + sides]
        self._sides = sides
        self._chain = SpineChain.from_figure(figure, own_pelvis=True).joints
        self._parents = figure.skeleton.parents.tolist()
        self._offsets = [(x, y, z) for x, y, z in figure.offsets.tolist()]
        self._back = [(-x, -y, -z, w) for x, y, z, w in figure.neutral.tolist()]
        x, y, z = figure.head_offset.tolist()
        self._top = (x, y, z)

    def solve(self, solver: Starting, tracked: Tracked, previous: Any = None, dt: float = 1 / 60) -> Any:
        """Solve one frame of trackers, led by those of chest, elbows and knees if there are any.

        Args:
            solver: ``SequentialIKPlus`` of the same figure, or one like it.
            tracked: The frame; its known rotations are used as far as the solver was made for them.
            previous: The solution of the frame before, if any.
            dt: Time since that frame [s].

        Returns:
            The solver's solution.
        """
        options: dict[str, Any] = {"rotations": tracked.known_rotations} if solver.rotations else {}
        solution = solver.solve(tracked.positions, previous, dt, **options)
        if not (tracked.weights > 0.0).any():
            return solution
        start = self.lead(solution.pose, tracked.guides, tracked.guide_rotations, tracked.weights)
        return solver.solve(tracked.positions, previous, dt, start=start, **options)

    def lead(self, pose: Pose, guides: Array, rotations: Array, weights: Array) -> Array:
        """Turn a pose's trunk and limbs towards guides.

        Args:
            pose: A pose that meets the six effectors.
            guides: (5, 3) joints in the order of ``GUIDES`` [m]; NaN where there is none.
            rotations: (5, 4) of their segments; only that of the chest is looked at; NaN where there is none.
            weights: (5,) from 0, as if there were no guide, to 1.

        Returns:
            (S + 4, 4) rotations of trunk and limb roots, to ``start`` from.
        """
        roles = self.figure.roles
        places, world = trace(pose, [roles.head, *roles.wrist, *roles.ankle])
        turns = {j: qt.mul(world[j], self._back[j]) for j in world}
        places = dict(places)
        known = np.isfinite(guides).all(axis=1) & (weights > 0.0)
        ends = [places[limb[2]] for limb in roles.limbs]  # hands and feet stay where they are met
        middles = [places[limb[1]] for limb in roles.limbs]
        if known[0]:
            x, y, z = guides[0].tolist()
            turned = rotations[0].tolist() if np.isfinite(rotations[0]).all() else None
            self._lead_chest(places, turns, (x, y, z), turned, float(weights[0]))
        for k, (root, _, _) in enumerate(roles.limbs):
            if known[k + 1]:
                x, y, z = guides[k + 1].tolist()
                middle, end, guide = (vec.sub(p, places[root]) for p in (middles[k], ends[k], (x, y, z)))
                turns[root] = _swivelled(turns[root], k < 2, middle, end, guide, float(weights[k + 1]))
        rows = [turns[self._chain[0]]]
        rows += [qt.inv_mul(turns[a], turns[b]) for a, b in pairwise(self._chain)]
        rows += [turns[limb[0]] for limb in roles.limbs]
        return np.array(rows)

    def _lead_chest(
        self,
        places: dict[int, Vector],
        turns: dict[int, Quaternion],
        place: Vector,
        turn: Quaternion | None,
        weight: float,
    ) -> None:
        """Bring the chest to its tracker by the spine below it, the head back to its place by the neck."""
        roles, chest = self.figure.roles, self._carried[-1]
        root, before = places[roles.pelvis], dict(turns)
        skull = vec.add(places[roles.head], qt.mul_vec(turns[roles.head], self._top))
        below = self._carried
        if turn is not None:
            change = _part(qt.mul(qt.normalised(turn), qt.inv(turns[chest])), weight)
            self._bend(places, turns, {j: (k + 1) / len(below) for k, j in enumerate(below)}, change)
            below = below[:-1]
        aim = _arc(vec.sub(places[chest], root), vec.sub(place, root))
        self._bend(places, turns, dict.fromkeys(below, 1.0), _part(aim, weight))
        if self._neck:
            start = places[self._neck[0]]
            head = vec.add(places[roles.head], qt.mul_vec(turns[roles.head], self._top))
            aim = _arc(vec.sub(head, start), vec.sub(skull, start))
            self._bend(places, turns, dict.fromkeys(self._neck, 1.0), aim)
        for joint in self._sides:
            parent = self._parents[joint]
            places[joint] = vec.add(places[parent], qt.mul_vec(turns[parent], self._offsets[joint]))
            turns[joint] = qt.mul(turns[parent], qt.inv_mul(before[parent], before[joint]))

    def _bend(
        self,
        places: dict[int, Vector],
        turns: dict[int, Quaternion],
        parts: dict[int, float],
        change: Quaternion,
    ) -> None:
        """Turn joints of the trunk in the world by parts of a rotation; the others keep theirs."""
        for joint in self._trunk:
            parent = self._parents[joint]
            places[joint] = vec.add(places[parent], qt.mul_vec(turns[parent], self._offsets[joint]))
            if joint in parts:
                turns[joint] = qt.mul(qt.scaled(change, parts[joint]), turns[joint])


def _swivelled(
    turn: Quaternion, arm: bool, middle: Vector, end: Vector, guide: Vector, weight: float
) -> Quaternion:
    """A limb root's rotation whose hinge axis is across the plane of root, guide and end, as ways from it."""
    line = vec.unit(end)
    side = vec.reject(guide, line)
    radius = vec.norm(side)
    weight *= min(1.0, radius / CLEAR)
    before = vec.unit(vec.reject(middle, line))
    now = vec.unit(vec.add(vec.scale(1.0 - weight, before), vec.scale(weight, vec.unit(side))))
    axis = vec.unit(vec.cross(line, now) if arm else vec.cross(now, line))
    if vec.norm(axis) < 0.5:
        return turn
    # Only the axis counts: the shortest turn that gives it to the root.
    return qt.mul(qt.arc(qt.x_axis(turn), axis, qt.y_axis(turn)), turn)  # type: ignore[no-any-return]


def _arc(a: Vector, b: Vector) -> Quaternion:
    """Shortest rotation from one direction to another; none where one has no length."""
    u, v = vec.unit(a), vec.unit(b)
    if vec.norm(u) < 0.5 or vec.norm(v) < 0.5:
        return qt.IDENTITY
    return qt.arc(u, v, vec.unit(vec.cross(u, Z)))  # type: ignore[no-any-return]


def _part(q: Quaternion, weight: float) -> Quaternion:
    """A part of a rotation, at most MOST."""
    size = vec.norm(qt.log(q))
    return qt.scaled(q, min(weight, MOST / max(size, 1e-9)))  # type: ignore[no-any-return]
