"""``sixpoint demo``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from sixpoint.cli.options import Force, NoLimits
from sixpoint.cli.screen import Screen
from sixpoint.cli.view import show_page

if TYPE_CHECKING:
    from sixpoint.jobs.demo import DemoClip

COLUMNS = ("clip", "frames", "position", "mean cm", "rad", "worst cm", "missed", "us/frame")
LEGEND = (
    ("position", "distance of the joints to the truth, over the figure's height"),
    ("mean cm", "the same as a mean distance"),
    ("rad", "angle of the joints to the truth"),
    ("worst cm", "largest distance of one of the six points to its target"),
    ("missed", "frames with a point more than 1 cm off: beyond reach or limits (see --no-limits)"),
)


def demo(
    *,
    out: Annotated[Path, Parameter(help="Folder to write into.")] = Path("demo"),
    sample: Annotated[
        list[str] | None,
        Parameter(
            name="--sample",
            negative="",
            consume_multiple=True,
            help="Only these motions: boxing, jump_kick, climb_and_hang, walk, reach.",
        ),
    ] = None,
    stature: Annotated[float, Parameter(help="Stature of the figure [m].")] = 1.75,
    no_limits: NoLimits = False,
    force: Force = False,
    view: Annotated[
        bool, Parameter(negative="", help="Open them on a page in the browser instead; writes nothing.")
    ] = False,
) -> None:
    """Reconstruct built-in motions from six points, and show how well it went. Needs no file.

    Writes the true motion, the result (BVH), the six points (CSV) and a picture of each. With --view they are
    on a page, where the six points can be dragged (see `sixpoint view`).

    For example:

    ```
    sixpoint demo
    sixpoint demo --sample boxing walk --out /tmp/demo
    sixpoint demo --force --no-limits
    sixpoint demo --view
    ```
    """
    if view:
        show_page(lambda clips: clips.sample_clips(sample or (), stature), limits=not no_limits)
        return
    from sixpoint.jobs import demo as job
    from sixpoint.jobs.solving import Solving

    screen = Screen()
    with screen.progress() as progress:
        clips = job.demo(
            out,
            names=sample or (),
            stature=stature,
            solving=Solving(limits=not no_limits),
            force=force,
            progress=progress,
        )
    screen.table(COLUMNS, [_row(clip) for clip in clips])
    screen.say()
    screen.rows(LEGEND)
    screen.say()
    _point_on(screen, out, clips[0].name)


def _row(clip: DemoClip) -> list[str]:
    from sixpoint.solvers.base import Status

    solution = clip.solved.solution
    return [
        clip.name,
        f"{len(solution.motion)}",
        f"{clip.errors.position:.4f}",
        f"{100 * clip.errors.distances.mean():.2f}",
        f"{clip.errors.orientation:.3f}",
        f"{100 * solution.residual.max():.2f}",
        f"{solution.count(Status.UNREACHABLE)}",
        f"{clip.solved.seconds * 1e6:.1f}",
    ]


def _point_on(screen: Screen, out: Path, name: str) -> None:
    endings = ("_truth.bvh", "_result.bvh", "_points.csv", ".png")
    screen.say(f"written to {out}{os.sep}: {', '.join('<clip>' + ending for ending in endings)}")
    screen.say("next:", style="bold")
    screen.rows(
        [
            (f"look at {out / name}.png", "the result over the truth; open the .bvh files in Blender"),
            (f"sixpoint info {out / name}_truth.bvh", "what a file holds"),
            (f"sixpoint reconstruct {out / name}_points.csv", "pose a body from six points"),
            ("sixpoint demo --view", "drag them in the browser; needs the extra [viewer]"),
            ("sixpoint demo --force --no-limits", "free joints: every reachable point is met exactly"),
            ("sixpoint reconstruct RECORDING", "the same with your own .bvh or .amc"),
        ]
    )
