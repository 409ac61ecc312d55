"""TGBSIK: the trunk and clavicles of Sequential IK, the limbs of Tolani, Goswami and Badler.

The swivel angle of each limb is the one of least swing^2 + weight twist^2 of shoulder or hip, on the whole
circle. That minimum jumps where two of them are alike.

References: Tolani, Goswami, Badler, "Real-time inverse kinematics techniques for anthropomorphic limbs",
Graphical Models 62 (2000) 353-388; Unzueta et al. 2008, section 9.
"""

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper
from sixpoint.solvers.sequential.frame import place_limb, pose_trunk
from sixpoint.solvers.sequential.packing import unpack_settings, unpack_work
from sixpoint.solvers.six_points.frame import MEMORY_ROWS, end_limb, judge, write_frame
from sixpoint.solvers.six_points.packing import limb_row, unpack_model
from sixpoint.solvers.tgb.swivel import solve_easiest


@helper
def solve_frame(model, settings, weight, points, local, memory, residual, scratch):
    """One frame; arguments as of ``sequential.frame.solve_frame``, ``weight`` is that of twist."""
    lost, root = pose_trunk(model, settings, points, local, memory, residual, scratch)
    world, segs, filled = scratch.world, scratch.segs, scratch.filled
    for limb in range(4):
        residual[limb + 2] = 0.0
        if filled[limb + 2, 3] == 0.0:
            continue
        target = vec.load(filled, limb + 2)
        frame, place = place_limb(
            model, settings.limits, settings.hold_clavicles, limb, root, target, local, world, segs
        )
        row = limb_row(segs.shape[0], limb)
        upper, hinge, end = solve_easiest(
            qt.inv_mul_vec(frame, vec.sub(target, place)),
            model.limbs[limb, 0],
            model.limbs[limb, 1],
            -1.0 if limb < 2 else 1.0,
            weight,
            settings.limits,
            model.balls,
            row,
            model.limbs[limb, 2],
            model.limbs[limb, 3],
        )
        end_limb(target, limb, row, frame, place, upper, hinge, end, local, residual)
    return judge(lost, residual)


@entry
def solve_tgbsik(
    table, integers, balls, chords, work, options, points, state, rotations, pelvis, outcome, residual
):
    """Solve F frames in order; arguments as of ``sequential.frame.solve_sequential``."""
    model = unpack_model(table, integers, balls, chords)
    settings = unpack_settings(options)
    scratch = unpack_work(work, model.segments.shape[0])
    rows = state.shape[0] - MEMORY_ROWS
    local, memory = state[:rows], state[rows:]
    for f in range(points.shape[0]):
        outcome[f, 0] = solve_frame(
            model, settings, options[7], points[f], local, memory, residual[f], scratch
        )
        outcome[f, 1] = 1
        write_frame(model, local, memory, rotations[f], pelvis[f])
