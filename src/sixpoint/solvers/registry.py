"""All solvers of the six points by the name the command line uses."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError, listed
from sixpoint.solvers.base import Solver
from sixpoint.solvers.prioritized.solver import PrioritizedIK
from sixpoint.solvers.sequential.solver import SequentialIK

SOLVERS: dict[str, Callable[..., Solver]] = {
    "sik": SequentialIK,
    "pik": partial(PrioritizedIK.from_targets, flext=False),
    "pik-flext": PrioritizedIK.from_targets,
}
"""Name -> what makes the solver of a figure."""


def make_solver(name: str, figure: Figure, **options: Any) -> Solver:
    """Make a solver by name; an unknown name is an error that lists those there are."""
    if name not in SOLVERS:
        raise SixpointError(f"no method named {name!r}; methods: {listed(SOLVERS)}")
    return SOLVERS[name](figure, **options)
