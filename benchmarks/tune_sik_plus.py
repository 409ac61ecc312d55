"""Choose the constants of SIK+ by a coordinate search on recordings that no reported figure uses.

    python benchmarks/tune_sik_plus.py [--data FOLDER] [--passes 3] [--rotations]

Subjects 02, 03, 05, 09, 11, 16, 29 and 127 of the CMU database at 30 Hz, at most 500 frames of each clip,
limits off. The objective is the mean over subjects of position error / 0.024 + orientation error / 0.29,
about the errors of Sequential IK. Each constant in turn is moved by steps that shrink from pass to pass. The
line of the ankles sets the unit of the pelvis' weights; the two times are not searched, since they trade
accuracy for smoothness.

With ``--rotations`` the constants that use measured rotations are chosen instead, in the mean over three
ways of tracking: the pelvis' rotation alone, pelvis and head, all six; errors then count in units of 0.01 and
0.16.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

import sixpoint as sp
from sixpoint.solvers.sequential_plus.solver import Habits, SequentialIKPlus

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
SUBJECTS = ("02", "03", "05", "09", "11", "16", "29", "127")
FRAMES = 500
STEPS = {
    "chord_share": 0.1,
    "leg_share": 0.2,
    "wrist_line": 0.4,
    "reach": 0.2,
    "speed": 0.1,
    "twist_share": 0.15,
    "bend_share": 0.25,
    "low_joint": 0.4,
    "neck_curve": 0.1,
    "elbow_out": 0.2,
    "elbow_down": 0.2,
    "elbow_back": 0.2,
    "elbow_lift": 0.3,
    "knee_out": 0.1,
}
MEASURED_STEPS = {
    "known_twist": 0.2,
    "known_bend": 0.2,
    "head_twist": 0.3,
    "head_bend": 0.3,
    "head_rise": 1.0,
    "head_hold": 0.3,
    "elbow_hand": 0.3,
    "elbow_palm": 0.3,
    "elbow_grip": 0.3,
    "elbow_tilt": 0.3,
    "knee_shank": 0.3,
    "knee_toes": 0.3,
    "knee_tilt": 0.3,
}
TRACKED = (sp.EFFECTORS[:1], sp.EFFECTORS[:2], sp.EFFECTORS)
RANGES = {"low_joint": (0.01, 10.0), "head_rise": (0.1, 10.0), "head_hold": (0.0, 1.0)}


def load_clips(folder: Path, part: int, parts: int) -> list[tuple[str, sp.Figure, sp.Motion, sp.Targets]]:
    """Every so manieth clip at 30 Hz: subject, figure, truth, targets."""
    clips = []
    paths = [p for s in SUBJECTS for p in sorted((folder / "cmu").glob(f"{s}_*.amc"))]
    for path in paths[part::parts]:
        whole = sp.load(path)
        figure = sp.Figure.from_motion(whole)
        motion = whole.sliced(slice(0, None, 4))
        motion = motion.sliced(slice(0, min(FRAMES, len(motion))))
        clips.append((path.stem.split("_")[0], figure, motion, figure.targets(motion)))
    return clips


CLIPS: list[tuple[str, sp.Figure, sp.Motion, sp.Targets]] = []


def begin(folder: Path, part: int, parts: int) -> int:
    """Load the clips of a process."""
    CLIPS[:] = load_clips(folder, part, parts)
    return len(CLIPS)


def measure(habits: Habits, tracked: tuple[tuple[str, ...], ...]) -> list[tuple[str, float, float]]:
    """Subject and errors of each clip, mean over what is tracked beside the positions."""
    out = []
    for subject, figure, truth, targets in CLIPS:
        found = []
        for rotations in tracked:
            solver = SequentialIKPlus(figure, limits=False, habits=habits, rotations=rotations)
            errors = sp.compute_errors(figure, truth, solver.solve_motion(targets))
            found.append((errors.position, errors.orientation))
        out.append((subject, *map(float, np.mean(found, axis=0))))
    return out


def main() -> None:
    """Search and print the constants."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--passes", type=int, default=3)
    parser.add_argument("--rotations", action="store_true", help="choose what uses measured rotations")
    options = parser.parse_args()
    tracked, unit, steps = ((),), (0.024, 0.29), STEPS
    if options.rotations:
        tracked, unit, steps = TRACKED, (0.01, 0.16), MEASURED_STEPS
    pools = [ProcessPoolExecutor(1) for _ in range(2)]
    loading = [pool.submit(begin, options.data, k, len(pools)) for k, pool in enumerate(pools)]
    print(f"{sum(f.result() for f in loading)} clips", flush=True)
    known: dict[tuple[float, ...], tuple[float, float, float]] = {}

    def judge(habits: Habits) -> tuple[float, float, float]:
        key = tuple(asdict(habits).values())
        if key not in known:
            jobs = [pool.submit(measure, habits, tracked) for pool in pools]
            rows = [row for job in jobs for row in job.result()]
            means = [
                np.mean([row[1:] for row in rows if row[0] == s], axis=0)
                for s in sorted({r[0] for r in rows})
            ]
            position, orientation = np.mean(means, axis=0)
            known[key] = (position / unit[0] + orientation / unit[1], position, orientation)
        return known[key]

    best = Habits()
    print("start", np.round(judge(best), 4), flush=True)
    for number in range(options.passes):
        scale = 0.5**number
        for name, step in steps.items():
            for sign in (1.0, -1.0):
                while True:
                    value = getattr(best, name) + sign * step * scale
                    least, most = RANGES.get(name, (-np.inf, np.inf))
                    if not least <= value <= most:
                        break
                    trial = replace(best, **{name: round(value, 4)})
                    if judge(trial)[0] >= judge(best)[0] - 1e-5:
                        break
                    best = trial
            print(number, name, getattr(best, name), np.round(judge(best), 4), flush=True)
    print(best)


if __name__ == "__main__":
    main()
