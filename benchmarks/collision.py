"""Elbows in the trunk, with and without avoidance, measured on the meshes by trimesh.

Nothing of the solver's own description of the trunk is used here: a vertex near an elbow is in the trunk if
a ray from it crosses the trunk's closed mesh an odd number of times, and as deep as the nearest point of it
is far.

    python benchmarks/collision.py [--write docs/collision.md] [--frames 1000] [--data FOLDER]
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
from reaches import is_within, reach_across, wander_around
from scipy.spatial.transform import Rotation

import sixpoint as sp
from sixpoint.body.flesh import build_shape

Array = NDArray[np.float64]

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
METHODS = ("sik", "sik+", "sik-prior")
NEAR = 0.07  # m, of an elbow joint: vertices of the arm that count as its elbow
DEEP = 0.005  # m, a penetration that counts
SEEDS = (1, 2, 3, 4, 5, 6)


class Meter:
    """Depth of the elbows in the trunk of a figure with a shape of named parts.

    With ``forearms``, of what is beyond the elbows, hands included, in trunk and head.
    """

    def __init__(self, figure: sp.Figure, forearms: bool = False) -> None:
        shape = figure.shape
        self.figure, self.shape = figure, shape
        self.bodies = []
        for part in ("trunk", "head") if forearms else ("trunk",):
            ids, faces = np.unique(shape.triangles[shape.parts[part]], return_inverse=True)
            self.bodies.append((ids, faces.reshape(-1, 3)))
        self.elbows = []
        positions, world = figure.neutral_pose.compute_transforms()
        vertices = shape.place(positions, world)
        for k, side in enumerate("lr"):
            elbow, wrist = positions[figure.roles.elbow[k]], positions[figure.roles.wrist[k]]
            arm = np.unique(shape.triangles[shape.parts[f"{side}_arm"]])
            if forearms:
                along = (vertices[arm] - elbow) @ (wrist - elbow) / np.linalg.norm(wrist - elbow)
                hand = np.unique(shape.triangles[shape.parts[f"{side}_hand"]])
                self.elbows.append(np.concatenate([arm[along > NEAR], hand]))
            else:
                self.elbows.append(arm[np.linalg.norm(vertices[arm] - elbow, axis=1) < NEAR])

    def place_bodies(self, vertices: Array) -> list[trimesh.Trimesh]:
        """The closed meshes in a frame."""
        return [trimesh.Trimesh(vertices[ids], faces, process=False) for ids, faces in self.bodies]

    def measure(self, motion: sp.Motion, known: tuple[sp.Motion, Array] | None = None) -> Array:
        """Depth (F, 2) of the left and the right elbow [m], 0 outside.

        Frames posed as in a ``known`` motion are as deep as there.
        """
        positions, world = motion.transforms
        out, frames = np.zeros((len(positions), 2)), np.arange(len(positions))
        if known is not None:
            out[:] = known[1]
            frames = np.flatnonzero((motion.rotations != known[0].rotations).any(axis=(1, 2)))
            out[frames] = 0.0
        for f in frames:
            vertices = self.shape.place(positions[f], world[f])
            bodies = self.place_bodies(vertices)
            for side, elbow in enumerate(self.elbows):
                out[f, side] = max(depth_in(body, vertices[elbow]) for body in bodies)
        return out

    def find_way_out(self, motion: sp.Motion, frame: int, side: int) -> float:
        """The least depth of an elbow [m] over all swivel angles within the shoulder's limits, by 5 degrees.

        The wrist stays where it is: the arm turns about the line to it.
        """
        figure, joint = self.figure, self.figure.roles.shoulder[side]
        positions, world = (array[frame] for array in motion.transforms)
        parent = int(figure.skeleton.parents[joint])
        above = Rotation.from_quat(world[parent]) * Rotation.from_quat(figure.neutral[parent]).inv()
        line = positions[figure.roles.wrist[side]] - positions[joint]
        line /= np.linalg.norm(line)
        below = figure.skeleton.subtree(joint)
        vertices = self.shape.place(positions, world)
        trunk = self.place_bodies(vertices)[0]
        least = np.inf
        for angle in np.radians(np.arange(0, 360, 5)):
            turn = Rotation.from_rotvec(angle * line)
            own = turn * Rotation.from_quat(world[joint]) * Rotation.from_quat(figure.neutral[joint]).inv()
            if not is_within(figure.dofs[joint].limit, above.inv() * own) and angle > 0.0:
                continue
            moved, turned = positions.copy(), world.copy()
            moved[below] = positions[joint] + turn.apply(positions[below] - positions[joint])
            turned[below] = (turn * Rotation.from_quat(world[below])).as_quat()
            points = self.shape.place(moved, turned)[self.elbows[side]]
            least = min(least, depth_in(trunk, points))
            if least == 0.0:
                break
        return least


def depth_in(mesh: trimesh.Trimesh, points: Array) -> float:
    """How deep the deepest of points is in a closed mesh [m]; 0 outside."""
    low, high = mesh.bounds
    points = points[((points > low) & (points < high)).all(axis=1)]
    inside = points[mesh.contains(points)] if len(points) else points
    return float(trimesh.proximity.closest_point(mesh, inside)[1].max()) if len(inside) else 0.0


@dataclass(frozen=True)
class Row:
    """What avoidance does to one method on some targets.

    Attributes:
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


def compare(figure: sp.Figure, method: str, targets: Sequence[sp.Targets], meter: Meter) -> Row:
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
        "| method | frames | elbow deeper than 5 mm | with avoidance | fewer by | left, bound by limits "
        "| deepest | with avoidance | on target without, still within 1 mm "
        "| arms off target that move: miss grows, median (95 %) | unchanged frames | time |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        fewer = f"{100 * (1 - r.deep[1] / r.deep[0]):.1f} %" if r.deep[0] else "-"
        lines.append(
            f"| `{r.method}` | {r.frames} | {r.deep[0]} | {r.deep[1]} | {fewer} "
            f"| {r.bound[0]}, {r.bound[1]} | {1e3 * r.worst[0]:.0f} mm "
            f"| {1e3 * r.worst[1]:.0f} mm | {100 * r.kept:.2f} % of {r.met} "
            f"| {r.lost[0]}: {1e3 * r.lost[1]:+.0f} mm ({1e3 * r.lost[2]:+.0f} mm) | {r.still} "
            f"| {r.micro:.1f} us x {r.cost:.2f} |"
        )
    return "\n".join(lines)


def compare_forearms(figure: sp.Figure, method: str, targets: Sequence[sp.Targets]) -> str:
    """A row: frames with forearm or hand in trunk or head, without avoidance, with elbows, with both."""
    meters, counts, kept = (Meter(figure, forearms=True), Meter(figure)), [], []
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


FOREARMS = (
    "| method | frames | forearm or hand deeper than 5 mm | elbows avoided | forearms too "
    "| elbow deeper than 5 mm | forearms too | on target without, still within 1 mm | time |\n"
    "|---|---|---|---|---|---|---|---|---|"
)


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
    parser.add_argument("--frames", type=int, default=1000, help="of each reach; wandering has 200")
    parser.add_argument("--data", type=Path, default=DATA)
    options = parser.parse_args()
    plain = sp.Figure.from_stature(1.75)
    figure = plain.with_shape(build_shape(plain))
    meter, parts = Meter(figure), {}
    for part, make, frames in (
        ("reaches", reach_across, options.frames),
        ("wandering", wander_around, min(options.frames, 200)),
    ):
        targets = [make(figure, seed, frames) for seed in SEEDS]
        parts[part] = table([compare(figure, m, targets, meter) for m in METHODS])
        print(f"{part}\n\n{parts[part]}\n", flush=True)
    targets = [reach_across(figure, seed, min(options.frames, 100)) for seed in SEEDS]
    parts["forearms"] = "\n".join([FOREARMS, *(compare_forearms(figure, m, targets) for m in METHODS)])
    print(f"forearms\n\n{parts['forearms']}\n", flush=True)
    own, boxing, name = boxing_targets(figure, options.data)
    rows = [compare(own, m, [boxing], Meter(own)) for m in METHODS]
    parts["boxing"] = f"On {name}:\n\n{table(rows)}"
    print(parts["boxing"])
    if options.write:
        rewrite(options.write, parts)


if __name__ == "__main__":
    main()
