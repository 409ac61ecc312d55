"""Where parts of a posed body are still in each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure, SpineChain
from sixpoint.body.motion import Motion
from sixpoint.body.surface.flesh_regions import PALM, thigh_radii, unit_of
from sixpoint.body.surface.prisms import build_prisms
from sixpoint.errors import SkeletonError
from sixpoint.solvers.avoidance.depths import find_depths
from sixpoint.solvers.avoidance.options import AVOIDABLE, arm_lengths, check_avoid
from sixpoint.solvers.avoidance.packing import WIDTH, pack_flesh, pack_thighs

Array = NDArray[np.float64]

PLACES = {
    "elbows": "elbows in the trunk",
    "forearms": "forearms or hands in trunk or head",
    "thighs": "thighs in each other",
    "arms": "arms in the thighs",
}
"""What each part is in."""


def find_penetration(
    figure: Figure, motion: Motion, parts: Sequence[str] | str = AVOIDABLE
) -> dict[str, Array]:
    """How deep parts of a body are in others, by the prisms and capsules that solvers keep apart.

    It needs no mesh of the frames and takes microseconds each. Balls and prisms are wider than flesh, so it
    says more rather than less: beside the mesh up to 4 cm, hardly ever less than the mesh by 5 mm. Wrists
    count where they are, though no solver can take them out.

    Args:
        figure: Whose body; its shape tells how thick, else a lean adult's measures.
        motion: Postures of its rig.
        parts: Names of ``AVOIDABLE``.

    Returns:
        Depths of each part [m], 0 outside: (F, 2) of the left and the right arm; "thighs" (F, 1).

    Raises:
        SixpointError: There is no such part.
        SkeletonError: The motion is of another rig.
    """
    names = check_avoid(parts)
    if motion.skeleton is not figure.skeleton and motion.skeleton.names != figure.skeleton.names:
        raise SkeletonError(
            f"the motion has {len(motion.skeleton)} joints of another rig than the figure's "
            f"{len(figure.skeleton)}; take the figure that was posed"
        )
    roles, chain = figure.roles, SpineChain.from_figure(figure, own_pelvis=True)
    positions, world = motion.transforms
    rows = np.pad(positions, ((0, 0), (0, 0), (0, 1)))
    joints = list(chain.joints)
    turned = np.ascontiguousarray(rot.mul(world[:, joints], rot.inv(figure.neutral[joints])))
    trunk = np.ascontiguousarray(rows[:, joints])
    arms = np.ascontiguousarray(rows[:, [j for limb in roles.limbs[:2] for j in limb]])
    legs = np.ascontiguousarray(rows[:, [j for limb in roles.limbs[2:] for j in limb[:2]]])
    lengths, radii, palm = arm_lengths(figure), thigh_radii(figure), PALM * unit_of(figure)
    nothing, no_arm = np.zeros((1, WIDTH)), pack_thighs(radii, (), lengths, False, palm)
    depths, apart = np.zeros((len(positions), 2)), np.zeros(len(positions))
    found = {}
    for name in names:
        table, thighs = nothing, no_arm
        if name == "elbows":
            table = pack_flesh(build_prisms(figure, chain), lengths, False)
        elif name == "forearms":
            prisms = build_prisms(figure, chain, head=True)
            table = pack_flesh(replace(prisms, elbow=()), lengths, True)
        elif name == "arms":
            prisms = build_prisms(figure, chain)
            thighs = pack_thighs(radii, (*prisms.elbow, *prisms.forearm), lengths, False, palm)
        work = np.zeros((len(joints), 4))
        find_depths(np.ascontiguousarray(table), thighs, turned, trunk, arms, legs, work, depths, apart)
        found[name] = apart[:, None].copy() if name == "thighs" else depths.copy()
    return found


def describe_penetration(depths: dict[str, Array], least: float = 1e-3) -> list[str]:
    """Sentences on what is still inside, one per part.

    Args:
        depths: As of ``find_penetration`` [m].
        least: Depth that counts [m].
    """
    said = []
    for name, depth in depths.items():
        deepest = depth.max(axis=1)
        count = int((deepest > least).sum())
        if count:
            most = 1e3 * deepest.max()
            said.append(f"{PLACES[name]} in {count} of {len(deepest)} frames, at most {most:.0f} mm")
        else:
            said.append(f"no {PLACES[name]}")
    return said
