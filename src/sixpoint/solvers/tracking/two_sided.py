"""Across gaps: from what was followed forwards to what was followed backwards."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Hinges
from sixpoint.body.markers.model import MarkerModel
from sixpoint.solvers.prioritized.articulation import Articulation
from sixpoint.solvers.tracking.engine import packing as tp
from sixpoint.solvers.tracking.gaps import bridge
from sixpoint.solvers.tracking.model import carrier_of
from sixpoint.solvers.tracking.running import Followed, reverse

Array = NDArray[np.float64]

SETTLE = 0.15  # time in which a marker that came back is trusted again [s]
NEVER = 1.0  # doubt of a marker that was not seen yet [s]
ASTRAY = 0.15  # a marker that is farther from its place is not followed, though it is used [m]
EVEN = 0.02  # doubt of both ways where nothing is missing [s]


def blend(
    body: Articulation,
    model: MarkerModel,
    ahead: Followed,
    back: Followed,
    markers: Array,
    rest: Array,
    rate: float,
    steady: Callable[[Array, NDArray[np.bool_]], Array],
) -> Followed:
    """Join both ways: each joint leans to the way that saw its markers last; gaps without any are bridged.

    Hinges stay hinges within their ranges; a ball between two allowed rotations may be a little outside.

    Doubt grows with the time since a marker was used, and fades when it is back; that of a joint is the mean
    over the markers it carries.
    """
    carries = carried_by(body, model)
    doubt = doubt_of(ahead, rate) @ carries, doubt_of(reverse(back), rate)[::-1] @ carries
    ahead, back = _lend(ahead, back), _lend(back, ahead)
    share = (doubt[0] + EVEN) / (doubt[0] + doubt[1] + 2 * EVEN)
    # In the world: there both ways agree about what markers tell, however they bend the back to it.
    world = _mix(_world(body, ahead), _world(body, back), share)
    base = share[:, body.base, None]
    positions = (1 - base) * ahead.positions + base * back.positions
    # A marker is refused or exchanged where one way did; what both saw is used.
    flags = np.where(ahead.flags == back.flags, ahead.flags, np.maximum(ahead.flags, back.flags))
    told = np.isin(flags, (tp.USED, tp.SWAPPED)) @ (carries > 0)
    states = bridge(body, _states(body, world, positions), told, rest, rate)
    states = steady(states, told)
    rotations, positions = body.rotations_of(states), states[:, len(body.tree), :3]
    moving, translations = body.place_base(rotations, positions)
    places = model.place(*body.rig.compute_transforms(rotations, translations, moving))
    residual = np.linalg.norm(markers - places, axis=-1)
    residual = np.where(np.isfinite(residual), residual, 0.0)
    swapped = flags == tp.SWAPPED
    residual[swapped] = np.maximum(ahead.residual, back.residual)[swapped]
    return Followed(rotations, positions, flags, residual, np.maximum(ahead.iterations, back.iterations))


def carried_by(body: Articulation, model: MarkerModel) -> Array:
    """(M, J) share of each marker in what is known of each joint: those on or below it count alike."""
    carries = np.zeros((len(model.joints), len(body.tree)))
    for i, joint in enumerate(model.joints):
        carrier, _ = carrier_of(body, int(joint), np.zeros(3))
        carries[i, body.tree.path(0, carrier)] = 1.0
    return np.asarray(carries / np.maximum(carries.sum(axis=0), 1.0))


def doubt_of(way: Followed, rate: float) -> Array:
    """(F, M) time since each marker was followed [s]; after it is back what had grown fades."""
    followed = np.isin(way.flags, (tp.USED, tp.SWAPPED)) & (way.residual < ASTRAY)
    out = np.zeros(followed.shape)
    fade = np.exp(-1 / (SETTLE * rate))
    known = np.where(followed[0], 0.0, NEVER)
    for f, row in enumerate(followed):
        known = np.where(row, known * fade, known + 1 / rate)
        out[f] = known
    return out


def _lend(way: Followed, other: Followed) -> Followed:
    """A way whose frames that it did not follow are the other's."""
    waits = (way.flags == tp.WAITING).all(axis=1)
    pairs = zip(way, other, strict=True)
    return Followed(*(np.where(waits.reshape(-1, *(1,) * (a.ndim - 1)), b, a) for a, b in pairs))


def _world(body: Articulation, way: Followed) -> Array:
    """Rotations (F, J, 4) of the rig in the world."""
    moving, translations = body.place_base(way.rotations, way.positions)
    return body.rig.compute_transforms(way.rotations, translations, moving)[1]


def _states(body: Articulation, world: Array, positions: Array) -> Array:
    """States of world rotations (F, J, 4) and base positions; hinges keep what they can express."""
    local = rot.mul(rot.inv(world[:, np.maximum(body.tree.parents, 0)]), world)
    local[:, 0] = world[:, 0]
    states = body.states_of(local, positions)
    for joint, dof in body.dofs.joints.items():
        if isinstance(dof, Hinges):
            row, part = len(body.tree) + 1 + joint, slice(0, dof.size)
            states[:, row, part] = np.clip(states[:, row, part], dof.lower, dof.upper)
    return states


def _mix(a: Array, b: Array, share: Array) -> Array:
    """Normalised mixture of rotations (F, J, 4), the shorter way."""
    sign = np.where(np.sum(a * b, axis=-1, keepdims=True) < 0, -1.0, 1.0)
    return rot.normalised((1 - share[..., None]) * a + share[..., None] * sign * b)
