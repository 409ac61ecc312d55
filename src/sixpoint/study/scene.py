"""Pictures of a figure among things: some of its poses from several views, with boxes, posts and marks.

A thing is the hull of some balls of one radius: a box has eight of radius zero, a capsule two. Things are
translucent, so that what is inside a shelf can be seen. Far parts come first, as in ``plots``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Polygon
from numpy.typing import ArrayLike, NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.errors import SixpointError
from sixpoint.study.canvas import DPI, INK, SOFT, WIDTH, add_heading, save_canvas
from sixpoint.study.plots import _outline, _Part, _parts

Array = NDArray[np.float64]

FLOOR_EDGE = 0.1  # beyond what stands on the floor [m]
WOOD, STEEL = "#cdb58f", "#7c8894"
MET, MISSED = "#3f9b5c", "#c9374f"
FACES = np.array([[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]])
VIEWS = {"side": (-90.0, 0.0), "three quarters": (-145.0, 18.0)}
"""Name -> yaw and pitch of the viewer [degrees]; 0 is in front of who looks along Z, 90 at the left."""


@dataclass(frozen=True, eq=False)
class Thing:
    """The hull of some balls, in the world.

    Attributes:
        centres: (n, 3) centres of the balls [m]; eight of radius 0, as ``box`` orders them, have flat faces.
        radius: Of all balls [m].
        colour: Fill colour.
    """

    centres: Array
    radius: float = 0.0
    colour: str = WOOD

    @classmethod
    def box(cls, size: ArrayLike, place: ArrayLike, colour: str = WOOD) -> Thing:
        """A box of three side lengths around a place: (3,), or (7,) with its rotation."""
        corners = 0.5 * np.asarray(size, float) * np.array(list(product((-1, 1), repeat=3)), float)
        return cls(_placed(corners, place), 0.0, colour)

    @classmethod
    def capsule(cls, radius: float, length: float, place: ArrayLike, colour: str = STEEL) -> Thing:
        """All within a radius of a segment along Y around a place: (3,), or (7,) with its rotation."""
        ends = np.array([[0.0, -0.5 * length, 0.0], [0.0, 0.5 * length, 0.0]])
        return cls(_placed(ends, place), radius, colour)


@dataclass(frozen=True, eq=False)
class Shot:
    """What one column of a picture shows.

    Attributes:
        frame: Frame of the motion.
        caption: Written below; lines apart by a newline.
        marks: (point (3,) [m], colour) pairs, drawn as rings on top of all.
        trail: (n, 3) points of a path [m], drawn as a dotted line.
    """

    frame: int
    caption: str = ""
    marks: tuple[tuple[ArrayLike, str], ...] = ()
    trail: ArrayLike | None = None


def draw_scene(
    figure: Figure,
    motion: Motion,
    path: str | Path,
    shots: Sequence[Shot],
    things: Sequence[Thing] = (),
    *,
    views: Mapping[str, tuple[float, float]] = VIEWS,
    title: str | None = None,
    note: str = "",
) -> Path:
    """Draw a row of shots per view, all at one scale, on the floor y = 0.

    Args:
        figure: The figure of the motion.
        motion: What to draw.
        path: The PNG to write.
        shots: The columns.
        things: What stands around, the same in every shot.
        views: Name -> (yaw, pitch) of the viewer [degrees]; a row each.
        title: By default the name of the motion.
        note: Printed at the right of the title.

    Returns:
        ``path``.

    Raises:
        SixpointError: No shot, no view, or a frame that the motion does not have.
    """
    wrong = [shot.frame for shot in shots if not 0 <= shot.frame < len(motion)]
    if wrong or not shots or not views:
        raise SixpointError(f"a scene needs views, and shots of frames 0 to {len(motion) - 1}; got {wrong}")
    cameras = [_camera(yaw, pitch) for yaw, pitch in views.values()]
    floor = _floor(motion, shots, things)
    corners = [_extent(figure, motion, shots, things, floor, camera) for camera in cameras]
    size = np.array([high - low for low, high in corners])
    scale = WIDTH / len(shots) / (1.06 * size[:, 0].max())  # [inch / m]
    lines = max(shot.caption.count("\n") + 1 for shot in shots)
    above, below = 0.62, 0.16 + 0.21 * lines
    tall = 1.03 * size[:, 1] * scale
    canvas = Canvas(figsize=(WIDTH, round((above + below + tall.sum()) * DPI) / DPI), dpi=DPI)
    height = canvas.get_figheight()
    top = height - above
    for camera, (low, high), h in zip(cameras, corners, tall, strict=True):
        top -= h
        middle = (low + high) / 2
        half = np.array([WIDTH / len(shots), h]) / scale / 2
        for k, shot in enumerate(shots):
            frame = (k / len(shots), top / height, 1 / len(shots), h / height)
            axes = canvas.add_axes(frame)
            axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
            axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
            axes.axis("off")
            _draw_shot(axes, figure, motion, shot, things, floor, camera)
    for k, shot in enumerate(shots):
        canvas.text(
            (k + 0.5) / len(shots), (below - 0.06) / height, shot.caption, ha="center", va="top", size=9.5,
            color=INK, linespacing=1.45,
        )  # fmt: skip
    add_heading(canvas, title or motion.name, note)
    return save_canvas(canvas, path)


def _placed(points: Array, place: ArrayLike) -> Array:
    where = np.asarray(place, float)
    turned = rot.mul_vec(where[3:], points) if where.shape == (7,) else points
    return np.asarray(turned + where[:3])


def _camera(yaw: float, pitch: float) -> Array:
    """(3, 3) rows right, up and towards the viewer."""
    a, b = np.radians([yaw, pitch])
    toward = np.array([np.sin(a) * np.cos(b), np.sin(b), np.cos(a) * np.cos(b)])
    right = rot.unit(np.cross([0, 1, 0], toward))
    return np.stack([right, np.cross(toward, right), toward])


def _extent(
    figure: Figure,
    motion: Motion,
    shots: Sequence[Shot],
    things: Sequence[Thing],
    floor: Array,
    camera: Array,
) -> tuple[Array, Array]:
    """Lower left and upper right corner (2,) of all that is seen."""
    positions, world = motion.transforms
    bodies = [part for s in shots for part in _parts(figure, positions[s.frame], world[s.frame], slim=False)]
    seen = [_outline(part, camera) for part in (*bodies, *map(_as_part, things))]
    seen += [(np.atleast_2d(np.asarray(p, float)) @ camera.T)[:, :2] for s in shots for p, _ in s.marks]
    points = np.concatenate([*seen, (floor @ camera.T)[:, :2]])
    return points.min(axis=0) - 0.03, points.max(axis=0) + 0.03


def _as_part(thing: Thing) -> _Part:
    return _Part(thing.centres, np.full(len(thing.centres), max(thing.radius, 1e-4)), thing.colour)


def _draw_shot(
    axes: Axes,
    figure: Figure,
    motion: Motion,
    shot: Shot,
    things: Sequence[Thing],
    floor: Array,
    camera: Array,
) -> None:
    """The floor, then bodies and things from far to near, then trail and marks."""
    positions, world = (a[shot.frame] for a in motion.transforms)
    body = _parts(figure, positions, world, slim=False)
    _draw_floor(axes, floor, camera)
    layers: list[_Part | Thing] = [*body, *things]
    layers.sort(key=lambda layer: float((layer.centres @ camera[2]).mean()))
    for order, layer in enumerate(layers):
        if isinstance(layer, Thing):
            _draw_thing(axes, layer, camera, 2 + order)
        else:
            outline = _outline(layer, camera)
            axes.add_patch(Polygon(outline, fc=layer.colour, ec="white", lw=0.8, zorder=2 + order))
    if shot.trail is not None:
        line = np.asarray(shot.trail, float) @ camera.T
        axes.plot(line[:, 0], line[:, 1], ls=(0, (1, 2)), color=INK, lw=1.2, zorder=90)
    for point, colour in shot.marks:
        place = camera @ np.asarray(point, float)
        axes.plot(*place[:2], "o", ms=9, mfc="none", mec="white", mew=4.0, zorder=91)
        axes.plot(*place[:2], "o", ms=9, mfc="none", mec=colour, mew=2.2, zorder=92)


def _floor(motion: Motion, shots: Sequence[Shot], things: Sequence[Thing]) -> Array:
    """Corners (4, 3) of the floor below all that is shown [m]."""
    stood = [motion.positions[shot.frame] for shot in shots]
    points = np.concatenate([*stood, *(thing.centres for thing in things)])
    low, high = points.min(axis=0) - FLOOR_EDGE, points.max(axis=0) + FLOOR_EDGE
    corners = ((low[0], low[2]), (high[0], low[2]), (high[0], high[2]), (low[0], high[2]))
    return np.array([[x, 0.0, z] for x, z in corners])


def _draw_floor(axes: Axes, floor: Array, camera: Array) -> None:
    """A plane, or a line where it is seen from the side."""
    axes.add_patch(Polygon((floor @ camera.T)[:, :2], fc="#f1f3f5", ec="#c5ccd3", lw=0.8, zorder=0))


def _draw_thing(axes: Axes, thing: Thing, camera: Array, order: int) -> None:
    """Translucent, with its edges; the faces of a box that look away are not drawn."""
    if thing.radius > 0 or len(thing.centres) != 8:
        outline = _outline(_as_part(thing), camera)
        axes.add_patch(Polygon(outline, fc=thing.colour, ec="white", alpha=0.75, lw=0.8, zorder=order))
        return
    flat = thing.centres @ camera.T
    middle = flat.mean(axis=0)
    for face in FACES:
        if flat[face, 2].mean() > middle[2] + 1e-9:
            corners = flat[face, :2]
            axes.add_patch(Polygon(corners, fc=thing.colour, ec=SOFT, alpha=0.5, lw=0.8, zorder=order))
