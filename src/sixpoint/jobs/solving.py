"""How a job solves: method, options and limits, checked before any file is read."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.limits import Limits
from sixpoint.body.motion import Motion
from sixpoint.body.surface.flesh import build_shape
from sixpoint.body.targets import EFFECTORS, Targets
from sixpoint.errors import SixpointError, listed
from sixpoint.jobs.progress import Progress, silent
from sixpoint.solvers.avoidance.penetration import find_penetration
from sixpoint.solvers.base import MotionSolution
from sixpoint.solvers.registry import DEFAULT, find_options, find_solver, make_solver, methods_with


@dataclass(frozen=True)
class Solving:
    """How to solve.

    Attributes:
        method: A name of ``SOLVERS``, or ``module:Class``.
        weights: Influence of wrists, ankles and the last frame on the pelvis; None: the method's own.
        search: "exact" or "literal"; None: the method's own.
        limits: Keep joints within their limits.
        limits_file: A table of joint limits in place of the shipped one.
        rotations: Effectors whose measured rotations are used; none by default.
        avoid: What is kept apart, of "elbows", "forearms", "thighs" and "arms"; a figure without a surface
            has the built-in one then.
    """

    method: str = DEFAULT
    weights: tuple[float, float, float] | None = None
    search: str | None = None
    limits: bool = True
    limits_file: Path | None = None
    rotations: tuple[str, ...] = ()
    avoid: tuple[str, ...] = ()

    def check(self) -> None:
        """Refuse a method that does not exist, and options it does not have.

        Raises:
            SixpointError: The message lists the methods, or the options of the method.
        """
        solver = find_solver(self.method)
        if not self.limits and self.limits_file is not None:
            raise SixpointError("--limits FILE and --no-limits exclude each other")
        known = find_options(solver)
        for name in self.options:
            if name not in known:
                having = methods_with(name)
                hint = f"; {listed(having)} have it: add --method {having[0]}" if having else ""
                raise SixpointError(f"the method {self.method!r} has no option {name}{hint}")
        make_solver(self.method, Figure.from_stature(), **self.options)

    def takes(self, option: str) -> bool:
        """Whether the method has an option."""
        return option in find_options(find_solver(self.method))

    @property
    def options(self) -> dict[str, Any]:
        """Keyword arguments of the solver, only what was asked for."""
        options: dict[str, Any] = {} if self.limits else {"limits": False}
        for name in ("weights", "search"):
            if getattr(self, name) is not None:
                options[name] = getattr(self, name)
        for name in ("rotations", "avoid"):
            if getattr(self, name):
                options[name] = getattr(self, name)
        return options

    def load_limits(self) -> Limits | None:
        """The joint limits asked for; None is the shipped table."""
        return None if self.limits_file is None else Limits.load(self.limits_file)


def parse_weights(text: str) -> tuple[float, float, float]:
    """Weights as ``1,1,0``."""
    try:
        first, second, third = (float(word) for word in text.split(","))
    except ValueError:
        raise SixpointError(
            "weights are three numbers: wrists, ankles and memory of the last frame, e.g. 1,1,0 or "
            f"0.1,0.1,1; got {text!r}"
        ) from None
    return first, second, third


def parse_names(text: str) -> tuple[str, ...]:
    """Names as ``elbows,forearms``."""
    return tuple(filter(None, (word.strip() for word in text.split(","))))


def parse_rotations(text: str) -> tuple[str, ...]:
    """Effectors as ``pelvis,head``, or ``all``; the solver says which there are."""
    names = parse_names(text)
    return EFFECTORS if names == ("all",) else names


def parse_solving(
    method: str = DEFAULT,
    weights: str | None = None,
    search: str | None = None,
    rotations: str | None = None,
    limits: Path | None = None,
    no_limits: bool = False,
    avoid: str | None = None,
) -> Solving:
    """How to solve, from the options of the command line."""
    return Solving(
        method,
        None if weights is None else parse_weights(weights),
        search,
        limits=not no_limits,
        limits_file=limits,
        rotations=() if rotations is None else parse_rotations(rotations),
        avoid=() if avoid is None else parse_names(avoid),
    )


@dataclass(frozen=True, eq=False)
class Solved:
    """What a solver made of targets.

    Attributes:
        solution: Postures, status and residual of each frame.
        seconds: Time per frame, kernels compiled [s].
        inside: How deep what was to be kept apart still is, see ``find_penetration`` [m]; empty where nothing
            was.
    """

    solution: MotionSolution
    seconds: float
    inside: dict[str, NDArray[np.float64]] = field(default_factory=dict)


def solve(
    figure: Figure,
    targets: Targets,
    solving: Solving,
    progress: Progress = silent,
    *,
    start: Motion | None = None,
) -> Solved:
    """Pose a figure for every frame; kernels are compiled before the clock starts.

    Args:
        figure: Whom to pose.
        targets: Where its six points shall be.
        solving: Method and options.
        progress: Told how far the work is.
        start: Postures to start from, one for each frame; not used by methods that take none.
    """
    if solving.avoid and figure.shape is None:
        figure = figure.with_shape(build_shape(figure))
    solver = make_solver(solving.method, figure, **solving.options)
    solver.warm_up()
    run: Callable[..., MotionSolution] = solver.solve_frames
    first = run
    one = slice(0, 1)
    if start is not None and getattr(solver, "takes_start", False):
        run, first = partial(run, start=start), partial(run, start=start.sliced(one))
    first(targets.sliced(one))  # arrays of the kind that follow
    begun = time.perf_counter()
    solution = run(targets, lambda done: progress("solving", done, len(targets)))
    seconds = (time.perf_counter() - begun) / len(targets)
    inside = find_penetration(figure, solution.motion, solving.avoid) if solving.avoid else {}
    return Solved(solution, seconds, inside)
