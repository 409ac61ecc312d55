"""One frame of Sequential IK, in the order of the paper: pelvis, spine, legs, clavicles, arms.

Reference: Unzueta et al. 2008, Algorithm 1.
"""

from math import atan2, cos, pi, sin

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper, specialised
from sixpoint.solvers.avoidance.elbow import clear_arm
from sixpoint.solvers.avoidance.swivel import make_arm
from sixpoint.solvers.avoidance.thighs import part_thighs
from sixpoint.solvers.sequential import spine
from sixpoint.solvers.sequential.clavicle import solve_clavicle
from sixpoint.solvers.sequential.limb import place_leg, solve_limb
from sixpoint.solvers.sequential.packing import unpack_settings, unpack_work
from sixpoint.solvers.six_points.frame import (
    MEMORY_ROWS,
    end_limb,
    end_trunk,
    estimate_pelvis,
    fill_lost,
    judge,
    write_frame,
)
from sixpoint.solvers.six_points.packing import limb_row, unpack_model


@helper
def solve_trunk(
    segments,
    turns,
    chords,
    balls,
    limits,
    literal,
    align,
    pelvis,
    head,
    x_estimated,
    y,
    local,
    memory,
    world,
    segs,
    start,
    flat,
):
    """Pelvis and spine (Algorithm 2); returns the pelvis joint's position. ``y`` is the chord's direction."""
    goal = vec.sub(head, pelvis)
    wanted = vec.norm(goal)
    # The trunk starts with the spine of the frame before and the pelvis as just estimated (Algorithm 1).
    qt.store(local, 0, qt.from_axes(x_estimated, y, vec.cross(x_estimated, y)))
    v, inside = spine.set_chord(
        segments,
        turns,
        chords,
        balls,
        limits,
        literal,
        wanted,
        goal,
        local,
        world,
        segs,
        start,
        flat,
        vec.load(memory, 1),
    )
    vec.store(memory, 1, v)
    if limits and not inside:  # line 15; it changes no rotation of the pelvis, so it may come before line 14
        spine.clamp_interior(balls, segments.shape[0], local)
        spine.place_trunk(segments, local, world, segs)
    root = qt.load(local, 0)
    # Line 14: the pelvis' X axis along the estimate. A half turn goes about its own Y.
    turn = qt.arc(qt.x_axis(root), x_estimated, qt.y_axis(root))
    chord = spine.chord_of(segs)
    length = vec.norm(chord)
    if length > 1e-9:  # line 16
        turn = qt.mul(qt.arc(vec.unit(qt.mul_vec(turn, chord)), y, x_estimated), turn)
        if align:  # twist about the chord until X is as near to the estimate as it gets
            x = vec.reject(qt.x_axis(qt.mul(turn, root)), y)
            half = 0.5 * atan2(vec.dot(vec.cross(x, x_estimated), y), vec.dot(x, x_estimated))
            turn = qt.mul((sin(half) * y[0], sin(half) * y[1], sin(half) * y[2], cos(half)), turn)
    qt.store(local, 0, qt.normalised(qt.mul(turn, root)))
    spine.place_trunk(segments, local, world, segs)
    return vec.madd(pelvis, 0.5 * (wanted - length), y)  # line 17


@helper
def place_arm(chest, girdle, clavicles, limbs, balls, limits, hold, side, root, target, world, segs, local):
    """Pose a clavicle; returns the world rotation of the shoulder's parent, and where the shoulder is."""
    row = segs.shape[0] + side
    place = root
    for k in range(chest[side]):
        place = vec.add(place, vec.load(segs, k))
    frame = qt.load(world, chest[side])
    joint = vec.add(place, qt.mul_vec(frame, vec.load(girdle, side)))
    clavicle = solve_clavicle(
        qt.load(local, row) if hold else qt.IDENTITY,
        vec.load(clavicles, side),
        qt.inv_mul_vec(frame, vec.sub(target, joint)),
        limbs[side, 0] + limbs[side, 1],
        limits,
        balls,
        row,
    )
    qt.store(local, row, clavicle)
    frame = qt.mul(frame, clavicle)
    return frame, vec.add(joint, qt.mul_vec(frame, vec.load(clavicles, side)))


@helper
def pose_trunk(model, settings, points, local, memory, residual, scratch):
    """Pelvis and spine of a frame; returns whether a point is lost, and where the pelvis is."""
    world, segs, start, flat, filled = scratch
    lost = fill_lost(points, filled, memory, model.chords[0])
    x, y = estimate_pelvis(filled, memory, settings.w1, settings.w2, settings.w3)
    root = solve_trunk(
        model.segments,
        model.turns,
        model.chords,
        model.balls,
        settings.limits,
        settings.literal,
        settings.align_pelvis,
        vec.load(filled, 0),
        vec.load(filled, 1),
        x,
        y,
        local,
        memory,
        world,
        segs,
        start,
        flat,
    )
    end_trunk(filled, memory, x, y, root, vec.add(root, spine.chord_of(segs)), residual)
    return lost, root


@helper
def place_limb(model, limits, hold, limb, root, target, local, world, segs):
    """World rotation and place of what carries a limb: 0 and 1 are the arms, 2 and 3 the legs.

    ``hold``: whether clavicles start from the last frame's.
    """
    if limb >= 2:
        return place_leg(model.hips, limb - 2, root, world)
    return place_arm(
        model.chest,
        model.girdle,
        model.clavicles,
        model.limbs,
        model.balls,
        limits,
        hold,
        limb,
        root,
        target,
        world,
        segs,
        local,
    )


@specialised
def solve_frame(model, settings, points, flesh, local, memory, residual, scratch):
    """Solve one frame; updates ``local``, ``memory``, ``residual`` (6,) [m] in place; returns the status.

    ``flesh`` is what arms stay out of, or None: the compiler then leaves that out.
    """
    lost, root = pose_trunk(model, settings, points, local, memory, residual, scratch)
    world, segs, filled = scratch.world, scratch.segs, scratch.filled
    for k in range(4):
        limb = k  # arms, then legs; neither depends on the other, unless arms have to stay out of the thighs
        if flesh is not None:
            limb = (k + 2) % 4
            if limb == 0:
                part_thighs(
                    flesh.thighs,
                    flesh.placed,
                    model,
                    settings.limits,
                    root,
                    filled,
                    local,
                    world,
                    residual,
                    pi,
                )
        residual[limb + 2] = 0.0
        if filled[limb + 2, 3] == 0.0:
            continue
        target = vec.load(filled, limb + 2)
        frame, place = place_limb(
            model, settings.limits, settings.hold_clavicles, limb, root, target, local, world, segs
        )
        row = limb_row(segs.shape[0], limb)
        aim = qt.inv_mul_vec(frame, vec.sub(target, place))
        upper, hinge, end = solve_limb(
            aim,
            model.limbs[limb, 0],
            model.limbs[limb, 1],
            -1.0 if limb < 2 else 1.0,
            settings.limits,
            model.balls,
            row,
            model.limbs[limb, 2],
            model.limbs[limb, 3],
        )
        if flesh is not None:
            if limb < 2:
                arm = make_arm(model, limb, place, frame, aim, settings.limits)
                upper, hinge, end = clear_arm(arm, flesh, root, world, segs, model.balls, upper, hinge, end)
        end_limb(target, limb, row, frame, place, upper, hinge, end, local, residual)
    return judge(lost, residual)


@entry
def solve_sequential(
    table, integers, balls, chords, work, options, points, state, rotations, pelvis, outcome, residual
):
    """Solve F frames in order.

    Few arrays are passed, because unpacking each of them would cost more than a tenth of a frame.

    Args:
        table: The figure's vectors and rotations, see ``packing``.
        integers: The figure's sizes and indices, see ``packing``.
        balls: The figure's limits, see ``kernels.swing_twist``.
        chords: (33,) chord lengths of the stretch poses [m].
        work: Working memory, see ``packing``.
        options: Weights adapted to the frame rate, and the switches of ``packing.Settings``.
        points: (F, 6, 3) effector positions [m]; NaN where lost.
        state: (rows + 15, 4) updated.
        rotations: (F, J, 4) out, local rotations of the rig.
        pelvis: (F, 3) out, local position of the pelvis joint [m].
        outcome: (F, 2) out, status and iterations.
        residual: (F, 6) out, distance of each effector to its target [m]; 0 where lost.
    """
    model = unpack_model(table, integers, balls, chords)
    settings = unpack_settings(options)
    scratch = unpack_work(work, model.segments.shape[0])
    rows = state.shape[0] - MEMORY_ROWS
    local, memory = state[:rows], state[rows:]
    for f in range(points.shape[0]):
        outcome[f, 0] = solve_frame(model, settings, points[f], None, local, memory, residual[f], scratch)
        outcome[f, 1] = 1
        write_frame(model, local, memory, rotations[f], pelvis[f])
