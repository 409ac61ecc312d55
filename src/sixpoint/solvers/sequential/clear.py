"""Sequential IK with elbows out of the trunk: the entry of ``frame`` with one more array."""

from sixpoint.kernels.jit import entry
from sixpoint.solvers.avoidance.packing import unpack_flesh
from sixpoint.solvers.sequential.frame import solve_frame
from sixpoint.solvers.sequential.packing import unpack_settings, unpack_work
from sixpoint.solvers.six_points.frame import MEMORY_ROWS, write_frame
from sixpoint.solvers.six_points.packing import unpack_model


@entry
def solve_sequential_clear(
    table,
    integers,
    balls,
    chords,
    flesh,
    thighs,
    work,
    options,
    points,
    state,
    rotations,
    pelvis,
    outcome,
    residual,
):
    """Solve F frames with elbows out of the trunk; ``flesh`` and ``thighs`` as in ``avoidance.packing``."""
    model = unpack_model(table, integers, balls, chords)
    settings = unpack_settings(options)
    scratch = unpack_work(work, model.segments.shape[0])
    rows = state.shape[0] - MEMORY_ROWS
    local, memory = state[:rows], state[rows:]
    trunk = unpack_flesh(flesh, thighs, work[work.shape[0] - 4 :], memory)
    for f in range(points.shape[0]):
        outcome[f, 0] = solve_frame(model, settings, points[f], trunk, local, memory, residual[f], scratch)
        outcome[f, 1] = 1
        write_frame(model, local, memory, rotations[f], pelvis[f])
