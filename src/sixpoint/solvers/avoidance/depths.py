"""Depths of arms and thighs over a motion, by what the solvers keep apart: the compiled loop."""

from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry
from sixpoint.solvers.avoidance.clearance import deepest
from sixpoint.solvers.avoidance.packing import unpack_flesh
from sixpoint.solvers.avoidance.thigh_clearance import gap_of_thighs


@entry
def find_depths(table, thighs, world, trunk, arms, legs, work, depths, apart):
    """Depths of both arms in trunk or thighs, and of the thighs in each other.

    Args:
        table: Trunk and arms, see ``packing``.
        thighs: See ``packing``; of an arm without balls nothing is in them.
        world: (F, S, 4) anatomical world rotations of the trunk's joints.
        trunk: (F, S, 4) their places [m].
        arms: (F, 6, 4) left shoulder, elbow and wrist, then the right ones [m].
        legs: (F, 4, 4) left hip and knee, then the right ones [m].
        work: (S, 4) working memory.
        depths: (F, 2) out, of the arms [m].
        apart: (F,) out, of the thighs in each other [m].
    """
    for f in range(world.shape[0]):
        flesh = unpack_flesh(table, thighs, legs[f], work)
        for k in range(work.shape[0] - 1):
            vec.store(work, k, vec.sub(vec.load(trunk[f], k + 1), vec.load(trunk[f], k)))
        root = vec.load(trunk[f], 0)
        for side in range(2):
            shoulder, elbow = vec.load(arms[f], 3 * side), vec.load(arms[f], 3 * side + 1)
            wrist = vec.load(arms[f], 3 * side + 2)
            depths[f, side], _, _ = deepest(flesh, root, world[f], work, shoulder, elbow, wrist)
        apart[f] = max(-gap_of_thighs(legs[f], thighs[0, 0], thighs[0, 1]), 0.0)
