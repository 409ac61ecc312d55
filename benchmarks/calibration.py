"""How exactly are tracker mounts recovered? Offsets of 2 to 12 cm, any rotation, 2 mm and 1 degree of noise.

Movements: what calibration asks for (``samples/range_of_motion.py``), more or less sloppily done; the
built-in motions; and ten-second pieces of recordings, where nobody was asked to circle anything. For each
tracker: how many offsets are called observed (standard deviation up to 1 cm), the errors of these, and how
many of them are within three standard deviations. Before each table: the errors of what is handed out all
the same, known to 5 cm or better.

    python benchmarks/calibration.py [--data FOLDER] [--seeds 40]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import sixpoint as sp
from sixpoint.samples.range_of_motion import range_of_motion

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
DEVELOPMENT = ("02", "03", "05", "09", "11", "16", "29", "127")
TEST = ("14",)
SECONDS = 10.0
POSITION, ROTATION = 0.002, np.radians(1.0)  # noise per axis [m, rad]

Array = NDArray[np.float64]
Row = tuple[Array, Array, float, float]


def draw_mounts(rng: np.random.Generator) -> tuple[Array, Rotation]:
    """Offsets (6, 3) of 2 to 12 cm [m] and mount rotations, segment<-tracker, any."""
    offsets = rng.normal(size=(6, 3))
    offsets *= (rng.uniform(0.02, 0.12, 6) / np.linalg.norm(offsets, axis=1))[:, None]
    return offsets, Rotation.random(6, random_state=rng)


def wear(
    joints: sp.Targets, offsets: Array, mounts: Rotation, rng: np.random.Generator, noise: float = 1.0
) -> sp.Targets:
    """What six trackers report that are mounted so; ``noise`` scales that of each frame."""
    assert joints.rotations is not None
    points, turned = np.array(joints.positions), np.array(joints.rotations)
    for k in range(6):
        rotation = Rotation.from_quat(turned[:, k]) * mounts[k]
        points[:, k] += rotation.apply(offsets[k])
        errors = Rotation.from_rotvec(noise * rng.normal(scale=ROTATION, size=(len(points), 3)))
        turned[:, k] = (rotation * errors).as_quat()
    points += noise * rng.normal(scale=POSITION, size=points.shape)
    return sp.Targets(points, joints.rate, turned, joints.name)


def track(figure: sp.Figure, motion: sp.Motion, seed: int) -> tuple[sp.Targets, Array, Rotation]:
    """Trackers on a motion, the offsets (6, 3) [m] and the mount rotations."""
    rng = np.random.default_rng(seed + 1000)
    offsets, mounts = draw_mounts(rng)
    return wear(figure.targets(motion), offsets, mounts, rng), offsets, mounts


def measure(figure: sp.Figure, motion: sp.Motion, seed: int, known: str) -> Row | None:
    """Errors and standard deviations (6,) of the offsets [m], stature [m], seconds; None if refused."""
    targets, offsets, _ = track(figure, motion, seed)
    start = time.perf_counter()
    try:
        found = sp.calibrate(targets, figure if known == "figure" else None)
    except sp.SixpointError:
        return None
    seconds = time.perf_counter() - start
    mounts = list(found.mounts.values())
    error = np.array([np.linalg.norm(m.offset - o) for m, o in zip(mounts, offsets, strict=True)])
    return error, np.array([m.std for m in mounts]), found.stature, seconds


def report(name: str, rows: list[Row | None]) -> None:
    """Print one table."""
    done = [row for row in rows if row is not None]
    print(f"\n{name}: {len(rows)} recordings, {len(rows) - len(done)} refused (no standing pose)")
    if not done:
        return
    error, std = (100 * np.array([row[k] for row in done]) for k in (0, 1))
    print(f"stature {np.mean([r[2] for r in done]):.3f} m, {np.median([r[3] for r in done]):.2f} s each")
    vague = [e[(s > 1.0) & (s < 5.0)] for e, s in zip(error.T, std.T, strict=True)]
    told = [
        f"{n} {len(e)} (median {np.median(e):.1f} cm)"
        for n, e in zip(sp.EFFECTORS, vague, strict=True)
        if len(e)
    ]
    print("known less well:", ", ".join(told) or "none")
    print("| tracker | observed | median [cm] | p95 | max | within 1 cm | within 3 std |")
    print("|---|---|---|---|---|---|---|")
    for k, tracker in enumerate(sp.EFFECTORS):
        good = std[:, k] <= 1.0
        e, s = error[good, k], std[good, k]
        line = f"| {tracker} | {good.sum()} of {len(rows)} |"
        if len(e):
            line += f" {np.median(e):.2f} | {np.percentile(e, 95):.2f} | {e.max():.2f} |"
            line += f" {np.mean(e < 1):.0%} | {np.mean(e < 3 * s):.0%} |"
        else:
            line += " | | | | |"
        print(line)


def recordings(folder: Path, people: tuple[str, ...]) -> Iterator[tuple[sp.Figure, sp.Motion]]:
    """Ten-second pieces of the CMU recordings of some people."""
    for person in people:
        for path in sorted((folder / "cmu").glob(f"{person}_*.amc")):
            motion = sp.load(path)
            size = round(SECONDS * motion.rate)
            figure = sp.Figure.from_motion(motion)
            for start in range(0, len(motion) - size + 1, size):
                yield figure, motion.sliced(slice(start, start + size))


def people_of(folder: Path, times: int = 4) -> list[sp.Figure]:
    """Figures of the development people, whose proportions are their own, several times each."""
    takes = [sorted((folder / "cmu").glob(f"{person}_*.amc"))[:1] for person in DEVELOPMENT]
    return [sp.Figure.from_motion(sp.load(path)) for found in takes for path in found] * times


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--seeds", type=int, default=40)
    options = parser.parse_args()
    seeds = range(100, 100 + options.seeds)
    for known in ("figure", "nothing"):
        for sloppy in (0.0, 0.03, 0.05, 0.1):
            figures = [
                sp.Figure.from_stature(s) for s in np.random.default_rng(1).uniform(1.5, 1.95, len(seeds))
            ]
            rows = [
                measure(f, range_of_motion(f, seed, sloppy=sloppy), seed, known)
                for f, seed in zip(figures, seeds, strict=True)
            ]
            report(f"asked movement, sloppy {sloppy:g}, {known} known", rows)
        rows = [
            measure(f, range_of_motion(f, seed, sloppy=0.03), seed, known)
            for seed, f in enumerate(people_of(options.data))
        ]
        report(f"asked movement on the rigs of CMU people, sloppy 0.03, {known} known", rows)
        figure = sp.Figure.from_stature(1.75)
        rows = [measure(figure, sp.make_sample(n, figure), k, known) for k, n in enumerate(sp.SAMPLES)]
        report(f"built-in motions, {known} known", rows)
        for people in (DEVELOPMENT, TEST):
            pieces = list(recordings(options.data, people))
            rows = [measure(f, m, seed, known) for seed, (f, m) in enumerate(pieces)]
            report(f"CMU {' '.join(people)}, {known} known", rows)


if __name__ == "__main__":
    main()
