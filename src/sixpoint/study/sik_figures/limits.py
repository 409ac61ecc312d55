"""Pictures of swing limits: the largest swing over its direction, and where on a sphere an elbow may be.

Reference: Unzueta et al. 2008, section 7, Figures 6 and 7.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure as Canvas
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import SwingTwist
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.study.canvas import (
    DPI,
    INK,
    LEFT,
    SOFT,
    WIDTH,
    add_heading,
    add_legend,
    save_canvas,
    style_axes,
)
from sixpoint.study.plots import _parts
from sixpoint.study.sik_figures.spine import (
    PALE,
    add_stage,
    arm_parts,
    camera,
    draw_caption,
    draw_parts,
    hangs_on,
    mark,
    tint,
)

Array = NDArray[np.float64]

COLOURS = (LEFT, "#6b5ca5")
SIDES = ((-180, "backward"), (-90, "to the body"), (0, "forward"), (90, "away"), (180, "backward"))
VIEWS = ((8.0, 14.0), (140.0, 14.0))
"""Yaw and pitch of the viewers of the sphere [degrees]."""
PIXELS = 700  # of the sphere's picture, each way
AROUND = np.linspace(-np.pi, np.pi, 721)


def draw_limits(
    limits: Mapping[str, SwingTwist],
    figure: Figure,
    motion: Motion,
    goals: Array,
    captions: Sequence[str],
    path: Path,
) -> Path:
    """Draw the limits as curves, and the first of them, the left shoulder's, on a sphere.

    Args:
        limits: Name of a joint -> its limits; at most two.
        figure: The figure of the motion.
        motion: A posture for each of the two views, the arm stopped by its limits.
        goals: (2, 3) where the wrist should have been [m].
        captions: Of the two views.
        path: The PNG to write.

    Returns:
        ``path``.
    """
    below, tall, wide = 0.72, 3.9, 0.3 * WIDTH
    canvas = Canvas(figsize=(WIDTH, below + tall + 0.86), dpi=DPI)
    height = canvas.get_figheight()
    add_heading(canvas, "Limits of swing", "")
    add_legend(canvas, ((tint(LEFT, 0.4), "allowed to the elbow"), (INK, "known wrist")))
    axes = canvas.add_axes((0.055, below / height, 0.325, tall / height))
    _draw_curves(axes, limits)
    scale = wide / 1.04
    for k, angles in enumerate(VIEWS):
        view = camera(*angles)
        shoulder = (view @ motion.positions[k, figure.roles.shoulder[0]])[:2]
        corner = np.array([*(shoulder - np.array([(0.64, 0.44)[k] * wide, 0.6 * tall]) / scale), scale])
        stage = add_stage(canvas, 0.4 * WIDTH + k * wide, below, wide, tall, corner)
        _draw_sphere(stage, next(iter(limits.values())), figure, motion, k, goals[k], view)
        draw_caption(stage, captions[k])
    return save_canvas(canvas, path)


def compute_overshoot(limit: SwingTwist) -> float:
    """How far the cubic spline passes its highest knot before it is clipped [rad]."""
    return float(_unclipped(limit, AROUND).max() - limit.psi.max())


def _unclipped(limit: SwingTwist, theta: Array) -> Array:
    """The spline itself."""
    piece = np.clip(np.searchsorted(limit.theta, theta, side="right") - 1, 0, len(limit.theta) - 2)
    powers = (theta - limit.theta[piece])[:, None] ** np.arange(3, -1, -1)
    return np.asarray((limit.cubics[piece] * powers).sum(axis=1), float)


def _draw_curves(axes: Axes, limits: Mapping[str, SwingTwist]) -> None:
    turns = np.degrees(AROUND)
    for (name, limit), colour in zip(limits.items(), COLOURS, strict=False):
        psi = np.degrees(limit.compute_limit(AROUND))
        axes.fill_between(turns, psi, color=colour, alpha=0.09, lw=0)
        axes.plot(turns, np.degrees(_unclipped(limit, AROUND)), color=colour, lw=1.0, ls=(0, (1, 1.6)))
        axes.plot(turns, psi, color=colour, lw=2.2)
        axes.plot(
            *np.degrees([limit.theta, limit.psi]),
            "o",
            ms=7,
            mfc="white",
            mec=colour,
            mew=1.9,
            clip_on=False,
            zorder=5,
        )
        at = float(np.radians(112 if limit.psi.max() > 3 else 48))
        place = (np.degrees(at) + 5, float(np.degrees(limit.compute_limit(at))) + 4)
        axes.text(*place, name, color=colour, size=11, weight="bold", ha="left", va="bottom")
    style_axes(axes, turns, "largest swing ψ [°]", "")
    axes.set_ylim(0, 198)
    axes.set_yticks(range(0, 181, 30))
    axes.set_xticks([at for at, _ in SIDES], [f"{at}".replace("-", "−") for at, _ in SIDES])
    axes.set_xticks(range(-135, 136, 90), minor=True)
    axes.tick_params(which="minor", length=0)
    axes.grid(axis="x", which="both", color="#eef1f4", lw=0.8)
    down = axes.get_xaxis_transform()
    for at, word in SIDES:
        axes.text(at, -0.088, word, transform=down, color=SOFT, size=9, ha="center", va="baseline")
    axes.set_xlabel("direction of swing θ [°]", color=SOFT, size=9.5, labelpad=22)


def _on_sphere(limit: SwingTwist, theta: Array, psi: Array) -> Array:
    """Directions (..., 3) of a segment."""
    aside = np.cos(theta)[..., None] * limit.forward + np.sin(theta)[..., None] * limit.side
    return np.cos(psi)[..., None] * limit.axis + np.sin(psi)[..., None] * aside


def _draw_sphere(
    axes: Axes, limit: SwingTwist, figure: Figure, motion: Motion, frame: int, goal: Array, view: Array
) -> None:
    """The sphere of the elbow: its far half, the body, the arm, its near half, the boundary."""
    r = figure.roles
    bones = [r.shoulder[0], r.elbow[0], r.wrist[0]]
    places, world = (a[frame] for a in motion.transforms)
    arm = places[bones]
    radius = float(np.linalg.norm(arm[1] - arm[0]))
    parent = int(figure.skeleton.parents[bones[0]])
    turn = rot.mul(world[parent], rot.inv(figure.neutral[parent]))

    def at(theta: Array, psi: Array) -> Array:
        return np.asarray((arm[0] + radius * rot.mul_vec(turn, _on_sphere(limit, theta, psi))) @ view.T)

    middle = (arm[0] @ view.T)[:2]
    rim = np.linspace(0, 2 * np.pi, 181)
    outline = (middle + radius * np.stack([np.cos(rim), np.sin(rim)], axis=-1)).T
    axes.fill(*outline, fc="#f4f6f8", ec="none", zorder=0)
    axes.plot(*outline, color="#b4bec7", lw=1.0, zorder=8)
    depth = (arm[0] @ view.T)[2]
    seen = rot.mul_vec(rot.inv(turn), view)
    _draw_shell(axes, limit, seen, middle, radius, near=False)
    body = [part for part in _parts(figure, places, world, False) if not hangs_on(part, arm)]
    draw_parts(axes, body, view, fill=PALE, order=2)
    draw_parts(axes, arm_parts(figure, arm, ""), view, fill=LEFT, order=4)
    _draw_shell(axes, limit, seen, middle, radius, near=True)
    for knot in limit.theta[1:]:
        line = at(np.full(40, knot), np.linspace(0, 1, 40) * limit.compute_limit(knot))
        _draw_line(axes, line, depth, "white", 0.8)
    edge = at(AROUND, limit.compute_limit(AROUND))
    _draw_line(axes, edge, depth, LEFT, 2.4)
    knots = at(limit.theta[1:], limit.psi[1:])
    for x, y, z in knots:
        axes.plot(
            x,
            y,
            "o",
            ms=6.5 if z > depth else 4.5,
            mfc="white",
            mec=LEFT,
            mew=1.6,
            zorder=9 if z > depth else 1.5,
        )
    aim = np.array([arm[0], goal]) @ view.T
    axes.plot(*aim[:, :2].T, ls=(0, (4, 3)), color=INK, lw=1.2, zorder=10)
    mark(axes, aim[1, :2], size=10)


def _draw_shell(axes: Axes, limit: SwingTwist, view: Array, middle: Array, radius: float, near: bool) -> None:
    """What is allowed of one half of the sphere, darker where it is seen aslant."""
    x, y = np.meshgrid(np.linspace(-1, 1, PIXELS), np.linspace(-1, 1, PIXELS))
    inside = x**2 + y**2 <= 1
    z = np.sqrt(np.maximum(1 - x**2 - y**2, 0)) * (1 if near else -1)
    way = np.stack([x, y, z], axis=-1) @ view
    psi = np.arccos(np.clip(way @ limit.axis, -1, 1))
    allowed = inside & (psi <= limit.compute_limit(np.arctan2(way @ limit.side, way @ limit.forward)))
    steep = 1 - np.abs(z)
    opacity = (0.16 + 0.34 * steep**1.5) if near else (0.12 + 0.12 * steep)
    picture = np.empty((PIXELS, PIXELS, 4))
    picture[..., :3] = to_rgb(tint(LEFT, 0.85))
    picture[..., 3] = np.where(allowed, opacity, 0.0)
    x0, y0 = middle
    limits = axes.get_xlim(), axes.get_ylim()
    axes.imshow(
        picture,
        extent=(x0 - radius, x0 + radius, y0 - radius, y0 + radius),
        origin="lower",
        aspect="auto",
        interpolation="antialiased",
        zorder=6 if near else 1,
    )
    axes.set(xlim=limits[0], ylim=limits[1])


def _draw_line(axes: Axes, line: Array, depth: float, colour: str, width: float) -> None:
    """A line on the sphere: full in the near half, dashed and under the body in the far one."""
    near = line[:, 2] >= depth
    for half, style, order in ((near, "-", 8), (~near, (0, (2, 2)), 1.4)):
        shown = np.where(half[:, None], line[:, :2], np.nan)
        axes.plot(*shown.T, color=colour, lw=width if order > 2 else 0.6 * width, ls=style, zorder=order)
