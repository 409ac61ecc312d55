"""One frame of Sequential IK, in the order of the paper: pelvis, spine, legs, clavicles, arms.

State between frames is one array (rows + 5, 4): ``local`` (rows, 4) are the anatomical local rotations of
the posed joints and ``memory`` (5, 4) holds the estimated X axis, the bending plane's normal (zero if none),
the positions of pelvis and head, and in its last row whether there was a frame before and whether
the X axis was ever told by wrists or ankles.

Reference: Unzueta et al. 2008, Algorithm 1.
"""

from math import atan2, cos, sin

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper
from sixpoint.solvers.sequential import spine
from sixpoint.solvers.sequential.clavicle import solve_clavicle
from sixpoint.solvers.sequential.limb import solve_limb
from sixpoint.solvers.sequential.packing import unpack_model, unpack_settings, unpack_work
from sixpoint.solvers.sequential.pelvis import estimate_x, says_something

MEMORY_ROWS = 5
FAR = 1e7  # m, a point farther away than this, or not a number, counts as lost
CONVERGED, UNREACHABLE, LOST = 0, 1, 2
REACHED = 0.01  # m, the paper's stop criterion (section 9)


@helper
def fill_lost(points, filled, memory, neutral_chord):
    """Copy the points; a lost pelvis or head follows the other, or stays where it was.

    Returns whether any of the six is lost.
    """
    lost = False
    for i in range(6):
        p = vec.load(points, i)
        here = abs(p[0]) < FAR and abs(p[1]) < FAR and abs(p[2]) < FAR  # false for NaN
        filled[i, 3] = 1.0 if here else 0.0
        if here:
            vec.store(filled, i, p)
        else:
            lost = True
    if filled[0, 3] * filled[1, 3] == 0.0:
        has_state = memory[4, 0] > 0.0
        neutral = (0.0, neutral_chord, 0.0)
        chord = vec.sub(vec.load(memory, 3), vec.load(memory, 2)) if has_state else neutral
        if filled[1, 3] > 0.0:
            vec.store(filled, 0, vec.sub(vec.load(filled, 1), chord))
        elif filled[0, 3] > 0.0:
            vec.store(filled, 1, vec.add(vec.load(filled, 0), chord))
        else:
            vec.store(filled, 0, vec.load(memory, 2))
            vec.store(filled, 1, vec.add(vec.load(memory, 2), chord))
    return lost


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
    v = spine.set_chord(
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
    if limits:  # line 15; it changes no rotation of the pelvis, so it may come before line 14
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
def pose_limb(limbs, balls, limits, limb, row, h, parent, place, target, local):
    """Pose one limb whose root joint has the given row; returns its end's position."""
    root, hinge, end = solve_limb(
        qt.inv_mul_vec(parent, vec.sub(target, place)),
        limbs[limb, 0],
        limbs[limb, 1],
        h,
        limits,
        balls,
        row,
        limbs[limb, 2],
        limbs[limb, 3],
    )
    qt.store(local, row, root)
    qt.store(local, row + 2, hinge)
    return vec.add(place, qt.mul_vec(parent, end))


@helper
def pose_arm(chest, girdle, clavicles, limbs, balls, limits, hold, side, root, target, world, segs, local):
    """Clavicle and arm of one side; returns the wrist's position."""
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
    shoulder = vec.add(joint, qt.mul_vec(frame, vec.load(clavicles, side)))
    return pose_limb(limbs, balls, limits, side, row + 2, -1.0, frame, shoulder, target, local)


@helper
def solve_frame(model, settings, points, local, memory, residual, scratch):
    """Solve one frame; updates ``local``, ``memory`` and ``residual`` (6,) [m] in place.

    Returns:
        Status: CONVERGED, UNREACHABLE (a residual above 1 cm) or LOST (some point is unknown).
    """
    world, segs, start, flat, filled = scratch
    count = segs.shape[0]
    lost = fill_lost(points, filled, memory, model.chords[0])
    pelvis, head = vec.load(filled, 0), vec.load(filled, 1)
    y = vec.unit(vec.sub(head, pelvis))
    if vec.norm(y) < 0.5:  # pelvis and head coincide: the trunk keeps its direction
        y = vec.unit(vec.sub(vec.load(memory, 3), vec.load(memory, 2)))
        y = y if vec.norm(y) > 0.5 else (0.0, 1.0, 0.0)
    x = estimate_x(filled, y, vec.load(memory, 0), memory[4, 1] > 0.0, settings.w1, settings.w2, settings.w3)
    root = solve_trunk(
        model.segments,
        model.turns,
        model.chords,
        model.balls,
        settings.limits,
        settings.literal,
        settings.align_pelvis,
        pelvis,
        head,
        x,
        y,
        local,
        memory,
        world,
        segs,
        start,
        flat,
    )
    top = vec.add(root, spine.chord_of(segs))
    if memory[4, 1] > 0.0 or says_something(filled, y):
        vec.store(memory, 0, x)
        memory[4, 1] = 1.0
    vec.store(memory, 2, root)
    vec.store(memory, 3, top)
    memory[4, 0] = 1.0
    residual[0] = vec.norm(vec.sub(pelvis, root)) if filled[0, 3] > 0.0 else 0.0
    residual[1] = vec.norm(vec.sub(head, top)) if filled[1, 3] > 0.0 else 0.0
    for limb in range(4):  # legs, then clavicles and arms; neither depends on the other
        side, effector = limb % 2, 4 + limb % 2 if limb < 2 else limb
        residual[effector] = 0.0
        if filled[effector, 3] == 0.0:
            continue
        target = vec.load(filled, effector)
        if limb < 2:
            frame = qt.load(world, 0)
            place = vec.add(root, qt.mul_vec(frame, vec.load(model.hips, side)))
            end = pose_limb(
                model.limbs,
                model.balls,
                settings.limits,
                2 + side,
                count + 6 + side,
                1.0,
                frame,
                place,
                target,
                local,
            )
        else:
            end = pose_arm(
                model.chest,
                model.girdle,
                model.clavicles,
                model.limbs,
                model.balls,
                settings.limits,
                settings.hold_clavicles,
                side,
                root,
                target,
                world,
                segs,
                local,
            )
        residual[effector] = vec.norm(vec.sub(target, end))
    if lost:
        return LOST
    for i in range(6):
        if not residual[i] <= REACHED:
            return UNREACHABLE
    return CONVERGED


@helper
def write_rig(row, before, after, constant, origin, local, root, rotations, pelvis):
    """Anatomical local rotations -> the rig's local rotations (J, 4) and the pelvis' local position (3,)."""
    for j in range(row.shape[0]):
        k = row[j]
        if k >= 0:
            q = qt.mul(qt.load(before, j), qt.mul(qt.load(local, k), qt.load(after, j)))
            qt.store(rotations, j, q)
        else:
            qt.store(rotations, j, qt.load(constant, j))
    for i in range(3):
        pelvis[i] = root[i] - origin[0, i]


@entry
def solve_frames(
    table, integers, balls, chords, options, points, state, work, rotations, pelvis, status, residual
):
    """Solve F frames in order.

    Few arrays are passed, because unpacking each of them would cost more than a tenth of a frame.

    Args:
        table: The figure's vectors and rotations, see ``packing``.
        integers: The figure's sizes and indices, see ``packing``.
        balls: The figure's limits, see ``kernels.swing_twist``.
        chords: (33,) chord lengths of the stretch poses [m].
        options: (7,) weights adapted to the frame rate, and the switches of ``packing.Settings``.
        points: (F, 6, 3) effector positions [m]; NaN where lost.
        state: (rows + 5, 4) updated.
        work: Working memory, see ``packing``.
        rotations: (F, J, 4) out, local rotations of the rig.
        pelvis: (F, 3) out, local position of the pelvis joint [m].
        status: (F,) out.
        residual: (F, 6) out, distance of each effector to its target [m]; 0 where lost.
    """
    model = unpack_model(table, integers, balls, chords)
    settings = unpack_settings(options)
    count = model.segments.shape[0]
    scratch = unpack_work(work, count)
    rows = state.shape[0] - MEMORY_ROWS
    local, memory = state[:rows], state[rows:]
    for f in range(points.shape[0]):
        status[f] = solve_frame(model, settings, points[f], local, memory, residual[f], scratch)
        write_rig(
            model.row,
            model.before,
            model.after,
            model.constant,
            model.origin,
            local,
            vec.load(memory, 2),
            rotations[f],
            pelvis[f],
        )
