"""The study of the prior: fit it anew from recordings, measure it, and say so on a card."""

from __future__ import annotations

import io
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.body.targets import EFFECTORS
from sixpoint.errors import SixpointError, listed
from sixpoint.formats import load
from sixpoint.formats.atomic import write_files
from sixpoint.jobs.data import fetch_cmu
from sixpoint.jobs.progress import Progress, silent
from sixpoint.jobs.writing import prepare_folder
from sixpoint.solvers.sequential.solver import SequentialIK
from sixpoint.solvers.sequential_plus.solver import Habits, SequentialIKPlus
from sixpoint.solvers.sequential_prior.solver import WITH, WITHOUT, SequentialIKPrior
from sixpoint.study.metrics import compute_errors

if TYPE_CHECKING:
    from sixpoint.study.prior.fitting import Recipe

PRIOR, CARD = "prior.npz", "prior.md"
DEVELOPMENT = ("cmu/14", "bandai", "xsens")
COLUMNS = ("people", "clips", "sik", "sik+", "sik-prior", "sik+, rotations", "sik-prior, rotations")


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording and whose it is."""

    person: str
    path: Path
    figure: Figure
    motion: Motion


@dataclass(frozen=True)
class Score:
    """Mean errors over the clips of a person.

    Attributes:
        person: Who.
        fitted: Whether the prior was fitted on that person.
        clips: Number of clips.
        errors: Position and orientation error [rad] of the columns after the second.
    """

    person: str
    fitted: bool
    clips: int
    errors: tuple[tuple[float, float], ...]

    @property
    def cells(self) -> list[str]:
        """A row of ``COLUMNS``."""
        name = f"{self.person} (fitted on)" if self.fitted else self.person
        return [name, str(self.clips), *(f"{p:.4f} / {o:.3f}" for p, o in self.errors)]


@dataclass(frozen=True, eq=False)
class PriorStudy:
    """A fitted prior.

    Attributes:
        scores: Errors of each person.
        files: What was written: the prior and its card.
    """

    scores: list[Score]
    files: list[Path]


def study_prior(
    out: Path,
    data: Path,
    *,
    people: Sequence[str] = SequentialIKPrior.fitted_on,
    steps: int = 1200,
    seed: int = 0,
    fetch: bool = False,
    force: bool = False,
    progress: Progress = silent,
) -> PriorStudy:
    """Fit the prior and write it, with its card.

    Args:
        out: The folder to write into; it is made.
        data: Folder of the recordings, ``cmu/02_01.amc`` or ``02_01.amc`` for ``cmu/02``, ``mass/*.bvh`` for
            ``mass``.
        people: Whom to fit on.
        steps: Steps of each of the two fits.
        seed: Of all that is random.
        fetch: Download the trials of the CMU database that are not there.
        force: Write into a folder that is not empty.
        progress: Told how far the work is.

    Raises:
        FormatError: The folder cannot be written into.
        SixpointError: PyTorch is not installed, or a person has no recording.
    """
    try:
        from sixpoint.study.prior.fitting import Recipe
    except ImportError as error:
        raise SixpointError(
            "fitting needs PyTorch, which is not installed: pip install 'sixpoint[fit]'"
        ) from error
    prepare_folder(out, force)
    if fetch:
        trials = [t for p in people if p.startswith("cmu/") for t in shipped_recordings().get(p, [])]
        fetch_cmu(trials, data / "cmu", progress=progress)
    paths = {person: find_recordings(data, person) for person in people}
    missing = [person for person, found in paths.items() if not found]
    if missing:
        hint = (
            "; --fetch downloads trials of the CMU database"
            if any(p.startswith("cmu/") for p in missing)
            else ""
        )
        raise SixpointError(f"{data}: no recording of {listed(missing)}{hint}")
    recordings = _load(paths, progress)
    recipes = {
        WITHOUT: Recipe(steps=steps, seed=seed),
        WITH: Recipe(turned=True, hidden=48, position=0.01, orientation=0.137, steps=steps, seed=seed),
    }
    arrays = _fit(recordings, recipes, progress)
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]
    write_files({out / PRIOR: stream.getvalue()}, force)
    tests = {person: find_recordings(data, person) for person in DEVELOPMENT if person not in people}
    scores = _measure([*recordings, *_load(tests, progress)], set(people), out / PRIOR, progress)
    write_files({out / CARD: card(recordings, recipes, scores).encode()}, force)
    return PriorStudy(scores, [out / PRIOR, out / CARD])


def shipped_recordings() -> dict[str, list[str]]:
    """The recordings that the shipped prior was fitted on, by person."""
    text = resources.files("sixpoint.study.prior").joinpath("recordings.toml").read_text("utf-8")
    return tomllib.loads(text)


def find_recordings(data: Path, person: str) -> list[Path]:
    """The recordings of a person under a folder: those of the shipped prior, or all of anybody else."""
    folder, _, number = person.partition("/")
    suffix = ".amc" if number else ".bvh"
    named = shipped_recordings().get(person)
    for place in (data / folder, data):
        found = sorted(place.glob(f"{number}_*{suffix}" if number else f"*{suffix}"))
        if named and (listed_here := [path for path in found if path.stem in named]):
            return listed_here
        if found and not named and (number or place != data):
            return found
    return []


def _load(paths: dict[str, list[Path]], progress: Progress) -> list[Recording]:
    found: list[Recording] = []
    total = sum(map(len, paths.values()))
    for person, files in paths.items():
        for path in files:
            progress("reading", len(found), total)
            beside = path.with_name(f"{path.stem.split('_')[0]}.asf")  # named, so that it need not be said
            motion = load(path, skeleton=beside if path.suffix == ".amc" else None)
            found.append(Recording(person, path, Figure.from_motion(motion), motion))
    return found


def _fit(
    recordings: list[Recording], recipes: dict[str, Recipe], progress: Progress
) -> dict[str, np.ndarray]:
    from sixpoint.study.prior.export import to_arrays
    from sixpoint.study.prior.fitting import chances_of, fit
    from sixpoint.study.prior.frames import frames_of, joined

    habits, names = Habits(), sorted({r.person for r in recordings})
    parts = [
        frames_of(r.figure, r.motion, habits, k, names.index(r.person)) for k, r in enumerate(recordings)
    ]
    frames, arrays = joined(parts), {}
    for name, recipe in recipes.items():

        def told(step: int, position: float, orientation: float, recipe: Recipe = recipe) -> None:
            kind = "with rotations" if recipe.turned else "positions alone"
            progress(f"fitting, {kind} ({position:.4f}, {orientation:.3f} rad)", step, recipe.steps)

        arrays.update(to_arrays(fit(frames, chances_of(frames), recipe, habits, told), name))
    return arrays


def _measure(recordings: list[Recording], fitted: set[str], prior: Path, progress: Progress) -> list[Score]:
    """Errors of every person, limits off."""
    errors: dict[str, list[list[tuple[float, float]]]] = {}
    for k, r in enumerate(recordings):
        progress("measuring", k, len(recordings))
        targets = r.figure.targets(r.motion)
        solvers = (
            SequentialIK(r.figure, limits=False),
            SequentialIKPlus(r.figure, limits=False),
            SequentialIKPrior(r.figure, limits=False, prior=prior),
            SequentialIKPlus(r.figure, limits=False, rotations=EFFECTORS),
            SequentialIKPrior(r.figure, limits=False, prior=prior, rotations=EFFECTORS),
        )
        row = [compute_errors(r.figure, r.motion, s.solve_motion(targets)) for s in solvers]
        errors.setdefault(r.person, []).append([(e.position, e.orientation) for e in row])
    scores = []
    for person, rows in errors.items():
        means = [(float(p), float(o)) for p, o in np.mean(rows, axis=0)]
        scores.append(Score(person, person in fitted, len(rows), tuple(means)))
    return scores


def card(recordings: list[Recording], recipes: dict[str, Recipe], scores: list[Score]) -> str:
    """The model card, in Markdown."""
    seconds: dict[str, float] = {}
    for r in recordings:
        seconds[r.person] = seconds.get(r.person, 0.0) + len(r.motion) / r.motion.rate
    people = ", ".join(f"{person} ({seconds[person]:.0f} s)" for person in seconds)
    rows = "\n".join(f"| {' | '.join(score.cells)} |" for score in scores)
    base, turned = recipes[WITHOUT], recipes[WITH]
    widths = " and ".join(f"{recipe.hidden}" for recipe in recipes.values())
    fitted = (
        f"**Fitted on** {people}, every frame at 30 Hz, in {base.steps} steps of {base.batch} frames, "
        f"seed {base.seed}: mirrored, with lengths changed by up to {base.lengths:.0%}, the root moved "
        f"against the hips by {100 * base.shift:.0f} cm and the frame of reference turned by {base.yaw} rad "
        "(standard deviations). The loss is what is reported, squared: position error over "
        f"{base.position} and orientation error over {base.orientation} rad (with rotations over "
        f"{turned.position} and {turned.orientation}), through closing and forward kinematics."
    )
    return f"""# Model card of the prior

**What it is.** Two priors, of positions alone and with the measured rotation of the pelvis (those of head,
hands and feet optional). In each a linear map and a network of two layers ({widths} wide), on the same
features and added, give the start of pelvis, spine and head; linear maps give the directions of elbows and
knees. `sik-prior` then closes the trunk on the head and the limbs on their points.

{fill(fitted, 110)}

**Errors**, limits off: position over the height and orientation [rad], RMS over frames, mean over clips. The
last two columns have exact rotations of all six points. Only people that the prior was not fitted on say what
to expect.

| {" | ".join(COLUMNS)} |
|---|{"---:|" * (len(COLUMNS) - 1)}
{rows}

**Limits.** Fitted on healthy adults who walk, run, jump, dance, climb and wave: lying, hand stands and
acrobatics are outside, where `sik+` takes over. Yaw is an inference: hands held behind the back turn it. The
rotation of the head and the split between the neck's joints are not in positions; what is predicted is usual.
"""
