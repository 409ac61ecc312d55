"""The methods of a comparison with their presets: fixed before anything is measured."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from sixpoint.body.figure import Figure
from sixpoint.errors import SixpointError, listed
from sixpoint.solvers.base import Solver
from sixpoint.solvers.jacobian.solver import DAMPING, REACH
from sixpoint.solvers.registry import SOLVERS, find_fitted_on, find_options, find_solver

STOP = "stops at 1 cm, at a gain below 1 mm, or after 20 iterations"
PRESETS: Mapping[str, tuple[Mapping[str, Any], str]] = {
    "sik": ({}, "closed form; the chord search is exact"),
    "sik+": ({}, "constants as benchmarks/tune_sik_plus.py chose them"),
    "sik-prior": ({}, "as sik+; trunk, elbows and knees start where the fitted prior says, docs/prior.md"),
    "tgbsik": ({}, "weight of twist 1; swivel searched on the whole circle by 0.1, then 0.01 rad"),
    "kma": ({}, f"from the standing pose; swivel angles zero; the spine's CCD {STOP}"),
    "ccd": ({}, f"from tip to root; {STOP}"),
    "jt": ({}, f"targets at most {REACH:g} m away; {STOP}"),
    "pinv": ({}, f"targets at most {REACH:g} m away, singular values below 1 % dropped; {STOP}"),
    "dls": ({}, f"damping {DAMPING:g} m, targets at most {REACH:g} m away; {STOP}"),
    "dls-svd": ({}, f"damping {DAMPING:g} m, targets at most {REACH:g} m away; {STOP}"),
    "sdls": ({}, f"largest turn 45 degrees, targets at most {REACH:g} m away; {STOP}"),
    "pik": (
        {"tolerance": 0.01},
        "levels pelvis, ankles, wrists, head; stops at 1 cm, or by its own rule",
    ),
    "pik-flext": ({"tolerance": 0.01}, "as pik, limbs by FLEXT in its secant form"),
    "hybrid": ({}, "sik+, then feet that stand held by at most three iterations of pik-flext"),
}
"""Method -> options that differ from the solver's own, and the preset in words."""


@dataclass(frozen=True)
class Method:
    """A method of a comparison.

    Attributes:
        name: What it is called in tables.
        solver: Name of ``SOLVERS``, or ``module:Class``.
        options: Its fixed options.
        preset: The same in words.
        fitted_on: People whose recordings it was fitted on, as "cmu/02".
    """

    name: str
    solver: str
    options: Mapping[str, Any] = field(default_factory=dict)
    preset: str = ""
    fitted_on: tuple[str, ...] = ()

    @classmethod
    def named(cls, solver: str, name: str = "", options: Mapping[str, Any] | None = None) -> Method:
        """A method by the name of its solver, with its preset and further options.

        Raises:
            SixpointError: There is no such solver or option, or it says wrongly what it was fitted on.
        """
        found = find_solver(solver)
        usual, text = PRESETS.get(solver, ({}, "the user's own"))
        if options:
            text = ", ".join(f"{key} {value}" for key, value in options.items()) + f"; {text}"
        method = cls(
            name or solver.rpartition(":")[2],
            solver,
            {**usual, **(options or {})},
            text,
            find_fitted_on(solver),
        )
        known = find_options(found)
        unknown = [key for key in method.options if key not in known]
        if unknown and not _takes_more(found):
            raise SixpointError(
                f"the method {solver!r} has no option {listed(unknown)}; it has: {listed(known)}"
            )
        return method

    def choose(self, limits: bool, weights: tuple[float, float, float] | None) -> dict[str, Any]:
        """Options of the solver: its own, and the study's limits and weights where it knows them."""
        known = find_options(find_solver(self.solver))
        options = dict(self.options)
        if "limits" in known:
            options.setdefault("limits", limits)
        if weights is not None and "weights" in known:
            options.setdefault("weights", weights)
        return options

    def describe(self, limits: bool, weights: tuple[float, float, float] | None) -> str:
        """The same as a text, for results."""
        texts = []
        for name, value in sorted(self.choose(limits, weights).items()):
            numbers = value if isinstance(value, tuple | list) else (value,)
            texts.append(f"{name}={','.join(f'{v:g}' if isinstance(v, float) else str(v) for v in numbers)}")
        return " ".join(texts)

    def make(self, figure: Figure, limits: bool, weights: tuple[float, float, float] | None) -> Solver:
        """The solver of a figure."""
        return find_solver(self.solver)(figure, **self.choose(limits, weights))


def _takes_more(solver: Callable[..., Solver]) -> bool:
    """Whether a solver has options beside those it names."""
    return any(p.kind is p.VAR_KEYWORD for p in inspect.signature(solver).parameters.values())


METHODS = {name: Method.named(name) for name in SOLVERS}
"""All methods of ours by name."""


def choose_methods(text: str) -> tuple[Method, ...]:
    """Methods as ``sik,kma,my_module:MySolver``; ``all`` are ours.

    Raises:
        SixpointError: A method does not exist; the message lists those there are.
    """
    chosen: dict[str, Method] = {}
    for word in filter(None, (part.strip() for part in text.split(","))):
        for method in METHODS.values() if word == "all" else [Method.named(word)]:
            if method.name in chosen and chosen[method.name] != method:
                method = Method.named(method.solver, method.solver)
            chosen[method.name] = method
    if not chosen:
        raise SixpointError(f"no methods; there are: {listed(SOLVERS)}, or module:Class for your own")
    return tuple(chosen.values())
