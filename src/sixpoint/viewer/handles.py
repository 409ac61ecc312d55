"""What is dragged: six balls and two obstacles.

A ball moves with the mouse in the plane of the screen; the last one touched has arrows and planes, and rings
where its rotation counts.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from sixpoint.body.targets import EFFECTORS
from sixpoint.viewer.body_view import as_wxyz
from sixpoint.viewer.colours import INK

Array = NDArray[np.float64]
Dragged = Callable[[int, Array, Array], None]
"""Told number, position (3,) [m] and rotation (4,) xyzw of what is dragged."""

RADIUS = 0.036  # of a ball, on a figure of 1.6 m [m]


class Handle:
    """A thing that is dragged by itself or by its arrows.

    Args:
        scene: Where it is added.
        name: Of its nodes.
        thing: Makes what is seen and grabbed, given the name of the node.
        number: By which it reports.
        dragged: Told where it is dragged to.
        scale: Size of the arrows [m].
        turns: Whether it may be turned.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        thing: Callable[[str], Any],
        number: int,
        dragged: Dragged,
        *,
        scale: float = 0.2,
        turns: bool = False,
        touched: Callable[[int], None] = lambda number: None,
    ) -> None:
        self._gizmo = scene.add_transform_controls(
            f"{name}_arrows",
            scale=scale,
            line_width=2.2,
            depth_test=False,
            disable_rotations=not turns,
            visible=False,
        )
        self._thing = thing(name)
        self._number, self._dragged, self._touched = number, dragged, touched
        self._grip = np.zeros(3)  # from the pointer to the middle
        self._thing.on_drag(self._on_drag)
        self._thing.on_click(self._on_click)
        self._gizmo.on_update(self._on_gizmo)

    async def _on_drag(self, event: Any) -> None:
        # In order on the server's loop, since it is async and awaits nothing.
        if event.phase == "start":
            self._grip = np.asarray(self._thing.position) - event.start_position
            self._touched(self._number)
        elif event.phase == "update":
            place = self._grip + event.end_position
            self.place(place)
            self._report()

    async def _on_click(self, event: Any) -> None:
        self._touched(self._number)

    async def _on_gizmo(self, event: Any) -> None:
        if event.phase == "update":
            self._thing.position, self._thing.wxyz = self._gizmo.position, self._gizmo.wxyz
            self._report()

    def _report(self) -> None:
        turned = np.asarray(self._gizmo.wxyz)[[1, 2, 3, 0]]
        self._dragged(self._number, np.array(self._thing.position), turned)

    @property
    def position(self) -> Array:
        """(3,) where it is [m]."""
        return np.array(self._thing.position)

    def place(self, position: Array, rotation: Array | None = None) -> None:
        """Put it somewhere: (3,) [m], (4,) xyzw; a position that is not finite hides it."""
        known = bool(np.all(np.isfinite(position)))
        self._thing.visible = known
        if known:
            self._thing.position = self._gizmo.position = np.asarray(position, float)
        if rotation is not None and np.all(np.isfinite(rotation)):
            self._thing.wxyz = self._gizmo.wxyz = as_wxyz(rotation)

    def set_turns(self, turns: bool) -> None:
        """Whether it may be turned."""
        if self._gizmo.disable_rotations == turns:
            self._gizmo.disable_rotations = not turns

    @property
    def selected(self) -> bool:
        """Whether its arrows are shown."""
        return bool(self._gizmo.visible)

    @selected.setter
    def selected(self, selected: bool) -> None:
        if self._gizmo.visible != selected:
            self._gizmo.visible = selected

    @property
    def visible(self) -> bool:
        """Whether it is there."""
        return bool(self._thing.visible)

    @visible.setter
    def visible(self, visible: bool) -> None:
        self._thing.visible = visible
        if not visible:
            self.selected = False

    def remove(self) -> None:
        """Take it off the page."""
        self._thing.remove()
        self._gizmo.remove()


class Handles:
    """The six effectors' handles.

    Args:
        scene: Where they are added.
        dragged: Told which one goes where; see ``Dragged``.
        unit: Size of the figure over 1.6 m.
    """

    def __init__(self, scene: viser.SceneApi, dragged: Dragged, unit: float) -> None:
        def ball(name: str) -> viser.IcosphereHandle:
            return scene.add_icosphere(
                name, radius=RADIUS * unit, color=INK, cast_shadow=False, receive_shadow=False
            )

        self._all = [
            Handle(scene, f"/handles/{name}", ball, k, dragged, scale=0.2 * unit, touched=self.select)
            for k, name in enumerate(EFFECTORS)
        ]

    def select(self, number: int | None) -> None:
        """Show the arrows of one."""
        for k, handle in enumerate(self._all):
            handle.selected = k == number

    def place(self, points: Array, rotations: Array | None = None, *, but: int | None = None) -> None:
        """Put them at (6, 3) [m] and turn them to (6, 4); ``but`` one that is being dragged."""
        for k, handle in enumerate(self._all):
            if k != but:
                handle.place(points[k], None if rotations is None else rotations[k])

    def set_turns(self, turns: list[bool]) -> None:
        """Which ones may be turned."""
        for handle, may in zip(self._all, turns, strict=True):
            handle.set_turns(may)

    @property
    def positions(self) -> Array:
        """(6, 3) where they are [m]."""
        return np.array([handle.position for handle in self._all])

    @property
    def visible(self) -> bool:
        """Whether they are shown."""
        return any(handle.visible for handle in self._all)

    @visible.setter
    def visible(self, visible: bool) -> None:
        for handle in self._all:
            handle.visible = visible

    def remove(self) -> None:
        """Take them off the page."""
        for handle in self._all:
            handle.remove()
