"""What the rows of all kinds share: how much is asked for, and directions across a line."""

from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper

RADIAN = 0.2  # metres that a radian counts for
OFF, EQUAL, WAITING, ENFORCED = 0.0, 1.0, 2.0, 3.0
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
NONE = (0.0, 0.0, 0.0)


@helper
def triple(values, b, column):
    return (values[b, column], values[b, column + 1], values[b, column + 2])


@helper
def perpendicular(u):
    """A unit vector perpendicular to the unit vector u."""
    if abs(u[0]) < 0.6:
        return vec.unit(vec.cross(u, X))
    return vec.unit(vec.cross(u, Y))


@helper
def limited(error, gain, step):
    """Factor that makes the wanted change ``gain`` of the error, at most ``step`` (norms)."""
    if error * gain <= step:
        return gain
    return step / error
