"""What can be looked at: recordings, six points of their own, or just a figure that stands there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.limits import Limits
from sixpoint.body.motion import Motion
from sixpoint.body.targets import Targets
from sixpoint.errors import FormatError, SixpointError, listed
from sixpoint.formats import MOTION_SUFFIXES
from sixpoint.jobs.reading import Reading, is_targets, open_motion, open_targets
from sixpoint.jobs.reconstruct import STATURE, Body
from sixpoint.samples import SAMPLES, make_sample

Array = NDArray[np.float64]

STANDING = "standing"
FREE_RATE = 60.0
NEAR = 0.7  # from the beginning [m]


@dataclass(frozen=True, eq=False)
class Clip:
    """Six points over time, and whose they are.

    Attributes:
        name: The file's or sample's.
        figure: Who is posed.
        targets: The six points; of a figure that just stands there one frame.
        truth: The recording they were taken from, if any.
    """

    name: str
    figure: Figure
    targets: Targets
    truth: Motion | None = None


def stand(figure: Figure, name: str = STANDING) -> Clip:
    """A figure on the floor, arms hanging, ready to be dragged."""
    pose = figure.neutral_pose
    sites = figure.skeleton.compute_sites(*pose.compute_transforms())
    lowest = min(pose.compute_transforms()[0][:, 1].min(), *(sites[:, 1] if len(sites) else [np.inf]))
    lift = -np.array([[0.0, lowest, 0.0]])
    _, translations = figure.place_pelvis(pose.rotations[None], lift)
    motion = Motion(figure.skeleton, pose.rotations[None], translations, FREE_RATE, pose.moving, name=name)
    return Clip(name, figure, figure.targets(motion))


def sample_clips(names: Sequence[str] = (), stature: float = STATURE) -> list[Clip]:
    """Built-in motions; all by default.

    Raises:
        SixpointError: There is no such motion.
    """
    figure = Figure.from_stature(stature)
    return [_of_motion(make_sample(name, figure), figure, name) for name in dict.fromkeys(names or SAMPLES)]


def open_clips(
    files: Sequence[Path],
    *,
    reading: Reading | None = None,
    body: Body | None = None,
    limits: Limits | None = None,
) -> list[Clip]:
    """Read files; without any, the figure that ``body`` names stands there.

    Args:
        files: Motions, and six points.
        reading: How to read them.
        body: Whom to pose: a rig and a stature count for six points and where there is no file.
        limits: Joint limits; the shipped table by default.

    Raises:
        SixpointError: A file cannot be read, or has no figure.
    """
    reading, body = reading or Reading(), body or Body()
    if not files:
        return [stand(_free_figure(body, reading, limits))]
    clips: list[Clip] = []
    for path in files:
        if is_targets(path):
            targets = open_targets(path, replace(reading, unit=None, up=None) if body.rig else reading)
            clip = Clip(path.name, _free_figure(body, reading, limits), targets)
        else:
            opened = open_motion(path, replace(reading, skeleton=body.rig))
            figure = opened.find_figure(body.mapping, limits)
            clip = _of_motion(opened.motion, figure, path.name)
        again = sum(clip.name == other.name for other in clips)
        clips.append(replace(clip, name=str(path)) if again else clip)
    return clips


def _of_motion(motion: Motion, figure: Figure, name: str) -> Clip:
    return Clip(name, figure, figure.targets(motion), motion)


def _free_figure(body: Body, reading: Reading, limits: Limits | None) -> Figure:
    if body.rig is None:
        return Figure.from_stature(STATURE if body.stature is None else body.stature, limits)
    if body.stature is not None:
        raise SixpointError("--skeleton and --stature exclude each other")
    if body.rig.suffix.lower() not in MOTION_SUFFIXES:
        raise FormatError(body.rig, f"a rig is one of {listed(MOTION_SUFFIXES)}")
    opened = open_motion(body.rig, Reading(unit=reading.unit, up=reading.up))
    return opened.find_figure(body.mapping, limits)


def known_rotations(clip: Clip, frame: int) -> Array:
    """(6, 4) rotations of the effectors in a frame; the identity where unknown."""
    if clip.targets.rotations is None:
        return np.tile(rot.IDENTITY, (6, 1))
    turned = clip.targets.rotations[frame].copy()
    turned[~np.all(np.isfinite(turned), axis=1)] = rot.IDENTITY
    return turned


def find_middle(clip: Clip) -> Array:
    """(3,) where to look: the middle of the pelvis' way, if that is near its beginning [m]."""
    pelvis = clip.targets.positions[:, 0]
    known = pelvis[np.all(np.isfinite(pelvis), axis=1)]
    if not len(known):
        return np.array([0.0, 1.0, 0.0])
    return np.asarray(known[0] + np.clip(known.mean(axis=0) - known[0], -NEAR, NEAR))
