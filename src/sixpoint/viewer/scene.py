"""The scene: a floor, a body over its truth, six handles and two obstacles."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.mannequin import HEIGHT
from sixpoint.viewer.body_view import BodyView
from sixpoint.viewer.colours import FLOOR, GRID, SECTION, WOOD
from sixpoint.viewer.handles import Handle, Handles

Array = NDArray[np.float64]
Report = Callable[[str, Any], None]
"""Told the name of what happened and its value, on the server's thread; must return at once."""

SPHERE, BOX = 0.15, (0.5, 0.06, 0.35)
"""Radius of the sphere and sides of the box that may stand in the way [m]."""
OBSTACLES = ("sphere", "box")
BESIDE = (-1.0, 0.0, 0.0)  # where the truth stands when it is beside the result [m]
CAMERA, LOOK = (2.2, 1.45, 3.5), (0.0, 0.95, 0.0)


class Scene:
    """What is seen in three dimensions.

    Reports ``"drag"`` with (number of the effector, position (3,) [m], rotation (4,) xyzw), and
    ``"obstacle"`` with the same of an obstacle.

    Args:
        server: Where.
        report: Told what is dragged.
    """

    def __init__(self, server: viser.ViserServer, report: Report) -> None:
        self._server, self._report = server, report
        scene = server.scene
        scene.set_up_direction("+y")
        scene.world_axes.visible = False
        scene.configure_default_lights(enabled=False)
        scene.configure_environment_map("studio", environment_intensity=0.35)
        scene.add_light_directional("/sun", intensity=1.9, position=(2.0, 4.0, 2.5), cast_shadow=True)
        scene.add_light_directional("/fill", intensity=0.55, position=(-3.0, 2.0, 1.0))
        scene.add_grid(
            "/floor",
            plane="xz",
            width=12.0,
            height=12.0,
            cell_size=0.25,
            section_size=1.0,
            cell_color=GRID,
            section_color=SECTION,
            shadow_opacity=0.22,
            plane_color=FLOOR,
            plane_opacity=1.0,
            fade_distance=14.0,
            fade_from="origin",
        )
        server.initial_camera.position = CAMERA
        server.initial_camera.look_at = LOOK
        server.initial_camera.fov = np.radians(42)
        self.figure: Figure | None = None
        self._body: BodyView | None = None
        self._truth: BodyView | None = None
        self._handles: Handles | None = None
        self._beside = False
        self._obstacles = self._make_obstacles()

    def _make_obstacles(self) -> list[Handle]:
        scene = self._server.scene

        def ball(name: str) -> viser.IcosphereHandle:
            return scene.add_icosphere(name, radius=SPHERE, color=WOOD, opacity=0.85)

        def board(name: str) -> viser.BoxHandle:
            return scene.add_box(name, color=WOOD, dimensions=BOX, opacity=0.85)

        def dragged(number: int, position: Array, rotation: Array) -> None:
            self._report("obstacle", (number, position, rotation))

        made = []
        for k, (name, make) in enumerate(zip(OBSTACLES, (ball, board), strict=True)):
            handle = Handle(scene, f"/obstacles/{name}", make, k, dragged, scale=0.3, turns=k == 1)
            handle.visible = False
            made.append(handle)
        return made

    def set_figure(self, figure: Figure) -> None:
        """Begin anew with the body of a figure; nothing is shown until it is posed."""
        if self.figure is figure:
            return
        for old in (self._body, self._truth, self._handles):
            if old is not None:
                old.remove()
        scene = self._server.scene
        self.figure = figure
        self._truth = BodyView(scene, "/truth", figure, ghost=True)
        self._body = BodyView(scene, "/body", figure)
        self._handles = Handles(scene, lambda *where: self._report("drag", where), figure.height / HEIGHT)
        self._handles.visible = False

    def show(self, positions: Array, world: Array) -> None:
        """Pose the body: joints (J, 3) in the world [m] and their world rotations (J, 4)."""
        assert self._body is not None, "set_figure comes first"
        with self._server.atomic():
            self._body.show(positions, world)

    def paint(self, joints: Collection[int]) -> None:
        """Show which joints are at their limits."""
        assert self._body is not None, "set_figure comes first"
        self._body.paint(joints)

    def show_truth(self, transforms: tuple[Array, Array] | None, beside: bool = False) -> None:
        """Pose the truth over the body or beside it; None hides it."""
        assert self._truth is not None, "set_figure comes first"
        if transforms is None:
            self._truth.visible = False
            return
        with self._server.atomic():
            self._truth.move(np.array(BESIDE if beside else (0.0, 0.0, 0.0)))
            self._truth.show(*transforms)

    def set_targets(self, points: Array, rotations: Array | None = None, *, but: int | None = None) -> None:
        """Put the handles at (6, 3) [m], turned to (6, 4); ``but`` one that is being dragged."""
        assert self._handles is not None, "set_figure comes first"
        with self._server.atomic():
            self._handles.place(points, rotations, but=but)

    def show_markers(self, points: Array, colours: Array) -> None:
        """Draw small balls at (M, 3) [m] in colours (M, 3), 0 to 255; rows of NaN are left out."""
        known = np.isfinite(points).all(axis=1)
        self._server.scene.add_point_cloud(
            "/markers",
            points=points[known].astype(np.float32),
            colors=colours[known].astype(np.uint8),
            point_size=0.012,
            point_shape="circle",
        )

    def set_turns(self, turns: list[bool]) -> None:
        """Which of the six handles may be turned."""
        assert self._handles is not None, "set_figure comes first"
        self._handles.set_turns(turns)

    def select(self, number: int | None) -> None:
        """Show the arrows of one handle, or of none."""
        if self._handles is not None:
            self._handles.select(number)

    def show_obstacle(self, number: int, place: Array | None) -> None:
        """Put an obstacle at (7,): position [m] and rotation; None takes it away."""
        handle = self._obstacles[number]
        handle.visible = handle.selected = place is not None
        if place is not None:
            handle.place(place[:3], place[3:])

    def look_at(self, place: Array) -> None:
        """Where new browsers look first: (3,) [m]; they stand as far off as ever."""
        self._server.initial_camera.look_at = tuple(np.asarray(place, float))
        self._server.initial_camera.position = tuple(np.asarray(place, float) + np.subtract(CAMERA, LOOK))
