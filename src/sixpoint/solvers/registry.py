"""All solvers by the name the command line uses."""

from __future__ import annotations

from typing import Any

from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError, listed
from sixpoint.solvers.base import Solver
from sixpoint.solvers.sequential.solver import SequentialIK

SOLVERS: dict[str, type[Any]] = {"sik": SequentialIK}


def make_solver(name: str, figure: Figure, **options: Any) -> Solver:
    """Make a solver by name; an unknown name is an error that lists those there are."""
    if name not in SOLVERS:
        raise SixpointError(f"no method named {name!r}; methods: {listed(SOLVERS)}")
    solver: Solver = SOLVERS[name](figure, **options)
    return solver
