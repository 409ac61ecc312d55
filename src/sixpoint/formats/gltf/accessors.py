"""Accessors to arrays: component types, strides, normalised integers.

Reference: Khronos, glTF 2.0 specification, sections 3.6.2 (accessors) and 3.11 (normalised integers).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.formats.gltf.document import COMPRESSIONS, Document
from sixpoint.formats.gltf.schema import COMPONENTS, WIDTHS

Array = NDArray[np.float64]
Index = NDArray[np.int64]

MOST_ZEROS = 10_000_000
"""Elements of an accessor without data, which the specification fills with zeros."""


def read_floats(document: Document, index: int, kind: str, what: str) -> Array:
    """Numbers of an accessor, shape (count, width), float64; normalised integers become 0..1 or -1..1.

    Args:
        document: The file.
        index: The accessor.
        kind: Its required type, e.g. "VEC3".
        what: What it is for, for messages.

    Raises:
        FormatError: It has another type, reaches beyond its buffer, is not finite or not supported.
    """
    raw = _read(document, index, kind, what)
    values = raw.astype(np.float64)
    if document.items("accessors")[index].get("normalized") and raw.dtype.kind in "iu":
        values /= 2 ** (8 * raw.dtype.itemsize - (raw.dtype.kind == "i")) - 1
        if raw.dtype.kind == "i":
            np.maximum(values, -1.0, out=values)
    if not np.isfinite(values).all():
        row = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
        raise document.error(f"accessors[{index}] ({what}): element {row} is not finite (NaN or infinite)")
    return values


def read_indices(document: Document, index: int, kind: str, what: str) -> Index:
    """Unsigned integers of an accessor, shape (count, width), int64."""
    raw = _read(document, index, kind, what)
    if raw.dtype.kind != "u":
        raise document.error(f"accessors[{index}] ({what}) must hold unsigned integers, not {raw.dtype.name}")
    return raw.astype(np.int64)


def _read(document: Document, index: int, kind: str, what: str) -> NDArray[np.generic]:
    """A view (count, width) of an accessor in its buffer."""
    accessor = document.items("accessors")[index]
    where = f"accessors[{index}] ({what})"
    if accessor["type"] != kind:
        raise document.error(f"{where} must be {kind}, it is {accessor['type']}")
    if "sparse" in accessor:
        raise document.error(f"{where} is sparse: not supported; export without sparse accessors")
    dtype = np.dtype("<" + COMPONENTS[accessor["componentType"]])
    count, width = accessor["count"], WIDTHS[kind]
    if "bufferView" not in accessor:
        if count > MOST_ZEROS:
            raise document.error(f"{where} has no data for its {count} elements")
        return np.zeros((count, width), dtype)
    view = document.items("bufferViews")[accessor["bufferView"]]
    for name in view.get("extensions", {}):
        if name in COMPRESSIONS:
            raise document.error(f"{where}: {COMPRESSIONS[name]}: not supported; export without compression")
    data = document.buffer(view["buffer"])
    size = dtype.itemsize * width
    stride = view.get("byteStride", size)
    start = view.get("byteOffset", 0)
    end = start + view["byteLength"]
    first = start + accessor.get("byteOffset", 0)
    if end > len(data):
        raise document.error(
            f"bufferViews[{accessor['bufferView']}] reaches to byte {end} of buffers[{view['buffer']}], "
            f"which has {len(data)}"
        )
    if stride < size or first + stride * (count - 1) + size > end:
        raise document.error(
            f"{where} reaches beyond bufferViews[{accessor['bufferView']}]: {count} elements of {size} bytes"
        )
    return np.ndarray((count, width), dtype, data, first, (stride, dtype.itemsize))
