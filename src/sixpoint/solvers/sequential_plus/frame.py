"""One frame of SIK+: pelvis, trunk, clavicles, limbs, in closed form but for the trunk's few Newton steps.

In ``memory`` (see ``six_points.frame``) row 0 is the last X axis and row 1 what told it, low-passed [m]; row
5 is the direction to the head, row 6 the low-passed velocity of the pelvis [m/s]; the fourth numbers of the
first three rows are the pelvis' point, which the posed pelvis may miss.
"""

from math import atan2

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper
from sixpoint.solvers.sequential.frame import place_arm, place_leg
from sixpoint.solvers.sequential.packing import unpack_work
from sixpoint.solvers.sequential.spine import chord_of, place_trunk
from sixpoint.solvers.sequential_plus.limbs import arm_pole, leg_pole, solve_by_pole
from sixpoint.solvers.sequential_plus.measured import is_measured, lean_to_head, pole_of_end, turn_end
from sixpoint.solvers.sequential_plus.packing import unpack_settings
from sixpoint.solvers.sequential_plus.pelvis import estimate_y, tell_x
from sixpoint.solvers.sequential_plus.trunk import close_trunk, start_trunk, twist_to_wrists
from sixpoint.solvers.six_points.frame import MEMORY_ROWS, end_limb, fill_lost, judge, write_frame
from sixpoint.solvers.six_points.packing import end_row, limb_row, unpack_model

CHEST = 0.75  # height of the chest's point between pelvis and head
TOLD = 0.02  # m, lines that tell less than this tell nothing
RUN = 3.0  # m/s, a faster pelvis is a jump of the tracker
TWIST = 0.8  # rad, largest twist of the thorax
DAMPING = 1e-5  # m^2, of the trunk's Newton steps
ALIGN = 1e-3  # m, where the spine stays farther off the pelvis turns too


@helper
def turn_at_most(before, x, y, most):
    """X axis on its way about ``y`` from where it was [rad]; both across y, ``before`` may be zero."""
    angle = atan2(vec.dot(vec.cross(before, x), y), vec.dot(before, x))
    if vec.norm(before) < 0.5 or abs(angle) <= most:
        return x
    return qt.mul_vec(qt.from_axis_angle(y, most if angle > 0.0 else -most), before)


@helper
def estimate_pelvis(filled, memory, s):
    """X and Y axes of the pelvis; updates what is remembered of X."""
    pelvis, head = vec.load(filled, 0), vec.load(filled, 1)
    began = memory[4, 0] > 0.0
    chord = vec.unit(vec.sub(head, pelvis))
    if vec.norm(chord) < 0.5:
        chord = vec.load(memory, 5) if began else (0.0, 1.0, 0.0)
    y = estimate_y(filled, chord, s.chord_share, s.leg_share)
    chest = vec.madd(pelvis, CHEST, vec.sub(head, pelvis))
    velocity = vec.load(memory, 6)
    if began and filled[0, 3] > 0.0:
        now = vec.scale(s.rate, vec.sub(pelvis, (memory[0, 3], memory[1, 3], memory[2, 3])))
        if vec.norm(now) > RUN:
            now = vec.scale(RUN / vec.norm(now), now)
        velocity = vec.add(vec.scale(s.kept_speed, velocity), vec.scale(1.0 - s.kept_speed, now))
    vec.store(memory, 6, velocity)
    memory[0, 3], memory[1, 3], memory[2, 3] = pelvis
    told = tell_x(filled, y, chest, velocity, s.wrist_line, s.ankle_line, s.reach, s.speed)
    if memory[4, 1] > 0.0:
        told = vec.add(vec.scale(s.kept, vec.load(memory, 1)), vec.scale(1.0 - s.kept, told))
    x = vec.reject(told, y)
    if vec.norm(x) >= TOLD:
        memory[4, 1] = 1.0
    else:
        x = vec.reject(vec.load(memory, 0) if began else (1.0, 0.0, 0.0), y)
        if vec.norm(x) < 0.1:
            x = vec.reject((0.0, 0.0, -1.0), y)
    vec.store(memory, 1, told)
    x = vec.unit(x)
    if began:
        x = turn_at_most(vec.unit(vec.reject(vec.load(memory, 0), y)), x, y, s.turn_speed * s.dt)
    return x, y, chord


@helper
def close_on_head(model, s, goal, first, turned, pinned, local, world, segs):
    """Bring the head to its goal by the joints from ``first`` on; returns how far it is off [m].

    A head that is an end site and whose rotation is measured (``pinned``) has its joint rotated so; the
    spine below reaches where that puts the joint. With limits that counts for less than the head's place.
    """
    segments, balls = model.segments, model.balls
    hold = s.head_hold if is_measured(turned, 1) else 0.0
    if pinned:
        last = segments.shape[0] - 1
        there = vec.sub(goal, qt.mul_vec(qt.load(turned, 1), vec.load(segments, last)))
        close_trunk(
            segments[:last],
            balls,
            s.limits,
            there,
            first,
            DAMPING,
            s.low_joint,
            hold,
            local,
            world[:last],
            segs[:last],
        )
        could = turn_end(last, qt.load(world, last - 1), turned, 1, s.limits, balls, local)
        place_trunk(segments, local, world, segs)
        off = vec.norm(vec.sub(goal, chord_of(segs)))
        if not s.limits or (could and off <= ALIGN):
            return off
    return close_trunk(segments, balls, s.limits, goal, first, DAMPING, s.low_joint, hold, local, world, segs)


@helper
def pose_trunk(model, s, filled, turned, local, memory, world, segs, residual):
    """Pelvis and spine; returns the place of the pelvis."""
    pelvis, head = vec.load(filled, 0), vec.load(filled, 1)
    x, y, chord = estimate_pelvis(filled, memory, s)
    qt.store(local, 0, qt.from_axes(x, y, vec.cross(x, y)))
    twist_share, bend_share = s.twist_share, s.bend_share
    held = is_measured(turned, 0)
    if held:
        qt.store(local, 0, qt.load(turned, 0))
        x = qt.x_axis(qt.load(turned, 0))
        twist_share, bend_share = s.known_twist, s.known_bend
    goal = vec.sub(head, pelvis)
    wanted = vec.norm(goal)
    twist = twist_to_wrists(filled, x, chord, twist_share, TWIST)
    start_trunk(model.segments, wanted, twist, bend_share, s.neck_curve, local, world, segs)
    pinned = False
    if is_measured(turned, 1):
        relative = qt.inv_mul(qt.load(local, 0), qt.load(turned, 1))
        lean_to_head(model.segments, relative, twist, s.head_twist, s.head_bend, s.head_rise, local)
        place_trunk(model.segments, local, world, segs)
        pinned = s.head_site and segs.shape[0] > 1
    off = close_on_head(model, s, goal, 1, turned, pinned, local, world, segs)
    if off > ALIGN and not held:  # out of reach of the spine: the pelvis turns too
        close_on_head(model, s, goal, 0, turned, pinned, local, world, segs)
    missed = vec.sub(goal, chord_of(segs))
    root = vec.madd(pelvis, 0.5, missed)
    top = vec.add(root, chord_of(segs))
    vec.store(memory, 0, x)
    vec.store(memory, 2, root)
    vec.store(memory, 3, top)
    vec.store(memory, 5, chord)
    memory[4, 0] = 1.0
    residual[0] = vec.norm(vec.sub(pelvis, root)) if filled[0, 3] > 0.0 else 0.0
    residual[1] = vec.norm(vec.sub(head, top)) if filled[1, 3] > 0.0 else 0.0
    return root


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
def solve_frame(model, s, points, turned, local, memory, residual, scratch):
    """Solve one frame; returns the status."""
    world, segs, filled = scratch.world, scratch.segs, scratch.filled
    count = segs.shape[0]
    began = memory[4, 0] > 0.0
    lost = fill_lost(points, filled, memory, model.chords[0])
    root = pose_trunk(model, s, filled, turned, local, memory, world, segs, residual)
    if turned.shape[0] > 0 and not s.head_site:
        turn_end(end_row(count, 0), qt.load(world, count - 1), turned, 1, s.limits, model.balls, local)
    for limb in range(4):
        residual[limb + 2] = 0.0
        if filled[limb + 2, 3] == 0.0:
            continue
        target = vec.load(filled, limb + 2)
        if limb < 2:
            frame, place = place_arm(
                model.chest,
                model.girdle,
                model.clavicles,
                model.limbs,
                model.balls,
                s.limits,
                False,
                limb,
                root,
                target,
                world,
                segs,
                local,
            )
        else:
            frame, place = place_leg(model.hips, limb - 2, root, world)
        gap = qt.inv_mul_vec(frame, vec.sub(target, place))
        row = limb_row(count, limb)
        upper, hinge, end = solve_by_pole(
            gap,
            model.limbs[limb, 0],
            model.limbs[limb, 1],
            -1.0 if limb < 2 else 1.0,
            point_limb(s, limb, vec.unit(gap), frame, turned),
            began,
            qt.load(local, row),
            qt.load(local, row + 2),
            s.swivel_memory,
            s.swivel_speed,
            s.dt,
            s.limits,
            model.balls,
            row,
            model.limbs[limb, 2],
            model.limbs[limb, 3],
        )
        end_limb(target, limb, row, frame, place, upper, hinge, end, local, residual)
        if turned.shape[0] > 0:
            above = qt.mul(qt.mul(frame, upper), hinge)
            turn_end(end_row(count, limb + 1), above, turned, limb + 2, s.limits, model.balls, local)
    return judge(lost, residual)


@entry
def solve_plus(
    table,
    integers,
    balls,
    chords,
    work,
    options,
    points,
    turned,
    state,
    rotations,
    pelvis,
    outcome,
    residual,
):
    """Solve F frames in order; see ``SixPointSolver``.

    ``turned`` (F, 6, 4) are measured world rotations, NaN where there is none, or (F, 0, 4).
    """
    model = unpack_model(table, integers, balls, chords)
    s = unpack_settings(options)
    scratch = unpack_work(work, model.segments.shape[0])
    rows = state.shape[0] - MEMORY_ROWS
    local, memory = state[:rows], state[rows:]
    for f in range(points.shape[0]):
        outcome[f, 0] = solve_frame(model, s, points[f], turned[f], local, memory, residual[f], scratch)
        outcome[f, 1] = 1
        write_frame(model, local, memory, rotations[f], pelvis[f])
