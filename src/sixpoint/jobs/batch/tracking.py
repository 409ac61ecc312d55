"""The job ``track`` of a batch: markers to a whole body."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sixpoint.body.figure import Figure
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.markers.roles import SHIPPED_LAYOUTS
from sixpoint.errors import SixpointError
from sixpoint.jobs.batch.registry import refuse
from sixpoint.jobs.reading import ALL, Reading, parse_frames
from sixpoint.jobs.solving import Solving
from sixpoint.jobs.track.job import track
from sixpoint.jobs.track.options import Following, parse_labels, parse_six
from sixpoint.solvers.tracking.solver import LOST, REJECTED, SWAPPED, MarkerTracker
from sixpoint.study.tracking import overall

READING = ("unit", "up", "rate")
REFUSED = {
    "avatar": "it writes motions and joint angles; for an avatar: sixpoint track, file by file",
    "save_model": "every file has a person of its own; calibrate one by sixpoint track, then give --model",
    "picture": "it is of one file; the residuals of all are in summary.csv",
    "report": "it is of one file; the residuals of all are in summary.csv",
    "live": "a replay is of one file: sixpoint track",
    "view": "a replay is of one file: sixpoint track",
}


def run_one(source: Path, out: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Follow the markers of a file.

    Args:
        source: Labelled markers.
        out: The .bvh or .amc to write.
        options: Of ``sixpoint track``.

    Returns:
        Frames and rate [Hz], markers followed, root mean square residual [m], shares of samples that were
        seen, refused and exchanged, parts without markers, the files.
    """
    frames = options.get("frames")
    reading = Reading(
        **{name: options[name] for name in READING if name in options},
        frames=ALL if frames is None else parse_frames(frames),
    )
    done = track(source, out, reading=reading, following=_following(options), six=_six(options), force=True)
    flags = done.tracked.flags
    return {
        "frames": len(done.markers),
        "rate": done.markers.rate,
        "markers": len(done.model.names),
        "residual": overall(done.tracked.residual, flags),
        "seen": float(np.mean(flags != LOST)),
        "refused": float(np.mean(flags == REJECTED)),
        "swapped": float(np.mean(flags == SWAPPED)),
        "missing": " ".join(done.model.missing),
        "files": done.files,
    }


def check(options: Mapping[str, Any]) -> None:
    """Refuse options that a batch does not heed or that do not go together, and files that are not there.

    Raises:
        SixpointError: The message says which.
    """
    refuse(options, REFUSED)
    _following(options).check()
    six = _six(options)
    if six is not None:
        six.check()
    for name in ("model", "static", "layout", "limits"):
        path = options.get(name)
        if path is None or (name == "layout" and path in SHIPPED_LAYOUTS):
            continue
        if not Path(path).is_file():
            raise SixpointError(f"--{name} {path}: there is no such file")


def warm_up(options: Mapping[str, Any]) -> None:
    """Compile the tracker's kernels, on three markers of the pelvis."""
    offsets = np.array([(0.1, 0.0, 0.1), (-0.1, 0.0, 0.1), (0.0, 0.0, -0.1)])
    joints, spread = np.zeros(3, np.int64), np.full(3, 0.01)
    model = MarkerModel(Figure.from_stature(), ("a", "b", "c"), joints, offsets, spread)
    MarkerTracker(model, limits=not options.get("no_limits", False)).warm_up()


def _following(options: Mapping[str, Any]) -> Following:
    labels = options.get("markers")
    return Following(
        model=options.get("model"),
        static=options.get("static"),
        layout=options.get("layout"),
        markers=() if labels is None else parse_labels(labels),
        limits=not options.get("no_limits", False),
        limits_file=options.get("limits"),
        cutoff=options.get("cutoff"),
        lock_feet=bool(options.get("lock_feet")),
    )


def _six(options: Mapping[str, Any]) -> Solving | None:
    return parse_six(bool(options.get("six")), options.get("method"), bool(options.get("no_limits")))
