"""``sixpoint study``: experiments of the papers, made again."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from sixpoint.cli.options import Force
from sixpoint.cli.screen import Screen

study = App(name="study", help="Make experiments of the papers again: pictures, numbers and a report.")


@study.command
def flext(
    *,
    out: Annotated[Path, Parameter(help="Folder to write into.")] = Path("study/flext"),
    force: Force = False,
) -> None:
    """Make the figures of the FLEXT paper: flexing from full extension, standing reach, squat and kick.

    Writes four pictures (PNG) and a report (Markdown) with all numbers. Needs no file.

    For example:

    ```
    sixpoint study flext
    sixpoint study flext --out /tmp/flext --force
    ```
    """
    from sixpoint.jobs.flext_study.job import study_flext
    from sixpoint.jobs.flext_study.report import BODY_COLUMNS, LIMB_COLUMNS, body_rows, limb_rows

    screen = Screen()
    with screen.progress() as progress:
        done = study_flext(out, force=force, progress=progress)
    screen.say("a stretched arm flexes: distance to the goal [mm]", style="bold")
    screen.table(LIMB_COLUMNS, limb_rows(done.limb), texts=(0, 1, 2))
    for title, runs in (
        ("standing reach", done.reach),
        ("squat and kick", done.kick),
        ("standing reach, the pelvis free", done.free),
    ):
        screen.say()
        screen.say(f"{title}: peaks are angular accelerations [1000 deg/s^2]", style="bold")
        screen.table(BODY_COLUMNS, body_rows(runs))
    screen.say()
    screen.say(f"written to {out}{os.sep}: {', '.join(path.name for path in done.files)}")
    screen.say("next:", style="bold")
    screen.rows([(f"read {done.files[-1]}", "what is seen, and whether it agrees with the paper")])


@study.command
def sik(
    *,
    out: Annotated[Path, Parameter(help="Folder to write into.")] = Path("study/sik"),
    data: Annotated[
        Path | None,
        Parameter(
            help="Folder with the recordings of the paper; built-in motions in their place by default."
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Make the figures of the Sequential IK paper: spine, clavicle, limb, limits, samples and hierarchy.

    Writes eight pictures (PNG) and a report (Markdown) with all numbers. Needs no file; with `--data` the
    samples are of the paper's recordings, CMU 17_10, 90_05 and 01_03.

    For example:

    ```
    sixpoint study sik
    sixpoint study sik --data data/cmu --out /tmp/sik --force
    ```
    """
    from sixpoint.jobs.sik_study.job import study_sik
    from sixpoint.jobs.sik_study.report import CLIP_COLUMNS, clip_rows, spine_columns, spine_rows

    screen = Screen()
    with screen.progress() as progress:
        done = study_sik(out, data=data, force=force, progress=progress)
    screen.say("a spine between pelvis and head: their distance, and the turn of each joint", style="bold")
    screen.table(spine_columns(done.spine), spine_rows(done.spine))
    screen.say()
    screen.say("whole clips from six points", style="bold")
    screen.table(CLIP_COLUMNS, clip_rows(done.clips), texts=(0, 1))
    screen.say()
    screen.say(f"written to {out}{os.sep}: {', '.join(path.name for path in done.files)}")
    screen.say("next:", style="bold")
    screen.rows([(f"read {done.files[-1]}", "what is seen, with its numbers")])


@study.command
def prior(
    *,
    data: Annotated[
        Path, Parameter(help="Folder with the recordings: cmu/02_01.amc and so on, mass/*.bvh.")
    ] = Path("data"),
    people: Annotated[
        str | None,
        Parameter(help="Whom to fit on, as cmu/02,cmu/05,mass; those of the shipped prior by default."),
    ] = None,
    steps: Annotated[int, Parameter(help="Steps of each of the two fits.")] = 1200,
    seed: Annotated[int, Parameter(help="Of all that is random.")] = 0,
    fetch: Annotated[
        bool, Parameter(negative="", help="Download the trials of the CMU database that are not there.")
    ] = False,
    out: Annotated[Path, Parameter(help="Folder to write into.")] = Path("study/prior"),
    force: Force = False,
) -> None:
    """Fit the prior of sik-prior anew from recordings: a file of numbers and its model card.

    Needs PyTorch: `pip install 'sixpoint[fit]'`. Takes some minutes on one core. The file is used by
    `SequentialIKPrior(figure, prior="study/prior/prior.npz")`.

    For example:

    ```
    sixpoint study prior --fetch --people cmu/02,cmu/03,cmu/05,cmu/09,cmu/11,cmu/16,cmu/29,cmu/127
    ```
    """
    from sixpoint.errors import SixpointError
    from sixpoint.jobs.prior_study import COLUMNS, study_prior
    from sixpoint.solvers.sequential_prior.solver import SequentialIKPrior

    chosen = SequentialIKPrior.fitted_on
    if people is not None:
        chosen = tuple(filter(None, (word.strip() for word in people.split(","))))
    if not chosen or steps < 1:
        raise SixpointError("give at least one person and one step")
    screen = Screen()
    with screen.progress() as progress:
        done = study_prior(
            out, data, people=chosen, steps=steps, seed=seed, fetch=fetch, force=force, progress=progress
        )
    screen.table(COLUMNS, [score.cells for score in done.scores], texts=(0,))
    screen.say()
    screen.say(f"written to {out}{os.sep}: {', '.join(path.name for path in done.files)}")
    screen.say("next:", style="bold")
    screen.rows([(f"read {done.files[-1]}", "what it was fitted on, and what to expect of it")])
