"""Elbows in the trunk, with and without avoidance, measured on the meshes by trimesh.

Nothing of the solver's own description of the trunk is used here: a vertex near an elbow is in the trunk if
a ray from it crosses the trunk's closed mesh an odd number of times, and as deep as the nearest point of it
is far.

    python benchmarks/collision.py [--write docs/collision.md] [--frames 200] [--data FOLDER]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from marked import rewrite
from numpy.typing import NDArray

import sixpoint as sp
from sixpoint.body.flesh import build_shape

Array = NDArray[np.float64]

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
METHODS = ("sik", "sik+", "sik-prior")
NEAR = 0.07  # m, of an elbow joint: vertices of the arm that count as its elbow
DEEP = 0.005  # m, a penetration that counts
SEEDS = (1, 2, 3, 4, 5, 6)
RATE = 60.0


class Meter:
    """Depth of the elbows in the trunk of a figure with a shape of named parts."""

    def __init__(self, figure: sp.Figure, near: float = NEAR) -> None:
        shape = figure.shape
        self.figure, self.shape = figure, shape
        triangles = shape.triangles[shape.parts["trunk"]]
        self.trunk, self.faces = np.unique(triangles, return_inverse=True)
        self.faces = self.faces.reshape(-1, 3)
        self.elbows = []
        positions, world = figure.neutral_pose.compute_transforms()
        vertices = shape.place(positions, world)
        for side, joint in zip("lr", figure.roles.elbow, strict=True):
            arm = np.unique(shape.triangles[shape.parts[f"{side}_arm"]])
            off = np.linalg.norm(vertices[arm] - positions[joint], axis=1)
            self.elbows.append(arm[off < near])

    def measure(self, motion: sp.Motion) -> Array:
        """Depth (F, 2) of the left and the right elbow [m], 0 outside."""
        positions, world = motion.transforms
        out = np.zeros((len(positions), 2))
        for f in range(len(positions)):
            vertices = self.shape.place(positions[f], world[f])
            mesh = trimesh.Trimesh(vertices[self.trunk], self.faces, process=False)
            low, high = mesh.bounds
            for side, elbow in enumerate(self.elbows):
                points = vertices[elbow]
                points = points[((points > low) & (points < high)).all(axis=1)]
                if len(points):
                    inside = points[mesh.contains(points)]
                    if len(inside):
                        out[f, side] = trimesh.proximity.closest_point(mesh, inside)[1].max()
        return out


def smooth(t: Array) -> Array:
    """From 0 to 1 with rest at both ends."""
    return t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)


def reach_across(figure: sp.Figure, seed: int, frames: int) -> sp.Targets:
    """Hands that wander around the trunk, near its surface, from point to point; the trunk sways.

    The trunk is an elliptic cylinder here, as wide and deep as the mesh; wrists stay 4 to 14 cm out of it
    and within the arms' length of the shoulder of the neutral pose.
    """
    rng = np.random.default_rng(seed)
    rest, roles = figure.rest_positions, figure.roles
    shoulders, hips = rest[list(roles.shoulder)], rest[list(roles.hip)]
    arm = np.linalg.norm(figure.offset_between(roles.shoulder[0], roles.elbow[0]))
    arm += np.linalg.norm(figure.offset_between(roles.elbow[0], roles.wrist[0]))
    low, high = hips[:, 1].mean() + 0.05, shoulders[:, 1].mean() + 0.02
    width, depth = 0.8 * abs(shoulders[0, 0]), 0.11
    middle = 0.5 * (hips.mean(axis=0) + shoulders.mean(axis=0))

    def place(angle: Array, height: Array, gap: Array) -> Array:
        out = np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=-1)
        points = out * np.array([width, 0.0, depth]) + gap[..., None] * out
        return points + np.array([middle[0], 0.0, middle[2]]) + height[..., None] * np.array([0.0, 1.0, 0.0])

    count = int(np.ceil(frames / 30)) + 1
    t = np.arange(frames) / 30.0
    first, share = t.astype(int), smooth(t % 1.0)
    points = np.zeros((frames, 6, 3))
    for side in range(2):
        sign = 1.0 if side == 0 else -1.0
        knots = np.zeros((count, 3))
        for k in range(count):
            while True:  # from across the chest over the own side to the small of the back
                knots[k] = rng.uniform(-1.4, 2.8), rng.uniform(low, high), rng.uniform(0.04, 0.14)
                here = place(sign * knots[k, 0], knots[k, 1], knots[k, 2])
                if np.linalg.norm(here - shoulders[side]) < 0.97 * arm:
                    break
        now = knots[first] + share[:, None] * (knots[first + 1] - knots[first])
        points[:, 2 + side] = place(sign * now[:, 0], now[:, 1], now[:, 2])
    points[:, 1] = rest[roles.head] + figure.head_offset
    points[:, 0] = rest[roles.pelvis]
    lean = 0.15 * np.sin(t[:, None] * rng.uniform(0.5, 1.5, 3) + rng.uniform(0, 6, 3))
    for f in range(frames):
        turn = trimesh.transformations.euler_matrix(*lean[f])[:3, :3]
        points[f, 1:4] = points[f, 1:4] @ turn.T
    points[:, 4:] = rest[list(roles.ankle)]
    return sp.Targets(points, RATE, name=f"reaches {seed}")


@dataclass(frozen=True)
class Row:
    """What avoidance does to one method on some targets.

    Attributes:
        method: Its name.
        frames: How many.
        deep: Frames with an elbow more than 5 mm in the trunk, without and with.
        worst: Largest depth without and with [m].
        met: Arms on their targets, to 1 mm, without.
        kept: Share of those that still are.
        cost: Time with over time without.
        micro: Time per frame without [us].
        still: Frames in which both arms are posed as without.
    """

    method: str
    frames: int
    deep: tuple[int, int]
    worst: tuple[float, float]
    met: int
    kept: float
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


def compare(figure: sp.Figure, method: str, targets: Sequence[sp.Targets], meter: Meter) -> Row:
    """One method with and without avoidance."""
    solvers = [sp.make_solver(method, figure, **more) for more in ({}, {"avoid": "elbows"})]
    found = [[solver.solve_frames(part) for part in targets] for solver in solvers]
    depths = [np.concatenate([meter.measure(s.motion) for s in of]) for of in found]
    misses = [np.concatenate([s.residual[:, 2:4] for s in of]) for of in found]
    turned = [np.concatenate([s.motion.rotations for s in of]) for of in found]
    met = misses[0] < 1e-3
    plain, clear = time_pair(*solvers, targets)
    return Row(
        method,
        len(depths[0]),
        tuple(int((d.max(axis=1) > DEEP).sum()) for d in depths),
        tuple(float(d.max()) for d in depths),
        int(met.sum()),
        float((misses[1][met] < 1e-3).mean()) if met.any() else 1.0,
        clear / plain,
        1e6 * plain,
        int((turned[0] == turned[1]).all(axis=(1, 2)).sum()),
    )


def table(rows: Sequence[Row]) -> str:
    """Rows as Markdown."""
    lines = [
        "| method | frames | elbow deeper than 5 mm | with avoidance | fewer by | deepest | with avoidance "
        "| on target without, still within 1 mm | unchanged frames | time |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        fewer = f"{100 * (1 - r.deep[1] / r.deep[0]):.1f} %" if r.deep[0] else "-"
        lines.append(
            f"| `{r.method}` | {r.frames} | {r.deep[0]} | {r.deep[1]} | {fewer} | {1e3 * r.worst[0]:.0f} mm "
            f"| {1e3 * r.worst[1]:.0f} mm | {100 * r.kept:.2f} % of {r.met} | {r.still} "
            f"| {r.micro:.1f} us x {r.cost:.2f} |"
        )
    return "\n".join(lines)


def boxing_targets(figure: sp.Figure, folder: Path) -> tuple[sp.Figure, sp.Targets, str]:
    """The paper's boxing clip on its own rig, or the built-in motion where it is absent; and which it is."""
    path = folder / "paper" / "17_10.amc"
    if path.exists():
        motion = sp.load(path)
        own = sp.Figure.from_motion(motion)
        return own.with_shape(build_shape(own)), own.targets(motion), "CMU 17_10, the paper's boxing clip"
    return figure, figure.targets(sp.make_sample("boxing", figure)), "the built-in boxing motion"


def main() -> None:
    """Measure, print, and write into a page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", type=Path)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--data", type=Path, default=DATA)
    options = parser.parse_args()
    plain = sp.Figure.from_stature(1.75)
    figure = plain.with_shape(build_shape(plain))
    reaches = [reach_across(figure, seed, options.frames) for seed in SEEDS]
    meter = Meter(figure)
    parts = {"reaches": table([compare(figure, m, reaches, meter) for m in METHODS])}
    print(parts["reaches"], flush=True)
    own, boxing, name = boxing_targets(figure, options.data)
    rows = [compare(own, m, [boxing], Meter(own)) for m in METHODS]
    parts["boxing"] = f"On {name}:\n\n{table(rows)}"
    print(parts["boxing"])
    if options.write:
        rewrite(options.write, parts)


if __name__ == "__main__":
    main()
