"""One frame of SIK with a prior: SIK+ that begins where the prior says, as far as it is to be trusted.

The prior sees the points in a frame near the pelvis: Y as SIK+ estimates it, X that of the frame before; or
the measured rotation of the pelvis. ``memory`` as in ``sequential_plus.frame``, with the X axis of the posed
pelvis in row 0; row 10 is that axis low-passed, rows 11 to 14 are wrists and ankles as they were last seen
from the pelvis [m].
"""

from math import exp

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper, specialised
from sixpoint.kernels.swing_twist import clamp
from sixpoint.solvers.sequential.frame import place_limb
from sixpoint.solvers.sequential.packing import unpack_work
from sixpoint.solvers.sequential_plus.frame import end_trunk, start_trunk
from sixpoint.solvers.sequential_plus.limb_step import part_legs, point_limb, pose_limb
from sixpoint.solvers.sequential_plus.measured import is_measured
from sixpoint.solvers.sequential_plus.packing import unpack_settings
from sixpoint.solvers.sequential_prior.features import (
    mirror,
    recall_ends,
    remember_ends,
    see_end,
    see_limb,
    see_points,
    see_rotations,
    strangeness,
)
from sixpoint.solvers.sequential_prior.network import point, think
from sixpoint.solvers.sequential_prior.packing import (
    END,
    LIMB,
    MASKS,
    POINTS,
    STATIONS,
    TURNED,
    unpack_facts,
    unpack_network,
    unpack_thought,
)
from sixpoint.solvers.six_points.frame import MEMORY_ROWS, fill_lost, judge, write_frame
from sixpoint.solvers.six_points.packing import end_row, unpack_model

USUAL, STRANGE = (
    1.0,
    2.0,
)  # of ``strangeness``: the prior counts wholly below, not at all above; 99 % of what it
# was fitted on lies below the first
ALONG, AGAINST = 0.0, -0.5  # cosine between remembered X and what is told: it counts wholly above, not below
LAG = 1.0 / 30.0  # s, age of the X axis that the prior was fitted with


@helper
def fade(value, whole, none):
    """1 at ``whole``, 0 at ``none``, smooth between and beyond."""
    t = min(max((value - none) / (whole - none), 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@helper
def part_way(a, b, t):
    """From rotation a a share of the way to b."""
    return qt.normalised(qt.mul(a, qt.scaled(qt.inv_mul(a, b), t)))


@helper
def see_frame(memory, y, plain):
    """Frame of reference of the prior, and how well its X goes with what is told.

    ``plain`` is the pelvis as SIK+ has it. A memory that contradicts what is told is not trusted.
    """
    x = vec.unit(vec.reject(vec.load(memory, 10), y))
    if vec.norm(x) < 0.5:
        return plain, 1.0
    told = vec.unit(vec.reject(vec.load(memory, 1), y))
    agree = vec.dot(x, told) if vec.norm(told) > 0.5 else 1.0
    return qt.from_axes(x, y, vec.cross(x, y)), fade(agree, ALONG, AGAINST)


@helper
def remember_x(memory, x, dt):
    """Let the remembered X axis follow that of the posed pelvis."""
    before = vec.load(memory, 10)
    kept = exp(-dt / LAG) if vec.norm(before) > 0.5 else 0.0
    now = vec.unit(vec.add(vec.scale(kept, before), vec.scale(1.0 - kept, x)))
    vec.store(memory, 10, now if vec.norm(now) > 0.5 else x)


@helper
def lay_course(out, course):
    """Rotation of the trunk against the pelvis at each of the seven stations."""
    q = qt.IDENTITY
    qt.store(course, 0, q)
    for k in range(1, STATIONS):
        q = qt.mul(q, qt.exp((out[3 * k], out[3 * k + 1], out[3 * k + 2])))
        qt.store(course, k, q)


@helper
def rotation_at(course, station):
    """Rotation of the trunk against the pelvis at a station."""
    below = min(int(station), STATIONS - 2)
    a = qt.load(course, below)
    return part_way(a, qt.load(course, below + 1), station - below)


@helper
def lean_on(model, s, facts, thought, held, frame, trust, local):
    """Turn the started trunk as far to what the prior says as it is trusted."""
    out, course, count = thought.out, thought.course, model.segments.shape[0]
    row = end_row(count, 0)
    if trust == 0.0:
        qt.store(local, row, qt.IDENTITY)
        return
    lay_course(out, course)
    if not held:
        told = qt.mul(frame, qt.exp((out[0], out[1], out[2])))
        qt.store(local, 0, part_way(qt.load(local, 0), told, trust))
    before = qt.IDENTITY
    for k in range(1, count):
        here = rotation_at(course, facts.stations[k])
        q = part_way(qt.load(local, k), qt.inv_mul(before, here), trust)
        if s.limits:
            q, _ = clamp(model.balls, k, q)
        qt.store(local, k, q)
        before = here
    head = qt.scaled(qt.exp((out[18], out[19], out[20])), trust)
    if s.limits:
        head, _ = clamp(model.balls, row, head)
    qt.store(local, row, head)


@helper
def ask_prior(model, s, facts, places, turns, turned, filled, memory, thought, local):
    """Start the trunk where the prior says, as far as it is trusted; returns the pelvis' X and the trust."""
    held = is_measured(turned, 0)
    told, velocity = vec.load(memory, 1), vec.load(memory, 6)
    frame, trust = qt.load(local, 0), 1.0
    network = turns
    if not held:
        network = places
        frame, trust = see_frame(memory, vec.load(memory, 8), frame)
    features, mirrored = thought.features, thought.mirrored
    see_points(facts, filled, frame, told, velocity, features)
    if held:
        see_rotations(turned, frame, features)
    mirror(features, held, mirrored)
    strange = strangeness(features, network.mean, network.spread, POINTS)
    strange += strangeness(mirrored, network.mean, network.spread, POINTS)
    trust *= fade(0.5 * strange, USUAL, STRANGE)
    think(network, thought)
    lean_on(model, s, facts, thought, held, frame, trust, local)
    x = qt.x_axis(qt.load(local, 0))
    remember_x(memory, x, s.dt)
    return x, trust


@helper
def wish_pole(model, limb, gap, base, places, turns, turned, features):
    """World direction of an elbow or knee as the prior has it; ``gap`` is from the limb's root to its end."""
    right = limb % 2 == 1
    see_limb(qt.inv_mul_vec(base, gap), model.limbs[limb, 0] + model.limbs[limb, 1], right, features)
    if is_measured(turned, limb + 2):
        see_end(turned, limb + 2, base, right, features)
        pole = point(turns.arm if limb < 2 else turns.leg, features, turns.limb)
    else:
        pole = point(places.arm if limb < 2 else places.leg, features, places.limb)
    if right:
        pole = (-pole[0], pole[1], pole[2])
    return qt.mul_vec(base, vec.unit(pole))


@specialised
def solve_frame(
    model, s, facts, places, turns, points, turned, flesh, local, memory, residual, scratch, thought
):
    """Solve one frame; ``places`` and ``turns`` are the priors without and with a measured pelvis."""
    world, segs, filled = scratch.world, scratch.segs, scratch.filled
    began = memory[4, 0] > 0.0
    lost = fill_lost(points, filled, memory, model.chords[0])
    recall_ends(facts, places.mean, qt.load(local, 0), memory, filled)
    _, chord = start_trunk(model, s, filled, turned, local, memory, world, segs)
    x, trust = ask_prior(model, s, facts, places, turns, turned, filled, memory, thought, local)
    remember_ends(qt.load(local, 0), filled, memory)
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
        gap = vec.sub(target, place)
        plain = point_limb(s, limb, vec.unit(qt.inv_mul_vec(frame, gap)), frame, turned)
        base = qt.load(world, model.chest[limb] if limb < 2 else 0)
        wish = wish_pole(model, limb, gap, base, places, turns, turned, thought.features)
        pole = vec.add(vec.scale(1.0 - trust, plain), vec.scale(trust, qt.inv_mul_vec(frame, wish)))
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
def solve_prior(
    table,
    integers,
    balls,
    chords,
    numbers,
    places,
    turns,
    work,
    course,
    thoughts,
    options,
    points,
    turned,
    state,
    rotations,
    pelvis,
    outcome,
    residual,
):
    """Solve F frames in order; see ``SixPointSolver`` and ``solve_plus``."""
    model = unpack_model(table, integers, balls, chords)
    s = unpack_settings(options)
    facts = unpack_facts(numbers)
    by_places = unpack_network(places, POINTS, LIMB)
    by_turns = unpack_network(turns, POINTS + TURNED + MASKS, LIMB + END)
    scratch = unpack_work(work, model.segments.shape[0])
    thought = unpack_thought(thoughts, course)
    rows = state.shape[0] - MEMORY_ROWS
    local, memory = state[:rows], state[rows:]
    for f in range(points.shape[0]):
        outcome[f, 0] = solve_frame(
            model,
            s,
            facts,
            by_places,
            by_turns,
            points[f],
            turned[f],
            None,
            local,
            memory,
            residual[f],
            scratch,
            thought,
        )
        outcome[f, 1] = 1
        write_frame(model, local, memory, rotations[f], pelvis[f])
