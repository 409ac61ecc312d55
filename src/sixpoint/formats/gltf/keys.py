"""A Motion as keys of an animation.

All samplers share one list of times. What does not change gets a single key, and none if the node is so
anyway; the root always has all keys, so that the number of frames is kept.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.formats.gltf.builder import Builder

Array = NDArray[np.float64]

SAME = 1e-7
"""Numbers nearer than this are the same in single precision."""


class Keys:
    """One animation being written.

    Args:
        builder: The file.
        frames: How many frames.
        rate: Frames per second [Hz].
        name: Of the animation.
    """

    def __init__(self, builder: Builder, frames: int, rate: float, name: str) -> None:
        self._builder, self._frames = builder, frames
        self._animation: dict[str, Any] = {"name": name, "channels": [], "samplers": []}
        self._all = builder.add_accessor(np.arange(frames) / rate, bounds=True)
        self._one: int | None = self._all if frames == 1 else None

    def add(self, node: int, path: str, values: Array, rest: ArrayLike, *, whole: bool = False) -> None:
        """Keys of one property.

        Args:
            node: Which node.
            path: "rotation" or "translation".
            values: (F, 4) or (F, 3).
            rest: What the node itself says; nothing is written where this never changes.
            whole: Write all frames, whatever happens in them.
        """
        if path == "rotation":
            values = _continuous(values)
            rest = np.asarray(rest, float)
            rest = rest * (1.0 if rest @ values[0] >= 0 else -1.0)
        still = bool(np.all(np.abs(values - values[0]) <= SAME)) and not whole
        if still and np.all(np.abs(values[0] - rest) <= SAME):
            return
        if still and self._one is None:
            self._one = self._builder.add_accessor([0.0], bounds=True)
        times = self._one if still else self._all
        output = self._builder.add_accessor(values[:1] if still else values)
        self._animation["samplers"].append({"input": times, "output": output, "interpolation": "LINEAR"})
        target = {"node": node, "path": path}
        self._animation["channels"].append(
            {"sampler": len(self._animation["samplers"]) - 1, "target": target}
        )

    def finish(self) -> None:
        """Put the animation into the file."""
        self._builder.add("animations", self._animation)


def _continuous(rotations: Array) -> Array:
    """The same rotations (F, 4), each in the half of the quaternions in which the one before it is."""
    dots = np.sum(rotations[1:] * rotations[:-1], axis=1)
    signs = np.cumprod(np.concatenate([[1.0], np.where(dots < 0, -1.0, 1.0)]))
    return np.asarray(rotations * signs[:, None])
