"""Vectors and unit quaternions xyzw as tensors (..., 3) and (..., 4), differentiable everywhere."""

from __future__ import annotations

import torch
from torch import Tensor

TINY = 1e-12


def dot(a: Tensor, b: Tensor) -> Tensor:
    """Scalar product, its axis kept."""
    return (a * b).sum(-1, keepdim=True)


def length(v: Tensor) -> Tensor:
    """Euclidean norm, its axis kept."""
    return torch.sqrt(dot(v, v) + TINY)


def unit(v: Tensor) -> Tensor:
    """Vector of length one."""
    return v / length(v)


def reject(v: Tensor, axis: Tensor) -> Tensor:
    """Part of v across a unit axis."""
    return v - dot(v, axis) * axis


def cross(a: Tensor, b: Tensor) -> Tensor:
    """Vector product."""
    return torch.linalg.cross(*torch.broadcast_tensors(a, b))


def mul(a: Tensor, b: Tensor) -> Tensor:
    """Product of quaternions."""
    ax, ay, az, aw = a.unbind(-1)
    bx, by, bz, bw = b.unbind(-1)
    return torch.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        -1,
    )


def inv(q: Tensor) -> Tensor:
    """Inverse of a unit quaternion."""
    return q * q.new_tensor([-1.0, -1.0, -1.0, 1.0])


def turn(q: Tensor, v: Tensor) -> Tensor:
    """The vector v rotated by q."""
    u, w = q[..., :3], q[..., 3:]
    t = 2.0 * cross(u, v)
    return v + w * t + cross(u, t)


def exp(w: Tensor) -> Tensor:
    """Rotation by a rotation vector [rad]."""
    a = length(w)
    return torch.cat([w * (torch.sin(0.5 * a) / a), torch.cos(0.5 * a)], -1)


def log(q: Tensor) -> Tensor:
    """Rotation vector of q [rad]."""
    q = torch.where(q[..., 3:] < 0.0, -q, q)
    s = length(q[..., :3])
    return q[..., :3] * (2.0 * torch.atan2(s, q[..., 3:]) / s)


def angle(q: Tensor) -> Tensor:
    """Rotation angle (...,) [rad]."""
    return 2.0 * torch.atan2(torch.sqrt((q[..., :3] ** 2).sum(-1) + 1e-10), q[..., 3].abs())


def from_axes(x: Tensor, y: Tensor) -> Tensor:
    """Rotation with the X and Y axes given, orthonormal."""
    xx, xy, xz = x.unbind(-1)
    yx, yy, yz = y.unbind(-1)
    zx, zy, zz = cross(x, y).unbind(-1)
    # The column of the largest diagonal is the quaternion, up to its length.
    k = torch.stack(
        [
            torch.stack([1 + xx - yy - zz, yx + xy, zx + xz, yz - zy], -1),
            torch.stack([yx + xy, 1 - xx + yy - zz, zy + yz, zx - xz], -1),
            torch.stack([zx + xz, zy + yz, 1 - xx - yy + zz, xy - yx], -1),
            torch.stack([yz - zy, zx - xz, xy - yx, 1 + xx + yy + zz], -1),
        ],
        -2,
    )
    best = torch.diagonal(k, dim1=-2, dim2=-1).argmax(-1)
    return unit(torch.gather(k, -2, best[..., None, None].expand(*best.shape, 1, 4)).squeeze(-2))
