"""The job ``reconstruct`` of a batch: six points to a whole body, measured against the recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError
from sixpoint.jobs.batch.registry import refuse
from sixpoint.jobs.reading import ALL, Reading, parse_frames
from sixpoint.jobs.reconstruct import Body, reconstruct
from sixpoint.jobs.solving import Solving, parse_solving, solve
from sixpoint.samples import make_sample
from sixpoint.solvers.base import Status

SOLVING = ("method", "weights", "search", "rotations", "limits", "no_limits", "avoid")
READING = ("unit", "up", "rate")
BODY = ("skeleton", "stature", "mapping")
AVATAR = "a batch poses rigs and the built-in figure; for an avatar: sixpoint reconstruct, file by file"
REFUSED = {
    "avatar": AVATAR,
    "avatar_mapping": AVATAR,
    "retarget": AVATAR,
    "picture": "it is of one file; the errors of all are in summary.csv",
}


def run_one(source: Path, out: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Reconstruct a file.

    Args:
        source: A motion, or six points.
        out: The .bvh or .amc to write.
        options: Of ``sixpoint reconstruct``.

    Returns:
        Frames and rate [Hz]; of a motion the errors of Unzueta et al. 2008 (position over H, orientation
        [rad]) and the mean joint distance [m]; frames reached, missed and with lost points, the farthest
        effector [m]; the files.
    """
    extras = bool(options.get("extras")) and source.suffix.lower() in (".bvh", ".amc")
    done = reconstruct(
        source,
        out,
        reading=_reading(options),
        solving=_solving(options),
        body=_body(options, source),
        extras=extras,
        force=True,
    )
    solution, errors = done.solved.solution, done.errors
    measured: dict[str, Any] = {"frames": len(done.targets), "rate": done.targets.rate}
    if errors is not None:
        measured |= {
            "position": errors.position,
            "orientation": errors.orientation,
            "distance_m": float(errors.distances.mean()),
        }
    for name, status in (
        ("reached", Status.CONVERGED),
        ("missed", Status.UNREACHABLE),
        ("lost", Status.LOST),
    ):
        measured[name] = solution.count(status)
    return {**measured, "farthest_m": float(solution.residual.max(initial=0.0)), "files": done.files}


def check(options: Mapping[str, Any]) -> None:
    """Refuse options that a batch does not heed or that do not go together, and files that are not there.

    Raises:
        SixpointError: The message says which.
    """
    refuse(options, REFUSED)
    solving = _solving(options)
    solving.check()
    solving.load_limits()
    _reading(options)
    for name in ("skeleton", "mapping"):
        path = options.get(name)
        if path is not None and not path.is_file():
            raise SixpointError(f"--{name} {path}: there is no such file")


def warm_up(options: Mapping[str, Any]) -> None:
    """Compile the method's kernels."""
    figure = Figure.from_stature()
    solve(figure, figure.targets(make_sample("walk", figure)).sliced(slice(0, 2)), _solving(options))


def _solving(options: Mapping[str, Any]) -> Solving:
    return parse_solving(**{name: options[name] for name in SOLVING if name in options})


def _reading(options: Mapping[str, Any]) -> Reading:
    frames = options.get("frames")
    taken = ALL if frames is None else parse_frames(frames)
    return Reading(**{name: options[name] for name in READING if name in options}, frames=taken)


def _body(options: Mapping[str, Any], source: Path) -> Body:
    """Whom to pose; a stature is for six points alone, a batch may hold both."""
    rig, stature, mapping = (options.get(name) for name in BODY)
    body = Body(rig, stature, mapping)
    return replace(body, stature=None) if source.suffix.lower() in (".bvh", ".amc") else body
