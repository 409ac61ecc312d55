"""The study of Sequential IK: the figures of its paper that show the method, as pictures and a report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sixpoint.body.figure import Figure
from sixpoint.formats.atomic import write_files
from sixpoint.jobs.progress import Progress, silent
from sixpoint.jobs.reconstruct import STATURE
from sixpoint.jobs.sik_study.clips import CLIPS, ClipRun, find_recording, run_clip
from sixpoint.jobs.sik_study.limb import LimbCase, LimitCase, stop_arm, swivel_arm
from sixpoint.jobs.sik_study.trunk import ClavicleCase, SpineCase, bend_spine, reach_beyond
from sixpoint.jobs.writing import prepare_folder
from sixpoint.solvers.sequential.solver import SequentialIK

REPORT = "report.md"
PICTURES = (
    "spine.png",
    "clavicle.png",
    "limb.png",
    "limits.png",
    *(c.picture for c in CLIPS),
    "hierarchy.png",
)


@dataclass(frozen=True, eq=False)
class SikStudy:
    """All measurements of the study.

    Attributes:
        figure: The built-in figure.
        spine: A trunk that stretches and bends.
        clavicle: A clavicle that helps its arm.
        limb: An arm, its angles and its swivel angle.
        limits: An arm that is stopped by its limits.
        clips: Whole clips.
        recorded: Whether the clips are the recordings of the paper.
        files: What was written.
    """

    figure: Figure
    spine: SpineCase
    clavicle: ClavicleCase
    limb: LimbCase
    limits: LimitCase
    clips: list[ClipRun]
    recorded: bool
    files: list[Path]


def study_sik(
    out: Path, *, data: Path | None = None, force: bool = False, progress: Progress = silent
) -> SikStudy:
    """Pose all cases, draw them and write the report.

    Args:
        out: The folder to write into; it is made.
        data: Folder with the recordings of the paper; built-in motions in their place by default.
        force: Write into a folder that is not empty.
        progress: Told how far the work is.

    Returns:
        The measurements, and the files: eight pictures and the report.

    Raises:
        FormatError: The folder is a file, or is not empty, or cannot be made; a recording is missing.

    Reference: Unzueta et al. 2008, Figures 2, 4 to 7 and 10 to 13.
    """
    from sixpoint.jobs.sik_study.report import report

    sources = [find_recording(data, clip) for clip in CLIPS]
    prepare_folder(out, force)
    steps = len(PICTURES) + 2

    def tell(done: int) -> None:
        progress("studying Sequential IK", done, steps)

    tell(0)
    figure = Figure.from_stature(STATURE)
    SequentialIK(figure).warm_up()
    cases = bend_spine(figure), reach_beyond(figure), swivel_arm(figure), stop_arm(figure)
    tell(1)
    _draw_cases(figure, *cases, out)
    tell(6)
    clips = []
    for clip, source in zip(CLIPS, sources, strict=True):
        clips.append(run_clip(clip, source, figure, out))
        tell(6 + len(clips))
    files = [*(out / name for name in PICTURES), out / REPORT]
    study = SikStudy(figure, *cases, clips, data is not None, files)
    write_files({out / REPORT: report(study).encode()}, force=True)
    tell(steps)
    return study


def _draw_cases(
    figure: Figure, spine: SpineCase, clavicle: ClavicleCase, limb: LimbCase, limits: LimitCase, out: Path
) -> None:
    # Matplotlib is slow to import
    from sixpoint.study.sik_figures.clavicle import draw_clavicle
    from sixpoint.study.sik_figures.hierarchy import draw_hierarchy
    from sixpoint.study.sik_figures.limb import draw_limb
    from sixpoint.study.sik_figures.limits import draw_limits
    from sixpoint.study.sik_figures.spine import draw_spine

    draw_spine(
        figure,
        spine.motion,
        spine.goals,
        [f"{name}\n{100 * chord:.1f} cm" for name, chord in zip(spine.names, spine.chords, strict=True)],
        out / "spine.png",
        "distance of pelvis and head, its share of the neutral one",
    )
    draw_clavicle(
        figure,
        clavicle.motion,
        clavicle.goal,
        (
            "the clavicle held: the stretched arm is too short",
            "the clavicle free: it turns, and the wrist is there",
            "both shoulders, close up",
        ),
        (f"{100 * clavicle.misses[0]:.1f} cm", _degrees(clavicle.angle)),
        out / "clavicle.png",
    )
    upper, fore, distance = (100 * length for length in limb.lengths)
    draw_limb(
        figure,
        limb.motion,
        limb.goal,
        (
            "the lengths of a triangle give the angles ψ and φ",
            "the swivel angle stays open: the elbow may be anywhere on the circle",
        ),
        (
            f"l₁ = {upper:.1f} cm",
            f"l₂ = {fore:.1f} cm",
            f"d = {distance:.1f} cm",
            f"ψ = {_degrees(limb.psi)}",
            f"φ = {_degrees(limb.flexion)}",
        ),
        out / "limb.png",
    )
    words = zip(("across the body", "backward"), limits.asked[:, 1], limits.kept[:, 1], strict=True)
    draw_limits(
        {"shoulder": limits.shoulder, "hip": limits.hip},
        figure,
        limits.motion,
        limits.goals,
        [f"{word}: ψ = {_degrees(asked)} asked,\n{_degrees(kept)} allowed" for word, asked, kept in words],
        out / "limits.png",
    )
    draw_hierarchy(figure, out / "hierarchy.png")


def _degrees(angle: float) -> str:
    return f"{np.degrees(angle):.1f}°"
