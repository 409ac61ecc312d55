"""Bodies in motion before one camera: what all pictures of a film share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.body.soles import find_floor
from sixpoint.errors import SixpointError, listed
from sixpoint.render.camera import Camera
from sixpoint.render.floor import Ground
from sixpoint.render.picture import Body, take_picture
from sixpoint.render.surface import Surface
from sixpoint.render.tracing import check_libraries

Array = NDArray[np.float64]

VIEWS = {"front": (0.0, 6.0), "three-quarter": (38.0, 8.0), "side": (90.0, 6.0), "back": (180.0, 6.0)}
"""Name -> yaw from where the body faces, to its left, and pitch [degrees]."""
LOOKS = 48  # frames that say what must be in view
TRAVEL = 1.1  # of the body's height: what goes farther is followed
SMOOTH = 0.7  # of the followed path [s]
NEAR = (-0.6, 0.12)  # where a floor is believed to be [m]


def check_view(view: str) -> None:
    """Refuse a view that there is not."""
    if view not in VIEWS:
        raise SixpointError(f"unknown view {view!r}; views: {listed(VIEWS)}")


@dataclass(frozen=True, eq=False)
class Actor:
    """Who is seen.

    Attributes:
        figure: Whose motion it is.
        motion: How it moves.
        surface: How it looks.
        ghost: Drawn translucent, behind the others.
    """

    figure: Figure
    motion: Motion
    surface: Surface
    ghost: bool = False

    def place(self, frame: int) -> Body:
        """The surface in a frame; beyond its end an actor stands still."""
        frame = min(frame, len(self.motion) - 1)
        positions, world = self.motion.transforms
        vertices, normals = self.surface.place(positions[frame], world[frame])
        colours = self.surface.colours[:, :3].astype(np.float32)
        return Body(vertices, normals, self.surface.triangles, colours, self.ghost, self.surface.painting)


class Stage:
    """Takes pictures of actors; the first one is who is looked at.

    Args:
        actors: Who is seen.
        size: Width and height of a picture [pixels].
        view: One of ``VIEWS``.
        follow: The camera travels with the body; None: only if it goes far.

    Raises:
        SixpointError: An unknown view, an empty shape, or a library that is not installed.
    """

    def __init__(
        self,
        actors: Sequence[Actor],
        size: tuple[int, int],
        view: str = "three-quarter",
        follow: bool | None = None,
    ) -> None:
        check_libraries()
        check_view(view)
        if any(not len(actor.surface.triangles) for actor in actors):
            raise SixpointError("there is nothing to draw: the shape has no opaque triangle")
        self.actors, self.size = tuple(actors), size
        self._view, self._follow = view, follow
        self._ground: tuple[Camera, Ground] | None = None

    def take(self, frame: int) -> NDArray[np.uint8]:
        """The picture (height, width, 3) of a frame, sRGB."""
        camera = self.camera(frame)
        if self._ground is None or self._ground[0] is not camera:
            middle = self._path[min(frame, len(self._path) - 1)] + self._middle
            self._ground = camera, Ground.seen(camera, self.floor, middle)
        return take_picture([actor.place(frame) for actor in self.actors], camera, self._ground[1])

    def camera(self, frame: int) -> Camera:
        """Where a frame is seen from."""
        shift = self._path[min(frame, len(self._path) - 1)]
        return self._camera.moved(shift) if shift.any() else self._camera

    @cached_property
    def floor(self) -> float:
        """Height of the floor [m]: below the feet that stand, or 0 if those are far from it.

        Toes that bend into the floor do not lower it: six points do not tell how feet roll.
        """
        lead = self.actors[0]
        low = find_floor(lead.figure.with_shape(lead.surface.shape), lead.motion)
        return low if NEAR[0] < low < NEAR[1] else min(low, 0.0)

    @cached_property
    def _clouds(self) -> list[tuple[int, Array]]:
        """Frames spread over the motion, with all vertices (n, 3) of the actors."""
        frames = np.unique(np.linspace(0, len(self.actors[0].motion) - 1, LOOKS).astype(int))
        out = []
        for frame in frames:
            bodies = [actor.place(int(frame)).vertices for actor in self.actors]
            out.append((int(frame), np.concatenate(bodies).astype(float)))
        return out

    @cached_property
    def _path(self) -> Array:
        """(F, 3) shift of the camera on the floor [m]."""
        lead = self.actors[0]
        pelvis = lead.motion.positions[:, lead.figure.roles.pelvis] * [1.0, 0.0, 1.0]
        follow = self._follow
        if follow is None:
            follow = bool(np.ptp(pelvis, axis=0).max() > TRAVEL * lead.figure.height)
        if not follow:
            return np.zeros_like(pelvis)
        smooth = gaussian_filter1d(pelvis, SMOOTH * lead.motion.rate, axis=0, mode="nearest")
        return np.asarray(smooth - smooth[0])

    @cached_property
    def _middle(self) -> Array:
        """(3,) around which the floor is seen, when the camera is not shifted [m]."""
        points = np.concatenate([cloud - self._path[frame] for frame, cloud in self._clouds])
        return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)

    @cached_property
    def _camera(self) -> Camera:
        yaw, pitch = np.radians(VIEWS[self._view])
        lead = self.actors[0]
        pelvis = lead.figure.roles.pelvis
        turned = rot.mul(lead.motion.transforms[1][:, pelvis], rot.inv(lead.figure.neutral[pelvis]))
        ahead = rot.mul_vec(turned, [0.0, 0.0, 1.0]).mean(axis=0)
        facing = np.arctan2(ahead[0], ahead[2]) if np.hypot(ahead[0], ahead[2]) > 0.2 else 0.0
        points = [cloud - self._path[frame] for frame, cloud in self._clouds]
        soles = np.array(
            [[x, self.floor, z] for p in points for x in p[:, 0].take([0, -1]) for z in p[:, 2].take([0, -1])]
        )
        return Camera.framing(np.concatenate([*points, soles]), facing + yaw, pitch, self.size)
