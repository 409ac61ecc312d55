"""How fast is a warm solver? Per frame inside solve_motion and as single calls, beside forward kinematics.

Times are medians over interleaved rounds of one process on one core; the ratio to a compiled batched
forward kinematics of the same figure, timed in the same rounds, says more than the microseconds.

    python benchmarks/speed.py [--data FOLDER] [--rounds 30]
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numba
import numpy as np

import sixpoint as sp
from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
CLIPS = (("17_10.amc", 0), ("90_05_repaired.bvh", 1), ("01_03.amc", 0))
START = """
import time
t = time.perf_counter()
import sixpoint as sp
sp.SequentialIK(sp.Figure.from_stature(1.75)).warm_up()
print(time.perf_counter() - t)
"""


@entry
def forward_kinematics(parents, offsets, rotations, roots, positions, world):
    """World positions (F, J, 3) and rotations (F, J, 4) of F frames."""
    for f in range(rotations.shape[0]):
        qt.store(world[f], 0, qt.load(rotations[f], 0))
        vec.store(positions[f], 0, vec.load(roots, f))
        for j in range(1, parents.shape[0]):
            p = parents[j]
            q = qt.load(world[f], p)
            vec.store(
                positions[f], j, vec.add(vec.load(positions[f], p), qt.mul_vec(q, vec.load(offsets, j)))
            )
            qt.store(world[f], j, qt.mul(q, qt.load(rotations[f], j)))


def load_clips(folder: Path) -> list[sp.Motion]:
    """The paper's clips, or the built-in motions where the recordings are absent."""
    paths = [folder / "paper" / name for name, _ in CLIPS]
    if all(path.exists() for path in paths):
        return [sp.load(p).sliced(slice(skip, None)) for p, (_, skip) in zip(paths, CLIPS, strict=True)]
    print(f"no recordings in {folder}: timing the built-in motions", file=sys.stderr)
    return [sp.make_sample(name) for name in ("boxing", "jump_kick", "climb_and_hang")]


def seconds(function) -> float:
    """Time of one call [s]."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def measure(motion: sp.Motion, limits: bool, rounds: int) -> dict[str, float]:
    """Medians over interleaved rounds [us per frame], and the p99 of single calls."""
    figure = sp.Figure.from_motion(motion)
    targets = figure.targets(motion)
    solver = sp.SequentialIK(figure, limits=limits)
    result = solver.solve_motion(targets)
    joints = len(figure.skeleton)
    arrays = (
        np.array(figure.skeleton.parents),
        np.array(figure.skeleton.offsets),
        np.array(result.rotations),
        np.array(result.translations[:, 0]),
        np.empty((len(motion), joints, 3)),
        np.empty((len(motion), joints, 4)),
    )
    forward_kinematics(*arrays)
    batch, fk, single = [], [], []
    solution = None
    for number in range(rounds):
        batch.append(seconds(lambda: solver.solve_motion(targets)) / len(motion))
        fk.append(seconds(lambda: forward_kinematics(*arrays)) / len(motion))
        for frame in range(100):
            points = targets.positions[(100 * number + frame) % len(motion)]
            start = time.perf_counter()
            solution = solver.solve(points, previous=solution, dt=1 / motion.rate)
            single.append(time.perf_counter() - start)
    return {
        "batch": 1e6 * float(np.median(batch)),
        "batch_p99": 1e6 * float(np.percentile(batch, 99)),
        "fk": 1e6 * float(np.median(fk)),
        "ratio": float(np.median(np.array(batch) / np.array(fk))),
        "single": 1e6 * float(np.median(single)),
        "single_p99": 1e6 * float(np.percentile(single, 99)),
    }


def start_up(cold: bool) -> float:
    """Seconds from a fresh interpreter's first line to the first pose."""
    with tempfile.TemporaryDirectory() as folder:
        env = {"NUMBA_CACHE_DIR": folder} if cold else {}
        run = subprocess.run(
            [sys.executable, "-c", START], env=os.environ | env, capture_output=True, text=True, check=True
        )
    return float(run.stdout)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--rounds", type=int, default=30)
    options = parser.parse_args()
    clips = load_clips(options.data)
    print(
        f"{platform.machine()}, Python {platform.python_version()}, "
        f"NumPy {np.__version__}, Numba {numba.__version__}"
    )
    print("times in us per frame: median (p99); FK is a compiled batched forward kinematics of the same rig")
    header = f"{'clip':<20}{'limits':>7}{'solve_motion':>18}{'FK':>7}{'ratio':>7}{'single solve':>18}"
    print(header)
    for limits in (False, True):
        rows = []
        for motion in clips:
            row = measure(motion, limits, options.rounds)
            rows.append(row)
            print(
                f"{motion.name:<20}{'on' if limits else 'off':>7}"
                f"{row['batch']:>10.2f} ({row['batch_p99']:5.2f})"
                f"{row['fk']:>7.2f}{row['ratio']:>7.2f}{row['single']:>10.2f} ({row['single_p99']:5.2f})"
            )
        middle = {key: float(np.median([row[key] for row in rows])) for key in rows[0]}
        print(
            f"{'median of clips':<20}{'on' if limits else 'off':>7}{middle['batch']:>10.2f}{'':8}"
            f"{middle['fk']:>7.2f}{middle['ratio']:>7.2f}{middle['single']:>10.2f}"
        )
    print(
        f"first pose of a new process: {start_up(False):.2f} s warm, {start_up(True):.1f} s with compilation"
    )


if __name__ == "__main__":
    main()
