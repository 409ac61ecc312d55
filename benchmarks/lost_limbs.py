"""A second without any marker of a limb, wherever it may begin: how far do joints jump?

    python benchmarks/lost_limbs.py [--every 6] [--motions boxing walk]

Every limb of every built-in motion, with a gap that begins at every sixth frame. A jump is how much further
than in the truth a joint moves in one frame; at 60 Hz a frame is 17 ms, and 5 cm are 3 m/s. The worst are
listed.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from virtual_markers import ARM, LEG, misplace, place_virtual, record

import sixpoint as sp
from sixpoint.solvers.tracking.limits import widen_limits
from sixpoint.solvers.tracking.solver import MarkerTracker

LIMBS = {"l_arm": ("L", ARM), "r_arm": ("R", ARM), "l_leg": ("L", LEG), "r_leg": ("R", LEG)}
GAP = 1.0  # s
NOISE, MISPLACED = 0.001, 0.008  # m, along each axis
SAMPLES = ("walk", "boxing", "jump_kick", "reach", "climb_and_hang")
Array = np.ndarray


class Jump(NamedTuple):
    """The largest jump of one gap.

    Attributes:
        size: How much further than in the truth a joint moved [m].
        joint: Which.
        frame: Between this frame, counted from the first one without the limb, and the one before.
        limb: What was lost.
        start: First frame without it.
        error: Mean error of the limb's joints in the gap [m].
    """

    size: float
    joint: str
    frame: int
    limb: str
    start: int
    error: float


def core_joints(figure: sp.Figure) -> list[int]:
    """Pelvis, head and the joints of the limbs: what every figure has."""
    roles = figure.roles
    return [roles.pelvis, roles.head, *(j for limb in roles.limbs for j in limb)]


def excess(ours: Array, theirs: Array) -> Array:
    """(F - 1, J) how much further than in the truth joints (F, J, 3) move from frame to frame [m]."""
    steps = [np.linalg.norm(np.diff(positions, axis=0), axis=-1) for positions in (ours, theirs)]
    return steps[0] - steps[1]


def sweep(truth: sp.Motion, figure: sp.Figure, two_sided: bool, every: int = 6) -> list[Jump]:
    """The largest jump of every gap, the worst first."""
    true = place_virtual(figure)
    model, rate, joints = misplace(true, MISPLACED, 1), truth.rate, core_joints(figure)
    markers = record(true, truth, NOISE, 2).positions
    tracker = MarkerTracker(model, dofs=widen_limits(model, markers, rate)[0])
    gap = round(GAP * rate)
    jumps = []
    for limb, (side, labels) in LIMBS.items():
        columns = [model.names.index(side + label) for label in labels]
        mine = list(figure.roles.limbs[list(LIMBS).index(limb)])
        for start in range(5, len(markers) - gap - 5, every):
            lost = markers.copy()
            lost[start : start + gap, columns] = np.nan
            ours = tracker.solve_frames(lost, rate, two_sided=two_sided).motion.positions
            more = excess(ours[:, joints], truth.positions[:, joints])
            frame, joint = np.unravel_index(int(np.argmax(more)), more.shape)
            inside = slice(start, start + gap)
            error = np.linalg.norm((ours[inside] - truth.positions[inside])[:, mine], axis=-1).mean()
            name = figure.skeleton.names[joints[joint]]
            jumps.append(Jump(float(more.max()), name, int(frame) + 1 - start, limb, start, float(error)))
    return sorted(jumps, reverse=True)


def main() -> None:
    """Print the worst gaps of every motion."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--every", type=int, default=6)
    parser.add_argument("--motions", nargs="+", default=SAMPLES)
    parser.add_argument("--ways", choices=("one", "two"))
    parser.add_argument("--show", type=int, default=3, help="how many to list")
    options = parser.parse_args()
    figure = sp.Figure.from_stature(1.75)
    for name in options.motions:
        truth = sp.make_sample(name, figure)
        for two_sided in (False, True) if options.ways is None else (options.ways == "two",):
            show(name, two_sided, sweep(truth, figure, two_sided, options.every), options.show)


def show(name: str, two_sided: bool, jumps: Sequence[Jump], most: int) -> None:
    """Print one motion."""
    error = 100 * np.mean([jump.error for jump in jumps])
    over = sum(jump.size > 0.05 for jump in jumps)
    print(
        f"{name}, {'two-sided' if two_sided else 'causal'}: {over} of {len(jumps)} gaps above 5 cm, "
        f"limb off by {error:.1f} cm in them",
        flush=True,
    )
    for jump in jumps[:most]:
        where = f"{jump.joint}, frame {jump.frame} of {jump.limb} lost at {jump.start}"
        print(f"  {100 * jump.size:5.1f} cm  {where}", flush=True)


if __name__ == "__main__":
    main()
