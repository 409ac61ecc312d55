"""SIK with a prior and elbows out of the trunk: the entry of ``frame`` with one more array."""

from sixpoint.kernels.jit import entry
from sixpoint.solvers.avoidance.packing import unpack_flesh
from sixpoint.solvers.sequential.packing import unpack_work
from sixpoint.solvers.sequential_plus.packing import unpack_settings
from sixpoint.solvers.sequential_prior.frame import solve_frame
from sixpoint.solvers.sequential_prior.packing import (
    END,
    LIMB,
    MASKS,
    POINTS,
    TURNED,
    unpack_facts,
    unpack_network,
    unpack_thought,
)
from sixpoint.solvers.six_points.frame import MEMORY_ROWS, write_frame
from sixpoint.solvers.six_points.packing import unpack_model


@entry
def solve_prior_clear(
    table,
    integers,
    balls,
    chords,
    numbers,
    places,
    turns,
    flesh,
    thighs,
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
    """Solve F frames; ``flesh`` and ``thighs`` as in ``avoidance.packing``, others as of ``solve_prior``."""
    model = unpack_model(table, integers, balls, chords)
    s = unpack_settings(options)
    facts = unpack_facts(numbers)
    by_places = unpack_network(places, POINTS, LIMB)
    by_turns = unpack_network(turns, POINTS + TURNED + MASKS, LIMB + END)
    scratch = unpack_work(work, model.segments.shape[0])
    thought = unpack_thought(thoughts, course)
    rows = state.shape[0] - MEMORY_ROWS
    local, memory = state[:rows], state[rows:]
    trunk = unpack_flesh(flesh, thighs, work[work.shape[0] - 4 :], memory)
    for f in range(points.shape[0]):
        outcome[f, 0] = solve_frame(
            model,
            s,
            facts,
            by_places,
            by_turns,
            points[f],
            turned[f],
            trunk,
            local,
            memory,
            residual[f],
            scratch,
            thought,
        )
        outcome[f, 1] = 1
        write_frame(model, local, memory, rotations[f], pelvis[f])
