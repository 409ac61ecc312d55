"""The movement in a glTF file: an animation sampled at a constant rate.

The rate is that of the keys where they lie on an even grid (what motion capture and most exporters write),
else 60 Hz. LINEAR, STEP and CUBICSPLINE keys are evaluated as the specification says.

Reference: Khronos, glTF 2.0 specification, section 3.11 and appendix C (interpolation).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.formats.gltf.accessors import read_floats
from sixpoint.formats.gltf.document import Document

Array = NDArray[np.float64]

DEFAULT_RATE = 60.0
"""Frames per second [Hz] where the keys lie on no even grid."""
FASTEST = 1000.0
MOST_FRAMES = 1_000_000
MOST_NUMBERS = 200_000_000
OFF_GRID = 0.02  # of a frame: keys nearer to the grid than this lie on it
TYPES = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3"}


@dataclass(frozen=True, eq=False)
class Channel:
    """The keys of one property of one node.

    Attributes:
        node: The node.
        path: "translation", "rotation" or "scale".
        times: (n,) [s].
        values: (n, 3) or (n, 4); with tangents (n, 3, 3) or (n, 3, 4) for CUBICSPLINE.
        interpolation: "LINEAR", "STEP" or "CUBICSPLINE".
    """

    node: int
    path: str
    times: Array
    values: Array
    interpolation: str

    def sample(self, times: Array) -> Array:
        """Values (F, 3) or (F, 4) at times (F,) [s]; before the first and after the last key these hold."""
        cubic = self.interpolation == "CUBICSPLINE"
        keys = self.values[:, 1] if cubic else self.values
        k = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(keys) - 1)
        after = np.minimum(k + 1, len(keys) - 1)
        span = self.times[after] - self.times[k]
        u = np.where(span > 0, (times - self.times[k]) / np.where(span > 0, span, 1.0), 0.0)
        u = np.clip(u, 0.0, 1.0)[:, None]
        turned = self.path == "rotation"
        if self.interpolation == "STEP":
            out = keys[k]
        elif cubic:
            span = span[:, None]
            leave, arrive = span * self.values[k, 2], span * self.values[after, 0]
            h = 2 * u**3 - 3 * u**2 + 1, u**3 - 2 * u**2 + u, -2 * u**3 + 3 * u**2, u**3 - u**2
            out = h[0] * keys[k] + h[1] * leave + h[2] * keys[after] + h[3] * arrive
        elif turned:
            out = slerp(keys[k], keys[after], u)
        else:
            out = keys[k] + u * (keys[after] - keys[k])
        return rot.normalised(out) if turned else np.asarray(out)


def slerp(a: Array, b: Array, u: Array) -> Array:
    """Spherical interpolation of unit quaternions (..., 4) along the shorter way, u (..., 1) in 0..1."""
    dot = np.sum(a * b, axis=-1, keepdims=True)
    b, dot = np.where(dot < 0, -b, b), np.minimum(np.abs(dot), 1.0)
    angle = np.arccos(dot)
    sine = np.sin(angle)
    near = sine < 1e-6
    sine = np.where(near, 1.0, sine)
    wa = np.where(near, 1.0 - u, np.sin((1.0 - u) * angle) / sine)
    wb = np.where(near, u, np.sin(u * angle) / sine)
    return np.asarray(wa * a + wb * b)


def read_channels(document: Document, index: int) -> list[Channel]:
    """The channels of an animation that move nodes.

    Raises:
        FormatError: Keys are missing, not finite or not in order.
    """
    animation = document.items("animations")[index]
    label = document.label("animations", index)
    channels = []
    for c, entry in enumerate(animation["channels"]):
        path, node = entry["target"]["path"], entry["target"].get("node")
        if path not in TYPES or node is None:
            continue  # weights of morph targets, pointers of extensions
        sampler = animation["samplers"][entry["sampler"]]
        what = f"{path} of {document.label('nodes', node)} in {label}"
        times = read_floats(document, sampler["input"], "SCALAR", f"key times of {what}")[:, 0]
        values = read_floats(document, sampler["output"], TYPES[path], what)
        interpolation = sampler.get("interpolation", "LINEAR")
        cubic = interpolation == "CUBICSPLINE"
        if np.any(np.diff(times) < 0):
            raise document.error(
                f"accessors[{sampler['input']}] (key times of {what}) must not go back in time"
            )
        if len(values) != len(times) * (3 if cubic else 1):
            raise document.error(
                f"{label}, channel {c} ({what}): {len(values)} values for {len(times)} keys"
                + (", CUBICSPLINE needs three for each" if cubic else "")
            )
        if cubic:
            values = values.reshape(len(times), 3, -1)
        elif path == "rotation":
            values = rot.normalised(values)
        channels.append(Channel(node, path, times, values, interpolation))
    return channels


def find_grid(
    document: Document, channels: list[Channel], rate: float | None, joints: int
) -> tuple[Array, float]:
    """Times (F,) [s] to sample at and the rate [Hz].

    Args:
        document: For messages.
        channels: The keys; not empty.
        rate: The rate asked for; by default that of the keys.
        joints: How many joints will be sampled.

    Raises:
        FormatError: There would be too many frames.
    """
    keys = np.unique(np.concatenate([c.times for c in channels]))
    start, length = keys[0], keys[-1] - keys[0]
    found = _even_rate(keys)
    even = found is not None and rate in (None, found)
    rate = rate or found or DEFAULT_RATE
    frames = length * rate + 1
    if not frames <= MOST_FRAMES or frames * joints * 4 > MOST_NUMBERS:
        raise document.error(f"the animation is {length:g} s long: {frames:.0f} frames are too many")
    times = start + np.arange(round(length * rate) + 1 if even else int(length * rate + 1e-6) + 1) / rate
    nearest = keys[np.clip(np.searchsorted(keys, times - 0.5 / rate), 0, len(keys) - 1)]
    on_key = np.abs(nearest - times) < OFF_GRID / rate  # times are single precision: meet the keys themselves
    return np.where(on_key, nearest, times), rate


def _even_rate(keys: Array) -> float | None:
    """Frames per second of keys on an even grid; None where they lie on none."""
    if len(keys) < 2:
        return None
    step = float(np.median(np.diff(keys)))
    length = float(keys[-1] - keys[0])
    count = round(length / step)
    if not 1 <= count <= MOST_FRAMES:
        return None
    place = (keys - keys[0]) * (count / length)
    rate = count / length
    if np.abs(place - np.round(place)).max() > OFF_GRID or not 1.0 / FASTEST < rate <= FASTEST:
        return None
    whole = max(round(rate), 1)
    return float(whole) if abs(rate - whole) < 1e-4 * rate else rate


def warn_of_scales(document: Document, channels: list[Channel], scales: Array) -> None:
    """Say it where an animation changes the scale of a joint: a Motion cannot hold that."""
    moving = {
        c.node
        for c in channels
        if c.path == "scale"
        and np.any(
            np.abs((c.values[:, 1] if c.interpolation == "CUBICSPLINE" else c.values) - scales[c.node]) > 0.01
        )
    }
    if moving:
        first = document.label("nodes", min(moving))
        warnings.warn(
            f"{document.path}: the animation scales {len(moving)} nodes, such as {first}: left out",
            stacklevel=5,
        )
