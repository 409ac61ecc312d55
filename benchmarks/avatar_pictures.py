"""Avatars driven by one recording: a sheet of each, and how well its targets are met.

    python benchmarks/avatar_pictures.py ../shared/data/mesh ../shared/data/paper/17_10.amc docs/avatars

All avatars below the folder, or those named after it; beside them the recording on its own rig. Files that
cannot be driven are listed with the reason; so are those that have bones only. The documentation shows
CesiumMan, KayKit_Knight and cool_loops.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from sixpoint.errors import SixpointError
from sixpoint.jobs.driving import AVATARS
from sixpoint.jobs.reading import Reading
from sixpoint.jobs.reconstruct import Body, reconstruct
from sixpoint.jobs.render import Look, render

FRAMES = slice(0, 2000)
LOOK = Look(size=(280, 330), pictures=5)


def main(avatars: Path, recording: Path, out: Path, *names: str) -> None:
    """Drive and draw avatars below a folder."""
    out.mkdir(parents=True, exist_ok=True)
    reading = Reading(frames=FRAMES)
    render(recording, out / "recording.png", look=LOOK, reading=reading, force=True)
    found = sorted(p for p in avatars.rglob("*") if p.suffix.lower() in AVATARS)
    for path in (p for p in found if not names or p.stem in names):
        with tempfile.TemporaryDirectory() as folder:
            driven = Path(folder) / f"{path.stem}.glb"
            try:
                done = reconstruct(recording, driven, reading=reading, body=Body(avatar=path))
                residual = done.solved.solution.residual
                met = f"{100 * np.mean(residual < 1e-3):.1f} % of the targets within 1 mm"
                print(f"{path.name}: {met}, worst {100 * residual.max():.1f} cm")
                if done.figure.shape is not None:
                    picture = out / f"{path.stem}.png"
                    render(driven, picture, look=LOOK, force=True)
                    print(f"  {picture}, {picture.stat().st_size // 1000} kB")
            except SixpointError as error:
                print(f"{path.name}: {error}")


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(*(Path(word) for word in sys.argv[1:4]), *sys.argv[4:])
