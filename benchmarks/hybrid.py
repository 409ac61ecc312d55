"""How far do feet that stand drift, and what does holding them cost? SIK+ beside the hybrid, on three walks.

Contacts are those of the true ankles; the drift is horizontal, from where each contact began, over all frames
of contact. Times are the best of the rounds, whole clips.

    python benchmarks/hybrid.py [--data FOLDER] [--no-limits] [--rounds 5]
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

import sixpoint as sp
from sixpoint.study.quality import compute_contact_drift

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
WALKS = ("02_01", "16_01", "09_12")


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


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--no-limits", action="store_true")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    print("| walk | method | drift: mean [mm] | p95 | largest | position error | iterations | us a frame |")
    print("|---|---|---|---|---|---|---|---|")
    for walk in WALKS:
        truth = sp.load(options.data / "cmu" / f"{walk}.amc")
        figure = sp.Figure.from_motion(truth)
        targets = figure.targets(truth)
        for name in ("sik+", "hybrid"):
            solver = sp.make_solver(name, figure, limits=not options.no_limits)
            took = 1e6 * seconds_a_frame(solver, targets, options.rounds)
            result = solver.solve_motion(targets)
            drift = 1e3 * compute_contact_drift(figure, truth, result)
            error = sp.compute_errors(figure, truth, result).position
            numbers = f"{drift.mean():.1f} | {np.percentile(drift, 95):.1f} | {drift.max():.1f} | {error:.5f}"
            print(f"| {walk} | {name} | {numbers} | {most_iterations(solver, targets)} | {took:.0f} |")


if __name__ == "__main__":
    main()
