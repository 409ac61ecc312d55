"""Six points of one body for another body.

Retargeting needs to know where limbs begin, which six points do not say: so it takes the posture of the body
that they came from, recorded or solved. Two modes:

- ``relative`` keeps the pose. The trunk bends and the shoulders shrug as they did; every wrist and ankle
  keeps its direction from the root of its limb, and its distance scales with the limb; the middle of the hips
  travels in proportion to the legs, so that feet that stood on the floor stand on it.
- ``absolute`` keeps what hands and feet touch. Wrists stay where they were in the world, and so do the soles
  under the ankles; the trunk is posed as above, at the height at which limbs reach as far as possible, legs
  first, or arms first for a body that hangs.

Every frame is carried over alone: nothing of it depends on its neighbours, so gaps stay gaps.

Reference: for the relative mode Kulpa, Multon & Arnaldi 2005, "Morphology-independent representation of
motions for interactive human-like animation", Computer Graphics Forum 24; for the absolute one see also Shin
et al. 2001, "Computer puppetry: an importance-based approach", ACM Transactions on Graphics 20.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.body.reach import Ends, find_lift
from sixpoint.body.soles import ankle_height
from sixpoint.body.spine_chain import HEAD
from sixpoint.body.targets import Targets
from sixpoint.errors import FigureError, TargetError, listed

Array = NDArray[np.float64]
Mode = Literal["relative", "absolute"]

MODES: tuple[Mode, ...] = get_args(Mode)
WHOLE = 0.985  # share of a limb that counts as its reach: a solver puts hips only nearly where they are here


def carry_points(
    points: Targets,
    posed: Motion,
    source: Figure,
    figure: Figure,
    mode: Mode = "relative",
    floor: float = 0.0,
    first: Ends = "feet",
) -> Targets:
    """Six points of a body for another one.

    Args:
        points: Of the source, F frames; a lost point stays lost. Rotations are kept as they are.
        posed: The source's posture in these frames, as recorded or as solved for the points. What it misses
            of a point (an unreachable one) is scaled and kept.
        source: Whose points these are.
        figure: For whom they shall be.
        mode: "relative" keeps the pose, "absolute" what hands and feet touch.
        floor: Height of the floor [m].
        first: In absolute mode, who has the last word where not all can reach: "hands" for a body that hangs.

    Raises:
        TargetError: An unknown mode, another number of frames, a floor that is no number.
        FigureError: The posture is on another rig than the source's.
    """
    _check(points, posed, source, mode, floor, first)
    shoulders_hips = [*source.roles.shoulder, *source.roles.hip]
    missed = points.positions - source.targets(posed).positions
    missed = np.where(np.isfinite(missed), missed, 0.0)
    roots = posed.positions[:, shoulders_hips] + missed[:, :1]
    ends = points.positions[:, 2:]
    limbs = figure.limb_lengths / source.limb_lengths
    legs = float(limbs[2:].mean())
    soles = np.array([ankle_height(source), ankle_height(figure)])

    trunk = carry_trunk(posed, source, figure)
    new_roots = trunk.positions[:, [*figure.roles.shoulder, *figure.roles.hip]]
    stretch = _trunk_length(figure) / _trunk_length(source)
    head = figure.targets(trunk).positions[:, 1] + stretch * (missed[:, 1] - missed[:, 0])

    hips = roots[:, 2:].mean(axis=1)
    place = hips * (legs if mode == "relative" else 1.0)
    place[:, 1] = floor + soles[1] + legs * (hips[:, 1] - floor - soles[0])
    pelvis = place - new_roots[:, 2:].mean(axis=1)
    new_roots, head = new_roots + pelvis[:, None], head + pelvis
    if mode == "relative":
        new_ends = new_roots + limbs[:, None] * (ends - roots)
    else:
        new_ends = ends.copy()
        new_ends[:, 2:, 1] += soles[1] - soles[0]
        reach = np.full((len(ends), 4), WHOLE)
        was = np.linalg.norm(ends[:, :2] - roots[:, :2], axis=2) / source.limb_lengths[:2]
        reach[:, :2] = np.clip(np.nan_to_num(was), WHOLE, 1.0)  # an arm that was straight may be so again
        lift = find_lift(new_roots, new_ends, reach * figure.limb_lengths, first)
        pelvis, head = pelvis + lift, head + lift
    out = np.concatenate([np.stack([pelvis, head], axis=1), new_ends], axis=1)
    out[~points.tracked] = np.nan
    return replace(points, positions=out)


def carry_trunk(posed: Motion, source: Figure, figure: Figure) -> Motion:
    """The trunk's posture on another rig: pelvis at the origin, turned as it was, limbs hanging.

    The spines may have any numbers of joints: what is carried over is a curve of world rotations along the
    trunk, see ``SpineChain.stations``.
    """
    world = rot.mul(posed.transforms[1], rot.inv(source.neutral))
    return _pose(figure, _turn_trunk(world, source, figure), posed.rate)


def carry_pose(posed: Motion, source: Figure, figure: Figure) -> Motion:
    """The posture on another rig: trunk as ``carry_trunk`` has it, limbs turned in the world as they were.

    So joint angles stay. Wrists and ankles are where ``carry_points`` puts them only if the parts of a limb
    are in proportion; a solver that takes a pose to start from brings them there.
    """
    world = rot.mul(posed.transforms[1], rot.inv(source.neutral))
    wished = _turn_trunk(world, source, figure)
    for ours, theirs in zip(source.roles.limbs, figure.roles.limbs, strict=True):
        wished |= {b: world[:, a] for a, b in zip(ours, theirs, strict=True)}
    return _pose(figure, wished, posed.rate)


def _turn_trunk(world: Array, source: Figure, figure: Figure) -> dict[int, Array]:
    """Trunk joints of a figure -> rotations (F, 4) in the world, as the source's (F, J, 4) are."""
    stations = _stations(source)
    at: list[float] = []
    turns: list[Array] = []
    for joint in (source.roles.pelvis, *source.roles.spine):
        if at and stations[joint] == at[-1]:
            turns[-1] = world[:, joint]  # of joints at one place the last turns what follows
        else:
            at.append(stations[joint])
            turns.append(world[:, joint])
    curve = np.stack(turns, axis=1)
    wished = {figure.roles.pelvis: world[:, source.roles.pelvis]}
    for joint in figure.roles.spine:
        wished[joint] = _interpolate(np.array(at), curve, _stations(figure)[joint])
    if source.roles.clavicle:
        wished |= {b: world[:, a] for a, b in zip(source.roles.clavicle, figure.roles.clavicle, strict=False)}
    return wished


def _pose(figure: Figure, wished: dict[int, Array], rate: float) -> Motion:
    """A motion in which some joints are turned in the world as wished (F, 4), and the others rest on them."""
    frames = len(wished[figure.roles.pelvis])
    local = np.tile(rot.IDENTITY, (frames, len(figure.skeleton), 1))
    for joint, turn in wished.items():
        above = next((j for j in figure.skeleton.path(0, joint)[-2::-1] if j in wished), None)
        local[:, joint] = turn if above is None else rot.mul(rot.inv(wished[above]), turn)
    return figure.compute_motion(local, np.zeros((frames, 3)), rate)


# --- proportions ---------------------------------------------------------------------------------


def _trunk_length(figure: Figure) -> float:
    return float(np.linalg.norm(figure.spine_chain.segments, axis=1).sum())


def _stations(figure: Figure) -> dict[int, float]:
    """Where each trunk joint stands in any trunk, 0 the pelvis, 3 the chest, 6 the head."""
    chain, roles = figure.spine_chain, figure.roles
    first = roles.clavicle[0] if roles.clavicle else roles.shoulder[0]
    carrier = next(j for j in figure.skeleton.path(0, first)[-2::-1] if j in chain.node)
    nodes = chain.stations(min(chain.node[carrier], len(chain.joints) - 1))
    return {j: float(nodes[n]) if n < len(nodes) else HEAD for j, n in chain.node.items()}


def _interpolate(at: Array, turns: Array, station: float) -> Array:
    """Rotations (F, 4) at a station, of rotations (F, S, 4) at rising stations (S,)."""
    above = int(np.clip(np.searchsorted(at, station), 1, max(len(at) - 1, 1)))
    if len(at) == 1 or station <= at[above - 1]:
        return np.asarray(turns[:, above - 1])
    share = min((station - at[above - 1]) / (at[above] - at[above - 1]), 1.0)
    a, b = turns[:, above - 1], turns[:, above]
    b = np.where(np.sum(a * b, axis=-1, keepdims=True) < 0.0, -b, b)
    return rot.normalised((1.0 - share) * a + share * b)


def _check(points: Targets, posed: Motion, source: Figure, mode: str, floor: float, first: str) -> None:
    if mode not in MODES:
        raise TargetError(f"unknown mode of retargeting {mode!r}; modes: {listed(MODES)}")
    if first not in get_args(Ends):
        raise TargetError(f"feet or hands go first, got {first!r}")
    if len(points) != len(posed):
        raise TargetError(f"{len(points)} frames of points need as many of the posture, got {len(posed)}")
    if not np.isfinite(floor):
        raise TargetError(f"the floor is a height in metres, got {floor}")
    if posed.skeleton.names != source.skeleton.names:
        raise FigureError("the posture is on another rig than the source figure's")
