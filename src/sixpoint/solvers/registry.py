"""All solvers of the six points by the name the command line uses."""

from __future__ import annotations

import importlib
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
from sixpoint.solvers.tgb.solver import TGBSequentialIK

SOLVERS: dict[str, Callable[..., Solver]] = {
    "sik": SequentialIK,
    "sik+": SequentialIKPlus,
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


def make_solver(name: str, figure: Figure, **options: Any) -> Solver:
    """Make a solver by name; an unknown name is an error that lists those there are."""
    return find_solver(name)(figure, **options)
