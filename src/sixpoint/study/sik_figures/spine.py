"""A spine that bends, drawn; and what the pictures of Sequential IK at work share.

Bodies are pale; what a step of the method moves is drawn in colour on top. All lengths and angles in the
pictures are measured on the postures that are given.

Reference: Unzueta et al. 2008, Figure 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Polygon
from numpy.typing import ArrayLike, NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.study.canvas import (
    DPI,
    INK,
    LEFT,
    SOFT,
    TRUNK,
    WIDTH,
    add_heading,
    add_legend,
    save_canvas,
)
from sixpoint.study.plots import _outline, _Part, _parts

Array = NDArray[np.float64]

PALE = "#e4e8ec"
GAP = 0.1
"""Between two postures of the spine [m]."""
BESIDE = (-90.0, 0.0)
"""Yaw and pitch of a viewer at the right of the figure [degrees]."""


def camera(yaw: float, pitch: float) -> Array:
    """(3, 3) rows right, up and towards a viewer; yaw 0 is in front, 90 at the figure's left [degrees]."""
    a, b = np.radians([yaw, pitch])
    toward = np.array([np.sin(a) * np.cos(b), np.sin(b), np.cos(a) * np.cos(b)])
    right = rot.unit(np.cross([0, 1, 0], toward))
    return np.stack([right, np.cross(toward, right), toward])


def tint(colour: str, share: float) -> str:
    """A colour mixed with white: all of it with share 1, white with 0."""
    red, green, blue = (1 - share * (1 - value) for value in to_rgb(colour))
    return str(to_hex((red, green, blue)))


def add_stage(canvas: Canvas, left: float, low: float, wide: float, tall: float, corner: Array) -> Axes:
    """Axes without lines at a place [inch]; ``corner``: their lower left corner [m] and scale [inch / m]."""
    w, h = canvas.get_size_inches()
    axes = canvas.add_axes((left / w, low / h, wide / w, tall / h))
    axes.set_xlim(corner[0], corner[0] + wide / corner[2])
    axes.set_ylim(corner[1], corner[1] + tall / corner[2])
    axes.axis("off")
    return axes


def draw_parts(
    axes: Axes,
    parts: Sequence[_Part],
    view: Array,
    shift: ArrayLike = (0, 0),
    *,
    fill: str = "",
    order: float = 1,
) -> None:
    """Parts of a body from far to near, in their own colours or all in one."""
    for part in sorted(parts, key=lambda part: float((part.centres @ view[2]).mean())):
        outline = _outline(part, view) + np.asarray(shift)
        axes.add_patch(
            Polygon(outline, fc=fill or part.colour, ec="white", lw=0.9, joinstyle="round", zorder=order)
        )


def arm_parts(figure: Figure, points: ArrayLike, colour: str) -> list[_Part]:
    """Upper arm and forearm between shoulder, elbow and wrist (3, 3) [m]."""
    unit, (a, b, c) = figure.height / 1.6, np.asarray(points, float)
    upper = _Part(np.array([a, b]), np.array([0.05, 0.04]) * unit, colour)
    return [upper, _Part(np.array([b, c]), np.array([0.039, 0.028]) * unit, colour)]


def mark(axes: Axes, points: ArrayLike, colour: str = INK, size: float = 8.0) -> None:
    """Rings around targets (n, 2)."""
    x, y = np.atleast_2d(points).T
    axes.plot(x, y, "o", ms=size, mfc="none", mec="white", mew=3.6, zorder=20)
    axes.plot(x, y, "o", ms=size, mfc="none", mec=colour, mew=1.9, zorder=21)


def hangs_on(part: _Part, places: Array) -> bool:
    """Whether a part hangs on one of some joints."""
    near = np.linalg.norm(places - part.centres[0], axis=1) < 1e-9
    return len(part.centres) == 2 and bool(near.any())


def draw_angle(
    axes: Axes, corner: Array, start: Array, end: Array, radius: float, label: str, beyond: float = 0.02
) -> None:
    """An arc between two directions and its size written outside."""
    first, last = (np.arctan2(*(p - corner)[::-1]) for p in (start, end))
    last = first + (last - first + np.pi) % (2 * np.pi) - np.pi
    turns = np.linspace(first, last, 40)
    axes.plot(
        *(corner[:, None] + radius * np.array([np.cos(turns), np.sin(turns)])), color=INK, lw=1.3, zorder=29
    )
    middle = corner + (radius + beyond) * np.array([np.cos(turns[20]), np.sin(turns[20])])
    axes.text(middle[0], middle[1], label, color=INK, size=10, ha="left", va="center", zorder=30)


def draw_caption(axes: Axes, text: str) -> None:
    """A text under a stage."""
    axes.text(
        0.5,
        -0.02,
        text,
        transform=axes.transAxes,
        ha="center",
        va="top",
        color=INK,
        size=9.5,
        linespacing=1.5,
    )


def draw_spine(
    figure: Figure, motion: Motion, goals: Array, captions: Sequence[str], path: Path, note: str = ""
) -> Path:
    """Draw the trunk between its two known points, one posture a frame, seen from the side.

    Args:
        figure: The figure of the motion.
        motion: The postures.
        goals: (F, 2, 3) known places of pelvis and head [m].
        captions: One a posture.
        path: The PNG to write.
        note: Printed at the right of the title.

    Returns:
        ``path``.
    """
    view, columns = camera(*BESIDE), []
    for frame, (pelvis, head) in enumerate(goals):
        places, world = (a[frame] for a in motion.transforms)
        body = [p for p in _parts(figure, places - pelvis, world, False) if p.colour == TRUNK]
        body += _thighs(figure, places - pelvis)
        seen = np.array([*(_trunk(figure, places, world) - pelvis), np.zeros(3), head - pelvis]) @ view.T
        columns.append((body, seen[:-2, :2], seen[-2:, :2]))
    edges = [np.concatenate([_outline(part, view) for part in body]) for body, *_ in columns]
    widths = [float(np.ptp(edge[:, 0])) + GAP for edge in edges]
    low, high = min(e[:, 1].min() for e in edges) - 0.01, max(e[:, 1].max() for e in edges) + 0.01
    names = 1.0  # room for the names of the joints [inch]
    scale = (WIDTH - names) / sum(widths)
    tall, below = (high - low) * scale, 0.62
    canvas = Canvas(figsize=(WIDTH, round((below + tall + 0.88) * DPI) / DPI), dpi=DPI)
    add_heading(canvas, "A spine between pelvis and head", note)
    known = (INK, "known: pelvis, head")
    add_legend(canvas, ((TRUNK, "spine, its joints white"), known, (LEFT, "asked distance")))
    axes = add_stage(canvas, 0, below, WIDTH, tall, np.array([0, low, scale]))
    left = names / scale
    for caption, (body, trunk, dots), edge, width in zip(captions, columns, edges, widths, strict=True):
        shift = np.array([left - edge[:, 0].min(), 0.0])
        draw_parts(axes, body, view, shift, fill=PALE)
        axes.plot(*(dots + shift).T, ls=(0, (4, 3)), color=LEFT, lw=1.4, zorder=3)
        axes.plot(*(trunk + shift).T, color=TRUNK, lw=5.5, solid_joinstyle="round", zorder=4)
        axes.plot(*(trunk + shift).T, "o", ms=7.5, mfc="white", mec=TRUNK, mew=1.8, zorder=5)
        mark(axes, dots + shift, size=14)
        if left * scale < names + 1e-6:
            _name_joints(axes, _trunk_names(figure), trunk + shift, left - 0.02)
        middle = left + (width - GAP) / 2
        axes.text(middle, low - 0.02, caption, ha="center", va="top", color=INK, size=9.5, linespacing=1.5)
        left += width
    return save_canvas(canvas, path)


def _name_joints(axes: Axes, names: Sequence[str], places: Array, right: float) -> None:
    """Names in a column at the left, with lines to their joints."""
    for name, (x, y) in zip(names, places, strict=True):
        axes.text(right, y, name, ha="right", va="center", color=INK, size=8.5)
        axes.plot([right + 0.006, x], [y, y], color=SOFT, lw=0.7, zorder=3)


def _trunk(figure: Figure, positions: Array, world: Array) -> Array:
    """Places (S + 1, 3) of the trunk's joints, coincident ones once, and of the head effector [m]."""
    r = figure.roles
    head = positions[r.head] + rot.mul_vec(world[r.head], r.head_offset)
    return np.array([*positions[list(figure.spine_chain.joints)], head])


def _trunk_names(figure: Figure) -> list[str]:
    """Names of the trunk's joints and of the head's."""
    joints = (*figure.spine_chain.joints, figure.roles.head)
    return ["pelvis", *(figure.skeleton.names[j] for j in joints[1:])]


def _thighs(figure: Figure, positions: Array) -> list[_Part]:
    radii = np.array([0.08, 0.056]) * figure.height / 1.6
    ends = zip(figure.roles.hip, figure.roles.knee, strict=True)
    return [_Part(positions[list(pair)], radii, TRUNK) for pair in ends]
