"""Where the real recordings are. Tests that need them skip with a reason where they are absent."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

settings.register_profile("patient", deadline=None)  # machines are shared, and the first call compiles
settings.load_profile("patient")


def data_folder() -> Path | None:
    """The folder of real recordings: ``$SIXPOINT_DATA`` or ``../shared/data`` beside the repository."""
    given = os.environ.get("SIXPOINT_DATA")
    folder = Path(given) if given else Path(__file__).resolve().parents[2] / "shared" / "data"
    return folder if folder.is_dir() else None


def recordings(*patterns: str) -> list[Any]:
    """Test parameters: paths below the data folder that match; one skipped parameter where none does."""
    folder = data_folder()
    found = sorted({path for pattern in patterns for path in folder.glob(pattern)}) if folder else []
    if not found:
        reason = f"no recordings {', '.join(patterns)} in $SIXPOINT_DATA or ../shared/data"
        return [pytest.param(None, marks=pytest.mark.skip(reason=reason), id="no-data")]
    return [pytest.param(path, id=str(path.relative_to(folder))) for path in found if folder]


@pytest.fixture
def data() -> Path:
    """The folder of real recordings."""
    folder = data_folder()
    if folder is None:
        pytest.skip("no recordings: set SIXPOINT_DATA or put them into ../shared/data")
    return folder
