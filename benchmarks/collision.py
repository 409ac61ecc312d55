"""Elbows in the trunk, thighs in each other, arms in thighs: with and without avoidance, by trimesh.

Nothing of the solver's own description of the trunk is used here: a vertex near an elbow is in the trunk if
a ray from it crosses the trunk's closed mesh an odd number of times, and as deep as the nearest point of it
is far.

    python benchmarks/collision.py [--write docs/collision.md] [--only PART ...] [--frames 1000] [--data D]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from collision_meter import Meter
from marked import rewrite
from numpy.typing import NDArray
from reaches import reach_across, wander_around
from seats import KINDS, POSTURES, move_legs, rest_hands

import sixpoint as sp
from sixpoint.body.surface.flesh import build_shape

Array = NDArray[np.float64]

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
METHODS = ("sik", "sik+", "sik-prior")
DEEP = 0.005  # m, a penetration that counts
SEEDS = (1, 2, 3, 4, 5, 6)
PARTS = ("reaches", "wandering", "boxing", "recordings", "forearms", "thighs", "arms")
RECORDINGS = (  # development test sets; nobody's motion was fitted on them
    "cmu/14_02.amc",
    "cmu/14_24.amc",
    "cmu/14_29.amc",
    "xsens/example_2.bvh",
    "bandai/dataset-1_bow_normal_001.bvh",
    "bandai/dataset-1_punch_normal_001.bvh",
    "bandai/dataset-2_walk_normal_001.bvh",
)
BOXING = "paper/17_10.amc"  # tests only


@dataclass(frozen=True)
class Row:
    """What avoidance does to one method on some targets.

    Attributes:
        points: What the targets are.
        method: Its name.
        frames: How many.
        deep: Frames with an elbow more than 5 mm in the trunk, without and with.
        worst: Largest depth without and with [m].
        bound: Elbows more than 5 mm deep with avoidance, and those of them that no swivel angle within the
            limits gets out of the mesh while the wrist stays.
        met: Arms on their targets, to 1 mm, without.
        kept: Share of those that still are.
        lost: Of arms that missed by more already and are moved: how many, by how much more they miss then,
            median and 95th percentile [m].
        cost: Time with over time without.
        micro: Time per frame without [us].
        still: Frames in which both arms are posed as without.
    """

    points: str
    method: str
    frames: int
    deep: tuple[int, int]
    worst: tuple[float, float]
    bound: tuple[int, int]
    met: int
    kept: float
    lost: tuple[int, float, float]
    cost: float
    micro: float
    still: int


def time_pair(plain: sp.Solver, clear: sp.Solver, targets: Sequence[sp.Targets]) -> tuple[float, float]:
    """Seconds per frame of both, medians of interleaved rounds."""
    times: list[list[float]] = [[], []]
    for _ in range(31):
        for k, solver in enumerate((plain, clear)):
            start = time.thread_time()
            for part in targets:
                solver.solve_frames(part)
            times[k].append(time.thread_time() - start)
    frames = sum(len(part) for part in targets)
    return float(np.median(times[0])) / frames, float(np.median(times[1])) / frames


def compare(figure: sp.Figure, method: str, targets: Sequence[sp.Targets], meter: Meter, points: str) -> Row:
    """One method with and without avoidance."""
    solvers = [sp.make_solver(method, figure, **more) for more in ({}, {"avoid": "elbows"})]
    found = [[solver.solve_frames(part) for part in targets] for solver in solvers]
    plain_depths = [meter.measure(s.motion) for s in found[0]]
    known = [(s.motion, depth) for s, depth in zip(found[0], plain_depths, strict=True)]
    clear_depths = [meter.measure(s.motion, k) for s, k in zip(found[1], known, strict=True)]
    depths = [np.concatenate(plain_depths), np.concatenate(clear_depths)]
    misses = [np.concatenate([s.residual[:, 2:4] for s in of]) for of in found]
    turned = [np.concatenate([s.motion.rotations for s in of]) for of in found]
    met = misses[0] < 1e-3
    elbows = list(figure.roles.elbow)
    places = [np.concatenate([s.motion.positions[:, elbows] for s in of]) for of in found]
    more = (misses[1] - misses[0])[~met & (np.abs(places[1] - places[0]).max(axis=-1) > 1e-6)]
    lost = (len(more), *(np.quantile(more, [0.5, 0.95]) if len(more) else (0.0, 0.0)))
    left = np.argwhere(depths[1] > DEEP)
    whole = sp.Motion.from_poses([s.motion.pose(f) for s in found[1] for f in range(len(s.motion))], 60.0)
    plain, clear = time_pair(*solvers, targets)
    return Row(
        points,
        method,
        len(depths[0]),
        tuple(int((d.max(axis=1) > DEEP).sum()) for d in depths),
        tuple(float(d.max()) for d in depths),
        (len(left), sum(meter.find_way_out(whole, int(f), int(side)) > DEEP for f, side in left)),
        int(met.sum()),
        float((misses[1][met] < 1e-3).mean()) if met.any() else 1.0,
        lost,
        clear / plain,
        1e6 * plain,
        int((turned[0] == turned[1]).all(axis=(1, 2)).sum()),
    )


def table(rows: Sequence[Row]) -> str:
    """Rows as Markdown."""
    lines = [
        "| points | method | frames | elbow deeper than 5 mm | with avoidance | fewer by "
        "| left, bound by limits | deepest | with avoidance | on target without, still within 1 mm "
        "| arms off target that move: miss grows, median (95 %) | unchanged frames | time |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        fewer = f"{100 * (1 - r.deep[1] / r.deep[0]):.1f} %" if r.deep[0] else "-"
        lines.append(
            f"| {r.points} | `{r.method}` | {r.frames} | {r.deep[0]} | {r.deep[1]} | {fewer} "
            f"| {r.bound[0]}, {r.bound[1]} | {1e3 * r.worst[0]:.0f} mm "
            f"| {1e3 * r.worst[1]:.0f} mm | {100 * r.kept:.2f} % of {r.met} "
            f"| {r.lost[0]}: {1e3 * r.lost[1]:+.0f} mm ({1e3 * r.lost[2]:+.0f} mm) | {r.still} "
            f"| {r.micro:.1f} us x {r.cost:.2f} |"
        )
    return "\n".join(lines)


def compare_forearms(figure: sp.Figure, method: str, targets: Sequence[sp.Targets]) -> str:
    """A row: frames with forearm or hand in trunk or head, without avoidance, with elbows, with both."""
    meters, counts, kept = (Meter(figure, "forearms"), Meter(figure)), [], []
    options = ({}, {"avoid": "elbows"}, {"avoid": ("elbows", "forearms")})
    solvers = [sp.make_solver(method, figure, **more) for more in options]
    found = [[solver.solve_frames(part) for part in targets] for solver in solvers]
    missed = [np.concatenate([s.residual[:, 2:4] for s in of]) for of in found]
    for of, miss in zip(found, missed, strict=True):
        deep = [np.concatenate([meter.measure(s.motion) for s in of]).max(axis=1) > DEEP for meter in meters]
        counts.append([int(d.sum()) for d in deep])
        kept.append(100.0 * (miss[missed[0] < 1e-3] < 1e-3).mean())
    plain, both = time_pair(solvers[0], solvers[2], targets)
    arms, elbows = zip(*counts, strict=True)
    return (
        f"| `{method}` | {len(missed[0])} | {arms[0]} | {arms[1]} | {arms[2]} | {elbows[0]} | {elbows[2]} "
        f"| {kept[2]:.2f} % | x {both / plain:.2f} |"
    )


def compare_legs(figure: sp.Figure, name: str, method: str, targets: Sequence[sp.Targets], what: str) -> str:
    """A row: frames with thighs in each other, or arms in thighs, without and with avoidance of that."""
    solvers = [sp.make_solver(method, figure, **more) for more in ({}, {"avoid": what})]
    meter, found = (
        Meter(figure, what),
        [[solver.solve_frames(part) for part in targets] for solver in solvers],
    )
    plain = [meter.measure(s.motion) for s in found[0]]
    known = [(s.motion, depth) for s, depth in zip(found[0], plain, strict=True)]
    clear = [meter.measure(s.motion, k) for s, k in zip(found[1], known, strict=True)]
    without, with_ = (np.concatenate(depths).max(axis=1) for depths in (plain, clear))
    ends, middles = (
        (slice(4, 6), figure.roles.knee) if what == "thighs" else (slice(2, 4), figure.roles.elbow)
    )
    misses = [np.concatenate([s.residual[:, ends] for s in of]) for of in found]
    met = misses[0] < 1e-3
    steps = [
        max(np.linalg.norm(np.diff(s.motion.positions[:, [*middles]], axis=0), axis=-1).max() for s in of)
        for of in found
    ]
    left = [(k, f, side) for k, d in enumerate(clear) for f, side in np.argwhere(d > DEEP)]
    bound = "-"
    if what == "arms":
        bound = str(
            sum(meter.find_way_out(found[1][k].motion, int(f), int(side)) > DEEP for k, f, side in left)
        )
    deep = [int((d > DEEP).sum()) for d in (without, with_)]
    fewer = f"{100 * (1 - deep[1] / deep[0]):.1f} %" if deep[0] else "-"
    first, second = time_pair(*solvers, targets)
    return (
        f"| {name} | `{method}` | {len(without)} | {deep[0]} | {deep[1]} | {fewer} | {len(left)}, {bound} "
        f"| {1e3 * without.max():.0f} mm | {1e3 * with_.max():.0f} mm "
        f"| {100 * (misses[1][met] < 1e-3).mean():.2f} % of {met.sum()} "
        f"| {1e3 * steps[0]:.0f}, {1e3 * steps[1]:.0f} mm | {1e6 * first:.1f} us x {second / first:.2f} |"
    )


LEGS = (
    "| points | method | frames | deeper than 5 mm | with avoidance | fewer by | sides left, bound by limits "
    "| deepest | with avoidance | on target without, still within 1 mm "
    "| largest step of {middle}, without, with | time |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|"
)

FOREARMS = (
    "| method | frames | forearm or hand deeper than 5 mm | elbows avoided | forearms too "
    "| elbow deeper than 5 mm | forearms too | on target without, still within 1 mm | time |\n"
    "|---|---|---|---|---|---|---|---|---|"
)


def read(path: Path) -> tuple[sp.Figure, sp.Targets]:
    """A recording's own figure with the built-in surface, and its points."""
    motion = sp.load(path)
    figure = sp.Figure.from_motion(motion)
    return figure.with_shape(build_shape(figure)), figure.targets(motion)


def compare_recordings(paths: Sequence[Path]) -> list[Row]:
    """Rows of recordings on their own rigs; those that are not there are left out."""
    rows = []
    for path in paths:
        if path.exists():
            figure, targets = read(path)
            rows += [compare(figure, m, [targets], Meter(figure), path.stem) for m in METHODS]
    return rows


def measure_part(part: str, figure: sp.Figure, frames: int, data: Path) -> str:
    """A part of the page as Markdown."""
    if part == "forearms":
        targets = [reach_across(figure, seed, min(frames, 100)) for seed in SEEDS]
        return "\n".join([FOREARMS, *(compare_forearms(figure, m, targets) for m in METHODS)])
    if part in ("thighs", "arms"):
        make, kinds = (move_legs, KINDS) if part == "thighs" else (rest_hands, POSTURES)
        rows = [LEGS.format(middle="a knee" if part == "thighs" else "an elbow")]
        for kind in kinds:
            targets = [
                make(figure, seed, min(frames, 500 if part == "thighs" else 180), kind) for seed in SEEDS
            ]
            rows += [compare_legs(figure, kind, m, targets, part) for m in METHODS]
        return "\n".join(rows)
    if part == "recordings":
        return table(compare_recordings([data / name for name in RECORDINGS]))
    if part == "boxing":
        targets = [figure.targets(sp.make_sample("boxing", figure))]
        rows = [compare(figure, m, targets, Meter(figure), "built-in boxing") for m in METHODS]
        return table(rows + compare_recordings([data / BOXING]))
    make, most = (reach_across, frames) if part == "reaches" else (wander_around, min(frames, 600))
    targets = [make(figure, seed, most) for seed in SEEDS]
    return table([compare(figure, m, targets, Meter(figure), part) for m in METHODS])


def main() -> None:
    """Measure, print, and write into a page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", type=Path)
    parser.add_argument("--frames", type=int, default=1000, help="of each reach; wandering has at most 600")
    parser.add_argument("--only", choices=PARTS, nargs="+", default=PARTS)
    parser.add_argument("--data", type=Path, default=DATA)
    options = parser.parse_args()
    plain = sp.Figure.from_stature(1.75)
    figure = plain.with_shape(build_shape(plain))
    parts = {}
    for part in options.only:
        parts[part] = measure_part(part, figure, options.frames, options.data)
        print(f"{part}\n\n{parts[part]}\n", flush=True)
    if options.write:
        rewrite(options.write, parts)


if __name__ == "__main__":
    main()
