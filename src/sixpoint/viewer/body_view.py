"""A body on the page: a mannequin in a few batches of balls and tubes, so that a frame is little to send."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import viser
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.mannequin import Mannequin
from sixpoint.viewer.colours import GHOST, LIMIT, SIDES, as_linear
from sixpoint.viewer.meshes import find_tubes, make_sphere, make_tube

Array = NDArray[np.float64]

OPACITY = 0.36  # of the truth
SWOLLEN = 1.22  # ball of a joint at its limit


def as_wxyz(q: Array) -> Array:
    """Quaternions xyzw in the order that viser takes."""
    return np.asarray(q)[..., [3, 0, 1, 2]]


class BodyView:
    """One body.

    Args:
        scene: Where it is added.
        name: Of its node.
        figure: Whose body.
        ghost: The truth: grey, translucent and with flesh; else coloured and slim.
    """

    def __init__(self, scene: viser.SceneApi, name: str, figure: Figure, *, ghost: bool = False) -> None:
        self._body = Mannequin.of(figure, slim=not ghost)
        self._root = scene.add_frame(name, show_axes=False, visible=False)
        self._tubes = find_tubes(self._body)
        self._ghost = ghost
        colours = as_linear([GHOST if ghost else SIDES[part.side] for part in self._body.parts])
        self._ball_colours = np.empty((len(self._body.radii), 3), np.uint8)
        for part, colour in zip(self._body.parts, colours, strict=True):
            self._ball_colours[part.balls] = colour
        self._painted: frozenset[int] = frozenset()
        centres = self._body.place(*figure.neutral_pose.compute_transforms())
        opacity = OPACITY if ghost else None
        self._balls = scene.add_batched_meshes_simple(
            f"{name}/balls",
            *make_sphere(),
            batched_wxyzs=np.tile([1.0, 0, 0, 0], (len(centres), 1)),
            batched_positions=centres,
            batched_scales=self._body.radii,
            batched_colors=self._ball_colours,
            lod="off",
            opacity=opacity,
            cast_shadow=not ghost,
            receive_shadow=False,
        )
        self._limbs = []
        for k, tubes in enumerate(self._tubes):
            positions, turned, scales = tubes.place(centres, self._body.radii)
            handle = scene.add_batched_meshes_simple(
                f"{name}/tubes_{k}",
                *make_tube(tubes.taper),
                batched_wxyzs=as_wxyz(turned),
                batched_positions=positions,
                batched_scales=scales,
                batched_colors=colours[tubes.part],
                lod="off",
                opacity=opacity,
                cast_shadow=not ghost,
                receive_shadow=False,
            )
            self._limbs.append(handle)

    def show(self, positions: Array, world: Array) -> None:
        """Pose it.

        Args:
            positions: (J, 3) of the figure's joints in the world [m].
            world: (J, 4) their world rotations.
        """
        centres = self._body.place(positions, world)
        self._balls.batched_positions = centres.astype(np.float32)
        for tubes, handle in zip(self._tubes, self._limbs, strict=True):
            places, turned, scales = tubes.place(centres, self._body.radii)
            handle.batched_positions = places.astype(np.float32)
            handle.batched_wxyzs = as_wxyz(turned).astype(np.float32)
            handle.batched_scales = scales.astype(np.float32)
        self.visible = True

    def paint(self, joints: Collection[int]) -> None:
        """Show which joints are at their limits."""
        asked = frozenset(joints)
        if asked == self._painted or self._ghost:
            return
        self._painted = asked
        at_limit = np.isin(self._body.joints, list(asked)) & ~self._body.offsets.any(axis=1)
        self._balls.batched_colors = np.where(at_limit[:, None], as_linear(LIMIT), self._ball_colours)
        self._balls.batched_scales = np.where(at_limit, SWOLLEN, 1.0).astype(
            np.float32
        ) * self._body.radii.astype(np.float32)

    @property
    def visible(self) -> bool:
        """Whether it is shown; a new body is not, until it has a pose."""
        return bool(self._root.visible)

    @visible.setter
    def visible(self, visible: bool) -> None:
        if self._root.visible != visible:
            self._root.visible = visible

    def move(self, shift: Array) -> None:
        """Stand it elsewhere: (3,) [m]; a ghost that stands by itself is not translucent."""
        if not np.array_equal(self._root.position, shift):
            self._root.position = np.asarray(shift, float)
            for handle in (self._balls, *self._limbs):
                handle.opacity = OPACITY if self._ghost and not np.any(shift) else None

    def remove(self) -> None:
        """Take it off the page."""
        self._root.remove()
