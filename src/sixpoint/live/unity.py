"""Unity's space: left-handed, Y up, Z forward, X to the figure's *right*; VMC and VRChat speak it.

The only difference to sixpoint's is the sign of X. A mirror image turns the other way about the axes in the
mirror, and the same way about the one across it: (x, y, z, w) becomes (x, -y, -z, w). Both ways are the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.body import rotations as rot
from sixpoint.live.readings import Quaternion, Vector

Array = NDArray[np.float64]


def mirror_position(p: Vector) -> Vector:
    """Unity's position in sixpoint's space, and the other way."""
    return (-p[0], p[1], p[2])


def mirror_rotation(q: Quaternion) -> Quaternion:
    """Unity's rotation in sixpoint's space, and the other way."""
    return (q[0], -q[1], -q[2], q[3])


def from_unity_euler(degrees: ArrayLike) -> Array:
    """Unity's Euler angles (..., 3) [deg] to sixpoint's rotations (..., 4).

    Unity turns about Z first, then X, then Y, all of them fixed axes; the angles are listed as x, y, z.
    """
    angles = np.radians(np.asarray(degrees, float))
    return np.asarray(rot.from_euler("YXZ", angles[..., [1, 0, 2]]) * [1.0, -1.0, -1.0, 1.0])


def to_unity_euler(q: ArrayLike) -> Array:
    """Sixpoint's rotations (..., 4) to Unity's Euler angles x, y, z (..., 3) [deg]."""
    angles = rot.to_euler("YXZ", np.asarray(q, float) * [1.0, -1.0, -1.0, 1.0])
    return np.asarray(np.degrees(angles[..., [1, 0, 2]]))
