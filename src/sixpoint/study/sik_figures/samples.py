"""Samples of clips, drawn: reconstructions beside the originals.

Reference: Unzueta et al. 2008, Figures 10 to 12.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.study.canvas import (
    DPI,
    INK,
    LEFT,
    RIGHT,
    TRUNK,
    WIDTH,
    add_heading,
    add_legend,
    save_canvas,
)
from sixpoint.study.metrics import measured_joints
from sixpoint.study.plots import VIEW_YAW, _camera, _outline, _Part, _parts, compute_distances
from sixpoint.study.sik_figures.spine import add_stage, draw_parts, tint

Array = NDArray[np.float64]

COLUMNS, FADED = 5, 0.42
"""Samples in a row; how much of its colour the original keeps."""
INNER, OUTER = 0.07, 0.26
"""Gap between the two bodies of a sample, and between samples [m at a height of 1.6]."""


def choose_samples(figure: Figure, motion: Motion, count: int) -> list[int]:
    """Frames whose postures are most unlike each other, in order of time.

    The first is the farthest from the mean posture, each next the farthest from all that are chosen; postures
    are compared by the places of their joints, seen from the pelvis and the way it faces.

    Args:
        figure: The figure of the motion.
        motion: The clip.
        count: How many, if the clip has as many.
    """
    places = motion.positions[:, measured_joints(figure)]
    hips = motion.positions[:, figure.roles.hip[0]] - motion.positions[:, figure.roles.hip[1]]
    turn = rot.from_axis_angle([0.0, 1.0, 0.0], np.arctan2(hips[:, 2], hips[:, 0]))
    postures = rot.mul_vec(turn[:, None], places - places[:, :1]).reshape(len(motion), -1)
    away = np.linalg.norm(postures - postures.mean(axis=0), axis=1)
    chosen: list[int] = []
    for _ in range(min(count, len(motion))):
        chosen.append(int(away.argmax()))
        last = np.linalg.norm(postures - postures[chosen[-1]], axis=1)
        away = last if len(chosen) == 1 else np.minimum(away, last)
    return sorted(chosen)


def draw_samples(
    figure: Figure, truth: Motion, result: Motion, frames: Sequence[int], path: Path, title: str, note: str
) -> Path:
    """Draw pairs of bodies: at the left of each the reconstruction, at the right the original.

    Args:
        figure: The figure of both motions.
        truth: The original.
        result: The reconstruction, as long.
        frames: What to show.
        path: The PNG to write.
        title: Printed above.
        note: Printed at the right of the title.

    Returns:
        ``path``.
    """
    unit, errors = figure.height / 1.6, 100 * compute_distances(figure, truth, result)
    floor = float(truth.positions[..., 1].min())
    points = figure.targets(truth).positions
    pairs = []
    for frame in frames:
        view = _camera(figure, truth, [frame], VIEW_YAW)
        origin = truth.positions[frame, figure.roles.pelvis] * [1, 0, 1] + [0, floor, 0]
        bodies = []
        for motion in (result, truth):
            places, world = (a[frame] for a in motion.transforms)
            parts = _parts(figure, places - origin, world, False)
            edge = np.concatenate([_outline(part, view) for part in parts])
            bodies.append((parts, edge.min(axis=0), edge.max(axis=0)))
        pairs.append((view, bodies, (points[frame] - origin) @ view.T))
    rows = [range(k, min(k + COLUMNS, len(pairs))) for k in range(0, len(pairs), COLUMNS)]
    widths = [sum(high[0] - low[0] for _, low, high in b) + (INNER + OUTER) * unit for _, b, _ in pairs]
    wide = max(sum(widths[k] for k in row) for row in rows)
    scale, below = WIDTH / (wide + 0.04 * unit), 0.4
    lows = [min(-0.11 * unit, *(low[1] for k in row for _, low, _ in pairs[k][1])) for row in rows]
    talls = [
        (max(h[1] for k in row for *_, h in pairs[k][1]) - low + 0.08 * unit) * scale
        for row, low in zip(rows, lows, strict=True)
    ]
    canvas = Canvas(figsize=(WIDTH, round((sum(talls) + below * len(rows) + 0.86) * DPI) / DPI), dpi=DPI)
    add_heading(canvas, title, note)
    add_legend(
        canvas,
        (
            (LEFT, "left side"),
            (RIGHT, "right side"),
            (tint(TRUNK, FADED), "pale: original"),
            (INK, "six points"),
        ),
    )
    top = canvas.get_figheight() - 0.86
    for row, low, tall in zip(rows, lows, talls, strict=True):
        top -= tall
        axes = add_stage(canvas, 0, top, WIDTH, tall, np.array([0, low - 0.02 * unit, scale]))
        free = wide - sum(widths[k] for k in row)
        left = free / (2 * len(row))
        for k in row:
            start = left + OUTER / 2 * unit
            _draw_pair(axes, pairs[k], start, unit)
            text = f"{frames[k] / truth.rate:.2f} s:  {errors[frames[k]]:.1f} cm"
            axes.text(
                start + (widths[k] - OUTER * unit) / 2,
                low - 0.05 * unit,
                text,
                ha="center",
                va="top",
                color=INK,
                size=9.5,
            )
            left += widths[k] + free / len(row)
        top -= below
    return save_canvas(canvas, path)


def _draw_pair(
    axes: Axes, pair: tuple[Array, list[tuple[list[_Part], Array, Array]], Array], left: float, unit: float
) -> None:
    """Reconstruction and original over their places on the floor, with the six points on both."""
    view, bodies, dots = pair
    around = np.linspace(0, 2 * np.pi, 60)
    disc = 0.29 * unit * np.stack([np.cos(around), np.zeros(60), np.sin(around)], axis=-1) @ view.T
    for number, (parts, low, high) in enumerate(bodies):
        shift = np.array([left - low[0], 0.0])
        axes.add_patch(Polygon(disc[:, :2] + shift, fc="#f1f3f5", ec="none", zorder=0))
        shown = [_Part(p.centres, p.radii, tint(p.colour, FADED)) for p in parts] if number else parts
        draw_parts(axes, shown, view, shift)
        axes.plot(*(dots[:, :2] + shift).T, "o", ms=4.8, color=INK, mec="white", mew=1.0, zorder=9)
        left += high[0] - low[0] + INNER * unit
