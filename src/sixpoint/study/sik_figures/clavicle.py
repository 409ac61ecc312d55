"""A clavicle that helps its arm, drawn.

Reference: Unzueta et al. 2008, section 5, Figures 3 and 4.
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
from sixpoint.study.canvas import DPI, INK, LEFT, WIDTH, add_heading, add_legend, save_canvas
from sixpoint.study.plots import _parts
from sixpoint.study.sik_figures.spine import (
    PALE,
    add_stage,
    arm_parts,
    camera,
    draw_angle,
    draw_caption,
    draw_parts,
    hangs_on,
    mark,
)

Array = NDArray[np.float64]

HELD = "#a5d0d8"


def draw_clavicle(
    figure: Figure, motion: Motion, goal: Array, captions: Sequence[str], labels: Sequence[str], path: Path
) -> Path:
    """Draw the left arm with its clavicle held and free, from the front, and both shoulders close up.

    Args:
        figure: The figure of the motion.
        motion: Two postures.
        goal: (3,) of the wrist [m].
        captions: Of the two postures and of the close-up.
        labels: Numbers in the picture: how far the wrist misses, the turn of the clavicle.
        path: The PNG to write.

    Returns:
        ``path``.
    """
    view, r = camera(0.0, 0.0), figure.roles
    bones = [r.clavicle[0], r.shoulder[0], r.elbow[0], r.wrist[0]]
    chains = (motion.positions[:, bones] @ view.T)[..., :2]
    target, base = (goal @ view.T)[:2], chains[0, 0]
    wide, tall, below = WIDTH / 3, 4.6, 0.62
    canvas = Canvas(figsize=(WIDTH, below + tall + 0.88), dpi=DPI)
    add_heading(canvas, "A clavicle helps its arm", "")
    add_legend(canvas, ((LEFT, "clavicle and arm"), (HELD, "the clavicle held"), (INK, "known wrist")))
    scale = tall / (target[1] - base[1] + 0.5)
    whole = np.array([base[0] + 0.03 - wide / scale / 2, target[1] + 0.06 - tall / scale, scale])
    zoom = 3.05 * scale
    middle = (base + chains[:, 1].sum(axis=0)) / 3
    near = np.array([*(middle - np.array([0.43 * wide, 0.34 * tall]) / zoom), zoom])
    for k, (frame, corner, caption) in enumerate(zip((0, 1, 1), (whole, whole, near), captions, strict=True)):
        axes = add_stage(canvas, (k + 0.02) * wide, below, 0.96 * wide, tall, corner)
        places, world = (a[frame] for a in motion.transforms)
        body = _parts(figure, places, world, False)
        draw_parts(axes, [p for p in body if not hangs_on(p, places[bones[1:]])], view, fill=PALE)
        draw_caption(axes, caption)
        if k == 2:
            continue
        for held in [0, 1] if k else [0]:
            colour = HELD if held < k else LEFT
            draw_parts(
                axes, arm_parts(figure, motion.positions[held, bones[1:]], ""), view, fill=colour, order=5
            )
            _draw_bone(axes, chains[held, :2], colour, 6.0)
        mark(axes, target, size=11)
    _measure(canvas.axes[0], chains[0, 3], target, labels[0])
    for held, colour in enumerate((HELD, LEFT)):
        _draw_bone(axes, chains[held, 1:3], colour, 13.0)
        _draw_bone(axes, chains[held, :2], colour, 13.0)
    axes.plot(*np.array([base, target]).T, ls=(0, (4, 3)), color=INK, lw=1.2, zorder=9)
    draw_angle(axes, base, chains[0, 1], chains[1, 1], 0.055, labels[1])
    for text, (x, y) in (("sternoclavicular", base), ("shoulder", chains[0, 1])):
        axes.text(x, y - 0.018, text, ha="center", va="top", color=INK, size=9, zorder=30)
    way = base + 0.17 * (target - base) / np.linalg.norm(target - base)
    x, y = way - [0.012, 0]
    axes.text(x, y, "to the\nknown wrist", ha="right", va="center", color=INK, size=9, zorder=30)
    return save_canvas(canvas, path)


def _draw_bone(axes: Axes, ends: Array, colour: str, width: float) -> None:
    """A line [point] with its joints."""
    axes.plot(*ends.T, color=colour, lw=width, solid_capstyle="round", zorder=7)
    axes.plot(*ends.T, "o", ms=width, mfc="white", mec=colour, mew=0.3 * width, zorder=8)


def _measure(axes: Axes, start: Array, end: Array, label: str) -> None:
    """A dimension line beside two points, with its length."""
    along = (end - start) / np.linalg.norm(end - start)
    aside = 0.065 * np.array([along[1], -along[0]])
    arrow = {"arrowstyle": "|-|,widthA=0.25,widthB=0.25", "color": INK, "lw": 1.2, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tuple(start + aside), tuple(end + aside), arrowprops=arrow, zorder=30)
    x, y = (start + end) / 2 + 1.5 * aside
    axes.text(x, y, label, color=INK, size=10, va="center", zorder=30)
