"""One frame of SIK+: pelvis, trunk, clavicles, limbs, in closed form but for the trunk's few Newton steps.

In ``memory`` (see ``six_points.frame``) row 0 is the last X axis and row 1 what told it, low-passed [m]; row
5 is the direction to the head, row 6 the low-passed velocity of the pelvis [m/s], row 7 its point, which the
posed pelvis may miss [m], row 8 its low-passed Y axis, row 9 its turn towards the ankles (a quaternion).
"""

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper, specialised
from sixpoint.kernels.swing_twist import clamp
from sixpoint.solvers.sequential.frame import place_limb
from sixpoint.solvers.sequential.packing import unpack_work
from sixpoint.solvers.sequential.spine import chord_of, place_trunk
from sixpoint.solvers.sequential_plus.limb_step import part_legs, point_limb, pole_of_start, pose_limb
from sixpoint.solvers.sequential_plus.measured import is_measured, lean_to_head, turn_end
from sixpoint.solvers.sequential_plus.packing import unpack_settings
from sixpoint.solvers.sequential_plus.pelvis import estimate_pelvis, keep_leaning
from sixpoint.solvers.sequential_plus.trunk import bend_spine, close_trunk, twist_to_wrists
from sixpoint.solvers.six_points.frame import MEMORY_ROWS, fill_lost, judge, write_frame
from sixpoint.solvers.six_points.packing import end_row, unpack_model

TWIST = 0.8  # rad, largest twist of the thorax
DAMPING = 1e-5  # m^2, of the trunk's Newton steps
ALIGN = 1e-3  # m, where the spine stays farther off the pelvis turns too


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
def start_trunk(model, s, filled, turned, local, memory, world, segs):
    """Pelvis and spine before the spine closes on the head; returns the pelvis' X and the chord's unit."""
    pelvis, head = vec.load(filled, 0), vec.load(filled, 1)
    x, y, chord = estimate_pelvis(filled, memory, s)
    qt.store(local, 0, qt.from_axes(x, y, vec.cross(x, y)))
    twist_share, bend_share = s.twist_share, s.bend_share
    if is_measured(turned, 0):
        qt.store(local, 0, qt.load(turned, 0))
        x = qt.x_axis(qt.load(turned, 0))
        twist_share, bend_share = s.known_twist, s.known_bend
    wanted = vec.norm(vec.sub(head, pelvis))
    twist = twist_to_wrists(filled, x, chord, twist_share, TWIST)
    bend_spine(model.segments, wanted, twist, bend_share, s.neck_curve, local, world, segs)
    if turned.shape[0] > 0:
        qt.store(local, end_row(segs.shape[0], 0), qt.IDENTITY)
    if is_measured(turned, 1):
        relative = qt.inv_mul(qt.load(local, 0), qt.load(turned, 1))
        lean_to_head(model.segments, relative, twist, s.head_twist, s.head_bend, s.head_rise, local)
        place_trunk(model.segments, local, world, segs)
    return x, chord


@helper
def take_start(model, s, given, turned, local):
    """Start the trunk as a given pose has it; a measured pelvis keeps its rotation."""
    for k in range(model.segments.shape[0]):
        if k == 0 and is_measured(turned, 0):
            continue
        q = qt.load(given, k)
        if s.limits and k > 0:
            q, _ = clamp(model.balls, k, q)
        qt.store(local, k, q)


@helper
def end_trunk(model, s, filled, turned, x, chord, local, memory, world, segs, residual):
    """Close the started spine on the head; returns the place of the pelvis. ``x`` is what to remember."""
    if not is_measured(turned, 0):
        qt.store(
            local, 0, keep_leaning(filled, model.hips, model.limbs, memory, s.kept_lean, qt.load(local, 0))
        )
    place_trunk(model.segments, local, world, segs)
    pelvis, head = vec.load(filled, 0), vec.load(filled, 1)
    goal, count = vec.sub(head, pelvis), segs.shape[0]
    pinned = is_measured(turned, 1) and s.head_site and count > 1
    off = close_on_head(model, s, goal, 1, turned, pinned, local, world, segs)
    if off > ALIGN and not is_measured(turned, 0):  # out of reach of the spine: the pelvis turns too
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
    if is_measured(turned, 1) and not s.head_site:
        turn_end(end_row(count, 0), qt.load(world, count - 1), turned, 1, s.limits, model.balls, local)
    return root


@specialised
def solve_frame(model, s, points, turned, flesh, local, memory, residual, scratch):
    """Solve one frame; returns the status."""
    world, segs, filled = scratch.world, scratch.segs, scratch.filled
    began = memory[4, 0] > 0.0
    lost = fill_lost(points, filled, memory, model.chords[0])
    x, chord = start_trunk(model, s, filled, turned, local, memory, world, segs)
    root = end_trunk(model, s, filled, turned, x, chord, local, memory, world, segs, residual)
    for k in range(4):
        limb = (k + 2) % 4  # legs, then arms, which may have to stay out of the thighs
        if limb == 0:
            part_legs(model, s, turned, began, flesh, root, scratch, local, residual)
        residual[limb + 2] = 0.0
        if filled[limb + 2, 3] == 0.0:
            continue
        target = vec.load(filled, limb + 2)
        frame, place = place_limb(model, s.limits, False, limb, root, target, local, world, segs)
        n = vec.unit(qt.inv_mul_vec(frame, vec.sub(target, place)))
        pole = point_limb(s, limb, n, frame, turned)
        pose_limb(
            model,
            s,
            limb,
            target,
            frame,
            place,
            pole,
            turned,
            began,
            flesh,
            root,
            scratch,
            local,
            residual,
        )
    return judge(lost, residual)


@specialised
def solve_frame_from(model, s, points, turned, given, flesh, local, memory, residual, scratch):
    """The same from a given pose, see ``start``."""
    world, segs, filled = scratch.world, scratch.segs, scratch.filled
    began = memory[4, 0] > 0.0
    lost = fill_lost(points, filled, memory, model.chords[0])
    _, chord = start_trunk(model, s, filled, turned, local, memory, world, segs)
    take_start(model, s, given, turned, local)
    x = qt.x_axis(qt.load(local, 0))
    root = end_trunk(model, s, filled, turned, x, chord, local, memory, world, segs, residual)
    for k in range(4):
        limb = (k + 2) % 4  # legs, then arms, which may have to stay out of the thighs
        if limb == 0:
            part_legs(model, s, turned, began, flesh, root, scratch, local, residual)
        residual[limb + 2] = 0.0
        if filled[limb + 2, 3] == 0.0:
            continue
        target = vec.load(filled, limb + 2)
        frame, place = place_limb(model, s.limits, False, limb, root, target, local, world, segs)
        pole = pole_of_start(given, limb, vec.unit(qt.inv_mul_vec(frame, vec.sub(target, place))), frame)
        pose_limb(
            model,
            s,
            limb,
            target,
            frame,
            place,
            pole,
            turned,
            began,
            flesh,
            root,
            scratch,
            local,
            residual,
        )
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
        outcome[f, 0] = solve_frame(model, s, points[f], turned[f], None, local, memory, residual[f], scratch)
        outcome[f, 1] = 1
        write_frame(model, local, memory, rotations[f], pelvis[f])


@entry
def solve_from_start(
    table,
    integers,
    balls,
    chords,
    work,
    options,
    points,
    turned,
    given,
    state,
    rotations,
    pelvis,
    outcome,
    residual,
):
    """Solve F frames, each from a pose ``given`` (F, S + 4, 4), see ``start``."""
    model = unpack_model(table, integers, balls, chords)
    s = unpack_settings(options)
    scratch = unpack_work(work, model.segments.shape[0])
    rows = state.shape[0] - MEMORY_ROWS
    local, memory = state[:rows], state[rows:]
    for f in range(points.shape[0]):
        outcome[f, 0] = solve_frame_from(
            model, s, points[f], turned[f], given[f], None, local, memory, residual[f], scratch
        )
        outcome[f, 1] = 1
        write_frame(model, local, memory, rotations[f], pelvis[f])
