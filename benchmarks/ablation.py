"""What each rule and each input of SIK+ is worth: switched off one at a time, into docs/results.md.

    python benchmarks/ablation.py [--data FOLDER]

Nothing is chosen here: the constants are the shipped ones, and what is switched off has its neutral value.
Also draws the jump kick over time, docs/kick.png. A further method is a ``Variant`` in ``VARIANTS``, and an
entry of ``kick.METHODS`` for its curve.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import kick
import numpy as np
from marked import rewrite
from rich.progress import track
from sik_plus_table import acceleration_error

import sixpoint as sp

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"
RESULTS = ROOT / "docs" / "results.md"
PICTURE = ROOT / "docs" / "kick.png"

Weights = tuple[float, float, float]
SETS: Mapping[str, Sequence[tuple[str, int, Weights]]] = {
    "the paper's three": (
        ("paper/17_10.amc", 0, sp.FIGHTING),
        ("paper/90_05_repaired.bvh", 1, sp.FIGHTING),
        ("paper/01_03.amc", 0, sp.WALKING),
    ),
    "person 14": (("cmu/14_*.amc", 0, sp.WALKING),),
    "Bandai, Xsens": (("bandai/*.bvh", 0, sp.WALKING), ("xsens/*.bvh", 0, sp.WALKING)),
}
"""Column -> recordings: files, frames to skip, weights of methods that have them."""
ACCELERATION = "acceleration error, m/s^2, all (13)"


@dataclass(frozen=True)
class Variant:
    """A row.

    Attributes:
        name: What is switched off, or which method.
        neutral: By which value, or what it is.
        method: A name of ``sp.SOLVERS``, or ``module:Class``.
        habits: Constants of SIK+ that differ from the shipped ones.
        options: Further options of the method.
        rotations: Whether it is given the rotations of all six as well, and is beside ``FULL_TURNED``.
        limits: Whether limits are on.
    """

    name: str
    neutral: str = ""
    method: str = "sik+"
    habits: Mapping[str, float] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    rotations: bool = False
    limits: bool = False

    def make(self, figure: sp.Figure, weights: Weights) -> sp.Solver:
        """Its solver."""
        options = dict(self.options)
        if self.habits:
            options["habits"] = sp.Habits(**self.habits)
        if self.method in ("sik", "tgbsik"):
            options.setdefault("weights", weights)
        if self.rotations:
            options["rotations"] = sp.EFFECTORS
        return sp.make_solver(self.method, figure, limits=self.limits, **options)


def off(name: str, text: str = "", **habits: float) -> Variant:
    """SIK+ with constants at their neutral values."""
    return Variant(name, text or ", ".join(f"`{k}` {v:g}" for k, v in habits.items()), habits=habits)


def off_turned(name: str, text: str = "", **habits: float) -> Variant:
    """The same with measured rotations."""
    return replace(off(name, text, **habits), rotations=True)


FULL = Variant("**`sik+` as shipped**")
FULL_TURNED = Variant("**`sik+` with the rotations of all six**", rotations=True)
UNBOUNDED = 1e6  # rad/s
VARIANTS: Mapping[str, Sequence[Variant]] = {
    "inputs": (
        off("wrists tell the pelvis nothing", wrist_line=0, reach=0),
        off("wrists tell pelvis and thorax nothing", wrist_line=0, reach=0, twist_share=0),
        off("ankles' line, for the yaw", ankle_line=0),
        off("legs' direction, for the tilt", "`leg_share` 0: the vertical has their share", leg_share=0),
        off("gravity", "`leg_share` 1: the legs have its share", leg_share=1),
        off("legs and gravity", "`chord_share` 1: the tilt is the direction to the head", chord_share=1),
        off("velocity of the pelvis", speed=0),
    ),
    "pelvis": (
        off("wrists' line", wrist_line=0),
        off("hands are before the chest", reach=0),
        off("trunk's direction", "`chord_share` 0: legs and vertical have its share", chord_share=0),
    ),
    "trunk": (
        off("thorax turns to the wrists", twist_share=0),
        off("begins bent", bend_share=0),
        off("lower joints turn more", "`low_joint` 1: all turn alike", low_joint=1),
        off("curve of the neck", neck_curve=0),
    ),
    "limbs": (
        off("elbows outward", elbow_out=0),
        off("elbows back", elbow_back=0),
        off("elbows outward when the hand is up", elbow_lift=0),
        off("all three: elbows straight down", elbow_out=0, elbow_back=0, elbow_lift=0),
        off("elbows down", "`elbow_down` 0: outward and back only", elbow_down=0),
        off("knees outward", "`knee_out` 0: the shipped value, nothing changes", knee_out=0),
    ),
    "steadiness": (
        off("memory of the yaw", "`memory` 0 s: each frame tells it anew", memory=0),
        off("memory of the velocity", "`speed_memory` 0 s", speed_memory=0),
        off("memory of the tilt", "`tilt_memory` 0 s", tilt_memory=0),
        off("memory of the lean to the ankles", "`lean_memory` 0 s", lean_memory=0),
        off("largest speed of the pelvis", "`turn_speed` without bound", turn_speed=UNBOUNDED),
        off("lag of elbows and knees", "`swivel_lag` 0 s", swivel_lag=0),
        off("longer lag where the pole is unclear", "`swivel_memory` 0 s", swivel_memory=0),
        off("largest speed of elbows and knees", "`swivel_speed` without bound", swivel_speed=UNBOUNDED),
        off(
            "all eight",
            "the values above",
            memory=0,
            speed_memory=0,
            tilt_memory=0,
            lean_memory=0,
            turn_speed=UNBOUNDED,
            swivel_lag=0,
            swivel_memory=0,
            swivel_speed=UNBOUNDED,
        ),
    ),
    "beside it": (
        Variant("`sik`, Sequential IK", "weights as in the paper", method="sik"),
        Variant("`tgbsik`", "the same", method="tgbsik"),
        Variant("`sik-prior`", "the fitted prior", method="sik-prior"),
        Variant("`sik+`, limits on", limits=True),
        Variant("`sik-prior`, limits on", method="sik-prior", limits=True),
    ),
    "measured rotations": (
        FULL_TURNED,
        off_turned("thorax turns to the wrists", known_twist=0),
        off_turned("begins bent", "`known_bend` 0: the shipped value, nothing changes", known_bend=0),
        off_turned("spine twists to the head", head_twist=0),
        off_turned("spine bends to the head", head_bend=0),
        off_turned("neck turns more", "`head_rise` 1: in proportion to lengths", head_rise=1),
        off_turned("closing keeps the top's turn", head_hold=0),
        off_turned("head tells the spine nothing", head_twist=0, head_bend=0, head_hold=0),
        off_turned("elbow along the hand", elbow_hand=0),
        off_turned("elbow away from the palm's front", elbow_palm=0),
        off_turned("elbow's axis is the hand's lateral one", elbow_grip=0),
        off_turned("elbow's axis against the hand's long one", elbow_tilt=0),
        off_turned("hands tell elbows nothing", elbow_hand=0, elbow_palm=0, elbow_grip=0, elbow_tilt=0),
        off_turned("knee along the shank of the foot", knee_shank=0),
        off_turned("knee where the toes point", knee_toes=0),
        off_turned("knee's axis follows the foot's", knee_tilt=0),
        off_turned("feet tell knees nothing", knee_shank=0, knee_toes=0, knee_tilt=0),
        Variant("`sik-prior` with them", "the fitted prior", method="sik-prior", rotations=True),
    ),
}
"""Group -> rows, each beside ``FULL``, or beside ``FULL_TURNED`` with rotations."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A clip that was read."""

    column: str
    figure: sp.Figure
    truth: sp.Motion
    targets: sp.Targets
    weights: Weights


def load_recordings(folder: Path) -> list[Recording]:
    """All recordings of ``SETS``; one that is missing ends the run."""
    found = []
    for column, entries in SETS.items():
        for pattern, skip, weights in entries:
            paths = sorted(folder.glob(pattern))
            if not paths:
                raise SystemExit(
                    f"{folder / pattern}: there is no such recording; say with --data where they are"
                )
            for path in paths:
                truth = sp.load(path).sliced(slice(skip, None))
                figure = sp.Figure.from_motion(truth)
                found.append(Recording(column, figure, truth, figure.targets(truth), weights))
    return found


def measure(variant: Variant, recordings: Sequence[Recording]) -> np.ndarray:
    """(columns + 1, 2) position and orientation error [rad], each the mean over the recordings of a column.

    The last row is the mean and root mean square of the acceleration error [m/s^2], the mean over all.
    """
    errors: dict[str, list[tuple[float, float]]] = {column: [] for column in (*SETS, ACCELERATION)}
    for recording in recordings:
        targets = recording.targets
        if not variant.rotations:
            targets = sp.Targets(targets.positions, targets.rate)
        result = variant.make(recording.figure, recording.weights).solve_motion(targets)
        found = sp.compute_errors(recording.figure, recording.truth, result)
        errors[recording.column].append((found.position, found.orientation))
        shaken = acceleration_error(recording.figure, recording.truth, result)
        errors[ACCELERATION].append(shaken)
    return np.array([np.mean(pairs, axis=0) for pairs in errors.values()])


def cells(found: np.ndarray, full: np.ndarray) -> list[str]:
    """Errors of each column and how much larger they are than those of the full method."""
    texts = []
    for k, (own, shipped) in enumerate(zip(found, full, strict=True)):
        digits = 4 if k < len(SETS) else 1
        text = f"{own[0]:.{digits}f} / {own[1]:.{digits}f}"
        if found is not full:
            more = [round(100 * (a / b - 1)) + 0 for a, b in zip(own, shipped, strict=True)]
            text += f" ({more[0]:+d} %, {more[1]:+d} %)"
        texts.append(text)
    return texts


def table(recordings: Sequence[Recording]) -> str:
    """Markdown: a row for each variant."""
    counts = {column: sum(r.column == column for r in recordings) for column in SETS}
    heads = [column if k == 0 else f"{column} ({counts[column]})" for k, column in enumerate(SETS)]
    lines = [
        f"| | switched off | neutral value | {' | '.join(heads)} | {ACCELERATION} |",
        f"|---|---|---|---|{'---|' * len(SETS)}",
    ]
    full, turned = measure(FULL, recordings), measure(FULL_TURNED, recordings)
    lines.append(f"| | {FULL.name} | | {' | '.join(cells(full, full))} |")
    rows = [(group, variant) for group, variants in VARIANTS.items() for variant in variants]
    before = ""
    for group, variant in track(rows, "switching off", transient=True):
        beside = turned if variant.rotations else full
        found = turned if variant is FULL_TURNED else measure(variant, recordings)
        head = "" if group == before else group
        lines.append(f"| {head} | {variant.name} | {variant.neutral} | {' | '.join(cells(found, beside))} |")
        before = group
    people = ", ".join(person.removeprefix("cmu/") for person in sp.SequentialIKPlus.fitted_on)
    lines += [
        "",
        "Position error over H / orientation error in radians, and how much larger than as shipped; limits "
        "off where nothing else is said; exact rotations, and how much larger than with all rules, where "
        "they are measured. Acceleration: mean / RMS of its error over joints and frames. Means over "
        f"recordings. `sik+` was fitted on CMU people {people}, `sik-prior` on these and `mass/`; they are "
        "in none of the columns. `sik` and `tgbsik` were fitted on nobody. Nothing was fitted again after "
        "something was switched off.",
    ]
    return "\n".join(lines)


def main() -> None:
    """Write the table, draw the kick."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=DATA)
    folder = parser.parse_args().data
    made = table(load_recordings(folder))
    print(made, "\n")
    said = kick.draw(folder / "paper" / "90_05_repaired.bvh", PICTURE)
    print(said)
    rewrite(RESULTS, {"ablation": made, "kick": said})


if __name__ == "__main__":
    main()
