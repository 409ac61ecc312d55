"""SIK+ with elbows out of the trunk: the entries of ``frame`` with one more array."""

from sixpoint.kernels.jit import entry
from sixpoint.solvers.avoidance.packing import unpack_flesh
from sixpoint.solvers.sequential.packing import unpack_work
from sixpoint.solvers.sequential_plus.frame import solve_frame, solve_frame_from
from sixpoint.solvers.sequential_plus.packing import unpack_settings
from sixpoint.solvers.six_points.frame import MEMORY_ROWS, write_frame
from sixpoint.solvers.six_points.packing import unpack_model


@entry
def solve_plus_clear(
    table,
    integers,
    balls,
    chords,
    flesh,
    thighs,
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
    """Solve F frames; ``flesh`` and ``thighs`` as in ``avoidance.packing``, others as of ``solve_plus``."""
    model = unpack_model(table, integers, balls, chords)
    s = unpack_settings(options)
    scratch = unpack_work(work, model.segments.shape[0])
    rows = state.shape[0] - MEMORY_ROWS
    local, memory = state[:rows], state[rows:]
    trunk = unpack_flesh(flesh, thighs, work[work.shape[0] - 4 :], memory)
    for f in range(points.shape[0]):
        outcome[f, 0] = solve_frame(
            model, s, points[f], turned[f], trunk, local, memory, residual[f], scratch
        )
        outcome[f, 1] = 1
        write_frame(model, local, memory, rotations[f], pelvis[f])


@entry
def solve_from_start_clear(
    table,
    integers,
    balls,
    chords,
    flesh,
    thighs,
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
    """The same, each frame from a pose ``given``, see ``start``."""
    model = unpack_model(table, integers, balls, chords)
    s = unpack_settings(options)
    scratch = unpack_work(work, model.segments.shape[0])
    rows = state.shape[0] - MEMORY_ROWS
    local, memory = state[:rows], state[rows:]
    trunk = unpack_flesh(flesh, thighs, work[work.shape[0] - 4 :], memory)
    for f in range(points.shape[0]):
        outcome[f, 0] = solve_frame_from(
            model, s, points[f], turned[f], given[f], trunk, local, memory, residual[f], scratch
        )
        outcome[f, 1] = 1
        write_frame(model, local, memory, rotations[f], pelvis[f])
