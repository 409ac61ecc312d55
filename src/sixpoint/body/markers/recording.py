"""Markers: points on a body as a laboratory records them, named, with gaps."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.motion import FileSpace
from sixpoint.body.skeleton import frozen
from sixpoint.errors import TargetError, listed

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Event:
    """Something that a recording names a time of, such as a foot strike.

    Attributes:
        label: What happened.
        time: When, from the first frame of the recording [s].
        context: Of what: "Left", "Right", "General" or empty.
    """

    label: str
    time: float
    context: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class Markers:
    """Positions of M named points over F frames, in metres and Y up.

    Attributes:
        names: M distinct labels.
        positions: (F, M, 3) [m]; NaN where a marker is not seen.
        rate: Frames per second [Hz].
        residuals: (F, M) of the reconstruction by the cameras [m], NaN where unknown; None: not recorded.
        events: In order of time.
        space: Unit and up axis of the file.
        name: Short name for messages and file names.
    """

    names: tuple[str, ...]
    positions: Array
    rate: float
    residuals: Array | None = None
    events: tuple[Event, ...] = ()
    space: FileSpace = field(default_factory=FileSpace)
    name: str = "markers"

    def __repr__(self) -> str:
        return f"Markers({self.name!r}, {len(self.names)} markers, {len(self)} frames at {self.rate:g} Hz)"

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "names", tuple(self.names))
        set_(self, "events", tuple(self.events))
        set_(self, "rate", float(self.rate))
        positions, count = np.asarray(self.positions, float), len(self.names)
        if positions.ndim != 3 or positions.shape[1:] != (count, 3) or not (count and len(positions)):
            raise TargetError(
                f"markers are (frames, {count}, 3), one column per name and none empty, got {positions.shape}"
            )
        repeated = sorted(name for name, times in Counter(self.names).items() if times > 1)
        if repeated:
            raise TargetError(f"marker names must be distinct; repeated: {listed(repeated)}")
        if not (np.isfinite(self.rate) and self.rate > 0):
            raise TargetError(f"the frame rate must be positive, got {self.rate}")
        whole = np.all(np.isfinite(positions), axis=-1, keepdims=True)
        set_(self, "positions", frozen(np.where(whole, positions, np.nan)))
        if self.residuals is not None:
            if np.shape(self.residuals) != positions.shape[:2]:
                raise TargetError(f"residuals must be {positions.shape[:2]}, got {np.shape(self.residuals)}")
            set_(self, "residuals", frozen(self.residuals))

    def __len__(self) -> int:
        return int(self.positions.shape[0])

    @property
    def tracked(self) -> NDArray[np.bool_]:
        """(F, M) whether each marker is seen."""
        return np.asarray(np.isfinite(self.positions[..., 0]), bool)

    def index(self, name: str) -> int:
        """Column of a marker by name; the error lists the markers there are."""
        try:
            return self.names.index(name)
        except ValueError:
            raise TargetError(f"no marker named {name!r}; markers: {listed(self.names)}") from None

    def sliced(self, frames: slice) -> Markers:
        """The frames of a slice; an empty slice is an error that says how many frames there are."""
        chosen = range(*frames.indices(len(self)))
        if len(chosen) == 0:
            raise TargetError(f"no frames left of 0 to {len(self) - 1}, asked for {frames}")
        first, step = chosen[0] / self.rate, abs(frames.step or 1)
        return replace(
            self,
            positions=self.positions[frames],
            residuals=None if self.residuals is None else self.residuals[frames],
            events=tuple(replace(event, time=event.time - first) for event in self.events),
            rate=self.rate / step,
        )

    def selected(self, names: tuple[str, ...] | list[str]) -> Markers:
        """Only some of the markers, in the order given."""
        columns = [self.index(name) for name in names]
        return replace(
            self,
            names=tuple(names),
            positions=self.positions[:, columns],
            residuals=None if self.residuals is None else self.residuals[:, columns],
        )
