"""A recording of one body, or its six points, as the six points and the posture of another body."""

from __future__ import annotations

import numpy as np

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.body.reach import Ends
from sixpoint.body.retargeting import Mode, carry_points, carry_pose
from sixpoint.body.targets import EFFECTORS, Targets
from sixpoint.calibration.person import estimate_figure
from sixpoint.errors import TargetError
from sixpoint.solvers.registry import DEFAULT, find_options, find_solver, make_solver


def retarget(
    recording: Motion | Targets,
    figure: Figure,
    mode: Mode = "relative",
    *,
    source: Figure | float | None = None,
    floor: float = 0.0,
    first: Ends = "feet",
    method: str = DEFAULT,
) -> Targets:
    """Six points of one body for another body; see ``body.retargeting`` for what is kept.

        avatar = sp.Figure.from_stature(1.20)
        result = sp.SequentialIKPlus(avatar).solve_motion(sp.retarget(sp.load("tall.bvh"), avatar))

    Args:
        recording: A motion, whose posture tells where limbs begin; or six points of a body, which is solved
            once for that.
        figure: For whom the points shall be.
        mode: "relative" keeps the pose, "absolute" what hands and feet touch.
        source: Whose recording it is: a figure, or of targets a stature [m]. By default the recording's own
            rig; of targets the person is estimated from the points.
        floor: Height of the floor [m].
        first: In absolute mode, who reaches where not all can: "hands" for a body that hangs.
        method: Solves bare targets; a name of ``SOLVERS``.

    Returns:
        Points with the frames, rate, gaps and rotations of the recording.

    Raises:
        TargetError: Nothing tells the lengths of the source, or the mode is unknown.
        FigureError: The recording's rig is no human's, or not the source's.
    """
    points, posed, owner = find_posture(recording, source, method)
    return carry_points(points, posed, owner, figure, mode, floor, first)


def retarget_pose(
    recording: Motion | Targets,
    figure: Figure,
    *,
    source: Figure | float | None = None,
    method: str = DEFAULT,
) -> Motion:
    """The posture of one body on another one, for a solver to start from.

        points, pose = sp.retarget(tall, avatar), sp.retarget_pose(tall, avatar)
        result = sp.SequentialIKPlus(avatar).solve_frames(points, start=pose).motion

    Joint angles are the recording's, of bare points those that the method finds on the source. The pelvis
    stays at the origin: where the body goes, ``retarget`` says, whose arguments and errors these are.
    """
    _, posed, owner = find_posture(recording, source, method)
    return carry_pose(posed, owner, figure)


def find_posture(
    recording: Motion | Targets, source: Figure | float | None = None, method: str = DEFAULT
) -> tuple[Targets, Motion, Figure]:
    """Six points of a recording, its posture, and whose they are; see ``retarget``."""
    if isinstance(recording, Motion):
        if isinstance(source, (int, float)):
            raise TargetError("a motion has a rig of its own: give its figure as the source, or nothing")
        owner = source or Figure.from_motion(recording)
        return owner.targets(recording), recording, owner
    if not isinstance(recording, Targets):
        raise TargetError(f"a recording is a Motion or Targets, got {type(recording).__name__}")
    if source is None:
        source = estimate_figure(recording)
    elif not isinstance(source, Figure):
        source = Figure.from_stature(source)
    return recording, _solve(recording, source, method), source


def _solve(targets: Targets, source: Figure, method: str) -> Motion:
    """The posture of six points, with their rotations where there are any and the method uses them."""
    options = {}
    if targets.rotations is not None and "rotations" in find_options(find_solver(method)):
        known = np.any(np.all(np.isfinite(targets.rotations), axis=2), axis=0)
        options["rotations"] = tuple(name for k, name in enumerate(EFFECTORS) if known[k])
    return make_solver(method, source, **options).solve_motion(targets)
