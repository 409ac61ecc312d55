"""Pictures of poses and errors: a film strip of mannequins, and curves under it.

Bodies are drawn as tapered capsules in an orthographic view, far parts first. The truth is a soft grey
body, the result a coloured skeleton on top of it: what differs sticks out. Works for any figure; joints
without a role are left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Polygon
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.mannequin import Mannequin
from sixpoint.body.motion import Motion
from sixpoint.study.canvas import (
    DPI,
    GHOST,
    INK,
    LEFT,
    RIGHT,
    SERIES,
    SOFT,
    TRUNK,
    WIDTH,
    add_heading,
    add_legend,
    save_canvas,
    style_axes,
)
from sixpoint.study.metrics import compute_errors

Array = NDArray[np.float64]

GAP = 0.16  # between the figures of a strip, in units of the figure
COLOURS = {"left": LEFT, "right": RIGHT, "trunk": TRUNK}
VIEW_YAW, VIEW_PITCH = np.radians(38), np.radians(9)


@dataclass(frozen=True)
class _Part:
    """The hull of some balls, all of one colour."""

    centres: Array
    radii: Array
    colour: str


def draw_comparison(
    figure: Figure,
    truth: Motion,
    result: Motion,
    path: str | Path,
    *,
    frames: Sequence[int] | None = None,
    title: str | None = None,
) -> Path:
    """Draw a result over the truth at some frames, and the position error over time below.

    Args:
        figure: The figure of both motions.
        truth: The recorded motion, drawn in grey.
        result: The reconstructed motion, of the same length.
        path: The PNG to write.
        frames: Frames to show; by default six, spread over the clip.
        title: By default the name of the truth.

    Returns:
        ``path``.
    """
    shown = _spread(len(truth)) if frames is None else list(frames)
    canvas = film(figure, (truth, result), shown, below=1.75)
    error = 100 * compute_distances(figure, truth, result)
    add_heading(canvas, title or truth.name, f"mean {error.mean():.1f} cm,  worst {error.max():.1f} cm")
    add_legend(canvas, ((GHOST, "truth"), (LEFT, "left side"), (RIGHT, "right side"), (INK, "six points")))
    height = canvas.get_figheight()
    axes = canvas.add_axes((0.055, 0.5 / height, 0.925, 1.2 / height))
    times = np.arange(len(truth)) / truth.rate
    axes.fill_between(times, error, color=LEFT, alpha=0.13, lw=0)
    axes.plot(times, error, color=LEFT, lw=1.8, solid_capstyle="round")
    axes.axhline(error.mean(), color=INK, lw=0.9, ls=(0, (4, 3)))
    axes.plot(times[shown], error[shown], "o", color=INK, ms=5, mec="white", mew=1.0, clip_on=False, zorder=5)
    axes.set_ylim(0, max(1.12 * error.max(), 0.1))
    style_axes(axes, times, "joint distance [cm]")
    return save_canvas(canvas, path)


def draw_poses(
    figure: Figure,
    motion: Motion,
    path: str | Path,
    frames: Sequence[int] | None = None,
    *,
    title: str | None = None,
) -> Path:
    """Draw a film strip of one motion.

    Args:
        figure: The figure of the motion.
        motion: What to draw.
        path: The PNG to write.
        frames: Frames to show; by default six, spread over the clip.
        title: By default the name of the motion.

    Returns:
        ``path``.
    """
    shown = _spread(len(motion)) if frames is None else list(frames)
    canvas = film(figure, (motion,), shown, below=0.0)
    add_heading(canvas, title or motion.name, f"{motion.duration:.1f} s at {motion.rate:g} Hz")
    return save_canvas(canvas, path)


def draw_error_curves(
    curves: Mapping[str, tuple[ArrayLike, ArrayLike]],
    path: str | Path,
    ylabel: str = "joint distance [cm]",
    *,
    title: str | None = None,
) -> Path:
    """Draw named curves over time [s] into one picture.

    Args:
        curves: Name -> (times [s], values).
        path: The PNG to write.
        ylabel: Quantity and unit of the values.
        title: Printed above, if given.

    Returns:
        ``path``.
    """
    canvas = Canvas(figsize=(WIDTH, 4.0), dpi=DPI)
    axes = canvas.add_axes((0.065, 0.14, 0.77, 0.74))
    for k, (name, (times, values)) in enumerate(curves.items()):
        dashes = ("-", "--")[k // len(SERIES) % 2]
        axes.plot(times, values, color=SERIES[k % len(SERIES)], lw=1.8, ls=dashes, label=name)
    ends = np.concatenate([np.asarray(times, float) for times, _ in curves.values()] or [np.zeros(1)])
    axes.set_ylim(bottom=0)
    style_axes(axes, ends, ylabel)
    if curves:
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1), frameon=False, labelcolor=INK, fontsize=9.5)
    if title:
        add_heading(canvas, title, "")
    return save_canvas(canvas, path)


def compute_distances(figure: Figure, truth: Motion, result: Motion) -> Array:
    """Mean distance of the joints in each frame (F,) [m], over those that ``compute_errors`` counts."""
    return np.asarray(compute_errors(figure, truth, result).distances.mean(axis=1), float)


def _places(figure: Figure, positions: Array, world: Array) -> Array:
    return np.concatenate([positions, figure.skeleton.compute_sites(positions, world)], axis=-2)


def _parts(figure: Figure, positions: Array, world: Array, slim: bool) -> list[_Part]:
    """The mannequin of one frame, in colours."""
    body = Mannequin.of(figure, slim)
    centres = body.place(positions, world)
    return [_Part(centres[p.balls], body.radii[p.balls], COLOURS[p.side]) for p in body.parts]


def _camera(figure: Figure, motion: Motion, shown: Sequence[int], turn: float) -> Array:
    """(3, 3) rows right, up and towards the viewer: ``turn`` from the front of the mean pose."""
    across = motion.positions[shown][:, figure.roles.hip[0]] - motion.positions[shown][:, figure.roles.hip[1]]
    front = np.cross(across.mean(axis=0), [0, 1, 0])
    yaw = np.arctan2(front[0], front[2]) + turn
    level = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
    toward = np.cos(VIEW_PITCH) * level + np.array([0.0, np.sin(VIEW_PITCH), 0.0])
    right = rot.unit(np.cross([0, 1, 0], toward))
    return np.stack([right, np.cross(toward, right), toward])


def film(
    figure: Figure,
    motions: Sequence[Motion],
    shown: Sequence[int],
    below: float,
    *,
    captions: Sequence[str] = (),
    points: Array | None = None,
    centre: ArrayLike | None = None,
    yaw: float = VIEW_YAW,
) -> Canvas:
    """Bodies side by side over their times, on a canvas that has ``below`` inches left at its foot.

    Instead of the times there may be ``captions``, instead of the six points others (F, n, 3), instead of the
    pelvis a fixed ``centre`` (3,) [m]; ``yaw`` is the way of the viewer from the front, to the left [rad].
    """
    unit, first = figure.height / 1.6, motions[0]
    camera = _camera(figure, first, shown, yaw)
    places = _places(figure, *first.transforms)
    floor = float(places[..., 1].min())
    targets = figure.targets(first).positions if points is None else points
    views = []
    for frame in shown:
        middle = first.positions[frame, figure.roles.pelvis] if centre is None else np.asarray(centre)
        origin = middle * [1, 0, 1] + [0, floor, 0]
        layers = []
        for motion in motions:
            positions, world = motion.transforms
            parts = _parts(figure, positions[frame] - origin, world[frame], slim=motion is not first)
            parts.sort(key=lambda part: float((part.centres @ camera[2]).mean()))
            layers.append([(part.colour, _outline(part, camera)) for part in parts])
        views.append((layers, (targets[frame] - origin) @ camera.T))
    edges = [np.concatenate([o for layer in layers for _, o in layer]) for layers, _ in views]
    widths = [max(float(np.ptp(e[:, 0])), 0.55 * unit) + GAP * unit for e in edges]
    wide = max(sum(widths), 5.0 * unit)
    low = min(-0.13 * unit, *(float(e[:, 1].min()) for e in edges)) - 0.14 * unit
    high = max(float(e[:, 1].max()) for e in edges) + 0.06 * unit
    tall = (high - low) / wide * WIDTH
    above = 0.62 if len(motions) == 1 else 0.84
    canvas = Canvas(figsize=(WIDTH, round((tall + below + above) * DPI) / DPI), dpi=DPI)
    total = canvas.get_figheight()
    axes = canvas.add_axes((0, below / total, 1, tall / total), xlim=(0, wide), ylim=(low, high))
    axes.axis("off")
    left = (wide - sum(widths)) / 2
    texts = captions or [f"{frame / first.rate:.2f} s" for frame in shown]
    dotted = len(motions) > 1 or points is not None
    for text, (layers, dots), edge, width in zip(texts, views, edges, widths, strict=True):
        shift = np.array([left + (width - edge[:, 0].max() - edge[:, 0].min()) / 2, 0.0])
        _draw_body(axes, layers, dots[:, :2] + shift if dotted else None, shift, camera, unit)
        axes.text(left + width / 2, low + 0.02 * unit, text, ha="center", color=SOFT, size=9.5)
        left += width
    return canvas


def _draw_body(
    axes: Axes,
    layers: list[list[tuple[str, Array]]],
    points: Array | None,
    shift: Array,
    camera: Array,
    unit: float,
) -> None:
    around = np.linspace(0, 2 * np.pi, 60)
    disc = 0.29 * unit * np.stack([np.cos(around), np.zeros(60), np.sin(around)], axis=-1) @ camera.T
    axes.add_patch(Polygon(disc[:, :2] + shift, fc="#f1f3f5", ec="none", zorder=0))
    for k, layer in enumerate(layers):
        ghost = k < len(layers) - 1
        for colour, outline in layer:
            fill, edge = (GHOST, GHOST) if ghost else (colour, "white")
            body = Polygon(outline + shift, fc=fill, ec=edge, lw=0.9, joinstyle="round", zorder=1 + k)
            axes.add_patch(body)
    if points is not None:
        axes.plot(*points.T, "o", ms=5.2, color=INK, mec="white", mew=1.1, zorder=9)


def _outline(part: _Part, camera: Array) -> Array:
    """Hull (n, 2) of the part's balls as seen by the camera."""
    around = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    circle = np.stack([np.cos(around), np.sin(around)], axis=-1)
    flat = (part.centres @ camera.T)[:, None, :2] + part.radii[:, None, None] * circle
    points = flat.reshape(-1, 2)
    return np.asarray(points[ConvexHull(points).vertices], float)


def _spread(frames: int, count: int = 6) -> list[int]:
    """Frames in the middle of equal parts of a clip."""
    return sorted({int((k + 0.5) * frames / count) for k in range(count)})
