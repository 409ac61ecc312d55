"""A movement and a static trial as arrays over the same markers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.markers.recording import Markers
from sixpoint.body.markers.roles import Layout, MarkerRoles, find_marker_roles
from sixpoint.errors import TargetError, listed

Array = NDArray[np.float64]

FEWEST = 3
"""Markers that a static trial and the movement have in common; fewer tell nothing of the movement's."""
SHOWN = 12  # labels in a message


def read_recordings(recordings: list[Markers], layout: Layout | None) -> tuple[MarkerRoles, list[Array]]:
    """Roles of all markers that have one and are ever seen, and (F, M, 3) of each recording in their order.

    Raises:
        TargetError: No label is known, no marker with a role is ever seen, or a static trial, the first of
            two, has other markers than the movement.
    """
    labels = list(dict.fromkeys(name for recording in recordings for name in recording.names))
    names = " and ".join(recording.name for recording in recordings)
    found = find_marker_roles(labels, layout)
    if not found.roles:
        raise TargetError(
            f"{names}: no label is of a known marker set: {listed(labels)}; "
            'name them in a layout, a TOML file with lines such as LASI = "l_asis"'
        )
    every = [_columns(recording, found.roles) for recording in recordings]
    if len(recordings) > 1:
        _check_common(recordings[0], recordings[1], found.roles)
    seen = np.any([np.isfinite(part[..., 0]).any(axis=0) for part in every], axis=0)
    if not seen.any():
        raise TargetError(f"{names}: none of the markers is ever seen: {listed(found.roles)}")
    kept = [label for label, is_seen in zip(found.roles, seen, strict=True) if is_seen]
    found = replace(
        found,
        roles={label: found.roles[label] for label in kept},
        segments={label: found.segments[label] for label in kept},
    )
    return found, [part[:, seen] for part in every]


def _check_common(static: Markers, moving: Markers, known: Iterable[str]) -> None:
    """Refuse a static trial of other markers: it would be calibrated on, and tell nothing of the movement."""
    common = [label for label in known if label in static.names and label in moving.names]
    if len(common) >= FEWEST:
        return
    shared = f"only {listed(common)}" if common else "no label"
    raise TargetError(
        f"{static.name}: a static trial has the markers of the movement, but {shared} with a role is in "
        f"both: it has {listed(static.names, SHOWN)}; {moving.name} has {listed(moving.names, SHOWN)}. Give "
        f"a trial with the same labels ({FEWEST} at least, better all), or leave out the static trial: the "
        "movement itself is enough"
    )


def _columns(recording: Markers, labels: Iterable[str]) -> Array:
    nothing = np.full((len(recording), 3), np.nan)
    return np.stack(
        [
            recording.positions[:, recording.names.index(label)] if label in recording.names else nothing
            for label in labels
        ],
        axis=1,
    )
