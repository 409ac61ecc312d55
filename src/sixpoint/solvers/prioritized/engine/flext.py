"""The FLEXT constraint: how a limb must flex so that its end moves a given way towards, or from, its root.

A limb is a root joint at O_r, a hinge at O_m with the unit axis f, and an effector E beyond the hinge. In
the plane through O_r normal to f (the FLEXT plane) they form a triangle with the sides L1, L2, L3. Its
angles follow from the cosine rule at every distance, also at full extension, where a Jacobian is blind.

Reference: Boulic and Raunhardt 2009, section 5 and appendix A.
"""

from math import acos, atan2, cos, pi, sin, sqrt

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper

NULL = 1e-7  # a wanted change of length below this is none [m]
VIRTUAL = 1e-3  # the virtual displacement, over the length of the limb
STRAIGHT = 1e-6  # a bend below this has no side of its own [rad]
SECANT = 0.02  # the least change of length that a secant is taken over, over the length of the limb
MARGIN = 1e-6  # the limits 12 and 13 are strict


@helper
def acosc(x):
    return acos(min(max(x, -1.0), 1.0))


@helper
def wrapped(angle):
    while angle > pi:
        angle -= 2.0 * pi
    while angle < -pi:
        angle += 2.0 * pi
    return angle


@helper
def triangle(root, middle, end, axis):
    """The FLEXT plane's triangle (appendix A): L1, L2, L3 [m], sigma, alpha [rad], offset [m].

    Sigma is the signed bend about the axis (0 when straight), alpha the signed angle at the root, and the
    offset is how far the effector lies off the plane.
    """
    a = vec.reject(vec.sub(middle, root), axis)
    b = vec.reject(vec.sub(end, middle), axis)
    c = vec.add(a, b)
    sigma = atan2(vec.dot(axis, vec.cross(a, b)), vec.dot(a, b))
    alpha = atan2(vec.dot(axis, vec.cross(a, c)), vec.dot(a, c))
    offset = vec.dot(vec.sub(end, root), axis)
    return vec.norm(a), vec.norm(b), vec.norm(c), sigma, alpha, offset


@helper
def length_at(l1, l2, sigma):
    """L3 [m] at a bend sigma."""
    return sqrt(max(l1 * l1 + l2 * l2 + 2.0 * l1 * l2 * cos(sigma), 0.0))


@helper
def branch_range(l1, l2, side, low, high):
    """Least and largest L3 on one side of the straight limb, for bends between low and high.

    Returns a range with its ends swapped when the hinge cannot bend to that side at all.
    """
    near, far = (max(low, 0.0), min(high, pi)) if side > 0.0 else (max(-high, 0.0), min(-low, pi))
    if near > far:
        return 1.0, 0.0
    shortest = abs(l1 - l2) * (1.0 + MARGIN) + MARGIN * (l1 + l2)
    longest = (l1 + l2) * (1.0 - MARGIN)
    return max(length_at(l1, l2, far), shortest), min(length_at(l1, l2, near), longest)


@helper
def solve_triangle(l1, l2, l3, sigma, alpha, wanted, standard, low, high):
    """Changes of the root's and the hinge's angle about f that change L3 by ``wanted``, as far as possible.

    Args:
        l1, l2, l3: Sides of the triangle [m].
        sigma, alpha: Signed bend and signed angle at the root [rad].
        wanted: Wanted change of L3 [m].
        standard: +1 or -1, the sign of the normal way to bend.
        low, high: Range of the bend that the hinge's limits leave [rad].

    Returns:
        Change at the root, at the hinge [rad], and 1 if it is to be done, 0 if it only shows which joint
        variations the constraint occupies (a virtual displacement), -1 if there is nothing to constrain.
        Then how much of the wish is out of reach [m].

    Reference: eqs. 4-8, 12, 13; sections 5.1 and 5.3.
    """
    if l1 < 1e-6 or l2 < 1e-6:
        return 0.0, 0.0, -1.0, 0.0
    side = standard if abs(sigma) < STRAIGHT else (1.0 if sigma > 0.0 else -1.0)
    shortest, longest = branch_range(l1, l2, side, low, high)
    if side != standard and (shortest > longest or l3 + wanted < shortest):
        # Overextended, and the hinge cannot fold this way: come back over the straight limb.
        other_shortest, other_longest = branch_range(l1, l2, standard, low, high)
        if other_shortest <= other_longest:
            side, shortest, longest = standard, other_shortest, other_longest
    if shortest > longest:  # limits leave (nearly) a single bend
        shortest = longest = min(max(l3, min(shortest, longest)), max(shortest, longest))
    length = min(max(l3 + wanted, shortest), longest)
    beyond = l3 + wanted - length
    todo = 1.0
    if (wanted > -NULL and l3 >= longest) or (wanted < NULL and l3 <= shortest):
        length = l3  # at the end already; the margin of the strict limits is no reason to move
    if abs(length - l3) < NULL:
        todo = 0.0
        step = VIRTUAL * (l1 + l2)
        length = l3 - step if l3 > 0.5 * (shortest + longest) else l3 + step
    before = alpha
    if l3 < MARGIN * (l1 + l2):  # folded onto the root: the angle there is that of the shortest length
        l3 = MARGIN * (l1 + l2)
        before = side * acosc((l1 * l1 - l2 * l2 + l3 * l3) / (2.0 * l1 * l3))
    after = side * acosc((l1 * l1 - l2 * l2 + length * length) / (2.0 * l1 * length))
    bend = side * (pi - acosc((l1 * l1 + l2 * l2 - length * length) / (2.0 * l1 * l2)))
    return -wrapped(after - before), bend - sigma, todo, beyond


@helper
def secant(l1, l2, l3, sigma, alpha, wanted, standard, low, high):
    """Change of L3 over that of the hinge's angle [m/rad] for a wanted change, or for a small one inward.

    Away from full extension and flexion it is near the derivative, which vanishes there.
    """
    _, bend, todo, beyond = solve_triangle(l1, l2, l3, sigma, alpha, wanted, standard, low, high)
    change = wanted - beyond
    if todo <= 0.0 or abs(change) < SECANT * (l1 + l2):
        change = SECANT * (l1 + l2)
        change = -change if l3 > 0.5 * (abs(l1 - l2) + l1 + l2) else change
        _, bend, todo, beyond = solve_triangle(l1, l2, l3, sigma, alpha, change, standard, low, high)
        change -= beyond
    if todo <= 0.0 or abs(bend) < 1e-9:
        return 0.0
    return change / bend


@helper
def exponential(q, axis, angle):
    """Left tangent of the change of exponential-map coordinates when q is turned about an axis of its parent.

    The paper takes the difference of the parameters after and before; here it is carried back to the
    tangent space at q, in which the engine works.

    Reference: section 5.1, "Convert both R' and R"; Grassia 1998.
    """
    v = qt.log(q)
    w = qt.log(qt.mul(qt.from_axis_angle(axis, angle), q))
    length = vec.norm(w)
    if length > 1e-9 and vec.dot(v, w) < 0.0:  # the branch of the logarithm nearest to v
        near = vec.scale(1.0 - 2.0 * pi / length, w)
        if vec.norm(vec.sub(near, v)) < vec.norm(vec.sub(w, v)):
            w = near
    d = vec.sub(w, v)
    phi = vec.norm(v)
    if phi < 1e-4:
        return vec.madd(d, 0.5, vec.cross(v, d))
    # Left Jacobian of the exponential map: I + (1 - cos) / phi^2 [v] + (phi - sin) / phi^3 [v]^2.
    once = vec.cross(v, d)
    twice = vec.cross(v, once)
    return vec.madd(vec.madd(d, (1.0 - cos(phi)) / phi**2, once), (phi - sin(phi)) / phi**3, twice)
