"""Motions, targets, figures and errors in words and numbers, for the screen."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.anthropometry import MEAN_STATURE, build_skeleton
from sixpoint.body.figure import Figure
from sixpoint.body.joint_angles import JointAngles
from sixpoint.body.markers.recording import Markers
from sixpoint.body.motion import FileSpace, Motion
from sixpoint.body.skeleton import Skeleton
from sixpoint.body.targets import EFFECTORS, Targets
from sixpoint.errors import listed
from sixpoint.jobs.info import MotionInfo
from sixpoint.jobs.reading import Opened
from sixpoint.jobs.solving import Solved
from sixpoint.solvers.avoidance.penetration import describe_penetration
from sixpoint.solvers.base import Status
from sixpoint.study.metrics import Errors

Row = tuple[str, str]

_UNITS = {1.0: "m", 0.01: "cm", 0.001: "mm", 0.0254: "inch", 0.0254 / 0.45: "cmu"}
_SOURCES = {"guessed": "guessed", "file": "from the file", "given": "given", "convention": "by convention"}


def describe_length(frames: int, rate: float) -> str:
    """Frames, rate and duration."""
    return f"{plural(frames, 'frame')} at {rate:g} Hz, {frames / rate:.2f} s"


def describe_space(space: FileSpace) -> list[Row]:
    """Unit and up axis of a file, and how they are known."""
    name = next((n for u, n in _UNITS.items() if math.isclose(u, space.unit, rel_tol=1e-6)), "")
    unit = f"{name} ({space.unit:.6g} m)" if name not in ("", "m") else f"{space.unit:.6g} m"
    guess = " (--unit to change)" if space.unit_source == "guessed" else ""
    up = " (--up to change)" if space.up_source == "guessed" else ""
    return [
        ("unit", f"{unit}, {_SOURCES.get(space.unit_source, space.unit_source)}{guess}"),
        ("up axis", f"{space.up}, {_SOURCES.get(space.up_source, space.up_source)}{up}"),
    ]


def describe_skeleton_file(opened: Opened) -> list[Row]:
    """The ASF that was used, if any."""
    if opened.skeleton is None:
        return []
    return [("skeleton", f"{opened.skeleton}, {'found beside the file' if opened.searched else 'given'}")]


def describe_figure(figure: Figure) -> list[Row]:
    """How the anatomy of a rig was found and what it is like."""
    r = figure.roles
    names = figure.skeleton.names
    head = f"{'the end site of' if any(r.head_offset) else 'the joint'} {names[r.head]}"
    clavicles = "with clavicles" if r.clavicle else "without clavicles"
    return [
        ("roles", f"found by {r.found_by}; head is {head}; {clavicles}"),
        ("spine", f"{plural(len(r.spine), 'joint')}: {' '.join(names[j] for j in r.spine)}"),
        ("height", f"{figure.height:.3f} m (calf + thigh + pelvis + torso + neck)"),
    ]


def find_stature(figure: Figure) -> float:
    """Stature of a built-in figure [m]: by how high its head is, beside that of mean proportions."""

    def find_top(skeleton: Skeleton) -> float:
        still = np.broadcast_to(np.array([0.0, 0.0, 0.0, 1.0]), (len(skeleton), 4))
        return float(skeleton.compute_sites(*skeleton.compute_transforms(still))[:, 1].max())

    return MEAN_STATURE * find_top(figure.skeleton) / find_top(build_skeleton())


def describe_avatar(found: MotionInfo) -> list[Row]:
    """What a character is made of; nothing for other files."""
    avatar = found.avatar
    if avatar is None:
        return []
    shape, humanoid = avatar.figure.shape, avatar.humanoid
    mesh = "none"
    if shape is not None:
        count = plural(len(avatar.pieces), "primitive")
        mesh = f"{count}, {len(shape.vertices)} vertices, {len(shape.triangles)} triangles"
    rows = [("kind", avatar.kind), ("mesh", mesh)]
    if humanoid is not None:
        rows.append(("humanoid", f"{plural(len(humanoid.bones), 'bone')} mapped"))
    names = avatar.animations
    shown = f"{len(names)}: {listed(names, 8)}; the first is read" if names else "none: the pose of the nodes"
    rows.append(("animations", shown))
    return rows


def describe_errors(errors: Errors) -> list[Row]:
    """How far the result is from the recording."""
    mean, degrees = 100 * errors.distances.mean(), math.degrees(errors.orientation)
    joints = plural(len(errors.joints), "joint")
    return [
        ("position error", f"{errors.position:.4f} of the height; {mean:.2f} cm mean of {joints}"),
        ("orientation error", f"{errors.orientation:.3f} rad ({degrees:.1f} deg)"),
    ]


def describe_solved(solved: Solved, targets: Targets) -> list[Row]:
    """How the six points were met."""
    residual = solved.solution.residual
    lost = ~targets.tracked
    met = "nothing tracked"
    if not lost.all():
        frame, effector = np.unravel_index(int(residual.argmax()), residual.shape)
        worst = f"{100 * residual.max():.2f} cm ({EFFECTORS[effector]}, frame {frame})"
        met = f"worst {worst}; mean {100 * residual[~lost].mean():.3f} cm"
    rows = [("effectors", met), ("frames", frames_met(solved))]
    if lost.any():
        rows.append(("lost points", _shares(lost)))
    if solved.inside:
        rows.append(
            ("inside", "; ".join(describe_penetration(solved.inside)) + " (by outlines wider than flesh)")
        )
    return [*rows, ("speed", f"{microseconds(solved)} us per frame")]


def frames_met(solved: Solved) -> str:
    """How many frames ended in which status."""
    count = solved.solution.count
    reached, missed, lost = (count(s) for s in (Status.CONVERGED, Status.UNREACHABLE, Status.LOST))
    text = f"{reached} reached"
    if missed:
        text += f", {missed} not reached (beyond the body's reach or limits, or the method stopped before)"
    if lost:
        text += f", {lost} with lost points"
    return text


def microseconds(solved: Solved) -> str:
    """Time per frame [us]."""
    return f"{solved.seconds * 1e6:.1f}"


def describe_box(points: NDArray[np.float64]) -> str:
    """Range of points (..., 3) [m] along each axis; NaN is left out."""
    flat = points.reshape(-1, 3)
    flat = flat[np.isfinite(flat).all(axis=1)]
    if not len(flat):
        return "nothing tracked"
    pairs = zip("xyz", flat.min(axis=0), flat.max(axis=0), strict=True)
    return ", ".join(f"{axis} {low:.2f} to {high:.2f}" for axis, low, high in pairs) + " m"


def _shares(lost: NDArray[np.bool_]) -> str:
    counts = zip(EFFECTORS, lost.sum(axis=0), strict=True)
    return ", ".join(f"{name} in {plural(int(n), 'frame')}" for name, n in counts if n)


def describe_content(content: Motion | Targets | Markers | JointAngles) -> str:
    """What was converted, in two words."""
    match content:
        case Motion():
            return f"{len(content.skeleton)} joints"
        case Markers():
            return plural(len(content.names), "marker")
        case JointAngles():
            return f"{len(content.names)} joint angles and coordinates"
    return "six points"


def describe_files(files: list[Path]) -> str:
    """What was written."""
    return "wrote " + ", ".join(str(path) for path in files)


def plural(count: int, noun: str) -> str:
    """A number with its noun."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
