"""KMA: the trunk by CCD from a standing pose, limbs at a fixed swivel angle.

As Unzueta et al. 2008 adapt the method: every frame starts from the standing pose; the root is placed and
turned by its estimate, the spine is solved by CCD, clavicles stay at rest, legs and arms close in the plane
of a reference direction of the pelvis. Where a limb points along its reference another one takes over, and
the swivel may jump. The original's trunk of three segments and its spline are left out, as in their study.

References: Kulpa, Multon, Arnaldi, "Morphology-independent representation of motions for interactive
human-like animation", Computer Graphics Forum 24 (2005); Unzueta et al. 2008, section 9.
"""

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper
from sixpoint.solvers.ccd.frame import solve_spine
from sixpoint.solvers.six_points.frame import (
    MEMORY_ROWS,
    end_limb,
    end_trunk,
    estimate_pelvis,
    fill_lost,
    judge,
    write_frame,
)
from sixpoint.solvers.six_points.packing import LIMB_ROWS, limb_row, unpack_model
from sixpoint.solvers.six_points.tree import place_chain, unpack_tree
from sixpoint.solvers.tgb.swivel import solve_at

ALIGNED = 0.05  # sine of the angle below which a limb runs along its reference: about 3 degrees


@helper
def reference_of(limb, pelvis, n):
    """Where the middle joint is to be, in the world: for arms down, else back; for legs forward, else up."""
    if limb < 2:
        first = vec.scale(-1.0, qt.y_axis(pelvis))
        second = vec.scale(-1.0, qt.z_axis(pelvis))
    else:
        first, second = qt.z_axis(pelvis), qt.y_axis(pelvis)
    return second if vec.norm(vec.cross(first, n)) < ALIGNED else first


@helper
def solve_frame(model, tree, options, points, local, memory, residual, world, positions, filled):
    """Solve one frame; returns status and the sweeps of the spine."""
    limits = options[3] > 0.0
    count = model.segments.shape[0]
    lost = fill_lost(points, filled, memory, model.chords[0])
    x, y = estimate_pelvis(filled, memory, options[0], options[1], options[2])
    estimate = qt.from_axes(x, y, vec.cross(x, y))
    qt.store(local, 0, estimate)
    for k in range(1, count + 2):  # the standing pose: spine and clavicles
        qt.store(local, k, qt.IDENTITY)
    top, sweeps = solve_spine(
        tree,
        model.balls,
        limits,
        False,
        count,
        vec.load(filled, 0),
        vec.load(filled, 1),
        local,
        world,
        positions,
    )
    end_trunk(filled, memory, x, y, vec.load(positions, 0), top, residual)
    place_chain(tree.offsets, tree.parents, local, count, LIMB_ROWS, 1, world, positions)
    for limb in range(4):
        residual[limb + 2] = 0.0
        if filled[limb + 2, 3] == 0.0:
            continue
        row = limb_row(count, limb)
        frame, place = qt.load(world, tree.parents[row]), vec.load(positions, row)
        target = vec.load(filled, limb + 2)
        gap = vec.sub(target, place)
        reference = reference_of(limb, estimate, vec.unit(gap))
        upper, hinge, end = solve_at(
            qt.inv_mul_vec(frame, gap),
            model.limbs[limb, 0],
            model.limbs[limb, 1],
            -1.0 if limb < 2 else 1.0,
            qt.inv_mul_vec(frame, reference),
            0.0,
            limits,
            model.balls,
            row,
            model.limbs[limb, 2],
            model.limbs[limb, 3],
        )
        end_limb(target, limb, row, frame, place, upper, hinge, end, local, residual)
    return judge(lost, residual), sweeps


@entry
def solve_kma(
    table,
    integers,
    balls,
    chords,
    tree_table,
    tree_integers,
    work,
    options,
    points,
    state,
    rotations,
    pelvis,
    outcome,
    residual,
):
    """Solve F frames in order; see ``SixPointSolver``."""
    model = unpack_model(table, integers, balls, chords)
    tree = unpack_tree(tree_table, tree_integers)
    rows = state.shape[0] - MEMORY_ROWS
    local, memory = state[:rows], state[rows:]
    world, positions, filled = work[:rows], work[rows : 2 * rows], work[2 * rows :]
    for f in range(points.shape[0]):
        outcome[f, 0], outcome[f, 1] = solve_frame(
            model, tree, options, points[f], local, memory, residual[f], world, positions, filled
        )
        write_frame(model, local, memory, rotations[f], pelvis[f])
