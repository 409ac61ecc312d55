"""Unit quaternions xyzw as tuples of floats; ``mul_vec(q_a_b, v_b)`` is ``v_a``."""

from math import atan2, cos, sin, sqrt

from sixpoint.kernels.jit import helper
from sixpoint.kernels.vector import cross, dot

IDENTITY = (0.0, 0.0, 0.0, 1.0)


@helper
def load(array, i):
    return (array[i, 0], array[i, 1], array[i, 2], array[i, 3])


@helper
def store(array, i, q):
    array[i, 0] = q[0]
    array[i, 1] = q[1]
    array[i, 2] = q[2]
    array[i, 3] = q[3]


@helper
def mul(a, b):
    return (
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] + a[1] * b[3] + a[2] * b[0] - a[0] * b[2],
        a[3] * b[2] + a[2] * b[3] + a[0] * b[1] - a[1] * b[0],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    )


@helper
def inv_mul(a, b):
    """inv(a) b."""
    return (
        a[3] * b[0] - a[0] * b[3] - a[1] * b[2] + a[2] * b[1],
        a[3] * b[1] - a[1] * b[3] - a[2] * b[0] + a[0] * b[2],
        a[3] * b[2] - a[2] * b[3] - a[0] * b[1] + a[1] * b[0],
        a[3] * b[3] + a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
    )


@helper
def inv(a):
    return (-a[0], -a[1], -a[2], a[3])


@helper
def normalised(q):
    length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if length < 1e-12:
        return (0.0, 0.0, 0.0, 1.0)
    return (q[0] / length, q[1] / length, q[2] / length, q[3] / length)


@helper
def mul_vec(q, v):
    tx = 2.0 * (q[1] * v[2] - q[2] * v[1])
    ty = 2.0 * (q[2] * v[0] - q[0] * v[2])
    tz = 2.0 * (q[0] * v[1] - q[1] * v[0])
    return (
        v[0] + q[3] * tx + q[1] * tz - q[2] * ty,
        v[1] + q[3] * ty + q[2] * tx - q[0] * tz,
        v[2] + q[3] * tz + q[0] * ty - q[1] * tx,
    )


@helper
def inv_mul_vec(q, v):
    return mul_vec((-q[0], -q[1], -q[2], q[3]), v)


@helper
def x_axis(q):
    return (
        1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2]),
        2.0 * (q[0] * q[1] + q[3] * q[2]),
        2.0 * (q[0] * q[2] - q[3] * q[1]),
    )


@helper
def y_axis(q):
    return (
        2.0 * (q[0] * q[1] - q[3] * q[2]),
        1.0 - 2.0 * (q[0] * q[0] + q[2] * q[2]),
        2.0 * (q[1] * q[2] + q[3] * q[0]),
    )


@helper
def z_axis(q):
    return (
        2.0 * (q[0] * q[2] + q[3] * q[1]),
        2.0 * (q[1] * q[2] - q[3] * q[0]),
        1.0 - 2.0 * (q[0] * q[0] + q[1] * q[1]),
    )


@helper
def from_axis_angle(axis, angle):
    s = sin(0.5 * angle)
    return (s * axis[0], s * axis[1], s * axis[2], cos(0.5 * angle))


@helper
def arc(u, v, fallback):
    """Shortest rotation from unit u to unit v; a half turn about the unit vector ``fallback`` if opposite."""
    w = 1.0 + dot(u, v)
    if w < 1e-12:
        return (fallback[0], fallback[1], fallback[2], 0.0)
    c = cross(u, v)
    return normalised((c[0], c[1], c[2], w))


@helper
def twist_angle(q, axis):
    """Signed rotation angle of q about a unit axis, in (-pi, pi]: the twist of the swing-twist split."""
    s, c = q[0] * axis[0] + q[1] * axis[1] + q[2] * axis[2], q[3]
    if c < 0.0:
        s, c = -s, -c
    return 2.0 * atan2(s, c)


@helper
def from_axes(x, y, z):
    """Rotation whose matrix has the orthonormal columns x, y, z."""
    trace = x[0] + y[1] + z[2]
    if trace > 0.0:
        q = (y[2] - z[1], z[0] - x[2], x[1] - y[0], 1.0 + trace)
    elif x[0] >= y[1] and x[0] >= z[2]:
        q = (1.0 + x[0] - y[1] - z[2], y[0] + x[1], z[0] + x[2], y[2] - z[1])
    elif y[1] >= z[2]:
        q = (y[0] + x[1], 1.0 - x[0] + y[1] - z[2], z[1] + y[2], z[0] - x[2])
    else:
        q = (z[0] + x[2], z[1] + y[2], 1.0 - x[0] - y[1] + z[2], x[1] - y[0])
    return normalised(q)


@helper
def scaled(q, t):
    """The rotation q by a fraction t of its angle: slerp from the identity."""
    x, y, z, w = q
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    s = sqrt(x * x + y * y + z * z)
    if s < 1e-12:
        return (0.0, 0.0, 0.0, 1.0)
    half = t * atan2(s, w)
    k = sin(half) / s
    return (k * x, k * y, k * z, cos(half))


@helper
def exp(w):
    """Rotation by the rotation vector w."""
    angle = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    half = 0.5 * angle
    k = 0.5 - half * half / 12.0 if angle < 1e-4 else sin(half) / angle
    return (k * w[0], k * w[1], k * w[2], cos(half))


@helper
def log(q):
    """Rotation vector of q, of length 0 to pi."""
    x, y, z, w = q
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    s = sqrt(x * x + y * y + z * z)
    k = 2.0 if s < 1e-9 else 2.0 * atan2(s, w) / s
    return (k * x, k * y, k * z)
