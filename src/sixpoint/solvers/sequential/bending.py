"""The bending law: all trunk segments turn about one axis v by shares of the pelvis' angle phi (eq. 1).

So the chord pelvis-head is a sum of plane rotations, and the search for the phi that gives it a wanted
length costs a few multiplications a step (Unzueta et al. 2008, section 4 and Algorithm 3).
"""

from math import cos, sin, sqrt

from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper

COARSE, FINE = 0.1, 0.01  # rad, Algorithm 3
COARSE_CAP, FINE_CAP = 40, 20
STALL = 1e-5  # m, a coarse step that changes the chord by less leads nowhere
EXACT = 1e-10  # m


@helper
def plane_components(segs, v, flat):
    """Write the parts of the segments across v into flat (S, 2); return the length along v."""
    helper_axis = (1.0, 0.0, 0.0) if abs(v[0]) < 0.7 else (0.0, 1.0, 0.0)
    e1 = vec.unit(vec.cross(v, helper_axis))
    e2 = vec.cross(v, e1)
    along = 0.0
    for k in range(segs.shape[0]):
        s = vec.load(segs, k)
        along += vec.dot(s, v)
        flat[k, 0] = vec.dot(s, e1)
        flat[k, 1] = vec.dot(s, e2)
    return along


@helper
def flat_chord(segments, flat, phi):
    """Chord across v after turning by phi: length squared and half its derivative.

    The angles of the segments are in arithmetic progression (eq. 1), so two sines and cosines give all.
    """
    x, y, dx, dy = 0.0, 0.0, 0.0, 0.0
    first = segments[0, 3]
    step = segments[1, 3] - first if flat.shape[0] > 1 else 0.0
    c, s = cos(first * phi), sin(first * phi)
    c_step, s_step = cos(step * phi), sin(step * phi)
    for k in range(flat.shape[0]):
        share = segments[k, 3]
        px = c * flat[k, 0] - s * flat[k, 1]
        py = s * flat[k, 0] + c * flat[k, 1]
        x += px
        y += py
        dx -= share * py
        dy += share * px
        c, s = c * c_step - s * s_step, s * c_step + c * s_step
    return x * x + y * y, x * dx + y * dy


@helper
def _refine(segments, flat, goal, inside, f_inside, outside, squared, slope, along):
    """Newton's method kept inside the bracket; f = chord squared minus goal.

    ``squared`` and ``slope`` are of the angle ``outside``, where it begins.
    """
    phi = outside
    tolerance = 2.0 * sqrt(max(goal + along * along, 1e-12)) * EXACT
    for _ in range(40):
        f = squared - goal
        if abs(f) < tolerance:
            break
        if (f > 0.0) == (f_inside > 0.0):
            inside, f_inside = phi, f
        else:
            outside = phi
        newton = phi - f / (2.0 * slope) if slope != 0.0 else outside
        phi = newton if (newton - inside) * (newton - outside) < 0.0 else 0.5 * (inside + outside)
        squared, slope = flat_chord(segments, flat, phi)
    return phi


@helper
def search_angle(segments, flat, along, wanted, literal):
    """Angle phi of the pelvis for which the chord has the wanted length (Algorithm 3).

    Coarse steps of 0.1 rad until the length is passed, then either fine steps of 0.01 rad back
    (``literal``) or Newton's method inside the last coarse step, which meets the length exactly.

    Returns:
        phi [rad] and whether the length was met; if not, phi is the best found.
    """
    squared, slope = flat_chord(segments, flat, 0.0)
    inner = squared
    goal = wanted * wanted - along * along
    sign = 1.0 if squared > goal else -1.0
    length = sqrt(squared + along * along)
    step, phi, steps = -sign, 0.0, 0
    flipped = False
    best_phi, best_gap = 0.0, abs(length - wanted)
    passed = abs(length - wanted) < EXACT
    while not passed and steps < COARSE_CAP:
        phi += step * COARSE
        steps += 1
        inner = squared
        squared, slope = flat_chord(segments, flat, phi)
        before, length = length, sqrt(squared + along * along)
        passed = sign * squared <= sign * goal
        gap = abs(length - wanted)
        if passed:
            break
        if gap < best_gap:
            best_phi, best_gap = phi, gap
        elif steps == 1 and not flipped:
            flipped, step, phi, steps = True, sign, 0.0, 0
            length, squared = before, inner
        else:
            return best_phi, False
        if abs(length - before) < STALL and steps > 0:
            return best_phi, False
    if not passed:
        return best_phi, False
    if phi == 0.0:
        return phi, True
    if literal:
        for _ in range(FINE_CAP):
            phi -= step * FINE
            if sign * flat_chord(segments, flat, phi)[0] >= sign * goal:
                break
        return phi, True
    inside = phi - step * COARSE
    return _refine(segments, flat, goal, inside, inner - goal, phi, squared, slope, along), True
