"""Three-vectors as tuples of floats: no allocation, and every helper is also plain Python."""

from math import sqrt

from sixpoint.kernels.jit import helper


@helper
def load(array, i):
    return (array[i, 0], array[i, 1], array[i, 2])


@helper
def store(array, i, v):
    array[i, 0] = v[0]
    array[i, 1] = v[1]
    array[i, 2] = v[2]


@helper
def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@helper
def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@helper
def scale(s, a):
    return (s * a[0], s * a[1], s * a[2])


@helper
def madd(a, s, b):
    """Sum of a and s times b."""
    return (a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2])


@helper
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@helper
def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@helper
def norm(a):
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@helper
def unit(a):
    """Unit vector, or zero where the length is below 1e-9."""
    length = norm(a)
    if length < 1e-9:
        return (0.0, 0.0, 0.0)
    return (a[0] / length, a[1] / length, a[2] / length)


@helper
def reject(a, n):
    """Part of a perpendicular to the unit vector n."""
    return madd(a, -dot(a, n), n)
