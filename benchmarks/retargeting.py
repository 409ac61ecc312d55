"""A recording of a person of 1.90 m on an avatar of 1.20 m: what stays of joint angles and of contacts?

Relative mode, joint angles in degrees of chest, shoulders, elbows, hips and knees: mean, share within 3
degrees, 95th percentile, largest.

- same rig: solved for the small one against solved for the tall one, both of one rig and its proportions.
- points: bend of elbows and knees that the points ask of the built-in figure, against the recorded.
- posed as recorded: the built-in figure, started from the recorded posture, against the recording; with the
  joint limits of the table and without.
- posed as reconstructed: the tall rig is solved for its six points alone; the built-in figure, started from
  that, against it.
- points alone: solved for the built-in figure from nothing but its points, against solved for the tall rig;
  with six rotations, the same with rotations of all trackers. What differs is how a solver guesses what six
  points leave open.
- to the truth: the error against the recording of what is solved for points alone, of tall rig and built-in.

Absolute mode, residual of standing ankles on the built-in figure, where its legs reach: share below 1 mm,
99th percentile and largest [mm], with and without joint limits.

    python benchmarks/retargeting.py [--data FOLDER] [--people 14]

Without recordings the built-in motions are measured: of the built-in figure, of one of other proportions, and
of one whose spine is straight in the neutral pose.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import sixpoint as sp
from sixpoint.body import rotations as rot
from sixpoint.body.retargeting import carry_pose, carry_trunk
from sixpoint.calibration.model import stature_of
from sixpoint.jobs.retarget import retarget
from sixpoint.signals.contacts import find_contacts

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
TALL, SMALL = 1.90, 1.20
FRAMES = 1200  # of each recording, from its beginning
PEOPLE = "02,03,05,09,11,16,29,127"
EACH = 4  # recordings of each person or folder

CONTACTS = ("limits", "limits, posed", "no limits", "no limits, posed")

Array = NDArray[np.float64]


def scaled(motion: sp.Motion, stature: float) -> tuple[sp.Motion, sp.Figure]:
    """A recording of a person of another stature [m], and its figure."""
    factor = stature / stature_of(sp.Figure.from_motion(motion))
    s = motion.skeleton
    skeleton = replace(s, offsets=s.offsets * factor, site_offsets=s.site_offsets * factor)
    motion = replace(motion, skeleton=skeleton, translations=motion.translations * factor)
    return motion, sp.Figure.from_motion(motion)


def joint_angles(figure: sp.Figure, motion: sp.Motion) -> Array:
    """(F, 9, 4) rotations chest<-pelvis, then shoulders and hips, elbows and knees, of any rig."""
    r, world = figure.roles, rot.mul(motion.transforms[1], rot.inv(figure.neutral))
    first = r.clavicle[0] if r.clavicle else r.shoulder[0]
    chest = next(j for j in figure.skeleton.path(0, first)[-2::-1] if j in (r.pelvis, *r.spine))
    pairs = [(r.pelvis, chest)]
    pairs += [(base, limb[0]) for base, limb in zip((chest, chest, r.pelvis, r.pelvis), r.limbs, strict=True)]
    pairs += [limb[:2] for limb in r.limbs]
    return np.stack([rot.mul(rot.inv(world[:, a]), world[:, b]) for a, b in pairs], axis=1)


def between(a: Array, b: Array) -> Array:
    """Angles from one set of rotations to another [degrees]."""
    return np.degrees(rot.angle(rot.mul(rot.inv(a), b))).ravel()


def recorded_bend(figure: sp.Figure, motion: sp.Motion) -> Array:
    """(F, 4) angle between the bones at elbows and knees [degrees]."""
    a, b, c = (motion.positions[:, [limb[k] for limb in figure.roles.limbs]] for k in range(3))
    return np.degrees(np.arccos(np.clip(np.sum(rot.unit(b - a) * rot.unit(c - b), axis=2), -1, 1)))


def asked_bend(figure: sp.Figure, roots: Array, ends: Array) -> Array:
    """(F, 4) the same that points ask for, by the law of cosines [degrees]."""
    off = figure.offset_between
    upper, lower = (
        np.array([np.linalg.norm(off(limb[k], limb[k + 1])) for limb in figure.roles.limbs]) for k in (0, 1)
    )
    far = np.linalg.norm(ends - roots, axis=2)
    return np.degrees(np.arccos(np.clip((far**2 - upper**2 - lower**2) / (2 * upper * lower), -1, 1)))


def clips(data: Path, people: list[str]) -> Iterator[tuple[str, str, sp.Motion]]:
    """Group, name and motion of all recordings; of the built-in motions where there are none."""
    found = False
    for pattern in (*(f"cmu/{person}_*.amc" for person in people), "bandai/*.bvh", "mass/*.bvh"):
        for path in sorted(data.glob(pattern))[:EACH]:
            found = True
            yield path.parent.name, path.stem, sp.load(path).sliced(slice(0, FRAMES))
    if found:
        return
    stocky = sp.Figure.from_segments(
        thigh=0.46, calf=0.48, torso_length=0.58, neck=0.14, upper_arm=0.31, forearm=0.31, torso_width=0.5
    )
    built_in = sp.Figure.from_stature(TALL)
    offsets = built_in.skeleton.offsets.copy()
    offsets[list(built_in.roles.spine), 2] = 0.0
    straight = sp.Figure.from_skeleton(replace(built_in.skeleton, offsets=offsets))
    for group, figure in (
        ("samples", built_in),
        ("samples, stocky", stocky),
        ("samples, straight spine", straight),
    ):
        for name in sp.SAMPLES:
            yield group, name, sp.make_sample(name, figure)


class Measures:
    """Angles and residuals of a group of clips."""

    def __init__(self) -> None:
        self.angles: dict[str, list[Array]] = {}
        self.residuals: dict[str, list[Array]] = {name: [] for name in CONTACTS}

    def add(self, motion: sp.Motion) -> None:
        """Measure one recording."""
        motion, tall = scaled(motion, TALL)
        points, small = tall.targets(motion), sp.Figure.from_stature(SMALL)
        truth = joint_angles(tall, motion)
        own = joint_angles(tall, sp.SequentialIKPlus(tall).solve_motion(points))

        same_motion, same = scaled(motion, SMALL)
        moved = retarget(motion, same, source=tall)
        np.testing.assert_allclose(moved.positions, same.targets(same_motion).positions, atol=1e-6)
        self.note("same rig", between(own, self.solve(same, moved)))

        moved = retarget(motion, small, source=tall)
        roots = self.roots(tall, motion, small) + moved.positions[:, :1]
        asked = asked_bend(small, roots, moved.positions[:, 2:])
        self.note("points", np.abs(asked - recorded_bend(tall, motion)).ravel())
        pose = carry_pose(motion, tall, small)
        for limits, name in ((True, "posed as recorded"), (False, "the same, no limits")):
            solver = sp.SequentialIKPlus(small, limits=limits)
            posed = joint_angles(small, solver.solve_frames(moved, start=pose).motion)
            self.note(name, between(truth, posed))

        guess = sp.SequentialIKPlus(tall).solve_motion(points)
        start = carry_pose(guess, tall, small)
        again = sp.SequentialIKPlus(small).solve_frames(retarget(guess, small, source=tall), start=start)
        self.note("posed as reconstructed", between(own, joint_angles(small, again.motion)))
        plain = self.solve(small, moved)
        self.note("points alone", between(own, plain))
        self.note(
            "the same, six rotations",
            between(self.solve(tall, points, sp.EFFECTORS), self.solve(small, moved, sp.EFFECTORS)),
        )
        self.note("to the truth: tall rig", between(truth, own))
        self.note("to the truth: built-in", between(truth, plain))

        kept = retarget(motion, small, "absolute", source=tall)
        hips = self.roots(tall, motion, small)[:, 2:] + kept.positions[:, :1]
        reached = np.linalg.norm(hips - kept.positions[:, 4:], axis=2) <= small.limb_lengths[2:]
        stands = find_contacts(points.positions[:, 4:], motion.rate) & reached
        for name in self.residuals:
            solver = sp.SequentialIKPlus(small, limits=not name.startswith("no limits"))
            begun = {"start": pose} if name.endswith("posed") else {}
            residual = solver.solve_frames(kept, **begun).residual
            self.residuals[name].append(residual[:, 4:][stands] * 1000.0)

    def note(self, name: str, values: Array) -> None:
        """Keep angles [degrees] under a name."""
        self.angles.setdefault(name, []).append(values)

    @staticmethod
    def roots(tall: sp.Figure, motion: sp.Motion, small: sp.Figure) -> Array:
        """(F, 4, 3) limb roots of the small figure over its pelvis [m]."""
        return carry_trunk(motion, tall, small).positions[:, [*small.roles.shoulder, *small.roles.hip]]

    @staticmethod
    def solve(figure: sp.Figure, points: sp.Targets, rotations: tuple[str, ...] = ()) -> Array:
        """Joint angles of a body solved for points."""
        return joint_angles(figure, sp.SequentialIKPlus(figure, rotations=rotations).solve_motion(points))

    def show(self) -> None:
        """Print a row for each measure."""
        for name, values in self.angles.items():
            v = np.concatenate(values)
            within = 100 * np.mean(v <= 3.0)
            print(f"  {name:26} {v.mean():6.2f} {within:7.2f} % {np.percentile(v, 95):7.2f} {v.max():7.1f}")
        for name, values in self.residuals.items():
            v = np.concatenate(values)
            if len(v):
                share = 100 * np.mean(v < 1.0)
                print(
                    f"  contacts, {name:16} {share:6.2f} %  {np.percentile(v, 99):6.3f} {v.max():7.2f}"
                    f"   of {len(v)} standing ankles"
                )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--data", type=Path, default=DATA, help="folder of recordings")
    parser.add_argument("--people", default=PEOPLE, help="of the CMU database")
    args = parser.parse_args()
    groups: dict[str, Measures] = {}
    for group, _, motion in clips(args.data, args.people.split(",")):
        groups.setdefault(group, Measures()).add(motion)
    for group, measures in groups.items():
        print(group)
        measures.show()


if __name__ == "__main__":
    main()
