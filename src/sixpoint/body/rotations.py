"""Quaternions on whole arrays (NumPy); the compiled kernels have their own on single tuples.

Unit quaternions are xyzw along the last axis; every function broadcasts over the leading axes.
``mul_vec(q_a_b, v_b)`` is ``v_a``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

IDENTITY: Array = np.array([0.0, 0.0, 0.0, 1.0])
IDENTITY.flags.writeable = False


_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def _cross(a: Array, b: Array) -> Array:
    """``np.cross`` of (..., 3), a third of its time on small arrays."""
    return np.asarray(a.take(_NEXT, -1) * b.take(_LAST, -1) - a.take(_LAST, -1) * b.take(_NEXT, -1))


def mul(a: ArrayLike, b: ArrayLike) -> Array:
    """Compose rotations: ``mul(q_a_b, q_b_c) = q_a_c``, shape (..., 4)."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    av, aw, bv, bw = a[..., :3], a[..., 3:], b[..., :3], b[..., 3:]
    vector = aw * bv + bw * av + _cross(av, bv)
    scalar = aw * bw - np.sum(av * bv, axis=-1, keepdims=True)
    return np.concatenate([vector, scalar], axis=-1)


def inv(q: ArrayLike) -> Array:
    """Inverse of unit quaternions, shape (..., 4)."""
    return np.asarray(np.asarray(q, float) * [-1.0, -1.0, -1.0, 1.0])


def mul_vec(q: ArrayLike, v: ArrayLike) -> Array:
    """Rotate vectors (..., 3) by unit quaternions (..., 4)."""
    q, v = np.asarray(q, float), np.asarray(v, float)
    axis = q[..., :3]
    t = 2.0 * _cross(axis, v)
    return np.asarray(v + q[..., 3:] * t + _cross(axis, t))


def normalised(q: ArrayLike) -> Array:
    """Scale to unit length; a zero quaternion becomes the identity."""
    q = np.asarray(q, float)
    norm = np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(norm > 1e-12, q / np.where(norm > 1e-12, norm, 1.0), IDENTITY)


def from_axis_angle(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Rotation by ``angle`` [rad] (...,) about unit ``axis`` (..., 3)."""
    half = np.asarray(angle, float)[..., None] / 2.0
    axis = np.broadcast_to(np.asarray(axis, float), (*half.shape[:-1], 3))
    return np.concatenate([axis * np.sin(half), np.cos(half)], axis=-1)


def from_vector(v: ArrayLike) -> Array:
    """Rotations (..., 4) of rotation vectors (..., 3) [rad]."""
    v = np.asarray(v, float)
    return np.asarray(Rotation.from_rotvec(v.reshape(-1, 3)).as_quat().reshape(*v.shape[:-1], 4))


def to_vector(q: ArrayLike) -> Array:
    """Rotation vectors (..., 3) of rotations (..., 4), of length 0 to pi [rad]."""
    q = np.asarray(q, float)
    return np.asarray(Rotation.from_quat(q.reshape(-1, 4)).as_rotvec().reshape(*q.shape[:-1], 3))


def between(u: ArrayLike, v: ArrayLike) -> Array:
    """Shortest rotation that takes unit vector ``u`` (..., 3) to ``v``; half turns about any normal axis."""
    u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
    q = np.concatenate([np.cross(u, v), 1.0 + np.sum(u * v, axis=-1, keepdims=True)], axis=-1)
    opposite = np.linalg.norm(q, axis=-1) < 1e-9
    if np.any(opposite):
        helper = np.where(np.abs(u[..., :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
        normal = np.cross(u, helper)
        turn = np.concatenate([normal, np.zeros_like(normal[..., :1])], axis=-1)
        q = np.where(opposite[..., None], turn, q)
    return normalised(q)


def from_axes(x: ArrayLike, y: ArrayLike, z: ArrayLike) -> Array:
    """Rotation whose matrix has the orthonormal columns ``x``, ``y``, ``z`` (..., 3)."""
    matrix = np.stack([np.asarray(x, float), np.asarray(y, float), np.asarray(z, float)], axis=-1)
    quat = Rotation.from_matrix(matrix.reshape(-1, 3, 3)).as_quat()
    return np.asarray(quat.reshape((*matrix.shape[:-2], 4)), float)


def from_euler(order: str, angles: ArrayLike) -> Array:
    """Intrinsic Euler angles [rad] (..., 3), e.g. ``order="ZXY"`` as in BVH, to quaternions (..., 4)."""
    angles = np.asarray(angles, float)
    quat = Rotation.from_euler(order.upper(), angles.reshape(-1, len(order))).as_quat()
    return np.asarray(quat.reshape((*angles.shape[:-1], 4)), float)


def to_euler(order: str, q: ArrayLike) -> Array:
    """Quaternions (..., 4) to intrinsic Euler angles [rad] (..., 3); at gimbal lock the last is zero."""
    q = np.asarray(q, float)
    angles = Rotation.from_quat(q.reshape(-1, 4)).as_euler(order.upper(), suppress_warnings=True)
    return np.asarray(angles.reshape((*q.shape[:-1], 3)), float)


def angle(q: ArrayLike) -> Array:
    """Rotation angle in [0, pi] [rad] of unit quaternions (..., 4), accurate near zero."""
    q = np.asarray(q, float)
    return np.asarray(2.0 * np.arctan2(np.linalg.norm(q[..., :3], axis=-1), np.abs(q[..., 3])), float)


def mean(q: ArrayLike) -> Array:
    """Chordal mean of quaternions along the first axis: (F, ..., 4) -> (..., 4)."""
    q = np.asarray(q, float)
    scatter = np.einsum("f...i,f...j->...ij", q, q)
    _, vectors = np.linalg.eigh(scatter)
    return np.asarray(vectors[..., -1], float)


def unit(v: ArrayLike) -> Array:
    """Scale vectors (..., 3) to unit length; vectors shorter than 1e-9 become zero."""
    v = np.asarray(v, float)
    norm = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.where(norm > 1e-9, v / np.where(norm > 1e-9, norm, 1.0), 0.0)
