"""Joints as the movement alone tells them: hips and shoulders as centres, knees and elbows as axes.

They make a better start for the joint fit: hips in the pelvis that a belt's markers have been taken for, and
thighs and upper arms turned about their bones so that the hinge is where the limb really folds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.calibration.markers.functional import Centre, fit_axis, fit_centre, fit_common_centre
from sixpoint.calibration.markers.kinematics import SEGMENTS, Kinematics, logarithm
from sixpoint.calibration.markers.places import Places
from sixpoint.calibration.markers.problem import State
from sixpoint.calibration.markers.starts import lay_segment

Array = NDArray[np.float64]

EXPECTED_STD = {"hip": 0.010, "shoulder": 0.015}  # of what regression and proportion say [m]
LEAST_SURE = 0.015  # centres that the movement tells worse are not looked at [m]
FARTHEST = 0.05  # from what is expected [m]
PLANE = 3.0  # how much more than along the axis markers must move across it
LEAST_SWEEP = 0.03  # root mean square of their movement across [m]


def improve_start(kinematics: Kinematics, places: Places, state: State, observed: Array) -> State:
    """A state whose hips, shoulders, knees and elbows come from the movement where it tells them.

    Args:
        kinematics: The figure.
        places: Its markers.
        state: With poses (F, D) laid through the markers.
        observed: (F, M, 3) [m], NaN where not seen.
    """
    state = state.copy()
    _move_hips(kinematics, places, state, observed)
    _widen_shoulders(kinematics, places, state, observed)
    for side in ("l", "r"):
        _turn_upper(kinematics, places, state, observed, f"{side}_hip", f"{side}_thigh", f"{side}_shank")
        _turn_upper(
            kinematics, places, state, observed, f"{side}_shoulder", f"{side}_upper_arm", f"{side}_forearm"
        )
    return state


def find_centre(
    kinematics: Kinematics, places: Places, state: State, observed: Array, parent: str, segment: str
) -> Centre:
    """Centre of the joint above a segment, in the frame of a joint that carries it [m].

    With three markers on the segment both segments' frames are used, else only distances.
    """
    columns = places.on(segment)
    placed = kinematics.place(state.lengths, state.poses)
    joint = kinematics.skeleton.index(parent)
    turned, place = placed.world[:, joint], placed.positions[:, joint]
    if len(columns) >= 3:
        template = observed[np.argmax(np.isfinite(observed[:, columns, 0]).sum(axis=1))]
        whole = [k for k in columns if np.isfinite(template[k, 0])]
        first, _ = fit_common_centre((turned, place), lay_segment(template, observed, whole))
        return first
    local = np.einsum("fyx,fmy->fmx", turned, observed[:, columns] - place[:, None])
    return fit_centre(local)


def _move_hips(kinematics: Kinematics, places: Places, state: State, observed: Array) -> None:
    rest = kinematics.rest(state.lengths)
    found = []
    for side in ("l", "r"):
        expected = rest[kinematics.skeleton.index(f"{side}_hip")]
        centre = find_centre(kinematics, places, state, observed, "humanoid_root", f"{side}_thigh")
        found.append(_blended(centre, expected, EXPECTED_STD["hip"]))
    middle = 0.5 * (rest[kinematics.skeleton.index("l_hip")] + rest[kinematics.skeleton.index("r_hip")])
    shift = 0.5 * (found[0] + found[1]) - middle
    pelvis = [k for k in places.on("pelvis") if "hip" not in places.roles[k]]
    state.offsets[pelvis] -= shift
    state.lengths[SEGMENTS.index("pelvis_width")] = found[0][0] - found[1][0]


def _widen_shoulders(kinematics: Kinematics, places: Places, state: State, observed: Array) -> None:
    placed = kinematics.rest(state.lengths)
    chest = placed[kinematics.skeleton.index("vt1")]
    found = []
    for side in ("l", "r"):
        expected = placed[kinematics.skeleton.index(f"{side}_shoulder")] - chest
        centre = find_centre(kinematics, places, state, observed, "vt1", f"{side}_upper_arm")
        found.append(_blended(centre, expected, EXPECTED_STD["shoulder"]))
    state.lengths[SEGMENTS.index("torso_width")] = found[0][0] - found[1][0]


def _blended(centre: Centre, expected: Array, std: float) -> Array:
    """Between what is expected and what the movement tells, by how sure both are."""
    if not (centre.std < LEAST_SURE and np.linalg.norm(centre.position - expected) < FARTHEST):
        return expected
    trust = std**2 / (std**2 + centre.std**2)
    return np.asarray(expected + trust * (centre.position - expected))


def _turn_upper(
    kinematics: Kinematics, places: Places, state: State, observed: Array, root: str, upper: str, lower: str
) -> None:
    """Turn a thigh or upper arm about its bone in all frames, so that its hinge is the axis of movement."""
    columns = places.on(upper)
    if len(columns) < 2 or not places.on(lower):
        return
    placed = kinematics.place(state.lengths, state.poses)
    joint = kinematics.skeleton.index(root)
    points = np.concatenate([observed[:, columns], placed.positions[:, joint, None]], axis=1)
    template = points[np.argmax(np.isfinite(points[..., 0]).sum(axis=1))]
    turned, place = lay_segment(
        template, points, [k for k in range(len(template)) if np.isfinite(template[k, 0])]
    )
    local = np.einsum("fyx,fmy->fmx", turned, observed[:, places.on(lower)] - place[:, None])
    axis, ratio = fit_axis(local)
    across = (
        float(np.sqrt(np.nanmean(np.nanvar(local, axis=0).sum(axis=-1)))) if np.isfinite(local).any() else 0.0
    )
    seen = np.isfinite(turned[:, 0, 0])
    if ratio < PLANE or across < LEAST_SWEEP or not seen.any():
        return
    world = placed.world[:, joint]
    hinge = (turned @ axis)[:, :, None]
    x = np.where(np.isfinite(hinge[..., 0]), hinge[..., 0], world[..., 0])
    x *= np.sign(np.median(np.sum(x[seen] * world[seen, :, 0], axis=1))) or 1.0
    y = world[..., 1]
    x = x - np.sum(x * y, axis=1, keepdims=True) * y
    x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-9)
    new = np.stack([x, y, np.cross(x, y)], axis=-1)
    above = placed.world[:, kinematics.skeleton.parents[joint]]
    state.poses[:, kinematics.dofs(root)] = logarithm(np.swapaxes(above, 1, 2) @ new)
    seen_from = np.einsum("fyx,fmy->fmx", new, observed[:, columns] - placed.positions[:, joint, None])
    moved = np.nanmedian(np.where(np.isfinite(seen_from), seen_from, np.nan), axis=0)
    moved -= places.reach[columns] @ state.lengths
    near = np.abs(moved - places.offsets[columns]) < 2.0 * places.std[columns]
    state.offsets[columns] = np.where(near.all(axis=1, keepdims=True), moved, state.offsets[columns])
