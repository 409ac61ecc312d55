"""The hierarchy of a figure, drawn: its joints as a tree, the known ones filled.

Reference: Unzueta et al. 2008, Figure 13.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.study.canvas import (
    DPI,
    INK,
    LEFT,
    RIGHT,
    SOFT,
    TRUNK,
    WIDTH,
    add_heading,
    add_legend,
    save_canvas,
)
from sixpoint.study.plots import _outline, _parts
from sixpoint.study.sik_figures.spine import PALE, add_stage, camera, draw_parts

Array = NDArray[np.float64]

LEVEL, PER_LETTER, SIZE = 0.42, 0.0615, 7.5
"""Height of a level of the tree and width of a letter [inch], size of a name [point]."""


def draw_hierarchy(figure: Figure, path: Path) -> Path:
    """Draw the figure from the front with its joints, and their tree; the six known ones are filled.

    Args:
        figure: The figure.
        path: The PNG to write.

    Returns:
        ``path``.
    """
    sk, r = figure.skeleton, figure.roles
    known = {r.pelvis, r.head, *r.wrist, *r.ankle}
    at = _lay_out(figure)
    depth = int(at[:, 1].max()) + 1
    tall, below, aside = depth * LEVEL, 0.25, 0.24 * WIDTH
    canvas = Canvas(figsize=(WIDTH, round((tall + below + 0.9) * DPI) / DPI), dpi=DPI)
    add_heading(canvas, "The joints of the figure", f"{len(sk)} joints, {len(known)} known positions")
    add_legend(
        canvas,
        (
            (LEFT, "left side"),
            (RIGHT, "right side"),
            (TRUNK, "trunk"),
            (SOFT, "filled: its position is known"),
        ),
    )
    _draw_front(add_stage(canvas, 0, below, aside, tall, _front_corner(figure, aside, tall)), figure, known)
    axes = add_stage(canvas, aside, below, WIDTH - aside, tall, np.array([0.0, -tall, 1.0]))
    places = at * [WIDTH - aside - 0.25, -LEVEL] + [0.05, -0.5 * LEVEL]
    for joint, (x, y) in enumerate(places):
        colour = _side_colour(sk.names[joint])
        parent = int(sk.parents[joint])
        if parent >= 0:
            px, py = places[parent]
            axes.plot(
                [px, px, x, x], [py, y + LEVEL / 2, y + LEVEL / 2, y], color="#c5ccd3", lw=1.2, zorder=1
            )
        full = joint in known
        box = {"boxstyle": "round,pad=0.28", "fc": colour if full else "white", "ec": colour, "lw": 1.0}
        axes.text(
            x,
            y,
            sk.names[joint],
            size=SIZE,
            color="white" if full else INK,
            ha="center",
            va="center",
            bbox=box,
            zorder=3,
        )
    return save_canvas(canvas, path)


def _lay_out(figure: Figure) -> Array:
    """(J, 2) of each joint: place across the tree 0 to 1, and depth."""
    sk, rest = figure.skeleton, figure.rest_positions
    out = np.zeros((len(sk), 2))
    right = 0.0

    def place(joint: int, depth: int, room: float) -> None:
        nonlocal right
        room = max(room, PER_LETTER * len(sk.names[joint]) + 0.16)
        children = sorted(sk.children[joint], key=lambda child: (float(rest[child, 0]), child))
        out[joint, 1] = depth
        if not children:
            out[joint, 0] = right + room / 2
            right += room
            return
        for child in children:
            place(child, depth + 1, room if len(children) == 1 else 0.0)
        out[joint, 0] = out[children][:, 0].mean()

    place(0, 0, 0.0)
    out[:, 0] /= right
    return out


def _side_colour(name: str) -> str:
    return {"l_": LEFT, "r_": RIGHT}.get(name[:2], TRUNK)


def _front_corner(figure: Figure, wide: float, tall: float) -> Array:
    """Lower left corner and scale of the figure's picture."""
    parts = _parts(figure, *figure.neutral_pose.compute_transforms(), False)
    edge = np.concatenate([_outline(part, camera(0.0, 0.0)) for part in parts])
    low, high = edge.min(axis=0), edge.max(axis=0)
    scale = 0.98 * tall / (high[1] - low[1])
    return np.array([(low[0] + high[0]) / 2 - wide / scale / 2, low[1] - 0.01 * tall / scale, scale])


def _draw_front(axes: Axes, figure: Figure, known: set[int]) -> None:
    """The neutral pose, pale, with bones as lines and joints as dots."""
    sk, view = figure.skeleton, camera(0.0, 0.0)
    places, world = figure.neutral_pose.compute_transforms()
    draw_parts(axes, _parts(figure, places, world, False), view, fill=PALE)
    flat = (places @ view.T)[:, :2]
    for joint, parent in enumerate(sk.parents):
        if parent >= 0:
            axes.plot(*flat[[parent, joint]].T, color=_side_colour(sk.names[joint]), lw=1.6, zorder=3)
    for joint, (x, y) in enumerate(flat):
        colour, full = _side_colour(sk.names[joint]), joint in known
        fill, edge = (colour, "white") if full else ("white", colour)
        size, order = (10.0, 6) if full else (4.4, 5)
        axes.plot(x, y, "o", ms=size, mfc=fill, mec=edge, mew=1.2, zorder=order)
