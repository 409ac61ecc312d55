"""Measure Sequential IK on the clips of the paper and write the table between the marks of docs/results.md.

python benchmarks/paper_table.py [--data FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import sixpoint as sp

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"
RESULTS = ROOT / "docs" / "results.md"
BEGIN, END = "<!-- table: begin -->", "<!-- table: end -->"

PAPER = {"boxing": (0.0265, 0.2508), "jump kick": (0.0213, 0.2849), "playground": (0.0261, 0.3469)}
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


def row(name, missed, free, limited, paper) -> str:
    """One Markdown row; None leaves a cell empty."""
    reached = "" if missed is None else f"{100 * (1 - missed):.0f} %"
    cells = ["" if e is None else f"{e[0]:.4f} / {e[1]:.4f}" for e in (free, limited, paper)]
    return f"| {name} | {reached} | {cells[0]} | {cells[1]} | {cells[2]} |"


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=DATA)
    lines = table(parser.parse_args().data)
    print("\n".join(lines))
    text = RESULTS.read_text("utf-8")
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    RESULTS.write_text(f"{before}{BEGIN}\n" + "\n".join(lines) + f"\n{END}{after}", "utf-8")


if __name__ == "__main__":
    main()
