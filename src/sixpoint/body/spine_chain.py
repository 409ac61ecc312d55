"""The trunk as the solvers see it: joints that rotate and the segments they carry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.skeleton import frozen
from sixpoint.errors import FigureError

if TYPE_CHECKING:
    from sixpoint.body.figure import Figure

Array = NDArray[np.float64]

COINCIDENT = 1e-3  # joints nearer than this [m] are at the same place
CHEST, NECK, HEAD = 3.0, 5.0, 6.0  # stations of the trunk, those of a spine of three joints and a neck of two


@dataclass(frozen=True, eq=False)
class SpineChain:
    """The trunk's rotating joints and the segments they carry; joints at the same place are merged.

    Attributes:
        joints: S joints that rotate, the pelvis first; joint k carries segment k.
        segments: (S, 3) segment vectors in the neutral pose [m]; their sum is the chord pelvis -> head.
        node: Trunk joint -> index of the chain node at its place (S is the head's).
    """

    joints: tuple[int, ...]
    segments: Array
    node: Mapping[int, int]

    @classmethod
    def from_figure(cls, figure: Figure, own_pelvis: bool = False) -> SpineChain:
        """Merge coincident joints: of joints at one place the first rotates, the others follow.

        Args:
            figure: Whose trunk.
            own_pelvis: A spine joint at the pelvis' place rotates apart from it; the pelvis then carries a
                segment without length.
        """
        trunk = (figure.roles.pelvis, *figure.roles.spine)
        places = [figure.rest_positions[j] for j in trunk]
        node = {trunk[0]: 0}
        joints, points = [trunk[0]], [places[0]]
        for joint, place in zip(trunk[1:], places[1:], strict=True):
            first = own_pelvis and len(joints) == 1 and len(trunk) > 2
            if first or np.linalg.norm(place - points[-1]) > COINCIDENT:
                joints.append(joint)
                points.append(place)
            node[joint] = len(points) - 1
        if np.linalg.norm(figure.head_offset) > COINCIDENT:
            points.append(places[-1] + figure.head_offset)
        else:
            joints = joints[: len(points) - 1]  # the head joint carries nothing: it follows its neck
        if len(points) < 2:
            raise FigureError("pelvis and head are at the same place: the trunk has no length")
        return cls(tuple(joints), frozen(np.diff(points, axis=0)), node)  # type: ignore[arg-type]

    def stations(self, chest: int) -> Array:
        """Where each joint stands in any trunk: 0 the pelvis, 3 the chest, 5 the top of the neck, 6 the head.

        Joints between stand at even distances, so that a curve of the trunk that is given by rotations at the
        seven stations can be carried over to any number of joints.

        Args:
            chest: The joint of the chain that carries the arms.

        Returns:
            (S,) station of each joint.
        """
        last = len(self.joints) - 1
        turned = max(self.node.values()) == last > chest  # the last joint is the head's: an end site follows
        necks = last - chest - turned
        out = [CHEST * k / max(chest, 1) for k in range(chest + 1)]
        out += [CHEST + (NECK - CHEST) * k / necks for k in range(1, necks + 1)]
        return np.array(out + [HEAD] * turned)
