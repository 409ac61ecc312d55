"""Whole clips for the study of Sequential IK: recordings of the paper, or built-in motions of their kind.

Reference: Unzueta et al. 2008, section 9 and Figures 10 to 12.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from sixpoint.body.figure import Figure
from sixpoint.body.targets import EFFECTORS
from sixpoint.errors import FormatError
from sixpoint.formats import load
from sixpoint.samples import make_sample
from sixpoint.solvers.base import Status
from sixpoint.solvers.sequential.solver import SequentialIK
from sixpoint.solvers.six_points.solver import FIGHTING, WALKING
from sixpoint.study.metrics import Errors, compute_errors

DRAWN = 5
"""Samples of each clip."""
MET = 0.01
"""A point nearer to its target than this is met [m], as ``Status`` has it."""


@dataclass(frozen=True)
class Clip:
    """A motion of the paper, and the built-in one of its kind.

    Attributes:
        picture: File name of its picture.
        title: Of the picture and in the report.
        sample: Name of the built-in motion.
        weights: Of the pelvis estimate, as in the paper.
        trial: Of the CMU database.
        files: Where the recording may be in a folder: path, and rows to drop at its beginning.
        paper: Position error and orientation error [rad] of Table 1.
    """

    picture: str
    title: str
    sample: str
    weights: tuple[float, float, float]
    trial: str
    files: tuple[tuple[str, int], ...]
    paper: tuple[float, float]


CLIPS = (
    Clip(
        "boxing.png",
        "Boxing",
        "boxing",
        FIGHTING,
        "17_10",
        (("paper/17_10.amc", 0), ("17_10.amc", 0)),
        (0.0265, 0.2508),
    ),
    Clip(
        "jump_kick.png",
        "Jump kick",
        "jump_kick",
        FIGHTING,
        "90_05",
        (("90_05.amc", 0), ("paper/90_05_repaired.bvh", 1)),  # row 0 of the BVH is an added T-pose
        (0.0213, 0.2849),
    ),
    Clip(
        "playground.png",
        "Playground",
        "climb_and_hang",
        WALKING,
        "01_03",
        (("paper/01_03.amc", 0), ("01_03.amc", 0)),
        (0.0261, 0.3469),
    ),
)


@dataclass(frozen=True, eq=False)
class ClipRun:
    """One clip, reconstructed from its six points.

    Attributes:
        clip: Which.
        source: Name of the built-in motion or of the file.
        frames: Number of frames.
        rate: Of the clip [Hz].
        errors: Against the original.
        reached: Frames in which all six points are met within 1 cm.
        reached_free: The same without joint limits.
        missed: The point that is most often missed; None if none ever is.
        missed_frames: Frames in which it is.
        missed_most: Its largest distance from its target [m].
        shown: Frames that are drawn.
        distances: Mean distance of the joints in these [m].
    """

    clip: Clip
    source: str
    frames: int
    rate: float
    errors: Errors
    reached: int
    reached_free: int
    missed: str | None
    missed_frames: int
    missed_most: float
    shown: tuple[int, ...]
    distances: tuple[float, ...]


def find_recording(data: Path | None, clip: Clip) -> tuple[Path, int] | None:
    """The recording of a clip, and rows to drop at its beginning; None for the built-in motion.

    Args:
        data: The folder of recordings, if any.
        clip: Which.

    Raises:
        FormatError: It is not in the folder; the message says where it can be had.
    """
    if data is None:
        return None
    for name, skip in clip.files:
        if (data / name).is_file():
            return data / name, skip
    others = " or ".join(name for name, _ in clip.files[1:])
    raise FormatError(
        data / clip.files[0][0],
        f"is missing, and so is {others}; it is trial {clip.trial} of the CMU Graphics Lab Motion Capture "
        f"Database, free at mocap.cs.cmu.edu: `sixpoint data cmu {clip.trial}` fetches it; without --data "
        "the study takes built-in motions",
    )


def run_clip(clip: Clip, source: tuple[Path, int] | None, figure: Figure, out: Path) -> ClipRun:
    """Reconstruct a clip from its six points and draw samples.

    Args:
        clip: Which.
        source: What ``find_recording`` says.
        figure: Whom a built-in motion moves.
        out: The folder of the picture.
    """
    # Matplotlib is slow to import
    from sixpoint.study.plots import compute_distances
    from sixpoint.study.sik_figures.samples import choose_samples, draw_samples

    truth = make_sample(clip.sample, figure)
    if source is not None:
        path, skip = source
        truth = load(path).sliced(slice(skip, None))
        figure = Figure.from_motion(truth)
    targets = replace(figure.targets(truth), rotations=None)
    solved = SequentialIK(figure, weights=clip.weights).solve_frames(targets)
    free = SequentialIK(figure, weights=clip.weights, limits=False).solve_frames(targets)
    often = (solved.residual > MET).sum(axis=0)
    point = int(often.argmax())
    errors = compute_errors(figure, truth, solved.motion)
    shown = choose_samples(figure, truth, DRAWN)
    draw_samples(
        figure,
        truth,
        solved.motion,
        shown,
        out / clip.picture,
        f"{clip.title}, from six points",
        _note(errors),
    )
    return ClipRun(
        clip=clip,
        source=clip.sample if source is None else source[0].name,
        frames=len(truth),
        rate=truth.rate,
        errors=errors,
        reached=solved.count(Status.CONVERGED),
        reached_free=free.count(Status.CONVERGED),
        missed=EFFECTORS[point] if often[point] else None,
        missed_frames=int(often[point]),
        missed_most=float(solved.residual[:, point].max()),
        shown=tuple(shown),
        distances=tuple(compute_distances(figure, truth, solved.motion)[shown]),
    )


def _note(errors: Errors) -> str:
    return f"left of each pair: the reconstruction; position error {errors.position:.4f} H"
