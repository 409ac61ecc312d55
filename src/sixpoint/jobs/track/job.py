"""Follow the markers of a recording and write the motion."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.dofs import Dofs
from sixpoint.body.joint_angles import compute_joint_angles
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.markers.recording import Markers
from sixpoint.body.motion import FileSpace
from sixpoint.body.targets import Targets
from sixpoint.errors import SixpointError
from sixpoint.formats import ANGLE_SUFFIXES, OUTPUT_SUFFIXES, save, save_angles
from sixpoint.jobs.driving import AVATAR_OUTPUTS, drive, open_avatar
from sixpoint.jobs.marker_models import save_marker_model
from sixpoint.jobs.progress import Progress, silent
from sixpoint.jobs.reading import Reading, open_markers
from sixpoint.jobs.solving import Solved, Solving, solve
from sixpoint.jobs.track.feet import TIGHT, hold_feet
from sixpoint.jobs.track.models import columns_of, find_model, find_ranges
from sixpoint.jobs.track.options import Following
from sixpoint.jobs.track.six import reduce_to_six
from sixpoint.jobs.writing import check_output, keep_sources, prepare_folder, save_dressed
from sixpoint.signals.low_pass import low_pass
from sixpoint.solvers.tracking.solver import MarkerTracker, TrackedMotion

Array = NDArray[np.float64]

OUTPUTS = (*OUTPUT_SUFFIXES, *ANGLE_SUFFIXES)


@dataclass(frozen=True, eq=False)
class Tracking:
    """What came out.

    Attributes:
        markers: The recording.
        model: Who moved.
        positions: (F, M, 3) markers of the model, as they were followed [m]; NaN in gaps.
        tracked: Postures, residuals and what became of each marker.
        seconds: Time of following, per second of the recording.
        calibration: Time of the calibration [s].
        stances: (F, 2) frames in which a foot was held; None: not asked for.
        six: The six points, how they were solved, and which of them the followed body gave; None: not asked.
        widened: Name of a joint -> by how much its limits had to be widened [rad].
        files: What was written.
        avatar: Who was posed as the person, if anybody, and how.
    """

    markers: Markers
    model: MarkerModel
    positions: Array
    tracked: TrackedMotion
    seconds: float
    calibration: float
    stances: NDArray[np.bool_] | None
    six: tuple[Targets, Solved, tuple[str, ...]] | None
    widened: dict[str, float]
    files: list[Path]
    avatar: tuple[Targets, Solved] | None = None


def track(
    source: Path,
    out: Path | None = None,
    *,
    reading: Reading | None = None,
    following: Following | None = None,
    six: Solving | None = None,
    avatar: Path | None = None,
    picture: Path | None = None,
    report: Path | None = None,
    save_model: Path | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Tracking:
    """Follow the markers of a recording with a figure that is calibrated on it.

    Args:
        source: A .c3d, .trc, .csv, .json or .npz of labelled markers.
        out: A motion (.bvh, .amc with its .asf, .glb, .vrma, USD), or joint angles as .mot or .csv; by
            default ``<stem>_tracked.bvh`` here.
        reading: How to read the source.
        following: How to follow.
        six: Reduce the markers to six points and pose the figure by these, with this method.
        avatar: A .glb, .gltf or .vrm that is posed as the person is, and written instead.
        picture: A .png that shows the body and the markers at some frames.
        report: A folder for a report with residuals of every marker, as HTML and Markdown.
        save_model: A .toml for the calibrated person, to be used again as ``Following.model``.
        force: Overwrite existing files.
        progress: Told how far the work is.

    Raises:
        SixpointError: The message says why. Nothing was written, but for a report or picture that failed.
    """
    reading, following = reading or Reading(), following or Following()
    following.check()
    if six is not None:
        six.check()
    if avatar is not None:
        out = out or Path(f"{source.stem}_{avatar.stem}.glb")
        files = check_output(out, AVATAR_OUTPUTS, force, "an avatar is written as one of these")
    else:
        out = out or Path(f"{source.stem}_{'six' if six else 'tracked'}.bvh")
        files = check_output(out, OUTPUTS, force)
    files += check_output(picture, (".png",), force) if picture else []
    files += check_output(save_model, (".toml",), force) if save_model else []
    if report:
        prepare_folder(report, force)
    keep_sources(files, [source, *following.files, avatar])
    hero = None if avatar is None else open_avatar(avatar)
    markers = open_markers(source, reading)
    started = time.perf_counter()
    model = find_model(markers, following, progress)
    calibration = 0.0 if following.model else time.perf_counter() - started
    if save_model:
        save_marker_model(model, save_model, force=force)
    positions = columns_of(model, markers)
    if following.cutoff is not None:
        positions = low_pass(positions, markers.rate, following.cutoff).positions
    MarkerTracker(model).warm_up()
    started = time.perf_counter()
    dofs, widened = find_ranges(model, positions, markers.rate, following, progress)
    spent = (time.perf_counter() - started) / len(positions) * markers.rate
    tracked, seconds = follow(model, positions, markers, following.limits, progress, dofs=dofs)
    seconds += spent
    stances = None
    if following.lock_feet:
        held, stances = hold_feet(model, tracked.motion, positions)
        tracked, more = follow(model, held, markers, following.limits, progress, dofs=dofs, tight=True)
        seconds += more
    motion, reduced = tracked.motion, None
    if six is not None:
        believed = np.where((tracked.flags == 0)[..., None], positions, np.nan)
        targets, borrowed = reduce_to_six(model, believed, tracked.motion, markers.rate, source.stem)
        solved = solve(model.figure, targets, six, progress)
        motion, reduced = solved.solution.motion, (targets, solved, borrowed)
    motion = replace(motion, name=out.stem, space=replace(FileSpace(), unit=0.01))
    driven = None
    if hero is not None:
        driven = drive(hero.figure, motion, model.figure, solving=six, progress=progress)
        result = replace(driven[1].solution.motion, name=out.stem)
        save(result, out, force=force, avatar=None if out.suffix.lower() == ".bvh" else hero)
    elif out.suffix.lower() in ANGLE_SUFFIXES:
        save_angles(compute_joint_angles(motion, model.figure), out, force)
    else:
        save_dressed(model.figure, motion, out, force)
    done = Tracking(
        markers, model, positions, tracked, seconds, calibration, stances, reduced, widened, files, driven
    )
    if picture or report:
        from sixpoint.jobs.track.report import write_picture, write_report  # Matplotlib is slow to import

        if picture:
            write_picture(done, picture)
        if report:
            done = replace(done, files=[*files, *write_report(done, report, force)])
    return done


def follow(
    model: MarkerModel,
    positions: Array,
    markers: Markers,
    limits: bool = True,
    progress: Progress = silent,
    *,
    dofs: Dofs | None = None,
    tight: bool = False,
) -> tuple[TrackedMotion, float]:
    """Follow positions (F, M, 3) [m] of a model's markers; kernels are compiled before the clock starts.

    ``dofs`` says what may move and how far, ``tight`` holds feet where their markers are.

    Returns:
        The motion, and the time that a second of it took [s].

    Raises:
        SixpointError: No frame has three markers.
    """
    if int(np.isfinite(positions[..., 0]).sum(axis=1).max()) < 3:
        raise SixpointError(f"{markers.name}: no frame has three of the model's markers, which a body needs")
    tracker = MarkerTracker(model, limits=limits, tolerances=TIGHT if tight else None, dofs=dofs)
    tracker.warm_up()
    start = time.perf_counter()
    total = 2 * len(positions)
    tracked = tracker.solve_frames(
        positions, markers.rate, progress=lambda done: progress("following", done, total), name=markers.name
    )
    progress("following", total, total)
    return tracked, (time.perf_counter() - start) / len(positions) * markers.rate
