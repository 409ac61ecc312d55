"""Every method's body at one frame over the truth, as the paper's Figures 19 to 21: a grid of mannequins.

The joints of trunk and clavicles are dots, white ones on the result and hollow ones on a line for the truth:
the shape of the spine and raised clavicles can be compared. Elbows show the swivel.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.study.canvas import DPI, GHOST, INK, LEFT, RIGHT, SOFT, TRUNK, WIDTH, add_heading, add_legend
from sixpoint.study.comparison.curves import plain
from sixpoint.study.comparison.model import ClipRuns, Run
from sixpoint.study.plots import VIEW_YAW, _camera, _draw_body, _outline, _Part, _parts

Array = NDArray[np.float64]

SIDE, TOP, FOOT = 0.1, 0.9, 0.5  # margin, heading, captions of a row [inch]
BEYOND = 0.3  # how far results are shown beyond the truth, in units of the figure
LARGEST = 0.45  # units of the figure an inch, where there is room
THICK = 0.026  # radius of a slim trunk, in the same units


def draw_poses(clip: ClipRuns, methods: Sequence[str], missing: Mapping[str, str]) -> Canvas:
    """Draw the truth and all methods at the clip's chosen frame.

    Args:
        clip: What to draw.
        methods: In the order of the pictures.
        missing: Method -> why it has no result, said in place of its body.
    """
    count = len(methods) + 1
    columns = min(count, min((4, 5, 6), key=lambda n: -count % n))
    view = _make_view(clip, methods)
    extent = view.high - view.low
    wide = (WIDTH - 2 * SIDE) / columns
    scale = max(float(extent[0]) / wide, LARGEST * clip.figure.height / 1.6)
    tall, rows = float(extent[1]) / scale, -(-count // columns)
    height = round((TOP + rows * (tall + FOOT)) * DPI) / DPI
    canvas = Canvas(figsize=(WIDTH, height), dpi=DPI)
    add_heading(
        canvas,
        f"{plain(clip.name)}: all methods at frame {clip.frame}",
        "position error over H, orientation error",
    )
    legend = ((GHOST, "truth"), (LEFT, "left side"), (RIGHT, "right side"), (INK, "six points"))
    add_legend(canvas, (*legend, (SOFT, "hollow: joints of the true trunk")))
    middle = float((view.low + view.high)[0]) / 2
    for k, name in enumerate(("truth", *methods)):
        left = SIDE + k % columns * wide
        foot = height - TOP - tall - k // columns * (tall + FOOT)
        axes = canvas.add_axes((left / WIDTH, foot / height, wide / WIDTH, tall / height))
        axes.set(
            xlim=(middle - scale * wide / 2, middle + scale * wide / 2), ylim=(view.low[1], view.high[1])
        )
        axes.axis("off")
        run = clip.runs.get(name)
        _draw_cell(axes, clip, run.sample if run else clip.truth if k == 0 else None, view)
        x, y = (left + wide / 2 + (view.centre - middle) / scale) / WIDTH, (foot - 0.03) / height
        canvas.text(x, y, plain(name), size=11, weight="bold", color=INK, ha="center", va="top")
        caption = _caption(clip, run) if run else "" if k == 0 else plain(missing.get(name, "no result"))
        canvas.text(x, y - 0.19 / height, caption, size=9.5, color=SOFT, ha="center", va="top")
    return canvas


def _caption(clip: ClipRuns, run: Run) -> str:
    return f"{run.position[clip.frame]:.4f}   {run.orientation[clip.frame]:.3f} rad"


@dataclass(frozen=True, eq=False)
class _View:
    """What every cell shows.

    Attributes:
        camera: (3, 3) right, up and towards the viewer.
        origin: (3,) below the true pelvis, as low as the lowest joint [m].
        low: (2,) lower left corner, seen from the origin [m].
        high: (2,) upper right corner [m].
        centre: Middle of the true body [m].
    """

    camera: Array
    origin: Array
    low: Array
    high: Array
    centre: float


def _make_view(clip: ClipRuns, methods: Sequence[str]) -> _View:
    """All bodies from the same side; of stray ones not much more than what the truth needs."""
    figure, unit = clip.figure, clip.figure.height / 1.6
    camera = _camera(figure, clip.truth, [0], VIEW_YAW)
    positions = clip.truth.positions[0]
    origin = np.asarray(positions[figure.roles.pelvis] * [1, 0, 1] + [0, positions[:, 1].min(), 0])
    bodies = [clip.truth, *(clip.runs[m].sample for m in methods if m in clip.runs)]
    outlines = [
        np.concatenate([o for _, o in _layer(figure, body, origin, camera, False)]) for body in bodies
    ]
    lows, highs = (np.array([edge(outline, axis=0) for outline in outlines]) for edge in (np.min, np.max))
    low = np.maximum(lows.min(axis=0), lows[0] - BEYOND * unit)
    high = np.minimum(highs.max(axis=0), highs[0] + BEYOND * unit)
    pad = np.array([0.05, 0.04]) * unit
    low = np.minimum(low, [np.inf, -0.05 * unit])  # the floor
    return _View(camera, origin, low - pad, high + pad, float((lows[0] + highs[0])[0] / 2))


def _layer(
    figure: Figure, motion: Motion, origin: Array, camera: Array, slim: bool
) -> list[tuple[str, Array]]:
    """Colours and outlines of a body, far parts first; a slim trunk follows its joints and clavicles."""
    positions, world = motion.transforms
    places = positions[0] - origin
    parts = _parts(figure, places, world[0], slim=slim)
    if slim:
        radius = np.full(2, THICK * figure.height / 1.6)
        hips = [[figure.roles.pelvis, hip] for hip in figure.roles.hip]
        pairs = [list(pair) for line in (*_trunk_lines(figure), *hips) for pair in pairwise(line)]
        trunk = [_Part(places[pair], radius, TRUNK) for pair in pairs]
        parts = [
            *trunk,
            *(part for part in parts[:-1] if part.colour != TRUNK),
            parts[-1],
        ]  # the last is the head
    parts.sort(key=lambda part: float((part.centres @ camera[2]).mean()))
    return [(part.colour, _outline(part, camera)) for part in parts]


def _trunk_lines(figure: Figure) -> list[list[int]]:
    """Joints from the pelvis to the head, and from the spine by way of each clavicle to its shoulder."""
    r, parents = figure.roles, figure.skeleton.parents
    arms = zip(r.clavicle or r.shoulder, r.shoulder, strict=True)
    return [[r.pelvis, *r.spine], *([int(parents[a]), *dict.fromkeys((a, b))] for a, b in arms)]


def _draw_cell(axes: Axes, clip: ClipRuns, result: Motion | None, view: _View) -> None:
    """The truth in grey; over it the result, if there is one, and the joints of both trunks."""
    figure, origin, camera = clip.figure, view.origin, view.camera
    layers = [_layer(figure, clip.truth, origin, camera, slim=False)]
    shown = [] if result is None else [result]
    layers += [_layer(figure, motion, origin, camera, slim=True) for motion in shown] or [[]]
    points = (figure.targets(clip.truth).positions[0] - origin) @ camera.T
    _draw_body(axes, layers, points[:, :2] if shown else None, np.zeros(2), camera, figure.height / 1.6)
    for motion in [clip.truth, *shown] if shown else []:
        for line in _trunk_lines(figure):
            places = ((motion.positions[0, line] - origin) @ camera.T)[:, :2]
            if motion is clip.truth:
                axes.plot(
                    *places.T, "o-", color=SOFT, lw=1.2, ms=4.0, mfc="white", mec=SOFT, mew=1.0, zorder=7
                )
            else:
                axes.plot(*places.T, "o", ms=3.0, color="white", mew=0, zorder=8)
