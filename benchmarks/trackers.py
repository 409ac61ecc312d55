"""Trackers with six degrees of freedom: what rotations bring, and the whole way from mounts to a pose.

    python benchmarks/trackers.py [--data FOLDER] [--seeds 5] [--held] [--write]

The whole way: trackers sit anywhere on their segments; the person does what calibration asks for
(``samples/range_of_motion.py`` on the recording's own rig); ``calibrate`` finds the mounts; ``apply`` turns
the recording's trackers, whose noise is another, into joints; a solver poses the figure with all six
rotations. Errors are against the recording, limits off. Without ``--held`` the paper's clips are measured
too; ``--write`` brings the tables into docs/results.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from calibration import draw_mounts, wear
from marked import rewrite
from numpy.typing import NDArray
from rich.progress import track
from scipy.spatial.transform import Rotation
from sik_plus_table import DATA, PAPER, RESULTS, load

import sixpoint as sp
from sixpoint.samples.range_of_motion import range_of_motion
from sixpoint.signals.smoothing import smooth

SOLVERS: Mapping[str, type[sp.SequentialIKPlus]] = {
    "sik+": sp.SequentialIKPlus,
    "sik-prior": sp.SequentialIKPrior,
}
GIVEN: Mapping[str, Sequence[str]] = {
    "positions only": (),
    "+ pelvis": sp.EFFECTORS[:1],
    "+ pelvis, head": sp.EFFECTORS[:2],
    "+ pelvis, head, feet": (*sp.EFFECTORS[:2], *sp.EFFECTORS[4:]),
    "+ all six": sp.EFFECTORS,
}
SLOPPY, SLOPPIER = 0.03, 0.1  # how the calibration movement is done
SMOOTHING = 0.0125  # standard deviation of the bell [s]; chosen on CMU people 02 to 127
AVERAGE = "**average of the paper's**"
EXACT = "exact joints and rotations"
NOISE = "mounts known, noise"
MOUNTS = "mounts calibrated, no noise in the recording"
CHAIN = "**the whole way**: mounts calibrated, noise"
SMOOTHED = "the same, trackers smoothed"
CARELESS = f"the whole way, calibration movement done sloppily ({SLOPPIER:g})"
STAGES = (EXACT, NOISE, MOUNTS, CHAIN, SMOOTHED, CARELESS)

Array = NDArray[np.float64]
Clip = tuple[sp.Figure, sp.Motion]
Sets = Mapping[str, Sequence[Clip]]


@dataclass(frozen=True, eq=False)
class Worn:
    """Six trackers on a person.

    Attributes:
        offsets: (6, 3) from the joints in the trackers' frames [m].
        rotations: Mount rotations, segment<-tracker.
        noise: Of the frames.
    """

    offsets: Array
    rotations: Rotation
    noise: np.random.Generator

    @classmethod
    def draw(cls, *seed: int) -> Worn:
        """Offsets of 2 to 12 cm, any rotation."""
        noise = np.random.default_rng(seed)
        return cls(*draw_mounts(noise), noise)

    def report(self, joints: sp.Targets, noise: float = 1.0) -> sp.Targets:
        """What the trackers report."""
        return wear(joints, self.offsets, self.rotations, self.noise, noise)

    def calibrate(self, figure: sp.Figure, seed: int, sloppy: float = SLOPPY) -> sp.Calibration:
        """What is found after the movement that is asked for."""
        movement = range_of_motion(figure, seed, sloppy=sloppy)
        return sp.calibrate(self.report(figure.targets(movement)), figure)

    def known(self, found: sp.Calibration) -> sp.Calibration:
        """The true mounts, as a calibration."""
        pairs = zip(found.mounts, self.offsets, self.rotations.as_quat(), strict=True)
        return replace(found, mounts={name: sp.Mount(offset, turn, 0.0, 0.0) for name, offset, turn in pairs})

    def errors(self, found: sp.Calibration) -> Array:
        """(6, 3) of each tracker: of the offset [cm], of the mount's tilt and heading [degrees]."""
        out = []
        for mount, offset, turn in zip(found.mounts.values(), self.offsets, self.rotations, strict=True):
            wrong = np.degrees((Rotation.from_quat(mount.rotation) * turn.inv()).as_rotvec())
            out.append(
                (100 * np.linalg.norm(mount.offset - offset), np.hypot(wrong[0], wrong[2]), abs(wrong[1]))
            )
        return np.array(out)


def smoothed(targets: sp.Targets) -> sp.Targets:
    """Positions and rotation matrices through the same bell, so that p = joint + R offset stays true."""
    assert targets.rotations is not None
    turns = Rotation.from_quat(targets.rotations.reshape(-1, 4)).as_matrix().reshape(-1, 6, 3, 3)
    mean = smooth(turns, targets.rate, SMOOTHING).reshape(-1, 3, 3)
    rotations = Rotation.from_matrix(mean).as_quat().reshape(-1, 6, 4)
    return sp.Targets(smooth(targets.positions, targets.rate, SMOOTHING), targets.rate, rotations)


def stand_in(found: sp.Calibration) -> sp.Calibration:
    """Trackers whose offset was not found stand in for their joints."""
    mounts = {
        name: mount if np.isfinite(mount.offset).all() else replace(mount, offset=np.zeros(3))
        for name, mount in found.mounts.items()
    }
    return replace(found, mounts=mounts)


def pose(clip: Clip, targets: sp.Targets, solver: str, rotations: Sequence[str] = sp.EFFECTORS) -> Array:
    """(2,) position error over H and orientation error [rad] of a reconstruction, limits off."""
    figure, truth = clip
    result = SOLVERS[solver](figure, limits=False, rotations=rotations).solve_motion(targets)
    errors = sp.compute_errors(figure, truth, result)
    return np.array([errors.position, errors.orientation])


def stages(clip: Clip, worn: Worn, seed: int) -> tuple[dict[str, sp.Targets], sp.Calibration]:
    """What the solver gets at each stage, and what was calibrated on the way."""
    figure, truth = clip
    joints = figure.targets(truth)
    found = worn.calibrate(figure, seed)
    noisy = worn.report(joints)
    given = {
        EXACT: joints,
        NOISE: worn.known(found).apply(noisy),
        MOUNTS: found.apply(worn.report(joints, noise=0.0)),
        CHAIN: found.apply(noisy),
        SMOOTHED: found.apply(smoothed(noisy)),
        CARELESS: worn.calibrate(figure, seed, SLOPPIER).apply(noisy),
    }
    return given, found


def average(found: Mapping[str, Array]) -> Iterator[tuple[str, Array]]:
    """Columns of a table: (name, (2,) errors), the paper's average after its clips."""
    paper = [name for name in found if name in PAPER]
    yield from ((name, found[name]) for name in paper)
    if paper:
        yield AVERAGE, np.mean([found[name] for name in paper], axis=0)
    yield from ((name, errors) for name, errors in found.items() if name not in PAPER)


def tabulate(head: str, rows: Mapping[tuple[str, str], Mapping[str, Array]]) -> str:
    """Markdown of (row, solver) -> set -> (2,) errors."""
    columns = [name for name, _ in average(next(iter(rows.values())))]
    lines = [f"| {head} | solver | {' | '.join(columns)} |", "|---|---|" + "---|" * len(columns)]
    for (row, solver), found in rows.items():
        cells = [f"{errors[0]:.4f} / {errors[1]:.4f}" for _, errors in average(found)]
        lines.append(f"| {row} | `{solver}` | {' | '.join(cells)} |")
    return "\n".join(lines)


def rotations_table(sets: Sets) -> str:
    """Errors by what is given exactly beside the positions."""
    rows = {}
    for row, rotations in GIVEN.items():
        for solver in SOLVERS:
            rows[row, solver] = {
                name: np.mean([pose(clip, clip[0].targets(clip[1]), solver, rotations) for clip in clips], 0)
                for name, clips in sets.items()
            }
    return tabulate("exact rotations", rows)


def chain_tables(sets: Sets, seeds: int) -> str:
    """Errors at each stage, what calibration was off by, and what it did not find."""
    rows: dict[tuple[str, str], dict[str, Array]] = {(s, v): {} for s in STAGES for v in SOLVERS}
    spread: dict[str, dict[str, Array]] = {solver: {} for solver in SOLVERS}
    calibrated, notes = {}, []
    for name, clips in track(list(sets.items()), "wearing trackers", transient=True):
        errors: dict[tuple[str, str], list[Array]] = {key: [] for key in rows}
        mounts, instead = [], []
        lost = {CHAIN: np.zeros(6, int), CARELESS: np.zeros(6, int)}
        for seed in range(seeds):
            for number, clip in enumerate(clips):
                worn = Worn.draw(seed, number)
                given, found = stages(clip, worn, seed)
                mounts.append(worn.errors(found))
                for key in rows:
                    errors[key].append(pose(clip, given[key[0]], key[1]))
                for stage, count in lost.items():
                    count += ~given[stage].tracked.any(axis=0)
                if not given[CHAIN].tracked.any(axis=0).all():
                    again = stand_in(found).apply(worn.report(clip[0].targets(clip[1])))
                    instead.append([pose(clip, again, solver) for solver in SOLVERS])
        for key, values in errors.items():
            rows[key][name] = np.mean(values, axis=0)
        for solver in SOLVERS:
            each = np.reshape(errors[CHAIN, solver], (seeds, len(clips), 2))
            spread[solver][name] = each.mean(axis=1)
        calibrated[name] = np.array(mounts)
        notes += [
            f"- {name}, {stage.strip('*').split('**')[0]}: {effector}, {count} of {len(mounts)}"
            for stage, counts in lost.items()
            for effector, count in zip(sp.EFFECTORS, counts, strict=True)
            if count
        ]
        if instead:
            both = zip(SOLVERS, np.mean(instead, axis=0), strict=True)
            said = ", ".join(f"`{solver}` {e[0]:.4f} / {e[1]:.4f}" for solver, e in both)
            notes.append(f"- {name}, there with the tracker standing in for the joint: {said}")
    head = "Offsets that were not found; `apply` calls the point lost then, and its rotation alone is used:"
    said = "\n".join([head, "", *notes]) if notes else "Every offset was found in every calibration."
    parts = [tabulate("what the solver gets", rows), *worst_of(spread), said, mounts_table(calibrated)]
    return "\n\n".join(parts)


def worst_of(spread: Mapping[str, Mapping[str, Array]]) -> Iterator[str]:
    """A sentence on the seeds: the largest of the paper's averages, (seeds, 2) for each set."""
    said = []
    for solver, found in spread.items():
        paper = [each for name, each in found.items() if name in PAPER]
        if paper:
            worst = np.mean(paper, axis=0).max(axis=0)
            said.append(f"`{solver}` {worst[0]:.4f} / {worst[1]:.4f}")
    if said:
        yield f"The whole way, largest average of the paper's among the seeds: {', '.join(said)}."


def mounts_table(calibrated: Mapping[str, Array]) -> str:
    """Markdown of set -> (calibrations, 6, 3) errors of the mounts."""
    lines = [
        f"| offset errors, cm: median, largest | {' | '.join(sp.EFFECTORS)} "
        "| mount rotations, degrees: tilt, heading |",
        "|---|" + "---|" * 7,
    ]
    for name, errors in calibrated.items():
        cells = []
        for of in errors[:, :, 0].T:
            known = of[np.isfinite(of)]
            cells.append(f"{np.median(known):.2f}, {known.max():.2f}" if len(known) else "not found")
        tilt, heading = np.nanmean(errors[:, :, 1:], axis=(0, 1))
        lines.append(f"| {name} | {' | '.join(cells)} | {tilt:.2f}, {heading:.2f} |")
    return "\n".join(lines)


def main() -> None:
    """Print the tables, and write them if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--held", action="store_true", help="leave the paper's clips alone")
    parser.add_argument("--write", action="store_true", help="into docs/results.md")
    options = parser.parse_args()
    sets = load(options.data, options.held)
    parts = {"rotations": rotations_table(sets), "trackers": chain_tables(sets, options.seeds)}
    print("\n\n".join(parts.values()))
    if options.write:
        rewrite(RESULTS, parts)


if __name__ == "__main__":
    main()
