"""How well, how fast and how steadily are markers followed? Rewrites docs/track.md with pictures.

    python benchmarks/track.py [--data ../shared/data] [--write]

1. Virtual markers on the built-in motions: the truth is known. Joint errors, gaps, ghosts, times;
   a second without a limb, beginning anywhere (``lost_limbs``).
2. The same from labels alone: calibrated on the markers, then followed, one rigid alignment allowed.
3. CMU takes that the data folder has as markers (C3D) and as skeleton (AMC).
4. All other marker recordings of the data folder: residuals and times.
5. A replay at 120 Hz: times of single frames.
Times are those of the process on one core, kernels compiled.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from lost_limbs import MISPLACED, NOISE, SAMPLES, core_joints, sweep
from marked import rewrite
from track_take import COLUMNS as TAKES
from track_take import measure_take
from virtual_markers import drop, misplace, place_virtual, record

import sixpoint as sp
from sixpoint.body import rotations as rot
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.markers.recording import Markers
from sixpoint.body.rigid import fit_rigid
from sixpoint.calibration.markers import calibrate_markers
from sixpoint.formats.markers import load_markers
from sixpoint.jobs.track.models import columns_of, select_markers
from sixpoint.solvers.tracking.limits import widen_limits
from sixpoint.solvers.tracking.solver import MarkerTracker, TrackedMotion
from sixpoint.study.canvas import save_canvas
from sixpoint.study.tracking import draw_residuals, draw_tracking, overall, summarise_markers

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"
LAYOUT = ROOT / "src/sixpoint/body/data/layouts/markers24.toml"
EVERY = 12  # frames from one lost limb to the next
Array = np.ndarray


def errors(result: sp.Motion, truth: sp.Motion, joints: Sequence[int]) -> Array:
    """(F, n) joint distances [m] on one figure."""
    return np.linalg.norm(result.positions[:, joints] - truth.positions[:, joints], axis=-1)


def aligned(ours: Array, theirs: Array) -> Array:
    """(F, n) distances [m] after one rigid alignment of all frames."""
    turn, shift = fit_rigid(ours.reshape(-1, 3), theirs.reshape(-1, 3))
    return np.linalg.norm(rot.mul_vec(turn, ours) + shift - theirs, axis=-1)


def follow(model: MarkerModel, markers: Array, rate: float, **options: object) -> tuple[TrackedMotion, float]:
    """Follow within limits that may widen, and the process time of a frame [s]."""
    MarkerTracker(model).warm_up()
    start = time.process_time()
    tracker = MarkerTracker(model, dofs=widen_limits(model, markers, rate)[0])
    done = tracker.solve_frames(markers, rate, **options)  # type: ignore[arg-type]
    return done, (time.process_time() - start) / len(markers)


def virtual_row(name: str, truth: sp.Motion, figure: sp.Figure) -> tuple[list[str], list[str], TrackedMotion]:
    """A recording with virtual markers: errors and times; gaps and ghosts."""
    true = place_virtual(figure)
    model, rate, joints = misplace(true, MISPLACED, 1), truth.rate, core_joints(figure)
    markers = record(true, truth, NOISE, 2).positions
    done, seconds = follow(model, markers, rate)
    whole = errors(done.motion, truth, joints).mean()
    gappy = drop(markers, rate, 3)
    once, _ = follow(model, gappy, rate, two_sided=False)
    both, twice = follow(model, gappy, rate)
    lost = [sweep(truth, figure, two_sided, EVERY) for two_sided in (False, True)]
    ghosts, found, false = haunt(model, markers, rate)
    accuracy = [
        name, f"{len(truth) / rate:.1f} s, {rate:g} Hz", f"{1e3 * overall(done.residual, done.flags):.1f}",
        f"{1e3 * whole:.1f}", f"{1e3 * seconds:.2f}", f"{1 / seconds / rate:.0f}", f"{1 / twice / rate:.0f}",
    ]  # fmt: skip
    more = [f"{100 * (errors(x.motion, truth, joints).mean() / whole - 1):+.0f} %" for x in (once, both)]
    jumps = [f"{100 * way[0].size:.1f}" for way in lost]
    limb = [f"{100 * np.mean([jump.error for jump in way]):.1f}" for way in lost]
    return accuracy, [name, *more, str(len(lost[0])), *jumps, *limb, f"{found} of {ghosts}", str(false)], done


def haunt(model: MarkerModel, markers: Array, rate: float) -> tuple[int, int, int]:
    """Samples moved away by 30 cm on average or exchanged; how many were refused or found, and false ones."""
    rng, out = np.random.default_rng(4), markers.copy()
    bad = np.zeros(out.shape[:2], bool)
    for i in rng.choice(out.shape[1], 8, replace=False):
        start = int(rng.integers(5, len(out) - 25))
        length = int(rng.integers(1, 20))
        out[start : start + length, i] += rng.normal(0, 0.17, 3)
        bad[start : start + length, i] = True
    for a, b in (("LHEE", "LTOE"), ("LFHD", "RFHD"), ("LKNE", "RKNE"), ("LWRA", "LWRB")):
        pair = [model.names.index(a), model.names.index(b)]
        start = int(rng.integers(5, len(out) - 25))
        part = slice(start, start + 15)
        if not bad[part, pair].any():
            out[part, pair] = out[part, pair[::-1]]
            bad[part, pair] = True
    done, _ = follow(model, out, rate, two_sided=False)
    noticed = done.flags >= 2
    return int(bad.sum()), int((noticed & bad).sum()), int((noticed & ~bad).sum())


def chain_row(
    name: str, markers: Markers, truth: sp.Motion, figure: sp.Figure, layout: Path | None
) -> list[str]:
    """From labels alone: calibrated, followed, aligned once."""
    start = time.process_time()
    model = calibrate_markers(markers, None, layout)
    calibration = time.process_time() - start
    done, seconds = follow(model, columns_of(model, markers), markers.rate)
    count = min(len(done.motion), len(truth))
    ours = done.motion.positions[:count, core_joints(model.figure)]
    off = aligned(ours, truth.positions[:count, core_joints(figure)])
    return [
        name, str(len(model.names)), f"{100 * overall(done.residual, done.flags):.2f}",
        f"{100 * off.mean():.2f}",
        f"{100 * np.percentile(off, 95):.1f}", f"{calibration:.0f}", f"{1 / seconds / markers.rate:.0f}",
    ]  # fmt: skip


def file_row(path: Path, pictures: Path | None) -> list[str]:
    """A recording without a truth: residuals and times."""
    markers = load_markers(path)
    statics = [
        p for p in sorted(path.parent.glob("*")) if "static" in p.stem.lower() and p.suffix == path.suffix
    ]
    kin = [p for p in statics if p.stem.split("_")[0] == path.stem.split("_")[0] and p != path]
    static = load_markers(kin[0]) if kin else None
    model = calibrate_markers(markers, static)
    positions = columns_of(model, markers)
    done, seconds = follow(model, positions, markers.rate)
    rows = summarise_markers(model.names, done.residual, done.flags)
    if pictures is not None:
        name = path.stem.lower()
        save_canvas(
            draw_tracking(model.figure, done.motion, positions, done.flags, path.name),
            pictures / f"{name}.png",
        )
        curves = draw_residuals(rows, done.residual, done.flags, markers.rate, path.name)
        save_canvas(curves, pictures / f"{name}-residuals.png")
    seen = np.mean(done.flags != 1)
    return [
        path.name, f"{len(markers) / markers.rate:.1f} s, {markers.rate:g} Hz", str(len(model.names)),
        f"{100 * overall(done.residual, done.flags):.2f}", f"{rows[0].name} {100 * rows[0].rms:.1f}",
        f"{seen:.1%}",
        str(int(np.sum(done.flags == 2))), f"{1 / seconds / markers.rate:.0f}",
        ", ".join(model.missing) or "none",
    ]  # fmt: skip


def replay_rows() -> list[list[str]]:
    """Single frames at 120 Hz, as a live loop asks for them."""
    figure = sp.Figure.from_stature(1.75)
    truth = sp.make_sample("boxing", figure)
    true = place_virtual(figure)
    rows = []
    for count in (24, 41):
        model = true if count == 41 else select_markers(true, labels_of_24(true))
        markers = columns_of(model, record(true, truth, NOISE, 2))
        tracker, frame, spent, used = MarkerTracker(model), None, [], []
        tracker.warm_up()
        for _ in range(5):
            for row in markers:
                start, begun = time.perf_counter(), time.thread_time()
                frame = tracker.solve(row, frame, 1 / 120)
                used.append(1e3 * (time.thread_time() - begun))
                spent.append(1e3 * (time.perf_counter() - start))
        times = [f"{np.percentile(values, p):.2f}" for values in (used, spent) for p in (50, 99, 99.9)]
        rows.append([str(len(model.names)), *times, f"{1e3 / 120:.2f}"])
    return rows


def labels_of_24(model: MarkerModel) -> tuple[str, ...]:
    """The labels that the layout of 24 markers takes of CMU's 41."""
    text = LAYOUT.read_text("utf-8")
    return tuple(name for name in model.names if f"\n{name} = " in text)


def table(columns: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    columns = list(columns)
    lines = [f"| {' | '.join(columns)} |", f"|{'|'.join('---' for _ in columns)}|"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


def main() -> None:
    """Measure, print, and rewrite the page where asked to."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--write", action="store_true", help="rewrite docs/track.md and its pictures")
    parser.add_argument("--quick", action="store_true", help="two built-in motions only")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    pictures = ROOT / "docs" / "track" if options.write else None
    if pictures is not None:
        pictures.mkdir(exist_ok=True)
    figure = sp.Figure.from_stature(1.75)
    known, robust, chain = [], [], []
    for name in SAMPLES[:2] if options.quick else SAMPLES:
        truth = replace(sp.make_sample(name, figure), name=name)
        accuracy, gaps, _ = virtual_row(name, truth, figure)
        known.append(accuracy)
        robust.append(gaps)
        markers = record(place_virtual(figure), truth, NOISE, 2)
        for layout in (None, LAYOUT):
            chain.append(chain_row(name, markers, truth, figure, layout))
        if pictures is not None:
            model = misplace(place_virtual(figure), MISPLACED, 1)
            lost = drop(markers.positions, truth.rate, 3)
            done, _ = follow(model, lost, truth.rate)
            title = f"{name}, a fifth of the samples deleted"
            save_canvas(draw_tracking(figure, done.motion, lost, done.flags, title),
                        pictures / f"{name.replace('_', '-')}.png")  # fmt: skip
            if name == "boxing":
                rows = summarise_markers(model.names, done.residual, done.flags)
                save_canvas(
                    draw_residuals(rows, done.residual, done.flags, truth.rate, name),
                    pictures / "residuals.png",
                )
        print(*known[-1], "|", *robust[-1][1:], "|", *chain[-2][1:], "|", *chain[-1][1:], flush=True)
    pairs, files = [], []
    for path in sorted([*options.data.glob("c3d/*.c3d"), *options.data.glob("trc/*.trc")]):
        amc = options.data / "cmu" / f"{path.stem}.amc"
        try:
            if amc.is_file():
                truth = sp.load(amc)
                pairs += [
                    measure_take(path.stem, load_markers(path), truth, layout) for layout in (None, LAYOUT)
                ]
                print(*pairs[-2], "|", *pairs[-1], flush=True)
            if "static" not in path.stem.lower():
                files.append(file_row(path, pictures))
                print(*files[-1], flush=True)
        except sp.SixpointError as error:
            print(f"{path.name}: {error}", flush=True)
    live = replay_rows()
    for row in live:
        print(*row)
    parts = {
        "known": table(KNOWN, known),
        "robust": table(ROBUST, robust),
        "chain": table(CHAIN, chain),
        "cmu": table(TAKES, pairs) if pairs else NOTHING.format("take as both C3D and AMC"),
        "files": table(FILES, files) if files else NOTHING.format("recording of markers"),
        "live": table(LIVE, live),
    }  # fmt: skip
    if options.write:
        rewrite(ROOT / "docs" / "track.md", parts)


KNOWN = (
    "motion", "length", "residual, RMS [mm]", "joint error [mm]", "ms per frame", "times real time",
    "with gaps",
)  # fmt: skip
ROBUST = (
    "motion", "error with gaps, causal", "two-sided", "limbs lost", "worst jump, causal [cm]", "two-sided",
    "limb off, causal [cm]", "two-sided", "bad samples noticed", "false",
)  # fmt: skip
CHAIN = (
    "recording", "markers", "residual, RMS [cm]", "joint error [cm]", "95 % below [cm]", "calibration [s]",
    "times real time",
)  # fmt: skip
FILES = (
    "file", "length", "markers", "residual, RMS [cm]", "worst marker [cm]", "seen", "refused",
    "times real time", "without markers",
)  # fmt: skip
LIVE = (
    "markers", "median, processor [ms]", "p99", "p99.9", "median, clock [ms]", "p99", "p99.9", "a frame [ms]",
)  # fmt: skip
NOTHING = "Not measured yet: the data folder had no {}."

if __name__ == "__main__":
    main()
