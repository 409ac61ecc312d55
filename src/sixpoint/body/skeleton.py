"""A skeleton: names, parents and rest offsets of any rig, as immutable arrays.

A joint is an index and a chain is an index array; there are no Joint or Bone objects.
Sites are points fixed to a joint that carry no rotation: end sites, tool and marker points.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.errors import SkeletonError, listed

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def frozen(values: object, dtype: type = np.float64) -> NDArray[np.generic]:
    """A C-contiguous, read-only array: the given one if it is that already, else a copy."""
    if isinstance(values, np.ndarray) and values.dtype == dtype and values.flags.c_contiguous:
        owner = values if values.base is None else values.base
        if not values.flags.writeable and not getattr(owner, "flags", values.flags).writeable:
            return values
    array: NDArray[np.generic] = np.array(values, dtype=dtype, order="C")
    array.flags.writeable = False
    return array


FEW = 200  # frames up to which forward kinematics goes by depth rather than by joint


@dataclass(frozen=True, eq=False, repr=False)
class Skeleton:
    """A tree of joints with rest offsets; joint 0 is the root and ``parents[j] < j``.

    Attributes:
        names: J distinct joint names.
        parents: (J,) parent index of each joint, -1 for the root.
        offsets: (J, 3) position of each joint in its parent's frame [m]; the root's is its rest position.
        site_names: M names of sites (need not be distinct).
        site_parents: (M,) joint that carries each site.
        site_offsets: (M, 3) position of each site in its joint's frame [m].
    """

    names: tuple[str, ...]
    parents: Index
    offsets: Array
    site_names: tuple[str, ...] = ()
    site_parents: Index = field(default_factory=lambda: np.zeros(0, np.int64))
    site_offsets: Array = field(default_factory=lambda: np.zeros((0, 3)))

    def __repr__(self) -> str:
        return f"Skeleton({len(self)} joints, {len(self.site_names)} sites, root {self.names[0]!r})"

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "names", tuple(self.names))
        set_(self, "site_names", tuple(self.site_names))
        set_(self, "parents", frozen(self.parents, np.int64))
        set_(self, "offsets", frozen(np.reshape(self.offsets, (-1, 3))))
        set_(self, "site_parents", frozen(self.site_parents, np.int64))
        set_(self, "site_offsets", frozen(np.reshape(self.site_offsets, (-1, 3))))
        count = len(self.names)
        if count == 0:
            raise SkeletonError("a skeleton needs at least one joint")
        duplicates = sorted(name for name, times in Counter(self.names).items() if times > 1)
        if duplicates:
            raise SkeletonError(f"joint names must be distinct; repeated: {listed(duplicates)}")
        if self.parents.shape != (count,) or self.offsets.shape != (count, 3):
            raise SkeletonError(
                f"{count} names need parents ({count},) and offsets ({count}, 3), "
                f"got {self.parents.shape} and {self.offsets.shape}"
            )
        wrong = [self.names[j] for j in range(count) if not self._parent_is_valid(j)]
        if wrong:
            raise SkeletonError(
                "joint 0 must be the only root (parent -1) and every parent must come before its "
                f"child; wrong at: {listed(wrong)}"
            )
        sites = len(self.site_names)
        if self.site_parents.shape != (sites,) or self.site_offsets.shape != (sites, 3):
            raise SkeletonError(f"{sites} site names need site_parents ({sites},), site_offsets ({sites}, 3)")
        if sites and not np.all((self.site_parents >= 0) & (self.site_parents < count)):
            raise SkeletonError("a site hangs on a joint that does not exist")
        if not (np.all(np.isfinite(self.offsets)) and np.all(np.isfinite(self.site_offsets))):
            raise SkeletonError("offsets must be finite numbers")

    def _parent_is_valid(self, joint: int) -> bool:
        parent = int(self.parents[joint])
        return parent == -1 if joint == 0 else 0 <= parent < joint

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """Children of each joint, in joint order."""
        lists: list[list[int]] = [[] for _ in self.names]
        for joint, parent in enumerate(self.parents[1:], start=1):
            lists[parent].append(joint)
        return tuple(tuple(c) for c in lists)

    def index(self, name: str) -> int:
        """Index of a joint by name; the error lists the joints there are."""
        try:
            return self.names.index(name)
        except ValueError:
            raise SkeletonError(f"no joint named {name!r}; joints: {listed(self.names)}") from None

    def path(self, ancestor: int, joint: int) -> list[int]:
        """Joints from ``ancestor`` down to ``joint``, both included; empty if it is no ancestor."""
        chain = [joint]
        while chain[-1] != ancestor:
            parent = int(self.parents[chain[-1]])
            if parent < 0:
                return []
            chain.append(parent)
        return chain[::-1]

    def subtree(self, joint: int) -> Index:
        """Indices of ``joint`` and all joints below it, in joint order."""
        inside = np.zeros(len(self), bool)
        inside[joint] = True
        for below in range(joint + 1, len(self)):
            inside[below] = inside[self.parents[below]]
        return np.flatnonzero(inside)

    @cached_property
    def ways_down(self) -> tuple[Array, tuple[tuple[str, int] | None, ...]]:
        """Per joint: length of the longest way down [units of the offsets], and what it leads to next.

        That is ``("joint", child)``, ``("site", site)`` or None at a tip.
        """
        way = np.zeros(len(self))
        ahead: list[tuple[str, int] | None] = [None] * len(self)
        for site, joint in enumerate(self.site_parents):
            length = float(np.linalg.norm(self.site_offsets[site]))
            if length > way[joint]:
                way[joint], ahead[joint] = length, ("site", site)
        lengths = np.linalg.norm(self.offsets, axis=1)
        for joint in range(len(self) - 1, 0, -1):  # children come after their parents
            parent = self.parents[joint]
            length = float(way[joint] + lengths[joint])
            if length > way[parent] or ahead[parent] is None:
                way[parent], ahead[parent] = length, ("joint", joint)
        return way, tuple(ahead)

    def longest_chain(self, joint: int) -> list[tuple[int, Array]]:
        """Joints of the longest way down, each with its bone (3,): offset to the next point, 0 at a tip."""
        chain: list[tuple[int, Array]] = []
        while True:
            kind, k = self.ways_down[1][joint] or ("tip", joint)
            if kind == "joint":
                chain.append((joint, self.offsets[k]))
                joint = k
                continue
            chain.append((joint, self.site_offsets[k] if kind == "site" else np.zeros(3)))
            return chain

    def common_ancestor(self, joints: Sequence[int]) -> int:
        """The deepest joint that is an ancestor of (or equal to) all of ``joints``."""
        common = self.path(0, joints[0])
        for joint in joints[1:]:
            other = set(self.path(0, joint))
            common = [j for j in common if j in other]
        return common[-1]

    def sites_of(self, joint: int) -> Index:
        """Indices of the sites that hang on a joint."""
        return np.flatnonzero(self.site_parents == joint)

    def compute_transforms(
        self, rotations: Array, translations: Array | None = None, moving: Sequence[int] = (0,)
    ) -> tuple[Array, Array]:
        """Forward kinematics over any leading axes.

        Args:
            rotations: (..., J, 4) local rotations, parent<-joint.
            translations: (..., len(moving), 3) local positions of the joints in ``moving`` [m];
                None keeps the rest offsets.
            moving: Joints whose local position is not the rest offset.

        Returns:
            World positions (..., J, 3) [m] and world rotations (..., J, 4).
        """
        rotations = np.asarray(rotations, float)
        lead = rotations.shape[:-2]
        local = np.broadcast_to(self.offsets, (*lead, len(self), 3))
        if translations is not None:
            local = local.copy()
            local[..., list(moving), :] = translations
        positions, world = np.array(local), rotations.copy()
        few = world.size < FEW * 4 * len(self)
        for joints, parents in self._generations if few else self._one_by_one:
            above = world[..., parents, :]
            positions[..., joints, :] = positions[..., parents, :] + rot.mul_vec(above, local[..., joints, :])
            world[..., joints, :] = rot.mul(above, rotations[..., joints, :])
        return positions, world

    @cached_property
    def _generations(self) -> tuple[tuple[Index, Index], ...]:
        """Joints of the same depth and their parents, from the root's children on."""
        depth = np.zeros(len(self), np.int64)
        for joint in range(1, len(self)):
            depth[joint] = depth[self.parents[joint]] + 1
        alike = [np.flatnonzero(depth == level) for level in range(1, int(depth.max()) + 1)]
        return tuple((joints, self.parents[joints]) for joints in alike)

    @cached_property
    def _one_by_one(self) -> tuple[tuple[slice, slice], ...]:
        """Each joint and its parent, as slices: views, where copies of many frames would cost more."""
        pairs = [(j, int(self.parents[j])) for j in range(1, len(self))]
        return tuple((slice(j, j + 1), slice(p, p + 1)) for j, p in pairs)

    def compute_sites(self, positions: Array, world: Array) -> Array:
        """World positions (..., M, 3) [m] of the sites, from the joints' world transforms."""
        carrier = self.site_parents
        return positions[..., carrier, :] + rot.mul_vec(world[..., carrier, :], self.site_offsets)
