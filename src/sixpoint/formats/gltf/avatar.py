"""An avatar: a glTF or VRM file as a Figure with its Shape, and the way back into the file.

The reference pose, in which all frames are aligned with the world, is the T-pose of the nodes where a
humanoid map says that they stand so, else the pose in which the mesh was bound, else that of the nodes.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.limits import Limits
from sixpoint.body.mapping import read_mapping
from sixpoint.body.motion import FileSpace, Motion
from sixpoint.body.surface.appearance import Appearance
from sixpoint.body.surface.shape import Shape
from sixpoint.errors import FigureError, FormatError, SixpointError
from sixpoint.formats.gltf.animation import DEFAULT_RATE, Channel, find_grid, read_channels, warn_of_scales
from sixpoint.formats.gltf.appearance import read_appearance
from sixpoint.formats.gltf.binding import check_one_body, find_bind_pose, place_bind_pose, read_skins
from sixpoint.formats.gltf.document import Document, read_document
from sixpoint.formats.gltf.humanoid import BONE_ROLES, Humanoid, find_humanoid
from sixpoint.formats.gltf.mesh import Piece, join_pieces, read_pieces
from sixpoint.formats.gltf.nodes import read_nodes
from sixpoint.formats.gltf.rig import HALF_TURN, Rig, build_rig, choose_joints

Array = NDArray[np.float64]

GLTF_SUFFIXES = (".glb", ".gltf", ".vrm", ".vrma")
SAME_BONES = 1e-3
"""Part of a body's height within which its bones are the same."""
STILL = 1e-5
"""Part of the body's size within which a joint keeps its offset."""
SPACE = FileSpace(1.0, "y", "convention", "convention")


@dataclass(frozen=True, eq=False, repr=False)
class Avatar:
    """A character from a file.

    Attributes:
        figure: Its anatomy, with its shape if it has a mesh.
        rig: Which node each joint is.
        humanoid: The humanoid map of a VRM; None for others.
        pieces: The primitives that the shape is made of.
    """

    figure: Figure
    rig: Rig
    humanoid: Humanoid | None
    pieces: list[Piece]

    def __repr__(self) -> str:
        shape = self.figure.shape
        mesh = "no mesh" if shape is None else f"{len(shape.triangles)} triangles"
        return f"Avatar({self.name!r}, {self.kind}, {len(self.figure.skeleton)} joints, {mesh})"

    @property
    def document(self) -> Document:
        """The file, from which materials, textures and meshes are written back."""
        return self.rig.tree.document

    @property
    def name(self) -> str:
        """The file's stem."""
        return self.document.path.stem

    @property
    def kind(self) -> str:
        """The kind of file: "glTF", "VRM 0.x", "VRM 1.0" or "VRM animation"."""
        return "glTF" if self.humanoid is None else self.humanoid.kind

    @cached_property
    def appearance(self) -> Appearance | None:
        """Colours and textures of the shape; None without one. Textures are decoded on first use."""
        return read_appearance(self.document, self.pieces) if self.pieces else None

    @property
    def animations(self) -> tuple[str, ...]:
        """Names of the file's animations."""
        found = self.document.items("animations")
        return tuple(str(a.get("name", f"animation_{k}")) for k, a in enumerate(found))

    def check_rig(self, motion: Motion) -> None:
        """Refuse a motion that is on another skeleton.

        Raises:
            FigureError: Saying what to do.
        """
        mine, other = self.figure.skeleton, motion.skeleton
        if other is mine:
            return
        what = f"({len(other)} joints) than the avatar {self.name!r} ({len(mine)})"
        if other.names == mine.names and np.array_equal(other.parents, mine.parents):
            off = np.abs(other.offsets[1:] - mine.offsets[1:]).max(axis=1, initial=0.0)
            if np.all(off < SAME_BONES * self.figure.height):
                return
            joint = mine.names[int(np.argmax(off)) + 1]
            what = f"than the avatar {self.name!r}, which shares its names: {joint!r} is elsewhere"
        raise FigureError(
            f"the motion is on another skeleton {what}; pose the avatar's figure from the motion's six points"
        )

    def read_motion(self, rate: float | None = None) -> Motion:
        """The first animation, or one frame of the pose that the nodes have where there is none.

        Args:
            rate: Frames per second [Hz]; by default that of the keys if these are evenly spaced, else 60.

        Raises:
            FormatError: The animation is damaged.
        """
        return sample_motion(self.rig, _first_channels(self.document), rate)


def load_avatar(
    path: str | Path,
    mapping: Mapping[str, str] | str | Path | None = None,
    limits: Limits | None = None,
) -> Avatar:
    """Read an avatar from a .glb, .gltf or .vrm file (a .vrma has bones only).

    Args:
        path: The file.
        mapping: Role -> joint name for what is not found, as for ``Figure.from_motion``.
        limits: Joint limits; the shipped table by default.

    Raises:
        FormatError: The file cannot be read or is not supported, or its body is not found.
    """
    path = Path(path)
    with np.errstate(all="ignore"):  # damaged files hold any numbers; what matters is checked
        try:
            rig, humanoid = _open(path)
            figure = _find_figure(rig, humanoid, read_mapping(mapping), limits)
            skins = read_skins(rig.tree)
            bound = place_bind_pose(rig, find_bind_pose(rig.tree, skins))
            pieces = read_pieces(rig, skins, *bound)
            shape: Shape | None = join_pieces(rig, pieces, *bound, path.stem)
        except FormatError:
            raise
        except SixpointError as error:
            raise FormatError(path, str(error)) from error
    return Avatar(figure.with_shape(shape), rig, humanoid, pieces)


def read_gltf_motion(path: Path, rate: float | None = None) -> Motion:
    """The movement in a file, of any rig, human or not; on the same skeleton as ``load_avatar``'s.

    Raises:
        FormatError: The file cannot be read.
    """
    with np.errstate(all="ignore"):
        try:
            rig, _ = _open(path)
            return sample_motion(rig, _first_channels(rig.tree.document), rate)
        except FormatError:
            raise
        except SixpointError as error:
            raise FormatError(path, str(error)) from error


def _open(path: Path) -> tuple[Rig, Humanoid | None]:
    """The rig in the reference pose that shows a human, and the humanoid map."""
    tree = read_nodes(read_document(path))
    humanoid = find_humanoid(tree.document, tree)
    skins = read_skins(tree)
    if humanoid is None:
        check_one_body(tree, skins)
    turn = HALF_TURN if humanoid is not None and humanoid.faces_back else rot.IDENTITY
    bones = [] if humanoid is None else humanoid.bones.values()
    animated = {c.node for c in _first_channels(tree.document)}
    joints = choose_joints(tree, {n for s in skins for n in s.nodes}, bones, animated)
    rigs = [build_rig(tree, joints, turn)]
    bound = {n: rot.mul(turn, q) for n, q in find_bind_pose(tree, skins).rotations.items()}
    if bound:
        rigs.insert(0 if humanoid is None else 1, build_rig(tree, joints, turn, bound))
    for rig in rigs:
        with contextlib.suppress(FigureError):
            _find_figure(rig, humanoid, {}, None)
            return rig, humanoid
    return rigs[0], humanoid


def _find_figure(
    rig: Rig, humanoid: Humanoid | None, mapping: Mapping[str, str], limits: Limits | None
) -> Figure:
    """The anatomy of a rig: in its rest pose, else in its movement."""
    roles = {}
    if humanoid is not None:
        joint = dict(zip(rig.nodes, rig.skeleton.names, strict=True))
        roles = {role: joint[humanoid.bones[b]] for b, role in BONE_ROLES.items() if b in humanoid.bones}
    roles |= mapping
    document = rig.tree.document
    try:
        figure = Figure.from_skeleton(rig.skeleton, roles, limits)
    except FigureError:
        channels = _first_channels(document)
        if not channels:
            raise
        figure = Figure.from_motion(sample_motion(rig, channels, None), roles, limits)
    return replace(figure, name=document.path.stem)


def _first_channels(document: Document) -> list[Channel]:
    return read_channels(document, 0) if document.items("animations") else []


def sample_motion(rig: Rig, channels: list[Channel], rate: float | None) -> Motion:
    """Sample an animation on the joints of a rig.

    Args:
        rig: The rig.
        channels: Of one animation; empty for one frame of the pose that the nodes have.
        rate: Frames per second [Hz]; see ``find_grid``.

    Raises:
        FormatError: There would be too many frames.
    """
    document, skeleton = rig.tree.document, rig.skeleton
    row = {node: k for k, node in enumerate(rig.nodes) if node >= 0}
    channels = [c for c in channels if c.node in row]
    times, found = np.zeros(1), rate or DEFAULT_RATE
    if channels:
        warn_of_scales(document, channels, rig.tree.scales)
        times, found = find_grid(document, channels, rate, len(row))
    local = np.array([rot.IDENTITY if n < 0 else rig.tree.rotations[n] for n in rig.nodes])
    local = np.tile(local, (len(times), 1, 1))
    size = float(np.ptp(skeleton.compute_transforms(rig.default_rotations())[0], axis=0).max()) or 1.0
    moved = {0: np.tile(skeleton.offsets[0], (len(times), 1))}
    for channel in channels:
        joint = row[channel.node]
        if channel.path == "rotation":
            local[:, joint] = channel.sample(times)
        elif channel.path == "translation":
            place = rig.enter_place(joint, channel.sample(times))
            if joint == 0 or np.any(np.abs(place - skeleton.offsets[joint]) > STILL * size):
                moved[joint] = place
    moving = tuple(sorted(moved))
    return Motion(
        skeleton,
        rot.normalised(rig.enter(local)),
        np.stack([moved[j] for j in moving], axis=1),
        found,
        moving=moving,
        space=SPACE,
        name=document.path.stem,
    )
