"""What is expected of a body before its movement is looked at: lengths by proportion, and postures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.anthropometry import segments_of_stature
from sixpoint.calibration.markers.kinematics import SEGMENTS, Kinematics
from sixpoint.calibration.markers.problem import INDEPENDENT

Array = NDArray[np.float64]

STATURE_STD = 0.15  # of the logarithm of the first guess
HIP_STD = 0.08  # of the logarithm of the distance between the hips by regression
PROPORTION_STD = {  # of the logarithm of each length, the stature apart
    "foot": 0.05,
    "calf": 0.05,
    "thigh": 0.05,
    "pelvis_length": 0.06,  # a convention of the figure more than anatomy: nothing turns there alone
    "pelvis_width": 0.10,
    "torso_length": 0.06,
    "torso_width": 0.08,
    "neck": 0.10,
    "upper_arm": 0.05,
    "forearm": 0.05,
    "hand": 0.06,
}
LOOSE = 2.0  # postures of a movement may be this many times as far from neutral as the kinematics' priors say
STIFF = {
    "l_sternoclavicular": 1.5,
    "r_sternoclavicular": 1.5,
    "vl5": 2.0,
    "vt6": 2.0,
    "l_ankle": 1.5,
    "r_ankle": 1.5,
}
"""These no farther, in any frame."""
STATIC_STD = {"l_knee": 6, "r_knee": 6, "l_ankle": 8, "r_ankle": 8, "vl5": 8, "vt6": 8, "vc4": 12}  # [deg]


def expect_lengths(stature: float, hips: float | None) -> tuple[Array, Array]:
    """Logarithms (K,) of the segment lengths [m], and their inverse covariance (K, K).

    Args:
        stature: A first guess [m]; proportions are surer than it.
        hips: Distance between the hips by regression, if there is one [m].
    """
    by_proportion = segments_of_stature(stature)
    lengths = np.log([by_proportion[name] for name in SEGMENTS])
    std = np.array([PROPORTION_STD[name] for name in SEGMENTS])
    information = np.linalg.inv(np.diag(std**2) + STATURE_STD**2)
    if hips is not None:
        k = SEGMENTS.index("pelvis_width")
        information[k, :] = information[:, k] = 0.0
        information[k, k], lengths[k] = HIP_STD**-2, np.log(hips)
    return np.asarray(lengths), np.asarray(information)


def moving_std(kinematics: Kinematics, frames: int) -> Array:
    """(F, D) standard deviations of postures in a movement, whose frames are far from independent."""
    std = kinematics.std * LOOSE * max(1.0, frames / INDEPENDENT) ** 0.5
    for joint, times in STIFF.items():
        std[kinematics.dofs(joint)] = times * kinematics.std[kinematics.dofs(joint)]
    return np.tile(std, (frames, 1))


def standing_std(kinematics: Kinematics, frames: int) -> Array:
    """(F, D) the same for a person standing still: legs, trunk and head are near neutral, arms anywhere."""
    std = kinematics.std * LOOSE
    for joint, degrees in STATIC_STD.items():
        std[kinematics.dofs(joint)] = np.radians(degrees)
    return np.tile(std, (frames, 1))
