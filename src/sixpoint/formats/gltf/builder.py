"""A glTF file being made: objects are added to its arrays, numbers to its buffer; then it is one GLB.

Reference: Khronos, glTF 2.0 specification, sections 3.6.2.4 (alignment) and 4 (GLB file format).
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sixpoint.formats.gltf.document import BIN_CHUNK, JSON_CHUNK, MAGIC
from sixpoint.formats.gltf.schema import COMPONENTS, WIDTHS

GENERATOR = "sixpoint"
VERTICES, INDICES = 34962, 34963
"""Targets of buffer views: vertex attributes and indices."""

_CODES = {np.dtype("<" + name): code for code, name in COMPONENTS.items()}
_TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Builder:
    """A document and its one buffer.

    Attributes:
        content: The JSON so far.
    """

    def __init__(self, content: dict[str, Any] | None = None) -> None:
        self.content = {} if content is None else content
        self.content["asset"] = {"version": "2.0", "generator": GENERATOR} | {
            key: value
            for key, value in self.content.get("asset", {}).items()
            if key not in ("version", "generator")
        }
        self._parts: list[bytes | memoryview] = []
        self._size = 0

    def add(self, kind: str, item: dict[str, Any]) -> int:
        """Append an object to a top-level array; its index."""
        items: list[dict[str, Any]] = self.content.setdefault(kind, [])
        items.append(item)
        return len(items) - 1

    def add_view(self, data: bytes | memoryview, target: int | None = None, **more: Any) -> int:
        """Append bytes to the buffer, aligned to four; the index of their buffer view."""
        view = {"buffer": 0, "byteOffset": self._size, "byteLength": len(data)} | more
        if target is not None:
            view["target"] = target
        for part in (data, b"\0" * (-len(data) % 4)):
            self._parts.append(part)
            self._size += len(part)
        return self.add("bufferViews", view)

    def add_accessor(
        self, values: ArrayLike, dtype: str = "<f4", *, target: int | None = None, bounds: bool = False
    ) -> int:
        """Store numbers (n,) or (n, 3, 4 or 16); the index of their accessor.

        Args:
            values: The numbers.
            dtype: Component type; rows must be multiples of four bytes for vertices.
            target: What a viewer uses them for.
            bounds: Also write the least and greatest, which positions and key times must have.
        """
        array: NDArray[Any] = np.ascontiguousarray(np.asarray(values).astype(dtype))
        flat = array.reshape(len(array), -1)
        accessor = {
            "bufferView": self.add_view(array.tobytes(), target),
            "componentType": _CODES[array.dtype],
            "count": len(array),
            "type": _TYPES[flat.shape[1]],
        }
        if bounds:
            accessor |= {"min": flat.min(axis=0).tolist(), "max": flat.max(axis=0).tolist()}
        assert WIDTHS[str(accessor["type"])] == flat.shape[1]
        return self.add("accessors", accessor)

    def to_glb(self) -> bytes:
        """The whole file."""
        self.content.pop("buffers", None)
        if self._size:
            self.content["buffers"] = [{"byteLength": self._size}]
        text = json.dumps(self.content, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        chunks: list[bytes | memoryview] = [struct.pack("<II", len(text), JSON_CHUNK), text]
        if self._size:
            chunks += [struct.pack("<II", self._size, BIN_CHUNK), *self._parts]
        length = 12 + sum(map(len, chunks))
        return b"".join([struct.pack("<4sII", MAGIC, 2, length), *chunks])
