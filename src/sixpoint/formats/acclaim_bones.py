"""The bones of an Acclaim skeleton and how they hang together.

A bone ends where *all* its children start, which few rigs obey. Our own writer therefore needs bones that
only place a joint (``<child>__link``) or a site (``<site>__site``): here they are folded away again.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Hinges

Array = NDArray[np.float64]

LINK = "__link"
SITE = "__site"
WIDE_OPEN = 2 * np.pi
"""Limit of a hinge for which the file states none [rad]."""

_AXES = dict(zip("xyz", np.eye(3), strict=True))


@dataclass(frozen=True, eq=False)
class Bone:
    """One bone in file units.

    Attributes:
        vector: (3,) from its start to its end in the rest pose.
        frame: (4,) rotation of its axis frame, in which its dofs turn.
        dofs: Names of its degrees of freedom, in the order of the values in the AMC.
        limits: (k, 2) least and largest value of each dof [rad or file units].
    """

    name: str
    vector: Array
    frame: Array
    dofs: tuple[str, ...]
    limits: Array

    @property
    def turns(self) -> tuple[str, ...]:
        """Axes of its rotations in the order in which they are applied, e.g. ("x", "z")."""
        return tuple(dof[1] for dof in self.dofs if dof[0] == "r")

    def compute_hinges(self) -> Hinges | None:
        """Its rotations as hinges in sequence: the dof applied first is the last hinge."""
        if not self.turns:
            return None
        axes = rot.mul_vec(self.frame, np.array([_AXES[axis] for axis in reversed(self.turns)]))
        limits = self.limits[[dof[0] == "r" for dof in self.dofs]][::-1]
        return Hinges(axes, limits[:, 0], limits[:, 1])


class BoneTree:
    """Bones and who hangs on whom; knows which bones only place joints and sites."""

    def __init__(self, bones: dict[str, Bone], parents: dict[str, str]) -> None:
        self.bones = bones
        self.parents = parents
        self.children: dict[str, list[str]] = {}
        for child in bones:
            self.children.setdefault(parents[child], []).append(child)

    def is_link(self, name: str) -> bool:
        """Whether a bone only places the one joint that it is named after."""
        still = name in self.bones and not self.bones[name].dofs
        return still and name.endswith(LINK) and self.children.get(name) == [name.removesuffix(LINK)]

    def is_site(self, name: str) -> bool:
        """Whether a bone only places a site."""
        still = not self.bones[name].dofs and name not in self.children
        return still and bool(re.search(SITE + r"\d*\Z", name))

    def compute_start(self, name: str) -> Array:
        """Start of a bone seen from the joint above: the end of its bone and of the links between."""
        start, parent = np.zeros(3), self.parents[name]
        while self.is_link(parent):
            start, parent = start + self.bones[parent].vector, self.parents[parent]
        return start if parent == "root" else start + self.bones[parent].vector

    def joint_above(self, name: str) -> str:
        """The joint that a bone hangs on, links skipped."""
        parent = self.parents[name]
        while self.is_link(parent):
            parent = self.parents[parent]
        return parent

    def sorted_joints(self) -> list[str]:
        """Bones that are joints in file order, but parents first."""
        placed: dict[str, None] = {"root": None}
        for bone in self.bones:
            above = []
            while bone not in placed:
                above.append(bone)
                bone = self.parents[bone]
            placed |= dict.fromkeys(reversed(above))
        del placed["root"]
        return [name for name in placed if not self.is_link(name) and not self.is_site(name)]

    def find_sites(self) -> list[tuple[str, str, Array]]:
        """(name, carrying bone, offset) of every leaf bone's end and every bone that only places a site."""
        found = []
        for name, bone in self.bones.items():
            if self.is_site(name):
                site = re.sub(SITE + r"\d*\Z", "", name)
                found.append((site, self.joint_above(name), self.compute_start(name) + bone.vector))
            elif name not in self.children and np.any(bone.vector != 0):
                found.append((f"{name}_end", name, bone.vector))
        return found
