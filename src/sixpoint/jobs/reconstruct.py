"""Six points to a whole body: of a recording, to be compared with it, or of tracked targets.

A recording gives the points and is the truth: the result is measured against it, on the same rig. Targets
have no truth; they are posed on a rig that is given, or on the built-in figure. An avatar is posed for the
points of either, carried over to its proportions; it has no truth then.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.body.retargeting import Mode
from sixpoint.body.targets import Targets
from sixpoint.errors import FormatError, SixpointError, listed
from sixpoint.formats import MOTION_SUFFIXES, OUTPUT_SUFFIXES, Avatar, save
from sixpoint.jobs.driving import AVATAR_OUTPUTS, drive, open_avatar
from sixpoint.jobs.progress import Progress, silent
from sixpoint.jobs.reading import Opened, Reading, is_targets, open_motion, open_targets
from sixpoint.jobs.solving import Solved, Solving, solve
from sixpoint.jobs.writing import check_output, keep_sources, save_dressed
from sixpoint.study.metrics import Errors, compute_errors

STATURE = 1.75
"""Stature of the built-in figure where none is given [m]."""


@dataclass(frozen=True)
class Body:
    """Whom to pose.

    Attributes:
        rig: A motion file whose rig is posed for targets; None: the built-in figure.
        stature: Of the built-in figure [m]; None: ``STATURE``.
        mapping: A TOML table role -> joint name, for an unusual rig.
        avatar: A .glb, .gltf or .vrm to pose instead; ``stature`` then is that of whose points they are.
        avatar_mapping: As ``mapping``, for the avatar's bones.
        mode: What is kept for an avatar of other proportions: see ``jobs.retarget``.
    """

    rig: Path | None = None
    stature: float | None = None
    mapping: Path | None = None
    avatar: Path | None = None
    avatar_mapping: Path | None = None
    mode: Mode = "relative"


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """What came out.

    Attributes:
        figure: Who was posed.
        opened: The recording, or the rig of the targets; None for the built-in figure.
        targets: The six points; of an avatar those carried over to it.
        solved: Postures, status and residuals.
        errors: Against the recording; None for targets and avatars.
        files: What was written.
        avatar: Who was posed, if it is one.
    """

    figure: Figure
    opened: Opened | None
    targets: Targets
    solved: Solved
    errors: Errors | None
    files: list[Path]
    avatar: Avatar | None = None


def reconstruct(
    source: Path,
    out: Path | None = None,
    *,
    reading: Reading | None = None,
    solving: Solving | None = None,
    body: Body | None = None,
    extras: bool = False,
    picture: Path | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Reconstruction:
    """Reconstruct a motion from its six points, or pose a figure for targets.

    Args:
        source: A motion or targets.
        out: A .bvh, an .amc with its .asf beside it, a .glb, a .vrma or a USD file; by default
            ``<stem>_<method>.bvh`` here, of an avatar ``<stem>_<avatar>.glb``.
        reading: How to read the source.
        solving: Method and options.
        body: Whom to pose; for a motion only the mapping counts, the rig is its own.
        extras: Copy fingers, toes and face from the recording.
        picture: A .png that shows the result over the recording.
        force: Overwrite existing files.
        progress: Told how far the work is.

    Raises:
        SixpointError: The message says why. Nothing was written, but for a picture that could not be.
    """
    reading, solving, body = reading or Reading(), solving or Solving(), body or Body()
    solving.check()
    points_only = is_targets(source)
    _check_request(points_only, body, extras, picture)
    if body.avatar is not None:
        return _drive_avatar(source, out, reading, solving, body, force, progress)
    out = out or Path(f"{source.stem}_{solving.method}.bvh")
    files = check_output(out, OUTPUT_SUFFIXES, force, "for the six points: sixpoint convert")
    files += check_output(picture, (".png",), force) if picture else []
    if points_only:
        figure, opened, targets = _prepare_targets(source, reading, solving, body)
    else:
        figure, opened, targets = _prepare_motion(source, reading, solving, body)
    keep_sources(files, [source, body.rig, body.mapping, opened.skeleton if opened else None])
    solved = solve(figure, targets, solving, progress)
    like = opened.motion if opened else None
    truth = None if points_only else like
    result = finish(solved.solution.motion, figure, like, truth if extras else None)
    errors = compute_errors(figure, truth, result) if truth else None
    save_dressed(figure, replace(result, name=out.stem), out, force)
    if picture and truth:
        _draw(figure, truth, result, picture, solving.method)
    return Reconstruction(figure, opened, targets, solved, errors, files)


def finish(result: Motion, figure: Figure, like: Motion | None, extras: Motion | None) -> Motion:
    """A result in the file space of a recording, with that of another's fingers, toes and face.

    Args:
        result: Solved postures on the figure's rig.
        figure: Who was posed.
        like: The motion whose unit and up axis are kept when it is written.
        extras: The recording whose joints beyond wrists, ankles and head are copied.
    """
    if like is not None:
        result = replace(result, space=like.space)
    if extras is not None:
        rotations = result.rotations.copy()
        rotations[:, figure.extremities] = extras.rotations[:, figure.extremities]
        result = replace(result, rotations=rotations)
    return result


def _drive_avatar(
    source: Path,
    out: Path | None,
    reading: Reading,
    solving: Solving,
    body: Body,
    force: bool,
    progress: Progress,
) -> Reconstruction:
    assert body.avatar is not None
    out = out or Path(f"{source.stem}_{body.avatar.stem}.glb")
    files = check_output(out, AVATAR_OUTPUTS, force, "an avatar is written as one of these")
    keep_sources(files, [source, body.rig, body.mapping, body.avatar, body.avatar_mapping])
    avatar = open_avatar(body.avatar, body.avatar_mapping, solving.load_limits())
    opened = None
    if is_targets(source):
        recording: Motion | Targets = open_targets(source, reading)
        owner: Figure | float | None = body.stature
    else:
        opened = open_motion(source, replace(reading, skeleton=body.rig))
        recording, owner = opened.motion, opened.find_figure(body.mapping)
    targets, solved = drive(
        avatar.figure, recording, owner, mode=body.mode, solving=solving, progress=progress
    )
    result = replace(solved.solution.motion, name=out.stem)
    save(result, out, force=force, avatar=None if out.suffix.lower() == ".bvh" else avatar)
    return Reconstruction(avatar.figure, opened, targets, solved, None, files, avatar)


def _check_request(points_only: bool, body: Body, extras: bool, picture: Path | None) -> None:
    if body.avatar is None and (body.avatar_mapping is not None or body.mode != "relative"):
        raise SixpointError("--avatar-mapping and --retarget are for an avatar: give it with --avatar")
    if body.avatar is not None:
        if extras or picture:
            raise SixpointError("--extras and --picture are for the recording's own rig, not for an avatar")
        if points_only and (body.rig is not None or body.mapping is not None):
            raise SixpointError(
                "with --avatar six points are posed on the avatar: leave out --skeleton and --mapping"
            )
    if points_only:
        if extras:
            raise SixpointError("--extras copies from a recording; targets hold six points only")
        if picture:
            raise SixpointError("--picture compares with a recording; targets have none")
        if body.rig is not None and body.stature is not None:
            raise SixpointError("--skeleton and --stature exclude each other")
    elif body.stature is not None:
        raise SixpointError("--stature is for targets; a motion is posed on its own rig")


def _prepare_motion(
    source: Path, reading: Reading, solving: Solving, body: Body
) -> tuple[Figure, Opened | None, Targets]:
    limits = solving.load_limits()
    opened = open_motion(source, replace(reading, skeleton=body.rig))
    figure = opened.find_figure(body.mapping, limits)
    return figure, opened, figure.targets(opened.motion)


def _prepare_targets(
    source: Path, reading: Reading, solving: Solving, body: Body
) -> tuple[Figure, Opened | None, Targets]:
    limits = solving.load_limits()
    targets = open_targets(source, replace(reading, unit=None, up=None) if body.rig else reading)
    if body.rig is None:
        if body.mapping is not None:
            raise SixpointError("--mapping names joints of a rig: give the rig with --skeleton")
        return Figure.from_stature(STATURE if body.stature is None else body.stature, limits), None, targets
    if body.rig.suffix.lower() not in MOTION_SUFFIXES:
        raise FormatError(body.rig, f"the rig of targets is one of {listed(MOTION_SUFFIXES)}")
    opened = open_motion(body.rig, Reading(unit=reading.unit, up=reading.up))
    return opened.find_figure(body.mapping, limits), opened, targets


def _draw(figure: Figure, truth: Motion, result: Motion, picture: Path, method: str) -> None:
    from sixpoint.study.plots import draw_comparison  # Matplotlib is slow to import

    draw_comparison(figure, truth, result, picture, title=f"{truth.name}: {method}")
