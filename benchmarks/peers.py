"""Six position targets on a hinge human: prioritized IK beside mink, in one run, on one core.

Both start from the true pose of frame 0 and go on from their own last pose, at most 20 iterations a frame.
The clock covers setting the targets, solving and the residual. Poses are measured by forward kinematics that
belong to neither. Each frame's time is the best of the rounds, in which the two take turns.

    python benchmarks/peers.py [--human FILE.py] [--seeds 1 2 3] [--json FILE] [--docs]

mink comes with `pip install -e '.[bench]'`; without it only our own rows are made.
"""

from __future__ import annotations

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import argparse
import importlib.util
import json
import platform
import sys
import time
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np
from hinge_human import Array, Problem, Truth, build_own, load_outside
from marked import rewrite
from scipy.spatial.transform import Rotation

import sixpoint as sp

TOLERANCE, ITERATIONS, RATE, WARM = 0.01, 20, 60.0, 20
DAMPING = 1e-3  # of mink's quadratic program, as least squares solvers of this size commonly take
RESULTS = Path(__file__).resolve().parents[1] / "docs" / "results.md"
State = tuple[Array, Array, Array]


class Ours:
    """Strict levels (pelvis, ankles, wrists, head), then the middle of every range."""

    def __init__(self, problem: Problem, flext: bool) -> None:
        pelvis, head, *limbs = (problem.names[k] for k in problem.targets)
        wrists, ankles = limbs[:2], limbs[2:]
        if flext:
            tasks = [sp.PositionTask(pelvis, level=0), sp.PositionTask(head, level=7)]
            tasks += [sp.FlextTask(at, level=4, drag=True) for at in wrists]
            tasks += [sp.FlextTask(at, level=1, drag=True) for at in ankles]
        else:
            tasks = [sp.PositionTask(pelvis, level=0), sp.PositionTask(head, level=3)]
            tasks += [sp.PositionTask(at, level=2) for at in wrists]
            tasks += [sp.PositionTask(at, level=1) for at in ankles]
        tasks.append(sp.PostureTask(pose="middle", step=0.05))
        self.problem = problem
        self.solver = sp.PrioritizedIK(
            problem.skeleton, tasks, dofs=problem.dofs, iterations=ITERATIONS, cold_iterations=ITERATIONS
        )

    def reset(self, root: Array, turn: Array, angles: Array) -> None:
        """Take a pose."""
        rotations = np.tile([0.0, 0.0, 0.0, 1.0], (len(self.problem.names), 1))
        rotations[0] = Rotation.from_matrix(turn).as_quat()
        for joint in set(self.problem.hinge_joint.tolist()):
            own = np.flatnonzero(self.problem.hinge_joint == joint)
            parts = [Rotation.from_rotvec(angles[k] * self.problem.axes[k]) for k in own]
            rotations[joint] = np.prod(parts).as_quat() if len(parts) > 1 else parts[0].as_quat()
        pose = sp.Pose(self.solver.body.rig, rotations, root[None])
        self.last = self.solver.begin(pose)

    def solve(self, targets: Array) -> int:
        """One frame; returns the iterations."""
        self.last = self.solver.solve(targets, previous=self.last)
        return self.last.iterations

    def state(self) -> State:
        """Root, its turn, hinge angles."""
        found = self.solver.hinge_angles(self.last)
        names, angles = self.problem.names, np.empty(len(self.problem.axes))
        for joint in set(self.problem.hinge_joint.tolist()):
            angles[self.problem.hinge_joint == joint] = found[names[joint]]
        pose = self.last.pose
        return pose.translations[0], Rotation.from_quat(pose.rotations[0]).as_matrix(), angles


class Mink:
    """A weighted quadratic program with hard joint limits (daqp)."""

    def __init__(self, problem: Problem) -> None:
        import mink
        import mujoco

        self.mink = mink
        self.model = mujoco.MjModel.from_xml_string(problem.mjcf)
        self.configuration = mink.Configuration(self.model)
        names = [problem.names[k] for k in problem.targets]
        self.tasks = [mink.FrameTask(n, "body", position_cost=1.0, orientation_cost=0.0) for n in names]
        self.limits = [mink.ConfigurationLimit(self.model)]
        self.bodies = [self.model.body(n).id for n in names]
        self.places = np.array([self.model.joint(n).qposadr[0] for n in problem.hinge_name])

    def reset(self, root: Array, turn: Array, angles: Array) -> None:
        """Take a pose."""
        q = np.zeros(self.model.nq)
        q[:3], q[3:7] = root, Rotation.from_matrix(turn).as_quat()[[3, 0, 1, 2]]
        q[self.places] = angles
        self.configuration.update(q)

    def solve(self, targets: Array) -> int:
        """One frame; returns the iterations."""
        for task, target in zip(self.tasks, targets, strict=True):
            task.set_target(self.mink.SE3.from_translation(target))
        done = 0
        while done < ITERATIONS:
            done += 1
            velocity = self.mink.solve_ik(
                self.configuration, self.tasks, 1.0, "daqp", damping=DAMPING, limits=self.limits
            )
            self.configuration.integrate_inplace(velocity, 1.0)
            gap = self.configuration.data.xpos[self.bodies] - targets
            if np.linalg.norm(gap, axis=1).max() < TOLERANCE:
                break
        return done

    def state(self) -> State:
        """Root, its turn, hinge angles."""
        q = self.configuration.q
        return q[:3].copy(), Rotation.from_quat(q[[4, 5, 6, 3]]).as_matrix(), q[self.places]


def run(solver: Ours | Mink, truth: Truth, targets: Array) -> tuple[Array, Array, list[State]]:
    """Times [ms], iterations and poses of every frame."""
    first = truth.root[0], truth.turn[0], truth.angles[0]
    solver.reset(*first)
    for frame in range(min(WARM, len(targets))):
        solver.solve(targets[frame])
    solver.reset(*first)
    times, iterations, states = np.zeros(len(targets)), np.zeros(len(targets)), []
    for frame, target in enumerate(targets):
        start = time.perf_counter()
        iterations[frame] = solver.solve(target)
        times[frame] = 1e3 * (time.perf_counter() - start)
        states.append(solver.state())
    return times, iterations, states


def score(
    problem: Problem, truth: Truth, times: Array, iterations: Array, states: list[State]
) -> dict[str, float]:
    """The figures of one run; names with their units."""
    joints = np.stack([problem.place(*state) for state in states])
    angles = np.stack([state[2] for state in states])
    residual = np.linalg.norm((joints - truth.joints)[:, problem.targets], axis=2)
    acceleration, true = (
        np.sqrt((np.diff(p, 2, axis=0) ** 2).sum(-1).mean()) for p in (joints, truth.joints)
    )
    beyond = np.maximum(problem.low - angles, angles - problem.high)
    return {
        "frames_under_1cm": float((residual.max(axis=1) < TOLERANCE).mean()),
        "worst_residual_mm": float(1e3 * residual.max()),
        "acceleration_ratio": float(acceleration / true),
        "limit_violation_deg": float(np.degrees(max(beyond.max(), 0.0))),
        "mpjpe_mm": float(1e3 * np.linalg.norm(joints - truth.joints, axis=2).mean()),
        "iterations_mean": float(iterations.mean()),
        "ms_median": float(np.median(times)),
        "ms_p99": float(np.percentile(times, 99)),
    }


def measure(
    problem: Problem, solvers: dict[str, Callable[[], Ours | Mink]], seed: int, frames: int, rounds: int
) -> dict[str, tuple[dict[str, float], Array]]:
    """Figures of all solvers on one motion, and their times [ms]."""
    truth = problem.motion(frames, RATE, seed)
    targets = np.ascontiguousarray(truth.joints[:, problem.targets])
    best: dict[str, tuple[Array, Array, list[State]]] = {}
    for _ in range(rounds):
        for name, make in solvers.items():
            times, iterations, states = run(make(), truth, targets)
            if name in best:
                times = np.minimum(times, best[name][0])
            best[name] = times, iterations, states
    return {name: (score(problem, truth, *found), found[0]) for name, found in best.items()}


HEADER = (
    "| seed | solver | frames < 1 cm | worst mm | acceleration / truth | limits deg | MPJPE mm | iterations "
    "| median ms | p99 ms |"
)


def table(rows: Sequence[dict]) -> list[str]:
    """Markdown."""
    lines = [HEADER, "|---" * 10 + "|"]
    for row in rows:
        for name in ("sixpoint", "mink"):
            r = row if name == "sixpoint" else row.get("mink")
            if r:
                lines.append(
                    f"| {row['seed']} | {name} | {100 * r['frames_under_1cm']:.1f} % "
                    f"| {r['worst_residual_mm']:.1f} | {r['acceleration_ratio']:.2f} "
                    f"| {r['limit_violation_deg']:.2g} | {r['mpjpe_mm']:.1f} | {r['iterations_mean']:.2f} "
                    f"| {r['ms_median']:.3f} | {r['ms_p99']:.3f} |"
                )
    both = [row for row in rows if "mink" in row]
    if both:
        median = np.median([row["median_ratio"] for row in both])
        lines += ["", f"Time over mink's, median of the seeds: median {median:.3f}, p99 "]
        lines[-1] += f"{np.median([row['p99_ratio'] for row in both]):.3f}; "
        lines[-1] += f"worst seed {max(row['median_ratio'] for row in both):.3f} and "
        lines[-1] += f"{max(row['p99_ratio'] for row in both):.3f}."
    return lines


def write_docs(title: str, lines: list[str], own: bool) -> None:
    """Replace the table between the marks of docs/results.md."""
    mark = "peers own" if own else "peers outside"
    machine = f"Python {platform.python_version()}, numba {version('numba')}"
    machine += "".join(f", {n} {version(n)}" for n in ("mink", "mujoco") if importlib.util.find_spec(n))
    rewrite(RESULTS, {mark: "\n".join(["", f"Problem: {title}. {machine}.", "", *lines, ""])})


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--human", type=Path, help="a module with another hinge human")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--frames", type=int, default=500)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--flext", action="store_true", help="limbs by FLEXT tasks")
    parser.add_argument("--json", type=Path, help="write one row per seed")
    parser.add_argument("--docs", action="store_true", help="write the table into docs/results.md")
    given = parser.parse_args()
    if given.frames < 3 or given.rounds < 1:
        parser.error("at least 3 frames and 1 round")
    problem = load_outside(given.human) if given.human else build_own()
    solvers: dict[str, Callable[[], Ours | Mink]] = {"sixpoint": lambda: Ours(problem, given.flext)}
    if importlib.util.find_spec("mink") and importlib.util.find_spec("mujoco"):
        solvers["mink"] = lambda: Mink(problem)
    else:
        print("mink is not installed (pip install -e '.[bench]'): only our own rows", file=sys.stderr)
    rows, times = [], {name: [] for name in solvers}
    for seed in given.seeds:
        print(f"seed {seed} ...", file=sys.stderr, flush=True)
        found = measure(problem, solvers, seed, given.frames, given.rounds)
        row = {"seed": seed, "frames": given.frames, "rounds": given.rounds, **found["sixpoint"][0]}
        if "mink" in found:
            row["mink"] = mink = found["mink"][0]
            row["median_ratio"] = row["ms_median"] / mink["ms_median"]
            row["p99_ratio"] = row["ms_p99"] / mink["ms_p99"]
        rows.append(row)
        for name, (_, spent) in found.items():
            times[name].append(spent)
    lines = table(rows)
    if "mink" in times:
        ours, theirs = (np.percentile(np.concatenate(times[n]), (50, 99)) for n in ("sixpoint", "mink"))
        lines[-1] += f" All frames pooled: median {ours[0] / theirs[0]:.3f}, p99 {ours[1] / theirs[1]:.3f}."
    print("\n".join(lines))
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1), "utf-8")
    if given.docs:
        write_docs(problem.title, lines, given.human is None)


if __name__ == "__main__":
    main()
