"""Which suffix holds what, and what is said of a file that holds something else."""

from __future__ import annotations

from pathlib import Path

from sixpoint.errors import FormatError, SixpointError, listed
from sixpoint.formats.gltf.avatar import GLTF_SUFFIXES
from sixpoint.formats.markers import MARKER_SUFFIXES
from sixpoint.formats.usd import USD_SUFFIXES

MOTION_SUFFIXES = (".bvh", ".amc", ".asf", *GLTF_SUFFIXES, *USD_SUFFIXES)
OUTPUT_SUFFIXES = (".bvh", ".amc", ".glb", ".vrma", *USD_SUFFIXES)
"""What a motion is written as."""
SHAPE_SUFFIXES = (".glb", ".gltf", ".vrm", *USD_SUFFIXES)
"""What may hold a surface."""
SHAPE_OUTPUTS = (".glb", *USD_SUFFIXES)
"""What a surface is written into."""
TARGET_SUFFIXES = (".csv", ".npz")

_FBX = (
    "FBX files are not read; convert it, e.g. in Blender: File > Import > FBX, then "
    "File > Export > Motion Capture (.bvh)"
)


def check_suffix(path: Path, known: tuple[str, ...], what: str) -> str:
    """The suffix of a file, lower case.

    Args:
        path: The file.
        known: What it may end with.
        what: What is asked of it, "motions, writing" say.

    Raises:
        FormatError: It ends with something else; the message says what that holds and what would do.
    """
    suffix = path.suffix.lower()
    if suffix in known:
        return suffix
    formats = f"formats of {what}: {listed(known)}"
    if suffix == ".fbx":
        raise FormatError(path, _FBX)
    if suffix == ".asf":
        raise FormatError(path, "save as .amc: the .asf is written beside it")
    if suffix in (".gltf", ".vrm") and ".glb" in known:
        raise FormatError(path, f"glTF is written as one file: save as .glb (got {suffix})")
    if suffix in MARKER_SUFFIXES and suffix not in TARGET_SUFFIXES:
        message = f"a {suffix} file holds markers, not {what.split(',')[0]}; follow them with: sixpoint track"
        raise FormatError(path, f"{message}; {formats}")
    if suffix in (*MOTION_SUFFIXES, *TARGET_SUFFIXES):
        raise FormatError(path, f"a {suffix} file does not hold {what.split(',')[0]}; {formats}")
    if suffix == ".mot":
        raise FormatError(path, f"joint angles of OpenSim (.mot) are written, not read; {formats}")
    raise FormatError(path, f"unknown suffix {suffix!r}; {formats}")


def check_rate(path: Path, rate: float | None) -> None:
    """Refuse a frame rate [Hz] that cannot be meant."""
    if rate is not None and not 1e-3 <= rate <= 1e6:
        raise FormatError(path, f"the rate is frames per second, 0.001 to 1000000, got {rate}")


def with_path(path: Path, error: SixpointError) -> FormatError:
    """An error that says of which file it is."""
    return error if isinstance(error, FormatError) else FormatError(path, str(error))
