"""Does a profile fit what is seen? Distances its body does not allow, and trackers that are missing."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body.figure import Figure
from sixpoint.calibration.mounts import Mount
from sixpoint.calibration.profile import Profile
from sixpoint.errors import listed

Array = NDArray[np.float64]

TOO_FAR = 0.08  # how much farther apart than the body allows trackers may be seen [m]
TALL = 0.06  # how much higher a head may be seen than standing [m]
UNKNOWN = 0.12  # how far a tracker may be from its joint where its offset is not known [m]


def find_misfits(profile: Profile, seen: Mapping[str, ArrayLike]) -> tuple[str, ...]:
    """Warnings where a profile does not fit what is seen: another person, or trackers worn elsewhere.

    Args:
        profile: What was loaded.
        seen: Serial -> its positions (F, 3) or (3,) over some seconds [m]; all with the same frames. A head
            that stands upright tells the most; sitting tells little, and is no misfit.

    Returns:
        One text per misfit; nothing where the profile fits, as far as can be seen.
    """
    said = []
    missing = [f"{s} ({w.point})" for s, w in profile.trackers.items() if s not in seen]
    strange = [serial for serial in seen if serial not in profile.trackers]
    if missing:
        said.append(f"trackers of the profile are not seen: {listed(missing)}")
    if strange:
        said.append(f"trackers are seen that the profile does not know: {listed(strange)}")
    at = {w.point: _frames(seen[s]) for s, w in profile.trackers.items() if s in seen}
    slack = {w.point: _offset(w.mount) for w in profile.trackers.values()}
    figure = profile.figure()
    reaches = _reaches(figure)
    for (a, b), reach in reaches.items():
        if a in at and b in at:
            apart = np.linalg.norm(at[a] - at[b], axis=1)
            most = float(np.nanpercentile(apart, 95)) if np.isfinite(apart).any() else 0.0
            limit = reach + slack[a] + slack[b] + TOO_FAR
            if most > limit:
                said.append(f"{a} and {b} are {most:.2f} m apart, which this body allows up to {limit:.2f} m")
    if "head" in at and "l_ankle" in at and "r_ankle" in at:
        ankles = 0.5 * (at["l_ankle"][:, 1] + at["r_ankle"][:, 1])
        tall = at["head"][:, 1] - ankles
        high = float(np.nanpercentile(tall, 95)) if np.isfinite(tall).any() else 0.0
        stands = _standing(figure)
        if high > stands + slack["head"] + slack["l_ankle"] + TALL:
            said.append(f"the head is {high:.2f} m above the ankles; of this stature it is {stands:.2f} m")
    if len(said) > bool(missing) + bool(strange):
        said.append("stand still for two seconds and calibrate again, or check where each tracker is worn")
    return tuple(said)


def _reaches(figure: Figure) -> dict[tuple[str, str], float]:
    """Largest distances [m] between joints of a figure, whatever its pose."""
    roles = figure.roles

    def way(a: int, b: int) -> float:
        """Length of the bones between two joints, one above the other."""
        path = figure.skeleton.path(a, b)
        return float(sum(np.linalg.norm(figure.offsets[j]) for j in path[1:]))

    trunk = way(roles.pelvis, roles.head) + float(np.linalg.norm(figure.head_offset))
    out = {("pelvis", "head"): trunk}
    for k, side in enumerate("lr"):
        leg = way(roles.pelvis, roles.ankle[k])
        arm = way(roles.pelvis, roles.wrist[k])
        out |= {("pelvis", f"{side}_ankle"): leg, ("pelvis", f"{side}_wrist"): arm}
        out |= {("head", f"{side}_wrist"): arm - way(roles.pelvis, roles.shoulder[k]) + 0.5 * trunk}
        out |= {("pelvis", f"{side}_knee"): way(roles.pelvis, roles.knee[k])}
        out |= {(f"{side}_knee", f"{side}_ankle"): way(roles.knee[k], roles.ankle[k])}
        out |= {(f"{side}_elbow", f"{side}_wrist"): way(roles.elbow[k], roles.wrist[k])}
    return out


def _standing(figure: Figure) -> float:
    """Height of the head over the ankles [m]."""
    roles, rest = figure.roles, figure.rest_positions
    head = rest[roles.head] + figure.head_offset
    return float(head[1] - rest[list(roles.ankle), 1].mean())


def _offset(mount: Mount) -> float:
    return float(np.linalg.norm(mount.offset)) if np.isfinite(mount.offset).all() else UNKNOWN


def _frames(positions: ArrayLike) -> Array:
    return np.atleast_2d(np.asarray(positions, float))
