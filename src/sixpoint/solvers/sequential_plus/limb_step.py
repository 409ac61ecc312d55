"""A limb of SIK+: where its elbow or knee points, how it is posed, and how its flesh keeps its place."""

from math import pi

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper, specialised
from sixpoint.solvers.avoidance.elbow import clear_arm_steadily, make_arm
from sixpoint.solvers.avoidance.thighs import part_thighs, remember_knee
from sixpoint.solvers.sequential_plus.limbs import arm_pole, leg_pole, solve_by_pole
from sixpoint.solvers.sequential_plus.measured import is_measured, pole_of_end, turn_end
from sixpoint.solvers.six_points.frame import end_limb
from sixpoint.solvers.six_points.packing import end_row, limb_row


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


@specialised
def pose_limb(
    model, s, limb, target, frame, place, pole, turned, began, flesh, root, scratch, local, residual
):
    """A limb whose middle joint points to ``pole``, and its extremity.

    ``flesh`` is what arms stay out of, or None: the compiler then leaves that out.
    """
    count = model.segments.shape[0]
    row = limb_row(count, limb)
    aim = qt.inv_mul_vec(frame, vec.sub(target, place))
    was, bent = qt.load(local, row), qt.load(local, row + 2)
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
    if flesh is not None:
        l1, l2 = model.limbs[limb, 0], model.limbs[limb, 1]
        remember_knee(flesh.thighs, flesh.placed, limb, aim, upper, began, was, bent, l1, l2)
        if limb < 2:
            arm = make_arm(model, limb, place, frame, aim, s.limits)
            most = s.swivel_speed * s.dt
            upper, hinge, end = clear_arm_steadily(
                arm,
                flesh,
                root,
                scratch.world,
                scratch.segs,
                model.balls,
                upper,
                hinge,
                end,
                began,
                was,
                bent,
                most,
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
                    end_row(model.segments.shape[0], limb + 1), above, turned, limb + 2, s.limits, model.balls, local
                )
