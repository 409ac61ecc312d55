"""Files to motions, avatars, markers and targets, and back; the suffix says which format.

Degrees, inches, centimetres and Z-up worlds exist only in this room: what comes out is in metres, radians
and Y up, and what goes into a file is in the unit and axes of the file it once came from. Reading raises
``FormatError`` with the line; writing is whole or not at all.
"""

from sixpoint.formats.amc import find_skeleton
from sixpoint.formats.angles import ANGLE_SUFFIXES, save_angles
from sixpoint.formats.gltf.avatar import GLTF_SUFFIXES, Avatar, load_avatar
from sixpoint.formats.markers import (
    MARKER_OUTPUTS,
    MARKER_SUFFIXES,
    holds_markers,
    load_markers,
    save_markers,
)
from sixpoint.formats.motions import load, load_shape, save
from sixpoint.formats.points import load_targets, save_targets
from sixpoint.formats.suffixes import (
    MOTION_SUFFIXES,
    OUTPUT_SUFFIXES,
    SHAPE_OUTPUTS,
    SHAPE_SUFFIXES,
    TARGET_SUFFIXES,
)

__all__ = [
    "ANGLE_SUFFIXES",
    "GLTF_SUFFIXES",
    "MARKER_OUTPUTS",
    "MARKER_SUFFIXES",
    "MOTION_SUFFIXES",
    "OUTPUT_SUFFIXES",
    "SHAPE_OUTPUTS",
    "SHAPE_SUFFIXES",
    "TARGET_SUFFIXES",
    "Avatar",
    "find_skeleton",
    "holds_markers",
    "load",
    "load_avatar",
    "load_markers",
    "load_shape",
    "load_targets",
    "save",
    "save_angles",
    "save_markers",
    "save_targets",
]
