"""Options that several commands share, each with its help text."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

Skeleton = Annotated[Path | None, Parameter(help="The .asf of an .amc; by default looked for beside it.")]
Frames = Annotated[
    str | None,
    Parameter(
        help="Frames to take, as Python slices them: `1:` (all but the first), `0:600`, `::2`, `10`.",
        allow_leading_hyphen=True,
    ),
]
Unit = Annotated[
    str | None,
    Parameter(
        help="Unit of the file: m, cm, mm, inch, cmu, or metres per unit as a number. "
        "By default the file's; guessed from the size of the body for .bvh."
    ),
]
Up = Annotated[
    Literal["y", "z"] | None,
    Parameter(help="Up axis of the file; by default guessed from the posture for .bvh, y for .amc."),
]
Rate = Annotated[
    float | None, Parameter(help="Frames per second, in place of the file's. An .amc states none: 120.")
]
Mapping = Annotated[
    Path | None,
    Parameter(help='TOML table of roles and joints, for a rig with unusual names: l_hip = "LeftThigh".'),
]
LimitsFile = Annotated[
    Path | None, Parameter(name="--limits", help="TOML table of joint limits in place of the shipped one.")
]
NoLimits = Annotated[
    bool, Parameter(name="--no-limits", negative="", help="Let joints turn beyond human limits.")
]
Force = Annotated[bool, Parameter(negative="", help="Overwrite existing files.")]
