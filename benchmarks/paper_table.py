"""Measure Sequential and Prioritized IK on the clips of the paper, and write the tables of docs/results.md.

python benchmarks/paper_table.py [--data FOLDER]
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from marked import rewrite

import sixpoint as sp

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"
RESULTS = ROOT / "docs" / "results.md"
MARKS = ("table", "pik", "plus")
PLUS = ("sik", "sik+", "sik-prior")

PAPER = {"boxing": (0.0265, 0.2508), "jump kick": (0.0213, 0.2849), "playground": (0.0261, 0.3469)}
PAPER_PIK = {"boxing": (0.0283, 0.3256), "jump kick": (0.0247, 0.3447), "playground": (0.0240, 0.3472)}
PAPER_MS = {"boxing": 28.56, "jump kick": 39.54, "playground": 28.40}
PIK = {"pik-flext": {}, "pik": {}, "pik-flext, from sik": {"start": "sequential"}}
CLIPS = {
    "boxing": ("17_10.amc", (1.0, 1.0, 0.0), 0),
    "jump kick": ("90_05_repaired.bvh", (1.0, 1.0, 0.0), 1),
    "playground": ("01_03.amc", (0.1, 0.1, 1.0), 0),
    "jump kick, raw BVH": ("90_05.bvh", (1.0, 1.0, 0.0), 1),
}


def measure(folder: Path, name: str, **options: object) -> tuple[float, float, float]:
    """Position error, orientation error [rad], share of frames with a point more than 1 cm off."""
    file, weights, skip = CLIPS[name]
    motion = sp.load(folder / "paper" / file).sliced(slice(skip, None))
    figure = sp.Figure.from_motion(motion)
    solver = sp.SequentialIK(figure, weights=weights, **options)
    solved = solver.solve_frames(figure.targets(motion))
    errors = sp.compute_errors(figure, motion, solved.motion)
    return errors.position, errors.orientation, solved.count(sp.Status.UNREACHABLE) / len(motion)


def table(folder: Path) -> list[str]:
    """Markdown rows."""
    lines = [
        "| clip | frames reached, limits off | limits off | limits on | paper |",
        "|---|---|---|---|---|",
    ]
    sums = np.zeros((3, 2))
    for name in CLIPS:
        free, limited = (measure(folder, name, limits=limits) for limits in (False, True))
        paper = PAPER.get(name)
        if paper:
            sums += [free[:2], limited[:2], paper]
            lines.append(row(name, free[2], free, limited, paper))
        else:
            lines.append(row("average", None, *(sums / 3)))
            lines.append(row(f"({name})", free[2], free, limited, None))
    literal = np.mean([measure(folder, name, limits=False, search="literal")[:2] for name in PAPER], axis=0)
    lines.append("")
    lines.append(
        f'With the literal steps of Algorithm 3 (`search="literal"`, limits off) the average is '
        f"{literal[0]:.4f} / {literal[1]:.4f}."
    )
    return lines


def measure_pik(folder: Path, name: str, method: str) -> tuple[float, float, float, float]:
    """Position error, orientation error [rad], worst residual [m], median time of a single solve [ms]."""
    file, _, skip = CLIPS[name]
    motion = sp.load(folder / "paper" / file).sliced(slice(skip, None))
    figure = sp.Figure.from_motion(motion)
    targets = figure.targets(motion)
    solver = sp.make_solver(method.split(",")[0], figure, **PIK[method])
    solved = solver.solve_frames(targets)
    errors = sp.compute_errors(figure, motion, solved.motion)
    times, solution = [], None
    for points in targets.positions[: min(len(targets), 1000)]:
        start = time.perf_counter()
        solution = solver.solve(points, previous=solution, dt=1 / targets.rate)
        times.append(time.perf_counter() - start)
    return errors.position, errors.orientation, solved.residual.max(), 1e3 * float(np.median(times))


def table_pik(folder: Path) -> list[str]:
    """Markdown rows of prioritized IK."""
    lines = [
        "| clip | method | errors | worst point off, mm | median ms | paper's PIK | paper's ms |",
        "|---|---|---|---|---|---|---|",
    ]
    for method in PIK:
        found = {name: measure_pik(folder, name, method) for name in PAPER}
        for name, (position, orientation, worst, spent) in found.items():
            paper = PAPER_PIK[name]
            lines.append(
                f"| {name} | {method} | {position:.4f} / {orientation:.4f} | {1e3 * worst:.1f} | {spent:.3f} "
                f"| {paper[0]:.4f} / {paper[1]:.4f} | {PAPER_MS[name]} |"
            )
        mean = np.mean(list(found.values()), axis=0)
        paper = np.mean(list(PAPER_PIK.values()), axis=0)
        lines.append(
            f"| **average** | {method} | **{mean[0]:.4f} / {mean[1]:.4f}** | | {mean[3]:.3f} "
            f"| {paper[0]:.4f} / {paper[1]:.4f} | {np.mean(list(PAPER_MS.values())):.2f} |"
        )
    return lines


def table_plus(folder: Path) -> list[str]:
    """Markdown rows of SIK+, without and with the prior, beside Sequential IK."""
    sets = {
        "boxing": [("paper/17_10.amc", (1.0, 1.0, 0.0), 0)],
        "jump kick": [("paper/90_05_repaired.bvh", (1.0, 1.0, 0.0), 1)],
        "playground": [("paper/01_03.amc", (0.1, 0.1, 1.0), 0)],
        "CMU person 14, mean of 5": [
            (f"cmu/{p.name}", None, 0) for p in sorted((folder / "cmu").glob("14_*.amc"))
        ],
        "Bandai Namco, mean of 4": [
            (f"bandai/{p.name}", None, 0) for p in sorted((folder / "bandai").glob("*.bvh"))
        ],
        "Xsens": [(f"xsens/{p.name}", None, 0) for p in sorted((folder / "xsens").glob("*.bvh"))],
    }
    names = " | ".join(f"`{method}`" for method in PLUS)
    lines = [
        f"| recordings | limits | {names} | frames missed: {names} |",
        "|---" * (2 + 2 * len(PLUS)) + "|",
    ]
    for limits in (False, True):
        means = []
        for name, clips in sets.items():
            found = np.mean([plus_row(folder, *clip, limits=limits) for clip in clips], axis=0)
            means.append(found)
            lines.append(plus_line(name, limits, found))
            if len(means) == 3:
                lines.append(plus_line("**average of the paper's**", limits, np.mean(means, axis=0)))
    return lines


def plus_row(
    folder: Path, file: str, weights: tuple[float, float, float] | None, skip: int, limits: bool
) -> list[tuple[float, float, float]]:
    """Of each method: errors, and the share of frames with a point more than 1 cm off."""
    motion = sp.load(folder / file).sliced(slice(skip, None))
    figure = sp.Figure.from_motion(motion)
    targets = figure.targets(motion)
    out = []
    for method in PLUS:
        options = {"weights": weights} if weights and method == "sik" else {}
        solved = sp.make_solver(method, figure, limits=limits, **options).solve_frames(targets)
        errors = sp.compute_errors(figure, motion, solved.motion)
        missed = solved.count(sp.Status.UNREACHABLE) / len(motion)
        out.append((errors.position, errors.orientation, missed))
    return out


def plus_line(name: str, limits: bool, found: np.ndarray) -> str:
    """One Markdown row."""
    cells = [f"{position:.4f} / {orientation:.4f}" for position, orientation, _ in found]
    cells += [f"{100 * missed:.1f} %" for *_, missed in found]
    return f"| {name} | {'on' if limits else 'off'} | {' | '.join(cells)} |"


def row(name, missed, free, limited, paper) -> str:
    """One Markdown row; None leaves a cell empty."""
    reached = "" if missed is None else f"{100 * (1 - missed):.0f} %"
    cells = ["" if e is None else f"{e[0]:.4f} / {e[1]:.4f}" for e in (free, limited, paper)]
    return f"| {name} | {reached} | {cells[0]} | {cells[1]} | {cells[2]} |"


def main() -> None:
    """Write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=DATA)
    folder = parser.parse_args().data
    parts = {}
    for mark, make in zip(MARKS, (table, table_pik, table_plus), strict=True):
        parts[mark] = "\n".join(make(folder))
        print(parts[mark], "\n")
    rewrite(RESULTS, parts)


if __name__ == "__main__":
    main()
