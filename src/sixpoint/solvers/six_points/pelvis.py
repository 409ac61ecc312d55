"""Step 1: the orientation of the pelvis from six positions (Unzueta et al. 2008, section 4).

Y points from pelvis to head. X is a weighted mean of the directions from right to left wrist, from right
to left ankle, and of the previous X, all across Y. Too short or opposing vectors say nothing and drop out.
"""

from math import sqrt

from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper

SHORT = 0.02  # m, a vector across Y shorter than this has no direction worth trusting
OPPOSED = 0.1  # of the sum of weights: below it the directions cancel


@helper
def across(points, left, right, y):
    """Unit direction from the right to the left point across y; zero where it says nothing."""
    if points[left, 3] == 0.0 or points[right, 3] == 0.0:
        return (0.0, 0.0, 0.0)
    v = vec.reject(vec.sub(vec.load(points, left), vec.load(points, right)), y)
    if vec.norm(v) < SHORT:
        return (0.0, 0.0, 0.0)
    return vec.unit(v)


@helper
def says_something(points, y):
    """Whether wrists or ankles tell the pelvis' X axis."""
    return vec.norm(across(points, 2, 3, y)) + vec.norm(across(points, 4, 5, y)) > 0.0


@helper
def estimate_x(points, y, x_previous, has_previous, w1, w2, w3):
    """X axis of the pelvis, a unit vector perpendicular to y.

    ``points`` (6, 4) are the effectors [m], with a 1 for a known point and a 0 for a lost one.
    """
    wrists = across(points, 2, 3, y)
    ankles = across(points, 4, 5, y)
    before = (0.0, 0.0, 0.0)
    if has_previous:
        before = vec.unit(vec.reject(x_previous, y))
    elif w3 > 0.0:  # nothing to remember yet: begin with wrists and ankles alone
        w1, w2 = 1.0, 1.0
    total = vec.add(vec.add(vec.scale(w1, wrists), vec.scale(w2, ankles)), vec.scale(w3, before))
    used = w1 * vec.norm(wrists) + w2 * vec.norm(ankles) + w3 * vec.norm(before)
    if used > 0.0 and vec.norm(total) >= OPPOSED * used:
        return vec.unit(total)
    if vec.norm(before) > 0.5:
        return before
    # Nothing known: the world's X, or its -Z where Y lies along X.
    x = vec.reject((1.0, 0.0, 0.0), y)
    if vec.norm(x) < sqrt(0.5):
        x = vec.reject((0.0, 0.0, -1.0), y)
    return vec.unit(x)
