"""How steady SIK+ and SIK with the prior are: a table of docs/results.md.

    python benchmarks/sik_plus_table.py [--data FOLDER] [--held] [--write]

Without ``--held`` the paper's clips are measured too; ``--write`` brings the table into docs/results.md.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from marked import rewrite

import sixpoint as sp
from sixpoint.study.metrics import measured_joints
from sixpoint.study.movement import find_swivel_jumps

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"
RESULTS = ROOT / "docs" / "results.md"

PAPER = {
    "boxing": ("paper/17_10.amc", 0),
    "jump kick": ("paper/90_05_repaired.bvh", 1),
    "playground": ("paper/01_03.amc", 0),
}
WEIGHTS = {"boxing": (1.0, 1.0, 0.0), "jump kick": (1.0, 1.0, 0.0)}
METHODS = ("sik", "sik+", "sik-prior")
ROUNDS = 7


def load(folder: Path, held: bool) -> dict[str, list[tuple[sp.Figure, sp.Motion]]]:
    """Name of a set -> its recordings."""
    files = {} if held else {name: [clip] for name, clip in PAPER.items()}
    files["CMU person 14"] = [(f"cmu/{p.name}", 0) for p in sorted((folder / "cmu").glob("14_*.amc"))]
    files["Bandai Namco"] = [(f"bandai/{p.name}", 0) for p in sorted((folder / "bandai").glob("*.bvh"))]
    files["Xsens"] = [(f"xsens/{p.name}", 0) for p in sorted((folder / "xsens").glob("*.bvh"))]
    out = {}
    for name, clips in files.items():
        motions = [sp.load(folder / file).sliced(slice(skip, None)) for file, skip in clips]
        out[name] = [(sp.Figure.from_motion(motion), motion) for motion in motions]
    return out


def acceleration_error(figure: sp.Figure, truth: sp.Motion, result: sp.Motion) -> tuple[float, float]:
    """Mean, and root of the mean square, of the joints' acceleration errors [m/s^2]."""
    joints = measured_joints(figure)
    off = np.diff(result.positions[:, joints] - truth.positions[:, joints], n=2, axis=0) * truth.rate**2
    size = np.linalg.norm(off, axis=-1)
    return float(size.mean()), float(np.sqrt(np.mean(size**2)))


def table_steady(sets: dict[str, list[tuple[sp.Figure, sp.Motion]]]) -> list[str]:
    """Jumps, acceleration errors and time beside Sequential IK."""
    names = " | ".join(f"`{method}`" for method in METHODS)
    lines = [
        f"| recordings | limits | jumps: {names} | truth | acceleration error, m/s^2: {names} "
        f"| us per frame: {names} | times `{METHODS[0]}`: {' | '.join(f'`{m}`' for m in METHODS[1:])} |",
        "|---" * (2 + 4 * len(METHODS)) + "|",
    ]
    for limits in (False, True):
        for name, clips in sets.items():
            jumps, errors, times = np.zeros(len(METHODS) + 1, int), [], []
            for figure, motion in clips:
                targets = figure.targets(motion)
                solvers = make_solvers(figure, name, limits)
                results = [solver.solve_motion(targets) for solver in solvers]
                jumps += [find_swivel_jumps(figure, m).sum() for m in (*results, motion)]
                errors.append([acceleration_error(figure, motion, m) for m in results])
                times.append(time_solvers(solvers, targets))
            spent = np.mean(times, axis=0)
            cells = [name, "on" if limits else "off", *map(str, jumps)]
            cells += [f"{mean:.1f} (RMS {rms:.1f})" for mean, rms in np.mean(errors, axis=0)]
            cells += [f"{us:.2f}" for us in spent] + [f"{us / spent[0]:.2f}" for us in spent[1:]]
            lines.append(f"| {' | '.join(cells)} |")
    return lines


def make_solvers(figure: sp.Figure, name: str, limits: bool) -> tuple[sp.Solver, ...]:
    """The methods; Sequential IK with the weights that the paper has for a clip."""
    options = {"sik": {"weights": WEIGHTS[name]}} if name in WEIGHTS else {}
    return tuple(sp.make_solver(m, figure, limits=limits, **options.get(m, {})) for m in METHODS)


def time_solvers(solvers: tuple[sp.Solver, ...], targets: sp.Targets) -> list[float]:
    """Time per frame of ``solve_frames``, the least of some rounds in turn [us]."""
    spent = [np.inf] * len(solvers)
    for _ in range(ROUNDS):
        for k, solver in enumerate(solvers):
            start = time.perf_counter()
            solver.solve_frames(targets)
            spent[k] = min(spent[k], (time.perf_counter() - start) / len(targets) * 1e6)
    return spent


def main() -> None:
    """Print the table, and write it if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--held", action="store_true", help="leave the paper's clips alone")
    parser.add_argument("--write", action="store_true", help="into docs/results.md")
    options = parser.parse_args()
    table = "\n".join(table_steady(load(options.data, options.held)))
    print(table)
    if options.write:
        rewrite(RESULTS, {"steady": table})


if __name__ == "__main__":
    main()
