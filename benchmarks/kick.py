"""The jump kick over time: where methods lose it, and that it is the yaw of the pelvis that they lose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

import sixpoint as sp
from sixpoint.study.canvas import (
    GHOST,
    INK,
    LEFT,
    RIGHT,
    SERIES,
    SOFT,
    add_heading,
    add_legend,
    save_canvas,
    style_axes,
)
from sixpoint.study.movement import compute_heading, compute_turning, wrap
from sixpoint.study.plots import film

Array = np.ndarray

METHODS: Mapping[str, tuple[str, Mapping[str, Any]]] = {
    "sik": (INK, {"weights": sp.FIGHTING}),
    "sik+": (SERIES[4], {}),
    "sik-prior": (SERIES[3], {}),
}
"""Method -> colour of its curve, options. A further one joins the curves."""
SHOWN = "sik+"  # whose body is drawn
BEFORE = "wrists before the chest; below zero behind it [m]"
BEGIN = 0.9  # before this he stands [s]
OFF_FLOOR = 0.05  # an ankle higher than this over its standing height is off the floor [m]
TURN, SHADE = 2.0, "#f8e3c8"  # as in the comparison: a pelvis that turns faster [rad/s]
PANELS = (1.55, 1.35, 1.2)  # heights of the three panels [inch]
SPACE, FOOT, HEAD = 0.36, 0.5, 0.42  # above each panel, below all, above all [inch]


@dataclass(frozen=True)
class Moments:
    """Frames at which something happens.

    Attributes:
        names: In the order of time.
        frames: Theirs.
    """

    names: tuple[str, ...]
    frames: tuple[int, ...]


def find_moments(points: Array) -> Moments:
    """Key moments of a jump kick, from the six points (F, 6, 3) [m].

    The kick is where an ankle is highest; take-off and landing are the last and first frame with a foot on
    the floor before and after it; the spin is halfway between take-off and kick; the turning hop before them
    is where the lower ankle is highest.
    """
    heights = points[:, 4:, 1] - np.percentile(points[:, 4:, 1], 5, axis=0)
    down = np.flatnonzero((heights < OFF_FLOOR).any(axis=1))
    strike = int(heights.max(axis=1).argmax())
    leave, land = int(down[down < strike].max()), int(down[down > strike].min())
    hop = int(heights.min(axis=1)[:leave].argmax())
    return Moments(
        ("turning hop", "take-off", "spin", "kick", "landing"),
        (hop, leave, (leave + strike) // 2, strike, land),
    )


def draw(recording: Path, picture: Path) -> str:
    """Draw errors over time with bodies at the key moments; returns what the curves show, a sentence."""
    truth = sp.load(recording).sliced(slice(1, None))  # the first row is a T-pose that the conversion added
    figure = sp.Figure.from_motion(truth)
    targets = sp.Targets(figure.targets(truth).positions, truth.rate)
    heading = compute_heading(figure, truth)
    position, yaw, results = {}, {}, {}
    for method, (_, options) in METHODS.items():
        results[method] = sp.make_solver(method, figure, limits=False, **options).solve_motion(targets)
        position[method] = sp.compute_errors(figure, truth, results[method]).position_curve
        yaw[method] = np.degrees(np.abs(wrap(compute_heading(figure, results[method]) - heading)))
    turning = compute_turning(figure, truth)
    moments = find_moments(targets.positions)
    times = np.arange(len(truth)) / truth.rate
    captions = [f"{name}, {times[k]:.2f} s" for name, k in zip(moments.names, moments.frames, strict=True)]
    below = FOOT + sum(PANELS) + SPACE * len(PANELS) + HEAD
    canvas = film(figure, (truth, results[SHOWN]), list(moments.frames), below=below, captions=captions)
    add_heading(canvas, f"Jump kick (CMU 90_05), limits off: {SHOWN} over the truth", "")
    shown = ((GHOST, "truth"), (LEFT, "left side"), (RIGHT, "right side"), (INK, "six points"))
    add_legend(canvas, (*shown, (SHADE, f"true pelvis turns faster than {TURN:g} rad/s")))
    hands = reach_of_hands(figure, truth, targets.positions)
    panels = {
        "position error over H": {m: (colour, position[m]) for m, (colour, _) in METHODS.items()},
        "pelvis: error of its yaw [°]": {m: (colour, yaw[m]) for m, (colour, _) in METHODS.items()},
        BEFORE: {"left": (LEFT, hands[:, 0]), "right": (RIGHT, hands[:, 1])},
    }
    foot, total = below - HEAD, canvas.get_figheight()
    for height, (title, curves) in zip(PANELS, panels.items(), strict=True):
        foot -= SPACE + height
        axes = canvas.add_axes((0.055, foot / total, 0.925, height / total))
        first, last = title == next(iter(panels)), title == BEFORE
        _draw_curves(axes, times, curves, "time [s]" if last else "")
        _draw_moments(axes, times, turning, moments, named=first)
        rise = (foot + height + (0.3 if first else 0.1)) / total
        canvas.text(0.055, rise, title, color=INK, size=10)
        edge = 0.98
        for name, (colour, _) in reversed(curves.items()):
            canvas.text(edge, rise, f"— {name}", color=colour, size=10, weight="bold", ha="right")
            edge -= 0.034 + 0.0085 * len(name)
    save_canvas(canvas, picture)
    said = (
        _say(moments, times, position, yaw, hands),
        _say_lines(figure, truth, targets.positions, moments),
        _say_wrists(figure, truth, targets),
    )
    return " ".join(said)


def reach_of_hands(figure: sp.Figure, truth: sp.Motion, points: Array) -> Array:
    """(F, 2) how far each wrist is before the chest, along the true pelvis' heading [m]."""
    heading = compute_heading(figure, truth)
    forward = np.stack([np.sin(heading), np.zeros_like(heading), np.cos(heading)], axis=-1)
    chest = points[:, 0] + 0.75 * (points[:, 1] - points[:, 0])
    return np.asarray(np.einsum("fkx,fx->fk", points[:, 2:4] - chest[:, None], forward))


def _draw_curves(axes: Axes, times: Array, curves: Mapping[str, tuple[str, Array]], xlabel: str) -> None:
    begin = int(np.searchsorted(times, BEGIN))
    for colour, curve in curves.values():
        axes.plot(times[begin:], curve[begin:], color=colour, lw=1.8, zorder=3)
    style_axes(axes, times[begin:], "", xlabel)
    axes.tick_params(labelbottom=bool(xlabel))
    values = np.concatenate([curve[begin:] for _, curve in curves.values()])
    low = min(0.0, float(values.min()))
    axes.set_ylim(1.15 * low, 1.12 * float(values.max()))
    if low < 0:
        axes.axhline(0, color=SOFT, lw=0.8, zorder=2)


def _draw_moments(axes: Axes, times: Array, turning: Array, moments: Moments, named: bool) -> None:
    """Fast turning shaded, moments dotted and named."""
    fast = np.abs(turning) > TURN
    edges = np.flatnonzero(np.diff(np.concatenate([[False], fast, [False]]).astype(int)))
    for begin, end in edges.reshape(-1, 2):
        axes.axvspan(times[begin], times[end - 1], color=SHADE, lw=0, zorder=0)
    for name, frame in zip(moments.names, moments.frames, strict=True):
        axes.axvline(times[frame], color=SOFT, lw=0.9, ls=(0, (1, 1.5)), zorder=2)
        if named:
            axes.text(
                times[frame],
                1.02,
                name,
                transform=axes.get_xaxis_transform(),
                ha="center",
                color=SOFT,
                size=8.5,
            )


def _say(
    moments: Moments, times: Array, position: Mapping[str, Array], yaw: Mapping[str, Array], hands: Array
) -> str:
    """Numbers of the curves in words."""
    texts: list[str] = []
    for method in position:
        worst = int(np.argmax(position[method]))
        alike = float(np.corrcoef(position[method], yaw[method])[0, 1])
        texts.append(
            f"The position error of `{method}` is highest at {times[worst]:.2f} s, "
            f"{position[method][worst]:.4f}, with the pelvis turned {yaw[method][worst]:.0f}° away from the "
            f"truth; over the clip it goes with the error of the yaw (correlation {alike:.2f})."
        )
    hop, *_, landing = (hands[frame].min() for frame in moments.frames)
    texts.append(
        f"A wrist is up to {-hands.min():.2f} m behind the chest: {-hop:.2f} m in the turning hop, "
        f"{-landing:.2f} m at the landing."
    )
    return " ".join(texts)


def _say_lines(figure: sp.Figure, truth: sp.Motion, points: Array, moments: Moments) -> str:
    """How far the lines that tell the yaw are from the true one."""
    heading, off = compute_heading(figure, truth), {}
    for name, left in (("wrists", 2), ("ankles", 4)):
        across = points[:, left] - points[:, left + 1]
        off[name] = np.degrees(np.abs(wrap(np.arctan2(-across[:, 2], across[:, 0]) - heading)))
    hop, *_, landing = moments.frames
    return (
        f"The line of the wrists is then {off['wrists'][hop]:.0f}° and {off['wrists'][landing]:.0f}° away "
        f"from the hips', that of the ankles {off['ankles'][hop]:.0f}° and {off['ankles'][landing]:.0f}°."
    )


def _say_wrists(figure: sp.Figure, truth: sp.Motion, targets: sp.Targets) -> str:
    """What the wrists tell SIK+ in this clip."""
    errors = []
    for habits in (sp.Habits(), sp.Habits(wrist_line=0.0, reach=0.0)):
        solver = sp.SequentialIKPlus(figure, limits=False, habits=habits)
        errors.append(sp.compute_errors(figure, truth, solver.solve_motion(targets)).position)
    return (
        f"With the wrists hidden from the pelvis the error of `sik+` in this clip is {errors[1]:.4f} in "
        f"place of {errors[0]:.4f}."
    )
