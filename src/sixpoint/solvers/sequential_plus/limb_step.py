"""A limb of SIK+: where its elbow or knee points, how it is posed, and how its flesh keeps its place."""

from math import pi

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper, specialised
from sixpoint.solvers.avoidance.clearance import gap_of_arm
from sixpoint.solvers.avoidance.elbow import MET, clear_arm_steadily
from sixpoint.solvers.avoidance.shoulder import CLOSE, GAIN, TRIES, angle_range, draw_clavicle
from sixpoint.solvers.avoidance.swivel import make_arm
from sixpoint.solvers.avoidance.thighs import part_thighs, remember_knee
from sixpoint.solvers.sequential_plus.limbs import arm_pole, leg_pole, solve_by_pole
from sixpoint.solvers.sequential_plus.measured import is_measured, pole_of_end, turn_end
from sixpoint.solvers.six_points.frame import end_limb
from sixpoint.solvers.six_points.packing import end_row, limb_row

MISSED = -1.0  # m, deeper than any arm


@helper
def point_limb(s, limb, n, frame, turned):
    """Direction of elbow or knee in the frame of what carries the limb; ``n`` is the limb's line there."""
    side = 1.0 if limb % 2 == 0 else -1.0
    if limb < 2:
        pole = arm_pole(side, n, s.elbow_out, s.elbow_down, s.elbow_back, s.elbow_lift)
    else:
        pole = leg_pole(side, s.knee_out)
    if not is_measured(turned, limb + 2):
        return pole
    end = qt.inv_mul(frame, qt.load(turned, limb + 2))
    if limb < 2:
        return pole_of_end(n, pole, end, side, s.elbow_hand, s.elbow_palm, s.elbow_grip, s.elbow_tilt)
    return pole_of_end(n, pole, end, side, s.knee_shank, s.knee_toes, 0.0, s.knee_tilt)


@helper
def pole_of_start(given, limb, n, frame):
    """Direction of elbow or knee in a given pose, for a limb along ``n`` in ``frame``."""
    x = qt.x_axis(qt.inv_mul(frame, qt.load(given, given.shape[0] - 4 + limb)))
    return vec.scale(-1.0 if limb < 2 else 1.0, vec.cross(n, x))


@helper
def aim_limb(model, s, limb, target, frame, place, pole, began, was, bent):
    """A limb whose middle joint points to ``pole``: its target, two rotations and its end, in ``frame``."""
    row, aim = limb_row(model.segments.shape[0], limb), qt.inv_mul_vec(frame, vec.sub(target, place))
    upper, hinge, end = solve_by_pole(
        aim,
        model.limbs[limb, 0],
        model.limbs[limb, 1],
        -1.0 if limb < 2 else 1.0,
        pole,
        began,
        was,
        bent,
        s.swivel_lag,
        s.swivel_memory,
        s.swivel_speed,
        s.dt,
        s.limits,
        model.balls,
        row,
        model.limbs[limb, 2],
        model.limbs[limb, 3],
    )
    return aim, upper, hinge, end


@helper
def pose_arm(model, s, limb, target, frame, place, pole, began, was, bent, flesh, root, scratch):
    """An arm out of what it must stay out of, if it can; and how far [m], MISSED where the target is."""
    aim, upper, hinge, end = aim_limb(model, s, limb, target, frame, place, pole, began, was, bent)
    world, segs = scratch.world, scratch.segs
    elbow = vec.madd(place, -model.limbs[limb, 0], qt.mul_vec(frame, qt.y_axis(upper)))
    wrist = vec.add(place, qt.mul_vec(frame, end))
    gap = gap_of_arm(flesh, root, world, segs, place, elbow, wrist)
    if gap >= 0.0:
        return upper, hinge, end, gap
    arm, most = make_arm(model, limb, place, frame, aim, s.limits), s.swivel_speed * s.dt
    upper, hinge, end = clear_arm_steadily(
        arm, flesh, root, world, segs, model.balls, upper, hinge, end, gap, began, was, bent, most
    )
    if vec.norm(vec.sub(end, aim)) > MET:
        return upper, hinge, end, MISSED
    elbow = vec.madd(place, -arm.l1, qt.mul_vec(frame, qt.y_axis(upper)))
    return upper, hinge, end, gap_of_arm(flesh, root, world, segs, place, elbow, wrist)


@helper
def pose_arm_at(
    angle, base, model, s, limb, target, frame, place, pole, began, was, bent, flesh, root, scratch
):
    """The same with the clavicle turned by an angle from ``base``; first what carries the shoulder."""
    turned, above, there = base, frame, place
    if angle != 0.0:
        turned, above, there = draw_clavicle(model, s.limits, limb, angle, base, scratch.world, frame, place)
    upper, hinge, end, gap = pose_arm(
        model, s, limb, target, above, there, pole, began, was, bent, flesh, root, scratch
    )
    return turned, above, there, upper, hinge, end, gap


@helper
def pose_arm_freely(
    model, s, limb, target, frame, place, pole, began, was, bent, flesh, root, scratch, local
):
    """An arm out of the trunk by its swivel angle, or else by the clavicle too, see ``avoidance.shoulder``.

    Returns what carries the shoulder and where that is, then as ``aim_limb``.
    """
    base = qt.load(local, model.segments.shape[0] + limb)
    low, high = angle_range(flesh.memory[limb + 2, 3], began, s.dt)
    angle = min(max(0.0, low), high)
    best = pose_arm_at(
        angle, base, model, s, limb, target, frame, place, pole, began, was, bent, flesh, root, scratch
    )
    if MISSED < best[6] < 0.0 and vec.norm(vec.load(model.clavicles, limb)) > 1e-9:
        a, inside = angle, best
        for i in range(2):
            b = high if i == 0 else low
            if b == a or angle * b < 0.0:
                continue
            found = pose_arm_at(
                b, base, model, s, limb, target, frame, place, pole, began, was, bent, flesh, root, scratch
            )
            if found[6] > best[6] + GAIN:
                angle, best = b, found
        fa, fb, b = inside[6], best[6], angle
        if fb >= 0.0:
            for _ in range(TRIES):  # Illinois
                if abs(a - b) < CLOSE:
                    break
                c = (a * fb - b * fa) / (fb - fa)
                found = pose_arm_at(
                    c,
                    base,
                    model,
                    s,
                    limb,
                    target,
                    frame,
                    place,
                    pole,
                    began,
                    was,
                    bent,
                    flesh,
                    root,
                    scratch,
                )
                if found[6] >= 0.0:
                    b, fb, fa, angle, best = c, found[6], 0.5 * fa, c, found
                else:
                    a, fa, fb = c, found[6], 0.5 * fb
    flesh.memory[limb + 2, 3] = angle
    qt.store(local, model.segments.shape[0] + limb, best[0])
    return best[1], best[2], best[3], best[4], best[5]


@specialised
def pose_limb(
    model, s, limb, target, frame, place, pole, turned, began, flesh, root, scratch, local, residual
):
    """A limb whose middle joint points to ``pole``, and its extremity.

    ``flesh`` is what arms stay out of, or None: the compiler then leaves that out.
    """
    count = model.segments.shape[0]
    row = limb_row(count, limb)
    was, bent = qt.load(local, row), qt.load(local, row + 2)
    aim, upper, hinge, end = aim_limb(model, s, limb, target, frame, place, pole, began, was, bent)
    if flesh is not None:
        l1, l2 = model.limbs[limb, 0], model.limbs[limb, 1]
        remember_knee(flesh.thighs, flesh.placed, limb, aim, upper, began, was, bent, l1, l2)
        if limb < 2:
            elbow = vec.madd(place, -l1, qt.mul_vec(frame, qt.y_axis(upper)))
            wrist = vec.add(place, qt.mul_vec(frame, end))
            gap = gap_of_arm(flesh, root, scratch.world, scratch.segs, place, elbow, wrist)
            if gap < 0.0 or flesh.memory[limb + 2, 3] != 0.0:
                frame, place, upper, hinge, end = pose_arm_freely(
                    model, s, limb, target, frame, place, pole, began, was, bent, flesh, root, scratch, local
                )
    end_limb(target, limb, row, frame, place, upper, hinge, end, local, residual)
    if turned.shape[0] > 0:
        above = qt.mul(qt.mul(frame, upper), hinge)
        turn_end(end_row(count, limb + 1), above, turned, limb + 2, s.limits, model.balls, local)


@specialised
def part_legs(model, s, turned, began, flesh, root, scratch, local, residual):
    """Thighs that are in each other part, feet stay as they are; done where ``flesh`` asks for it."""
    if flesh is not None:
        most = s.swivel_speed * s.dt if began else pi
        part_thighs(
            flesh.thighs,
            flesh.placed,
            model,
            s.limits,
            root,
            scratch.filled,
            local,
            scratch.world,
            residual,
            most,
        )
        if turned.shape[0] > 0:
            for limb in range(2, 4):
                row, frame = limb_row(model.segments.shape[0], limb), qt.load(scratch.world, 0)
                above = qt.mul(qt.mul(frame, qt.load(local, row)), qt.load(local, row + 2))
                turn_end(
                    end_row(model.segments.shape[0], limb + 1),
                    above,
                    turned,
                    limb + 2,
                    s.limits,
                    model.balls,
                    local,
                )
