"""Avatars that move as somebody else did: six points, retargeted and posed on the avatar's bones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sixpoint.body.figure import Figure
from sixpoint.body.limits import Limits
from sixpoint.body.motion import Motion
from sixpoint.body.retargeting import Mode, carry_points, carry_pose
from sixpoint.body.soles import ankle_height, find_floor
from sixpoint.body.spine_chain import SpineChain
from sixpoint.body.targets import EFFECTORS, Targets
from sixpoint.errors import FormatError, SixpointError, listed
from sixpoint.formats import GLTF_SUFFIXES, Avatar, load_avatar
from sixpoint.formats.suffixes import with_path
from sixpoint.jobs.progress import Progress, silent
from sixpoint.jobs.retarget import find_posture
from sixpoint.jobs.solving import Solved, Solving, solve
from sixpoint.live.feet import Floor, level_feet

SAME = 1e-3
"""Part of a body's height within which bones are the same."""
NEAR = 0.1
"""Part of a body's height within which soles that stand are on the floor at zero."""
AVATAR_OUTPUTS = (".glb", ".vrma", ".bvh")
AVATARS = tuple(suffix for suffix in GLTF_SUFFIXES if suffix != ".vrma")


def open_avatar(path: Path, mapping: Path | None = None, limits: Limits | None = None) -> Avatar:
    """Read an avatar.

    Args:
        path: A .glb, .gltf or .vrm.
        mapping: A TOML table role -> joint name, for unusual bones.
        limits: Joint limits; the shipped table by default.

    Raises:
        FormatError: It is no such file, or holds no human.
    """
    if path.suffix.lower() not in AVATARS:
        raise FormatError(path, f"an avatar is one of {listed(AVATARS)}")
    avatar = load_avatar(path, mapping, limits)
    try:
        SpineChain.from_figure(avatar.figure)
    except SixpointError as error:
        raise with_path(path, error) from None
    return avatar


def is_on(motion: Motion, figure: Figure) -> bool:
    """Whether a motion is on a figure's own skeleton, so that nothing has to be solved.

    Names alone do not tell: bodies of other proportions share them.
    """
    ours, other = figure.skeleton, motion.skeleton
    if other.names != ours.names or not np.array_equal(other.parents, ours.parents):
        return False
    return bool(np.abs(other.offsets[1:] - ours.offsets[1:]).max(initial=0.0) < SAME * figure.height)


def drive(
    figure: Figure,
    recording: Motion | Targets,
    source: Figure | float | None = None,
    *,
    mode: Mode = "relative",
    solving: Solving | None = None,
    progress: Progress = silent,
) -> tuple[Targets, Solved]:
    """Pose a figure as another body was, on its soles: flat where nothing turns a foot, toes above the floor.

    The six points lead. A method that can do so starts from the posture as it was, and turns pelvis, head,
    hands and feet as a motion has them; with ``solving.rotations`` only those that are named there.

    Args:
        figure: Whom to pose.
        recording: A motion, or six points.
        source: Whose: a figure, or a stature [m] for six points; None: found from the recording.
        mode: "relative" keeps the pose, "absolute" what hands and feet touch.
        solving: Method and options.
        progress: Told how far the work is.

    Returns:
        The six points for the figure, and its postures.

    Raises:
        SixpointError: The recording's body cannot be found, or an option is unknown.
    """
    points, posed, owner = find_posture(recording, source)
    targets, pose = carry_points(points, posed, owner, figure, mode), carry_pose(posed, owner, figure)
    solving = solving or Solving()
    if isinstance(recording, Motion) and not solving.rotations and solving.takes("rotations"):
        solving = replace(solving, rotations=EFFECTORS)
    solved = solve(figure, targets, solving, progress, start=pose)
    measured = () if targets.rotations is None else solving.rotations
    level = _level(figure, solved.solution.motion, ("l_ankle" not in measured, "r_ankle" not in measured))
    return targets, replace(solved, solution=replace(solved.solution, motion=level))


def _level(figure: Figure, motion: Motion, free: tuple[bool, bool]) -> Motion:
    """A motion whose feet are on the floor, not in it, if it is a motion on a floor."""
    height = find_floor(figure, motion)
    if abs(height) > NEAR * figure.height:
        return motion
    floor = replace(Floor.under(figure, height), ankle=ankle_height(figure))
    poses = (level_feet(figure, motion.pose(k), floor, free=free, clear=True) for k in range(len(motion)))
    return replace(motion, rotations=np.array([pose.rotations for pose in poses]))
