"""At which times a stage is read, and how many frames per second that makes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sixpoint.errors import FormatError
from sixpoint.formats.usd.rig import Rig

EVEN = 1e-4  # steps that differ by less than this share are even
MOST = 1_000_000  # frames


def find_times(usd: Any, stage: Any, rig: Rig, path: Path) -> tuple[list[float], float]:
    """Time codes of the frames, and their rate [Hz].

    These are the animation's own samples where they are even. Else the time they span is read at the frame
    rate of the stage, USD interpolating between samples.
    """
    codes = float(stage.GetTimeCodesPerSecond())
    frames = float(stage.GetFramesPerSecond())
    if not (codes > 0 and frames > 0 and np.isfinite(codes) and np.isfinite(frames)):
        raise FormatError(path, f"the stage has {codes:g} time codes and {frames:g} frames per second")
    found: list[float] = [] if rig.animation is None else list(rig.animation.GetJointTransformTimeSamples())
    if rig.is_placed_over_time:
        prim = rig.prim
        while prim and not prim.IsPseudoRoot():
            place = usd.UsdGeom.Xformable(prim)
            found += place.GetTimeSamples() if place else []
            prim = prim.GetParent()
    samples = np.unique(np.array(found, float))
    if len(samples) < 2:
        return [
            float(samples[0]) if len(samples) else float(usd.Usd.TimeCode.EarliestTime().GetValue())
        ], frames
    steps = np.diff(samples)
    step = float((samples[-1] - samples[0]) / len(steps))
    if np.all(np.abs(steps - step) <= EVEN * step):
        return samples.tolist(), codes / step
    count = round((samples[-1] - samples[0]) * frames / codes) + 1
    if count > MOST:
        raise FormatError(path, f"the animation has {count} frames at {frames:g} per second; too many")
    return (samples[0] + np.arange(count) * codes / frames).tolist(), frames
