"""``sixpoint data``: public recordings, fetched on request."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from sixpoint.cli.screen import Screen

data = App(name="data", help="Fetch public recordings, so that anyone can repeat a study.")


@data.command
def cmu(
    trials: Annotated[list[str], Parameter(help="One or more trials, as subject_trial: `17_10`.")],
    /,
    *,
    out: Annotated[Path, Parameter(help="Folder to fetch into.")] = Path("data/cmu"),
    site: Annotated[
        str | None, Parameter(name="--from", help="Base URL of a mirror; by default http://mocap.cs.cmu.edu.")
    ] = None,
    force: Annotated[
        bool, Parameter(negative="", help="Fetch files anew that are here, and record their new hashes.")
    ] = False,
) -> None:
    """Fetch trials of the CMU Graphics Lab Motion Capture Database.

    Each trial is an .amc; the .asf of its subject comes with it. Files that are here are not fetched again,
    a transfer that was cut goes on where it stopped. SHA256SUMS records what was fetched: check it with
    `sha256sum -c SHA256SUMS`.

    For example:

    ```
    sixpoint data cmu 17_10 90_05 01_03
    sixpoint data cmu 17_10 --out recordings
    ```
    """
    from sixpoint.jobs.data import fetch_cmu

    screen = Screen()
    with screen.progress() as progress:
        done = fetch_cmu(trials, out, site=site, force=force, progress=progress)
    screen.say(f"in {out}{os.sep}:", style="bold")
    screen.rows([(path.name, outcome) for path, outcome in done.files.items()])
    screen.say("credit, for what you publish:", style="bold")
    screen.say(f"  {done.credit}")
    screen.say("next:", style="bold")
    motions = " ".join(str(path) for path in done.files if path.suffix == ".amc")
    screen.rows([(f"sixpoint compare {motions}", "repeat the study")])
