"""Which anonymous tracker is what, from a still pose.

Every way of giving roles to trackers has a cost: how far the figure it makes is from a human one, in squared
standard deviations (``stance_cost``). The least cost wins, if it wins clearly: where the second best is near,
or where the facing is unknown and the pose looks the same from behind, the result says what is open and what
to do, and whoever uses it must not go on.

Up to seven trackers all permutations are tried. For more, minimal-cost assignments (Kuhn-Munkres) for every
pair of head and pelvis begin a search by exchanges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from sixpoint.body import rotations as rot
from sixpoint.body.targets import EFFECTORS, POINTS
from sixpoint.calibration.stance_cost import Stances, compute_cost, compute_facing
from sixpoint.errors import TargetError, listed

Array = NDArray[np.float64]
Index = NDArray[np.int64]

KITS: dict[int, tuple[str, ...]] = {
    3: ("head", "l_wrist", "r_wrist"),
    4: ("pelvis", "head", "l_wrist", "r_wrist"),
    5: ("head", "l_wrist", "r_wrist", "l_ankle", "r_ankle"),
    6: EFFECTORS,
    7: (*EFFECTORS, "chest"),
    8: (*EFFECTORS, "l_elbow", "r_elbow"),
    9: (*EFFECTORS, "chest", "l_elbow", "r_elbow"),
    10: (*EFFECTORS, "l_elbow", "r_elbow", "l_knee", "r_knee"),
    11: POINTS,
}
"""What so many trackers are on, unless it is said otherwise."""

CLEAR = 3.0  # the second best must cost so much more where the facing is known [variances]
CLEAR_UNKNOWN = 6.0  # and where it is not
POOR = 60.0  # a pose that costs more is no human's
STILL = 0.03  # largest distance of a tracker from its mean in a still pose [m]
STEP = 0.15  # shortest step that tells the facing [m]
EXHAUSTIVE = 7
KEPT = 16  # beginnings of a search


@dataclass(frozen=True, eq=False)
class Assignment:
    """Roles of trackers.

    Attributes:
        roles: Role -> index of its tracker.
        facing: (3,) where the person faces, a horizontal unit vector.
        margin: How much more the second best assignment costs [variances].
        open: Roles that are not certain.
        advice: What to do about it; empty where all is certain.
    """

    roles: dict[str, int]
    facing: Array
    margin: float
    open: tuple[str, ...] = ()
    advice: str = ""

    @property
    def certain(self) -> bool:
        """Whether the roles may be used."""
        return not self.advice


def assign_roles(
    positions: ArrayLike,
    *,
    roles: Sequence[str] | None = None,
    facing: ArrayLike | None = None,
    head: int | None = None,
    stature: float | None = None,
) -> Assignment:
    """Find out what each of 3 to 11 trackers is on.

    Args:
        positions: (n, 3) of a still pose [m], Y up, or (F, n, 3) over the time it is held.
        roles: The roles to give, as many as trackers; ``KITS`` by default.
        facing: (3,) where the person faces, roughly (45 degrees do no harm): from ``facing_of_rotation`` or
            ``facing_of_step``. Without it only poses that differ before and behind tell left from right.
        head: Index of the headset where it is known.
        stature: [m] where it is known.

    Raises:
        TargetError: The trackers move, one is not seen, or there are no such roles.
    """
    points = _still(positions)
    names = _names(len(points), roles)
    if head is not None and not 0 <= head < len(points):
        raise TargetError(f"head is the index of a tracker, 0 to {len(points) - 1}, got {head}")
    if head is not None and "head" not in names:
        raise TargetError(f"a head tracker was given, but none of the roles is head: {listed(names)}")
    forward = None if facing is None else _horizontal(facing)
    stances = Stances(names, forward, stature)
    tried, costs = _candidates(points, stances, head)
    order = np.argsort(costs, kind="stable")
    best = tried[order[0]]
    margin = float(costs[order[1]] - costs[order[0]]) if len(order) > 1 else float("inf")
    clear = CLEAR if forward is not None else CLEAR_UNKNOWN
    rivals = tried[order[(costs[order] < costs[order[0]] + clear)]]
    unsure = tuple(n for k, n in enumerate(names) if (rivals[:, k] != best[k]).any())
    where = compute_facing(points[best][None], stances)[0]
    advice = _advise(unsure, forward is None, float(costs[order[0]]), head is None)
    return Assignment({n: int(k) for n, k in zip(names, best, strict=True)}, where, margin, unsure, advice)


def facing_of_rotation(rotation: ArrayLike, mount: ArrayLike = rot.IDENTITY) -> Array:
    """(3,) where a segment faces, horizontally.

    Args:
        rotation: (4,) of a tracker, world<-tracker xyzw; a headset's Z looks forward.
        mount: (4,) segment<-tracker, where the tracker's axes are not the segment's.

    Raises:
        TargetError: It looks straight up or down, or is no rotation.
    """
    q = np.asarray(rotation, float)
    if q.shape != (4,) or not np.isfinite(q).all() or np.linalg.norm(q) < 1e-6:
        raise TargetError(f"a rotation is four numbers xyzw, got {rotation!r}")
    segment = rot.mul(rot.normalised(q), rot.inv(mount))
    return _horizontal(rot.mul_vec(segment, [0.0, 0.0, 1.0]))


def facing_of_step(before: ArrayLike, after: ArrayLike) -> Array:
    """(3,) where a person faces who has stepped forward, from all trackers (n, 3) before and after.

    Raises:
        TargetError: They have moved by less than 0.15 m, or the sets differ.
    """
    first, second = np.asarray(before, float), np.asarray(after, float)
    if first.shape != second.shape or first.ndim != 2 or first.shape[1] != 3:
        raise TargetError(f"before and after are the same trackers (n, 3), got {first.shape}, {second.shape}")
    moved = np.median(second - first, axis=0) * [1.0, 0.0, 1.0]
    if not np.linalg.norm(moved) >= STEP:
        raise TargetError(
            f"the trackers moved by {np.linalg.norm(moved):.2f} m only: take a whole step forward, "
            f"at least {STEP:g} m, and stand still again"
        )
    return _horizontal(moved)


def _still(positions: ArrayLike) -> Array:
    points = np.asarray(positions, float)
    if points.ndim not in (2, 3) or points.shape[-1] != 3:
        raise TargetError(f"positions are (n, 3) or (frames, n, 3), got {points.shape}")
    if points.ndim == 3:
        lost = [str(k) for k in range(points.shape[1]) if not np.isfinite(points[:, k]).all(axis=1).any()]
        if lost or not len(points):
            raise TargetError(f"trackers {listed(lost)} are never seen: roles need all of them")
        mean = np.nanmean(points, axis=0)
        off = np.nanmax(np.linalg.norm(points - mean, axis=-1), axis=0)
        if off.max() > STILL:
            raise TargetError(
                f"tracker {int(off.argmax())} moves by {100 * off.max():.0f} cm: stand still for two seconds"
            )
        points = mean
    if not np.isfinite(points).all():
        lost = [str(k) for k in np.flatnonzero(~np.isfinite(points).all(axis=1))]
        raise TargetError(f"trackers {listed(lost)} are not seen: roles need all of them")
    return points


def _names(n: int, roles: Sequence[str] | None) -> tuple[str, ...]:
    if roles is None:
        if n not in KITS:
            raise TargetError(f"kits have 3 to 11 trackers, got {n}")
        return KITS[n]
    unknown = [r for r in roles if r not in POINTS]
    if unknown or len(set(roles)) != len(roles) or len(roles) != n:
        raise TargetError(
            f"roles are {n} different ones, as many as trackers, of {listed(POINTS)}; got {listed(roles)}"
        )
    if "head" not in roles:
        raise TargetError(f"one of the roles must be head, got {listed(roles)}")
    return tuple(r for r in POINTS if r in roles)


def _horizontal(direction: ArrayLike) -> Array:
    v = np.array(direction, float)
    if v.shape != (3,) or not np.isfinite(v).all():
        raise TargetError(f"a facing is three numbers, got {direction!r}")
    length = float(np.hypot(v[0], v[2]))
    if length < 0.2 * np.linalg.norm(v) or length == 0.0:
        raise TargetError("the facing is nearly vertical: look straight ahead")
    return np.array([v[0], 0.0, v[2]]) / length


# --- candidates ------------------------------------------------------------------------------------


def _candidates(points: Array, stances: Stances, head: int | None) -> tuple[Index, Array]:
    """Assignments (K, n), tracker of each role, and their costs (K,)."""
    n = len(points)
    if n <= EXHAUSTIVE:
        tried = np.array(list(permutations(range(n))))
        if head is not None:
            tried = tried[tried[:, stances.names.index("head")] == head]
        return tried, compute_cost(points[tried], stances)
    here = _beginnings(points, stances, head)
    costs = compute_cost(points[here], stances)
    kept = np.argsort(costs, kind="stable")[:KEPT]
    here, cost = here[kept], costs[kept]
    visited, known = [here], [cost]
    moves = np.array(_moves(stances.names))
    while True:
        near = here[:, moves]  # (starts, moves, n)
        costs = compute_cost(points[near.reshape(-1, n)], stances).reshape(near.shape[:2])
        if head is not None:
            costs[near[:, :, stances.names.index("head")] != head] = np.inf
        visited.append(near.reshape(-1, n))
        known.append(costs.ravel())
        best = costs.argmin(axis=1)
        better = costs.min(axis=1) < cost - 1e-9
        if not better.any():
            break
        here = np.where(better[:, None], near[np.arange(len(near)), best], here)
        cost = np.where(better, costs.min(axis=1), cost)
        here, first = np.unique(here, axis=0, return_index=True)
        cost = cost[first]
    unique, first = np.unique(np.concatenate(visited), axis=0, return_index=True)
    return unique, np.concatenate(known)[first]


def _moves(names: tuple[str, ...]) -> list[list[int]]:
    """Exchanges of two roles, of both arms, of both legs, and of the sides."""
    identity = list(range(len(names)))
    moves = []
    for i, j in combinations(identity, 2):
        move = identity.copy()
        move[i], move[j] = j, i
        moves.append(move)
    for parts in (("wrist", "elbow"), ("ankle", "knee"), ("wrist", "elbow", "ankle", "knee")):
        move = identity.copy()
        for part in parts:
            if f"l_{part}" in names:
                i, j = names.index(f"l_{part}"), names.index(f"r_{part}")
                move[i], move[j] = j, i
        moves.append(move)
    return moves


def _beginnings(points: Array, stances: Stances, head: int | None) -> Index:
    """Minimal-cost assignments of the other roles to the others, for every head and pelvis."""
    n, names = len(points), stances.names
    h = names.index("head")
    p = names.index("pelvis") if "pelvis" in names else None
    others = [k for k in range(n) if k not in (h, p)]
    found = []
    facings = [stances.facing] if stances.facing is not None else _around()
    for top in range(n) if head is None else [head]:
        for low in range(n) if p is not None else [-1]:
            if low == top or (low >= 0 and points[low, 1] > points[top, 1]):
                continue
            rest = [k for k in range(n) if k not in (top, low)]
            for facing in facings:
                cost = stances.place_costs(
                    points[rest], points[top], None if low < 0 else points[low], facing
                )
                rows, columns = linear_sum_assignment(cost[:, others])
                chosen = np.empty(n, int)
                chosen[h] = top
                if p is not None:
                    chosen[p] = low
                chosen[np.array(others)[columns]] = np.array(rest)[rows]
                found.append(chosen)
    return np.unique(np.array(found), axis=0)


def _around() -> list[Array]:
    angles = np.arange(8) * np.pi / 4
    return [np.array([np.sin(a), 0.0, np.cos(a)]) for a in angles]


def _advise(unsure: tuple[str, ...], blind: bool, cost: float, headless: bool) -> str:
    if cost > POOR:
        return (
            "the trackers are not those of a standing or sitting person: check that all of them are worn and "
            "that Y is up, stand upright with the arms hanging, and try again"
        )
    if not unsure:
        return ""
    sides = {n for n in unsure if n[1] == "_"} == set(unsure)
    what = f"{listed(unsure)} cannot be told apart"
    if blind and sides:
        return (
            f"{what}: the pose looks the same from behind. Take a step forward, or say where the person faces"
        )
    more = ", and say which tracker is the headset" if headless and "head" in unsure else ""
    return f"{what}: stand upright, feet a little apart, arms stretched to the sides, and try again{more}"
