"""A limb's picture: the angles that three lengths determine, and the swivel angle that they leave open.

Reference: Unzueta et al. 2008, section 6 and Figure 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.study.canvas import DPI, INK, RIGHT, WIDTH, add_heading, add_legend, save_canvas
from sixpoint.study.plots import _parts
from sixpoint.study.sik_figures.spine import (
    BESIDE,
    PALE,
    add_stage,
    arm_parts,
    camera,
    draw_angle,
    draw_caption,
    draw_parts,
    hangs_on,
    mark,
    tint,
)

Array = NDArray[np.float64]

ASLANT = (-46.0, 16.0)
"""Yaw and pitch of the viewer of the elbow's circle [degrees]."""
ASIDE = np.array([[-0.02, 0.07], [0.04, 0.085]])
"""From the middle of the arm to the middle of each half of the picture [m]."""
GHOST_ARM = tint(RIGHT, 0.32)


def draw_limb(
    figure: Figure, motion: Motion, goal: Array, captions: Sequence[str], labels: Sequence[str], path: Path
) -> Path:
    """Draw the right arm from the side with its angles, and aslant with the circle of its elbow.

    Args:
        figure: The figure of the motion.
        motion: The posture of the solver, then the same arm at other swivel angles.
        goal: (3,) of the wrist [m].
        captions: Of the two halves.
        labels: Numbers in the picture: length of the upper arm, of the forearm, from shoulder to goal, angle
            at the shoulder, flexion of the elbow.
        path: The PNG to write.

    Returns:
        ``path``.
    """
    r = figure.roles
    bones = [r.shoulder[1], r.elbow[1], r.wrist[1]]
    arms = motion.positions[:, bones]
    wide, tall, below = WIDTH / 2, 4.8, 0.62
    canvas = Canvas(figsize=(WIDTH, below + tall + 0.88), dpi=DPI)
    add_heading(canvas, "A limb in closed form", "")
    add_legend(canvas, ((RIGHT, "as solved"), (GHOST_ARM, "other swivel angles"), (INK, "known wrist")))
    places, world = (a[0] for a in motion.transforms)
    body = [p for p in _parts(figure, places, world, False) if not hangs_on(p, arms[0])]
    scale = tall / 0.86
    for k, (view, caption) in enumerate(zip((camera(*BESIDE), camera(*ASLANT)), captions, strict=True)):
        middle = (view @ arms[0].mean(axis=0))[:2] + ASIDE[k]
        corner = np.array([*(middle - np.array([0.48 * wide, tall / 2]) / scale), scale])
        axes = add_stage(canvas, (k + 0.01) * wide, below, 0.98 * wide, tall, corner)
        draw_parts(axes, body, view, fill=PALE)
        draw_caption(axes, caption)
        flat = (arms @ view.T)[..., :2]
        if k == 0:
            draw_parts(axes, arm_parts(figure, arms[0], ""), view, fill=RIGHT, order=4)
            _draw_triangle(axes, flat[0], labels)
        else:
            _draw_circle(axes, figure, arms, view)
        mark(axes, (view @ goal)[:2], size=13)
    return save_canvas(canvas, path)


def _draw_triangle(axes: Axes, points: Array, labels: Sequence[str]) -> None:
    """Sides and angles over the arm; the angle at the elbow is that of flexion, beyond the upper arm."""
    a, b, c = points
    axes.plot(*np.array([a, b, c]).T, "-", color="white", lw=1.8, zorder=8)
    axes.plot(*np.array([a, c]).T, ls=(0, (4, 3)), color=INK, lw=1.4, zorder=8)
    axes.plot(*np.array([a, b]).T, "o", ms=9, mfc="white", mec=RIGHT, mew=2.2, zorder=9)
    on = b + 0.6 * (b - a)
    axes.plot(*np.array([b, on]).T, ls=(0, (1, 2)), color=INK, lw=1.4, zorder=3)
    draw_angle(axes, a, c, b, 0.13, labels[3])
    draw_angle(axes, b, on, c, 0.085, labels[4])
    sides = ((a, b, 0.5, -0.075), (b, c, 0.74, -0.055), (a, c, 0.5, 0.02))
    for (start, end, share, aside), label in zip(sides, labels[:3], strict=True):
        along = (end - start) / np.linalg.norm(end - start)
        place = start + share * (end - start) + aside * np.array([-along[1], along[0]])
        turn = np.degrees(np.arctan2(along[1], along[0]))
        style = {"ha": "center", "va": "center", "rotation": turn, "rotation_mode": "anchor"}
        axes.text(place[0], place[1], label, color=INK, size=10, zorder=30, **style)


def _draw_circle(axes: Axes, figure: Figure, arms: Array, view: Array) -> None:
    """The circle of the elbow, the arm at other swivel angles as lines, and the arm as solved on top."""
    a, b, c = arms[0]
    axis = (c - a) / np.linalg.norm(c - a)
    centre = a + ((b - a) @ axis) * axis
    out = b - centre
    turns = np.linspace(0, 2 * np.pi, 121)
    circle = centre + np.cos(turns)[:, None] * out + np.sin(turns)[:, None] * np.cross(axis, out)
    flat = (arms @ view.T)[..., :2]
    for line in flat[1:]:
        axes.plot(*line.T, color=GHOST_ARM, lw=7, solid_joinstyle="round", solid_capstyle="round", zorder=4)
    axes.plot(*flat[0, [0, 2]].T, color=INK, ls=(0, (4, 3)), lw=1.4, zorder=5)
    draw_parts(axes, arm_parts(figure, arms[0], ""), view, fill=RIGHT, order=6)
    axes.plot(*(circle @ view.T)[:, :2].T, color=INK, lw=1.3, zorder=8)
    axes.plot(*flat[:, 1].T, "o", ms=7, mfc="white", mec=INK, mew=1.5, zorder=9)
    axes.plot(*flat[0, 0], "o", ms=7, mfc="white", mec=RIGHT, mew=2.0, zorder=9)
