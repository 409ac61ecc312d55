"""Pictures of the FLEXT study: convergence of a limb, its postures, whole-body sequences over their curves.

Plain position constraints are dark diamonds, FLEXT light squares, as in the figures of the paper.

Reference: Boulic and Raunhardt 2009, section 6 and Figure 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.study.canvas import (
    DPI,
    GHOST,
    INK,
    LEFT,
    RIGHT,
    SOFT,
    WIDTH,
    add_heading,
    add_legend,
    save_canvas,
    style_axes,
)
from sixpoint.study.plots import film

Array = NDArray[np.float64]

PLAIN, FLEXT = INK, RIGHT
DASHES = ("-", (0, (5, 2)), (0, (1.2, 1.6)))
PANEL, FOOT = 1.45, 0.5  # height of a panel of curves with its gap, and room under the last one [inch]


REACH_FRAMES, KICK_FRAMES = (20, 102, 150, 198, 252, 306, 362), (12, 48, 90, 126, 177, 197, 228, 250)


@dataclass(frozen=True, eq=False)
class Traces:
    """What is drawn of a whole-body sequence.

    Attributes:
        motion: The solved postures.
        budget: Iterations a frame, at most.
        errors: (F, 3) distance of the left and the right foot and of the right hand to their goals [m].
        knees: (F, 2) knee angles, left and right [rad].
        truth: (F, 2) knee angles that meet all goals exactly [rad].
        swings: (F, 2) angular accelerations of the knees [rad/s^2].
        true_swings: (F, 2) those of the true angles [rad/s^2].
        goals: (F, 3, 3) goals of feet and right hand [m]; NaN for none.
    """

    motion: Motion
    budget: int
    errors: Array
    knees: Array
    truth: Array
    swings: Array
    true_swings: Array
    goals: Array


@dataclass(frozen=True, eq=False)
class Curve:
    """One line of a panel.

    Attributes:
        name: For the legend.
        values: (n,) ordinates.
        colour: Of the line.
        dashes: Its pattern, as Matplotlib has it.
        width: Of the line [point].
    """

    name: str
    values: Array
    colour: str
    dashes: str | tuple[int, tuple[float, ...]] = "-"
    width: float = 1.6


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves over one time axis.

    Attributes:
        label: Quantity and unit of the ordinates.
        curves: From back to front.
        top: Highest ordinate shown; None for the largest value.
        logarithmic: Whether the ordinates are on a logarithmic scale; ``floor`` is its foot.
        floor: Lowest ordinate shown; None for the smallest value.
    """

    label: str
    curves: Sequence[Curve]
    top: float | None = None
    logarithmic: bool = False
    floor: float | None = None


def draw_convergence(panels: Sequence[tuple[str, Sequence[tuple[float, Array, Array]]]], path: Path) -> Path:
    """Draw error against iteration, a panel for each goal, from several starts.

    Args:
        panels: Title -> (bend at the start [rad], errors (K + 1,) with a plain constraint, with FLEXT [m]);
            at most three starts, the straight limb first.
        path: The PNG to write.

    Returns:
        ``path``.
    """
    canvas = Canvas(figsize=(WIDTH, 4.3), dpi=DPI)
    add_heading(canvas, "Flexing a stretched arm", "")
    wide = 0.86 / len(panels)
    highest = 100 * max(float(max(a.max(), b.max())) for _, runs in panels for _, a, b in runs)
    for k, (title, runs) in enumerate(panels):
        axes = canvas.add_axes((0.055 + k * (wide + 0.065), 0.13, wide, 0.61))
        for (bend, plain, flext), dashes in zip(runs, DASHES, strict=False):
            at = f"{np.degrees(bend):.1f}° bent" if bend else "straight"
            lines = axes.plot(100 * plain, "D", color=PLAIN, label=f"plain, {at}")
            lines += axes.plot(100 * flext, "s", color=FLEXT, mfc="white", label=f"FLEXT, {at}")
            for line in lines:
                line.set(ls=dashes, lw=1.2, ms=5.0, clip_on=False)
        style_axes(axes, np.array([0.0, len(runs[0][1]) - 1.0]), "distance to the goal [cm]", "iteration")
        axes.set_ylim(0, 1.04 * highest)
        axes.set_title(title, loc="left", color=INK, size=11)
    handles, labels = axes.get_legend_handles_labels()
    order = [*range(0, len(labels), 2), *range(1, len(labels), 2)]
    canvas.legend(
        [handles[i] for i in order],
        [labels[i] for i in order],
        loc="upper right",
        bbox_to_anchor=(0.99, 0.985),
        ncols=2,
        frameon=False,
        fontsize=9.5,
        labelcolor=SOFT,
        handlelength=3.6,
        labelspacing=0.25,
    )
    return save_canvas(canvas, path)


def draw_postures(
    figure: Figure, plain: Motion, flext: Motion, captions: Sequence[str], goals: Array, path: Path
) -> Path:
    """Draw what FLEXT makes of a posture over what a plain constraint makes of it.

    Args:
        figure: The figure of both motions.
        plain: One posture a frame, drawn in grey.
        flext: As many postures, drawn in colours.
        captions: One a posture.
        goals: (F, n, 3) points to mark [m]; NaN for none.
        path: The PNG to write.

    Returns:
        ``path``.
    """
    shown = range(len(plain))
    canvas = film(
        figure, (plain, flext), list(shown), 0.0, captions=captions, points=goals, yaw=np.radians(55)
    )
    add_heading(canvas, "A stretched arm flexes to the front and to the side", "after 12 iterations")
    add_legend(
        canvas,
        ((GHOST, "plain constraint"), (LEFT, "FLEXT, left side"), (RIGHT, "right side"), (INK, "goal")),
    )
    return save_canvas(canvas, path)


def draw_reach(figure: Figure, plain: Traces, flext: Traces, path: Path) -> Path:
    """Draw the standing reach with FLEXT; below, errors and the left knee, with plain constraints too.

    Args:
        figure: The figure of both motions.
        plain: With plain constraints.
        flext: With FLEXT.
        path: The PNG to write.

    Returns:
        ``path``.
    """
    hands = [
        Curve("hand, plain", 1e3 * plain.errors[:, 2], GHOST, width=2.2),
        Curve("hand, FLEXT", 1e3 * flext.errors[:, 2], LEFT, width=1.2),
    ]
    panels = [
        Panel("error [mm]", [*hands, *_feet(plain, flext)], floor=1e-4, logarithmic=True),
        _angle_panel("left knee [°]", plain, flext, 0),
        _swing_panel("left knee\n[1000 °/s²]", plain, flext, 0),
    ]
    note = f"drawn: FLEXT; at most {flext.budget} iterations a frame"
    centre = flext.goals[0, :2].mean(axis=0) + np.array([0.0, 0.0, 0.05])
    title = "Standing reach, the feet held"
    return _draw_sequence(figure, flext, REACH_FRAMES, path, title, note, panels, centre, np.radians(-58))


def draw_kick(figure: Figure, plain: Traces, flext: Traces, path: Path) -> Path:
    """Draw squat and kick with FLEXT; below, errors and knees, with plain constraints too.

    Args:
        figure: The figure of both motions.
        plain: With plain constraints.
        flext: With FLEXT.
        path: The PNG to write.

    Returns:
        ``path``.
    """
    panels = [
        Panel("error [mm]", _feet(plain, flext), floor=1e-4, logarithmic=True),
        _angle_panel("right knee [°]", plain, flext, 1),
        _swing_panel("left knee\n[1000 °/s²]", plain, flext, 0),
        _swing_panel("right knee\n[1000 °/s²]", plain, flext, 1),
    ]
    note = f"drawn: FLEXT; at most {flext.budget} iterations a frame"
    centre = flext.goals[0, :2].mean(axis=0) + np.array([0.0, 0.0, 0.05])
    title = "Squat and kick, the feet held"
    return _draw_sequence(figure, flext, KICK_FRAMES, path, title, note, panels, centre, np.radians(-66))


def _feet(plain: Traces, flext: Traces) -> list[Curve]:
    return [
        Curve("feet, plain", 1e3 * plain.errors[:, :2].max(axis=1), PLAIN, width=1.2),
        Curve("feet, FLEXT", 1e3 * flext.errors[:, :2].max(axis=1), FLEXT, width=1.2),
    ]


def _angle_panel(label: str, plain: Traces, flext: Traces, side: int) -> Panel:
    """A knee over time near extension, where a plain constraint is blind."""
    angles = [Curve("true", np.degrees(plain.truth[:, side]), GHOST, width=4.0)]
    angles += [Curve("plain", np.degrees(plain.knees[:, side]), PLAIN, width=1.2)]
    return Panel(
        label, [*angles, Curve("FLEXT", np.degrees(flext.knees[:, side]), FLEXT, width=1.2)], top=6.0
    )


def _swing_panel(label: str, plain: Traces, flext: Traces, side: int) -> Panel:
    """Angular acceleration of a knee over time."""
    thousands = 1e-3 * np.degrees(1.0)
    return Panel(
        label,
        [
            Curve("plain", thousands * plain.swings[:, side], PLAIN, width=1.0),
            Curve("true", thousands * plain.true_swings[:, side], GHOST, width=4.0),
            Curve("FLEXT", thousands * flext.swings[:, side], FLEXT, width=1.2),
        ],
    )


def _draw_sequence(
    figure: Figure,
    traces: Traces,
    frames: Sequence[int],
    path: Path,
    title: str,
    note: str,
    panels: Sequence[Panel],
    centre: Array,
    yaw: float,
) -> Path:
    """A film strip seen from ``yaw``, around ``centre``, and panels of curves under it."""
    motion, below = traces.motion, FOOT + PANEL * len(panels)
    canvas = film(figure, (motion,), list(frames), below, points=traces.goals, centre=centre, yaw=yaw)
    add_heading(canvas, title, note)
    times = np.arange(len(motion)) / motion.rate
    total = canvas.get_figheight()
    for k, panel in enumerate(panels):
        low = FOOT + PANEL * (len(panels) - 1 - k)
        axes = canvas.add_axes((0.075, low / total, 0.745, (PANEL - 0.28) / total))
        for frame in frames:
            axes.axvline(times[frame], color="#e6eaee", lw=1.0, zorder=0)
        _draw_panel(axes, panel, times, last=k == len(panels) - 1)
    return save_canvas(canvas, path)


def _draw_panel(axes: Axes, panel: Panel, times: Array, last: bool) -> None:
    highest = max(float(np.nanmax(curve.values)) for curve in panel.curves)
    lowest = min(float(np.nanmin(curve.values)) for curve in panel.curves)
    for curve in panel.curves:
        values = np.maximum(curve.values, panel.floor or 1e-9) if panel.logarithmic else curve.values
        axes.plot(times, values, color=curve.colour, ls=curve.dashes, lw=curve.width, label=curve.name)
    style_axes(axes, times, panel.label, "time [s]" if last else "")
    top = highest if panel.top is None else panel.top
    foot = min(lowest, 0.0) if panel.floor is None else panel.floor
    if panel.logarithmic:
        axes.set_yscale("log")
        axes.set_ylim(panel.floor or max(lowest, 1e-9), 2 * top)
        axes.tick_params(which="minor", length=0)
    else:
        axes.set_ylim(foot - 0.04 * (top - foot), top + 0.04 * (top - foot))
    if not last:
        axes.tick_params(labelbottom=False)
    axes.yaxis.set_label_coords(-0.048, 0.5)
    axes.legend(
        loc="upper left",
        bbox_to_anchor=(1.01, 1.06),
        frameon=False,
        labelcolor=SOFT,
        fontsize=9.5,
        handlelength=1.6,
        borderaxespad=0.0,
    )
