"""The first frame: where the body stands, and which markers cannot be right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.rigid import fit_rigid
from sixpoint.solvers.prioritized.articulation import Articulation
from sixpoint.solvers.tracking.engine import packing as tp
from sixpoint.solvers.tracking.running import Followed, State, TrackingEngine

Array = NDArray[np.float64]

COLD, ROUNDS = 60, 4  # iterations of a first frame, and times that its strays are left out
CAUTIOUS = 0.1  # damping of a first frame, whose steps are large [m]
POOR = 0.03  # a first frame that is off by more on average is also begun without limits [m]
STRAY = 0.1  # a marker that is farther than this from its place in a first frame is no one's [m]
DOUBTFUL = 0.05  # and one that is farther than this may have another's label [m]
TIMES = 5.0  # unless others are as far: this times their median


@dataclass(frozen=True, eq=False)
class Beginning:
    """Finds the pose of a first frame.

    Args:
        body: What is posed.
        model: Who moves.
        engine: Follows markers.
        starter: Follows them at one level.
        rest: (2 J + 1, 4) the relaxed posture.
    """

    body: Articulation
    model: MarkerModel
    engine: TrackingEngine
    starter: TrackingEngine
    rest: Array

    def begin(self, markers: Array, options: tp.Options) -> tuple[Followed, State]:
        """A first frame (M, 3) [m]: all markers at one level, from the neutral pose; strays are left out.

        Strays that are where another one should be have each other's labels.
        """
        seen, pairs = markers.copy(), []
        for _ in range(ROUNDS):
            out, pose = self._begin_with(seen, options)
            strays = refuse_strays(out.residual[0], out.flags[0], options.gate)
            if not strays.any():
                break
            seen[strays] = np.nan
        if np.isfinite(options.gate):
            pairs = find_swaps(markers, self._places(out), np.isnan(seen[:, 0]))
        if pairs:
            for pair in pairs:
                seen[pair] = markers[pair[::-1]]
            out, pose = self._begin_with(seen, options)
        state = self.engine.fresh(pose)
        out = self.engine.run(seen[None], self.rest, state, options._replace(dt=1e-6, most=10, posture=0.0))
        state.speed[:] = 0.0
        state.lag[:] = 0.0
        refused = np.isfinite(markers[:, 0]) & np.isnan(seen[:, 0])
        out.flags[0][refused] = tp.REJECTED
        out.residual[0][refused] = np.linalg.norm(markers - self._places(out), axis=-1)[refused]
        for pair in pairs:
            out.flags[0][pair] = tp.SWAPPED
        return out, state

    def _places(self, out: Followed) -> Array:
        """(M, 3) where the model's markers are in the pose of a run's only frame [m]."""
        moving, translations = self.body.place_base(out.rotations, out.positions)
        places = self.model.place(*self.body.rig.compute_transforms(out.rotations, translations, moving))
        return np.asarray(places[0])

    def _begin_with(self, seen: Array, options: tp.Options) -> tuple[Followed, Array]:
        """The better one of two ways to the first pose: within human limits first, or without any.

        Limits lead elbows and knees to the right side also where they are not kept in the end.
        """
        cold = options._replace(cold=True, most=COLD, posture=0.02, damping=CAUTIOUS)
        start = place_base(self.body, self.model, seen)
        found = []
        for limits in (True, False):
            state = self.starter.fresh(start)
            if limits != options.limits:
                self.starter.run(seen[None], self.rest, state, cold._replace(limits=limits))
            out = self.starter.run(seen[None], self.rest, state, cold)
            used = out.flags[0] == tp.USED
            off = float(np.mean(out.residual[0][used])) if used.any() else 0.0
            found.append((off, out, state.pose))
            if off < POOR:
                break
        _, out, pose = min(found, key=lambda entry: entry[0])
        return out, pose


def place_base(body: Articulation, model: MarkerModel, markers: Array) -> Array:
    """The neutral state, turned and moved to the pelvis' markers, or to all markers where it has few."""
    figure = model.figure
    state = body.rest_state()
    places = figure.rest_positions[model.joints] + rot.mul_vec(figure.neutral[model.joints], model.offsets)
    places = places - figure.rest_positions[figure.roles.pelvis]
    seen = np.isfinite(markers[:, 0])
    trunk = seen & np.isin(model.joints, [figure.roles.pelvis])
    near = seen & np.isin(model.joints, [figure.roles.pelvis, *figure.roles.spine, *figure.roles.hip])
    chosen = next((m for m in (trunk, near, seen) if _spans(places[m])), None)
    if chosen is None:
        if seen.any():
            state[len(body.tree), :3] = (markers[seen] - places[seen]).mean(axis=0)
        return state
    turn, shift = fit_rigid(places[chosen], markers[chosen])
    state[body.base] = turn
    state[len(body.tree), :3] = shift
    return state


def _spans(points: Array) -> bool:
    """Whether points are three and not on a line, by 3 cm."""
    if len(points) < 3:
        return False
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[1] > 0.03)


def refuse_strays(residual: Array, flags: NDArray[np.int64], gate: float) -> NDArray[np.bool_]:
    """(M,) markers of a first frame that are far from their places while others are near; the worst third."""
    used = flags == tp.USED
    if not np.isfinite(gate) or not used.any():
        return np.zeros(len(flags), bool)
    limit = max(STRAY, TIMES * float(np.median(residual[used])))
    bad = used & (residual > limit)
    worst = np.sort(residual[used])[-max(1, int(used.sum()) // 6)]
    return np.asarray(bad & (residual >= worst), bool)


def find_swaps(markers: Array, places: Array, strays: NDArray[np.bool_]) -> list[list[int]]:
    """Pairs of markers that are where the other one should be, the clearest first.

    Args:
        markers: (M, 3) of a first frame [m], NaN where one is not seen.
        places: (M, 3) where they should be in a pose that the others tell [m].
        strays: (M,) which were left out of it; others count where they are off by more than 5 cm.
    """
    seen = np.isfinite(markers[:, 0])
    off = np.linalg.norm(np.where(seen[:, None], markers, places) - places, axis=-1)
    rows = np.flatnonzero(seen & (strays | (off > DOUBTFUL)))
    across = np.linalg.norm(markers[rows, None] - places[None, rows], axis=-1)
    clear = np.triu(off[rows, None] + off[rows] - across - across.T, 1)
    found: list[list[int]] = []
    for a, b in zip(*np.unravel_index(np.argsort(-clear, axis=None), clear.shape), strict=True):
        near = max(across[a, b], across[b, a]) < min(STRAY, 0.5 * min(off[rows[a]], off[rows[b]]))
        if a < b and near and not {rows[a], rows[b]} & {row for pair in found for row in pair}:
            found.append([int(rows[a]), int(rows[b])])
    return found
