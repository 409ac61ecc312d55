"""How markers are followed, checked before any file is read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sixpoint.errors import SixpointError, listed
from sixpoint.jobs.solving import Solving
from sixpoint.solvers.registry import DEFAULT


@dataclass(frozen=True)
class Following:
    """How to follow.

    Attributes:
        model: A saved marker model; None: calibrated on the static trial, or on the recording itself.
        static: A recording of the same person and markers, standing still.
        layout: A TOML table marker label -> role, or the name of a shipped one.
        markers: Labels to use; empty for all that have a role.
        limits: Keep joints within their limits, widened where the markers themselves contradict them.
        limits_file: A table of joint limits in place of the shipped one; it is not widened.
        cutoff: Filter the markers without delay at this frequency [Hz]; None for not at all.
        lock_feet: Hold feet still while they stand.
    """

    model: Path | None = None
    static: Path | None = None
    layout: Path | str | None = None
    markers: tuple[str, ...] = ()
    limits: bool = True
    limits_file: Path | None = None
    cutoff: float | None = None
    lock_feet: bool = False

    @property
    def files(self) -> tuple[Path | None, ...]:
        """What is read beside the recording; None for what is not."""
        return self.model, self.static, None if self.layout is None else Path(self.layout), self.limits_file

    def check(self) -> None:
        """Refuse what excludes each other.

        Raises:
            SixpointError: The message says what.
        """
        if self.model is not None and (self.static is not None or self.layout is not None):
            raise SixpointError("--model is calibrated already: leave out --static and --layout")
        if not self.limits and self.limits_file is not None:
            raise SixpointError("--limits FILE and --no-limits exclude each other")
        if self.cutoff is not None and not self.cutoff > 0:
            raise SixpointError(f"the cutoff is a positive frequency [Hz], got {self.cutoff}")


def parse_labels(text: str) -> tuple[str, ...]:
    """Marker labels as ``LASI,RASI,LKNE``."""
    return tuple(filter(None, (word.strip() for word in text.split(","))))


def parse_six(six: bool, method: str | None, no_limits: bool) -> Solving | None:
    """How the six points are solved, from the options of the command line; None: markers are followed.

    Raises:
        SixpointError: A method is named, but no six points are asked for.
    """
    if not six:
        if method is not None:
            raise SixpointError(
                f"--method {method} says how six points are solved: add --six, or leave it out"
            )
        return None
    return Solving(DEFAULT if method is None else method, limits=not no_limits)


def check_replay(**options: Any) -> None:
    """Refuse options, by the names of their parameters, that a replay would not heed.

    Raises:
        SixpointError: The message names them.
    """
    given = [f"--{name.replace('_', '-')}" for name, value in options.items() if value not in (None, False)]
    if given:
        raise SixpointError(
            f"a replay (--live, --view) goes frame by frame and writes nothing: leave out {listed(given)}, "
            "or leave out --live and --view"
        )
