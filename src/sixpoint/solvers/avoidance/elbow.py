"""An arm whose elbow is in the trunk gets it out: swivelled, or straight where it misses.

A bent arm turns about the line from shoulder to wrist, so the wrist stays where it is. ``clear_arm`` turns it
outward by K times the depth over the length of the upper arm, then by secant steps to the same side
(``step_out``); where these do not get it out, to the nearest free angle on either side (``find_free``).
``clear_arm_steadily`` looks for that at once, from the angle of the last frame. An arm that misses its target
turns about v x w by arccos(v . w), where v and w are the directions from the shoulder to the deepest point
and to the nearest point of the outline.

Where this differs from the paper: it repeats steps of K times the depth to one side until the elbow is out;
here later steps are secants, since those creep or overshoot, and both sides are searched where the first is
barred by limits or flesh. It turns an arm about v x w that must be almost or fully stretched to reach; here
only one that misses anyway, since a nearly stretched arm would leave its target, and its swivel angle still
moves the elbow (by 6 cm where the arm is 2 % longer than its target is far).

Reference: Unzueta et al. 2008, section 8 and Algorithm 5, line 7.
"""

from math import pi

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.kernels.swing_twist import clamp
from sixpoint.solvers.avoidance.clearance import OUTSIDE, deepest, gap_of_arm
from sixpoint.solvers.avoidance.swivel import (
    HALVES,
    LARGEST_STEP,
    LEAST_STEP,
    TOUCH,
    find_free,
    gap_at,
    make_circle,
    refine,
    step_out,
    within,
)
from sixpoint.solvers.sequential.limb import close_on, fold, turn_about_itself
from sixpoint.solvers.sequential_plus.limbs import carried_angle
from sixpoint.solvers.tgb.swivel import hinge_at, root_at, triangle

K = 1.0  # of a bent arm's first turn
MET = 1e-3  # m, an arm that misses by less is on its target
STRETCHES = 2  # turns of a stretched arm
COARSE_STEP = pi / 4  # rad, in which an arm that misses looks for another swivel angle
STRAIGHT = 0.01  # sine between upper arm and target below which a swivel angle moves nothing
GIVES = 0.02  # m, an arm that misses by so much gives way wholly


@helper
def close_arm(arm, balls, upper):
    """An upper arm set within the limits and turned about itself; the elbow flexes towards the target."""
    if arm.limits:
        upper, _ = clamp(balls, arm.ball, upper)
        return close_on(upper, arm.target, arm.l1, arm.l2, -1.0, balls, arm.ball, arm.low, arm.high)
    y = qt.y_axis(upper)
    reach = vec.madd(arm.target, arm.l1, y)
    v = vec.reject(reach, y)
    if vec.norm(v) > 1e-6 * arm.l2:
        upper = turn_about_itself(upper, y, v, -1.0)
    return fold(upper, reach, arm.l1, arm.l2, -1.0, 0.0, pi)


@helper
def turn_stretched(arm, flesh, root, world, segs, balls, upper, hinge, end, before, found, share):
    """An arm that misses its target turns out of the trunk, a share of the way; then closes on the target.

    ``before`` is its distance from the trunk as it is [m], ``found`` what is ``deepest`` there.
    """
    turned = upper
    depth, p_e, p_t = found
    for k in range(STRETCHES):
        if depth <= TOUCH:
            break
        v = vec.unit(qt.inv_mul_vec(arm.frame, vec.sub(p_e, arm.shoulder)))
        w = vec.unit(qt.inv_mul_vec(arm.frame, vec.sub(p_t, arm.shoulder)))
        turned = qt.normalised(qt.mul(qt.arc(v, w, qt.x_axis(turned)), turned))
        if k < STRETCHES - 1:
            here = vec.add(arm.shoulder, qt.mul_vec(arm.frame, vec.scale(-arm.l1, qt.y_axis(turned))))
            lower = qt.mul_vec(qt.mul(turned, hinge), (0.0, -arm.l2, 0.0))
            wrist = vec.add(here, qt.mul_vec(arm.frame, lower))
            depth, p_e, p_t = deepest(flesh, root, world, segs, arm.shoulder, here, wrist)
    turned = qt.normalised(qt.mul(upper, qt.scaled(qt.inv_mul(upper, turned), share)))
    root_turn, bent, there = close_arm(arm, balls, turned)
    here = vec.add(arm.shoulder, qt.mul_vec(arm.frame, vec.scale(-arm.l1, qt.y_axis(root_turn))))
    wrist = vec.add(arm.shoulder, qt.mul_vec(arm.frame, there))
    if gap_of_arm(flesh, root, world, segs, arm.shoulder, here, wrist) > before + 1e-4:
        return root_turn, bent, there
    return upper, hinge, end


@helper
def clear_arm(arm, flesh, root, world, segs, balls, upper, hinge, end):
    """Sequential IK: an arm as posed, or with its elbow out of the trunk, whatever the frame before.

    Returns the local rotations of shoulder and elbow, and the wrist in the arm's frame.
    """
    elbow = vec.scale(-arm.l1, qt.y_axis(upper))
    here = vec.add(arm.shoulder, qt.mul_vec(arm.frame, elbow))
    wrist = vec.add(arm.shoulder, qt.mul_vec(arm.frame, end))
    gap = gap_of_arm(flesh, root, world, segs, arm.shoulder, here, wrist)
    if gap >= 0.0:
        return upper, hinge, end
    circle = make_circle(arm, elbow)
    if vec.norm(vec.sub(end, arm.target)) > MET:
        d, _, _, flexion = triangle(vec.norm(arm.target), arm.l1, arm.l2)
        if circle.sine >= STRAIGHT and (not arm.limits or arm.low <= flexion <= arm.high):
            # Another angle may be free and meet the target, which the limits kept this one from.
            first = 1.0 if vec.dot(circle.beside, vec.sub(arm.shoulder, root)) >= 0.0 else -1.0
            phi, out = find_free(
                arm, circle, flesh, root, world, segs, balls, 0.0, OUTSIDE, first, COARSE_STEP, COARSE_STEP
            )
            if out:
                turned = root_at(circle.n, circle.u, circle.cosine, circle.sine, -1.0, phi)
                return turned, hinge_at(-1.0, flexion), vec.scale(d, circle.n)
        found = deepest(flesh, root, world, segs, arm.shoulder, here, wrist)
        return turn_stretched(arm, flesh, root, world, segs, balls, upper, hinge, end, gap, found, 1.0)
    if circle.sine < STRAIGHT:
        return upper, hinge, end
    depth, p_e, p_t = deepest(flesh, root, world, segs, arm.shoulder, here, wrist)
    outward = 1.0 if vec.dot(circle.beside, vec.sub(p_t, p_e)) >= 0.0 else -1.0
    step = max(K * depth / arm.l1, LEAST_STEP)
    phi, out = step_out(arm, circle, flesh, root, world, segs, balls, gap, outward * step)
    if not out:
        phi, _ = find_free(
            arm, circle, flesh, root, world, segs, balls, 0.0, gap, outward, step, LARGEST_STEP
        )
    return root_at(circle.n, circle.u, circle.cosine, circle.sine, -1.0, phi), hinge, end


@helper
def clear_arm_steadily(arm, flesh, root, world, segs, balls, upper, hinge, end, gap, began, was, bent, most):
    """SIK+: an arm with the swivel angle nearest to that of the last frame which is allowed.

    ``gap`` is its distance from the trunk as it is posed, negative [m].
    ``was`` and ``bent`` are the rotations of the last frame, if it ``began`` before; the angle moves by
    ``most`` [rad] per frame, but for what it moves to be where ``upper`` has it. An elbow that cannot be out
    in this frame is on its way.
    """
    elbow = vec.scale(-arm.l1, qt.y_axis(upper))
    here = vec.add(arm.shoulder, qt.mul_vec(arm.frame, elbow))
    wrist = vec.add(arm.shoulder, qt.mul_vec(arm.frame, end))
    missed = vec.norm(vec.sub(end, arm.target))
    if missed > MET:
        share = min((missed - MET) / GIVES, 1.0)
        found = deepest(flesh, root, world, segs, arm.shoulder, here, wrist)
        return turn_stretched(arm, flesh, root, world, segs, balls, upper, hinge, end, gap, found, share)
    circle = make_circle(arm, elbow)
    if circle.sine < STRAIGHT:
        return upper, hinge, end
    before, far, at_before = 0.0, pi, gap
    if began:
        before = carried_angle(circle.n, circle.u, -1.0, was, bent, arm.l1, arm.l2)
        far = most
        at_before = gap_at(arm, circle, flesh, root, world, segs, before)
        if not within(arm, circle, balls, before):
            at_before = -OUTSIDE
        if at_before >= TOUCH:
            phi = refine(arm, circle, flesh, root, world, segs, balls, before, 0.0, at_before)
            return root_at(circle.n, circle.u, circle.cosine, circle.sine, -1.0, phi), hinge, end
    _, p_e, p_t = deepest(flesh, root, world, segs, arm.shoulder, here, wrist)
    outward = 1.0 if vec.dot(circle.beside, vec.sub(p_t, p_e)) >= 0.0 else -1.0
    phi, _ = find_free(
        arm, circle, flesh, root, world, segs, balls, before, at_before, outward, LEAST_STEP, LARGEST_STEP
    )
    turn = min(max(phi - before, -far), far)
    for _ in range(HALVES):
        if within(arm, circle, balls, before + turn):
            phi = before + turn
            return root_at(circle.n, circle.u, circle.cosine, circle.sine, -1.0, phi), hinge, end
        turn *= 0.5
    return upper, hinge, end
