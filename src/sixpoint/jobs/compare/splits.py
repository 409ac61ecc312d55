"""Which recordings test, and which made a method: people used for fitting are never in a test row.

A method names the people it was fitted on (``solvers.registry.find_fitted_on``), a clip the person it shows.
If any method of a comparison was fitted on a clip's person the clip is a training clip for all of them, so
that averages stay over the same clips.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from sixpoint.errors import SixpointError, listed
from sixpoint.study.comparison.model import TEST, TRAIN, is_fitted

if TYPE_CHECKING:
    from sixpoint.jobs.compare.methods import Method
    from sixpoint.jobs.compare.study import Clip

CMU = re.compile(r"(\d{2,3})_\d{2}(?:_\w+)?\.(?:amc|bvh)")
"""Files of the CMU database, also converted or mended ones: the person, then the take."""


def find_person(file: Path) -> str:
    """The person of a recording by the name of its file, as ``cmu/14``; empty where that does not tell."""
    found = CMU.fullmatch(file.name.lower())
    return f"cmu/{found[1]}" if found else ""


def assign_splits(clips: Sequence[Clip], methods: Sequence[Method]) -> dict[str, str]:
    """Clip -> "train", "development" or "test".

    Raises:
        SixpointError: A study calls a clip "test" or "development" whose person a method was fitted on.
    """
    splits = {}
    for clip in clips:
        fitted = [method.name for method in methods if is_fitted(clip.person, method.fitted_on)]
        if fitted and clip.split not in ("", TRAIN):
            raise SixpointError(
                f"{clip.name}: split = {clip.split!r}, but {listed(fitted)} was fitted on {clip.person}: "
                f"leave the method or the clip out, or say split = {TRAIN!r}"
            )
        splits[clip.name] = clip.split or (TRAIN if fitted else TEST)
    return splits
