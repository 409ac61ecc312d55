"""The demonstration: built-in motions, reconstructed from six points and measured. Needs no file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from sixpoint.body.figure import Figure
from sixpoint.errors import FormatError, SixpointError, listed
from sixpoint.formats import save, save_targets
from sixpoint.jobs.progress import Progress, silent
from sixpoint.jobs.reconstruct import STATURE
from sixpoint.jobs.solving import Solved, Solving, solve
from sixpoint.samples import SAMPLES, make_sample
from sixpoint.solvers.registry import find_options, find_solver
from sixpoint.solvers.six_points.solver import FIGHTING, WALKING
from sixpoint.study.metrics import Errors, compute_errors

FAST = ("boxing", "jump_kick")
"""Motions for which the paper has the pelvis follow wrists and ankles at once, by methods with weights."""
ENDINGS = ("_truth.bvh", "_result.bvh", "_points.csv", ".png")
"""What is written of each motion, after its name."""


@dataclass(frozen=True, eq=False)
class DemoClip:
    """One motion of the demonstration.

    Attributes:
        name: The motion's.
        solved: Postures, status and residuals.
        errors: Against the motion the six points were taken from.
        files: What was written.
    """

    name: str
    solved: Solved
    errors: Errors
    files: list[Path]


def demo(
    out: Path,
    *,
    names: Sequence[str] = (),
    stature: float = STATURE,
    solving: Solving | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> list[DemoClip]:
    """Reconstruct built-in motions and write truth, result, points and picture of each.

    Args:
        out: The folder to write into; it is made.
        names: Which motions; all by default.
        stature: Of the figure [m].
        solving: Method and options.
        force: Overwrite the files of an earlier demonstration.
        progress: Told how far the work is.

    Raises:
        SixpointError: A name is unknown, or files of an earlier demonstration are in the folder.
    """
    solving = solving or Solving()
    solving.check()
    chosen = list(dict.fromkeys(names)) or list(SAMPLES)
    unknown = [name for name in chosen if name not in SAMPLES]
    if unknown:
        raise SixpointError(f"no built-in motion named {listed(unknown)}; there are: {listed(SAMPLES)}")
    figure = Figure.from_stature(stature)
    _prepare_folder(out, chosen, force)
    progress("reconstructing", 0, len(chosen))
    weighted = solving.weights is None and "weights" in find_options(find_solver(solving.method))
    clips = []
    for number, name in enumerate(chosen, start=1):
        weights = FIGHTING if name in FAST else WALKING
        own = replace(solving, weights=weights) if weighted else solving
        clips.append(_run(name, figure, out, own))
        progress("reconstructing", number, len(chosen))
    return clips


def _prepare_folder(out: Path, names: Sequence[str], force: bool) -> None:
    if out.exists() and not out.is_dir():
        raise FormatError(out, "this is a file; the demonstration needs a folder")
    present = [p for name in names for p in (out / (name + ending) for ending in ENDINGS) if p.exists()]
    if present and not force:
        raise FormatError(
            out, f"exists, with {len(present)} files of an earlier demo; use --force to overwrite them"
        )
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FormatError(out, f"the folder cannot be made: {error.strerror}") from error


def _run(name: str, figure: Figure, out: Path, solving: Solving) -> DemoClip:
    from sixpoint.study.plots import draw_comparison  # Matplotlib is slow to import

    truth = make_sample(name, figure)
    targets = replace(figure.targets(truth), rotations=None)
    solved = solve(figure, targets, solving)
    result = solved.solution.motion
    files = [out / (name + ending) for ending in ENDINGS]
    save(truth, files[0], force=True)
    save(result, files[1], force=True)
    save_targets(targets, files[2], force=True)
    draw_comparison(figure, truth, result, files[3], title=f"{name}: {solving.method}")
    return DemoClip(name, solved, compute_errors(figure, truth, result), files)
