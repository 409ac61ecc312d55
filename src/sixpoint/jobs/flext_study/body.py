"""The whole body with held feet: a standing reach, and a squat that ends in a kick.

In both the pelvis is tracked, as the paper tracks the full body. Its path is made from leg angles that vary
smoothly, so that feet and pelvis can be met exactly in every frame, the true knee angles are known, and the
knees are exactly straight in between. What else is seen in solved knee angles comes from the method.

Reference: Boulic and Raunhardt 2009, section 6 ("standing reach").
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.solvers.prioritized.solver import PrioritizedIK
from sixpoint.solvers.prioritized.tasks import (
    BalanceTask,
    FlextTask,
    LookAtTask,
    OrientationTask,
    PositionTask,
    PostureTask,
    Task,
)

Array = NDArray[np.float64]
Keys = Mapping[float, tuple[float, ...]]

RATE = 60.0
SETTLE = 40  # frames before the first, at its goals
LEAST = 3  # fewest iterations a frame, so that small errors do not add up
EYES = (0.0, 0.06, 0.08)  # from the head joint [m]
FINE = 1e-5
"""Tolerance [m]: near extension 1 mm of a leg's length is 5 degrees of its knee."""
X = (1.0, 0.0, 0.0)
SHANK, THIGH = np.radians([17.0, 80.0])
"""How far shanks lean forward and thighs backward in the deepest squat [rad]."""
SQUAT: Keys = {0.3: (0, 0), 1.4: (0.88, 24), 1.6: (0.88, 24), 2.7: (0, 0)}
KICK: Keys = {2.95: (0, 0), 3.3: (40, 85), 3.7: (78, 0), 3.9: (78, 0), 4.2: (40, 62), 4.6: (0, 0)}
"""Time [s] -> depth of the squat, pitch of the pelvis [degrees]; bend of the right hip and knee [degrees]."""
ARMS: Keys = {0.3: (0.25, -0.09, 0.10), 1.4: (0.17, 0.04, 0.42), 1.6: (0.17, 0.04, 0.42)}
ARMS = {**ARMS, 2.7: (0.25, -0.09, 0.10)}
"""Time [s] -> the left wrist from where the pelvis rests, of a figure of 1.75 m [m]; the right mirrors it."""
LEAN: Keys = {0.4: (0, 0), 1.5: (0.18, 14), 1.9: (0.18, 14), 3.1: (0, -3), 3.5: (0, -3)}
LEAN = {**LEAN, 4.9: (1, 34), 5.3: (1, 34), 6.6: (0, 0)}
HAND: Keys = {0.4: (-0.20, 0.34, 0.40), 1.5: (-0.20, 0.28, 0.82), 1.9: (-0.20, 0.28, 0.82)}
HAND = {**HAND, 3.1: (-0.24, 1.13, 0.16), 3.5: (-0.24, 1.13, 0.16), 4.9: (-0.16, -0.78, 0.50)}
HAND = {**HAND, 5.3: (-0.16, -0.78, 0.50), 6.6: (-0.20, 0.34, 0.40)}
"""The same for the reach: depth and pitch of the pelvis; the right wrist."""
REACH_METHODS = {"plain": ("plain", "plain"), "FLEXT legs": ("FLEXT", "plain"), "FLEXT": ("FLEXT", "FLEXT")}
"""Name -> method of the legs and of the right arm."""
FREE_METHODS = {**REACH_METHODS, "secant": ("secant", "secant")}
"""The same where the pelvis is free: then also the secant form of FLEXT."""


@dataclass(frozen=True, eq=False)
class BodyRun:
    """One sequence of the whole body.

    Attributes:
        method: How feet and hand are constrained.
        budget: Iterations a frame, at most.
        motion: The solved postures.
        errors: (F, 3) distance of the left and the right foot and of the right hand to their goals [m]; NaN
            where the hand has none.
        pelvis: (F,) distance of the pelvis to its goal [m].
        knees: (F, 2) angles of the knees [rad].
        elbow: (F,) angles of the right elbow [rad].
        truth: (F, 2) knee angles that meet all goals exactly [rad].
        goals: (F, n, 3) goals of feet and hand [m].
    """

    method: str
    budget: int
    motion: Motion
    errors: Array
    pelvis: Array
    knees: Array
    elbow: Array
    truth: Array
    goals: Array

    @property
    def slip(self) -> float:
        """Largest distance of a foot to its goal [m]."""
        return float(self.errors[:, :2].max())

    @property
    def miss(self) -> float:
        """Largest distance of the right hand to its goal [m]; NaN without one."""
        return float(self.errors[:, 2].max())

    @property
    def jump(self) -> float:
        """Largest way of a joint from one frame to the next [m]."""
        return float(np.linalg.norm(np.diff(self.motion.positions, axis=0), axis=-1).max())

    @property
    def peaks(self) -> Array:
        """(2,) largest angular acceleration of each knee [rad/s^2]."""
        return np.asarray(np.abs(acceleration(self.knees)).max(axis=0))


def acceleration(angles: Array) -> Array:
    """Second differences (F, k) of angles (F, k) over time [rad/s^2]; zero at both ends."""
    out = np.zeros_like(angles)
    out[1:-1] = np.diff(angles, 2, axis=0) * RATE**2
    return out


def squat_and_kick(figure: Figure, method: str, budget: int) -> BodyRun:
    """Down into a squat and up with both feet held, then a kick of the right foot while the left stays.

    Args:
        figure: The figure.
        method: "plain" or "FLEXT", of both feet.
        budget: Most iterations a frame.
    """
    times = np.arange(0.0, 5.0, 1 / RATE)
    pelvis, turn, bend = _squat(figure, _through(SQUAT, times))
    hip, knee = np.radians(_through(KICK, times)).T
    kicks = times > min(KICK)
    rest, roles = figure.rest_positions, figure.roles
    calf, thigh = _legs(figure)
    foot = rest[roles.hip[1]] + _hanging(-hip, thigh) + _hanging(knee - hip, calf)
    goals = {
        "pelvis": pelvis,
        "pelvis orientation": turn,
        "l_ankle": rest[[roles.ankle[0]]],
        "r_ankle": np.where(kicks[:, None], foot, rest[roles.ankle[1]]),
        "l_ankle orientation": rot.IDENTITY[None],
        "r_ankle orientation": rot.from_axis_angle(X, np.where(kicks, knee - hip, 0.0)),
        "head gaze": np.array([[0.0, 0.2, 8.0]]),
    }
    wrists = _through(ARMS, times) * (figure.height / Figure.from_stature().height)
    goals |= {"l_wrist": wrists, "r_wrist": wrists * [-1.0, 1.0, 1.0]}
    tasks = [
        *_pelvis(),
        *_feet(method),
        *(_place(at, 4, method) for at in ("l_wrist", "r_wrist")),
        LookAtTask("head", level=7, offset=EYES),
        PostureTask(level=8),
    ]
    truth = np.stack([bend, np.where(kicks, knee, bend)], axis=-1)
    return _run(figure, tasks, method, budget, goals, truth)


def reach(figure: Figure, name: str, budget: int, held: bool = True) -> BodyRun:
    """The right hand goes far forward, up and to the floor; both feet stay, balance is kept, eyes follow.

    Args:
        figure: The figure.
        name: Of ``FREE_METHODS``.
        budget: Most iterations a frame.
        held: Whether the pelvis has its goal; else it goes where the hand takes it.
    """
    times = np.arange(0.0, 7.0, 1 / RATE)
    pelvis, turn, bend = _squat(figure, _through(LEAN, times))
    rest, roles = figure.rest_positions, figure.roles
    hand = _through(HAND, times) * (figure.height / Figure.from_stature().height)
    goals = {
        "l_ankle": rest[[roles.ankle[0]]],
        "r_ankle": rest[[roles.ankle[1]]],
        "l_ankle orientation": rot.IDENTITY[None],
        "r_ankle orientation": rot.IDENTITY[None],
        "r_wrist": hand,
        "head gaze": hand,
    }
    if held:
        goals |= {"pelvis": pelvis, "pelvis orientation": turn}
    legs, arm = FREE_METHODS[name]
    tasks = [
        *(_pelvis() if held else []),
        *_feet(legs),
        BalanceTask(level=4),
        _place("r_wrist", 5, arm),
        LookAtTask("head", level=8, offset=EYES),
        PostureTask(level=9),
    ]
    return _run(figure, tasks, name, budget, goals, np.stack([bend, bend], axis=-1))


def _place(at: str, level: int, method: str) -> Task:
    """A position constraint, plain, FLEXT or its secant form."""
    if method == "FLEXT":
        return FlextTask(at, level=level, drag=True, tolerance=FINE, form="tangent")
    if method == "secant":
        return FlextTask(at, level=level, drag=True, tolerance=FINE, form="secant")
    return PositionTask(at, level=level, tolerance=FINE)


def _pelvis() -> list[Task]:
    return [PositionTask("pelvis", tolerance=FINE), OrientationTask("pelvis", tolerance=10 * FINE)]


def _feet(method: str) -> list[Task]:
    """Legs at levels 1 to 3, with the soles at level 2."""
    ankles = ("l_ankle", "r_ankle")
    soles = [OrientationTask(at, level=2, tolerance=10 * FINE) for at in ankles]
    return [*(_place(at, 1, method) for at in ankles), *soles]


def _legs(figure: Figure) -> tuple[float, float]:
    """Lengths of calf and thigh [m]."""
    rest, roles = figure.rest_positions, figure.roles
    calf = np.linalg.norm(rest[roles.ankle[0]] - rest[roles.knee[0]])
    return float(calf), float(np.linalg.norm(rest[roles.knee[0]] - rest[roles.hip[0]]))


def _hanging(angle: Array, length: float) -> Array:
    """A hanging segment (F, 3) turned back by angles (F,) [rad, m]."""
    return length * np.stack([0 * angle, -np.cos(angle), -np.sin(angle)], axis=-1)


def _squat(figure: Figure, course: Array) -> tuple[Array, Array, Array]:
    """Pelvis (F, 3), its rotation (F, 4) and knee angles (F,) of depths 0 ... 1 and pitches [degrees]."""
    depth, turn = course[:, 0], rot.from_axis_angle(X, np.radians(course[:, 1]))
    rest, roles = figure.rest_positions, figure.roles
    calf, thigh = _legs(figure)
    hip = rest[roles.ankle[0]] * [0, 1, 1] - _hanging(SHANK * depth, calf) - _hanging(-THIGH * depth, thigh)
    middle = 0.5 * (rest[roles.hip[0]] + rest[roles.hip[1]]) - rest[roles.pelvis]
    return hip - rot.mul_vec(turn, np.tile(middle, (len(hip), 1))), turn, (SHANK + THIGH) * depth


def _through(keys: Keys, times: Array) -> Array:
    """Values (F, k) that rest at every key and go from one to the next with continuous acceleration."""
    at, values = np.array(list(keys)), np.array(list(keys.values()), float)
    piece = np.clip(np.searchsorted(at, times, side="right") - 1, 0, len(at) - 2)
    x = np.clip((times - at[piece]) / (at[piece + 1] - at[piece]), 0.0, 1.0)[:, None]
    share = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    return np.asarray(values[piece] + share * (values[piece + 1] - values[piece]))


def _run(
    figure: Figure, tasks: list[Task], method: str, budget: int, goals: dict[str, Array], truth: Array
) -> BodyRun:
    """Solve all frames; measure by forward kinematics."""
    solver = PrioritizedIK(
        figure,
        tasks,
        dofs=figure.full_dofs(),
        iterations=budget,
        cold_iterations=budget,
        least_iterations=min(budget, LEAST),
    )
    frames, roles = len(truth), figure.roles
    table = np.full((frames, len(solver.goal_names), 7), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    for name, values in goals.items():
        part = slice(0, 3) if values.shape[1] == 3 else slice(3, 7)
        table[:, solver.goal_names.index(name), part] = values
    table = np.concatenate([np.repeat(table[:1], SETTLE, axis=0), table])
    motion = solver.solve_frames(table).motion.sliced(slice(SETTLE, None))
    there = {"l_ankle": roles.ankle[0], "r_ankle": roles.ankle[1], "r_wrist": roles.wrist[1]}
    places = motion.positions
    nowhere = np.full((frames, 3), np.nan)
    wanted = {name: np.broadcast_to(goals.get(name, nowhere), (frames, 3)) for name in (*there, "pelvis")}
    errors = [np.linalg.norm(places[:, joint] - wanted[name], axis=1) for name, joint in there.items()]
    return BodyRun(
        method=method,
        budget=budget,
        motion=motion,
        errors=np.stack(errors, axis=-1),
        pelvis=np.linalg.norm(places[:, roles.pelvis] - wanted["pelvis"], axis=1),
        knees=np.stack([_bends(places, *joints) for joints in _limbs(figure)], axis=-1),
        elbow=_bends(places, roles.shoulder[1], roles.elbow[1], roles.wrist[1]),
        truth=truth,
        goals=np.stack([wanted[name] for name in there], axis=1),
    )


def _limbs(figure: Figure) -> list[tuple[int, int, int]]:
    roles = figure.roles
    return [(roles.hip[k], roles.knee[k], roles.ankle[k]) for k in (0, 1)]


def _bends(places: Array, root: int, middle: int, end: int) -> Array:
    """Angles (F,) between the two segments of a limb [rad], accurate also when they are aligned."""
    a, b = places[:, middle] - places[:, root], places[:, end] - places[:, middle]
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1)))
