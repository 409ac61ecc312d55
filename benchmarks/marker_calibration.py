"""How well does a person's model follow from labelled markers alone?

1. Known people: 41 and 24 misplaced markers on the built-in motions, with skin that slides: errors of joints
   when the found figure is posed by its markers, of lengths, and residuals.
2. A take that exists as markers (C3D) and as a skeleton (AMC), where there is one: distances of joints after
   one rigid alignment of the two worlds; what of them is constant in the segment is another idea of where a
   joint is, or a wrong length.
3. Files with joint centres of their own: how far ours are from these, which the calibration does not see.
4. All marker files: residuals, stature, time.

    python benchmarks/marker_calibration.py [--data FOLDER] [--seeds 4]
"""

from __future__ import annotations

import argparse
import time
import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
from takes import compare_take, find_lag

import sixpoint as sp
from sixpoint.body import rotations as rot
from sixpoint.body.anthropometry import segments_of_stature
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.markers.recording import Markers
from sixpoint.body.markers.roles import find_marker_roles
from sixpoint.calibration.markers import calibrate_markers
from sixpoint.calibration.markers.kinematics import SEGMENTS, Kinematics
from sixpoint.calibration.markers.places import place_markers
from sixpoint.calibration.markers.posing import pose_markers
from sixpoint.calibration.model import stature_of
from sixpoint.formats import load
from sixpoint.formats.markers import load_markers
from sixpoint.samples import SAMPLES
from sixpoint.samples.range_of_motion import range_of_motion

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
CMU41 = (
    "LFHD RFHD LBHD RBHD C7 T10 CLAV STRN RBAC LSHO LUPA LELB LFRM LWRA LWRB LFIN RSHO RUPA RELB RFRM RWRA "
    "RWRB RFIN LFWT RFWT LBWT RBWT LTHI LKNE LSHN LANK LHEE LTOE LMT5 RTHI RKNE RSHN RANK RHEE RTOE RMT5"
)
NOISE, SKIN = 0.001, 0.015  # of each sample [m]; how far skin slides per radian of its joints [m]
FAR = 0.1  # samples farther from their places are labels in error, and counted [m]
STATIC = {"opensim_subject01_walk.trc": "opensim_subject01_static.trc"}


def wear(motion_of, labels: list[str], seed: int) -> tuple[Markers, sp.Motion, sp.Figure]:
    """Markers on a person whose lengths vary by 5 %, misplaced by what anatomy leaves open."""
    rng, kinematics = np.random.default_rng(seed), Kinematics()
    stature = rng.uniform(1.55, 1.95)
    segments = {k: v * float(np.exp(0.05 * rng.normal())) for k, v in segments_of_stature(stature).items()}
    figure = sp.Figure.from_segments(**segments)
    motion = motion_of(figure)
    roles = find_marker_roles(CMU41.split())
    places = place_markers(roles, stature, kinematics)
    lengths = np.array([segments[name] for name in SEGMENTS])
    off = places.offsets + rng.normal(size=places.std.shape) * np.minimum(places.std, 0.03)
    model = MarkerModel(
        figure, places.names, places.carriers, off + places.reach @ lengths, np.zeros(len(off))
    )
    positions, world = motion.transforms
    points = model.place(positions, world)
    for k, joint in enumerate(model.joints):
        below = motion.skeleton.children[joint][:1]
        angles = motion.rotations[:, [joint, *below], :3].reshape(len(motion), -1) * 2.0
        slide = rng.normal(size=(3, angles.shape[1])) * SKIN / np.sqrt(3.0)
        points[:, k] += rot.mul_vec(world[:, joint], angles @ slide.T)
    points += NOISE * rng.normal(size=points.shape)
    return Markers(places.names, points, motion.rate).selected(labels), motion, figure


def measure_known(seeds: int) -> None:
    """Print one row per motion and set of markers."""
    print("motion           markers  joints cm  worst joint cm   lengths cm  residual cm  seconds")
    layout = find_marker_roles(CMU41.split(), "markers24")
    for name, motion_of in {"range_of_motion": range_of_motion, **SAMPLES}.items():
        for labels in (CMU41.split(), list(layout.roles)):
            rows = []
            for seed in range(seeds):
                markers, motion, figure = wear(motion_of, labels, seed)
                start = time.perf_counter()
                found = calibrate_markers(markers)
                took = time.perf_counter() - start
                posed = pose_markers(found, markers.sliced(slice(None, None, 4)))
                rows.append([*known_errors(posed, motion, figure, found), 100 * posed.rms, took])
            joints, worst, lengths, rms, took = np.mean(rows, axis=0)
            print(
                f"{name:16} {len(labels):7} {joints:10.2f} {worst:15.2f} {lengths:12.2f} {rms:12.2f} "
                f"{took:8.1f}"
            )


def known_errors(posed, motion: sp.Motion, figure: sp.Figure, found: MarkerModel) -> list[float]:
    """Mean and worst of joints, and the mean of the limbs' lengths [cm]."""
    r = figure.roles
    joints = [r.pelvis, *r.spine, *r.hip, *r.knee, *r.ankle, *r.shoulder, *r.elbow, *r.wrist]
    apart = np.linalg.norm(posed.motion.positions - motion.positions[::4], axis=2)[:, joints]
    pairs = [(a, b) for limb in r.limbs for a, b in pairwise(limb)]
    lengths = [[np.linalg.norm(f.offset_between(a, b)) for a, b in pairs] for f in (found.figure, figure)]
    off = np.abs(np.subtract(*lengths)).mean()
    return [100 * apart.mean(), 100 * apart.mean(axis=0).max(), 100 * off]


def measure_take(markers: Markers, motion: sp.Motion) -> None:
    """Print distances between a take's AMC and the figure that follows from its markers."""
    for title, layout in (("all", None), ("24", "markers24")):
        labels = list(find_marker_roles(markers.names, layout).roles)
        some = markers if layout is None else markers.selected(labels)
        posed = pose_markers(calibrate_markers(some), some)
        apart = compare_take(posed.motion, motion)
        print(
            f"{markers.name}, {title} markers: joints {100 * apart.mean:.2f} cm, residual "
            f"{100 * posed.rms:.2f} cm; the AMC is {find_lag(posed.motion, motion)} frames late, the worlds' "
            f"verticals {apart.turned:.1f} deg apart"
        )
        print("    joint          mean cm   constant: left, up, forward   varying")
        for k, name in enumerate(apart.names):
            left, up, front = 100 * apart.constant[k]
            print(
                f"    {name:14} {100 * apart.distance[:, k].mean():6.1f} {left:14.1f} {up:6.1f} {front:6.1f} "
                f"{100 * apart.varying[k]:14.1f}"
            )


def measure_centres(path: Path) -> None:
    """Print how far joints are from the centres in a file, which the calibration does not see."""
    markers = load_markers(path)
    roles = find_marker_roles(markers.names).roles
    centres = {role: label for label, role in roles.items() if role.endswith("_centre") and role[1] == "_"}
    if not centres:
        return
    models = ("_centre", "_centre_regression")
    skin = markers.selected([name for name in markers.names if not roles.get(name, "").endswith(models)])
    posed = pose_markers(calibrate_markers(skin), skin)
    skeleton, row = posed.motion.skeleton, []
    for role, label in centres.items():
        ours = posed.motion.positions[:, skeleton.index(role.removesuffix("_centre"))]
        apart = np.linalg.norm(ours - markers.positions[:, markers.index(label)], axis=1)
        row.append(f"{role.removesuffix('_centre')} {100 * np.nanmean(apart):.1f}")
    print(f"{path.name:46} {', '.join(row)}")


def marker_files(data: Path) -> list[Path]:
    """All recordings of markers."""
    return sorted([*(data / "c3d").glob("*.c3d"), *(data / "trc").glob("*.trc")])


def measure_files(data: Path) -> None:
    """Print one row per marker file."""
    print(
        "file                                          markers  residual cm  samples far  worst marker cm"
        "     stature m  seconds  missing"
    )
    for path in marker_files(data):
        try:
            markers = load_markers(path)
            still = path.parent / STATIC.get(path.name, "-")
            static = load_markers(still) if still.exists() else None
            start = time.perf_counter()
            found = calibrate_markers(markers, static)
            took = time.perf_counter() - start
            posed = pose_markers(found, markers.sliced(slice(None, None, 4)))
        except sp.SixpointError as error:
            print(f"{path.name:32} {error}")
            continue
        far = posed.residuals > FAR
        near = np.where(far, np.nan, posed.residuals)
        per_marker = np.sqrt(np.nanmean(near**2, axis=0))
        worst = int(np.nanargmax(per_marker))
        print(
            f"{path.name:46} {len(found.names):6} {100 * np.sqrt(np.nanmean(near**2)):12.2f} {far.sum():8} "
            f"{100 * per_marker[worst]:8.2f} {found.names[worst]:18} {stature_of(found.figure):10.2f} "
            f"{took:8.1f}  {', '.join(found.missing)}"
        )


def main() -> None:
    """Measure what there is data for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--seeds", type=int, default=4)
    given = parser.parse_args()
    measure_known(given.seeds)
    warnings.simplefilter("ignore")
    for path in sorted((given.data / "c3d").glob("*.c3d")):
        take = given.data / "cmu" / f"{path.stem}.amc"
        if take.exists():
            measure_take(load_markers(path), load(take))
    for path in marker_files(given.data):
        measure_centres(path)
    if given.data.is_dir():
        measure_files(given.data)
    else:
        print(f"no recordings in {given.data}")


if __name__ == "__main__":
    main()
