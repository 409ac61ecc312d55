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
