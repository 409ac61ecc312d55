"""The study of the FLEXT constraint: the experiments of its paper, as pictures and a report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.formats.atomic import write_files
from sixpoint.jobs.flext_study.body import (
    FREE_METHODS,
    REACH_METHODS,
    BodyRun,
    acceleration,
    reach,
    squat_and_kick,
)
from sixpoint.jobs.flext_study.limb import BENDS, GOALS, METHODS, LimbRun, flex_all, hand_angle, postures
from sixpoint.jobs.progress import Progress, silent
from sixpoint.jobs.reconstruct import STATURE
from sixpoint.jobs.writing import prepare_folder

if TYPE_CHECKING:
    from sixpoint.study.flext_plots import Traces

Array = NDArray[np.float64]

BUDGETS = (3, 20)
"""Iterations a frame: what real time leaves, and plenty."""
PICTURES = ("convergence.png", "postures.png", "reach.png", "kick.png")
REPORT = "report.md"
CAPTIONS = ("initial", "front flexing", "side flexing", "side flexing, hand kept")


@dataclass(frozen=True, eq=False)
class FlextStudy:
    """All measurements of the study.

    Attributes:
        limb: The stretched arm: every goal, start and method.
        turned: The arm that also keeps the rotation of its hand, with FLEXT.
        turned_angle: How far that hand is from its rotation after the last iteration [rad].
        reach: Standing reach, the pelvis tracked: every method and budget.
        free: The same with a free pelvis.
        kick: Squat and kick: every method and budget.
        files: What was written.
    """

    limb: list[LimbRun]
    turned: LimbRun
    turned_angle: float
    reach: list[BodyRun]
    free: list[BodyRun]
    kick: list[BodyRun]
    files: list[Path]


def study_flext(out: Path, *, force: bool = False, progress: Progress = silent) -> FlextStudy:
    """Run all experiments, draw them and write the report.

    Args:
        out: The folder to write into; it is made.
        force: Write into a folder that is not empty.
        progress: Told how far the work is.

    Returns:
        The measurements, and the files: four pictures and the report.

    Raises:
        FormatError: The folder is a file, or is not empty, or cannot be made.

    Reference: Boulic and Raunhardt 2009, section 6, Figure 4.
    """
    from sixpoint.jobs.flext_study.report import report

    # Matplotlib is slow to import
    from sixpoint.study.flext_plots import draw_convergence, draw_kick, draw_postures, draw_reach

    prepare_folder(out, force)
    figure = Figure.from_stature(STATURE)
    files = [out / name for name in PICTURES]
    steps = 4 + 2 * len(BUDGETS)
    progress("studying FLEXT", 0, steps)
    limb = flex_all(figure)
    panels = [(title, _starts(limb, goal)) for goal, title in zip(GOALS, ("front", "side"), strict=True)]
    draw_convergence([(f"{name} flexing", runs) for name, runs in panels], files[0])
    progress("studying FLEXT", 1, steps)
    plain, flext, goals, turned = postures(figure)
    draw_postures(figure, plain, flext, CAPTIONS, goals, files[1])
    progress("studying FLEXT", 2, steps)
    reaches: list[BodyRun] = []
    kicks: list[BodyRun] = []
    for done, budget in enumerate(BUDGETS):
        reaches += [reach(figure, name, budget) for name in REACH_METHODS]
        kicks += [squat_and_kick(figure, method, budget) for method in METHODS]
        progress("studying FLEXT", 3 + done, steps)
    free = [reach(figure, name, BUDGETS[-1], held=False) for name in FREE_METHODS]
    progress("studying FLEXT", steps - 3, steps)
    draw_reach(figure, _traces(reaches[0]), _traces(reaches[2]), files[2])
    progress("studying FLEXT", steps - 2, steps)
    draw_kick(figure, _traces(kicks[0]), _traces(kicks[1]), files[3])
    progress("studying FLEXT", steps - 1, steps)
    angle = hand_angle(figure, turned.poses[-1])
    study = FlextStudy(limb, turned, angle, reaches, free, kicks, [*files, out / REPORT])
    write_files({out / REPORT: report(study).encode()}, force=True)
    progress("studying FLEXT", steps, steps)
    return study


def _starts(limb: list[LimbRun], goal: str) -> list[tuple[float, Array, Array]]:
    """Of every start the errors with a plain constraint and with FLEXT."""
    runs = {(run.bend, run.method): run.errors for run in limb if run.goal == goal}
    return [(bend, runs[bend, METHODS[0]], runs[bend, METHODS[1]]) for bend in BENDS]


def _traces(run: BodyRun) -> Traces:
    """What is drawn of a run."""
    from sixpoint.study.flext_plots import Traces

    return Traces(
        motion=run.motion,
        budget=run.budget,
        errors=run.errors,
        knees=run.knees,
        truth=run.truth,
        swings=acceleration(run.knees),
        true_swings=acceleration(run.truth),
        goals=run.goals,
    )
