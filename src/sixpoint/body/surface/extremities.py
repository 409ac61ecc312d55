"""Head, hands and feet of the built-in surface: what lies beyond the tracked joints."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.surface.flesh_parts import Flesh
from sixpoint.body.surface.loft import Loft, loft, sample

Array = NDArray[np.float64]

X, Y, Z = np.eye(3)
TURN = np.cos(np.radians(35.0))
"""Hands and feet that point elsewhere by more than this are taken to have no tip in the rig."""


def add_head(flesh: Flesh, sizes: dict[str, Any], middle: Array) -> None:
    """An egg with a chin and a hint of a nose, so that one sees where it looks."""
    stature, rows = flesh.stature, sizes["sections"]
    places = np.linspace(rows[0][0], rows[-1][0], 17)
    breadth, front, back, exponents = sample(rows, places).T
    heights = (places - 0.5) * sizes["height"] * stature
    egg = loft(
        middle + heights[:, None] * Y,
        X,
        Z,
        stature * np.column_stack([breadth, breadth, front, back]),
        places,
        sectors=20,
        exponents=exponents,
        caps=(0.009 * stature, 0.0035 * stature),
    )
    vertices = egg.vertices.copy()
    aside = np.abs(vertices[:, 0] - middle[0]) / (0.011 * stature)
    low = (egg.places - 0.36) / np.where(egg.places > 0.36, 0.13, 0.055)
    before = vertices[:, 2] > middle[2]
    vertices[:, 2] += before * sizes["nose"] * stature * np.exp(-(aside**2) - low**2)
    flesh.add_rigid("head", Loft(vertices, egg.triangles, egg.places), flesh.figure.roles.head)


def add_foot(flesh: Flesh, name: str, sizes: dict[str, Any], leg: tuple[int, int, int], sign: float) -> None:
    """A foot on a flat sole, pointing where the rig's toes point."""
    ankle = flesh.positions[leg[2]]
    tip = find_tip(flesh, leg[2])
    flat = tip * [1.0, 0.0, 1.0]
    reach = float(np.linalg.norm(flat))
    length = sizes["length"] * flesh.stature
    ahead = Z
    if reach > 0.25 * length and flat[2] > TURN * reach:
        ahead = flat / reach
        length = float(np.clip(reach / (1.0 - sizes["behind"]), 0.8 * length, 1.25 * length))
    across = sign * np.cross(Y, ahead)
    sole = ankle[1] - find_sole(flesh, sizes, leg[2])
    rows = sizes["sections"]
    places = np.linspace(0.0, 1.0, 15)
    outer, inner, top, exponents = sample(rows, places).T
    scale = flesh.stature
    # The ankle's height above the sole is the rig's; the foot's back rises to it.
    rise = top * np.clip((ankle[1] - sole) / (sizes["height"] * scale), 0.6, 1.6)
    half = 0.5 * rise * scale
    floor = np.array([ankle[0], sole, ankle[2]])
    centres = floor + ((places - sizes["behind"]) * length)[:, None] * ahead + half[:, None] * Y
    radii = np.column_stack([outer * scale, inner * scale, half, half])
    foot = loft(
        centres,
        across,
        Y,
        radii,
        places,
        sectors=16,
        exponents=exponents,
        caps=(0.006 * scale, 0.007 * scale),
    )
    vertices = foot.vertices.copy()
    vertices[:, 1] = np.maximum(vertices[:, 1], sole)
    # Sections are broad at the sole and narrow above it.
    up = np.clip((vertices[:, 1] - sole) / (0.045 * scale), 0.0, 1.0)
    middle = floor + ((vertices - floor) @ ahead)[:, None] * ahead
    aside = ((vertices - middle) @ across)[:, None] * across
    vertices -= (0.12 * up)[:, None] * aside
    flesh.add_rigid(name, Loft(vertices, foot.triangles, foot.places), leg[2])


def find_sole(flesh: Flesh, sizes: dict[str, Any], ankle: int) -> float:
    """How far the sole is below the ankle [m]: to the rig's lowest point, if it is a foot's."""
    usual = float(sizes["height"] * flesh.stature)
    drop = float(-flesh.points_below(ankle)[:, 1].min())
    return drop if 0.6 * usual < drop < 1.7 * usual else usual


def find_tip(flesh: Flesh, joint: int) -> Array:
    """The rig's farthest point below a joint, seen from it in the neutral pose (3,) [m]; zero if none."""
    ends = flesh.points_below(joint)
    return np.asarray(ends[np.argmax(np.linalg.norm(ends, axis=1))])


def add_hand(flesh: Flesh, name: str, sizes: dict[str, Any], arm: tuple[int, int, int], sign: float) -> None:
    """A palm, four fingers and a thumb, palm to the thigh, a little curled."""
    stature, wrist = flesh.stature, flesh.positions[arm[2]]
    along = rot.unit(wrist - flesh.positions[arm[1]])
    tip = find_tip(flesh, arm[2])
    length, reach = sizes["length"] * stature, float(np.linalg.norm(tip))
    if reach > 0.4 * length and tip @ along > TURN * reach:
        along = tip / reach
        length = float(np.clip(reach, 0.75 * length, 1.25 * length))
    outward = rot.unit(sign * X - (sign * X @ along) * along)  # the back of the hand
    ahead = sign * np.cross(along, outward)  # the side of the thumb
    ahead = ahead * np.sign(ahead[2])
    scale = length / sizes["length"]
    palm = sizes["palm"] * length
    rows = sizes["sections"]
    places = np.linspace(rows[0][0], 1.0, 8)
    breadth, thickness = sample(rows, places).T * scale
    centres = wrist + (places * palm)[:, None] * along
    radii = np.column_stack([thickness, thickness, breadth, breadth])
    body = loft(
        centres,
        outward,
        ahead,
        radii,
        places,
        sectors=12,
        exponents=2.4,
        caps=(0.002 * scale, 0.006 * scale),
        cap_rings=3,
    )
    flesh.add_rigid(name, body, arm[2])
    curl = np.radians(sizes["curl"])
    for across, root, reach, radius in sizes["fingers"]:
        base = wrist + root * palm * along + across * scale * ahead
        splay = 3.0 * across * ahead
        bends = [rot.unit(_bent(along, outward, curl * k) + splay) for k in (0.4, 1.6, 2.6)]
        _add_finger(flesh, name, arm[2], base, bends, reach * scale, radius * scale, outward)
    across, root, reach, radius = sizes["thumb"]
    base = wrist + root * palm * along + across * scale * ahead
    turn = np.radians(sizes["thumb_turn"])
    first = np.cos(turn) * along + np.sin(turn) * ahead - 0.25 * outward
    last = np.cos(0.35 * turn) * along + np.sin(0.35 * turn) * ahead - 0.3 * outward
    bends = [rot.unit(first), rot.unit(first + last), rot.unit(last)]
    _add_finger(flesh, name, arm[2], base, bends, reach * scale, radius * scale, outward)


def _bent(along: Array, outward: Array, angle: float) -> Array:
    """The direction of fingers bent towards the palm."""
    return np.asarray(np.cos(angle) * along - np.sin(angle) * outward)


def _add_finger(
    flesh: Flesh,
    name: str,
    joint: int,
    base: Array,
    bends: list[Array],
    length: float,
    radius: float,
    outward: Array,
) -> None:
    """A thin tube whose three bones, as long as 5, 3 and 2, point along ``bends``."""
    bones = np.array([0.5, 0.3, 0.2])[:, None] * length * np.array(bends)
    points = base + np.concatenate([np.zeros((1, 3)), np.cumsum(bones, axis=0)])
    places = np.array([-0.25, 0.5, 1.0, 1.5, 2.0, 3.0])
    centres = np.stack([np.interp(places, np.arange(4), points[:, k]) for k in range(3)], axis=-1)
    centres[0] = base - 0.25 * bones[0]
    thick = radius * np.interp(places, [0, 3], [1.0, 0.8])
    ahead = rot.unit(np.gradient(centres, axis=0))
    over = rot.unit(outward - (ahead @ outward)[:, None] * ahead)
    beside = np.cross(ahead, over)
    finger = loft(
        centres,
        over,
        beside,
        np.tile(thick[:, None], 4),
        places,
        sectors=8,
        caps=(0.3 * radius, 0.9 * radius),
        cap_rings=2,
    )
    flesh.add_rigid(name, finger, joint)
