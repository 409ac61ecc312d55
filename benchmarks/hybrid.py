"""How far do feet that stand drift, and what does holding them cost? SIK+ beside the hybrid, on three walks.

Contacts are those of the true ankles; the drift is horizontal, from where each contact began, over all frames
of contact. Times are the best of the rounds, whole clips.

    python benchmarks/hybrid.py [--data FOLDER] [--no-limits] [--rounds 5] [--more]

``--more`` takes at most 2500 frames each of 25 clips of walks, jumps, dances and chores instead; the last
rows are means.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import sixpoint as sp
from sixpoint.study.quality import compute_contact_drift

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
WALKS = ("02_01", "16_01", "09_12")
MORE = (
    *("02_01", "02_05", "03_01", "05_02", "05_10", "05_18", "09_12", "11_01", "14_02", "14_06", "14_24"),
    *("16_01", "16_05", "16_11", "16_15", "16_21", "16_31", "16_35", "16_47", "16_58", "29_01"),
    *("127_01", "127_05", "127_16", "127_31"),
)


def seconds_a_frame(solver: sp.Solver, targets: sp.Targets, rounds: int) -> float:
    """Best time of a whole clip, per frame [s]."""
    solver.warm_up()
    solver.solve_motion(targets)
    best = np.inf
    for _ in range(rounds):
        start = time.perf_counter()
        solver.solve_motion(targets)
        best = min(best, time.perf_counter() - start)
    return best / len(targets)


def most_iterations(solver: sp.Solver, targets: sp.Targets) -> int:
    """Most iterations of a frame, one after the other as in live use."""
    most, solution = 0, None
    for points in targets.positions:
        solution = solver.solve(points, previous=solution, dt=1.0 / targets.rate)
        most = max(most, solution.iterations)
    return most


def describe(walk: str, name: str, row: Sequence[float]) -> str:
    """A row of the table."""
    mean, high, largest, error, most, took = row
    drift = f"{mean:.1f} | {high:.1f} | {largest:.1f}"
    return f"| {walk} | {name} | {drift} | {error:.5f} | {most:.0f} | {took:.0f} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--no-limits", action="store_true")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--more", action="store_true")
    options = parser.parse_args()
    rows: dict[str, list[tuple[float, ...]]] = {"sik+": [], "hybrid": []}
    print("| walk | method | drift: mean [mm] | p95 | largest | position error | iterations | us a frame |")
    print("|---|---|---|---|---|---|---|---|")
    for walk in MORE if options.more else WALKS:
        truth = sp.load(options.data / "cmu" / f"{walk}.amc")
        truth = truth.sliced(slice(0, min(len(truth), 2500)))
        figure = sp.Figure.from_motion(truth)
        targets = figure.targets(truth)
        for name in ("sik+", "hybrid"):
            solver = sp.make_solver(name, figure, limits=not options.no_limits)
            took = 1e6 * seconds_a_frame(solver, targets, options.rounds)
            result = solver.solve_motion(targets)
            drift = 1e3 * compute_contact_drift(figure, truth, result)
            error = sp.compute_errors(figure, truth, result).position
            most = most_iterations(solver, targets)
            rows[name].append((drift.mean(), np.percentile(drift, 95), drift.max(), error, most, took))
            print(describe(walk, name, rows[name][-1]))
    for name, found in rows.items():
        print(describe("mean", name, [*np.mean(found, axis=0)]))
    grown = np.divide(*(np.array([row[3] for row in rows[name]]) for name in ("hybrid", "sik+"))) - 1.0
    print(f"\nThe position error grows by {100 * grown.mean():.1f} % on average.")


if __name__ == "__main__":
    main()
