"""Measure what stands between trackers and solver: smoothing, guides, feet, gaps, roles; prints Markdown.

    python benchmarks/live_trackers.py [SIXPOINT_DATA]

Recordings are clips of CMU subjects 02, 03, 05, 09, 11, 16, 29 and 127, on which constants were chosen.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import sixpoint as sp
from sixpoint.body import rotations as rot
from sixpoint.body.stature import stature_of
from sixpoint.calibration.roles import KITS, POINTS, assign_roles
from sixpoint.live.feet import Floor, level_feet
from sixpoint.live.guides import Guidance
from sixpoint.live.tracking import Tracked, Tracking
from sixpoint.signals.one_euro import SMOOTHINGS, OneEuro

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from start_poses import POSES, stand, with_offsets

CLIPS = ("02_01", "02_03", "03_01", "05_03", "09_01", "11_01", "16_11", "16_42", "29_01", "127_03")
RATE, NOISE, TURN_NOISE = 90.0, 0.0015, np.radians(0.5)


def angle(a, b):
    """Angle between rotations (..., 4) [rad]."""
    return rot.angle(rot.mul(a, rot.inv(b)))


def smoothing(clips) -> None:
    """Jitter of a still tracker against lag of a moving one."""
    rng = np.random.default_rng(0)
    print("\n| smoothing | still: mm, degrees | lag at 0.1-0.5 m/s, above | RMS error: mm, degrees |")
    print("|---|---|---|---|")
    noise = rng.normal(0, NOISE, (900, 6, 3))
    turns = Rotation.from_rotvec(rng.normal(0, TURN_NOISE, (5400, 3))).as_quat().reshape(900, 6, 4)
    moving = []
    for _, figure, motion in clips:
        targets = figure.targets(motion)
        at = np.arange(0.0, (len(targets) - 1) / targets.rate, 1 / RATE) * targets.rate
        k, w = at.astype(int), (at % 1.0)[:, None, None]
        p = (1 - w) * targets.positions[k] + w * targets.positions[k + 1]
        q = targets.rotations[k]
        shaken = Rotation.from_rotvec(rng.normal(0, TURN_NOISE, (len(k) * 6, 3))).as_quat().reshape(q.shape)
        moving.append((p, p + rng.normal(0, NOISE, p.shape), q, rot.mul(shaken, q)))
    for name, constants in SMOOTHINGS.items():
        out, out_turn = run(constants, noise, turns)
        still = np.sqrt(np.mean(np.sum(out[100:] ** 2, -1))) * 1e3
        still_turn = np.degrees(np.sqrt(np.mean(rot.angle(out_turn[100:]) ** 2)))
        rows = []
        for p, noisy, q, shaken in moving:
            out, out_turn = run(constants, noisy, shaken)
            v = np.gradient(p, axis=0) * RATE
            speed, behind = np.linalg.norm(v, axis=-1), np.sum((p - out) * v, -1)
            bands = [(speed > 0.1) & (speed < 0.5), speed > 0.5]
            lag = [behind[b].sum() / (speed[b] ** 2).sum() * 1e3 for b in bands]
            error = np.sqrt(np.mean(np.sum((p - out) ** 2, -1))) * 1e3
            rows.append([*lag, error, np.degrees(np.sqrt(np.mean(angle(out_turn, q) ** 2)))])
        slow, fast, error, turned = np.mean(rows, axis=0)
        jitter, lag = f"{still:.1f}, {still_turn:.2f}", f"{slow:.0f} ms, {fast:.1f} ms"
        print(f"| {name} | {jitter} | {lag} | {error:.1f}, {turned:.2f} |")


def run(constants, positions, rotations):
    """Filter a stream at RATE."""
    f = OneEuro(constants)
    p = np.array([f.filter_positions(x, k / RATE) for k, x in enumerate(positions)])
    return p, np.array([f.filter_rotations(x, k / RATE) for k, x in enumerate(rotations)])


def guides(clips) -> None:
    """Elbows, knees and chest with and without trackers on them; feet with and without levelling."""
    print(
        "\n| solver | extra trackers | elbows, cm | knees, cm | chest, cm, degrees |\n|---|---|---|---|---|"
    )
    feet = []
    for rotations in ((), sp.EFFECTORS):
        for extra, on in (
            ("none", [0] * 5),
            ("chest", [1, 0, 0, 0, 0]),
            ("elbows", [0, 1, 1, 0, 0]),
            ("all", [1] * 5),
        ):
            rows = []
            for _, figure, motion in clips:
                rows.append(guided(figure, motion, rotations, np.array(on, float), feet))
            elbow, knee, chest, turned = np.mean(rows, axis=0)
            kind = "six rotations" if rotations else "positions"
            print(f"| sik+, {kind} | {extra} | {elbow:.1f} | {knee:.1f} | {chest:.1f}, {turned:.1f} |")
    rest, level = np.degrees(np.mean(feet, axis=0))
    print(f"\nFeet without rotations: {rest:.1f} degrees off at their rest angle, {level:.1f} levelled.")


def guided(figure, motion, rotations, weights, feet):
    """Mean errors of one clip."""
    targets, r = figure.targets(motion), figure.roles
    places, world = motion.transforms
    true = rot.mul(world, rot.inv(figure.neutral))
    chest = [j for j in r.spine if j in figure.skeleton.path(0, r.shoulder[0])][-1]
    joints, ankles = [chest, *r.elbow, *r.knee], list(r.ankle)
    solver, guidance = sp.SequentialIKPlus(figure, rotations=rotations), Guidance(figure)
    floor, stood = Floor.under(figure), float(np.percentile(targets.positions[:, 4:, 1], 10))
    floor = replace(floor, height=stood - floor.ankle)
    solution, rows = None, []
    for k in range(0, len(targets), 4):
        frame = Tracked(
            targets.positions[k], targets.rotations[k], np.ones(6, bool), np.ones(11, int), np.zeros(11),
            places[k, joints], true[k, joints], weights,
        )  # fmt: skip
        solution = guidance.solve(solver, frame, solution, 4 / targets.rate)
        at, turn = solution.pose.compute_transforms()
        off = np.linalg.norm(at[joints] - places[k, joints], axis=1) * 100
        turned = angle(rot.mul(turn[chest], rot.inv(figure.neutral[chest])), true[k, chest])
        rows.append([off[1:3].mean(), off[3:].mean(), off[0], np.degrees(turned)])
        if not rotations and not weights.any():
            pair = []
            for pose in (solution.pose, level_feet(figure, solution.pose, floor)):
                foot = rot.mul(pose.compute_transforms()[1][ankles], rot.inv(figure.neutral[ankles]))
                pair.append(angle(foot, true[k, ankles]).mean())
            feet.append(pair)
    return np.mean(rows, axis=0)


def kits(clips) -> None:
    """How far filled effectors are off."""
    print("\n| kit | pelvis, cm | ankles, cm | facing, degrees | a foot stands, % |\n|---|---|---|---|---|")
    for kit in (3, 4, 5):
        rows = []
        for _, figure, motion in clips:
            targets = figure.targets(motion)
            seen = [sp.EFFECTORS.index(n) for n in KITS[kit]]
            p, q = np.full(targets.positions.shape, np.nan), np.full(targets.rotations.shape, np.nan)
            p[:, seen], q[:, seen] = targets.positions[:, seen], targets.rotations[:, seen]
            low = np.percentile(targets.positions[:, 4:, 1], 3) - 0.039 * stature_of(figure)
            tracking, out, yaw = Tracking(figure, floor=float(low)), [], []
            for k in range(len(targets)):
                out.append(tracking.update(k / targets.rate, p[k], q[k]).positions)
                yaw.append(tracking.stance.yaw)
            off = np.linalg.norm(np.array(out) - targets.positions, axis=-1) * 100
            true = 2 * np.arctan2(targets.rotations[:, 0, 1], targets.rotations[:, 0, 3])
            facing = np.degrees(np.abs((np.array(yaw) - true + np.pi) % (2 * np.pi) - np.pi)).mean()
            still = (np.linalg.norm(np.diff(np.array(out)[:, 4:], axis=0), axis=-1) < 1e-9).mean() * 100
            rows.append([off[:, 0].mean(), off[:, 4:].mean(), facing, still])
        pelvis, ankles, facing, still = np.mean(rows, axis=0)
        stands = f"{still:.0f}" if "l_ankle" not in KITS[kit] else "-"
        print(f"| {kit} | {pelvis:.1f} | {ankles:.1f} | {facing:.0f} | {stands} |")


def roles(seconds: float = 60.0) -> None:
    """Roles of shuffled trackers in start poses, 1.2 to 2.0 m, with and without a facing."""
    rng, counts, end = np.random.default_rng(77), Counter(), time.monotonic() + seconds
    figures = [sp.Figure.from_stature(h) for h in (1.2, 1.4, 1.6, 1.8, 2.0)]
    while time.monotonic() < end:
        for pose in POSES:
            for kit, names in KITS.items():
                yaw = rng.uniform(-np.pi, np.pi)
                points = with_offsets(*stand(figures[rng.integers(5)], pose, yaw), rng)
                order = rng.permutation(kit)
                shuffled = points[[POINTS.index(n) for n in names]][order]
                want = {n: int(np.flatnonzero(order == k)[0]) for k, n in enumerate(names)}
                gaze = yaw + np.radians(POSES[pose].get("gaze", 0.0)) + rng.uniform(-0.15, 0.15)
                for facing in (None, [np.sin(gaze), 0.0, np.cos(gaze)]):
                    head = want["head"] if kit == 3 and facing else None
                    found = assign_roles(shuffled, facing=facing, head=head)
                    how = "reported" if not found.certain else "right" if found.roles == want else "wrong"
                    counts[kit, "known" if facing else "unknown", how] += 1
    print("\n| kit | facing known: right, reported, wrong | unknown |\n|---|---|---|")
    for kit in KITS:
        known, unknown = (
            ", ".join(str(counts[kit, f, how]) for how in ("right", "reported", "wrong"))
            for f in ("known", "unknown")
        )
        print(f"| {kit} | {known} | {unknown} |")


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "../shared/data") / "cmu"
    clips = []
    for name in CLIPS:
        motion = sp.load(folder / f"{name}.amc").sliced(slice(0, 1200))
        clips.append((name, sp.Figure.from_motion(motion), motion))
    smoothing(clips)
    guides(clips)
    kits(clips)
    roles()
