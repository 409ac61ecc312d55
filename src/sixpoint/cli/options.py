"""Options that several commands share, each with its help text."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter, Token

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
    Literal["y", "z", "-y", "-z", "x", "-x"] | None,
    Parameter(
        help="Up axis of the file; by default guessed from the posture for .bvh and markers, y for .amc. "
        "All but y and z are for markers only.",
        allow_leading_hyphen=True,
    ),
]
Rate = Annotated[
    float | None, Parameter(help="Frames per second, in place of the file's. An .amc states none: 120.")
]
Mapping = Annotated[
    Path | None,
    Parameter(help='TOML table of roles and joints, for a rig with unusual names: l_hip = "LeftThigh".'),
]


def read_layout(_type: object, tokens: Sequence[Token]) -> Path | str:
    """A layout that ships goes by its name, others are files."""
    from sixpoint.body.markers.roles import SHIPPED_LAYOUTS

    value = tokens[0].value
    return value if value in SHIPPED_LAYOUTS else Path(value)


Layout = Annotated[
    Path | str | None,
    Parameter(
        converter=read_layout,
        help='TOML file that says what the markers\' labels mean (`LASI = "l_asis"`), or `markers24`. '
        "By default the labels are looked for in the known marker sets.",
    ),
]
LimitsFile = Annotated[
    Path | None, Parameter(name="--limits", help="TOML table of joint limits in place of the shipped one.")
]
NoLimits = Annotated[
    bool, Parameter(name="--no-limits", negative="", help="Let joints turn beyond human limits.")
]
Force = Annotated[bool, Parameter(negative="", help="Overwrite existing files.")]
