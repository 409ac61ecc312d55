"""All solvers of the six points by the name the command line uses."""

from __future__ import annotations

import importlib
import inspect
import re
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError, listed
from sixpoint.solvers.base import Solver
from sixpoint.solvers.ccd.solver import CyclicCoordinateDescent
from sixpoint.solvers.hybrid.solver import HybridIK
from sixpoint.solvers.jacobian.solver import JacobianIK
from sixpoint.solvers.kma.solver import KulpaMultonArnaldi
from sixpoint.solvers.prioritized.solver import PrioritizedIK
from sixpoint.solvers.sequential.solver import SequentialIK
from sixpoint.solvers.sequential_plus.solver import SequentialIKPlus
from sixpoint.solvers.sequential_prior.solver import SequentialIKPrior
from sixpoint.solvers.tgb.solver import TGBSequentialIK

SOLVERS: dict[str, Callable[..., Solver]] = {
    "sik": SequentialIK,
    "sik+": SequentialIKPlus,
    "sik-prior": SequentialIKPrior,
    "tgbsik": TGBSequentialIK,
    "kma": KulpaMultonArnaldi,
    "ccd": CyclicCoordinateDescent,
    "jt": partial(JacobianIK, step="transpose"),
    "pinv": partial(JacobianIK, step="pseudoinverse"),
    "dls": partial(JacobianIK, step="dls"),
    "dls-svd": partial(JacobianIK, step="dls-svd"),
    "sdls": partial(JacobianIK, step="sdls"),
    "pik": partial(PrioritizedIK.from_targets, flext=False),
    "pik-flext": PrioritizedIK.from_targets,
    "hybrid": HybridIK,
}
"""Name -> what makes the solver of a figure."""

PERSON = re.compile(r"[a-z][\w.-]*(/[\w.-]+)*")
"""A data set, or a person in one: ``cmu``, ``cmu/02``."""

DEFAULT = "sik+"
"""The method where none is named."""


def find_solver(name: str) -> Callable[..., Solver]:
    """What makes a solver: a name of ``SOLVERS``, or ``module:attribute`` of a user's own.

    The module is looked for as Python does, and in the current folder.

    Raises:
        SixpointError: There is no such method; the message lists those there are.
    """
    if name in SOLVERS:
        return SOLVERS[name]
    module, _, attribute = name.partition(":")
    if not attribute:
        raise SixpointError(
            f"no method named {name!r}; methods: {listed(SOLVERS)}, or module:Class for your own"
        )
    found = getattr(_import(module, name), attribute, None)
    if not callable(found):
        raise SixpointError(f"{name!r}: the module {module} has no class or function {attribute!r}")
    return found  # type: ignore[no-any-return]


def find_options(solver: Callable[..., Solver]) -> list[str]:
    """Names of the options of a solver; the figure comes first and is none."""
    parameters = list(inspect.signature(solver).parameters.values())[1:]
    return [p.name for p in parameters if p.kind in (p.KEYWORD_ONLY, p.POSITIONAL_OR_KEYWORD)]


def find_fitted_on(name: str) -> tuple[str, ...]:
    """The people that a method was fitted on, as ``("cmu/02", "mass")``: its attribute ``fitted_on``, if any.

    A name is that of a data set, or of a person or recording in one: ``PERSON``.

    Raises:
        SixpointError: It declares something else.
    """
    solver = find_solver(name)
    made = solver.func if isinstance(solver, partial) else solver
    people = getattr(made, "fitted_on", ())
    if not isinstance(people, tuple | list):
        raise SixpointError(f"{name!r}: fitted_on must be a tuple of names such as 'cmu/02', got {people!r}")
    for person in people:
        if not (isinstance(person, str) and PERSON.fullmatch(person)):
            raise SixpointError(
                f"{name!r}: fitted_on names people as 'cmu/02', or a whole data set as 'mass', got {person!r}"
            )
    return tuple(people)


def _import(module: str, name: str) -> Any:
    here = str(Path.cwd())
    sys.path.insert(0, here)
    try:
        return importlib.import_module(module)
    except Exception as error:  # the user's module may fail in any way
        raise SixpointError(f"{name!r}: the module {module} cannot be imported: {error}") from error
    finally:
        if here in sys.path:
            sys.path.remove(here)


def methods_with(option: str) -> list[str]:
    """The names of ``SOLVERS`` whose solvers have an option."""
    return [name for name, solver in SOLVERS.items() if option in find_options(solver)]


def make_solver(name: str, figure: Figure, **options: Any) -> Solver:
    """Make a solver by name; an unknown name or option is an error that lists what there is."""
    solver = find_solver(name)
    for option in options:
        having = methods_with(option)
        if name in SOLVERS and name not in having:
            hint = f"; {listed(having)} have it" if having else ""
            raise SixpointError(f"the method {name!r} has no option {option}{hint}")
    return solver(figure, **options)
