"""The constraints of prioritized IK, as data: what, where, and how important.

Level 0 is the most important. A task is attached to a place: a role of the figure ("l_wrist", "head"), a
joint or a site of the rig by name; ``offset`` shifts it to a point fixed to that joint, such as a marker. The
goal and whether the task is active are not part of it: they are given frame by frame. ``goal`` is the value
for frames that give none.

A goal is a frame: a position (3,) [m], a rotation (4,) xyzw, or both (7,). A task without a goal, or with
None or infinity, is off; NaN says that the goal is unknown, which is off too, and the frame is LOST.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property
from typing import ClassVar, Literal

from numpy.typing import ArrayLike

from sixpoint.body.motion import Pose
from sixpoint.body.surface.distance_grid import DistanceGrid, build_grid

Vector = tuple[float, float, float]
FLOOR = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Task:
    """What all tasks have.

    Attributes:
        at: Where the task is attached: a role, a joint or a site.
        level: Priority, 0 is the most important; gaps do not matter.
        offset: (3,) point in the joint's frame [m]; in a figure, its anatomical frame.
        weight: Influence within its level (not of FLEXT's own row, which has unit norm).
        goal: Goal of the frames that give none.
        name: What goals and residuals are called by; by default the place, with the kind of task.
        tolerance: Error at which iterating stops [m or rad]; None for 1 mm or 0.01 rad.
    """

    suffix: ClassVar[str] = ""
    takes_goal: ClassVar[bool] = True
    turns: ClassVar[bool] = False  # whether the goal is a rotation

    at: str
    _: KW_ONLY
    level: int = 0
    offset: Vector = (0.0, 0.0, 0.0)
    weight: float = 1.0
    goal: ArrayLike | None = None
    name: str | None = None
    tolerance: float | None = None

    @property
    def label(self) -> str:
        """Name of the task among the others."""
        return self.name or f"{self.at} {self.suffix}".strip()


@dataclass(frozen=True, eq=False)
class PositionTask(Task):
    """A point goes to a position."""


@dataclass(frozen=True, eq=False)
class OrientationTask(Task):
    """A joint takes a world rotation, the goal's (4,); in a figure, that of its anatomical frame."""

    suffix: ClassVar[str] = "orientation"
    turns: ClassVar[bool] = True


@dataclass(frozen=True, eq=False)
class LookAtTask(Task):
    """An axis through the point (``offset``: the eye) points at the goal position.

    Attributes:
        axis: (3,) direction in the joint's frame; forward by default.
    """

    suffix: ClassVar[str] = "gaze"
    _: KW_ONLY
    axis: Vector = (0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class AlignTask(Task):
    """An axis of a joint points along the goal, a world direction (3,).

    Attributes:
        axis: (3,) direction in the joint's frame; up by default.
    """

    suffix: ClassVar[str] = "axis"
    _: KW_ONLY
    axis: Vector = (0.0, 1.0, 0.0)


@dataclass(frozen=True, eq=False)
class PlaneTask(Task):
    """A point stays above a plane; by default the floor.

    The goal is a point of the plane, and a rotation whose Y axis is the plane's upward normal.

    Attributes:
        margin: Least distance to the plane [m].
    """

    suffix: ClassVar[str] = "plane"
    _: KW_ONLY
    margin: float = 0.0
    goal: ArrayLike | None = FLOOR


@dataclass(frozen=True, eq=False)
class Sphere:
    """A sphere around the goal's position; radius [m]."""

    radius: float


@dataclass(frozen=True, eq=False)
class Capsule:
    """All within ``radius`` of a segment of ``length`` [m] that lies along the goal's Y axis around it."""

    radius: float
    length: float


@dataclass(frozen=True, eq=False)
class Box:
    """A box of three side lengths [m], centred and turned as the goal."""

    size: Vector


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """Everything below the plane through the goal's position, normal to its Y axis."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed triangle mesh, placed and turned as the goal: an object of the scene.

    Distances are interpolated on a grid that is made once; features smaller than its spacing are rounded.

    Attributes:
        vertices: (V, 3) [m].
        triangles: (T, 3), counter-clockwise seen from outside.
        spacing: Of the grid [m]; by default a 32nd of the longest side.
    """

    vertices: ArrayLike
    triangles: ArrayLike
    spacing: float | None = None

    @cached_property
    def grid(self) -> DistanceGrid:
        """Signed distances around it.

        Raises:
            SixpointError: It is not closed.
        """
        return build_grid(self.vertices, self.triangles, self.spacing)


Shape = Sphere | Capsule | Box | HalfSpace | Mesh


@dataclass(frozen=True, eq=False)
class ObstacleTask(Task):
    """Points of the body stay out of a shape: an approach is slowed in a buffer, a penetration pushed out.

    Reference: Peinado et al. 2009.

    Attributes:
        shape: What to avoid; the goal is its position and rotation.
        points: More observer points: places, or (place, offset) pairs. Ends of segments and their middles
            are a good choice.
        margin: Distance kept to the shape [m]: the flesh around the point.
        buffer: Thickness of the zone in which approaches are slowed [m].
        on: Place that carries the shape: a part of the body that the points stay out of. The goal is then
            in that joint's frame (in a figure, its anatomical frame); by default the joint itself.
    """

    suffix: ClassVar[str] = "obstacle"
    shape: Shape = field(default_factory=HalfSpace)
    _: KW_ONLY
    points: tuple[str | tuple[str, Vector], ...] = ()
    margin: float = 0.0
    buffer: float = 0.05
    on: str | None = None

    def __post_init__(self) -> None:
        if self.on is not None and self.goal is None:
            object.__setattr__(self, "goal", FLOOR)


@dataclass(frozen=True, eq=False)
class BalanceTask(Task):
    """The centre of mass stays above the support polygon of the feet, or above a point.

    Attributes:
        support: Points that bear on the floor: places, or (place, offset) pairs; by default heels, balls and
            toes of a figure. Those more than 5 cm above the lowest one bear nothing.
        margin: How far inside the polygon to stay [m].
        target: "polygon", or "point": above the goal's position.
    """

    suffix: ClassVar[str] = "balance"
    at: str = ""
    _: KW_ONLY
    support: tuple[str | tuple[str, Vector], ...] = ()
    margin: float = 0.02
    target: Literal["polygon", "point"] = "polygon"

    @property
    def takes_goal(self) -> bool:  # type: ignore[override]
        """Only a balance above a point has a goal."""
        return self.target == "point"


@dataclass(frozen=True, eq=False)
class CouplingTask(Task):
    """The coordinates of a joint are ``ratio`` times those of another: rotation vectors, or hinge angles.

    Attributes:
        other: The joint that leads.
        ratio: Share, such as that of one vertebra in the bend of another.
    """

    suffix: ClassVar[str] = "coupling"
    takes_goal: ClassVar[bool] = False
    other: str = ""
    ratio: float = 1.0


@dataclass(frozen=True, eq=False)
class FlextTask(Task):
    """The end of a limb goes to a position: its distance to the limb's root by flexing, the rest below.

    One row for flexion and extension at ``level``, two rows for the directions across the limb at
    ``tangential_level``, and with ``drag`` one row that lets the body follow where the limb is too short.

    Reference: Boulic and Raunhardt 2009.

    Attributes:
        tangential_level: Level of the two other directions; by default the next one, in the secant form the
            same.
        drag: Let the rest of the body follow when the goal is beyond the limb; by default wherever something
            above the limb's root can move.
        drag_level: Level of that; by default two below ``level``.
        form: "tangent": the paper's row, in the tangent space; "exponential": the same from exponential-map
            parameters, as printed; "secant": the row moves the limb, but what is kept from lower levels are
            the three directions of its end, so that they may move the limb's root and the hinge answers at
            once; "hinge": the middle joint alone carries the row.
        predict: Allow for what higher levels do to root and end in the same step.
        root: Root of the limb, by default the next moving joint above the middle one.
        middle: Middle joint; by default the nearest hinge above.
    """

    _: KW_ONLY
    tangential_level: int | None = None
    drag: bool | None = None
    drag_level: int | None = None
    form: Literal["tangent", "exponential", "hinge", "secant"] = "secant"
    predict: bool = True
    root: str | None = None
    middle: str | None = None


@dataclass(frozen=True, eq=False)
class PostureTask(Task):
    """At the very end: joints drift towards a posture in what all tasks leave free.

    Attributes:
        pose: "relaxed": standing, elbows and knees slightly bent (a plain skeleton: its rest pose);
            "middle": the middle of each hinge's range; or a pose of the rig.
        weights: Place -> how strongly; 1 unless a figure's trunk (2) or clavicles (5).
        step: Share of the way done in a sixtieth of a second; in each iteration of a frame without a previous
            one.
        after: Only once all tasks are met.
    """

    suffix: ClassVar[str] = "posture"
    takes_goal: ClassVar[bool] = False
    at: str = ""
    _: KW_ONLY
    level: int = 1_000_000
    pose: Literal["relaxed", "middle"] | Pose = "relaxed"
    weights: Mapping[str, float] = field(default_factory=dict)
    step: float = 0.2
    after: bool = False
