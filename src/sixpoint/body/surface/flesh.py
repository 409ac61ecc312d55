"""The built-in surface of a figure: a mannequin of closed, overlapping parts, skinned.

Each part is a surface through sections whose sizes follow from the stature, and which lie around the joints
of the figure in its neutral pose; so any rig has one. Arms and legs end in balls around shoulders and hips,
as those of an artist's mannequin do: a ball looks the same from all sides, so no pose tears or pinches it.

Sizes and their sources: ``data/flesh.toml``.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.stature import stature_of
from sixpoint.body.surface.extremities import add_foot, add_hand, add_head
from sixpoint.body.surface.flesh_parts import Flesh, frames_along, smooth_step, weigh_along
from sixpoint.body.surface.loft import loft, sample
from sixpoint.body.surface.shape import Shape
from sixpoint.body.tables import read_shipped

Array = NDArray[np.float64]

SIDES = (("l", 1.0), ("r", -1.0))
BREADTHS = (0.75, 1.35)
"""How far a trunk may be narrower or broader than a human's: rigs put their shoulders and hips anywhere."""


@cache
def _sizes() -> dict[str, Any]:
    return read_shipped("flesh.toml")


def build_shape(figure: Figure) -> Shape:
    """A closed, skinned mesh around any figure.

    It is bound to the neutral pose with the pelvis at the origin (``figure.neutral_pose``). Its parts, each
    watertight: ``trunk``, ``head``, and with ``l_`` and ``r_``: ``arm``, ``hand``, ``leg``, ``foot``. Parts
    overlap where they meet. A vertex hangs on at most four joints.

    Reference: lengths of head, hands and feet after Drillis & Contini 1966; for the sections see
    ``data/flesh.toml``.
    """
    positions, world = figure.neutral_pose.compute_transforms()
    flesh = Flesh(figure, positions, stature_of(figure))
    sizes = _sizes()
    middle = _add_trunk(flesh, sizes["trunk"], sizes["head"])
    add_head(flesh, sizes["head"], middle)
    roles = figure.roles
    for k, (side, sign) in enumerate(SIDES):
        arm = (roles.shoulder[k], roles.elbow[k], roles.wrist[k])
        leg = (roles.hip[k], roles.knee[k], roles.ankle[k])
        above = roles.clavicle[k] if roles.clavicle else int(figure.skeleton.parents[arm[0]])
        _add_limb(flesh, f"{side}_arm", sizes["arm"]["sections"], arm, above, sign)
        add_hand(flesh, f"{side}_hand", sizes["hand"], arm, sign)
        _add_limb(flesh, f"{side}_leg", sizes["leg"]["sections"], leg, roles.pelvis, sign)
        add_foot(flesh, f"{side}_foot", sizes["foot"], leg, sign)
    return flesh.finish(positions, world)


# --- limbs ---------------------------------------------------------------------------------------


def _add_limb(
    flesh: Flesh, name: str, rows: list[list[float]], chain: tuple[int, int, int], above: int, sign: float
) -> None:
    """A tube from the ball around the limb's root through its middle joint to its end."""
    points = flesh.positions[list(chain)]
    places = np.concatenate(
        [np.linspace(0.0, 0.8, 8)[:-1], np.linspace(0.8, 1.2, 10), np.linspace(1.2, rows[-1][0], 10)[1:]]
    )
    radii = sample(rows, places) * flesh.stature
    centres = _along(points, places)
    across, ahead = frames_along(centres, sign)
    ball = float(radii[0].mean())
    tube = loft(
        centres, across, ahead, radii, places, sectors=16, caps=(0.9 * ball, 0.3 * float(radii[-1].mean()))
    )
    upper = float(np.linalg.norm(points[1] - points[0]))
    lower = float(np.linalg.norm(points[2] - points[1]))
    thick = sample(rows, [1.0, 2.0]).mean(axis=1) * flesh.stature
    weights = weigh_along(
        flesh,
        tube.places,
        (above, *chain),
        (0.0, 1.0, 2.0),
        (ball / upper, thick[0] / upper, thick[1] / lower),
    )
    # The ball keeps to its own joint for the most part, and so stays a ball.
    loose = 0.7 * weights[:, above]
    weights[:, above] -= loose
    weights[:, chain[0]] += loose
    flesh.add(name, tube, weights)


def _along(points: Array, places: Array) -> Array:
    """Points (n, 3) of a broken line through (k, 3) at places 0, 1, ...; straight on beyond its ends."""
    first = np.clip(np.floor(places).astype(int), 0, len(points) - 2)
    share = (places - first)[:, None]
    return np.asarray((1.0 - share) * points[first] + share * points[first + 1])


# --- trunk ---------------------------------------------------------------------------------------


def _add_trunk(flesh: Flesh, sizes: dict[str, Any], head: dict[str, Any]) -> Array:
    """Pelvis, belly, chest and neck in one; returns the middle of the head (3,)."""
    r, stature = flesh.figure.roles, flesh.stature
    hips, shoulders = flesh.positions[list(r.hip)], flesh.positions[list(r.shoulder)]
    crown = flesh.find_crown(head["above_joint"], head["above_site"])
    middle = crown + stature * np.array([0.0, -0.5 * head["height"], head["front_of_joint"]])
    line = np.array([hips.mean(axis=0), shoulders.mean(axis=0), middle])
    line[2, 1] = max(line[2, 1], line[1, 1] + 0.08 * stature)
    rows = sizes["sections"]
    places = np.concatenate(
        [np.linspace(rows[0][0], 0.9, 20)[:-1], np.linspace(0.9, 1.5, 12), np.linspace(1.5, 2.0, 4)[1:]]
    )
    breadth, front, back, exponents = sample(rows, places).T
    wide = [
        (np.ptp(hips[:, 0]) / 2 / stature + sizes["hip_flesh"]) / (sizes["hip_breadth"] + sizes["hip_flesh"]),
        np.ptp(shoulders[:, 0]) / 2 / stature / sizes["shoulder_breadth"],
    ]
    breadth = breadth * np.interp(places, [0.0, 1.0, 1.1, 1.4], [*np.clip([*wide, wide[1]], *BREADTHS), 1.0])
    radii = stature * np.column_stack([breadth, breadth, front, back])
    trunk = loft(
        _along(line, places),
        np.array([1.0, 0.0, 0.0]),
        np.array([0.0, 0.0, 1.0]),
        radii,
        places,
        sectors=32,
        exponents=exponents,
        caps=(0.012 * stature, 0.01 * stature),
    )
    flesh.add("trunk", trunk, _weigh_trunk(flesh, trunk.vertices))
    return np.asarray(line[2])


def _weigh_trunk(flesh: Flesh, vertices: Array) -> Array:
    """Weights (V, J): the spine by height; beside it the clavicles, and a little of the limbs."""
    figure, stature = flesh.figure, flesh.stature
    r = figure.roles
    chain = (r.pelvis, *r.spine)
    heights = flesh.positions[list(chain), 1]
    heights[1:] = np.maximum.accumulate(heights[1:])
    weights = weigh_along(flesh, vertices[:, 1], chain, tuple(heights[1:]), _half_windows(heights, stature))

    def give(joint: int, share: Array) -> None:
        weights[:] *= 1.0 - share[:, None]
        weights[:, joint] += share

    for k, (_, sign) in enumerate(SIDES):
        shoulder, hip = flesh.positions[r.shoulder[k]], flesh.positions[r.hip[k]]
        outward, height = sign * vertices[:, 0], vertices[:, 1]
        if r.clavicle:
            inner = max(sign * flesh.positions[r.clavicle[k], 0], 0.0)
            span = max(sign * shoulder[0] - inner, 0.03 * stature)
            high = smooth_step((height - shoulder[1]) / (0.12 * stature) + 1.0)
            give(r.clavicle[k], smooth_step((outward - inner) / span) * high)
        near = 1.0 - np.linalg.norm(vertices - shoulder, axis=1) / (0.075 * stature)
        give(r.shoulder[k], 0.35 * smooth_step(near))
        low = smooth_step((hip[1] + 0.03 * stature - height) / (0.12 * stature))
        give(r.hip[k], 0.45 * low * smooth_step(outward / (0.05 * stature)))
    return weights


def _half_windows(heights: Array, stature: float) -> tuple[float, ...]:
    """How far each joint's bend spreads up and down [m]: half way to the next joint that is elsewhere."""
    out = []
    for own in heights[1:]:
        gaps = np.abs(heights - own)
        gaps = gaps[gaps > 0.01 * stature]
        out.append(float(np.clip(0.5 * gaps.min(initial=0.1 * stature), 0.02 * stature, 0.06 * stature)))
    return tuple(out)
